"""Fixes: what one array makes of a ping, and those of all that heard it, made one.

Without errors that last each measurement errs by itself (:func:`measured`).  With systematic errors

    fix = place + J c + noise

c are the heading misalignment of each ASV, the slow error of its GNSS position along x and y, the
share by which sound is taken for too fast, and how late the AUV's clock is.  What an ASV has by
itself is one more error of its measurement; sound speed and clock are those of all that hear a ping
at once, so that they are fused as unknowns beside the place (best linear unbiased estimate).

An AUV that measures an ASV's ping with its own array finds where it is itself (inverted USBL).
Everything is that of :mod:`.measuring` seen from the other end: the array and the AHRS are the
AUV's, the source is the ASV.  Synchronised clocks make the travel time a range.  With the source as
the origin a fix is the mirror image of a fix of the source, and so is its covariance.  Source:
Rypkema, Fischell and Schmidt, "One-way travel-time inverted ultra-short baseline localization for
low-cost autonomous underwater vehicles", ICRA 2017.
"""

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
from .measuring import NOISE_WIDTH, Instrument, Sighting, offset_of, path_sd, placed
from .sights import note_call, note_sight, unknown_sights
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
    astray,
    bent,
    changes,
    deviations,
    kept,
    lengthen,
    level_part,
    limit,
    move,
    noise_of,
    spread_out,
    states_place,
)
from .two_way import (
    Heard,
    View,
    by_itself,
    first_to_locate,
    measure,
    sighting,
    two_way,
    way_to_caller,
)


@compiled
def measured(
    heard: Heard, asvs: Motion, instrument: Instrument, strayed: Floats
) -> tuple[Floats, Floats]:
    """Return the fix (3,), m, of a ping and its covariance (3, 3), m2, fused over its hearers.

    `strayed` (AUVs,) is how far each may have strayed between a call and its answer (variance along
    its course, m2).
    """
    if not isnan(heard.ping.call_time_s):
        return two_way(heard, asvs, instrument, strayed[heard.ping.auv])
    estimate, covariance, first = heard.noise[0], heard.noise, True  # until somebody has heard it
    for row in range(len(heard.receptions)):
        reception, noise = heard.receptions[row], heard.noise[row]
        if reception.outcome != HEARD:
            continue
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
    """Write what has been measured of a ping to the row of its fix."""
    row.x_m, row.y_m, row.z_m = estimate[0], estimate[1], estimate[2]
    row.sd_x_m = sqrt(max(covariance[0, 0], 0.0))
    row.sd_y_m = sqrt(max(covariance[1, 1], 0.0))
    row.sd_z_m = sqrt(max(covariance[2, 2], 0.0))
    row.cov_xy_m2, row.cov_xz_m2 = covariance[0, 1], covariance[0, 2]
    row.cov_yz_m2 = covariance[1, 2]
    row.error_m = hypot(estimate[0] - ping.x_m, estimate[1] - ping.y_m)


# Numbers of a row of noise, after those of NOISE_WIDTH and of the loss, that make an outlier
OUTLIER_WIDTH = 3


class Astray(NamedTuple):
    """The instrument that every ASV carries, and what is wrong all the time."""

    usbl: Usbl
    systematic: Systematic


@compiled
def jump(fix: Floats, noise: Floats, levels: Row) -> None:
    """Make an outlier of a fix (3,), m, if its noise says so; no covariance knows of that."""
    if levels.outlier_sd_m > 0.0 and noise[NOISE_WIDTH + 1] < levels.outliers_below:
        for axis in range(2):
            fix[axis] += levels.outlier_sd_m * noise[NOISE_WIDTH + 2 + axis]


class AsvFix(NamedTuple):
    """What one array makes of a ping: a fix (3,), m, in the direction `seen` at a range `reach`
    (m); the covariance (4, 4), m2, of it and of (less) the length of the call's way, with no error
    that lasts; its effects (4, EFFECTS), their changes along x and y (2, 4, EFFECTS), the `bends`
    (4, EFFECTS) that a misalignment (rad) squared makes half of, and that length (m), 0 without a
    call.  The call came along the unit vector `bearing` (3,); per m that its way was longer than if
    the AUV had kept its place, fix and (less) that length are off by `moved` (4,).
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
    """Return what an array makes of a ping that came over the path measured, less that of a call
    that went a known way (m); a clock that is late (of a standard deviation, s) makes the range
    longer, or shorter by a `sign`.
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
    effects[3] = 0.0  # the length of the call's way is given
    return AsvFix(
        fix, seen, reach, spread, effects, changes(effects, ahead, seen, instrument, clock_m),
        bent(effects, ahead, instrument), call_way, seen.unit, np.zeros(4),
    )  # fmt: skip


