"""Surveys of any shape in scenarios: which keys say so, and what follows the area."""

import math
import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from worlds import merged, scenario

from bindusbl_des import Scenario, Setup, simulate, warnings_of

BRIEF: dict[str, Any] = {"duration_s": 20.0, "record": {"detail": "summary"}}
FAR = [[1000.0, 500.0], [1400.0, 500.0], [1400.0, 700.0], [1000.0, 700.0]]


def brief(**changes: Any) -> Scenario:
    return scenario(**merged(BRIEF, changes))


def test_a_rectangle_of_equal_sides_is_the_square() -> None:
    """`size_m` and the polygon of its corners make the mission that `side_m` makes."""
    full = {"duration_s": 20.0}
    square = simulate(scenario(**full), 1)
    rectangle = simulate(scenario(**full, survey={"size_m": [140.0, 140.0]}), 1)
    assert square.arrow.keys() == rectangle.arrow.keys()
    assert all(square.arrow[name].equals(rectangle.arrow[name]) for name in square.arrow)
    corners = [[70.0, 70.0], [70.0, -70.0], [-70.0, -70.0], [-70.0, 70.0]]
    polygon = simulate(scenario(**full, survey={"polygon_m": corners}), 1)
    columns = ["x_m", "y_m", "estimate_x_m", "estimate_y_m"]
    found, expected = (it.tables["tracks"][columns].to_numpy(float) for it in (polygon, square))
    assert found == pytest.approx(expected, abs=1e-6, nan_ok=True)


@pytest.mark.parametrize(
    ("survey", "message"),
    [
        ({"side_m": 60.0, "size_m": [60.0, 40.0]}, "survey.size_m: excludes side_m"),
        ({"size_m": [60.0, 40.0], "polygon_m": FAR}, "survey.polygon_m: excludes size_m"),
        ({"side_m": None}, "survey.side_m: says of no survey what it is; give one of side_m"),
        ({"polygon_m": FAR[:2]}, "survey.polygon_m: needs at least three corners"),
        (
            {"polygon_m": [FAR[0], FAR[2], FAR[1], FAR[3]]},
            r"survey.polygon_m: crosses or touches itself at \(1200, 600\)",
        ),
        ({"polygon_m": FAR, "rotation_deg": 3.0}, "survey.rotation_deg: turns squares"),
        ({"depths_m": [10.0, 12.0]}, "survey.depths_m: needs one depth per AUV: 3 expected, 2"),
        ({"size": [60.0, 40.0]}, r"survey.size\s+unknown key; did you mean 'size_m'"),
        ({"size_m": [60.0]}, r"survey.size_m\s+needs two numbers \[x, y\]; got a list of 1"),
        ({"size_m": [60.0, 0.0]}, r"survey.size_m.1\s+must be >= 0.1 m; got 0"),
        ({"size_m": [300.0, 8.0]}, None),
        ({"size_m": [8.0, 300.0]}, "auvs.route.lane_spacing_m: leaves no lane"),
    ],
)
def test_what_is_no_survey_is_refused(survey: dict[str, Any], message: str | None) -> None:
    """Two shapes, none, or one that cannot be swept: each says which key to change."""
    if message is None:
        brief(survey=survey)
        return
    with pytest.raises(ValueError, match=message):
        brief(survey=survey)


@pytest.mark.parametrize(
    ("auvs", "message"),
    [
        ({"speeds_m_per_s": [1.0]}, "auvs.speeds_m_per_s: needs one speed per AUV: 3 expected, 1"),
        ({"speeds_m_per_s": [1.0, 0.0, 1.0]}, r"auvs.speeds_m_per_s.1\s+must be >= 0.001 m/s"),
        ({"launch_m": [[0.0, 0.0]] * 2}, "auvs.launch_m: needs one .x, y. per AUV, or one for all"),
        ({"recovery_m": []}, "auvs.recovery_m: needs one .x, y. per AUV, or one for all"),
        (
            {"route": {"kind": "lawnmower", "division": "equal_length", "lane_spacing_m": 60.0}},
            None,
        ),
        (
            {"route": {"kind": "lawnmower", "division": "equal_length", "lane_spacing_m": 100.0}},
            "auvs.route.division: shares 2 lanes out among 3 AUVs",
        ),
    ],
)
def test_fleets_that_do_not_fit_are_refused(auvs: dict[str, Any], message: str | None) -> None:
    """Lists of one per AUV, and enough lanes for everybody."""
    if message is None:
        brief(auvs=auvs)
        return
    with pytest.raises(ValueError, match=message):
        brief(auvs=auvs)


