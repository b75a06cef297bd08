"""How far a place is from a path: the nearest of the row that is flown and those beside it."""

from itertools import pairwise
from math import pi

import numpy as np
import pytest
from numpy.typing import NDArray

from bindusbl_des.core.compiled import compiled
from bindusbl_des.geometry.paths import Path, Pose, Segment
from bindusbl_des.records.rows import Rows
from bindusbl_des.vehicles.guidance.tracks import distance_from, pack

Floats = NDArray[np.float64]

STEP = 0.01  # m between the samples of a path that places are held against


@compiled
def distances(rows: Rows, bounds: Rows, row: int, places: Floats, found: Floats) -> None:
    """Write how far (m) places (n, 2) are from the path about one of its rows."""
    for k in range(len(places)):
        found[k] = distance_from(rows, bounds[0], row, places[k, 0], places[k, 1])


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