@compiled
def by_other(
    heard: Heard, row: int, call_way: float, asvs: Motion, instrument: Instrument, sds: Floats,
    systematic: Systematic,
) -> AsvFix:  # fmt: skip
    """Return what an ASV makes of a ping, or of an answer whose call went a known way (m)."""
    seen, noise = sighting(heard, row, asvs, instrument, systematic), heard.noise[row]
    part = by_range(seen, call_way, 1.0, sds[CLOCK], noise, instrument)
    jump(part.fix, noise, systematic.levels)
    return part


@compiled
def _by_whole_way(
    heard: Heard, row: int, asvs: Motion, instrument: Instrument, strayed: Floats, sds: Floats,
    systematic: Systematic,
) -> AsvFix:  # fmt: skip
    """Return what an ASV makes of an answer by the whole way of call and answer."""
    ping, noise = heard.ping, heard.noise[row]
    seen = sighting(heard, row, asvs, instrument, systematic)
    baseline = way_to_caller(heard, row, seen, asvs, instrument)
    baseline = plus(baseline, astray(ping.called_by, ping.called_at_s, systematic))
    alone = by_itself(seen, baseline, heard, row, instrument, strayed[ping.auv])
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
    """Return when (s) the AUV's clock told it to ping; NaN if a call did."""
    return float(ping.sent_at_s) if isnan(ping.call_time_s) else nan


# What is fused: a place, the error of the call's way (m), sound speed and clock per sd
UNKNOWNS = 6

# As unlikely (sd) as consistent fixes of a ping contradict each other once in a thousand pings
CONTRADICTION = 3.0902


