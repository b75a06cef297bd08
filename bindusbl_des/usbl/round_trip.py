"""Where an AUV was when it answered a call: what an ASV makes of the whole way of both.

An ASV knows, by GNSS time, how long the sound was under way from the caller to the AUV and from
there to itself: call and answer together.  The two places of the AUV are those at which it heard
the call and at which it answered, a ping and a turnaround later.
"""

import math
from typing import NamedTuple

import numpy as np

from ..core.compiled import compiled
from ..vehicles.motion import Floats
from .vectors import NOTHING, Vector, divided, dot, length, minus, negative, scaled

# A share of the whole way below which a caller and an AUV are in line, and one cannot tell where.
IN_LINE = 1e-9


class OwnRange(NamedTuple):
    """How far (m) an AUV was from who heard its answer.

    `share` of an error of the path goes into the range; the AUV lies from the caller along the unit
    vector `bearing` (3,); the range grows by `lean` (3,) per metre across the direction.  In
    `doubt` (m2) it is whatever the errors only where the AUV lies between the two, where every
    range makes the same path.
    """

    reach: float
    share: float
    bearing: Vector
    lean: Vector
    doubt: float


class PathErrors(NamedTuple):
    """Variances (m2): of a path's own length, of the AUV's motion between call and answer, of what
    moves the whole fix of who heard it (GNSS), and of the GNSS of the caller if that is another
    (else 0).
    """

    timing: float
    motion: float
    gnss: float
    other_gnss: float


@compiled
def own_range(path: float, baseline: Vector, unit: Vector) -> OwnRange:
    """Return how far an AUV in a direction was, when call and answer took a `path` (m).

    `baseline` (3,), m, points from who heard the answer to where the call was sent: 0 for a caller
    that keeps its place, who takes half the path; others look for a point of an ellipse.

    >>> [round(x, 9) for x in own_range(100.0, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))[:2]]
    [50.0, 0.5]
    >>> aside = own_range(90.0, (0.0, 30.0, 0.0), (1.0, 0.0, 0.0))
    >>> round(aside[0], 9), round(90.0 - math.hypot(aside[0], 30.0), 9)
    (40.0, 40.0)
    """
    along, square = dot(unit, baseline), dot(baseline, baseline)
    whole = max(path, math.sqrt(square))
    rest = whole - along
    if rest <= IN_LINE * whole:
        return OwnRange(whole / 2, 0.5, negative(unit), NOTHING, square / 12)
    reach = (whole**2 - square) / (2 * rest)
    lean = divided(minus(baseline, scaled(unit, along)), rest)
    bearing = minus(scaled(unit, reach), baseline)
    way = length(bearing)
    if way <= IN_LINE * whole:
        return OwnRange(reach, 0.5, unit, lean, 0.0)
    return OwnRange(reach, (whole - reach) / rest, divided(bearing, way), lean, 0.0)


@compiled
def dated(
    covariance: Floats, unit: Vector, own: OwnRange, limit: float, errors: PathErrors
) -> Floats:
    """Return the covariance (4, 4), m2, of a fix by a range of one's own and of the call's way.

    The call's way is what remains of the path, and tells all others when the AUV answered.
    `covariance` (3, 3) is that of the direction and of the ASV's GNSS; the range errs by a share of
    the path's own error, of the AUV's motion, and where another ASV has called of both GNSS errors
    along the bearing, and it leans on the error of the direction.  However little the geometry
    tells, the AUV lies on an ellipse: neither direction nor path make more than a `limit` (m2) of
    it.
    """
    share, timing, motion = own.share, errors.timing, errors.motion
    tilt = np.zeros(3)  # covariance of the place with what the direction makes of the range
    variance = 0.0
    for i in range(3):
        for j in range(3):
            tilt[i] += (covariance[i, j] - (errors.gnss if i == j else 0.0)) * own.lean[j]
        variance += own.lean[i] * tilt[i]
    if variance > limit:
        tilt *= math.sqrt(limit / variance)
        variance = limit
    drawn = share**2 * (timing + motion + 2 * errors.other_gnss)
    if drawn > timing + motion + limit:
        share *= math.sqrt((timing + motion + limit) / drawn)
    variance += share**2 * (timing + motion + 2 * errors.other_gnss) + own.doubt
    out = np.empty((4, 4))
    for i in range(3):
        tilt[i] -= share * errors.other_gnss * own.bearing[i]
    for i in range(3):
        for j in range(3):
            out[i, j] = covariance[i, j] + variance * unit[i] * unit[j]
            out[i, j] += tilt[i] * unit[j] + unit[i] * tilt[j]
        out[i, 3] = out[3, i] = (variance - share * timing) * unit[i] + tilt[i]
    out[3, 3] = variance - 2 * share * timing + timing
    return out
