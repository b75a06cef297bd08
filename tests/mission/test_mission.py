"""A mission that is held: advanced to any instants and looked at, it is the same mission."""

import re
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from worlds import merged, scenario

from bindusbl_des import Mission, Result, Scenario, View, simulate

DURATION_S, RATE_HZ = 20.0, 30

# On a clock of ticks, so that deliveries, calls and looks fall on the same instants.
ON_TICKS = {
    "duration_s": DURATION_S,
    "survey": {"side_m": 80.0},
    "auvs": {"count": 4},
    "acoustics": {"mf": {"range_m": 70.0}},
    "protocol": {"tick_rate_hz": RATE_HZ},
    "record": {"tracks_hz": float(RATE_HZ)},
}
STEERING = {
    "auvs": {"vehicle": "bluerov2", "feedback": "estimate", "speed_m_per_s": 0.5},
    "navigation": {"velocity_bias_m_per_s": [0.2, 0.1]},
}
KALMAN = {"navigation": {"filter": "kalman", "velocity_bias_sd_m_per_s": 0.1}}
MISSIONS: dict[str, list[dict[str, Any]]] = {
    "sequential": [],
    "exact_clock": [{"protocol": {"tick_rate_hz": None, "downlink": "pipelined_group"}}],
    "direct_reply": [{"protocol": {"downlink": "direct_reply"}}],
    "twtt": [KALMAN, {"protocol": {"ranging": "twtt", "downlink": "pipelined_round"}}],
    "steering": [STEERING, {"protocol": {"downlink": "pipelined_group"}}],
    "steering_twtt": [STEERING, KALMAN, {"protocol": {"ranging": "twtt"}}],
    "steering_direct": [STEERING, {"protocol": {"downlink": "direct_reply"}}],
    "steering_polling": [STEERING, {"protocol": {"schedule": "polling"}}],
    "packed_direct": [{"protocol": {"schedule": "super_tdma", "downlink": "direct_reply"}}],
    "passive": [KALMAN, {"protocol": {"ranging": "passive"}}],
    "steering_passive": [STEERING, KALMAN, {"protocol": {"ranging": "passive"}}],
}
# Of these deliveries are on no ticks.
EXACT = ("exact_clock", "passive", "steering_passive")

TICKS = st.integers(0, round(DURATION_S) * RATE_HZ).map(lambda tick: tick / RATE_HZ)
CUTS = st.lists(st.one_of(TICKS, st.floats(0.0, DURATION_S)), max_size=12).map(sorted)
FEW = settings(
    max_examples=5,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)


def flown(name: str) -> Scenario:
    changes = ON_TICKS
    for change in MISSIONS[name]:
        changes = merged(changes, change)
    return scenario(**changes)


def same(one: Result, other: Result) -> bool:
    assert set(one.arrow) == set(other.arrow)
    return all(one.arrow[name].equals(other.arrow[name]) for name in one.arrow)


def look(mission: Mission) -> list[Any]:
    """Look at all that there is to see."""
    return [*mission.auvs(), mission.asvs(), mission.pings_under_way(), mission.broadcast_on_air()]


@pytest.mark.parametrize("name", MISSIONS)
@FEW
@given(cuts=CUTS, seed=st.integers(0, 2))
def test_stopping_and_looking_change_nothing(name: str, cuts: list[float], seed: int) -> None:
    """Whenever one stops and looks, every table is bit for bit that of the mission in one go."""
    mission = Mission(flown(name), seed)
    look(mission)
    for instant in cuts:
        mission.advance(instant)
        assert mission.time == instant
        look(mission)
    assert same(mission.result(), simulate(flown(name), seed))


@pytest.mark.parametrize("name", MISSIONS)
def test_looking_at_every_tick_changes_nothing(name: str) -> None:
    """Nor does it change anything to look at each instant at which something can happen."""
    mission = Mission(flown(name), 1)
    for tick in range(round(DURATION_S) * RATE_HZ + 1):
        mission.advance(tick / RATE_HZ)
        look(mission)
    in_one_go = simulate(flown(name), 1)
    assert (in_one_go.tables["fixes"].outcome == "delivered").sum() > 5
    assert same(mission.result(), in_one_go)


