"""AUVs that come up to the surface on their way, and take it up again where they left it."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from voyages import way
from worlds import merged, scenario

from bindusbl_des import Scenario, Setup, simulate
from bindusbl_des.apps.verification.case import Case, bounds_of
from bindusbl_des.core.geometry.routes import Surfacing, surfaced

# Up and down 10 m at 45 degrees are 20 m, in circles of 5 m radius one of 31.4 m
ASKED = Surfacing(every=100.0, radius=5.0, depth=10.0, angle=math.radians(45.0), stay=3.0)
LINE = way((0.0, 150.0), (0.1, 50.0))


def moved(distance: float, breaks: list[float], asked: Surfacing) -> float:
    """Return where on the path with its ascents a distance along the one without (m) is."""
    return distance + asked.length * sum(ascent < distance for ascent in breaks)


def surfacing(**changes: Any) -> Scenario:
    """Return the default mission, whose AUVs come up after each two minutes."""
    route = {"kind": "lawnmower", "surface_every_s": 120.0, "climb_angle_deg": 45.0}
    return scenario(**merged({"auvs": {"route": route}, "navigation": {"gnss_fix": {}}}, changes))


def test_it_comes_up_in_whole_circles_and_goes_on_where_it_left_its_path() -> None:
    path, breaks = surfaced(LINE, ASKED)
    circle = 2.0 * math.pi * 5.0
    assert ASKED.length == pytest.approx(circle)
    assert breaks == [100.0]
    assert path.length == pytest.approx(200.0 + circle)
    for along in np.linspace(0.0, 200.0, 37):
        was, now = LINE.at(along), path.at(moved(along, breaks, ASKED))
        assert (now.x, now.y) == pytest.approx((was.x, was.y), abs=1e-9)
        assert math.remainder(now.yaw - was.yaw, math.tau) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("every", [30.0, 60.0, 77.0, 170.0])
def test_a_tour_comes_up_as_often_in_each_of_its_laps(every: float) -> None:
    asked = ASKED._replace(every=every)
    tour = replace(LINE, repeats_from=30.0)
    path, breaks = surfaced(tour, asked)
    first = path.repeats_from
    assert first is not None
    assert first == moved(30.0, breaks, asked)
    lap, down = path.length - first, [moved(it, breaks, asked) for it in breaks]
    instants = down + [it + lap for it in down if it >= first]
    gaps = np.diff([-asked.length, *instants, path.length + lap])
    assert (gaps <= every + asked.length + 1e-9).all()


def test_lanes_last_longer_by_each_time_that_it_comes_up() -> None:
    with_it, without = (
        Setup(surfacing(auvs={"route": {"surface_every_s": it}})).plans[0] for it in (120.0, None)
    )
    up = with_it.path.length - without.path.length
    assert up > 0.0
    assert with_it.lanes[-1][1] - without.lanes[-1][1] == pytest.approx(up)
    ends = (
        surfacing(duration_s="survey"),
        surfacing(duration_s="survey", auvs={"route": {"surface_every_s": None}}),
    )
    longer = ends[0].duration_s - ends[1].duration_s
    assert longer == pytest.approx(up / 0.627)
    finished = simulate(ends[0], 0).mission.survey_finished_at_s[0]
    assert finished == pytest.approx(ends[0].duration_s, abs=1e-3)


@pytest.mark.parametrize(("until", "share"), [(60.0, 0.25), (260.0, 0.3575), (700.0, 0.75)])
def test_circles_at_the_surface_are_no_lanes(until: float, share: float) -> None:
    """One lane of 200 m at 1 m/s, up each 50 s: by 60 s a quarter is flown, and it circles."""
    route = {"lane_spacing_m": 20.0, "end_margin_m": 0.0, "start": "strip_corner"}
    up = {"surface_every_s": 50.0, "surface_for_s": 60.0, "climb_angle_deg": 20.0}
    world = surfacing(
        duration_s=until,
        survey={"side_m": None, "size_m": [200.0, 20.0], "depth_m": 20.0},
        auvs={"count": 1, "speed_m_per_s": 1.0, "route": route | up},
    )
    assert simulate(world, 0).auvs.lanes_flown_share[0] == pytest.approx(share, abs=1e-4)


def test_an_auv_is_at_the_surface_when_it_says_and_at_its_depth_else() -> None:
    run = simulate(surfacing(duration_s=400.0, record={"tracks_hz": 4.0}), 1)
    rows = run.tables["tracks"].query("vehicle == 'AUV0'")
    time, depth = rows.time_s.to_numpy(), rows.z_m.to_numpy()
    assert depth[time < 120.0] == pytest.approx(10.0)
    assert depth.min() == pytest.approx(0.0, abs=1e-9)
    assert depth.max() == pytest.approx(10.0)
    up = (time >= 120.0 + 10.0 / 0.627 + 0.1) & (time <= 130.0 + 10.0 / 0.627)
    assert depth[up] == pytest.approx(0.0, abs=1e-9)
    steep = np.abs(np.diff(depth)) / np.diff(time)
    assert steep.max() == pytest.approx(0.627, rel=1e-6)  # at 45 degrees
    fixes = run.tables["gnss_fixes"].query("auv == 'AUV0'")
    at = np.interp(fixes.fixed_at_s, time, depth)
    assert len(fixes) >= 3 * 10
    assert (at <= 0.5 + 0.2).all()


def test_what_is_flown_at_the_surface_sweeps_nothing() -> None:
    """The circles of an AUV that holds a lane at the survey's edge leave the area as it was."""
    swaths = {"survey": {"side_m": 60.0}, "auvs": {"route": {"lane_spacing_m": 20.0}}}
    base = merged({"duration_s": 170.0}, swaths)
    with_it = simulate(surfacing(**base), 0)
    assert (
        with_it.mission.area_covered_m2[0]
        < simulate(
            surfacing(**merged(base, {"auvs": {"route": {"surface_every_s": None}}})), 0
        ).mission.area_covered_m2[0]
    )


def test_the_verifier_counts_with_all_depths_and_the_speed_of_a_climb() -> None:
    tested = surfacing()
    assert Case(Setup(tested), bounds_of(Setup(tested))).depths == ((0.0, 10.0),) * 3
    level = surfacing(auvs={"route": {"surface_every_s": None}})
    faster = bounds_of(Setup(tested)).max_speed_m_per_s / bounds_of(Setup(level)).max_speed_m_per_s
    assert faster == pytest.approx(math.sqrt(2.0))


@pytest.mark.parametrize("vehicle", ["bluerov2", "remus100"])
def test_hulls_that_know_no_surface_are_refused(vehicle: str) -> None:
    with pytest.raises(ValidationError, match=f"the equations of {vehicle} know no surface"):
        surfacing(auvs={"vehicle": vehicle})


def test_a_path_on_which_it_would_come_up_without_end_is_refused() -> None:
    """A thousand kilometres, up every metre: planned as a whole, that took minutes."""
    line = way((0.0, 1e6))
    with pytest.raises(ValueError, match=r"come up 1,000,000 times on its path of 1e\+03 km"):
        surfaced(line, ASKED._replace(every=1.0))
