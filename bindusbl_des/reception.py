"""What becomes of a ping at the ASVs in range, and the fix they make of it together."""

from math import erfc, hypot, sqrt
from typing import NamedTuple

import numpy as np

from .acoustics import loss_probability
from .compiled import compiled
from .events import COLLIDED, HEARD, IN_FLIGHT, LOST, OUT_OF_RANGE
from .fusion import fuse_pair
from .motion import Floats, Ints, where
from .propagation import (
    ARRIVED_AT,
    AT_ASV,
    HEARD_BY,
    OF_AUV,
    OF_PING,
    OUTCOME,
    PING_X,
    PING_Z,
    SENT_AT,
    SLANT_RANGE,
    TRAVEL_TIME,
)
from .usbl import NOISE_WIDTH, locate

# Arrivals that overlap by less (s) only touch: rounding of the instants is far smaller.
TOUCH = 1e-9

# A fix: position and its standard deviations (m), covariances xy, xz, yz (m2), horizontal error (m)
ESTIMATE = 10


NOBODY = -1


class Loss(NamedTuple):
    """How likely a ping is lost on its way (:func:`.acoustics.loss_probability`)."""

    coefficients: Floats
    combine: int
    contention: float
    cap: float


@compiled
def overlapped(
    row: int, count: int, duration: float, longest: float, pings: Floats, receptions: Floats
) -> bool:
    """Tell whether another ping overlaps this one at its ASV; touching is no overlap.

    `duration` is that of a ping and `longest` the longest travel time (s) of any in range: what was
    sent earlier than both before this arrival is over, and so is the search.
    """
    mine = receptions[row]
    starts, ends = mine[ARRIVED_AT], mine[ARRIVED_AT] + duration
    for k in range(count - 1, -1, -1):
        other = receptions[k]
        if pings[int(other[OF_PING]), SENT_AT] + longest + duration < starts:
            break
        if other[AT_ASV] == mine[AT_ASV] and k != row and other[OUTCOME] != OUT_OF_RANGE:
            begins = other[ARRIVED_AT]
            if begins < ends - TOUCH and begins + duration > starts + TOUCH:
                return True
    return False


@compiled
def settle(
    first: int, end: int, count: int, caller: int, called: float, duration: float, longest: float,
    pings: Floats, receptions: Floats, coefficients: Floats, combine: int, contention: float,
    cap: float, asv_table: Floats, asv_first: Ints, asv_step: float, array: Floats, metric: Floats,
    levels: Floats, shelf: Ints, taken: Ints, blocks: Floats, estimate: Floats, hearers: Ints,
) -> int:  # fmt: skip
    """Decide the receptions first..end of one ping, fuse what was heard; return by how many.

    `count` receptions are on record; `duration` and `longest` as in :func:`overlapped`.  An ASV
    `caller` that called the AUV ranges by the round trip, of which `called` (s) was its call (eq.
    rtt; the turnaround is known and removed).  The fix is written to `estimate` (ESTIMATE,), the
    ASVs that heard to `hearers`.  Where an ASV's noise is used up, nothing is done and NOBODY - its
    number returned: it must be refilled first.
    """
    for row in range(first, end):
        line = receptions[row]
        auv, asv = int(line[OF_AUV]), int(line[AT_ASV])
        if line[OUTCOME] == IN_FLIGHT and taken[auv, asv] == blocks.shape[1]:
            return NOBODY - asv
    heard = 0
    source = pings[int(receptions[first, OF_PING]), PING_X : PING_Z + 1]
    fix, covariance = np.zeros(3), np.zeros((3, 3))
    for row in range(first, end):
        line = receptions[row]
        if line[OUTCOME] != IN_FLIGHT:
            continue
        auv, asv = int(line[OF_AUV]), int(line[AT_ASV])
        noise = blocks[shelf[auv, asv], taken[auv, asv]]
        taken[auv, asv] += 1  # whatever comes of it, so that worlds that differ share their noise
        chance = 0.5 * erfc(-noise[NOISE_WIDTH] / sqrt(2.0))  # uniform, of a standard normal
        if overlapped(row, count, duration, longest, pings, receptions):
            line[OUTCOME] = COLLIDED
        elif chance < loss_probability(line[SLANT_RANGE], coefficients, combine, contention, cap):
            line[OUTCOME] = LOST
        else:
            line[OUTCOME] = HEARD
            x, y, z, yaw = where(asv_table, asv_first, asv_step, asv, line[ARRIVED_AT])
            travelled = line[TRAVEL_TIME]
            if asv == caller:
                travelled = (called + travelled) / 2
            measured, spread = locate(
                source, np.array((x, y, z)), yaw, travelled, noise[:NOISE_WIDTH], array, metric,
                levels,
            )  # fmt: skip
            if heard == 0:
                fix, covariance = measured, spread
            else:
                fix, covariance = fuse_pair(fix, covariance, measured, spread)
            hearers[heard] = asv
            heard += 1
    pings[int(receptions[first, OF_PING]), HEARD_BY] += heard
    for axis in range(3):
        estimate[axis], estimate[3 + axis] = fix[axis], sqrt(max(covariance[axis, axis], 0.0))
    estimate[6], estimate[7], estimate[8] = covariance[0, 1], covariance[0, 2], covariance[1, 2]
    estimate[9] = hypot(fix[0] - source[0], fix[1] - source[1])
    return heard
