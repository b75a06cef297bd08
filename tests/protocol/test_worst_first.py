"""Worst first: the AUV that is expected to err most has its turn, and nobody is forgotten."""

from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from families_for_tests import allow
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds import scenario, still

from bindusbl_des import TimedGroups, View, simulate
from bindusbl_des.models.schedules.worst_first import WorstFirst, worst_first

allow(f"test_worst_first:{name}" for name in ("watching", "unequal", "uneven", "endless"))

WORST = {"protocol": {"schedule": {"model": "worst_first", "slots": 1}, "tick_rate_hz": None}}


def view_of(heard: Any, errors: Any, in_vain: Any = None) -> View:
    """Return what a fleet knows of AUVs with expected errors (m) that some ASVs hear."""
    flags = np.array(heard, dtype=bool)
    auvs, asvs = flags.shape
    view = View(
        0, 0.0, np.zeros((auvs, 3)), np.zeros((asvs, 3)), flags, 50.0, "horizontal",
        np.random.default_rng(0),
    )  # fmt: skip
    view.expected_error_m = np.array(errors, dtype=float)
    view.turns_in_vain = np.array([0] * auvs if in_vain is None else in_vain)
    return view


def test_the_worst_go_first_and_whoever_does_not_disturb_them() -> None:
    """Two ASVs: AUV2 (3 m) and AUV3 (2 m) share the first, so AUV0 (1 m) of the other joins."""
    heard = [[False, True], [True, False], [True, False], [True, False], [False, False]]
    view = view_of(heard, [1.0, 0.5, 3.0, 2.0, 0.1])
    assert worst_first(view, settings=WorstFirst(slots=1)) == [[2, 0, 4]]
    assert worst_first(view, settings=WorstFirst(slots=2)) == [[2, 0, 4], [3]]
    assert worst_first(view, settings=WorstFirst()) == [[2, 0, 4], [3], [1]]


def test_turns_in_vain_lower_a_claim() -> None:
    """3 m with one turn in vain count as 2 m with none (3 / 3 = 2 / 2), 2.9 m as less."""
    heard = [[True], [True]]
    assert worst_first(view_of(heard, [3.0, 2.0], [1, 0]), settings=WorstFirst(slots=1)) == [[0]]
    assert worst_first(view_of(heard, [2.9, 2.0], [1, 0]), settings=WorstFirst(slots=1)) == [[1]]


@settings(max_examples=200, deadline=None)
@given(data=st.data(), auvs=st.integers(1, 12), asvs=st.integers(1, 4), slots=st.integers(1, 6))
def test_groups_are_free_of_conflicts(data: Any, auvs: int, asvs: int, slots: int) -> None:
    """No ASV hears two of a group; who waits is heard by somebody in each slot, and claims less."""
    flags = st.lists(st.booleans(), min_size=asvs, max_size=asvs)
    heard = np.array(data.draw(st.lists(flags, min_size=auvs, max_size=auvs)))
    errors = data.draw(
        st.lists(st.floats(0.0, 100.0, allow_subnormal=False), min_size=auvs, max_size=auvs)
    )
    groups = worst_first(view_of(heard, errors), settings=WorstFirst(slots=slots))
    assert 1 <= len(groups) <= slots
    assert all(heard[group].sum(axis=0).max() <= 1 for group in groups)
    served = [auv for group in groups for auv in group]
    assert len(set(served)) == len(served)
    for waiting in set(range(auvs)) - set(served):
        for group in groups:
            rivals = [auv for auv in group if (heard[auv] & heard[waiting]).any()]
            assert any(errors[auv] >= errors[waiting] for auv in rivals)


@settings(max_examples=60, deadline=None)
@given(
    drifts=st.lists(st.floats(1.0, 3.0), min_size=2, max_size=6),
    chances=st.lists(st.sampled_from([0.0, 0.3, 0.9, 1.0]), min_size=6, max_size=6),
    seed=st.integers(0, 1000),
)
def test_nobody_starves(drifts: list[float], chances: list[float], seed: int) -> None:
    """One slot for all, drifts of 1 to 3 m a round, fixes that come always, at times or never: who
    has had k turns in vain waits for at most k + 2 times the rounds that all of them together could
    need at the highest drift.
    """
    luck, count = np.random.default_rng(seed), len(drifts)
    age, in_vain, waited, longest = np.zeros((4, count))
    for _ in range(400):
        view = view_of(np.ones((count, 1)), np.array(drifts) * age, in_vain)
        ((auv,),) = worst_first(view, settings=WorstFirst(slots=1))
        age, waited = age + 1.0, waited + 1.0
        waited[auv] = 0.0
        fixed = luck.random() < chances[auv]
        age[auv], in_vain[auv] = (0.0, 0) if fixed else (age[auv], in_vain[auv] + 1)
        longest = np.maximum(longest, waited / (in_vain + 2.0))
    assert longest.max() <= 3.0 * count


