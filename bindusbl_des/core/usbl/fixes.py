"""Fixes: the measurements of all arrays that heard a ping, fused.

Without systematic errors measurements are independent (:func:`measured`).  With them

    fix = position + J c + noise

where c are the heading misalignment of each ASV, the slow error of its GNSS position along x and y,
the relative error of the assumed sound speed, and how late the AUV's clock is.  An ASV's own errors
are further errors of its measurement; sound speed and clock are common to all ASVs that hear a
ping, so they are fused as unknowns beside the position (best linear unbiased estimate).

An AUV that measures an ASV's ping with its own array gets its own position (inverted USBL).
Everything is :mod:`.measuring` from the other end: the array and the AHRS are the AUV's, the source
is the ASV. Synchronised clocks make the travel time a range.  With the source as the origin a fix
is the mirror image of a fix of the source, and so is its covariance.  Source: Rypkema, Fischell and
Schmidt, "One-way travel-time inverted ultra-short baseline localization for low-cost autonomous
underwater vehicles", ICRA 2017.
"""

from collections.abc import Sequence
from math import hypot, isnan, nan, sqrt
from typing import NamedTuple

import numpy as np

from ...support.arrays import Floats
from ...support.compiled import compiled
from ..records.events import HEARD
from ..records.rows import NONE, Row
from ..vehicles.motion import Motion
from .array import NOTHING, Vector, dot, negative, plus
from .fusion import fuse_pair, fuse_shared
from .instrument import Usbl
from .measuring import (
    NOISE_WIDTH,
    Instrument,
    PackedInstrument,
    Sighting,
    instrument_of,
    offset_of,
    path_sd,
    placed,
)
from .sights import (
    ArrayView,
    Heard,
    measure,
    note_call,
    note_sight,
    sighting,
    unknown_sights,
)
from .systematic_effects import (
    CALLER,
    CLOCK,
    EFFECTS,
    GNSS,
    MISALIGNMENT,
    SLOW_ASIDE,
    SLOW_RANGE,
    SOUND_SPEED,
    Systematic,
    Whose,
    across,
    add,
    add_own,
    add_unknown_turn,
    bent,
    changes,
    deviations,
    gnss_error,
    kept,
    lengthen,
    level_part,
    limit,
    move,
    noise_of,
    spread_out,
    states_place,
)
from .two_way import by_itself, caller_offset, first_to_locate, two_way


@compiled
def measured(
    heard: Heard, asvs: Motion, instruments: PackedInstrument, strayed: Floats
) -> tuple[Floats, Floats]:
    """Return the fix (3,), m, of a ping and its covariance (3, 3), m2, fused over its hearers.

    `strayed` (AUVs,), m2, is the variance, along any level axis, of how far each AUV goes between a
    call and its answer.
    """
    if not isnan(heard.ping.call_time_s):
        return two_way(heard, asvs, instruments, strayed[heard.ping.auv])
    estimate, covariance, first = heard.noise[0], heard.noise, True  # placeholders of these types
    for row in range(len(heard.receptions)):
        reception, noise = heard.receptions[row], heard.noise[row]
        if reception.outcome != HEARD:
            continue
        instrument = instrument_of(instruments, reception.asv)
        seen = sighting(heard, row, asvs, instrument, None)
        fix, spread = placed(
            seen, seen.path, path_sd(seen.path, instrument.levels), noise, instrument
        )
        note_sight(reception, fix, seen, seen.path, spread, instrument)
        if first:
            estimate, covariance, first = fix, spread, False
        else:
            estimate, covariance = fuse_pair(estimate, covariance, fix, spread)
    return estimate, covariance


@compiled
def note(row: Row, ping: Row, estimate: Floats, covariance: Floats) -> None:
    """Write a measured position (3,), m, its covariance (3, 3), m2, and its true horizontal error
    to the row of a fix.
    """
    row.x_m, row.y_m, row.z_m = estimate[0], estimate[1], estimate[2]
    row.sd_x_m = sqrt(max(covariance[0, 0], 0.0))
    row.sd_y_m = sqrt(max(covariance[1, 1], 0.0))
    row.sd_z_m = sqrt(max(covariance[2, 2], 0.0))
    row.cov_xy_m2, row.cov_xz_m2 = covariance[0, 1], covariance[0, 2]
    row.cov_yz_m2 = covariance[1, 2]
    row.error_m = hypot(estimate[0] - ping.x_m, estimate[1] - ping.y_m)


