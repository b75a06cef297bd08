"""Fleets of several groups: each AUV does what it does in a fleet of its own kind."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from predicted_for_tests import inputs_of, predict

from bindusbl_des import (
    Result,
    Scenario,
    ScenarioError,
    Setup,
    load_scenario,
    simulate,
    warnings_of,
)  # fmt: skip

Keys = dict[str, Any]

WAYS = {"kind": "waypoints", "points_m": [[[-40, -20], [40, -20]]]}
HELD = {"kind": "hold", "positions_m": [[15, 0]]}
SHEET = {"percent_of_distance": 1.0, "line_m": 20.0}

# Hulls, depths, speeds, routes and dead reckoning that differ; by estimate as well as by truth
GROUPS: list[Keys] = [
    {"vehicle": "remus100", "speed_m_per_s": 1.2, "depth_m": 8.0, "route": WAYS, "drift": SHEET},
    {"depth_m": 12.0, "route": HELD, "velocity_bias_m_per_s": [0.1, -0.02]},
    {"vehicle": "bluerov2", "depth_m": 4.0, "feedback": "estimate", "scale_factor_sd": 0.05},
    {"vehicle": {"model": "kinematic", "turning_radius_m": 9.0}, "heading_sd_deg": 5.0},
]
OF_ALL = {"kind": "lawnmower", "lane_spacing_m": 20.0}


def mission(auvs: Keys, **changes: Any) -> Scenario:
    return Scenario(
        **{
            "name": "mixed",
            "duration_s": 40.0,
            "auvs": auvs,
            "navigation": {"filter": "dead_reckoning", "initial_position_sd_m": 0.5},
            **changes,
        }
    )


def tracks(result: Result, auv: int) -> pd.DataFrame:
    found = result.tables["tracks"]
    return found[found.vehicle == f"AUV{auv}"].reset_index(drop=True)


ERRORS = ("drift", "velocity_bias_m_per_s", "scale_factor_sd", "heading_sd_deg")


def all_such(group: Keys, count: int) -> Scenario:
    """Return a mission without groups all of whose AUVs are as those of a group."""
    own, route = dict(group), dict(group.get("route", OF_ALL))
    survey = {name: own.pop(name) for name in ("depth_m",) if name in own}
    errors = {name: own.pop(name) for name in ERRORS if name in own}
    route |= {name: route[name] * count for name in ("points_m", "positions_m") if name in route}
    made = mission({**own, "count": count, "route": route}, survey=survey)
    return mission(
        made.auvs.model_dump(exclude_unset=True),
        survey=survey,
        navigation={**made.navigation.model_dump(exclude_unset=True), **errors},
    )


def test_each_auv_does_what_it_does_among_its_like() -> None:
    """Dead reckoning alone: AUVs of several kinds do not meet, so that each is row for row the AUV
    of its number in a fleet that is all of its kind.
    """
    groups = [{"count": 1, **group} for group in GROUPS]
    mixed = simulate(mission({"groups": groups, "route": OF_ALL}), seed=3)
    for auv, group in enumerate(GROUPS[:2]):  # those with routes of their own
        alone = simulate(all_such(group, len(GROUPS)), seed=3)
        pd.testing.assert_frame_equal(tracks(mixed, auv), tracks(alone, auv))
    # the others share that of all, in the order of their numbers
    pair = [{"count": 1, **group} for group in GROUPS[2:]]
    shared = simulate(mission({"groups": pair, "route": OF_ALL}), seed=3)
    for auv, group in enumerate(GROUPS[2:]):
        alone = simulate(all_such(group, len(pair)), seed=3)
        pd.testing.assert_frame_equal(tracks(shared, auv), tracks(alone, auv))
    places = ["x_m", "y_m", "z_m"]  # and in the whole fleet they share it, too
    pd.testing.assert_frame_equal(tracks(shared, 1)[places], tracks(mixed, 3)[places])


@pytest.mark.parametrize("extra", [{}, {"vehicle": "bluerov2", "feedback": "estimate"}])
def test_groups_that_say_nothing_are_one_fleet(extra: Keys) -> None:
    """A fleet that is split in groups is the fleet, bit for bit, with fixes and a filter."""
    one = Scenario(name="one", duration_s=30.0, auvs={"count": 3, **extra})
    whole = simulate(one, seed=1)
    for groups in ([{"count": 3}], [{"count": 2}, {"count": 1}]):
        split = simulate(Scenario(name="one", duration_s=30.0, auvs={**extra, "groups": groups}), 1)
        assert split.scenario.auvs.count == 3
        for name, table in whole.tables.items():
            pd.testing.assert_frame_equal(table, split.tables[name], obj=f"{name} of {groups}")


STILL = {"kind": "hold", "positions_m": [[10, 0], [-10, 5], [0, -12]]}


@pytest.mark.parametrize("filtered", ["kalman", "smoother", "fixed_gain"])
def test_each_filter_knows_what_is_wrong_with_its_own_auv(filtered: str) -> None:
    """AUVs that lie still have the same fixes whatever their compasses and logs: what each makes of
    them is what it makes of them in a fleet of its kind.
    """
    kinds: list[Keys] = [
        {"velocity_bias_sd_m_per_s": 0.05, "velocity_bias_time_constant_s": 30.0},
        {"scale_factor_sd": 0.02, "heading_sd_deg": 2.0},
        {"velocity_bias_m_per_s": [0.0, 0.0], "random_walk_m_per_sqrt_s": 0.1},
    ]
    navigation = {"filter": filtered, "velocity_bias_m_per_s": [0.02, 0.01]}
    groups = [{"count": 1, **kind} for kind in kinds]
    auvs = {"route": STILL, "groups": groups}
    mixed = simulate(mission(auvs, duration_s=60.0, navigation=navigation), seed=5)
    for auv, kind in enumerate(kinds):
        keys = {**navigation, **kind}
        alone = simulate(mission({"route": STILL}, duration_s=60.0, navigation=keys), seed=5)
        one, two = tracks(mixed, auv), tracks(alone, auv)
        assert one.position_error_m.iloc[-1] > 0.0
        assert len(mixed.tables["fixes"]) > 5
        pd.testing.assert_frame_equal(one, two, rtol=1e-9, atol=1e-9)


def test_setup_answers_for_each_auv() -> None:
    auvs = {"groups": [{"count": 1, **group} for group in GROUPS], "speed_m_per_s": 0.7}
    setup = Setup(mission(auvs))
    assert [auv.depth_m for auv in setup.auvs] == [8.0, 12.0, 4.0, 10.0]
    assert [auv.speed_m_per_s for auv in setup.auvs] == [1.2, 0.7, 0.7, 0.7]
    assert setup.planned_speeds_m_per_s == (1.2, 0.0, 0.7, 0.7)
    assert (setup.deepest_m, setup.fastest_m_per_s) == (12.0, 1.2)
    assert [plan is None for plan in setup.plans] == [False, True, False, False]
    assert setup.turning_radii_m[3] == 9.0
    assert [own.scale_factor_sd for own in setup.sensors] == [0.0, 0.0, 0.05, 0.0]
    assert setup.sensors[0].bias_sd_m_per_s > 0.0
    assert "AUV0: its data sheet's 1 % of distance" in setup.drift_words
    # sound that crosses the survey goes down to the deepest AUV
    deep, usual = setup.slots, Setup(mission({"count": 4})).slots
    assert deep.longest_travel_time > usual.longest_travel_time


def test_a_prediction_tells_groups_apart() -> None:
    """What is predicted of each AUV is what missions have, whose dead reckoning is their own."""
    groups: list[Keys] = [
        {"count": 2, "drift": {"percent_of_distance": 0.5}},
        {"count": 1, "drift": {"percent_of_distance": 20.0}, "depth_m": 6.0},
    ]

    def made(groups: list[Keys]) -> Scenario:
        return Scenario(
            name="two kinds", duration_s=120.0, survey={"side_m": 100.0}, asvs={"count": 1},
            auvs={"groups": groups, "speed_m_per_s": 1.0}, record={"detail": "summary"},
            acoustics={"hf": {"range_m": 60.0}},
        )  # fmt: skip

    asked = made(groups)
    setup = Setup(asked)
    inputs = inputs_of(setup)
    assert inputs.ways.depths_m.tolist() == [10.0, 10.0, 6.0]
    predicted = predict(inputs, setup.stations_m).position_error_m
    missions = np.mean([simulate(asked, seed).auvs.position_error_m for seed in range(8)], axis=0)
    assert missions[2] > 2.0 * missions[:2].max()
    assert np.abs(predicted / missions - 1.0).max() < 0.4
    assert [own.members for own in inputs.others] == [(2,)]
    assert not inputs_of(Setup(made([groups[0], groups[0]]))).others


# Groups (or, behind a !, all keys of auvs), and what is said of them: below auvs.groups, or !
BAD = """
{count: 2}, {count: 0}
    1.count: must be >= 1; got 0
