"""The log of a fleet under way: how its lines are written, and how far beside a path they lie."""

from math import ceil

from ..compiled import compiled
from ..dynamics.frames import Floats
from ..logs import COS, DISTANCE, SIN, X, Y, sums
from . import tracks
from .tracks import Ints


@compiled
def note(log: Floats, line: int, step: float, spot: Floats) -> None:
    """Write the line of one boundary: place and rates there, and what has summed up to it.

    `spot` (8 or more,) begins like a line.
    """
    for i in range(COS):
        log[line, i] = spot[i]
    if line == 0:
        log[0, COS] = log[0, SIN] = log[0, DISTANCE] = 0.0
        return
    summed = sums(log, line - 1, step, spot)
    log[line, COS], log[line, SIN], log[line, DISTANCE] = summed


@compiled
def beside(
    table: Floats, times: Floats, control: float, active: Ints, rows: Floats, bounds: Ints,
    errors: Floats,
) -> None:  # fmt: skip
    """Write how far (m) each line of `table` (n, 7) lies from the path flown then.

    `active` (intervals,) is the row of the path that was flown in each control interval.
    """
    for k in range(times.size):
        interval = min(
            max(ceil(times[k] / control) - 1, 0), active.size - 1
        )  # at T_k, the one before
        errors[k] = tracks.distance_from(rows, bounds, active[interval], table[k, X], table[k, Y])
