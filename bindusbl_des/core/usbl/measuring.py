"""One USBL measurement of a ping: a fix of the position where it was sent, and its covariance.

Range comes from the travel time, direction from the array, attitude from the AHRS and the vessel's
own position from GNSS. Frames are those of :mod:`.array`.  A data sheet's figures are the whole
system's: they replace the array's arrival times, and the noise of travel times.  A fix has the
covariance of these parts, and is shortened by the uncertainty of its direction (:func:`debias`).
"""

import math
from math import cos, hypot, isnan, nan, sin
from typing import Annotated, Any, NamedTuple

import numpy as np

from ...support.arrays import Floats
from ...support.compiled import compiled, written_out
from ..records.rows import Row, Rows
from .array import (
    NOTHING,
    Vector,
    arrival_differences,
    cross,
    direction,
    divided,
    dot,
    length,
    minus,
    plus,
    rotated,
    rotated_back,
    rotation,
    scaled,
    tangents,
    weighted,
)

# A source nearer than this (m) is within the array; the limit only keeps divisions finite.
SHORTEST_RANGE = 1e-3

# Bearing and elevation are distinguishable beyond so many standard deviations from the vertical.
STEEP = 5.0

# A smallest variance (rad2), which only keeps divisions finite
TINY = 1e-30


class Across(NamedTuple):
    """The error of an offset across its direction: a covariance in the plane of two unit vectors
    (3,), scale (d e e^T - b (e f^T + f e^T) + a f f^T), m2, where e is horizontal and f across
    both.
    """

    east: Vector
    down: Vector
    a: float
    b: float
    d: float
    scale: float


@compiled
def across_by_array(
    offset: Vector, attitude: Floats, metric: Floats, direction_sd: float
) -> Across:
    """Return the error across an offset (3,), m, whose direction an array has measured.

    `attitude` is the rotation from array to survey frame, `metric` the scatter matrix (m2),
    `direction_sd` the element noise times the sound speed (m): r^2 T (T^T M T)^-1 T^T sd^2.
    """
    reach = length(offset)
    east, down = tangents(divided(offset, reach))
    along_east, along_down = rotated_back(attitude, east), rotated_back(attitude, down)
    a, b = weighted(metric, along_east, along_east), weighted(metric, along_east, along_down)
    d = weighted(metric, along_down, along_down)
    return Across(east, down, a, b, d, (reach * direction_sd) ** 2 / (a * d - b * b))


@compiled
def across_by_sheet(offset: Vector, sds: tuple[float, float], share: float) -> Across:
    """Return a `share` of the error (variance) across an offset (3,), m, whose bearing and
    elevation have the stated errors `sds` (rad).
    """
    square = offset[0] ** 2 + offset[1] ** 2 + offset[2] ** 2
    east, down = tangents(divided(offset, math.sqrt(square)))
    level, steep = sds_across(down[2], sds)
    return Across(east, down, steep**2, 0.0, level**2, share * square)


@compiled
def sds_across(level: float, sds: tuple[float, float]) -> tuple[float, float]:
    """Return the errors (sd, rad) of a direction, horizontal and vertical, by a stated bearing and
    elevation; `level` is the direction's horizontal share (0 to 1).

    Both are angles across the direction at any elevation.  Within a few standard deviations of the
    vertical bearing and elevation cannot be distinguished, and both errors are their mean square.
    """
    bearing, elevation = sds[0] ** 2, sds[1] ** 2
    apart = level**2 / (STEEP**2 * max(bearing, elevation, TINY))
    mixed = 0.5 * math.exp(-0.5 * apart) * (elevation - bearing)
    return math.sqrt(bearing + mixed), math.sqrt(elevation - mixed)


@compiled
def fix_covariance(
    offset: Vector,
    attitude: Floats,
    across: Across,
    ranging_sd: float,
    attitude_sd: Floats,
    gnss_sd: float,
) -> Floats:
    """Return the first-order covariance (3, 3), m2, of a fix, in the survey frame.

    `offset` points from the array to the source (survey frame, m), not 0; `attitude` is the
    rotation from array to survey frame, `across` the error of the direction, `ranging_sd` in m,
    `attitude_sd` (roll, pitch, heading) in rad.  Source: physics of the first-order terms of eq.
    usbl_fix, sr^2 s s^T + across + [r s]x Sigma_att [r s]x^T + sg^2 I.
    """
    unit = divided(offset, length(offset))
    east, down, a, b, d, scale = across
    heading = math.atan2(attitude[1, 0], attitude[0, 0])
    ch, sh = math.cos(heading), math.sin(heading)
    by_roll = scaled(cross(offset, (ch, sh, 0.0)), attitude_sd[0])
    by_pitch = scaled(cross(offset, (-sh, ch, 0.0)), attitude_sd[1])
    by_heading = scaled(cross(offset, (0.0, 0.0, 1.0)), attitude_sd[2])
    out = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            tangent = d * east[i] * east[j] - b * (east[i] * down[j] + down[i] * east[j])
            tangent += a * down[i] * down[j]
            out[i, j] = ranging_sd**2 * unit[i] * unit[j] + scale * tangent
            out[i, j] += by_roll[i] * by_roll[j]
            out[i, j] += by_pitch[i] * by_pitch[j]
            out[i, j] += by_heading[i] * by_heading[j]
        out[i, i] += gnss_sd**2
    return out