def test_with_equal_drift_it_is_a_round_robin() -> None:
    """Three AUVs in one slot a round: whoever has waited longest, and so one after the other."""
    result = simulate(still(3, duration_s=20.0, **WORST))
    turns = result.tables["pings"].auv.tolist()
    assert turns[1:10] == ["AUV0", "AUV1", "AUV2"] * 3  # AUV0's first fix was as old as the start
    # a ping in its slot of 0.1 s, then a frame of one fix in its slot of 0.4 s
    assert np.diff(result.tables["rounds"].started_at_s) == pytest.approx(0.5)


@pytest.mark.parametrize("downlink", ["sequential", "pipelined_round", "direct_reply"])
@pytest.mark.parametrize("slots", [1, 2])
def test_who_is_not_where_it_is_believed_keeps_nobody_waiting(downlink: str, slots: int) -> None:
    """One AUV is launched in range and leaves it, unknown to the fleet: the others are served."""
    ways = [[[45.0, 0.0], [400.0, 0.0]], *([[5.0 * k, 0.0], [5.0 * k, 9.0]] for k in range(3))]
    result = simulate(scenario(
        duration_s=60.0, survey={"side_m": 60.0}, asvs={"count": 1},
        auvs={"count": 4, "speed_m_per_s": 4.0,
              "vehicle": {"model": "kinematic", "turning_radius_m": 1.0},
              "route": {"kind": "waypoints", "points_m": ways}},
        acoustics={"loss": {"law": "none"}},
        protocol={"schedule": {"model": "worst_first", "slots": slots}, "positions": "last_fix",
                  "downlink": downlink},
    ))  # fmt: skip
    assert result.tables["pings"].groupby("auv").size().min() > 4
    assert result.auvs.fixes_delivered.tolist()[0] < 8
    ages = result.auvs.fix_age_max_s.tolist()
    assert ages[0] > 45.0
    assert max(ages[1:]) < 8.0


SEEN: list[View] = []


def watching(view: View) -> list[list[int]]:
    """Let AUV0 and AUV1 ping, and keep what is known."""
    assert len(view.expected_error_m) == len(view.since_s) == len(view.turns_in_vain)
    SEEN.append(view)
    return [[0], [1]]


def test_the_fleet_expects_what_its_fixes_and_its_plans_say() -> None:
    """Variances: at first those of the start, 2 x 2^2; then (|b| t)^2 + 2 sigma^2 t are added, and
    a fix of r is weighed with them, v r / (v + r).
    """
    SEEN.clear()
    navigation = {"initial_position_sd_m": 2.0, "velocity_bias_m_per_s": [0.3, 0.4],
                  "random_walk_m_per_sqrt_s": 0.1}  # fmt: skip
    protocol = {"schedule": watching, "tick_rate_hz": None}
    result = simulate(still(3, duration_s=3.0, navigation=navigation, protocol=protocol))
    first, second = SEEN[0], SEEN[1]
    assert first.expected_error_m == pytest.approx([np.sqrt(8.0)] * 3)
    assert first.turns_in_vain.tolist() == [0, 0, 0]
    assert second.since_s.tolist() == pytest.approx([second.time, second.time - 0.1, second.time])
    fix, pinged = result.tables["fixes"].iloc[1], 0.1
    drifted = 8.0 + (0.5 * pinged) ** 2 + 2 * 0.01 * pinged
    variance = fix.sd_x_m**2 + fix.sd_y_m**2
    since = second.time - pinged
    later = (0.5 * since) ** 2 + 2 * 0.01 * since
    expected = np.sqrt(drifted * variance / (drifted + variance) + later)
    assert second.expected_error_m[1] == pytest.approx(expected)
    unfixed = np.sqrt(8.0 + (0.5 * second.time) ** 2 + 2 * 0.01 * second.time)
    assert second.expected_error_m[2] == pytest.approx(unfixed)
    assert second.turns_in_vain.tolist() == [0, 0, 0]


def test_a_fix_is_weighed_once() -> None:
    """Two ASVs after each other, the fix of AUV1 first, though that of AUV0 is the older one."""
    SEEN.clear()
    route = {"kind": "hold", "positions_m": [[40.0, 0.0], [5.0, 0.0]]}
    vessels = {"count": 2, "formation": {"positions_m": [[0.0, 0.0], [45.0, 0.0]]}}
    protocol = {"schedule": watching, "downlink": "pipelined_round", "broadcaster": "parallel"}
    navigation = {"initial_position_sd_m": 2.0, "velocity_bias_m_per_s": [0.3, 0.4]}
    result = simulate(still(2, duration_s=6.0, auvs={"route": route}, asvs=vessels,
                            protocol=protocol, navigation=navigation))  # fmt: skip
    walk, fixes = result.scenario.navigation.random_walk_m_per_sqrt_s, result.tables["fixes"]
    assert fixes.broadcast_at_s[0] > fixes.broadcast_at_s[1]
    assert len(SEEN) > 5
    for view in SEEN:
        variance, at = 8.0, 0.0
        sent = fixes[(fixes.auv == "AUV1") & (fixes.broadcast_at_s <= view.time)]
        for fix in sent.itertuples():
            since, own = fix.pinged_at_s - at, fix.sd_x_m**2 + fix.sd_y_m**2
            variance += (0.5 * since) ** 2 + 2 * walk**2 * since
            variance, at = variance * own / (variance + own), fix.pinged_at_s
        since = view.time - at
        expected = np.sqrt(variance + (0.5 * since) ** 2 + 2 * walk**2 * since)
        assert view.expected_error_m[1] == pytest.approx(expected)


