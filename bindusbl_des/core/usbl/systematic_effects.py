"""Effects of systematic errors (attitude, GNSS, sound speed, clocks, and slow acoustic errors): the
Jacobian J of a fix, and their part of its covariance.
"""

from math import hypot, isnan, sqrt
from typing import Annotated, NamedTuple

import numpy as np

from ...support.arrays import Floats
from ...support.compiled import compiled, written_out
from ..records.rows import NONE, Row, Rows
from ..vehicles.currents import CONTROL_S
from .array import (
    Vector,
    across_by_metric,
    divided,
    dot,
    length,
    plus,
    rotated,
    rotated_back,
    scaled,
    tangents,
    weighted,
)
from .measuring import (
    Instrument,
    Sighting,
    angle_sds,
    spread_sd,
    stated_aside,
    timed_sd,
    turned_aside,
)

# Columns of effects, derivatives of a fix and of minus the length of a call's path: per rad of
# misalignment, per m of the GNSS of the ASV that measures and of the caller, along x and y, per
# relative error of the sound speed, and per s of the clock; these two are common to all that hear a
# ping.  Then per standard deviation of the slow error of the range, and of three numbers that make
# the slow error of the direction.
MISALIGNMENT, GNSS, CALLER, SOUND_SPEED, CLOCK, SLOW_RANGE, SLOW_ASIDE = 0, 1, 3, 5, 6, 7, 8
EFFECTS = 11

# Levels: standard deviations for these columns before the clock's, of the clock's offset (s) and
# drift, the standard normal number below which a measurement is an outlier and the standard
# deviation of outliers (m), and the columns of J at which each kind begins (NONE: not in J).
SYSTEMATIC = np.dtype(
    [
        ("sd", "f8", (CLOCK,)),
        ("clock_offset_sd_s", "f8"),
        ("clock_drift_sd", "f8"),
        ("outliers_below", "f8"),
        ("outlier_sd_m", "f8"),
        ("misalignment_at", "i8"),
        ("gnss_at", "i8"),
        ("sound_speed_at", "i8"),
        ("clock_at", "i8"),
        ("slow_at", "i8"),
    ]
)

# Number of slow errors of a pair of vehicles
SLOW = EFFECTS - SLOW_RANGE

# Range in standard deviations of the clock error at which `_far_share` is one half
NEAR = 3.0

# An offset shorter than this (m) has no direction: a clock error may cancel a range.
AT_THE_ARRAY = 1e-3


class Systematic(NamedTuple):
    """The systematic errors of a mission.

    A record of SYSTEMATIC and the variances (k,) of the errors in J; and the true errors: heading
    misalignments of the ASVs (m,), rad, their GNSS errors (m, n, 2), m, each for CONTROL_S, and how
    late (s) each AUV's clock is at first, and its drift (s/s), (auvs, 2).
    """

    levels: Row
    variances: Floats
    misalignments: Floats
    gnss: Floats
    clocks: Floats


class PackedErrors(NamedTuple):
    """A :class:`Systematic` for compiled code, with levels (1,); and the arrays to which it writes
    each fix's Jacobian by these errors, `jacobians` (fixes, 2, 4 k + 2), and the remaining
    covariance xx, yy, xy, `left` (fixes, 3), m2: see :class:`..records.rows.Jacobians`.
    """

    levels: Annotated[Rows, SYSTEMATIC]
    variances: Floats
    misalignments: Floats
    gnss: Annotated[Floats, 3]
    clocks: Annotated[Floats, 2]
    jacobians: Annotated[Floats, 3]
    left: Annotated[Floats, 2]


@written_out
def systematic_of(packed: PackedErrors) -> Systematic:
    """Return systematic errors from their packed form."""
    return Systematic(
        packed.levels[0], packed.variances, packed.misalignments, packed.gnss, packed.clocks
    )


@compiled
def gnss_error(asv: int, time: float, systematic: Systematic) -> Vector:
    """Return the slow GNSS error (3,), m, of an ASV at an instant (s)."""
    own = systematic.gnss[asv]
    now = min(int(time / CONTROL_S), len(own) - 1)
    return own[now, 0], own[now, 1], 0.0


@compiled
def deviations(time: float, levels: Row) -> Floats:
    """Return the standard deviations (EFFECTS,) of all systematic errors, at an instant (s) at
    which the AUV's clock is read; NaN if it is not.
    """
    sds = np.ones(EFFECTS)  # 1 for slow errors
    sds[:CLOCK] = levels.sd
    sds[CLOCK] = 0.0
    if not isnan(time):
        sds[CLOCK] = hypot(levels.clock_offset_sd_s, levels.clock_drift_sd * time)
    return sds