# Number of columns for an outlier in a row of noise, after NOISE_WIDTH and the loss
OUTLIER_WIDTH = 3


class UsblWithErrors(NamedTuple):
    """The instruments that ASVs carry, one for each, and their systematic errors."""

    usbls: Sequence[Usbl]
    systematic: Systematic


@compiled
def jump(fix: Floats, noise: Floats, levels: Row) -> None:
    """Make a fix (3,), m, an outlier that its covariance does not contain, if its noise says so."""
    if levels.outlier_sd_m > 0.0 and noise[NOISE_WIDTH + 1] < levels.outliers_below:
        for axis in range(2):
            fix[axis] += levels.outlier_sd_m * noise[NOISE_WIDTH + 2 + axis]


class AsvFix(NamedTuple):
    """One array's fix of a ping: its position (3,), m, in the direction `seen` at a range `reach`
    (m); the covariance (4, 4), m2, of the position and of minus the call's path length, without
    systematic errors; the Jacobian by these, `effects` (4, EFFECTS), its derivatives along x and y
    (2, 4, EFFECTS), and the second derivatives `bends` (4, EFFECTS); and the call's path length
    (m), 0 without a call.  The call came along the unit vector `bearing` (3,); `moved` (4,) is the
    derivative by how much longer (m) its path was than if the AUV had not moved.
    """

    fix: Floats
    seen: Sighting
    reach: float
    covariance: Floats
    effects: Floats
    changes: Floats
    bends: Floats
    call_way: float
    bearing: Vector
    moved: Floats


@compiled
def by_range(
    seen: Sighting, call_way: float, sign: float, clock_sd: float, noise: Floats,
    instrument: Instrument,
) -> AsvFix:  # fmt: skip
    """Return an array's fix of a ping by the measured path less a call's known path (m); a late
    clock (standard deviation, s) makes the range longer by `sign` 1, or shorter by -1.
    """
    reach, spread, levels = seen.path - call_way, np.zeros((4, 4)), instrument.levels
    fix, spread[:3, :3] = placed(seen, reach, path_sd(seen.path, levels), noise, instrument)
    ahead, speed = offset_of(fix, seen.vessel, reach, noise, instrument), levels.sound_speed_m_per_s
    clock_m = speed * clock_sd
    add_unknown_turn(spread, ahead, clock_m, seen, instrument)
    effects, farther = across(seen, ahead, instrument), np.zeros(EFFECTS)
    farther[SOUND_SPEED], farther[CLOCK] = seen.path, sign * speed
    farther[SLOW_RANGE] = path_sd(seen.path, levels, True)
    lengthen(effects, seen.unit, farther, kept(ahead, reach))
    effects[3] = 0.0  # the length of the call's path is given
    return AsvFix(
        fix, seen, reach, spread, effects, changes(effects, ahead, seen, instrument, clock_m),
        bent(effects, ahead, instrument), call_way, seen.unit, np.zeros(4),
    )  # fmt: skip


@compiled
def by_other(
    heard: Heard, row: int, call_way: float, asvs: Motion, instruments: PackedInstrument,
    sds: Floats, systematic: Systematic,
) -> AsvFix:  # fmt: skip
    """Return an ASV's fix of a ping (reception `row`), or of an answer to a call whose path (m) is
    known; `sds` (EFFECTS,) as of :func:`.systematic_effects.deviations`.
    """
    instrument = instrument_of(instruments, heard.receptions[row].asv)
    seen, noise = sighting(heard, row, asvs, instrument, systematic), heard.noise[row]
    part = by_range(seen, call_way, 1.0, sds[CLOCK], noise, instrument)
    jump(part.fix, noise, systematic.levels)
    return part