@pytest.mark.parametrize("name", MISSIONS)
def test_vehicles_are_where_the_tracks_have_them(name: str) -> None:
    """What is seen at an instant is that instant's row of the tracks, bit for bit."""
    tables = simulate(flown(name), 1).tables
    tracks, fixes = tables["tracks"], tables["fixes"]
    at_ticks = fixes.delivered_at_s.dropna()
    assert name in EXACT or np.isin(at_ticks, tracks.time_s).mean() > 0.9
    mission = Mission(flown(name), 1)
    tracks = tracks.sort_values("time_s", kind="stable")
    instants = np.unique(tracks.time_s)

    def seen_at(kind: str, columns: list[str]) -> NDArray[np.float64]:
        """Return columns of all AUVs or ASVs: by instant, vehicle and column."""
        own = tracks[tracks.vehicle.str.startswith(kind)]
        return own[columns].to_numpy().reshape(len(instants), -1, len(columns))

    place = ["x_m", "y_m", "z_m", "yaw_rad"]
    auvs, asvs = seen_at("AUV", place), seen_at("ASV", place)
    estimates = seen_at("AUV", ["estimate_x_m", "estimate_y_m"])
    spreads = seen_at("AUV", ["estimate_sd_x_m", "estimate_sd_y_m"])
    together = seen_at("AUV", ["estimate_cov_xy_m2"])[..., 0]
    for n, instant in enumerate(instants):
        mission.advance(float(instant))
        seen = mission.auvs()
        assert np.array_equal(seen.truth, auvs[n])
        assert np.array_equal(mission.asvs(), asvs[n])
        assert np.array_equal(seen.estimate, estimates[n])
        variances = np.diagonal(seen.covariance, axis1=1, axis2=2)
        assert np.array_equal(np.sqrt(variances), spreads[n])
        for off in (seen.covariance[:, 0, 1], seen.covariance[:, 1, 0]):
            assert np.array_equal(off, together[n])


def number(vehicle: str) -> int:
    return int(vehicle[3:])


def soundings(result: Result) -> list[tuple[float, tuple[int, int, float]]]:
    """Return until when (s) each ping is under way by the tables; its number, AUV and instant."""
    pings, receptions = result.tables["pings"], result.tables["receptions"]
    lasts = result.scenario.acoustics.hf.ping_s
    pings = pings[pings.call.isna() | (pings.call == "heard")]
    in_range = receptions[receptions.outcome != "out_of_range"]
    passed = in_range.groupby("ping").arrived_at_s.max().reindex(pings.ping).to_numpy() + lasts
    ends = np.fmax(pings.sent_at_s + lasts, passed)
    told = zip(pings.ping, pings.auv.map(number), pings.sent_at_s, strict=True)
    return list(zip(ends, told, strict=True))


@pytest.mark.parametrize("name", ["sequential", "exact_clock", "direct_reply", "twtt", "steering"])
def test_what_is_in_the_air_is_what_the_tables_say(name: str) -> None:
    """Pings and broadcasts under way are those that the tables of the whole mission have then."""
    result = simulate(flown(name), 1)
    broadcasts = list(result.tables["broadcasts"].itertuples())
    pinged = soundings(result)
    mission = Mission(flown(name), 1)
    together, sent = 0, 0
    for instant in np.arange(0.0, DURATION_S - 1.0, 0.031):
        mission.advance(instant)
        pings = mission.pings_under_way()
        sounding = [ping for ends, ping in pinged if ping[2] <= instant < ends]
        assert [(it.ping, it.auv, it.sent_at_s) for it in pings] == sounding
        together = max(together, len(pings))
        expected = [
            (number(it.asv), it.fixes, it.sent_at_s)
            for it in broadcasts
            if it.sent_at_s <= instant < it.sent_at_s + it.airtime_s
        ]
        seen = mission.broadcasts_on_air()
        assert [(it.asv, it.fixes, it.sent_at_s) for it in seen] == expected
        assert mission.broadcast_on_air() == (seen[-1] if seen else None)
        sent += bool(seen)
    assert together > 0
    assert sent > 0


def test_a_mission_begins_with_its_first_pings() -> None:
    """At 0 s what happens at 0 s has happened: the first group pings."""
    mission = Mission(flown("sequential"), 1)
    assert mission.time == 0.0
    pings = simulate(flown("sequential"), 1).tables["pings"]
    first = pings[pings.sent_at_s == 0.0]
    assert [ping.auv for ping in mission.pings_under_way()] == [number(auv) for auv in first.auv]
    assert np.array_equal(mission.auvs().estimate, mission.auvs().truth[:, :2])


def test_what_was_seen_is_ones_own() -> None:
    """Who writes to what a look returned changes nothing of the mission."""
    mission = Mission(flown("sequential"), 1)
    for instant in np.arange(0.1, DURATION_S, 0.1):
        mission.advance(instant)
        for array in (*mission.auvs(), mission.asvs()):
            array[:] = -1.0
        if (broadcast := mission.broadcast_on_air()) is not None:
            broadcast.sent_at_s = broadcast.airtime_s = -1.0
    assert same(mission.result(), simulate(flown("sequential"), 1))


