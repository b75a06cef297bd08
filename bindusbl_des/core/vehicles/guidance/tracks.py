"""Planned paths as guidance reads them: where on its path a vehicle is, and its cross-track error.

A path is rows of constant curvature; one array holds the rows of the whole fleet.  A vehicle is on
one row at a time and never returns to an earlier one, so that it does not mistake a neighbouring
lane, however close, for its own.  Within its row it is at the closest point.
"""

from collections.abc import Sequence
from math import atan2, cos, hypot, inf, sin
from typing import Annotated, NamedTuple

import numpy as np

from ....support.compiled import compiled, inlined
from ...geometry.paths import PATH_ROW, Path, path_rows
from ...records.rows import Row, Rows
from .sensing import half_turn

# The rows of a vehicle's path: the first, the one past the last, and the row where a tour repeats
# (or -1).  Its progress: row, distance along it (m), distance of completed laps (m)
BOUNDS = np.dtype([("first", "i8"), ("end", "i8"), ("again", "i8")])
PROGRESS = np.dtype([("row", "i8"), ("along", "f8"), ("lapped", "f8")])

# Rows of less curvature (1/m) are straight: about so distant a centre, positions lose all digits.
FLAT = 1e-10

ROWS_AT_ONCE = 16  # a fix may carry a vehicle past this many rows, no further
SURELY = 1e-6  # m: a difference of distances larger than this is no rounding


# A row of a path; cosine and sine of the heading at its beginning, and the position of that from
# the centre of its circle (m); centre and radius (m) of the circle, or of one that encloses a
# straight row
_NUMBERS = ("cosine", "sine", "centred_x", "centred_y", "centre_x", "centre_y", "radius")
TRACK_ROW = np.dtype([*PATH_ROW.descr, *((name, "f8") for name in _NUMBERS)])


class PathTracks(NamedTuple):
    """The paths of a fleet: `rows` (total,), TRACK_ROW, and `bounds` (vehicles,) into them."""

    rows: Annotated[Rows, TRACK_ROW]
    bounds: Annotated[Rows, BOUNDS]


class PathPoint(NamedTuple):
    """The closest point of a path.

    Cross-track error (m, positive to starboard); heading of the path (rad) with cosine and sine,
    and its curvature (1/m, positive to starboard); distance left on the path (m).
    """

    cross: float
    yaw: float
    cosine: float
    sine: float
    bend: float
    left: float


def nowhere(count: int) -> PathTracks:
    """Return empty paths, for vehicles that keep stations."""
    return PathTracks(np.zeros(0, dtype=TRACK_ROW), np.zeros(count, dtype=BOUNDS))


def pack(paths: Sequence[Path]) -> PathTracks:
    """Return the paths of a fleet as arrays; a tour gets a joint where it repeats."""
    rows: list[Rows] = []
    bounds = np.empty(len(paths), dtype=BOUNDS)
    first = 0
    for vehicle, path in enumerate(paths):
        own, again = path_rows(path)
        rows.append(own)
        bounds[vehicle] = first, first + len(own), first + again if again >= 0 else -1
        first += len(own)
    joined = np.concatenate(rows)
    prepared = np.zeros(len(joined), dtype=TRACK_ROW)
    for name in PATH_ROW.names or ():
        prepared[name] = joined[name]
    # by the mathematical library, as compiled code has it; numpy's own differ in the last bit
    prepared["cosine"] = [cos(yaw) for yaw in joined["yaw"].tolist()]
    prepared["sine"] = [sin(yaw) for yaw in joined["yaw"].tolist()]
    bends = np.abs(joined["curvature"]) > FLAT
    prepared["curvature"][~bends] = 0.0
    for name, side in (("centred_x", prepared["sine"]), ("centred_y", -prepared["cosine"])):
        prepared[name][bends] = side[bends] / joined["curvature"][bends]
    half = joined["length"] / 2.0
    for axis, along in (("x", "cosine"), ("y", "sine")):
        middle = np.where(bends, -prepared[f"centred_{axis}"], half * prepared[along])
        prepared[f"centre_{axis}"] = joined[axis] + middle
    prepared["radius"] = half
    prepared["radius"][bends] = 1.0 / np.abs(joined["curvature"][bends])
    return PathTracks(prepared, bounds)


@compiled
def _into(row: Row, north: float, east: float, near: float) -> float:
    """Return how far along a row (m) it is closest to a position; on a circle, near `near`."""
    bend = row.curvature
    if bend == 0.0:
        along: float = (north - row.x) * row.cosine + (east - row.y) * row.sine
        return along
    ahead = north - row.x + row.centred_x  # from the centre of the circle
    aside = east - row.y + row.centred_y
    heading = atan2(bend * ahead, -bend * aside)
    turned: float = half_turn(heading - row.yaw - bend * near) / bend
    return near + turned