@compiled
def kept(ahead: Vector, reach: float) -> float:
    """Return |`ahead`| / |`reach`|, the share of a range that :func:`.measuring.debias` left."""
    return 1.0 if reach == 0.0 else length(ahead) / abs(reach)


@compiled
def across(seen: Sighting, ahead: Vector, instrument: Instrument) -> Floats:
    """Return the effects (4, EFFECTS) of errors that rotate an offset `ahead` (3,), m, or move its
    origin.

    An assumed sound speed that is too high lengthens the plane wave that fits the arrivals.  Where
    the array resolves some axes better, the direction that fits it best is then rotated by T (T^T M
    T)^-1 T^T M s, T spanning the plane across s.
    """
    effects = np.zeros((4, EFFECTS))
    effects[0, MISALIGNMENT], effects[1, MISALIGNMENT] = -ahead[1], ahead[0]
    effects[0, GNSS] = effects[1, GNSS + 1] = 1.0
    within = rotated_back(seen.believed, seen.unit)
    east, down = tangents(within)
    x, y, determinant = across_by_metric(instrument.metric, east, down, within)
    aside = scaled(plus(scaled(east, x), scaled(down, y)), kept(ahead, 1.0))
    moved = rotated(seen.believed, divided(aside, determinant))
    for axis in range(3):
        effects[axis, SOUND_SPEED] = moved[axis]
    if instrument.levels.slow_share > 0.0:
        _slow_aside(effects, (ahead[0], ahead[1], seen.below), seen, instrument)
    return effects


@compiled
def _slow_aside(effects: Floats, ahead: Vector, seen: Sighting, instrument: Instrument) -> None:
    """Write to effects (4, EFFECTS) the effects of slow direction errors on an offset (3,), m, with
    the AUV's depth, which is known, while a fix's depth has the error of the elevation.

    An array has these errors in its frame: in the sums X^T n of its elements' errors, with
    covariance M = L L^T, L (3, 3) triangular, one for each column of L. A data sheet has the three
    of :func:`.measuring.stated_aside`; or the position along each axis, in any direction.
    """
    levels, share = instrument.levels, sqrt(instrument.levels.slow_share)
    away = length(ahead)
    if away < AT_THE_ARRAY:
        return
    within = rotated_back(seen.believed, divided(ahead, away))
    east, down = tangents(within)
    if levels.has_sheet:
        sds = angle_sds(seen.snr_db, levels)
        for k in range(3):
            if states_place(levels):
                effects[k, SLOW_ASIDE + k] = share * spread_sd(away, levels)
                continue
            one = 1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0
            moved = rotated(seen.believed, stated_aside(east, down, sds, one))
            for axis in range(3):
                effects[axis, SLOW_ASIDE + k] = share * away * moved[axis]
        return
    sd = share * levels.sound_speed_m_per_s * timed_sd(levels.element_sd_s, seen.snr_db, levels)
    a, b = weighted(instrument.metric, east, east), weighted(instrument.metric, east, down)
    d, root = weighted(instrument.metric, down, down), _root(instrument.metric)
    for k in range(3):
        column = root[0, k], root[1, k], root[2, k]
        f, g = dot(east, column), dot(down, column)
        aside = plus(scaled(east, d * f - b * g), scaled(down, a * g - b * f))
        moved = rotated(seen.believed, scaled(aside, away * sd / (a * d - b * b)))
        for axis in range(3):
            effects[axis, SLOW_ASIDE + k] = moved[axis]


@compiled
def _root(metric: Floats) -> Floats:
    """Return the lower triangular L (3, 3) of a metric M = L L^T (A.-L. Cholesky)."""
    out = np.zeros((3, 3))
    for i in range(3):
        for j in range(i + 1):
            left = metric[i, j]
            for k in range(j):
                left -= out[i, k] * out[j, k]
            out[i, j] = sqrt(left) if i == j else left / out[j, j]
    return out


@compiled
def states_place(levels: Row) -> bool:
    """Return whether a data sheet states the accuracy of positions rather than of directions."""
    return bool(levels.spread_sd_m > 0.0 or levels.spread_share > 0.0)