@compiled
def not_nothing(offset: Vector) -> Vector:
    """Return an offset (3,), m, or a short one downwards if it is too short to have a direction."""
    return (0.0, 0.0, SHORTEST_RANGE) if length(offset) < SHORTEST_RANGE else offset


@compiled
def debias(ahead: Vector, covariance: Floats, ranging_sd: float) -> float:
    """Return the factor that shortens an offset; add the uncertainty of that to the covariance.

    Given a measured direction with error covariance A, the source lies anywhere on a cap of the
    sphere around it: on average r tr(A) / 2 nearer to the array than the cap's top, with a radial
    variance of r^2 tr(A^2) / 2 that the first-order `covariance` (m2, changed in place) lacks.
    Where the cap would be the whole sphere, a measurement says no more than that the source lies
    somewhere on it: the fix is its centre, with a variance of r^2 / 3 along each axis.  Source:
    measurement conversion conditioned on the measurement, Duan, Han and Li, IEEE Trans.  AES 40(4),
    2004, to second order. (Conversions that are unbiased over measurements of one position, as by
    Lerro and Bar-Shalom, 1993, lengthen the offset instead.)
    """
    square = max(ahead[0] ** 2 + ahead[1] ** 2 + ahead[2] ** 2, SHORTEST_RANGE**2)
    trace = trace_of_square = 0.0
    for i in range(3):
        for j in range(3):
            across = covariance[i, j] - ranging_sd**2 * ahead[i] * ahead[j] / square
            trace_of_square += across * across
            if i == j:
                trace += across
    if trace >= 2.0 * square:
        for i in range(3):
            for j in range(3):
                covariance[i, j] = (square + ranging_sd**2) / 3.0 if i == j else 0.0
        return 0.0
    for i in range(3):
        for j in range(3):
            covariance[i, j] += 0.5 * trace_of_square / square * ahead[i] * ahead[j] / square
    return float(1.0 - 0.5 * trace / square)


# A data sheet: noise of bearing and elevation (rad), noise of a path as a share of it, noise of the
# position along each axis (m) and as a share of the range, the SNR (dB) at which the angles hold
# (nan: at any), their lower limit (rad), and whether there is a sheet.
SHEET = [
    *((name, "f8") for name in ("bearing_sd_rad", "elevation_sd_rad", "path_share")),
    *((name, "f8") for name in ("spread_sd_m", "spread_share", "reference_snr_db")),
    *(("angle_floor_rad", "f8"), ("has_sheet", "?")),
]
NO_SHEET = (0.0, 0.0, 0.0, 0.0, 0.0, nan, 0.0, False)

# With a sheet, a row of noise has the direction's three numbers from 0 on and the position's three
# from here on (no sheet states both), in the place of the elements of an array.
SPREAD_NOISE = 2


class Sheet(NamedTuple):
    """A data sheet's figures, as standard deviations.

    Of bearing and elevation (rad); of the length of a path (m) and as a share of it, added in
    squares; of a position along each axis (m) and as a share of its range, added in squares.
    Angles hold at a signal-to-noise ratio (dB; nan: at any), and are never below `angle_floor`
    (rad).
    """

    bearing_sd: float = 0.0
    elevation_sd: float = 0.0
    path_sd: float = 0.0
    path_share: float = 0.0
    spread_sd: float = 0.0
    spread_share: float = 0.0
    reference_snr_db: float = nan
    angle_floor: float = 0.0

    @property
    def levels(self) -> tuple[Any, ...]:
        """The values of the fields SHEET of LEVELS for this sheet."""
        return (
            *(self.bearing_sd, self.elevation_sd, self.path_share),
            *(self.spread_sd, self.spread_share, self.reference_snr_db, self.angle_floor, True),
        )