!groups: [{count: 2}], count: 3
    !auvs.count: is 3, and groups are of 2 = 2 AUVs; remove it, or have them add up
{speed_m_per_s: 1}
    0.count: missing; add it
{count: 1, speed_m_s: 1}
    0.speed_m_s: unknown key; did you mean 'speed_m_per_s'?
{count: 1, depth_m: -1}
    0.depth_m: must be >= 0 m; got -1
{count: 1, route: {kind: lawnmowr}}
    0.route.kind: must be one of lawnmower, hold, waypoints, track
{count: 1, route: {kind: hold, lane_spacing_m: 5}}
    0.route.lane_spacing_m: no key of a hold route; it belongs to
{count: 2, route: {kind: hold, positions_m: [[0, 0]]}}
    0.route.positions_m: needs one [x, y] per AUV of the group: 2 expected, 1
!route: {kind: hold, positions_m: [[0, 0]]}, groups: [{count: 2}, {count: 1, route: {}}]
    !auvs.route.positions_m: needs one [x, y] per AUV that has no other: 2 expected, 1 given
{count: 1}, {count: 1, vehicle: remus100, route: {kind: track, files: []}}
    1.vehicle: remus100 flies paths; with a track route use kinematic
{count: 1, vehicle: {model: kinematic, turning_radius_m: 80}}
    0.vehicle.turning_radius_m: a turn of 80 m radius does not fit a survey
{count: 2, launch_m: [[0, 0], [1, 1], [2, 2]]}
    0.launch_m: needs one [x, y] per AUV of the group, or one for all: 2 expected
{count: 1, route: {kind: waypoints, points_m: [[[0, 0]]]}}
    0.route.points_m.0: needs at least two points
