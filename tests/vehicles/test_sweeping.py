"""What of a survey is swept, and when: against areas worked out by hand and by shapely."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st
from worlds import scenario

from bindusbl_des import Result, simulate

Way = Sequence[Sequence[float]]


def swept(survey: dict[str, Any], ways: list[Way], swath: float, until: float) -> Result:
    """Fly AUVs over a survey along ways: when (s) they are where (m), until an instant (s)."""

    def route(plan: Any) -> list[Way]:
        return [[*map(tuple, way)] for way in ways]

    return simulate(
        scenario(
            duration_s=until, survey={**survey, "swath_m": swath},
            auvs={"count": len(ways), "route": {"kind": route}}, asvs={"count": 1},
            protocol={"shortest_uplink_slot_s": 60.0},
            navigation={"filter": "dead_reckoning"}, record={"tracks_hz": 20.0 / until},
        )
    )  # fmt: skip


def area(result: Result) -> float:
    """Return what all have swept at the end (m2)."""
    return float(result.mission.area_covered_m2[0])


def along(result: Result, auv: str = "AUV0") -> dict[float, float]:
    """Return what an AUV has swept as the first of all (m2) by instants (s)."""
    own = result.tables["tracks"].query("vehicle == @auv")
    return dict(zip(own.time_s.round(6).tolist(), own.swept_m2.tolist(), strict=True))


def line(x: float, y: float, yaw: float, length: float, speed: float) -> Way:
    """Return the way of a straight line 5 m deep."""
    ends = (x, y), (x + length * math.cos(yaw), y + length * math.sin(yaw))
    return [(k * length / speed, *end, 5.0) for k, end in enumerate(ends)]


def test_one_lane_sweeps_its_swath() -> None:
    """A lane across the whole of a survey sweeps a strip as wide as the swath, at its speed."""
    result = swept({"size_m": [100.0, 80.0]}, [line(-60.0, 0.0, 0.0, 120.0, 2.0)], 16.0, 60.0)
    found = along(result)
    assert [found[0.0], found[30.0]] == pytest.approx([0.0, 16.0 * 50.0 + math.pi * 32.0], abs=30.0)
    assert area(result) == pytest.approx(1600.0, abs=30.0)
    assert area(result) == pytest.approx(result.auvs.swept_m2[0])


def test_whoever_comes_first_has_swept_it() -> None:
    """Two vehicles along one lane: the slower one sweeps what the faster one has not reached."""
    ways = [line(50.0, 0.0, math.pi, 100.0, 1.0), line(-50.0, 0.0, 0.0, 100.0, 2.0)]
    result = swept({"size_m": [100.0, 40.0]}, ways, 20.0, 100.0)
    shares = result.auvs.swept_m2
    assert area(result) == pytest.approx(2000.0, abs=40.0)
    assert shares.sum() == pytest.approx(area(result))
    assert shares[1] / shares[0] == pytest.approx(2.0, rel=0.2)  # they met after 67 m


@settings(max_examples=30, deadline=None)
@given(
    st.lists(
        st.tuples(*[st.floats(-80.0, 80.0)] * 2, st.floats(-3.0, 3.0)), min_size=1, max_size=4
    ),
    st.floats(5.0, 40.0),
    st.floats(-0.1, 0.1),
)
@example([(0.0, 0.0, 1.0)], 5.0, 1.4e-17)  # of 55.5 m went the way that a figure drew
@example([(0.0, 0.0, 1.0)], 5.0, 1e-15)
def test_what_is_swept_is_the_way_with_its_surroundings(
    starts: list[tuple[float, float, float]], swath: float, curvature: float
) -> None:
    """Against shapely's buffers about the ways, up to half a cell along their edges."""
    corners = [(-60.0, -60.0), (60.0, -60.0), (60.0, 20.0), (0.0, 60.0), (-60.0, 20.0)]
    times, ways = np.linspace(0.0, 60.0, 121), []
    for x, y, yaw in starts:
        turned = yaw + curvature * (times[:-1] + times[1:]) / 2.0
        steps = 0.5 * np.column_stack((np.cos(turned), np.sin(turned)))
        places = np.cumsum(np.vstack([(x, y), steps]), axis=0)
        ways.append(np.column_stack((times, places, np.full(len(times), 5.0))).tolist())
    found = swept({"polygon_m": corners}, ways, swath, 60.0)
    lines = [shapely.LineString(np.array(way)[:, 1:3]) for way in ways]
    around = shapely.union_all(shapely.buffer(lines, swath / 2))
    around = shapely.intersection(around, shapely.Polygon(corners))
    edge = around.length * swath / 16
    assert area(found) == pytest.approx(around.area, abs=edge / 2 + 20.0)


def test_who_waits_has_swept_all_that_lies_behind() -> None:
    """A lane of 100 m in 50 s is swept as well if the vehicle then lies still for hours."""
    lane = line(-50.0, 0.0, 0.0, 100.0, 2.0)
    soon, late = (swept({"size_m": [100.0, 40.0]}, [lane], 10.0, until) for until in (50.0, 2e4))
    assert area(late) == pytest.approx(area(soon), abs=2.0)


