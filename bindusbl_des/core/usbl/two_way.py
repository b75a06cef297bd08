"""Two-way ranging: an answer is located by the whole path of call and answer.

ASVs share their clock, GNSS time, and their measurements: the travel time of the sound from the
caller to the AUV and from there to themselves.  The two positions of the AUV are those at which it
heard the call and at which it answered, a ping and a turnaround later.  One ASV gets its range by
itself, the caller if it heard the answer.  That gives the instant of the answer, and with it the
ranges of all others, whose errors contain that of the first (eq. rtt; the turnaround is known and
removed).
"""

import math
from typing import NamedTuple

import numpy as np

from ...support.arrays import Floats
from ...support.compiled import compiled
from ..records.events import HEARD
from ..records.rows import NONE
from ..vehicles.motion import Motion, where
from .array import (
    NOTHING,
    Vector,
    divided,
    dot,
    length,
    minus,
    negative,
    plus,
    scaled,
)
from .fusion import fuse_shared
from .measuring import (
    PackedInstrument,
    Sighting,
    gnss_noise,
    instrument_of,
    path_sd,
    placed,
    spread_sd,
)
from .sights import Heard, note_answer, note_sight, sighting

# Relative path difference below which the AUV is on the line to the caller, somewhere between
IN_LINE = 1e-9


class OwnRange(NamedTuple):
    """The range (m) of an AUV at an ASV that heard its answer.

    `share` of an error of the path goes into the range; the AUV is in the direction of the unit
    vector `bearing` (3,) from the caller; the range grows by `lean` (3,) per metre across the
    direction.  It has a variance `doubt` (m2) of its own only where the AUV is between the two,
    where every range gives the same path.
    """

    reach: float
    share: float
    bearing: Vector
    lean: Vector
    doubt: float


class PathErrors(NamedTuple):
    """Variances (m2): of the path's length, of the AUV's motion between call and answer, of errors
    that move the whole fix (GNSS), and of the hearer's and the caller's GNSS if these are two ASVs
    (else 0).
    """

    timing: float
    motion: float
    gnss: float
    own_gnss: float
    other_gnss: float


@compiled
def own_range(path: float, baseline: Vector, unit: Vector) -> OwnRange:
    """Return the range of an AUV in the direction `unit`, when call and answer took a `path` (m).

    `baseline` (3,), m, points from the ASV that heard the answer to where the call was sent: 0 for
    a caller that has not moved, whose range is half the path; for others the AUV is on an ellipse.

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
def limited_share(own: OwnRange, limit: float, errors: PathErrors) -> float:
    """Return the share of an error of the path that goes into the range, limited to the path's own
    error and a variance `limit` (m2).
    """
    drawn = own.share**2 * (errors.timing + errors.motion + (errors.own_gnss + errors.other_gnss))
    most = errors.timing + errors.motion + limit
    return own.share if drawn <= most else own.share * math.sqrt(most / drawn)


@compiled
def dated(
    covariance: Floats, unit: Vector, own: OwnRange, limit: float, errors: PathErrors
) -> Floats:
    """Return the covariance (4, 4), m2, of a fix by an ASV's own range and of the call's path.

    The call's path is the rest of the path, and gives the instant of the answer to all others.
    `covariance` (3, 3) comes of the direction and of the ASV's GNSS; the range has a share of the
    path's own error, of the AUV's motion, and if another ASV has called of both GNSS errors along
    the bearing, and is correlated with the error of the direction by `lean`.  However weak the
    geometry, the AUV lies on an ellipse: neither direction nor path adds more than a `limit` (m2).
    """
    share, timing, motion = limited_share(own, limit, errors), errors.timing, errors.motion
    tilt = np.zeros(3)  # covariance of the position with the range's error by the direction
    variance = 0.0
    for i in range(3):
        for j in range(3):
            tilt[i] += (covariance[i, j] - (errors.gnss if i == j else 0.0)) * own.lean[j]
        variance += own.lean[i] * tilt[i]
    if variance > limit:
        tilt *= math.sqrt(limit / variance)
        variance = limit
    variance += share**2 * (timing + motion + (errors.own_gnss + errors.other_gnss)) + own.doubt
    out = np.empty((4, 4))
    for i in range(3):
        tilt[i] -= share * errors.own_gnss * own.bearing[i]
    for i in range(3):
        for j in range(3):
            out[i, j] = covariance[i, j] + variance * unit[i] * unit[j]
            out[i, j] += tilt[i] * unit[j] + unit[i] * tilt[j]
        out[i, 3] = out[3, i] = (variance - share * timing) * unit[i] + tilt[i]
    out[3, 3] = variance - 2 * share * timing + timing
    return out


class Alone(NamedTuple):
    """One ASV's location of an answer: the fix (3,), m; the covariance (4, 4), m2, of the fix and
    of minus the call's path length; the ASV's own range; and the share of an error of the path that
    goes into it (:func:`limited_share`).
    """

    fix: Floats
    covariance: Floats
    own: OwnRange
    share: float


@compiled
def two_way(
    heard: Heard, asvs: Motion, instruments: PackedInstrument, strayed: float
) -> tuple[Floats, Floats]:
    """Return the fix (3,), m, of an answer to a call, and its covariance (3, 3), m2.

    `strayed` (m2) as of :func:`.fixes.measured`.
    """
    reference = first_to_locate(heard)
    instrument = instrument_of(instruments, heard.receptions[reference].asv)
    seen = sighting(heard, reference, asvs, instrument, None)
    baseline = caller_offset(heard, reference, seen, asvs, instruments)
    alone = by_itself(seen, baseline, heard, reference, instruments, strayed)
    state, spread, jacobian = np.zeros(4), alone.covariance, np.empty((3, 1))
    state[:3] = alone.fix
    _note(heard, reference, seen, asvs, instruments)
    call_way = seen.path - alone.own.reach
    for row in range(len(heard.receptions)):
        if heard.receptions[row].outcome == HEARD and row != reference:
            own = instrument_of(instruments, heard.receptions[row].asv)
            seen = sighting(heard, row, asvs, own, None)
            _note(heard, row, seen, asvs, instruments)
            reach, ranging_sd = max(seen.path - call_way, 0.0), path_sd(seen.path, own.levels)
            fix, other = placed(seen, reach, ranging_sd, heard.noise[row], own)
            for k in range(3):
                jacobian[k, 0] = -seen.unit[k]
            state, spread, _, _ = fuse_shared(state, spread, fix, other, jacobian)
    return state[:3].copy(), spread[:3, :3].copy()


@compiled
def _note(
    heard: Heard, row: int, seen: Sighting, asvs: Motion, instruments: PackedInstrument
) -> None:
    """Write an ASV's measurement of an answer to its reception."""
    instrument = instrument_of(instruments, heard.receptions[row].asv)
    half, levels = seen.path / 2, instrument.levels
    fix, noise = placed(seen, half, path_sd(half, levels), heard.noise[row], instrument)
    reception, baseline = heard.receptions[row], caller_offset(heard, row, seen, asvs, instruments)
    note_sight(reception, fix, seen, half, noise, instrument)
    note_answer(reception, heard.ping, seen.path, baseline, levels)