def test_missions_can_be_held_side_by_side() -> None:
    """Missions that are advanced in turn do not see each other."""
    names = ["steering", "steering", "twtt"]
    held = [Mission(flown(name), seed) for seed, name in enumerate(names)]
    for instant in np.arange(0.5, DURATION_S, 1.3):
        for mission in held:
            mission.advance(instant)
            look(mission)
    for seed, (mission, name) in enumerate(zip(held, names, strict=True)):
        assert same(mission.result(), simulate(flown(name), seed))


def test_result_runs_to_the_end_once() -> None:
    """The result is there from wherever the mission is, and remains the same object."""
    mission = Mission(flown("twtt"), 3)
    mission.advance(7.7)
    result = mission.result()
    assert mission.time == DURATION_S
    assert mission.result() is result
    mission.advance(DURATION_S)
    seen = look(mission)
    assert same(result, simulate(flown("twtt"), 3))
    assert np.isfinite(seen[1]).all()
    with pytest.raises(ValueError, match="at 20 s and does not go back to 19 s"):
        mission.advance(19.0)


@pytest.mark.parametrize(
    ("until", "told"),
    [
        (4.0, "the mission is at 5 s and does not go back to 4 s; begin a new Mission"),
        (-1.0, "the mission is at 5 s and does not go back to -1 s"),
        (20.5, "the mission ends at 20 s and cannot be advanced to 20.5 s; give an earlier"),
        (float("nan"), "the mission ends at 20 s and cannot be advanced to nan s"),
        (float("inf"), "the mission ends at 20 s and cannot be advanced to inf s"),
        ("6", "advance to an instant (s) or a SimPy event; got '6'"),
        (None, "advance to an instant (s) or a SimPy event; got None"),
    ],
)
def test_instants_that_cannot_be_reached_are_told(until: Any, told: str) -> None:
    """Neither the past nor what is beyond the end can be reached; the mission stays as it was."""
    mission = Mission(flown("sequential"), 1)
    mission.advance(5.0)
    with pytest.raises((ValueError, TypeError), match=re.escape(told)):
        mission.advance(until)
    assert mission.time == 5.0
    assert same(mission.result(), simulate(flown("sequential"), 1))


@pytest.mark.parametrize("seed", [-1, 1.5, True, "0"])
def test_a_seed_is_a_whole_number(seed: Any) -> None:
    """Seeds that are none are refused before anything is built."""
    with pytest.raises(ValueError, match="the seed must be a whole number >= 0"):
        Mission(flown("sequential"), seed)


def one_per_slot(view: View) -> list[list[int]]:
    return [[auv] for auv in range(len(view.auvs))]


def failing(view: View) -> list[list[int]]:
    """Schedule two rounds, and fail at the third."""
    if view.round == 2:
        raise ArithmeticError("no idea")
    return one_per_slot(view)


def test_events_are_run_by_the_mission_alone() -> None:
    mission = Mission(scenario(duration_s=5.0), 0)
    with pytest.raises(RuntimeError, match=r"runs its events itself: mission.advance\(until\)"):
        mission.env.run(until=3.0)
    with pytest.raises(RuntimeError, match="runs its events itself"):
        mission.env.step()
    mission.advance(3.0)
    assert mission.time == 3.0


def test_a_mission_that_failed_does_not_go_on_in_silence() -> None:
    """After an error a mission is where the error was, and says so; it makes no result."""
    mission = Mission(scenario(**merged(ON_TICKS, {"protocol": {"schedule": failing}})))
    with pytest.raises(ValueError, match="no idea"):
        mission.advance(15.0)
    failed_at = mission.time
    assert 0.0 < failed_at < 15.0
    for go_on in (lambda: mission.advance(16.0), mission.result):
        with pytest.raises(RuntimeError, match="ended with an error at"):
            go_on()
    assert mission.time == failed_at


def test_progress_is_that_of_the_mission() -> None:
    """`simulate` tells instants that rise to the end; being told changes nothing."""
    told: list[float] = []
    result = simulate(flown("steering_twtt"), 2, told.append)
    assert len(told) > 100
    assert pd.Series([0.0, *told, DURATION_S]).is_monotonic_increasing
    assert same(result, simulate(flown("steering_twtt"), 2))


@pytest.mark.parametrize("protocol", [{"schedule": "aloha"}, {"knowledge": "broadcast"}])
def test_a_schedule_that_would_not_be_asked_is_refused(protocol: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="is not asked; name it in the scenario"):
        Mission(scenario(**merged(ON_TICKS, {"protocol": protocol})), schedule=one_per_slot)
