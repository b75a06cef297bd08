"""ALOHA, pure and slotted: Poisson instants, and the closed forms of who is heard."""

from itertools import takewhile
from math import exp, log
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds import merged, packets_of, scenario, still

from bindusbl_des import Result, Scenario, Setup, simulate

PING_S = 0.010


def crowd(count: int, schedule: str, every_s: float, pings: float, **changes: Any) -> Scenario:
    """AUVs that one ASV hears all of, from one place, until there are about so many pings."""
    base = {
        "duration_s": pings * every_s / count,
        "protocol": {"schedule": schedule, "frame_s": every_s, "tick_rate_hz": None},
        "navigation": {"imu_rate_hz": 0.1},
        "record": {"detail": "summary", "metrics_hz": 0.01},
    }
    return still(count, **merged(base, changes))


def share_heard(result: Result) -> float:
    """Return the share of all pings in range that are heard."""
    auvs = result.tables["auvs"]
    return float(auvs.pings_heard.sum() / auvs.pings_in_range.sum())


# The standard error of a share p of n pings is sqrt(p (1 - p) / n), below 0.25 % of p in all of
# these; pings that collide do so in twos, which makes it larger by 1.4 at most.
@pytest.mark.parametrize(
    ("count", "every_s", "pings"),
    [
        (10, 1.0, 40_000),
        (3, 0.2, 40_000),
        pytest.param(20, 0.4, 240_000, marks=pytest.mark.slow),
        pytest.param(50, 0.5, 600_000, marks=pytest.mark.slow),
    ],
)
def test_pure_aloha_meets_its_closed_form(count: int, every_s: float, pings: float) -> None:
    """e^(-2 G (N - 1) / N) within 1 %, G = N T / F the load that AUVs offer (Abramson)."""
    load = count * PING_S / every_s
    found = share_heard(simulate(crowd(count, "aloha", every_s, pings), 1))
    assert found == pytest.approx(exp(-2.0 * load * (count - 1) / count), rel=0.01)


@pytest.mark.parametrize(
    ("count", "every_s", "pings"),
    [(5, 0.1, 60_000), pytest.param(10, 0.05, 600_000, marks=pytest.mark.slow)],
)
def test_what_an_auv_leaves_out_is_counted(count: int, every_s: float, pings: float) -> None:
    """Where AUVs hardly ever pause, instants that fall into their own pings are fewer: exactly."""
    own = PING_S / every_s
    found = share_heard(simulate(crowd(count, "aloha", every_s, pings), 1))
    exact = (exp(-own) / (1.0 + own)) ** (count - 1)
    assert found == pytest.approx(exact, rel=0.01)
    textbook = exp(-2.0 * own * (count - 1))
    assert log(exact / textbook) == pytest.approx((count - 1) * own**2 / 2, rel=0.15)


@pytest.mark.parametrize(
    ("count", "every_s", "pings"),
    [
        (10, 2.0, 40_000),
        pytest.param(5, 0.3, 200_000, marks=pytest.mark.slow),
        pytest.param(30, 3.0, 400_000, marks=pytest.mark.slow),
    ],
)
def test_slotted_aloha_meets_its_closed_form(count: int, every_s: float, pings: float) -> None:
    """e^(-G (N - 1) / N) within 1 %, G = N T / F with slots of length T (Roberts)."""
    plan = crowd(count, "slotted_aloha", every_s, pings)
    slot = Setup(plan).slots.uplink_slot
    result = simulate(plan, 1)
    load = count * slot / every_s
    assert share_heard(result) == pytest.approx(exp(-load * (count - 1) / count), rel=0.01)
    slots = plan.duration_s / slot
    sent = result.tables["auvs"].pings.sum() / (count * slots)
    assert sent == pytest.approx(1.0 - exp(-slot / every_s), rel=0.01)


def test_two_of_a_slot_are_heard_where_their_ways_differ_by_more_than_a_ping() -> None:
    """Two AUVs 4 and 30 m away, 17 ms apart by sound, lose nothing, though they share slots."""
    places = {"route": {"kind": "hold", "positions_m": [[4.0, 0.0], [30.0, 0.0]]}}
    plan = crowd(2, "slotted_aloha", 0.2, 2_000, auvs=places)
    assert exp(-Setup(plan).slots.uplink_slot / 0.2) < 0.7
    assert share_heard(simulate(plan, 1)) == 1.0


