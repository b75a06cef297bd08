"""The log of a fleet under way: how its lines are written, and how far beside a path they lie."""

from math import ceil

from ...core.compiled import compiled, entry
from ...records.rows import Row, Rows
from ..hulls.frames import Floats
from ..logs import COS, DISTANCE, RATES, SIN, YAW, X, Y, Z, distance, headings
from . import tracks
from .belief import Spot
from .tracks import Ints


@compiled
def note(log: Floats, line: int, step: float, spot: Spot) -> None:
    """Write the line of one boundary: place and rates there, and what has summed up to it."""
    log[line, X], log[line, Y], log[line, Z], log[line, YAW] = spot.x, spot.y, spot.z, spot.yaw
    log[line, RATES + X], log[line, RATES + Y] = spot.north, spot.east
    log[line, RATES + Z], log[line, RATES + YAW] = spot.sinking, spot.turning
    if line == 0:
        log[0, COS] = log[0, SIN] = log[0, DISTANCE] = 0.0
        return
    log[line, COS], log[line, SIN] = headings(log, line - 1, step, spot.yaw, spot.turning)
    log[line, DISTANCE] = distance(log, line - 1, step, spot.x, spot.y, spot.north, spot.east)


@entry
def beside(
    table: Floats, times: Floats, control: float, active: Ints, rows: Rows, bounds: Row,
    errors: Floats,
) -> None:  # fmt: skip
    """Write how far (m) each line of `table` (n, 6) lies from the path flown then.

    `active` (intervals,) is the row of the path that was flown in each control interval.
    """
    for k in range(times.size):
        interval = min(
            max(ceil(times[k] / control) - 1, 0), active.size - 1
        )  # at T_k, the one before
        errors[k] = tracks.distance_from(rows, bounds, active[interval], table[k, X], table[k, Y])
