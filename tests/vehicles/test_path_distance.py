"""How far a place is from a path: the nearest of the row that is flown and those beside it."""

from itertools import pairwise
from math import cos, pi, remainder, sin
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from voyages import way

from bindusbl_des.core.vehicles.guidance import tracks
from bindusbl_des.support.compiled import compiled

Floats = NDArray[np.float64]

STEP = 0.01  # m between the samples of a path that places are held against


@compiled
def distances(rows: Any, bounds: Any, row: int, places: Floats, found: Floats) -> None:
    """Write how far (m) places (n, 2) are from the path about one of its rows."""
    for k in range(len(places)):
        found[k] = tracks.distance_from(rows, bounds[0], row, places[k, 0], places[k, 1])


@compiled
def placed(rows: Any, bounds: Any, progress: Any, north: float, east: float) -> tuple[float, float]:
    """Return the cross-track error (m) at a place, and its path's heading (rad)."""
    point = tracks.locate(rows, bounds[0], progress[0], north, east)
    return point.cross, point.yaw


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_past_a_path_that_ends_in_an_arc_it_is_taken_as_straight(side: float) -> None:
    """A right angle of radius 8 m, turned by 0.4 rad; past its end, so far on and so far aside."""
    x, y, turned, bend, on, aside = 3.0, -7.0, 0.4, side / 8.0, 2.0, 1.5
    packed = tracks.pack([way((bend, 4.0 * pi), begin=(x, y, turned))])
    yaw = turned + side * pi / 2
    ahead, across = 8.0, side * 8.0  # the end of the arc, in the frame of its beginning
    north = x + ahead * cos(turned) - across * sin(turned)
    east = y + ahead * sin(turned) + across * cos(turned)
    north, east = north + on * cos(yaw) - aside * sin(yaw), east + on * sin(yaw) + aside * cos(yaw)
    found = placed(packed.rows, packed.bounds, np.zeros(1, tracks.PROGRESS), north, east)
    assert found == pytest.approx((aside, yaw), abs=1e-9)


# Lanes joined by half circles of either side, a short straight between two arcs, a long bend
WAYS = [
    [(0.0, 40.0), (0.25, 4.0 * pi), (0.0, 40.0), (-0.25, 4.0 * pi), (0.0, 40.0)],
    [(0.1, 15.0), (0.0, 0.5), (-0.2, 12.0), (0.05, 90.0), (0.0, 3.0)],
]


@pytest.mark.parametrize("parts", WAYS)
def test_no_row_that_is_nearest_is_left_out(parts: list[tuple[float, float]]) -> None:
    path = way(*parts, begin=(3.0, -7.0, 0.4))
    packed, random = tracks.pack([path]), np.random.default_rng(4)
    joints = np.concatenate(([0.0], np.cumsum([length for _, length in parts])))
    lines = [
        path.sample(np.linspace(begin, end, int((end - begin) / STEP) + 2))[:, :2]
        for begin, end in pairwise(joints)
    ]
    for row in range(len(parts)):
        about = np.concatenate(lines[max(row - 1, 0) : row + 2])
        ends = lines[row][[0, -1]]  # near them another row may be the nearest
        near = np.concatenate((random.choice(about, 100), random.choice(ends, 100)))
        places = near + 10.0 ** random.uniform(-1.0, 1.5, (200, 1)) * random.normal(size=(200, 2))
        found = np.zeros(len(places))
        distances(packed.rows, packed.bounds, row, places, found)
        away = places[:, np.newaxis] - about
        sampled = np.hypot(away[..., 0], away[..., 1]).min(axis=1)
        assert (found <= sampled + 1e-9).all()
        assert (sampled <= found + STEP).all()


def found_from(path: Any, start: float, place: tuple[float, float]) -> tuple[float, ...]:
    """Return cross-track error (m), heading, its cosine and sine, curvature, and what is left (m),
    as a vehicle finds them that has come so far (m) along a path.
    """
    packed, progress = tracks.pack([path]), np.zeros(1, tracks.PROGRESS)[0]
    for along in np.arange(0.0, start, 0.5):
        tracks.locate(packed.rows, packed.bounds[0], progress, *path.at(along)[:2])
    return tuple(tracks.locate(packed.rows, packed.bounds[0], progress, *place))


@pytest.mark.parametrize("bend", [0.0, 0.05, -0.05])
def test_starboard_of_the_path_is_positive(bend: float) -> None:
    """A vehicle 1.5 m to starboard of a line or a circle finds +1.5 m, heading and distance."""
    path = way((bend, 50.0), begin=(3.0, -2.0, 0.7))
    for along in (0.5, 20.0, 49.0):
        x, y, yaw = path.at(along)
        place = (x - 1.5 * sin(yaw), y + 1.5 * cos(yaw))
        cross, heading, *direction, curvature, left = found_from(path, along, place)
        assert direction == [cos(heading), sin(heading)]
        assert cross == pytest.approx(1.5, abs=1e-9)
        assert remainder(heading - yaw, 2 * pi) == pytest.approx(0.0, abs=1e-9)
        assert (curvature, left) == pytest.approx((bend, 50.0 - along), abs=1e-9)


def test_a_neighbouring_lane_is_not_mistaken_for_ones_own() -> None:
    """Carried 9 m sideways, next to the lane 10 m away, a vehicle still knows its own."""
    path = way(
        (0.0, 50.0), (pi / 10.0, 5.0), (0.0, 10.0 - 20.0 / pi), (pi / 10.0, 5.0), (0.0, 50.0)
    )
    cross, *_, left = found_from(path, 25.0, (25.0, 9.0))
    assert cross == pytest.approx(9.0)
    assert left == pytest.approx(path.length - 25.0)