def test_a_scenario_is_written_and_read_again() -> None:
    """All its keys, and only those that were given, say which shape it is."""
    mission = brief(survey={"polygon_m": FAR}, auvs={"launch_m": [[0.0, 0.0]]})
    assert Scenario.model_validate(mission.model_dump()) == mission
    assert Scenario.model_validate(mission.model_dump(exclude_unset=True)) == mission
    assert repr(mission).endswith("80,000 m2, a polygon of 4 corners, 20 s>")
    assert "140 m" in repr(brief())


def test_stations_lie_about_the_survey() -> None:
    """A ring is laid about the survey's centre of gravity, a single ASV upon it."""
    ring = Setup(
        brief(survey={"polygon_m": FAR}, asvs={"formation": {"radius_m": 50.0}})
    ).stations_m
    assert np.mean(ring, axis=0) == pytest.approx((1200.0, 600.0))
    assert [math.dist(it, (1200.0, 600.0)) for it in ring] == pytest.approx([50.0] * 3)
    assert Setup(brief(survey={"polygon_m": FAR}, asvs={"count": 1})).stations_m == (
        (1200.0, 600.0),
    )


def test_slots_are_those_of_the_longer_side() -> None:
    """The paper's L is that of a square; of another survey, the longer side around it."""
    square = Setup(brief(survey={"side_m": 400.0})).slots
    for survey in ({"size_m": [400.0, 200.0]}, {"size_m": [200.0, 400.0], "rotation_deg": 20.0}):
        found = Setup(brief(survey=survey)).slots
        assert replace(found, clock=square.clock) == square
    found = Setup(brief(survey={"polygon_m": FAR})).slots
    assert found.crossing_time == pytest.approx(400.0 / 1500.0)
    assert found.uplink_slot == pytest.approx(square.uplink_slot)


def test_every_auv_has_its_depth_and_speed() -> None:
    """Tracks show them; what is heard, and how long slots are, is that of the deepest."""
    hf = {"range_m": 50.0, "range_metric": "slant"}
    mission = scenario(
        duration_s=20.0,
        survey={"depths_m": [5.0, 10.0, 30.0]},
        auvs={"speeds_m_per_s": [0.5, 1.0, 2.0]},
        acoustics={"hf": hf},
    )
    result = simulate(mission, 1)
    tracks = result.tables["tracks"]
    depths = tracks[tracks.vehicle.str.startswith("AUV")].groupby("vehicle").z_m.first()
    assert depths.tolist() == [5.0, 10.0, 30.0]
    assert result.auvs.distance_m.tolist() == pytest.approx([10.0, 20.0, 40.0])
    assert Setup(mission).horizontal_reach_m == pytest.approx(40.0)
    deep = Setup(scenario(survey={"depths_m": [5.0, 10.0, 30.0]})).slots.longest_travel_time
    assert deep == pytest.approx(math.hypot(50.0, 30.0) / 1500.0)


@pytest.mark.parametrize("kind", ["lawnmower", "waypoints"])
def test_auvs_are_launched_and_recovered(kind: str) -> None:
    """They begin where they are launched, fly it once, and wait where they are recovered."""
    points = [[[-50.0, 0.0], [50.0, 0.0]], [[-50.0, 30.0], [50.0, 30.0]]]
    route = {"points_m": points} if kind == "waypoints" else {}
    mission = scenario(
        duration_s=2000.0,
        survey={"size_m": [120.0, 80.0], "rotation_deg": 40.0},
        auvs={
            "count": 2,
            "speed_m_per_s": 2.0,
            "launch_m": [[-90.0, -10.0]],
            "recovery_m": [[80.0, 5.0], [80.0, -5.0]],
            "route": {"kind": kind, **route},
        },
        record={"tracks_hz": 0.1},
    )
    tracks = simulate(mission, 1).tables["tracks"]
    for auv, recovery in enumerate([(80.0, 5.0), (80.0, -5.0)]):
        mine = tracks[tracks.vehicle == f"AUV{auv}"]
        assert mine[["x_m", "y_m"]].iloc[0].tolist() == pytest.approx([-90.0, -10.0])
        assert mine[["x_m", "y_m"]].iloc[-1].tolist() == pytest.approx(recovery)
        plan = Setup(mission).plans[auv]
        assert (
            plan.tour
            == plan.path
            == [plan.tour for plan in Setup(mission).plans][auv]
            == [plan.path for plan in Setup(mission).plans][auv]
        )
        assert 0.0 < plan.lanes[0][0] < plan.lanes[-1][1] < plan.path.length


