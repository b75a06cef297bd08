"""How far a place is from a path: the nearest of the row that is flown and those beside it."""

from itertools import pairwise
from math import cos, pi, sin

import numpy as np
import pytest
from numpy.typing import NDArray

from bindusbl_des.core.compiled import compiled
from bindusbl_des.geometry.paths import Path, Pose, Segment
from bindusbl_des.records.rows import Rows
from bindusbl_des.vehicles.guidance.tracks import PROGRESS, distance_from, locate, pack

Floats = NDArray[np.float64]

STEP = 0.01  # m between the samples of a path that places are held against


@compiled
def distances(rows: Rows, bounds: Rows, row: int, places: Floats, found: Floats) -> None:
    """Write how far (m) places (n, 2) are from the path about one of its rows."""
    for k in range(len(places)):
        found[k] = distance_from(rows, bounds[0], row, places[k, 0], places[k, 1])


@compiled
def placed(
    rows: Rows, bounds: Rows, progress: Rows, north: float, east: float
) -> tuple[float, float]:
    """Return the cross-track error (m) at a place, and its path's heading (rad)."""
    point = locate(rows, bounds[0], progress[0], north, east)
    return point.cross, point.yaw


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_past_a_path_that_ends_in_an_arc_it_is_taken_as_straight(side: float) -> None:
    """A right angle of radius 8 m, turned by 0.4 rad; past its end, so far on and so far aside."""
    begin, bend, on, aside = Pose(3.0, -7.0, 0.4), side / 8.0, 2.0, 1.5
    tracks = pack([Path(begin, (Segment(bend, 4.0 * pi),))])
    yaw = begin.yaw + side * pi / 2
    ahead, across = 8.0, side * 8.0  # the end of the arc, in the frame of its beginning
    north = begin.x + ahead * cos(begin.yaw) - across * sin(begin.yaw)
    east = begin.y + ahead * sin(begin.yaw) + across * cos(begin.yaw)
    north, east = north + on * cos(yaw) - aside * sin(yaw), east + on * sin(yaw) + aside * cos(yaw)
    found = placed(tracks.rows, tracks.bounds, np.zeros(1, PROGRESS), north, east)
    assert found == pytest.approx((aside, yaw), abs=1e-9)


# Lanes joined by half circles of either side, a short straight between two arcs, a long bend
WAYS = [
    [(0.0, 40.0), (0.25, 4.0 * pi), (0.0, 40.0), (-0.25, 4.0 * pi), (0.0, 40.0)],
    [(0.1, 15.0), (0.0, 0.5), (-0.2, 12.0), (0.05, 90.0), (0.0, 3.0)],
]


@pytest.mark.parametrize("way", WAYS)
def test_no_row_that_is_nearest_is_left_out(way: list[tuple[float, float]]) -> None:
    path = Path(Pose(3.0, -7.0, 0.4), tuple(Segment(*it) for it in way))
    tracks, random = pack([path]), np.random.default_rng(4)
    joints = np.concatenate(([0.0], np.cumsum([length for _, length in way])))
    lines = [
        path.sample(np.linspace(begin, end, int((end - begin) / STEP) + 2))[:, :2]
        for begin, end in pairwise(joints)
    ]
    for row in range(len(way)):
        about = np.concatenate(lines[max(row - 1, 0) : row + 2])
        ends = lines[row][[0, -1]]  # near them another row may be the nearest
        near = np.concatenate((random.choice(about, 100), random.choice(ends, 100)))
        places = near + 10.0 ** random.uniform(-1.0, 1.5, (200, 1)) * random.normal(size=(200, 2))
        found = np.zeros(len(places))
        distances(tracks.rows, tracks.bounds, row, places, found)
        away = places[:, np.newaxis] - about
        sampled = np.hypot(away[..., 0], away[..., 1]).min(axis=1)
        assert (found <= sampled + 1e-9).all()
        assert (sampled <= found + STEP).all()
