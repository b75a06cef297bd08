"""How much of a survey vehicles sweep by an instant: on a grid, by their true tracks.

A point is swept once a vehicle has passed within half a swath of it horizontally.
"""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from ...support.arrays import Floats, Ints
from ...support.compiled import compiled
from ..geometry.area import Area
from .vehicle import Vehicle

# Cells are this share of a swath wide, unless cells or track positions would exceed these numbers.
CELL = 1 / 8
MOST_CELLS, MOST_PLACES = 250_000, 250_000

# A track is straight between positions so many cells apart, or so close in time (s).
STEP, SHORTEST_S = 2.0, 1e-3

# Swaths that touch may part by this share of half a swath: rounding.
TOUCHING = 1e-9

# Cells coarser than this share of a swath are useless.
COARSEST = 0.5

# A vehicle more than this (m) above its depth is climbing to the surface.
LEVEL_M = 0.1


class Sweep(NamedTuple):
    """For each cell: when it was first swept (s; infinite: never), by which vehicle, and which
    share of it lies in the survey.
    """

    at_s: Floats
    by: NDArray[np.int64]
    share: Floats
    cell_m2: float

    def area(self, times: Floats, vehicle: int | None = None) -> Floats:
        """Return the area (m2) swept by instants (n,), s: by all vehicles, or first by one."""
        mine = slice(None) if vehicle is None else self.by == vehicle
        at = self.at_s[mine]
        order = np.argsort(at, kind="stable")
        swept = self.cell_m2 * np.cumsum(np.append(0.0, self.share[mine][order]))
        return np.asarray(swept[np.searchsorted(at[order], times, side="right")])


def sweep(
    area: Area,
    vehicles: Sequence[Vehicle],
    swaths: Sequence[float | None],
    until: float,
    depths: Sequence[float] | None = None,
) -> Sweep | None:
    """Return the parts of a survey that vehicles sweep until an instant (s), or None.

    Each vehicle has a swath (m), or None.  Cells lie along the longer side of the smallest
    rectangle about the survey.  A cell is swept with its middle, so the edge of the swept area is
    off by at most half a cell; it counts with its share in the survey.  Vehicles sweep nothing
    while they are above their `depths` (m).  The result is None without swaths, or when survey or
    tracks are too large for useful cells.
    """
    wide = {number: swath for number, swath in enumerate(swaths) if swath is not None}
    if not wide:
        return None
    sweeping, least = list(wide), min(wide.values())
    vehicles = [vehicles[number] for number in sweeping]
    depths = None if depths is None else [depths[number] for number in sweeping]
    turn = _axes(area)  # columns: along the cells' axes
    corners = np.asarray(area.outline) @ turn
    (x_min, y_min), (x_max, y_max) = corners.min(axis=0), corners.max(axis=0)
    ways = sum(vehicle.distance(until) for vehicle in vehicles)
    cell = max(
        CELL * least,
        math.sqrt((x_max - x_min) * (y_max - y_min) / MOST_CELLS),
        ways / STEP / MOST_PLACES,
    )
    if cell > COARSEST * least:
        return None
    # a survey thinner than half a cell has one row of cells along its middle
    x_min, y_min = (
        low if high - low > cell / 2 else (low + high - cell) / 2
        for low, high in ((x_min, x_max), (y_min, y_max))
    )
    x, y = (
        np.arange(low + cell / 2, max(high, low + cell), cell)
        for low, high in ((x_min, x_max), (y_min, y_max))
    )
    times, ends, begins, who = _passed(vehicles, STEP * cell, until, depths)
    # the first stretch of a track that passes each cell
    first = np.full((len(x), len(y)), len(times))
    halves = np.array([wide[number] / 2 for number in sweeping])[who]
    _look_around(first, ends @ turn, begins @ turn, x_min, y_min, cell, halves)
    who = np.append(np.array(sweeping)[who], -1)
    at, by = np.append(times, np.inf)[first].ravel(), who[first].ravel()
    if area.is_rectangle:
        # no product of matrices: threads of BLAS wait for each other where the machine is busy
        along, across = (them.ravel() for them in np.meshgrid(x, y, indexing="ij"))
        middles = np.stack([a * along + b * across for a, b in turn], axis=-1)
        share = area.contains(middles).astype(np.float64)
    else:
        share = _shares(tuple(map(tuple, corners.tolist())), tuple(x), tuple(y), cell)
    within = share > 0.0
    cell_m2 = area.square_m / (float(share.sum()) or 1.0)
    return Sweep(at[within], by[within], share[within], cell_m2)


@lru_cache(maxsize=8)  # missions share it, and may ask for it each
def _shares(
    corners: tuple[tuple[float, ...], ...], x: tuple[float, ...], y: tuple[float, ...], cell: float
) -> Floats:
    """Return the share of each square cell in a polygon, row by row; `x`, `y` are middles (m)."""
    shape, half = shapely.Polygon(corners), cell / 2
    shapely.prepare(shape)
    along, across = (them.ravel() for them in np.meshgrid(x, y, indexing="ij"))
    squares = shapely.box(along - half, across - half, along + half, across + half)
    share: Floats = shapely.contains_properly(shape, squares).astype(np.float64)
    cut = shapely.intersects(shape, squares) & (share == 0.0)
    share[cut] = shapely.area(shapely.intersection(squares[cut], shape)) / cell**2
    return share