def test_a_launch_and_recovery_at_the_ends_of_a_route_change_nothing() -> None:
    """Way points that begin and end there are not passed twice."""
    points = [[[-50.0, 0.0], [50.0, 0.0], [50.0, 40.0]]]
    auvs = {"count": 1, "route": {"kind": "waypoints", "points_m": points}}
    ends = {"launch_m": [[-50.0, 0.0]], "recovery_m": [[50.0, 40.0]]}
    plain, ended = brief(auvs=auvs), brief(auvs={**auvs, **ends})
    assert Setup(ended).plans[0].path == Setup(plain).plans[0].path
    assert Setup(ended).plans[0].lanes == ((0.0, pytest.approx(Setup(plain).plans[0].path.length)),)


def test_lanes_have_the_heading_that_is_asked_for() -> None:
    """Lanes of a turned rectangle run along its sides unless another heading is given."""
    survey = {"size_m": [200.0, 100.0], "rotation_deg": 30.0}
    for asked, expected in ((None, 30.0), (120.0, 120.0)):
        plan = Setup(brief(survey=survey, auvs={"route": {"lane_heading_deg": asked}})).plans[1]
        middles = [(begin + end) / 2 for begin, end in plan.lanes]
        yaw = np.degrees(plan.path.sample(np.array(middles))[:, 2])
        assert np.mod(yaw, 180.0) == pytest.approx(expected)


def test_vessels_and_routes_outside_a_polygon_are_told() -> None:
    """Warnings measure from the edge of the survey that there is."""
    far = {"polygon_m": FAR}
    route = {"kind": "hold", "positions_m": [[1200.0, 600.0], [900.0, 600.0], [1000.0, 500.0]]}
    told = {it.key: it.message for it in warnings_of(brief(survey=far, auvs={"route": route}))}
    assert (
        "AUV1 is outside the survey of 80,000 m2, a polygon of 4 corners, up to 100 m"
        in told["auvs.route.positions_m"]
    )
    wide = brief(survey=far, acoustics={"hf": {"range_m": 150.0}})
    told = {it.key: it.message for it in warnings_of(wide)}
    assert (
        "which puts 2 of 3 ASVs outside the survey, up to 29.9 m beyond its edge;"
        in told["asvs.formation.radius_m"]
    )
    assert Setup(wide).area.beyond(1200.0, 600.0 + 129.9) == pytest.approx(29.9)


def test_a_mission_lasts_until_its_survey_is_flown() -> None:
    """By hand: two lanes of 90 m 10 m apart, a half circle between them, at 2 m/s."""
    lanes = {"lane_spacing_m": 10.0, "start": "strip_corner"}
    mission = scenario(
        duration_s="survey",
        survey={"size_m": [100.0, 20.0]},
        auvs={
            "count": 1,
            "speed_m_per_s": 2.0,
            "vehicle": {"model": "kinematic", "turning_radius_m": 5.0},
            "route": lanes,
        },
    )
    length = 90.0 + math.pi * 5.0 + 90.0
    assert mission.duration_s == pytest.approx(length / 2.0)
    result = simulate(mission, 1)
    found = result.mission.iloc[0]
    assert found.duration_s == mission.duration_s
    assert found.survey_finished_at_s == pytest.approx(length / 2.0, abs=1e-5)
    assert found.lanes_flown_share == pytest.approx(1.0)
    assert result.auvs.distance_m.tolist() == pytest.approx([length])
    # what circles of 10 m about the way leave of the corners, and a half circle of turn
    assert found.area_covered_share == pytest.approx(1.0, abs=0.02)
    tracks = result.tables["tracks"]
    swept = tracks[tracks.vehicle == "AUV0"].swept_m2
    assert swept.is_monotonic_increasing
    assert swept.iloc[-1] <= found.area_covered_m2 == result.auvs.swept_m2.sum()
    assert tracks[tracks.vehicle == "ASV0"].swept_m2.isna().all()


