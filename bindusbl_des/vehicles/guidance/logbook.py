"""The log of a fleet under way: how its lines are written."""

from math import hypot

import numpy as np

from ...core.arrays import Floats
from ...core.compiled import compiled, inlined
from ..hulls import rk4
from ..hulls.frames import C_PSI, S_PSI
from ..hulls.rk4 import MovedVehicle
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

# A line that is being written: the columns of the log, and what else the next one follows from: the
# speed (m/s), cosine and sine of the yaw.
SPEED, C_YAW, S_YAW, NOTES = range(COLUMNS, COLUMNS + 4)


@inlined
def take_up(log: Floats, number: int, depth: float) -> Floats:
    """Return a line that goes on from what has summed up in a log, of a vehicle so deep (m)."""
    line = np.zeros(NOTES)
    for column in (COS, SIN, DISTANCE):
        line[column] = log[number, column]
    line[Z] = depth
    return line


@inlined
def begin(vehicle: MovedVehicle, line: Floats) -> None:
    """Write where a vehicle is that has looked; what has summed up stays as it is.

    Of a vehicle at the surface so does the depth.
    """
    state, rates = vehicle.state, vehicle.rates
    line[X], line[Y] = state[0], state[1]
    line[RATES + X], line[RATES + Y] = rates[0], rates[1]
    if state.size >= rk4.PITCHING_STATE:
        line[Z], line[YAW] = state[2], state[5]
        line[RATES + Z], line[RATES + YAW] = rates[2], rates[5]
    else:
        line[YAW], line[RATES + YAW] = state[2], rates[2]
    line[SPEED] = hypot(rates[0], rates[1])
    line[C_YAW], line[S_YAW] = vehicle.angles[C_PSI], vehicle.angles[S_PSI]


@inlined
def _bearing(line: Floats) -> Bearing:
    return Bearing(line[C_YAW], line[S_YAW], line[RATES + YAW])


@inlined
def _stride(line: Floats) -> Stride:
    return Stride(line[X], line[Y], line[RATES + X], line[RATES + Y], line[SPEED])


@compiled
def go_on(vehicle: MovedVehicle, step: float, line: Floats) -> None:
    """Write the next line of a vehicle, a step (s) later."""
    bearing, stride = _bearing(line), _stride(line)
    begin(vehicle, line)
    ahead, aside = turned_over(bearing, _bearing(line), step)
    line[COS] += ahead
    line[SIN] += aside
    line[DISTANCE] += walked(stride, _stride(line), step)


@compiled
def keep(line: Floats, log: Floats, number: int) -> None:
    """Enter a line in a log."""
    for column in range(COLUMNS):
        log[number, column] = line[column]
