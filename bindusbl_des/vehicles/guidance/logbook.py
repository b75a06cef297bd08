"""The log of a fleet under way: how its lines are written."""

from math import hypot

from ...core.compiled import compiled, inlined
from ..hulls import rk4
from ..hulls.frames import C_PSI, S_PSI, Floats
from ..hulls.rk4 import Four
from ..logs import (
    COLUMNS,
    COS,
    DISTANCE,
    RATES,
    SIN,
    YAW,
    Bearing,
    Stride,
    X,
    Y,
    Z,
    turned_over,
    walked,
)

# The lines of four vehicles, a column of the log in each row, and what else the next ones follow
# from: the speed (m/s), cosine and sine of the yaw. They lie behind what moves the four.
SPEED, C_YAW, S_YAW, NOTES = range(COLUMNS, COLUMNS + 4)
LINE = rk4.ROWS


@inlined
def take_up(logs: Floats, line: int, vehicle: int, lane: int, rows: Floats) -> None:
    """Have what has summed up so far in a vehicle's log, for it to go on in a lane."""
    for column in (COS, SIN, DISTANCE):
        rows[LINE + column, lane] = logs[vehicle, line, column]


@inlined
def begin(size: int, vehicles: Four, line: Floats) -> None:
    """Write where four vehicles are that have looked; what has summed up stays as it is.

    Of vehicles at the surface so does the depth.
    """
    state, rates = vehicles.state, vehicles.rates
    line[X], line[Y] = state[0], state[1]
    line[RATES + X], line[RATES + Y] = rates[0], rates[1]
    if size >= rk4.PITCHING_STATE:
        line[Z], line[YAW] = state[2], state[5]
        line[RATES + Z], line[RATES + YAW] = rates[2], rates[5]
    else:
        line[YAW], line[RATES + YAW] = state[2], rates[2]
    line[SPEED] = hypot(rates[0], rates[1])
    line[C_YAW], line[S_YAW] = vehicles.angles[C_PSI], vehicles.angles[S_PSI]


@inlined
def _bearing(line: Floats) -> Bearing:
    return Bearing(line[C_YAW], line[S_YAW], line[RATES + YAW])


@inlined
def _stride(line: Floats) -> Stride:
    return Stride(line[X], line[Y], line[RATES + X], line[RATES + Y], line[SPEED])


@compiled
def go_on(size: int, vehicles: Four, step: float, line: Floats) -> None:
    """Write the next line of four vehicles, a step (s) later."""
    bearing, stride = _bearing(line), _stride(line)
    begin(size, vehicles, line)
    ahead, aside = turned_over(bearing, _bearing(line), step)
    line[COS] += ahead
    line[SIN] += aside
    line[DISTANCE] += walked(stride, _stride(line), step)


@compiled
def keep(rows: Floats, logs: Floats, line: int, first: int, count: int) -> None:
    """Enter the lines of so many vehicles, of which one is the first, in their logs."""
    for lane in range(count):
        for column in range(COLUMNS):
            logs[first + lane, line, column] = rows[LINE + column, lane]