def test_a_fleet_counts_turns_in_vain() -> None:
    """Of an AUV that is not decoded each ping was in vain; of one that nobody hears, none."""
    SEEN.clear()
    loss = {"law": "none", "combine": "clamp_first", "contention_per_auv": 1.0, "cap": 1.0}
    world = still(2, duration_s=3.0, acoustics={"loss": loss}, protocol={"schedule": watching})
    simulate(world)
    assert [it.turns_in_vain.tolist() for it in SEEN[:3]] == [[0, 0], [1, 1], [2, 2]]
    SEEN.clear()
    route = {"kind": "hold", "positions_m": [[20.0, 0.0], [200.0, 0.0]]}
    simulate(still(2, duration_s=3.0, auvs={"route": route}, protocol={"schedule": watching}))
    assert [it.turns_in_vain.tolist() for it in SEEN[:3]] == [[0, 0], [0, 0], [0, 0]]


@pytest.mark.parametrize("downlink", ["sequential", "pipelined_round"])
def test_who_does_not_know_its_slot_keeps_nobody_waiting(downlink: str) -> None:
    """AUV0 decodes no frame, so it has the largest claim and is silent: a turn is a turn."""
    route = {"kind": "hold", "positions_m": [[30.0, 0.0], [10.0, 0.0], [0.0, 10.0]]}
    protocol = {"downlink": downlink, "knowledge": "broadcast", **WORST["protocol"]}
    mf = {"range_m": 20.0}
    world = still(
        3, duration_s=30.0, auvs={"route": route}, protocol=protocol, acoustics={"mf": mf}
    )
    turns = simulate(world).tables["assignments"].auv.tolist()[2:]
    assert turns.count("AUV0") < len(turns) / 2
    assert min(turns.count("AUV1"), turns.count("AUV2")) > len(turns) / 5
    assert not any(turn == following for turn, following in pairwise(turns))


def test_a_view_made_by_hand_says_what_it_lacks() -> None:
    view = view_of([[True]], [1.0])
    del view.__dict__["turns_in_vain"]
    with pytest.raises(LookupError, match="made by hand"):
        worst_first(view, settings=WorstFirst())
    view.known = SimpleNamespace(turns_in_vain=lambda: np.zeros(1))  # type: ignore[assignment]
    assert worst_first(view, settings=WorstFirst()) == [[0]]


def unequal(view: View) -> TimedGroups:
    return TimedGroups([[1], [0, 2]], [0.05, 0.3])


def uneven(view: View) -> TimedGroups:
    return TimedGroups([[1], [0, 2]], [0.05])


def endless(view: View) -> TimedGroups:
    return TimedGroups([[1], [0, 2]], [0.05, float("inf")])


@pytest.mark.parametrize(("rate", "lengths"), [(None, (0.05, 0.3)), (30.0, (2 / 30, 0.3))])
def test_slots_last_as_long_as_a_schedule_says(rate: float | None, lengths: Any) -> None:
    """Slots of 50 and 300 ms begin and end where they should, on ticks where there are some."""
    protocol = {"schedule": unequal, "tick_rate_hz": rate, "downlink": "direct_reply"}
    result = simulate(still(3, duration_s=5.0, protocol=protocol))
    pings, rounds = result.tables["pings"], result.tables["rounds"]
    begins = pings.groupby(["round", "slot"]).sent_at_s.first()
    assert begins[2, 1] - begins[2, 0] == pytest.approx(lengths[0])
    assert rounds.uplink_s[2] == pytest.approx(sum(lengths))
    assert np.diff(rounds.started_at_s) == pytest.approx(sum(lengths))


@pytest.mark.parametrize(
    ("wrong", "told"), [(uneven, r"\[0.05\] s"), (endless, r"\[0.05, inf\] s")]
)
def test_slots_of_no_length_are_refused(wrong: Any, told: str) -> None:
    with pytest.raises(ValueError, match=f"{told} in round 0; lengths_s is one time above 0"):
        simulate(still(3, duration_s=5.0, protocol={"schedule": wrong}))