@compiled
def angle_sds(snr_db: float, levels: Row) -> tuple[float, float]:
    """Return the noise (rad) of bearing and elevation at an SNR (dB, nan if unknown).

    It falls as 10^(-SNR / 20), as the Cramer-Rao bound of an arrival's time does, to a floor.
    """
    bearing, elevation = levels.bearing_sd_rad, levels.elevation_sd_rad
    less = levels.reference_snr_db - snr_db
    if isnan(less):
        return bearing, elevation
    factor, floor = 10.0 ** (less / 20.0), levels.angle_floor_rad
    return max(factor * bearing, floor), max(factor * elevation, floor)


@compiled
def stated_direction(seen: Vector, sds: tuple[float, float], noise: Floats) -> Vector:
    """Return the measured unit vector (3,) to a source at `seen` (3,), m, both in the array frame,
    with a sheet's errors `sds` (rad) as of :func:`angle_sds`.
    """
    away = not_nothing(seen)
    unit = divided(away, length(away))
    east, down = tangents(unit)
    aside = stated_aside(east, down, sds, (noise[0], noise[1], noise[2]))
    turn = length(aside)
    return plus(scaled(unit, cos(turn)), scaled(aside, sin(turn) / turn if turn > 0.0 else 1.0))


@compiled
def stated_aside(east: Vector, down: Vector, sds: tuple[float, float], noise: Vector) -> Vector:
    """Return the error (3,), rad, of a sheet's direction across itself: along the unit vectors
    `east`, which is horizontal, and `down`, with angles `sds` (:func:`.measuring.sds_across`).

    Three standard normal numbers in the array's frame make both, as an array's elements do: nearby
    directions have similar errors, and there is no discontinuity straight below, where every
    direction across is horizontal.
    """
    level, steep = sds_across(down[2], sds)
    return plus(scaled(east, level * dot(east, noise)), scaled(down, steep * dot(down, noise)))


@compiled
def path_sd(path: float, levels: Row, slow: bool = False) -> float:
    """Return the white noise (sd, m) of a measured path (m), one-way or of call and answer, or if
    `slow` its slow error; `levels` is a record of LEVELS.
    """
    share = levels.slow_share if slow else 1.0 - levels.slow_share
    whole = hypot(levels.sound_speed_m_per_s * levels.travel_time_sd_s, levels.path_share * path)
    return math.sqrt(share) * whole


@compiled
def spread_sd(reach: float, levels: Row) -> float:
    """Return a data sheet's noise (sd, m) of a position along each axis at a range `reach` (m)."""
    return hypot(levels.spread_sd_m, levels.spread_share * reach)


# Columns of a row of noise: 5 element arrivals from 0 on, then the travel time, roll, pitch and
# heading, and GNSS along 3 axes; further elements are at the row's end
TIME_NOISE, ATTITUDE_NOISE, HEADING_NOISE, GNSS_NOISE, NOISE_WIDTH = 5, 6, 8, 9, 12

# Figures of an instrument: the sound speed that it assumes and the true one (m/s), the noise of one
# element (s), of a travel time (s), of GNSS along each axis (m), and of roll, pitch and heading
# (rad); the noise that an SNR of 0 dB adds to an element (s); the slow share of acoustic variances;
# a data sheet in the place of the array.
LEVELS = np.dtype(
    [
        ("sound_speed_m_per_s", "f8"),
        ("true_sound_speed_m_per_s", "f8"),
        ("element_sd_s", "f8"),
        ("travel_time_sd_s", "f8"),
        ("gnss_sd_m", "f8"),
        ("attitude_sd_rad", "f8", (3,)),
        ("timing_sd_s", "f8"),
        ("slow_share", "f8"),
        *SHEET,
    ]
)


class Instrument(NamedTuple):
    """An ASV's instrument: the positions of the elements (n, 3), m, their scatter matrix (3, 3), m2
    (:mod:`.array`), and a record of LEVELS, with a data sheet in their place if it has one.
    """

    array: Floats
    metric: Floats
    levels: Row


class PackedInstrument(NamedTuple):
    """The :class:`Instrument` of each carrier for compiled code: array (m, n, 3), metric (m, 3, 3)
    and levels (m,); n = 0 for a user-defined instrument, which measures later.
    """

    array: Annotated[Floats, 3]
    metric: Annotated[Floats, 3]
    levels: Annotated[Rows, LEVELS]


@written_out
def instrument_of(packed: PackedInstrument, carrier: int) -> Instrument:
    """Return the instrument of a carrier from the packed form."""
    return Instrument(packed.array[carrier], packed.metric[carrier], packed.levels[carrier])


