"""ALOHA, pure and slotted: Poisson instants, and the closed forms of who is heard."""

import math
from math import exp, log
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds import merged, scenario, still

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


def packets(count: int, every_s: float, lasts: float, seed: int) -> list[np.ndarray]:
    """Return when (s) each AUV has something to send: it pings then, were its pings nothing."""
    plan = crowd(count, "aloha", every_s, count * lasts / every_s)
    data = merged(plan.model_dump(mode="json"), {"acoustics": {"hf": {"ping_s": 1e-6}}})
    full = merged(data, {"record": {"detail": "full", "tracks_hz": 0.01}})
    pings = simulate(Scenario.model_validate(full), seed).tables["pings"]
    return [pings.sent_at_s[pings.auv == f"AUV{auv}"].to_numpy() for auv in range(count)]


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
    found = share_heard(simulate(crowd(count, "aloha", every_s, pings), 1))
    load = count * PING_S / every_s
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


def test_instants_are_poisson() -> None:
    """Intervals have the mean asked for, are as scattered as it, and know nothing of each other."""
    found = packets(3, 2.5, 6_000.0, 5)
    gaps = np.array([np.diff(own, prepend=0.0)[:2_200] for own in found])
    assert gaps.mean() == pytest.approx(2.5, rel=4 / math.sqrt(gaps.size))
    assert gaps.std() == pytest.approx(2.5, rel=8 / math.sqrt(gaps.size))
    assert np.abs(np.corrcoef(gaps) - np.eye(3)).max() < 4 / math.sqrt(2_200)
    assert abs(np.corrcoef(gaps[0, 1:], gaps[0, :-1])[0, 1]) < 4 / math.sqrt(2_200)


def test_a_further_auv_leaves_the_instants_of_others() -> None:
    """Streams are of one AUV each, and a longer interval stretches the same instants."""
    few, many = packets(2, 1.0, 100.0, 5), packets(3, 2.0, 200.0, 5)
    for auv in range(2):
        assert 2.0 * few[auv] == pytest.approx(many[auv], rel=1e-12)
    assert packets(2, 1.0, 9.0, 6)[0][0] != few[0][0]


@given(st.integers(0, 2**16), st.integers(1, 6), st.floats(0.001, 2.0))
@settings(max_examples=10, deadline=None)
def test_pure_aloha_is_the_instants_but_own_overlaps(seed: int, auvs: int, ping_s: float) -> None:
    """An AUV's own pings never overlap, and others are not asked."""
    plan = still(
        auvs, duration_s=30.0, acoustics={"hf": {"ping_s": ping_s}},
        protocol={"schedule": "aloha", "frame_s": 1.0, "tick_rate_hz": None},
    )  # fmt: skip
    pings = simulate(plan, seed).tables["pings"]
    for auv, own in enumerate(packets(auvs, 1.0, 30.0, seed)):
        kept: list[float] = []
        for instant in own:
            if not kept or instant >= kept[-1] + ping_s:
                kept.append(instant)
        assert pings.sent_at_s[pings.auv == f"AUV{auv}"].tolist() == kept


@given(st.integers(0, 2**16), st.integers(1, 6), st.floats(0.05, 1.5), st.booleans())
@settings(max_examples=10, deadline=None)
def test_slotted_aloha_puts_instants_on_the_next_slot(
    seed: int, auvs: int, slot_s: float, ticks: bool
) -> None:
    """Each slot's instants are one ping of their AUV at the start of the next slot of the clock."""
    plan = still(
        auvs, duration_s=30.0,
        protocol={
            "schedule": "slotted_aloha", "frame_s": 1.0, "shortest_uplink_slot_s": slot_s,
            "tick_rate_hz": 30.0 if ticks else None,
        },
    )  # fmt: skip
    slots, pings = Setup(plan).slots, simulate(plan, seed).tables["pings"]
    length = slots.clock.after(0.0, slots.uplink_slot)
    for auv, own in enumerate(packets(auvs, 1.0, 30.0, seed)):
        sent = pings.sent_at_s[pings.auv == f"AUV{auv}"].to_numpy()
        numbers = np.round(sent / length)
        assert sent == pytest.approx(numbers * length, abs=1e-9)
        due = np.unique(np.ceil(own / length))
        assert numbers.tolist() == due[due * length < 30.0 - 1e-9].tolist()


def test_no_downlink_interrupts_pings() -> None:
    """Pings go on as frames are on the air, at the very instants of their own streams."""
    plan = scenario(duration_s=40.0, protocol={"schedule": "aloha", "frame_s": 0.7})
    result = simulate(plan, 3)
    pings, frames = result.tables["pings"], result.tables["broadcasts"]
    for auv, meant in enumerate(packets(plan.auvs.count, 0.7, 40.0, 3)):
        sent = pings.sent_at_s[pings.auv == f"AUV{auv}"].to_numpy()
        assert set(sent) <= set(meant)
        assert len(sent) > 0.95 * len(meant)
    during = [
        ((pings.sent_at_s > it.sent_at_s) & (pings.sent_at_s < it.sent_at_s + it.airtime_s)).any()
        for it in frames.itertuples()
    ]
    assert np.mean(during) > 0.5
