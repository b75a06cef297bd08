"""Packed arrivals: pings set out so that they come in one behind the other."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from worlds import merged, scenario, still

from bindusbl_des import Scenario, Setup, simulate, travel_time, warnings_of
from bindusbl_des.models.schedules.departures import departures

PLACES = [[20.0, 0.0], [-36.0, 0.0], [0.0, 45.0]]
PING, SOUND, CLEAR = 0.01, 1500.0, 0.02


def packed(places: Any = PLACES, **changes: Any) -> Scenario:
    """Return AUVs that hold still around one ASV, their arrivals packed, on the exact clock."""
    base = {
        "duration_s": 20.0,
        "auvs": {"route": {"positions_m": places}},
        "protocol": {"schedule": "super_tdma", "tick_rate_hz": None},
    }
    return still(len(places), **merged(base, changes))


def test_arrivals_follow_each_other_by_a_ping_and_the_pause() -> None:
    """By hand: ways of 14.9, 24.9 and 30.7 ms; the farthest sets out at 0, comes in at 30.7 ms, the
    others 30 ms later each, and the round's uplink ends a ping and a pause after the last.
    """
    result = simulate(packed())
    ways = np.hypot(np.linalg.norm(PLACES, axis=1), 10.0) / SOUND
    pings, met = result.tables["pings"], result.tables["receptions"]
    sent = pings[pings["round"] == 0].set_index("auv").sent_at_s
    comes = ways[2] + np.array([2, 1, 0]) * (PING + CLEAR)
    assert sent[["AUV0", "AUV1", "AUV2"]].to_numpy() == pytest.approx(comes - ways, abs=1e-12)
    arrived = np.sort(met.arrived_at_s[met.ping < 3])
    assert np.diff(arrived) == pytest.approx(PING + CLEAR, abs=1e-12)
    assert result.tables["rounds"].uplink_s[0] == pytest.approx(comes[0] + PING + CLEAR)
    assert set(met.outcome) <= {"heard", "in_flight"}


def test_two_asvs_and_an_auv_that_both_hear() -> None:
    """AUV1 is heard by both: it keeps clear of AUV0 at the one, of AUV2 at the other, which in turn
    need not mind each other and set out together.
    """
    stations = {"positions_m": [[0.0, 0.0], [80.0, 0.0]]}
    places = [[-30.0, 0.0], [40.0, 0.0], [110.0, 0.0]]
    result = simulate(packed(places, asvs={"count": 2, "formation": stations}))
    pings = result.tables["pings"]
    sent = pings[pings["round"] == 0].set_index("auv").sent_at_s
    near, far = np.hypot(30.0, 10.0) / SOUND, np.hypot(40.0, 10.0) / SOUND
    assert sent["AUV1"] == 0.0
    assert sent["AUV0"] == sent["AUV2"] == pytest.approx(far + PING + CLEAR - near, abs=1e-12)
    assert result.tables["rounds"].colours[0] == 2


def test_departures_fall_on_ticks_and_arrivals_keep_their_distance() -> None:
    """At 30 Hz a spacing of 30 ms needs a tick; rounding never brings two arrivals nearer."""
    result = simulate(packed(protocol={"tick_rate_hz": 30.0}))
    ticks = result.tables["pings"].sent_at_s * 30.0
    assert ticks.to_numpy() == pytest.approx(ticks.round().to_numpy(), abs=1e-6)
    met = result.tables["receptions"]
    assert np.diff(np.sort(met.arrived_at_s)).min() >= PING + CLEAR - 1e-9


COORDINATE = st.floats(-60.0, 60.0)
SPOTS = st.tuples(COORDINATE, COORDINATE)


@settings(max_examples=150, deadline=None)
@given(
    auvs=st.lists(SPOTS, min_size=1, max_size=9),
    asvs=st.lists(SPOTS, min_size=1, max_size=4),
    moves=st.floats(0.0, 2.0),
    tick_rate=st.sampled_from([0.0, 7.0, 30.0, 1000.0]),
    lasts=st.sampled_from([0.01, 0.03]),
    reach=st.sampled_from([30.0, 50.0, 100.0]),
    turn=st.floats(0.0, 6.0),
)
def test_no_two_arrivals_overlap(
    auvs: Any, asvs: Any, moves: float, tick_rate: float, lasts: float, reach: float, turn: float
) -> None:
    """By the exact light-time of AUVs that are where they are believed, and of ASVs that are moved
    on: wherever one hears two, the second comes in when the first has lasted as long as it should.
    """
    here = np.array([(*spot, 10.0) for spot in auvs])
    there = np.array([(*spot, 0.0) for spot in asvs])
    ways = np.linalg.norm(here[:, None] - there[None], axis=2) / SOUND
    heard = ways * SOUND <= reach
    rates = np.full(len(auvs), moves / SOUND)
    # what the light-time of a moving ASV adds to the way: its own move in that time
    blurs = np.full(len(auvs), 2.0 * moves / SOUND * ways.max())
    departs = departures(ways, heard, blurs, rates, lasts, tick_rate)
    assert departs.min() == 0.0
    if tick_rate:
        assert departs * tick_rate == pytest.approx((departs * tick_rate).round(), abs=1e-6)
    step = moves * np.array([np.cos(turn), np.sin(turn), 0.0])
    for asv in range(len(asvs)):

        def at(time: float, asv: int = asv) -> np.ndarray:
            return np.append(there[asv] + step * time, 0.0)

        comes = np.sort([
            departs[auv] + travel_time(np.append(here[auv], 0.0), at, float(departs[auv]), SOUND)
            for auv in np.flatnonzero(heard[:, asv])
        ])  # fmt: skip
        assert (np.diff(comes) >= lasts - 2e-9).all()


def test_blurs_and_rates_widen_gaps() -> None:
    """Two at one distance: 30 ms, 1 and 2 ms of doubt, and the second grows by a hundredth."""
    ways, heard = np.full((2, 1), 0.03), np.full((2, 1), True)
    found = departures(ways, heard, np.array([1e-3, 2e-3]), np.array([0.0, 0.01]), 0.03)
    assert found.tolist() == pytest.approx([0.0, 0.033 / 0.99])


@pytest.mark.parametrize("positions", ["truth", "last_fix", "carried_forward"])
def test_moving_auvs_do_not_collide(positions: str) -> None:
    """Six AUVs at 2 m/s among three ASVs: no ping that was believed in range meets another."""
    world = scenario(
        duration_s=120.0, survey={"side_m": 60.0}, asvs={"count": 3},
        auvs={"count": 6, "speed_m_per_s": 2.0,
              "vehicle": {"model": "kinematic", "turning_radius_m": 2.0},
              "route": {"lane_spacing_m": 4.0}},
        acoustics={"loss": {"law": "none"}, "hf": {"range_m": 80.0}},
        protocol={"schedule": "super_tdma", "positions": positions},
    )  # fmt: skip
    result, again = simulate(world, 1), simulate(world, 1)
    outcomes = result.tables["receptions"].outcome
    assert "collided" not in set(outcomes)
    assert (outcomes == "heard").sum() > 800
    assert again.tables["pings"].equals(result.tables["pings"])
    gaps = []
    for _, met in result.tables["receptions"].query("outcome == 'heard'").groupby("asv"):
        gaps.append(np.diff(np.sort(met.arrived_at_s)).min() - PING)
    # of plans that are carried on, 2 standard deviations are no bound: most of the pause is left
    assert min(gaps) >= CLEAR - (1e-3 if positions == "carried_forward" else 1e-9)
    if positions == "truth":
        assert min(gaps) < CLEAR + 0.01  # what ways of a round's length can add


def test_the_uplink_is_shorter_than_slots_and_no_shorter_than_its_bound() -> None:
    """N T_UL above, N (T_P + T_clear) below (B1), for 1 to 12 AUVs around one ASV."""
    for count in (1, 3, 6, 12):
        spots = [[40.0 * np.cos(k), 40.0 * np.sin(k)] for k in range(count)]
        world = packed(spots, duration_s=5.0)
        uplink = simulate(world).tables["rounds"].uplink_s[0]
        assert uplink < count * Setup(world).slots.uplink_slot
        assert uplink >= count * (PING + CLEAR)


def test_an_auv_that_nobody_hears_pings_at_once() -> None:
    """It takes no time from the others, and the round waits for it as for the longest way."""
    result = simulate(packed([[300.0, 0.0]]))
    assert result.tables["rounds"].uplink_s[0] == pytest.approx(
        PING + CLEAR + np.hypot(50.0, 10.0) / SOUND
    )


@pytest.mark.parametrize(
    ("protocol", "told"),
    [
        ({"ranging": "twtt"}, "protocol.ranging.*on their own clocks.*use owtt_sync"),
        ({"downlink": "pipelined_group"}, "protocol.downlink.*packs the pings of a whole round"),
    ],
)
def test_what_packing_does_not_go_with_is_refused(protocol: Any, told: str) -> None:
    with pytest.raises(ValidationError, match=f"(?s){told}"):
        packed(protocol=protocol)


def test_guards_of_slots_are_idle_where_there_are_no_slots() -> None:
    keys = {"uplink_guard_s": 0.1, "shortest_uplink_slot_s": 0.1}
    told = {it.key for it in warnings_of(packed(protocol=keys))}
    assert {f"protocol.{name}" for name in keys} <= told
    slotted = warnings_of(packed(protocol={**keys, "schedule": "dsatur"}))
    assert not any(it.key.startswith("protocol.") for it in slotted)