def test_the_word_survey_is_kept() -> None:
    """It is written as it was given, and worked out anew with other keys."""
    mission = brief(duration_s="survey", auvs={"speed_m_per_s": 1.0})
    dumped = mission.model_dump(mode="json")
    assert dumped["duration_s"] == "survey"
    assert Scenario.model_validate(dumped) == mission
    assert pickle.loads(pickle.dumps(mission)).model_dump(mode="json") == dumped
    dumped["auvs"]["speed_m_per_s"] = 2.0
    assert Scenario.model_validate(dumped).duration_s == pytest.approx(mission.duration_s / 2.0)
    recovered = brief(duration_s="survey", auvs={"speed_m_per_s": 1.0, "recovery_m": [[0.0, 0.0]]})
    assert recovered.duration_s == max(plan.path.length for plan in Setup(recovered).plans)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"auvs": {"route": {"kind": "hold", "positions_m": [[0.0, 0.0]] * 3}}},
            "duration_s: survey needs lanes or waypoints",
        ),
        (
            {
                "auvs": {"vehicle": "bluerov2", "speed_m_per_s": 0.5},
                "environment": {"current_m_per_s": 0.4, "current_variation_m_per_s": 0.1},
            },
            "duration_s: survey has no end: at 0.5 m/s AUV0 makes no headway against a current",
        ),
        (
            {"auvs": {"vehicle": "bluerov2", "speed_m_per_s": 0.734}},
            r"^(?!.*duration_s:)[^:]*:?\s+auvs.speed_m_per_s: .*0.734 m/s is not .* the 0.733 m/s",
        ),
        (
            {"auvs": {"vehicle": "remus100", "speeds_m_per_s": [1.5, 1.5, 3.0]}},
            r"^[^:]*:?\s+auvs.speeds_m_per_s: remus100: a speed of 3.0 m/s is not between 0 and",
        ),
        (
            {"record": {"metrics_hz": 1000.0}, "auvs": {"speed_m_per_s": 0.001}},
            "metrics_hz: .* exceed",
        ),
        ({"duration_s": "surveys"}, r"needs a number \(>= 0.001 and <= 10000000 s\)"),
    ],
)
def test_a_survey_without_an_end_is_refused(changes: dict[str, Any], message: str) -> None:
    """What cannot be planned has no end; nor has what a current carries away."""
    with pytest.raises(ValueError, match=message):
        scenario(**merged({"duration_s": "survey"}, changes))


@pytest.mark.parametrize("current", [0.0, 0.15])
def test_hulls_are_done_before_their_bound(current: float) -> None:
    """What steers through the water finishes its lanes within the time that is reckoned for it."""
    mission = brief(
        duration_s="survey",
        survey={"size_m": [60.0, 20.0]},
        auvs={"count": 1, "vehicle": "bluerov2", "speed_m_per_s": 0.6},
        environment={"current_m_per_s": current, "current_direction_deg": 40.0},
    )
    found = simulate(mission, 1).mission.iloc[0]
    planned = Setup(mission).plans[0].lanes[-1][1] / 0.6
    assert 0.9 * planned < found.survey_finished_at_s < mission.duration_s == found.duration_s
    assert found.lanes_flown_share == pytest.approx(1.0)


@pytest.mark.parametrize("speeds", [[2.0, 1.0], [1.0, 2.0]])
def test_a_survey_is_finished_by_the_last(speeds: list[float]) -> None:
    """Of two AUVs with as much to fly the slower one finishes it, whichever of them that is."""
    mission = brief(duration_s="survey", auvs={"count": 2, "speeds_m_per_s": speeds})
    last = Setup(mission).plans[speeds.index(1.0)].lanes[-1][1]
    found = simulate(mission, 1).mission.iloc[0]
    assert found.survey_finished_at_s == pytest.approx(last, abs=1e-5)


def test_an_unfinished_survey_has_no_end() -> None:
    """Half of the time is half of the lanes, and nothing has finished."""
    whole = brief(duration_s="survey", auvs={"count": 1, "route": {"start": "strip_corner"}})
    half = brief(duration_s=whole.duration_s / 2, auvs=whole.auvs.model_dump(exclude_unset=True))
    found = simulate(half, 1).mission.iloc[0]
    assert found.lanes_flown_share == pytest.approx(0.5, abs=0.02)
    assert math.isnan(found.survey_finished_at_s)
    held = {"kind": "hold", "positions_m": [[0.0, 0.0]]}
    nothing = simulate(brief(auvs={"count": 1, "route": held}), 1).mission.iloc[0]
    assert math.isnan(nothing.lanes_flown_share)
    assert math.isnan(nothing.area_covered_m2)
    wide = brief(survey={"swath_m": 30.0}, auvs={"count": 1, "route": held})
    assert simulate(wide, 1).mission.area_covered_m2[0] == pytest.approx(math.pi * 225.0, rel=0.05)