@compiled
def _next(row: int, bounds: Row) -> int:
    """Return the row that follows, or -1 at a path's end."""
    return row + 1 if row + 1 < bounds.end else bounds.again


@compiled
def locate(rows: Rows, bounds: Row, progress: Row, north: float, east: float) -> PathPoint:
    """Return the closest point of a path to a position (m), and update `progress`.

    Before the beginning of an arc and past a path's end, the path continues straight; a tour has no
    end, and an infinite distance left.  Source: Fossen 2021, section 12.5 (path-tangential frame).
    """
    row = progress.row
    # An estimated position may jump beyond the centre of a tight circle: measured from within the
    # arc, this does not count as a turn backwards, which the vehicle would have to undo.
    near = min(max(progress.along, 0.0), rows[row].length)
    into = _into(rows[row], north, east, near)
    for _ in range(ROWS_AT_ONCE):
        following = _next(row, bounds)
        if into < rows[row].length or following < 0:
            break
        if following <= row:
            last = bounds.end - 1
            progress.lapped += rows[last].begin + rows[last].length - rows[following].begin
        row = following
        into = _into(rows[row], north, east, 0.0)
    progress.row, progress.along = row, into
    left = inf
    if bounds.again < 0:
        last = bounds.end - 1
        left = rows[last].begin + rows[last].length - rows[row].begin - into
    bend = rows[row].curvature
    length = rows[row].length
    if bend != 0.0 and 0.0 <= into <= length:
        ahead = north - rows[row].x + rows[row].centred_x
        aside = east - rows[row].y + rows[row].centred_y
        radius = hypot(ahead, aside)
        cross = 1.0 / bend - (radius if bend > 0.0 else -radius)
        yaw = rows[row].yaw + bend * into
        sine, cosine = sin(yaw), cos(yaw)
        return PathPoint(cross, yaw, cosine, sine, bend, left)
    x, y, yaw = rows[row].x, rows[row].y, rows[row].yaw
    sine, cosine = rows[row].sine, rows[row].cosine
    if bend != 0.0 and into > length:
        yaw += bend * length
        sine, cosine = sin(yaw), cos(yaw)
        x += (sine - rows[row].sine) / bend
        y -= (cosine - rows[row].cosine) / bend
    return PathPoint((east - y) * cosine - (north - x) * sine, yaw, cosine, sine, 0.0, left)


@compiled
def bend_ahead(rows: Rows, bounds: Row, progress: Row, ahead: float) -> float:
    """Return the path's curvature (1/m) `ahead` metres past where the vehicle is."""
    row = progress.row
    into = progress.along + ahead
    for _ in range(ROWS_AT_ONCE):
        following = _next(row, bounds)
        if into < rows[row].length or following < 0:
            break
        into -= rows[row].length
        row = following
    bend: float = rows[row].curvature if 0.0 <= into < rows[row].length else 0.0
    return bend


@compiled
def travelled(rows: Rows, progress: Row) -> float:
    """Return the distance (m) along its path that a vehicle has come, completed laps included."""
    distance: float = progress.lapped + rows[progress.row].begin + progress.along
    return distance


@compiled
def _distance_to(row: Row, north: float, east: float) -> float:
    """Return the distance (m) of a place from one row of a path."""
    length, bend = row.length, row.curvature
    if bend == 0.0:
        into = min(max(_into(row, north, east, 0.0), 0.0), length)
        x, y = row.x + into * row.cosine, row.y + into * row.sine
        return hypot(north - x, east - y)
    if 0.0 <= _into(row, north, east, 0.5 * length) <= length:
        ahead = north - row.x + row.centred_x
        aside = east - row.y + row.centred_y
        distance: float = abs(hypot(ahead, aside) - row.radius)
        return distance
    yaw = row.yaw + bend * length
    sine, cosine = sin(yaw), cos(yaw)
    x = row.x + (sine - row.sine) / bend
    y = row.y - (cosine - row.cosine) / bend
    return min(hypot(north - row.x, east - row.y), hypot(north - x, east - y))


@inlined
def _may_be_within(distance: float, row: Row, north: float, east: float) -> bool:
    """Tell whether a row may be closer than `distance` (m) to a position (m), by its circle."""
    ahead, aside = north - row.centre_x, east - row.centre_y
    reach = row.radius + distance + SURELY
    within: bool = ahead * ahead + aside * aside <= reach * reach
    return within


@compiled
def distance_from(rows: Rows, bounds: Row, row: int, north: float, east: float) -> float:
    """Return the distance (m) of a position from the active row of a path and the two beside it."""
    nearest = _distance_to(rows[row], north, east)
    last_of_lap = bounds.end - 1 if row == bounds.again else -1
    before = row - 1 if row > bounds.first else -1
    for other in (_next(row, bounds), last_of_lap, before):
        if other >= 0 and _may_be_within(nearest, rows[other], north, east):
            nearest = min(nearest, _distance_to(rows[other], north, east))
    return nearest