@compiled
def _by_whole_way(
    heard: Heard, row: int, asvs: Motion, instruments: PackedInstrument, strayed: Floats,
    sds: Floats, systematic: Systematic,
) -> AsvFix:  # fmt: skip
    """Return an ASV's fix of an answer (reception `row`) by the whole path of call and answer;
    arguments as of :func:`measured` and :func:`by_other`.
    """
    instrument = instrument_of(instruments, heard.receptions[row].asv)
    ping, noise = heard.ping, heard.noise[row]
    seen = sighting(heard, row, asvs, instrument, systematic)
    baseline = caller_offset(heard, row, seen, asvs, instruments)
    baseline = plus(baseline, gnss_error(ping.called_by, ping.called_at_s, systematic))
    alone = by_itself(seen, baseline, heard, row, instruments, strayed[ping.auv])
    fix, spread, own = alone.fix, alone.covariance, alone.own
    ahead = offset_of(fix, seen.vessel, own.reach, noise, instrument)
    effects, farther = across(seen, ahead, instrument), np.zeros(EFFECTS)
    for k in range(3):
        for effect in (MISALIGNMENT, SOUND_SPEED):
            farther[effect] += own.lean[k] * effects[k, effect]
        if not states_place(instrument.levels):
            for effect in range(SLOW_ASIDE, EFFECTS):
                farther[effect] += own.lean[k] * effects[k, effect]
    if heard.receptions[row].asv != ping.called_by:  # else its own error is the caller's
        for axis in range(2):
            farther[GNSS + axis] = -own.share * own.bearing[axis]
            farther[CALLER + axis] = own.share * own.bearing[axis]
    farther[SOUND_SPEED] += own.share * seen.path
    limit(farther, sds, baseline, seen.path)
    slow_sd = path_sd(seen.path, instrument.levels, True)  # limited as `two_way.dated` does
    farther[SLOW_RANGE] = min(own.share * slow_sd, sqrt(slow_sd**2 + dot(baseline, baseline) / 6))
    lengthen(effects, seen.unit, farther, kept(ahead, own.reach))
    effects[3, SOUND_SPEED] -= seen.path
    effects[3, SLOW_RANGE] -= slow_sd
    moved = np.full(4, alone.share)
    for i in range(3):
        moved[i] *= kept(ahead, own.reach) * seen.unit[i]
    jump(fix, noise, systematic.levels)
    return AsvFix(
        fix, seen, own.reach, spread, effects, changes(effects, ahead, seen, instrument, 0.0),
        bent(effects, ahead, instrument), seen.path - own.reach, own.bearing, moved,
    )  # fmt: skip


@compiled
def _clock_at(ping: Row) -> float:
    """Return when (s) the AUV's clock triggered its ping; NaN if a call did."""
    return float(ping.sent_at_s) if isnan(ping.call_time_s) else nan


# Number of fused unknowns: position (3), error of the call's path (m), sound speed and clock (sd)
UNKNOWNS = 6

# Threshold (sd) on contradictions, which consistent fixes exceed once in a thousand pings
CONTRADICTION = 3.0902