@compiled
def limit(farther: Floats, sds: Floats, baseline: Vector, path: float) -> None:
    """Limit errors of a range, `farther` (EFFECTS,), m per unit, where geometry constrains it
    little (:func:`.two_way.dated`).

    No error, of standard deviations `sds` (EFFECTS,), exceeds the variance of two positions on a
    `baseline` (3,), m; an error of the sound speed may also have its effect on the whole `path`
    (m).
    """
    square = dot(baseline, baseline) / 6
    for k in range(EFFECTS):
        if k in (CLOCK, SLOW_RANGE):
            continue
        own = (sds[k] * path) ** 2 if k == SOUND_SPEED else 0.0
        variance = (sds[k] * farther[k]) ** 2
        if variance > square + own:
            farther[k] *= sqrt((square + own) / variance)


@compiled
def lengthen(effects: Floats, unit: Vector, farther: Floats, kept: float) -> None:
    """Add errors of a range, `farther` (EFFECTS,), m, to effects: along `unit`, times `kept`.  The
    last row, minus the call's path, becomes `farther`.
    """
    for k in range(EFFECTS):
        for i in range(3):
            effects[i, k] += kept * unit[i] * farther[k]
        effects[3, k] = farther[k]


@compiled
def changes(
    effects: Floats, ahead: Vector, seen: Sighting, instrument: Instrument, clock_m: float
) -> Floats:
    """Return the derivatives of effects (4, EFFECTS) along x and along y, (2, 4, EFFECTS), per m.

    All effects rotate with the direction of the offset `ahead` (3,), m; the effects of misalignment
    and sound speed grow with its length as well; for slow errors the derivatives are differences.
    A navigator needs them where it knows the AUV's position better than the fix: noise of the fix
    in its J would seem to measure clocks and sound speeds that the geometry does not.  If the clock
    error is as large (`clock_m`, sd) as the range, it is unknown how fast the direction rotates.
    """
    out, square = np.zeros((2, 4, EFFECTS)), ahead[0] ** 2 + ahead[1] ** 2
    if square < AT_THE_ARRAY**2:
        return out
    for axis in range(2):
        grown, turn = ahead[axis] / square, (-ahead[1] if axis == 0 else ahead[0]) / square
        for k in (MISALIGNMENT, SOUND_SPEED):
            out[axis, 0, k] = grown * effects[0, k] - turn * effects[1, k]
            out[axis, 1, k] = grown * effects[1, k] + turn * effects[0, k]
        turn *= _far_share(ahead, clock_m)
        out[axis, 0, CLOCK] = -turn * effects[1, CLOCK]
        out[axis, 1, CLOCK] = turn * effects[0, CLOCK]
    if instrument.levels.slow_share > 0.0:
        _slow_changes(out, effects, ahead, seen, instrument)
    return out


@compiled
def _far_share(ahead: Vector, clock_m: float) -> float:
    """Return which share of an offset's rotation is certain despite a clock error (sd, m)."""
    square = dot(ahead, ahead)
    return square / (square + (NEAR * clock_m) ** 2)


@compiled
def add_unknown_turn(
    covariance: Floats, ahead: Vector, clock_m: float, seen: Sighting, instrument: Instrument
) -> None:
    """Add to a covariance (3, 3) or larger, m2, the error of a direction at the part of the range
    that is uncertain by a clock error (sd, m): see :func:`changes`.
    """
    if clock_m <= 0.0:
        return
    away = sqrt(1.0 - _far_share(ahead, clock_m)) * clock_m
    aside = turned_aside(seen, away, instrument)
    for i in range(3):
        for j in range(3):
            covariance[i, j] += aside[i, j]


@compiled
def _slow_changes(
    out: Floats, effects: Floats, ahead: Vector, seen: Sighting, instrument: Instrument
) -> None:
    """Write the derivatives of the effects of slow errors to `out` (2, 4, EFFECTS), by differences:
    with the offset `ahead` (3,), m, moved to either side.
    """
    step, ahead = 1e-3 * length(ahead), (ahead[0], ahead[1], seen.below)
    ranged = effects[0, SLOW_RANGE], effects[1, SLOW_RANGE], effects[2, SLOW_RANGE]
    near = np.zeros((4, EFFECTS))
    for axis in range(2):
        for side in (-1.0, 1.0):
            moved = plus(ahead, (side * step, 0.0, 0.0) if axis == 0 else (0.0, side * step, 0.0))
            _slow_aside(near, moved, seen, instrument)
            for i in range(3):
                near[i, SLOW_RANGE] = length(ranged) * moved[i] / length(moved)
                for k in range(SLOW_RANGE, EFFECTS):
                    out[axis, i, k] += side * near[i, k] / (2.0 * step)