@pytest.mark.parametrize("leaves", [365.0, 400.0, 1000.0, 1300.0])
def test_who_goes_out_and_back_has_swept_what_lies_between(leaves: float) -> None:
    """25 m at 1 m/s and back in an hour of hovering, between two instants looked at first."""
    times = (0.0, leaves, leaves + 25.0, leaves + 50.0, 3600.0)
    way = [(time, x, 0.0, 5.0) for time, x in zip(times, (0.0, 0.0, 25.0, 0.0, 0.0), strict=True)]
    truth = 25.0 * 5.0 + math.pi * 2.5**2
    assert area(swept({"side_m": 60.0}, [way], 5.0, 3600.0)) == pytest.approx(truth, abs=4.0)


@pytest.mark.parametrize("wide", [1.0, 3.0])
def test_a_strip_thinner_than_its_cells_is_swept(wide: float) -> None:
    lane = line(-150.0, 0.0, 0.0, 300.0, 1.0)
    found = swept({"size_m": [300.0, wide]}, [lane], 10.0, 150.0)
    assert area(found) == pytest.approx(155.0 * wide, rel=0.02)


@pytest.mark.parametrize("wide", [2.0, 5.0, 10.0])
@pytest.mark.parametrize("swath", [80.0, 150.0])
def test_of_a_corridor_thinner_than_its_cells_counts_what_is_in_them(
    wide: float, swath: float
) -> None:
    """A Z of three corridors, the middle one flown along: against a buffer of the way."""
    middle = wide / 2.0
    corridor = [
        (0.0, 0.0), (500.0 + middle, 0.0), (500.0 + middle, 1000.0 - wide), (1000.0, 1000.0 - wide),
        (1000.0, 1000.0), (500.0 - middle, 1000.0), (500.0 - middle, wide), (0.0, wide),
    ]  # fmt: skip
    leg = line(500.0, 0.0, math.pi / 2, 1000.0, 10.0)
    found = swept({"polygon_m": corridor}, [leg], swath, 100.0)
    around = shapely.LineString([(500, 0), (500, 1000)]).buffer(swath / 2)
    truth = shapely.intersection(shapely.Polygon(corridor), around).area
    assert area(found) == pytest.approx(truth, rel=0.03)


def test_who_lies_still_sees_about_itself() -> None:
    lies = [(0.0, 0.0, 0.0, 5.0), (60.0, 0.0, 0.0, 5.0)]
    found = swept({"side_m": 100.0}, [lies], 20.0, 60.0)
    assert along(found)[0.0] == pytest.approx(math.pi * 100.0, rel=0.05)


@pytest.mark.parametrize("degrees", [0, 30, 45])
def test_a_slanted_corridor_is_swept_as_a_straight_one(degrees: int) -> None:
    """Lanes whose swaths touch leave nothing of 3 km x 60 m between them, whatever its heading."""
    turn = math.radians(degrees)
    along_it, across = (
        np.array([math.cos(turn), math.sin(turn)]),
        np.array([-math.sin(turn), math.cos(turn)]),
    )
    corners = [
        tuple((u * along_it + v * across).tolist())
        for u, v in ((0, -30), (3000, -30), (3000, 30), (0, 30))
    ]
    lanes = [line(*(v * across).tolist(), turn, 3000.0, 2.0) for v in (-25, -15, -5, 5, 15, 25)]
    found = swept({"polygon_m": corners}, lanes, 10.0, 1500.0)
    assert area(found) / 180e3 > 0.999
    half = sum(along(found, f"AUV{n}")[750.0] for n in range(6))
    assert half / 180e3 == pytest.approx(0.5, abs=0.005)


def test_who_comes_up_sweeps_nothing_on_the_way() -> None:
    """Circles in which an AUV comes up and dives, beside its straight way, add nothing to it."""
    route = {"kind": "waypoints", "points_m": [[[-90.0, 0.0], [90.0, 0.0]]]}
    result = simulate(
        scenario(
            duration_s=170.0, survey={"side_m": 200.0, "depth_m": 10.0, "swath_m": 3.0},
            auvs={
                "count": 1, "speed_m_per_s": 1.0,
                "route": {**route, "surface_every_s": 40.0, "surface_for_s": 5.0},
            },
            asvs={"count": 1}, navigation={"filter": "dead_reckoning"},
            record={"tracks_hz": 10.0},
        )
    )  # fmt: skip
    track = result.tables["tracks"].query("vehicle == 'AUV0'")
    grown, rising = track.swept_m2.diff()[1:], (track.z_m < 9.0)[1:]
    assert rising.sum() > 200
    assert grown[rising].sum() == pytest.approx(0.0, abs=1.0)
    assert grown.sum() == pytest.approx(3.0 * np.ptp(track.x_m), rel=0.1)


def test_what_lies_where_two_swaths_touch_is_swept() -> None:
    """Middles of cells 8 m beside a lane, to the last bit, with a swath of 16 m."""
    lane = line(-60.0, 0.0, 0.0, 120.0, 2.0)
    found = swept({"size_m": [100.0, 18.0]}, [lane], 16.0, 60.0)
    assert area(found) == pytest.approx(1800.0, abs=1.0)