@compiled
def _look_around(
    first: Ints, ends: Floats, begins: Floats, x_min: float, y_min: float, cell: float,
    halves: Floats,
) -> None:  # fmt: skip
    """Note for each cell, unless noted, the first stretch of track whose swath holds its middle.

    Stretches go from `begins` to `ends` (n, 2) and have half swaths `halves` (n,), in m along the
    axes of the cells.
    """
    for k in range(len(ends)):
        reach, near = math.ceil(halves[k] / cell + STEP), (halves[k] * (1.0 + TOUCHING)) ** 2
        x, y = ends[k, 0], ends[k, 1]
        back_x, back_y = begins[k, 0] - x, begins[k, 1] - y
        square = max(back_x**2 + back_y**2, 1e-12)
        column, row = math.floor((x - x_min) / cell), math.floor((y - y_min) / cell)
        for i in range(max(column - reach, 0), min(column + reach + 1, first.shape[0])):
            for j in range(max(row - reach, 0), min(row + reach + 1, first.shape[1])):
                if first[i, j] <= k:
                    continue
                off_x, off_y = x_min + cell * (i + 0.5) - x, y_min + cell * (j + 0.5) - y
                share = min(max((off_x * back_x + off_y * back_y) / square, 0.0), 1.0)
                if (off_x - share * back_x) ** 2 + (off_y - share * back_y) ** 2 <= near:
                    first[i, j] = k


def _axes(area: Area) -> Floats:
    """Return unit vectors (2, 2), in columns, along the sides of an area's smallest rectangle.

    The axes of the survey are taken where they give a rectangle as small.
    """
    outline, box = np.asarray(area.outline), area.box
    least: Any = shapely.minimum_rotated_rectangle(shapely.Polygon(outline))
    if least.area > (1.0 - 1e-6) * (box.x_max - box.x_min) * (box.y_max - box.y_min):
        return np.eye(2)
    sides = np.diff(np.array(least.exterior.coords)[:3], axis=0)
    along = sides[np.argmax(np.linalg.norm(sides, axis=1))]
    along = along / np.linalg.norm(along)
    return np.array([[along[0], -along[1]], [along[1], along[0]]])


def _sampled(vehicle: Vehicle, step: float, until: float) -> tuple[Floats, Floats]:
    """Return instants (n,), s, at most `step` (m) of track apart, and the positions (n, 3), m."""
    whole = vehicle.distance(until)
    times = np.linspace(0.0, until, math.ceil(whole / step) + 1)
    while True:
        places = vehicle.sample(times)[:, :3]
        gone, took = np.hypot(*np.diff(places[:, :2], axis=0).T), np.diff(times)
        if whole - gone.sum() > step:  # it went out and back between two of them
            gone = np.diff([vehicle.distance(time) for time in times.tolist()])
        pieces = np.where(took > SHORTEST_S, np.ceil(gone / step * (1.0 - TOUCHING)), 1.0)
        pieces = np.maximum(pieces, 1.0).astype(np.int64)
        if (pieces == 1).all():
            return times, places
        behind = np.arange(pieces.sum()) - np.repeat(np.cumsum(pieces) - pieces, pieces)
        start = np.repeat(times[:-1], pieces) + behind * np.repeat(took / pieces, pieces)
        times = np.append(start, until)


def _passed(
    vehicles: Sequence[Vehicle], step: float, until: float, depths: Sequence[float] | None
) -> tuple[Floats, Floats, Floats, NDArray[np.int64]]:
    """Return stretches of all tracks by time: instants (n,), s, ends and begins (n, 2), m, vehicle.

    A stretch is at most `step` (m) long.  The first one of a vehicle, and the one at which it is
    down again after a climb, begins where it ends.
    """
    sampled = [_sampled(vehicle, step, until) for vehicle in vehicles]
    times, places = [at for at, _ in sampled], [way for _, way in sampled]
    before = [np.concatenate((way[:1], way[:-1])) for way in places]
    if depths is not None:
        deep = [way[:, 2] > depth - LEVEL_M for way, depth in zip(places, depths, strict=True)]
        for way, back, kept in zip(places, before, deep, strict=True):
            from_above = np.flatnonzero(~kept[:-1]) + 1
            back[from_above] = way[from_above]
        times, places, before = (
            [rows[kept] for rows, kept in zip(them, deep, strict=True)]
            for them in (times, places, before)
        )
    who = np.repeat(np.arange(len(vehicles)), [len(at) for at in times])
    together = np.concatenate(times)
    order = np.argsort(together, kind="stable")
    to, since = (np.concatenate(them)[order, :2] for them in (places, before))
    return together[order], to, since, who[order]