@compiled
def bent(effects: Floats, ahead: Vector, instrument: Instrument) -> Floats:
    """Return the second derivatives (4, EFFECTS) of a fix by errors that rotate its offset (3,), m:
    the misalignment about z, and slow direction errors, which move it along a sphere.
    """
    out = np.zeros((4, EFFECTS))
    out[0, MISALIGNMENT], out[1, MISALIGNMENT] = -ahead[0], -ahead[1]
    square = dot(ahead, ahead)
    if states_place(instrument.levels) or square < AT_THE_ARRAY**2:
        return out
    for k in range(SLOW_ASIDE, EFFECTS):
        aside = effects[0, k] ** 2 + effects[1, k] ** 2 + effects[2, k] ** 2
        for i in range(3):
            out[i, k] = -aside / square * ahead[i]
    return out


@compiled
def noise_of(covariance: Floats, jacobians: Floats, variances: Floats) -> Floats:
    """Return the covariance (3, 3), m2, without errors of some `variances` (k,); `jacobians` (3, 2
    k) are the derivatives by their squares, then by themselves.
    """
    out, count = covariance.copy(), variances.size
    for k in range(2 * count):
        variance = variances[k - count] if k >= count else 0.75 * variances[k] ** 2
        for i in range(3):
            for j in range(3):
                out[i, j] -= variance * jacobians[i, k] * jacobians[j, k]
    for i in range(3):
        out[i, i] = max(out[i, i], 0.0)
    return out


@compiled
def level_part(covariance: Floats) -> Floats:
    """Return xx, yy, xy (3,) of a covariance (3, 3)."""
    return np.array((covariance[0, 0], covariance[1, 1], covariance[0, 1]))


@compiled
def add_own(covariance: Floats, effects: Floats, bends: Floats, sds: Floats) -> None:
    """Add an ASV's own errors (misalignment, GNSS, slow errors) to a covariance (m2), by their
    effects and second derivatives `bends` (both n, EFFECTS) and standard deviations (EFFECTS,).

    A misalignment rotates the offset on a circle: its square has a variance, too, E x^4 / 4 = 3
    sd^4 / 4.
    """
    for k in range(EFFECTS):
        if k < CALLER or k >= SLOW_RANGE:
            add(covariance, effects[:, k], sds[k] ** 2)
    for k in range(EFFECTS):
        if k == MISALIGNMENT or k >= SLOW_ASIDE:
            add(covariance, bends[:, k], 0.75 * sds[k] ** 4)


@compiled
def add(covariance: Floats, effect: Floats, variance: float) -> None:
    """Add an error of some variance, by its effect (n,), to a covariance (n, n), m2, in place."""
    for i in range(len(covariance)):
        for j in range(len(covariance)):
            covariance[i, j] += variance * effect[i] * effect[j]


class Whose(NamedTuple):
    """The vehicles whose errors a measurement has: the index of the array among those in J, the
    ASV, the caller (NONE: none), and when (s) the AUV's clock was read, NaN for an answer.
    """

    array: int
    asv: int
    caller: int
    clock_at_s: float


@compiled
def spread_out(effects: Floats, out: Floats, whose: Whose, levels: Row) -> None:
    """Write effects (4, EFFECTS) to the columns of J, `out` (4, k), of the vehicles that have the
    errors.
    """
    if levels.misalignment_at != NONE:
        out[:, levels.misalignment_at + whose.array] = effects[:, MISALIGNMENT]
    if levels.gnss_at != NONE:
        for axis in range(2):
            out[:, levels.gnss_at + 2 * whose.asv + axis] += effects[:, GNSS + axis]
            if whose.caller != NONE:
                out[:, levels.gnss_at + 2 * whose.caller + axis] += effects[:, CALLER + axis]
    if levels.sound_speed_at != NONE:
        out[:, levels.sound_speed_at] = effects[:, SOUND_SPEED]
    if levels.clock_at != NONE and not isnan(whose.clock_at_s):
        out[:, levels.clock_at] = effects[:, CLOCK]
        out[:, levels.clock_at + 1] = whose.clock_at_s * effects[:, CLOCK]
    if levels.slow_at != NONE:
        for k in range(SLOW):
            out[:, levels.slow_at + SLOW * whose.asv + k] = effects[:, SLOW_RANGE + k]


@compiled
def move(jacobians: Floats, way: Floats) -> None:
    """Move the position at which J (n, 5 k + 1) holds by `way` (2 or more,), m: extrapolate its
    first k columns, in place.
    """
    count = jacobians.shape[1] // 5
    for axis in range(2):
        jacobians[:, :count] += way[axis] * jacobians[:, (1 + axis) * count : (2 + axis) * count]