def sending(count: int, every_s: float, access: str = "aloha", **changes: Any) -> Scenario:
    """AUVs that have something to send at mean intervals, for 20 of these."""
    base = {"duration_s": 20.0 * every_s, "protocol": {"access": access, "frame_s": every_s}}
    return still(count, **merged(base, changes))


def test_instants_are_poisson() -> None:
    """Intervals have the mean asked for, are as scattered as it, and know nothing of each other."""
    found = np.array(packets_of(sending(3, 2.5), 5, 20_000))
    gaps = np.diff(found, axis=1, prepend=0.0)
    assert gaps.mean(axis=1) == pytest.approx(2.5, rel=0.03)
    assert gaps.std(axis=1) == pytest.approx(2.5, rel=0.04)
    assert np.abs(np.corrcoef(gaps) - np.eye(3)).max() < 0.03
    assert abs(np.corrcoef(gaps[0, 1:], gaps[0, :-1])[0, 1]) < 0.03


def test_a_further_auv_leaves_the_instants_of_others() -> None:
    """Streams are of one AUV each, and a longer interval stretches the same instants."""
    few, many = packets_of(sending(2, 1.0), 5, 200), packets_of(sending(3, 2.0), 5, 200)
    for auv in range(2):
        assert 2.0 * np.array(few[auv]) == pytest.approx(np.array(many[auv]), rel=1e-12)
    assert packets_of(sending(2, 1.0), 6, 1) != packets_of(sending(2, 1.0), 5, 1)


@given(st.integers(0, 2**32), st.integers(1, 6), st.floats(0.001, 2.0))
@settings(max_examples=15, deadline=None)
def test_pure_aloha_is_all_instants_but_own_overlaps(seed: int, auvs: int, ping_s: float) -> None:
    """An AUV's own pings never overlap; others are not asked."""
    plan = sending(auvs, 1.0, acoustics={"hf": {"ping_s": ping_s}})
    pings = simulate(plan, seed).tables["pings"]
    assert pings.sent_at_s.is_monotonic_increasing
    for auv, own in enumerate(packets_of(plan, seed, 100)):
        kept: list[float] = []
        for instant in takewhile(lambda it: it < 20.0, own):
            if not kept or instant >= kept[-1] + ping_s:
                kept.append(instant)
        sent = pings.sent_at_s[pings.auv == f"AUV{auv}"]
        assert sent.to_numpy() == pytest.approx(np.array(kept), abs=1e-12)


@given(st.integers(0, 2**32), st.integers(1, 6), st.floats(0.02, 3.0), st.booleans())
@settings(max_examples=15, deadline=None)
def test_slotted_aloha_puts_instants_on_the_next_slot(
    seed: int, auvs: int, slot_s: float, ticks: bool
) -> None:
    """Each slot's instants are one ping of their AUV at the start of the next slot of the clock."""
    changes = {"tick_rate_hz": 30.0 if ticks else None, "shortest_uplink_slot_s": slot_s}
    plan = sending(auvs, 1.0, "slotted_aloha", protocol=changes)
    slots = Setup(plan).slots
    length = slots.clock.after(0.0, slots.uplink_slot)
    pings = simulate(plan, seed).tables["pings"]
    for auv, own in enumerate(packets_of(plan, seed, 100)):
        numbers = sorted({int(np.ceil(it / length)) for it in own})
        starts = [number * length for number in numbers if number * length < 20.0 - 1e-9]
        sent = pings.sent_at_s[pings.auv == f"AUV{auv}"].to_numpy()
        assert sent[: len(starts)] == pytest.approx(np.array(starts), abs=1e-9)
        assert len(sent) <= len(starts) + 1


def test_no_downlink_interrupts_pings() -> None:
    """Pings go on as frames are on the air, at the very instants of their own streams."""
    plan = scenario(duration_s=40.0, protocol={"schedule": "aloha", "frame_s": 0.7})
    result = simulate(plan, 3)
    pings, frames = result.tables["pings"], result.tables["broadcasts"]
    for auv, own in enumerate(packets_of(plan, 3, 200)):
        sent = pings.sent_at_s[pings.auv == f"AUV{auv}"].to_numpy()
        meant = np.array(list(takewhile(lambda it: it < 40.0, own)))
        assert set(sent) <= set(meant)
        assert len(sent) > 0.95 * len(meant)
    during = [
        ((pings.sent_at_s > it.sent_at_s) & (pings.sent_at_s < it.sent_at_s + it.airtime_s)).any()
        for it in frames.itertuples()
    ]
    assert np.mean(during) > 0.5
