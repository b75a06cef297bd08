"""Planned paths as guidance reads them: where on its path a vehicle is, and how far beside it.

A path is rows of constant curvature, one after the other in one array for the whole fleet. A
vehicle is on one row at a time and never returns to an earlier one, so a neighbouring lane, however
close, is not mistaken for its own; within its row it is wherever the row comes closest.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, cos, hypot, inf, sin

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import compiled
from ...geometry.paths import BEGIN, CURVATURE, LENGTH, ROW_COLUMNS, YAW, Path, X, Y, path_rows
from ..hulls.frames import Floats
from .signals import half_turn

Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

# Where a vehicle's rows lie: the first, the one past the last, and where a tour begins again (or
# -1), then where a vehicle is: row, metres into it, metres of whole tours behind it
FIRST, END, AGAIN = range(3)
ROW, ALONG, LAPPED, PROGRESS = range(4)

ROWS_AT_ONCE = 16  # a fix may carry a vehicle past this many rows, no further


@dataclass(frozen=True)
class Tracks:
    """The paths of a fleet: `rows` (total, COLUMNS) and `bounds` (vehicles, 3) into them."""

    rows: Floats
    bounds: Ints


def nowhere(count: int) -> Tracks:
    """Return the paths of vehicles that keep stations: no rows at all."""
    return Tracks(np.zeros((0, ROW_COLUMNS)), np.zeros((count, 3), dtype=np.int64))


def pack(paths: Sequence[Path]) -> Tracks:
    """Return the paths of a fleet as arrays; a tour gets a joint where it repeats."""
    rows: list[Floats] = []
    bounds = np.empty((len(paths), 3), dtype=np.int64)
    first = 0
    for vehicle, path in enumerate(paths):
        own, again = path_rows(path)
        rows.append(own)
        bounds[vehicle] = first, first + len(own), first + again if again >= 0 else -1
        first += len(own)
    return Tracks(np.concatenate(rows), bounds)


@compiled
def _into(row: Floats, north: float, east: float, near: float) -> float:
    """Return how far into a row (m) it comes closest to a place; on a circle, close to `near`."""
    bend, yaw = row[CURVATURE], row[YAW]
    if bend == 0.0:
        along: float = (north - row[X]) * cos(yaw) + (east - row[Y]) * sin(yaw)
        return along
    ahead = north - row[X] + sin(yaw) / bend  # from the centre of the circle
    aside = east - row[Y] - cos(yaw) / bend
    heading = atan2(bend * ahead, -bend * aside)
    turned: float = half_turn(heading - yaw - bend * near) / bend
    return near + turned


@compiled
def _next(row: int, bounds: Ints) -> int:
    """Return the row that follows, or -1 at a path's end."""
    return row + 1 if row + 1 < bounds[END] else bounds[AGAIN]


@compiled
def locate(
    rows: Floats, bounds: Ints, progress: Floats, north: float, east: float
) -> tuple[float, float, float, float]:
    """Find a place on its path: cross-track error (m, positive to starboard), the path's heading
    (rad) and curvature (1/m, positive to starboard) there, and what is left of the path (m).

    `progress` (PROGRESS,) is where the vehicle was before, and is brought up to date. Before the
    beginning of an arc and past a path's end the path is taken as straight; a tour has no end, and
    what is left of it is infinite. Source: Fossen 2021, section 12.5 (path-tangential frame).
    """
    row = int(progress[ROW])
    # A believed place may jump beyond a tight circle's centre: measured from within the arc, that
    # is no turn backwards which would have to be unwound.
    near = min(max(progress[ALONG], 0.0), rows[row, LENGTH])
    into = _into(rows[row], north, east, near)
    for _ in range(ROWS_AT_ONCE):
        following = _next(row, bounds)
        if into < rows[row, LENGTH] or following < 0:
            break
        if following <= row:
            last = bounds[END] - 1
            progress[LAPPED] += rows[last, BEGIN] + rows[last, LENGTH] - rows[following, BEGIN]
        row = following
        into = _into(rows[row], north, east, 0.0)
    progress[ROW], progress[ALONG] = row, into
    left = inf
    if bounds[AGAIN] < 0:
        last = bounds[END] - 1
        left = rows[last, BEGIN] + rows[last, LENGTH] - rows[row, BEGIN] - into
    bend = rows[row, CURVATURE]
    length = rows[row, LENGTH]
    if bend != 0.0 and 0.0 <= into <= length:
        ahead = north - rows[row, X] + sin(rows[row, YAW]) / bend
        aside = east - rows[row, Y] - cos(rows[row, YAW]) / bend
        radius = hypot(ahead, aside)
        cross = 1.0 / bend - (radius if bend > 0.0 else -radius)
        return cross, rows[row, YAW] + bend * into, bend, left
    yaw = rows[row, YAW] + bend * (0.0 if into < 0.0 else length)
    x, y = rows[row, X], rows[row, Y]
    if bend != 0.0 and into > length:
        x += (sin(yaw) - sin(rows[row, YAW])) / bend
        y -= (cos(yaw) - cos(rows[row, YAW])) / bend
    return (east - y) * cos(yaw) - (north - x) * sin(yaw), yaw, 0.0, left


@compiled
def bend_ahead(rows: Floats, bounds: Ints, progress: Floats, ahead: float) -> float:
    """Return the path's curvature (1/m) `ahead` metres past where the vehicle is."""
    row = int(progress[ROW])
    into = progress[ALONG] + ahead
    for _ in range(ROWS_AT_ONCE):
        following = _next(row, bounds)
        if into < rows[row, LENGTH] or following < 0:
            break
        into -= rows[row, LENGTH]
        row = following
    bend: float = rows[row, CURVATURE] if 0.0 <= into < rows[row, LENGTH] else 0.0
    return bend


@compiled
def travelled(rows: Floats, progress: Floats) -> float:
    """Return how far along its path, whole tours included, a vehicle has come (m)."""
    distance: float = progress[LAPPED] + rows[int(progress[ROW]), BEGIN] + progress[ALONG]
    return distance


@compiled
def _beside(row: Floats, north: float, east: float) -> float:
    """Return the distance (m) of a place from one row of a path."""
    length, bend, yaw = row[LENGTH], row[CURVATURE], row[YAW]
    into = _into(row, north, east, 0.5 * length)
    if bend != 0.0 and 0.0 <= into <= length:
        ahead = north - row[X] + sin(yaw) / bend
        aside = east - row[Y] - cos(yaw) / bend
        beside: float = abs(hypot(ahead, aside) - 1.0 / abs(bend))
        return beside
    if bend == 0.0:
        into = min(max(into, 0.0), length)
        x, y = row[X] + into * cos(yaw), row[Y] + into * sin(yaw)
        return hypot(north - x, east - y)
    end = yaw + bend * length
    x = row[X] + (sin(end) - sin(yaw)) / bend
    y = row[Y] - (cos(end) - cos(yaw)) / bend
    return min(hypot(north - row[X], east - row[Y]), hypot(north - x, east - y))


@compiled
def distance_from(rows: Floats, bounds: Ints, row: int, north: float, east: float) -> float:
    """Return the distance (m) of a place from the row that is flown and the two beside it."""
    nearest = _beside(rows[row], north, east)
    following, before = _next(row, bounds), row - 1
    if following >= 0:
        nearest = min(nearest, _beside(rows[following], north, east))
    if row == bounds[AGAIN]:
        nearest = min(nearest, _beside(rows[bounds[END] - 1], north, east))
    if before >= bounds[FIRST]:
        nearest = min(nearest, _beside(rows[before], north, east))
    return nearest