!groups: {count: 2}
    !auvs.groups: needs a list of {count, vehicle,
"""


def wrong() -> list[tuple[str, str]]:
    """Return keys of auvs, and the beginning of what is said of them."""
    lines = BAD.strip().splitlines()
    said = [line.strip() for line in lines]
    return [
        (
            keys[1:] if keys.startswith("!") else f"groups: [{keys}]",
            told[1:] if told.startswith("!") else f"auvs.groups.{told}",
        )
        for keys, told in zip(said[::2], said[1::2], strict=True)
    ]


@pytest.mark.parametrize(("auvs", "told"), wrong())
def test_a_group_that_cannot_be_is_told_at_its_line(auvs: str, told: str, tmp_path: Path) -> None:
    file = tmp_path / "mixed.yaml"
    file.write_text(f"name: mixed\nauvs: {{{auvs}}}\n")
    with pytest.raises(ScenarioError) as raised:
        load_scenario(file)
    assert any(
        str(it).startswith(f"{file}:2:") and told in str(it) for it in raised.value.mistakes
    ), str(raised.value)


def test_passive_ranging_has_one_compass_for_all() -> None:
    groups = [{"count": 1, "heading_sd_deg": 1.0}, {"count": 1}]
    with pytest.raises(ValueError, match=r"heading_sd_deg: is to be the same in all groups"):
        mission({"groups": groups}, protocol={"ranging": "passive"})


def test_options_reach_into_groups(tmp_path: Path) -> None:
    file = tmp_path / "mixed.yaml"
    file.write_text("name: mixed\nauvs: {speed_m_per_s: 0.4, groups: [{count: 1}, {count: 2}]}\n")
    options = ["auvs.groups.1.speed_m_per_s=1.5", "auvs.groups.0.vehicle.turning_radius_m=2"]
    setup = Setup(load_scenario(file, overrides=[*options, "auvs.groups.1.count=3"]))
    assert [auv.speed_m_per_s for auv in setup.auvs] == [0.4, 1.5, 1.5, 1.5]
    assert setup.turning_radii_m[:2] == (2.0, 5.0)
    again = Scenario.model_validate(setup.scenario.model_dump())
    assert again == setup.scenario


def test_keys_that_no_group_goes_by_are_told() -> None:
    held = {"kind": "hold", "positions_m": [[0, 0]]}
    auvs = {
        "speed_m_per_s": 0.5,
        "groups": [
            {"count": 1, "depth_m": 3.0, "route": held, "join_angle_deg": 5.0},
            {"count": 1, "depth_m": 4.0},
        ],
    }
    told = {it.key: it.message for it in warnings_of(mission(auvs, survey={"depth_m": 7.0}))}
    assert "each group of AUVs says its own" in told["survey.depth_m"]
    assert "the AUVs lie still" in told["auvs.groups.0.join_angle_deg"]
    assert "auvs.speed_m_per_s" not in told  # the other group goes by it