@compiled
def measured_astray(
    heard: Heard,
    asvs: Motion,
    instrument: Instrument,
    strayed: Floats,
    systematic: Systematic,
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return the fix (3,), m, of a ping, its covariance (3, 3), m2, J (3, 4 k + 2), and what is
    left of the covariance without the errors that J is of, xx, yy, xy (3,), m2.

    `strayed` (AUVs,) is how far each may have strayed between a call and its answer (variance along
    its course, m2).  Behind the columns of J at the fix are
    their derivatives along x, along y, and by what they belong to; last are those of the way along
    x and y (m) from where the AUV has answered back to where it has heard the call.
    """
    first, sds = first_to_locate(heard), deviations(_clock_at(heard.ping), systematic.levels)
    if not isnan(heard.ping.call_time_s):
        begun = _by_whole_way(heard, first, asvs, instrument, strayed, sds, systematic)
    else:
        begun = by_other(heard, first, 0.0, asvs, instrument, sds, systematic)
    state, spread, squares = np.zeros(UNKNOWNS), _begun(begun, sds), 0.0
    state[:3] = begun.fix
    known = _columns(begun, heard, first, systematic)
    reception, alone = heard.receptions[first], spread[:3, :3].copy()
    note_sight(reception, begun.fix, begun.seen, begun.reach, alone, instrument)
    jacobians = np.zeros((UNKNOWNS, known.shape[1]))
    jacobians[:3] = known[:3]
    others = 0
    for row in range(len(heard.receptions)):
        if heard.receptions[row].outcome == HEARD and row != first:
            others += 1
            part = by_other(heard, row, begun.call_way, asvs, instrument, sds, systematic)
            fix, own, beside = part.fix, part.covariance[:3, :3].copy(), _beside(part, sds)
            add_own(own, part.effects, part.bends, sds)
            note_sight(heard.receptions[row], part.fix, part.seen, part.reach, own, instrument)
            fused = fuse_shared(state, spread, fix, own, beside)
            off = _columns(part, heard, row, systematic)[:3]
            if begun.call_way > 0.0:  # its error is in every other range
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
        unknown_sights(heard.receptions)  # they err together
        if not isnan(heard.ping.call_time_s):
            note_call(heard.receptions, heard.ping)
    move(jacobians, state)
    out[:, : 4 * count] = jacobians[:3, : 4 * count]
    return state[:3].copy(), covariance, out, level_part(left)


@compiled
def _begun(part: AsvFix, sds: Floats) -> Floats:
    """Return the covariance (UNKNOWNS, UNKNOWNS) of what is fused, after the first measurement."""
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
    """Return how a fix depends (3, UNKNOWNS - 3) on what is fused beside the place."""
    out = np.zeros((3, UNKNOWNS - 3))
    for i in range(3):
        if part.call_way > 0.0:
            out[i, 0] = -part.seen.unit[i]
        out[i, 1] = sds[SOUND_SPEED] * part.effects[i, SOUND_SPEED]
        out[i, 2] = sds[CLOCK] * part.effects[i, CLOCK]
    return out


@compiled
def _columns(part: AsvFix, heard: Heard, row: int, systematic: Systematic) -> Floats:
    """Return effects in the columns of J, (4, 5 k + 1): as they would be at the origin, how they
    change along x, along y, and with what they belong to, and as they are; and that of the call's
    way.
    """
    count, asv = systematic.variances.size, heard.receptions[row].asv
    whose = Whose(asv, asv, heard.ping.called_by, _clock_at(heard.ping))
    out = np.zeros((4, 5 * count + 1))
    out[:, 5 * count] = part.moved
    write_columns(out, part.effects, part.changes, part.bends, whose, systematic)
    out[:, 4 * count : 5 * count] = out[:, :count]
    move(out, -part.fix)  # each from its own fix to where all can be added up
    return out


@compiled
def write_columns(
    out: Floats, effects: Floats, moved: Floats, bends: Floats, whose: Whose,
    systematic: Systematic,
) -> None:  # fmt: skip
    """Write effects (4, EFFECTS) to columns of J (4, 4 k or more), how these change along x, along
    y (2, 4, EFFECTS), and with what they belong to.
    """
    count, levels = systematic.variances.size, systematic.levels
    spread_out(effects, out[:, :count], whose, levels)
    for axis in range(2):
        columns = out[:, (1 + axis) * count : (2 + axis) * count]
        spread_out(moved[axis], columns, whose, levels)
    spread_out(bends, out[:, 3 * count : 4 * count], whose, levels)


@compiled
def _doubt(squares: float, freedom: float, levels: Row) -> float:
    """Return the factor on the covariance of fixes that contradict each other, else 1.

    Where there may be outliers, an improbable sum of squares says that somebody has measured one;
    nobody knows who.  Sources: limit of chi-squared by Wilson and Hilferty, 1931; factor by Birge,
    Phys. Rev. 40, 1932.
    """
    if levels.outlier_sd_m <= 0.0 or freedom <= 0.0:
        return 1.0
    share = 2.0 / (9.0 * freedom)
    limit = freedom * (1.0 - share + CONTRADICTION * sqrt(share)) ** 3
    return squares / freedom if squares > limit else 1.0


class HeardBeacon(NamedTuple):
    """A ping and its reception at an AUV: where that is as it arrives (3,), m, and heads (rad), and
    the noise of the measurement, standard normal numbers (NOISE_WIDTH or more).

    The three of GNSS make the error of what the AUV takes the ASV's place for.
    """

    ping: Row
    reception: Row
    place: Vector
    yaw: float
    noise: Floats


@compiled
def located_itself(own: HeardBeacon, instrument: Instrument) -> tuple[Floats, Floats]:
    """Return the fix (3,), m, of an AUV where a ping has reached it, and its covariance (3, 3), m2.

    It is the ASV's place less the offset measured.
    """
    seen, levels = _sighting(own, instrument, None), instrument.levels
    image, covariance = placed(seen, seen.path, path_sd(seen.path, levels), own.noise, instrument)
    note_sight(own.reception, -image, _mirrored(seen), seen.path, covariance, instrument)
    return -image, covariance


@compiled
def located_astray(
    own: HeardBeacon, instrument: Instrument, systematic: Systematic
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return the fix (3,), m, of an AUV, its covariance (3, 3), m2, J with its changes
    (3, 4 k + 2), and what is left, as of :func:`.fixes.measured_astray`: the array is
    turned in the AUV by its misalignment, its clock is late, the ASV is slowly astray.
    """
    reception, count = own.reception, systematic.variances.size
    sds = deviations(reception.arrived_at_s, systematic.levels)
    seen = _sighting(own, instrument, systematic)
    # a clock that is late takes the way for shorter than it was
    image = by_range(seen, 0.0, -1.0, sds[CLOCK], own.noise, instrument)
    covariance, effects, bends = image.covariance[:3, :3].copy(), image.effects, -image.bends
    for k in range(EFFECTS):  # of the mirror image, whose AUV moves the other way
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
    """Return what an AUV measures of an ASV, as the image of it where the ASV is the origin."""
    ping, reception = own.ping, own.reception
    beneath, above = negative(own.place), negative((ping.x_m, ping.y_m, ping.z_m))
    took, off = reception.travel_time_s, NOTHING
    if errors is not None:
        late, later = errors.clocks[reception.auv]
        took = took - late - later * reception.arrived_at_s
        off = negative(astray(reception.asv, ping.sent_at_s, errors))
    view = View(beneath, above, own.yaw, took, beneath[2] - above[2], off)
    return measure(view, reception, reception.auv, own.noise, instrument, errors)


@compiled
def _mirrored(seen: Sighting) -> Sighting:
    """Return a sighting as seen from the other end."""
    return Sighting(
        seen.vessel, negative(seen.unit), -seen.believed, seen.path, seen.snr_db, seen.below
    )