@compiled
def first_to_locate(heard: Heard) -> int:
    """Return the reception that locates an AUV first: the caller's if it has heard the answer."""
    first = NONE
    for row in range(len(heard.receptions)):
        reception = heard.receptions[row]
        if reception.outcome == HEARD and (first == NONE or reception.asv == heard.ping.called_by):
            first = row
    return first


@compiled
def caller_offset(
    heard: Heard, row: int, seen: Sighting, asvs: Motion, instruments: PackedInstrument
) -> Vector:
    """Return where the call was sent relative to the ASV that heard its answer (reception `row`),
    (3,), m, by the GNSS of both.
    """
    caller, hearer = heard.ping.called_by, heard.receptions[row].asv
    x, y, z, _ = where(asvs, caller, heard.ping.called_at_s)
    baseline = minus((x, y, z), seen.vessel)
    if hearer != caller:
        astray = NOTHING  # the caller's GNSS error, which lasts for as long as call and answer
        for other in range(len(heard.receptions)):
            if heard.receptions[other].asv == caller:
                astray = scaled(
                    gnss_noise(heard.noise[other]), instruments.levels[caller].gnss_sd_m
                )
        own = scaled(gnss_noise(heard.noise[row]), instruments.levels[hearer].gnss_sd_m)
        baseline = minus(plus(baseline, astray), own)
    return baseline


@compiled
def by_itself(
    seen: Sighting, baseline: Vector, heard: Heard, row: int, instruments: PackedInstrument,
    strayed: float,
) -> Alone:  # fmt: skip
    """Locate an AUV by one reception (row `row`) of its answer; `baseline` as of
    :func:`caller_offset`.
    """
    instrument = instrument_of(instruments, heard.receptions[row].asv)
    levels, noise = instrument.levels, heard.noise[row]
    gnss, own_gnss, other_gnss = levels.gnss_sd_m**2, 0.0, 0.0
    if heard.receptions[row].asv != heard.ping.called_by:
        own_gnss, other_gnss = gnss, instruments.levels[heard.ping.called_by].gnss_sd_m ** 2
    own = own_range(seen.path, baseline, seen.unit)
    fix, covariance = placed(seen, own.reach, 0.0, noise, instrument)
    # errors of the position that the range does not depend on
    beside = gnss + (1.0 - levels.slow_share) * spread_sd(own.reach, levels) ** 2
    limit = dot(baseline, baseline) / 6  # mean square difference of two positions on it
    level = own.bearing[0] ** 2 + own.bearing[1] ** 2  # AUVs move horizontally
    timing = path_sd(seen.path, levels) ** 2
    errors = PathErrors(timing, level * strayed, beside, own_gnss, other_gnss)
    spread = dated(covariance, seen.unit, own, limit, errors)
    return Alone(fix, spread, own, limited_share(own, limit, errors))