@compiled
def measured_with_errors(
    heard: Heard,
    asvs: Motion,
    instruments: PackedInstrument,
    strayed: Floats,
    systematic: Systematic,
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return the fix (3,), m, of a ping, its covariance (3, 3), m2, its Jacobian J (3, 4 k + 2) by
    k systematic errors, and the remaining covariance without these, xx, yy, xy (3,), m2.

    `strayed` (AUVs,), m2, as of :func:`measured`.  Columns of J are the Jacobian at the fix, its
    derivatives along x, along y, and by each error; last the derivatives by the displacement (m)
    along x and y from where the AUV answered back to where it heard the call.
    """
    first, sds = first_to_locate(heard), deviations(_clock_at(heard.ping), systematic.levels)
    if not isnan(heard.ping.call_time_s):
        begun = _by_whole_way(heard, first, asvs, instruments, strayed, sds, systematic)
    else:
        begun = by_other(heard, first, 0.0, asvs, instruments, sds, systematic)
    state, spread, squares = np.zeros(UNKNOWNS), _begun(begun, sds), 0.0
    state[:3] = begun.fix
    known = _columns(begun, heard, first, systematic)
    reception, alone = heard.receptions[first], spread[:3, :3].copy()
    instrument = instrument_of(instruments, reception.asv)
    note_sight(reception, begun.fix, begun.seen, begun.reach, alone, instrument)
    jacobians = np.zeros((UNKNOWNS, known.shape[1]))
    jacobians[:3] = known[:3]
    others = 0
    for row in range(len(heard.receptions)):
        if heard.receptions[row].outcome == HEARD and row != first:
            others += 1
            part = by_other(heard, row, begun.call_way, asvs, instruments, sds, systematic)
            fix, own, beside = part.fix, part.covariance[:3, :3].copy(), _beside(part, sds)
            add_own(own, part.effects, part.bends, sds)
            other = instrument_of(instruments, heard.receptions[row].asv)
            note_sight(heard.receptions[row], part.fix, part.seen, part.reach, own, other)
            fused = fuse_shared(state, spread, fix, own, beside)
            off = _columns(part, heard, row, systematic)[:3]
            if begun.call_way > 0.0:  # the error of the call's path is in every other range
                for i in range(3):
                    off[i] += part.seen.unit[i] * known[3]
            for i in range(3):
                off[i] -= jacobians[i]
                for k in range(3, UNKNOWNS):
                    off[i] -= beside[i, k - 3] * jacobians[k]
            for i in range(UNKNOWNS):
                for j in range(3):
                    jacobians[i] += fused.gain[i, j] * off[j]
            state, spread, squares = fused.estimate, fused.covariance, squares + fused.square
    doubt = _doubt(squares, 3.0 * others, systematic.levels)
    count, covariance = systematic.variances.size, doubt * spread[:3, :3]
    left = noise_of(covariance, jacobians[:3, 3 * count : 5 * count], systematic.variances)
    out = np.zeros((3, 4 * count + 2))
    if begun.call_way > 0.0:
        for axis in range(2):
            out[:, 4 * count + axis] = begun.bearing[axis] * jacobians[:3, 5 * count]
            add(left, out[:, 4 * count + axis], -strayed[heard.ping.auv])
        for i in range(3):
            left[i, i] = max(left[i, i], 0.0)
    if others == 0 and begun.call_way == 0.0:
        note_sight(reception, begun.fix, begun.seen, begun.reach, left, instrument)
    elif count > 0 or doubt > 1.0 or begun.call_way > 0.0 or sds[SOUND_SPEED] + sds[CLOCK] > 0.0:
        unknown_sights(heard.receptions)  # their errors are correlated
        if not isnan(heard.ping.call_time_s):
            note_call(heard.receptions, heard.ping)
    move(jacobians, state)
    out[:, : 4 * count] = jacobians[:3, : 4 * count]
    return state[:3].copy(), covariance, out, level_part(left)


@compiled
def _begun(part: AsvFix, sds: Floats) -> Floats:
    """Return the covariance (UNKNOWNS, UNKNOWNS) of the unknowns after the first measurement."""
    out = np.zeros((UNKNOWNS, UNKNOWNS))
    out[:4, :4] = part.covariance
    add_own(out[:4, :4], part.effects, part.bends, sds)
    for k in range(CALLER, CLOCK + 1):
        add(out[:4, :4], part.effects[:, k], sds[k] ** 2)
    for k in range(SOUND_SPEED, CLOCK + 1):
        for i in range(4):
            out[i, k - 1] = out[k - 1, i] = -sds[k] * part.effects[i, k]
        out[k - 1, k - 1] = 1.0
    return out


@compiled
def _beside(part: AsvFix, sds: Floats) -> Floats:
    """Return the Jacobian (3, UNKNOWNS - 3) of a fix by the unknowns beside the position."""
    out = np.zeros((3, UNKNOWNS - 3))
    for i in range(3):
        if part.call_way > 0.0:
            out[i, 0] = -part.seen.unit[i]
        out[i, 1] = sds[SOUND_SPEED] * part.effects[i, SOUND_SPEED]
        out[i, 2] = sds[CLOCK] * part.effects[i, CLOCK]
    return out


@compiled
def _columns(part: AsvFix, heard: Heard, row: int, systematic: Systematic) -> Floats:
    """Return the effects on a fix as columns, (4, 5 k + 1), in blocks of k: extrapolated to the
    origin of the survey frame, their derivatives along x, along y and by each error, and their
    values at the fix; last the effect of the call's path.
    """
    count, asv = systematic.variances.size, heard.receptions[row].asv
    whose = Whose(asv, asv, heard.ping.called_by, _clock_at(heard.ping))
    out = np.zeros((4, 5 * count + 1))
    out[:, 5 * count] = part.moved
    write_columns(out, part.effects, part.changes, part.bends, whose, systematic)
    out[:, 4 * count : 5 * count] = out[:, :count]
    move(out, -part.fix)  # from each fix to the origin, where all can be added
    return out


@compiled
def write_columns(
    out: Floats, effects: Floats, moved: Floats, bends: Floats, whose: Whose,
    systematic: Systematic,
) -> None:  # fmt: skip
    """Write effects (4, EFFECTS) to the columns of J (4, 4 k or more), with their derivatives along
    x and y, `moved` (2, 4, EFFECTS), and by each error, `bends` (4, EFFECTS).
    """
    count, levels = systematic.variances.size, systematic.levels
    spread_out(effects, out[:, :count], whose, levels)
    for axis in range(2):
        columns = out[:, (1 + axis) * count : (2 + axis) * count]
        spread_out(moved[axis], columns, whose, levels)
    spread_out(bends, out[:, 3 * count : 4 * count], whose, levels)


@compiled
def _doubt(squares: float, freedom: float, levels: Row) -> float:
    """Return the factor that inflates the covariance of contradicting fixes, else 1.

    Where there may be outliers, an improbable sum of squares means that an ASV has measured one,
    but not which.  Sources: limit of chi-squared by Wilson and Hilferty, 1931; factor by Birge,
    Phys.  Rev. 40, 1932.
    """
    if levels.outlier_sd_m <= 0.0 or freedom <= 0.0:
        return 1.0
    share = 2.0 / (9.0 * freedom)
    limit = freedom * (1.0 - share + CONTRADICTION * sqrt(share)) ** 3
    return squares / freedom if squares > limit else 1.0


class HeardBeacon(NamedTuple):
    """A ping and its reception at an AUV: the AUV's position (3,), m, and heading (rad) as it
    arrives, and the noise of the measurement, standard normal numbers (NOISE_WIDTH or more), whose
    GNSS columns are the error of the ASV's position.
    """

    ping: Row
    reception: Row
    place: Vector
    yaw: float
    noise: Floats


@compiled
def located_itself(own: HeardBeacon, instrument: Instrument) -> tuple[Floats, Floats]:
    """Return an AUV's own fix (3,), m, by an ASV's ping, and its covariance (3, 3), m2: the ASV's
    position less the measured offset.
    """
    seen, levels = _sighting(own, instrument, None), instrument.levels
    image, covariance = placed(seen, seen.path, path_sd(seen.path, levels), own.noise, instrument)
    note_sight(own.reception, -image, _mirrored(seen), seen.path, covariance, instrument)
    return -image, covariance


@compiled
def located_with_errors(
    own: HeardBeacon, instrument: Instrument, systematic: Systematic
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return an AUV's own fix (3,), m, its covariance (3, 3), m2, J with its derivatives (3, 4 k +
    2), and the remaining covariance, as of :func:`.fixes.measured_with_errors`: the errors are the
    array's misalignment in the AUV, its clock, and the ASV's slow GNSS error.
    """
    reception, count = own.reception, systematic.variances.size
    sds = deviations(reception.arrived_at_s, systematic.levels)
    seen = _sighting(own, instrument, systematic)
    # a late clock makes the path shorter
    image = by_range(seen, 0.0, -1.0, sds[CLOCK], own.noise, instrument)
    covariance, effects, bends = image.covariance[:3, :3].copy(), image.effects, -image.bends
    for k in range(EFFECTS):  # of the mirror image, which moves in the opposite direction
        if k < GNSS or k >= SOUND_SPEED:
            for i in range(3):
                effects[i, k] = -effects[i, k]
    add_own(covariance, effects, bends, sds)
    for k in (SOUND_SPEED, CLOCK):
        add(covariance, effects[:, k], sds[k] ** 2)
    fix = -image.fix
    jump(fix, own.noise, systematic.levels)
    columns = np.zeros((4, 4 * count + 2))
    whose = Whose(0, reception.asv, NONE, reception.arrived_at_s)
    write_columns(columns, effects, image.changes, bends, whose, systematic)
    jacobians = columns[:3]
    each = np.concatenate((jacobians[:, 3 * count : 4 * count], jacobians[:, :count]), axis=1)
    left = noise_of(covariance, each, systematic.variances)
    note_sight(reception, fix, _mirrored(seen), seen.path, left, instrument)
    return fix, covariance, jacobians, level_part(left)


@compiled
def _sighting(own: HeardBeacon, instrument: Instrument, errors: Systematic | None) -> Sighting:
    """Return an AUV's measurement of an ASV, mirrored so that the ASV is the origin."""
    ping, reception = own.ping, own.reception
    beneath, above = negative(own.place), negative((ping.x_m, ping.y_m, ping.z_m))
    took, off = reception.travel_time_s, NOTHING
    if errors is not None:
        late, later = errors.clocks[reception.auv]
        took = took - late - later * reception.arrived_at_s
        off = negative(gnss_error(reception.asv, ping.sent_at_s, errors))
    view = ArrayView(beneath, above, own.yaw, took, beneath[2] - above[2], off)
    return measure(view, reception, reception.auv, own.noise, instrument, errors)


@compiled
def _mirrored(seen: Sighting) -> Sighting:
    """Return a measurement of the AUV as if the ASV had made it: direction and attitude negated."""
    return Sighting(
        seen.vessel, negative(seen.unit), -seen.believed, seen.path, seen.snr_db, seen.below
    )