class Sighting(NamedTuple):
    """What an array measures of a ping: the array's own position (m), direction and attitude
    (:func:`sighted`), the length (m) of the path of the ping, or of call and answer, and the SNR
    (dB, nan if unknown); and the depth (m) of the source below it, by its pressure sensor.
    """

    vessel: Vector
    unit: Vector
    believed: Floats
    path: float
    snr_db: float
    below: float


# Stands for a user-defined instrument in compiled code
NO_INSTRUMENT = PackedInstrument(np.empty((1, 0, 3)), np.eye(3)[None], np.zeros(1, dtype=LEVELS))


@compiled
def locate(
    source: Vector,
    vessel: Vector,
    yaw: float,
    travel_time: float,
    snr_db: float,
    noise: Floats,
    instrument: Instrument,
) -> tuple[Floats, Floats]:
    """Measure one ping: return the fix (3,), m, and its covariance (3, 3), m2 (eq. usbl_fix).

    `source` is where the ping was sent and `vessel` where the array is when it arrives (survey
    frame, m), at the heading `yaw` (rad), after the true travel time (s); `snr_db` its SNR, nan if
    unknown; `noise` are NOISE_WIDTH standard normal numbers.
    """
    unit, believed = sighted(source, vessel, yaw, snr_db, noise, instrument)
    reach = instrument.levels.sound_speed_m_per_s * clocked(travel_time, noise, instrument)
    seen = Sighting(vessel, unit, believed, reach, snr_db, source[2] - vessel[2])
    return placed(seen, reach, path_sd(reach, instrument.levels), noise, instrument)


@compiled
def sighted(
    source: Vector,
    vessel: Vector,
    yaw: float,
    snr_db: float,
    noise: Floats,
    instrument: Instrument,
) -> tuple[Vector, Floats]:
    """Return the measured unit vector to a source, and the measured attitude: the rotation (3, 3)
    from array to survey frame.  Arguments as of :func:`locate`.
    """
    attitude_sd, (ahead, aside, below) = instrument.levels.attitude_sd_rad, minus(source, vessel)
    cy, sy = math.cos(yaw), math.sin(yaw)  # arrays are level, whatever the AHRS measures
    seen = cy * ahead + sy * aside, cy * aside - sy * ahead, below
    levels = instrument.levels
    if levels.has_sheet:
        within = stated_direction(seen, angle_sds(snr_db, levels), noise)
    else:
        differences = arrival_differences(
            instrument.array, seen, levels.true_sound_speed_m_per_s, noise,
            timed_sd(levels.element_sd_s, snr_db, levels),
        )  # fmt: skip
        speed = levels.sound_speed_m_per_s
        within = direction(instrument.array, differences, speed, instrument.metric)
    believed = rotation(
        attitude_sd[0] * noise[ATTITUDE_NOISE],
        attitude_sd[1] * noise[ATTITUDE_NOISE + 1],
        yaw + attitude_sd[2] * noise[HEADING_NOISE],
    )
    return rotated(believed, within), believed


@compiled
def _across(offset: Vector, believed: Floats, snr_db: float, instrument: Instrument) -> Across:
    """Return the white error across an offset (3,), m; `believed` (3, 3): measured attitude."""
    levels = instrument.levels
    if levels.has_sheet:
        return across_by_sheet(offset, angle_sds(snr_db, levels), 1.0 - levels.slow_share)
    timing_sd = math.sqrt(1.0 - levels.slow_share) * timed_sd(levels.element_sd_s, snr_db, levels)
    direction_sd = levels.sound_speed_m_per_s * timing_sd
    return across_by_array(offset, believed, instrument.metric, direction_sd)


@compiled
def timed_sd(floor: float, snr_db: float, levels: Row) -> float:
    """Return an element's noise (s): a `floor` (s), and what an SNR (dB; nan: unknown) adds."""
    if levels.timing_sd_s > 0.0 and not math.isnan(snr_db):
        return math.sqrt(floor**2 + levels.timing_sd_s**2 * 10.0 ** (-snr_db / 10.0))
    return floor


@compiled
def clocked(travel_time: float, noise: Floats, instrument: Instrument) -> float:
    """Return a measured travel time (s), which noise or a clock error may make negative: clipping
    it would add an error that no covariance contains.
    """
    levels = instrument.levels
    sd = math.hypot(levels.travel_time_sd_s, levels.path_share * travel_time)
    return float(travel_time + sd * noise[TIME_NOISE])


