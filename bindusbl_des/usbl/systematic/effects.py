"""How a measurement moves with what is wrong all the time: attitude, GNSS, sound speed, clocks."""

from math import sqrt

import numpy as np

from ...core.compiled import compiled
from ...vehicles.motion import Floats
from ..array import across_by_metric, tangents
from ..instrument import Instrument
from ..two_way import Sighting
from ..vectors import Vector, divided, dot, length, plus, scaled, turned, turned_back

# Columns of what a fix and (less) the length of a call's way are off, per rad of misalignment, per
# m of GNSS of who measures and of who has called, along x and y, per share of the sound speed, and
# per s of the clock.  The last two are shared by all that hear a ping.
MISALIGNMENT, GNSS, CALLER, SOUND_SPEED, CLOCK = 0, 1, 3, 5, 6
EFFECTS = 7

# What is nearer (m) lies in no direction: a clock that is off may leave nothing of a range.
AT_THE_ARRAY = 1e-3


@compiled
def kept(ahead: Vector, reach: float) -> float:
    """Return how much of a range (m) an offset keeps that is shortened (:func:`.debias`)."""
    return 1.0 if reach <= 0.0 else length(ahead) / reach


@compiled
def across(seen: Sighting, ahead: Vector, instrument: Instrument) -> Floats:
    """Return the effects (4, EFFECTS) of what turns an offset `ahead` (3,), m, or moves its origin.

    A sound speed taken for too high makes the plane wave that fits the arrivals longer.  Where the
    array resolves some axes better, the direction that comes nearest to it is another one: turned
    by T (T^T M T)^-1 T^T M s, T spanning the plane across s.
    """
    effects = np.zeros((4, EFFECTS))
    effects[0, MISALIGNMENT], effects[1, MISALIGNMENT] = -ahead[1], ahead[0]
    effects[0, GNSS] = effects[1, GNSS + 1] = 1.0
    within = turned_back(seen.believed, seen.unit)
    east, down = tangents(within)
    x, y, determinant = across_by_metric(instrument.metric, east, down, within)
    aside = scaled(plus(scaled(east, x), scaled(down, y)), kept(ahead, 1.0))
    moved = turned(seen.believed, divided(aside, determinant))
    for axis in range(3):
        effects[axis, SOUND_SPEED] = moved[axis]
    return effects


@compiled
def limit(farther: Floats, sds: Floats, baseline: Vector, path: float) -> None:
    """Shorten what a range errs by where geometry tells little (:func:`.round_trip.dated`).

    No error makes more of it than two places on a `baseline` (3,), m, differ, and of that of the
    sound speed what it makes of the whole `path` (m).
    """
    square = dot(baseline, baseline) / 6
    for k in range(CLOCK):
        own = (sds[k] * path) ** 2 if k == SOUND_SPEED else 0.0
        variance = (sds[k] * farther[k]) ** 2
        if variance > square + own:
            farther[k] *= sqrt((square + own) / variance)


@compiled
def lengthen(effects: Floats, unit: Vector, farther: Floats, kept: float) -> None:
    """Add what a range is longer by (m) to the effects; it is less of the call's way."""
    for k in range(EFFECTS):
        for i in range(3):
            effects[i, k] += kept * unit[i] * farther[k]
        effects[3, k] = farther[k]


@compiled
def changes(effects: Floats, ahead: Vector) -> Floats:
    """Return how effects (4, EFFECTS) change per m along x and along y, (2, 4, EFFECTS).

    They turn with the direction of the offset `ahead` (3,), m; those of misalignment and sound
    speed grow with its length as well.  A navigator needs them where it knows better where the AUV
    is than the fix does: noise of the fix that is in its J, too, would look as if it told something
    of clocks and sound speeds that no geometry tells.
    """
    out, square = np.zeros((2, 4, EFFECTS)), ahead[0] ** 2 + ahead[1] ** 2
    if square < AT_THE_ARRAY**2:
        return out
    for axis in range(2):
        grown, turn = ahead[axis] / square, (-ahead[1] if axis == 0 else ahead[0]) / square
        for k in (MISALIGNMENT, SOUND_SPEED, CLOCK):
            out[axis, 0, k], out[axis, 1, k] = -turn * effects[1, k], turn * effects[0, k]
            if k != CLOCK:
                out[axis, 0, k] += grown * effects[0, k]
                out[axis, 1, k] += grown * effects[1, k]
    return out


@compiled
def bent(ahead: Vector) -> Floats:
    """Return the second derivative (4,) of a fix by what turns its offset (3,), m, about z."""
    return np.array((-ahead[0], -ahead[1], 0.0, 0.0))