@compiled
def placed(
    seen: Sighting, reach: float, ranging_sd: float, noise: Floats, instrument: Instrument
) -> tuple[Floats, Floats]:
    """Return the fix (3,), m, at a range `reach` (m, with standard deviation `ranging_sd`) in the
    measured direction, and its covariance (3, 3), m2, without slow errors.
    """
    ahead, levels = scaled(seen.unit, reach), instrument.levels
    offset, believed = not_nothing(ahead), seen.believed
    across = _across(offset, believed, seen.snr_db, instrument)
    covariance = fix_covariance(offset, believed, across, ranging_sd, levels.attitude_sd_rad, 0.0)
    shrinkage, spread = debias(ahead, covariance, ranging_sd), spread_sd(reach, levels)
    fix = np.empty(3)
    for k in range(3):
        fix[k] = seen.vessel[k] + levels.gnss_sd_m * noise[GNSS_NOISE + k] + shrinkage * ahead[k]
        fix[k] += spread * noise[SPREAD_NOISE + k]
        covariance[k, k] += levels.gnss_sd_m**2 + (1.0 - levels.slow_share) * spread**2
    return fix, covariance


@compiled
def turned_aside(seen: Sighting, away: float, instrument: Instrument) -> Floats:
    """Return the covariance (3, 3), m2, of a position at a distance `away` (m) in the measured
    direction, by the errors of the direction alone.
    """
    offset, attitude_sd = not_nothing(scaled(seen.unit, away)), instrument.levels.attitude_sd_rad
    across = _across(offset, seen.believed, seen.snr_db, instrument)
    return fix_covariance(offset, seen.believed, across, 0.0, attitude_sd, 0.0)


@compiled
def offset_of(
    fix: Floats, vessel: Vector, reach: float, noise: Floats, instrument: Instrument
) -> Vector:
    """Return the offset (3,), m, of a fix from a `vessel` (3,), m, as measured at a range `reach`
    (m): without the noise of GNSS and a sheet's of positions.
    """
    levels = instrument.levels
    gnss = scaled(gnss_noise(noise), levels.gnss_sd_m)
    spread = scaled(_spread_noise(noise), spread_sd(reach, levels))
    return minus(minus(minus((fix[0], fix[1], fix[2]), vessel), gnss), spread)


@compiled
def gnss_noise(noise: Floats) -> Vector:
    """Return a vessel's GNSS error along x, y, z, in standard deviations, from a row of noise."""
    return noise[GNSS_NOISE], noise[GNSS_NOISE + 1], noise[GNSS_NOISE + 2]


@compiled
def _spread_noise(noise: Floats) -> Vector:
    return noise[SPREAD_NOISE], noise[SPREAD_NOISE + 1], noise[SPREAD_NOISE + 2]


@compiled
def variances(
    away: Floats, depth: float, snr_db: Floats, moved: float, weighs: bool,
    array: Floats, metric: Floats, levels: Rows,
) -> Floats:  # fmt: skip
    """Return the variances along, across and down, and the covariance of along and down (g, 4), m2,
    of fixes at horizontal distances `away` (g,), m, a depth (m) and SNRs (g,), dB, by a packed
    instrument.

    With calls the range is half the path of call and answer, between which the AUV has `moved` (a
    variance, m2; below 0: one-way).  A filter that `weighs` fixes knows the direction better than
    one fix, so that the range along it is as precise as measured (:mod:`..navigation.turning`).
    """
    instrument = Instrument(array[0], metric[0], levels[0])
    out, none, believed = np.empty((away.size, 4)), np.zeros(NOISE_WIDTH), np.eye(3)
    for k in range(away.size):
        reach = max(math.hypot(away[k], depth), 1e-3)
        unit = away[k] / reach, 0.0, depth / reach
        ranging_sd = path_sd(reach, instrument.levels)
        if moved >= 0.0:
            ranging_sd = 0.5 * math.sqrt(path_sd(2.0 * reach, instrument.levels) ** 2 + moved)
        seen = Sighting(NOTHING, unit, believed, reach, snr_db[k], depth)
        _, spread = placed(seen, reach, ranging_sd, none, instrument)
        if weighs:
            spread_m2 = spread_sd(reach, instrument.levels) ** 2
            own = instrument.levels.gnss_sd_m**2 + (1.0 - instrument.levels.slow_share) * spread_m2
            bent = dot(rotated(spread, unit), unit) - ranging_sd**2 - own
            for i in range(3):
                for j in range(3):
                    spread[i, j] -= bent * unit[i] * unit[j]
        out[k, 0], out[k, 1] = spread[0, 0], spread[1, 1]
        out[k, 2], out[k, 3] = spread[2, 2], spread[0, 2]
    return out
