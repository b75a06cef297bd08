"""What a USBL measures of a ping: a fix of where it was sent, and how sure it is of that.

Range comes from the travel time, direction from the array, attitude from the AHRS and the vessel's
own position from GNSS.  Frames are those of :mod:`.array`.  A data sheet's figures are the whole
system's: they stand in the place of what an array makes of arrival times, and of the noise of
travel times.
"""

import math
from math import cos, hypot, isnan, nan, sin
from typing import Annotated, Any, NamedTuple

import numpy as np

from ..core.arrays import Floats
from ..core.compiled import compiled, written_out
from ..records.rows import Row, Rows
from .array import (
    Vector,
    arrival_differences,
    direction,
    divided,
    dot,
    length,
    minus,
    plus,
    rotation,
    scaled,
    tangents,
    turned,
)
from .covariance import (
    Across,
    across_by_array,
    across_by_sheet,
    debias,
    fix_covariance,
    not_nothing,
    sds_across,
)

# The noise of bearing and elevation (rad), the share of a path that is noise of its length, the
# noise of the place along each axis (m) and its share of the range, the SNR (dB) at which angles
# are as noisy as that (nan: at any), and what they never fall below (rad); whether one is there.
SHEET = [
    *((name, "f8") for name in ("bearing_sd_rad", "elevation_sd_rad", "path_share")),
    *((name, "f8") for name in ("spread_sd_m", "spread_share", "reference_snr_db")),
    *(("angle_floor_rad", "f8"), ("has_sheet", "?")),
]
NO_SHEET = (0.0, 0.0, 0.0, 0.0, 0.0, nan, 0.0, False)

# Of a row of noise the first three numbers are the direction's, and from here on the spread's three
# (no sheet states both): elements of an array, of which they are else, there are none.
SPREAD_NOISE = 2


class Sheet(NamedTuple):
    """What a sheet states, as standard deviations.

    Of bearing and elevation (rad); of the length of a path (m) and as a share of it, added in
    squares; of a place along each axis (m) and as a share of its range, added in squares.  Angles
    are those at a signal-to-noise ratio (dB; nan: at any), and never below `angle_floor` (rad).
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
        """The fields SHEET of this sheet."""
        return (
            *(self.bearing_sd, self.elevation_sd, self.path_share),
            *(self.spread_sd, self.spread_share, self.reference_snr_db, self.angle_floor, True),
        )


@compiled
def angle_sds(snr_db: float, levels: Row) -> tuple[float, float]:
    """Return the noise (rad) of bearing and elevation at an SNR (dB, nan if nobody knows of one).

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
    """Return the unit vector (3,) that is made out of a source at `seen` (3,), m, both in the array
    frame; `sds` (rad) as of :func:`angle_sds`.
    """
    away = not_nothing(seen)
    unit = divided(away, length(away))
    east, down = tangents(unit)
    aside = stated_aside(east, down, sds, (noise[0], noise[1], noise[2]))
    turn = length(aside)
    return plus(scaled(unit, cos(turn)), scaled(aside, sin(turn) / turn if turn > 0.0 else 1.0))


@compiled
def stated_aside(east: Vector, down: Vector, sds: tuple[float, float], noise: Vector) -> Vector:
    """Return what a sheet's direction errs by (3,), rad, across itself: along the unit vectors
    `east`, which is level, and `down`, by angles of `sds` (:func:`.covariance.sds_across`).

    Three standard normal numbers of the array make both, as an array's elements do: a direction
    near it errs alike, and straight below, where every way is level, there is no edge.
    """
    level, steep = sds_across(down[2], sds)
    return plus(scaled(east, level * dot(east, noise)), scaled(down, steep * dot(down, noise)))


@compiled
def path_sd(path: float, levels: Row) -> float:
    """Return the noise (m) of the length of a path (m): one way, or a call's and its answer's; of
    what is known to change slowly without that.
    """
    return math.sqrt(1.0 - levels.slow_share) * _whole_path_sd(path, levels)


@compiled
def slow_path_sd(path: float, levels: Row) -> float:
    """Return the standard deviation (m) of what is known to be slow in the length of a path (m)."""
    return math.sqrt(levels.slow_share) * _whole_path_sd(path, levels)


@compiled
def _whole_path_sd(path: float, levels: Row) -> float:
    return hypot(levels.sound_speed_m_per_s * levels.travel_time_sd_s, levels.path_share * path)


@compiled
def spread_sd(reach: float, levels: Row) -> float:
    """Return the noise (m) of a place at a range (m) along each axis, but for range and angles."""
    return hypot(levels.spread_sd_m, levels.spread_share * reach)


# Noise of one measurement: from column 0 on that of 5 element arrivals, then of the travel time, of
# roll, pitch and heading, and of GNSS along 3 axes; what further elements err by stands at the
# row's end
TIME_NOISE, ATTITUDE_NOISE, HEADING_NOISE, GNSS_NOISE, NOISE_WIDTH = 5, 6, 8, 9, 12

# What all measurements of an instrument share: the sound speed that it computes with and the true
# one (m/s), the noise of one element (s), that of a travel time (s), of GNSS along each axis (m),
# and of roll, pitch and heading (rad); what an SNR of 0 dB adds to the noise of an element (s); the
# share of acoustic variances that is known to change slowly; what a sheet says in the place of the
# array.
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
    """What ASVs measure with: the places of the elements (n, 3), m, their scatter matrix (3, 3), m2
    (:mod:`.array`), and a record of LEVELS; a data sheet is in their place where there is one.
    """

    array: Floats
    metric: Floats
    levels: Row


class PackedInstrument(NamedTuple):
    """An :class:`Instrument` as compiled code is handed it once: levels (1,), and no array where
    somebody's own measures later.
    """

    array: Annotated[Floats, 2]
    metric: Annotated[Floats, 2]
    levels: Annotated[Rows, LEVELS]


@written_out
def instrument_of(packed: PackedInstrument) -> Instrument:
    """Return an instrument, of what was handed over."""
    return Instrument(packed.array, packed.metric, packed.levels[0])


class Sighting(NamedTuple):
    """What an array measures of a ping: where it is (m), the direction and the attitude that it
    believes in (:func:`sighted`), the length (m) of the way of the ping, or of call and answer, and
    its signal-to-noise ratio (dB, nan if nobody knows of one); how far (m) the source was below it,
    by its pressure sensor.
    """

    vessel: Vector
    unit: Vector
    believed: Floats
    path: float
    snr_db: float
    below: float


# What is handed over in the place of an instrument of somebody's own
NO_INSTRUMENT = PackedInstrument(np.empty((0, 3)), np.eye(3), np.zeros(1, dtype=LEVELS))


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
    frame, m), `snr_db` its signal-to-noise ratio, nan if nobody knows of one; `noise` are
    NOISE_WIDTH standard normal numbers.
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
    """Return the unit vector to a source that an ASV believes in, and the attitude that it believes
    to have: the rotation (3, 3) from array to survey frame.  Arguments as of :func:`locate`.
    """
    attitude_sd, (ahead, aside, below) = instrument.levels.attitude_sd_rad, minus(source, vessel)
    cy, sy = math.cos(yaw), math.sin(yaw)  # arrays hang level, whatever the AHRS says
    seen = cy * ahead + sy * aside, cy * aside - sy * ahead, below
    within = _made_out(seen, snr_db, noise, instrument)
    believed = rotation(
        attitude_sd[0] * noise[ATTITUDE_NOISE],
        attitude_sd[1] * noise[ATTITUDE_NOISE + 1],
        yaw + attitude_sd[2] * noise[HEADING_NOISE],
    )
    return turned(believed, within), believed


@compiled
def _made_out(seen: Vector, snr_db: float, noise: Floats, instrument: Instrument) -> Vector:
    """Return the unit vector (3,) that is made out of a source at `seen` (3,), m, both in the array
    frame.
    """
    levels = instrument.levels
    if levels.has_sheet:
        return stated_direction(seen, angle_sds(snr_db, levels), noise)
    differences = arrival_differences(
        instrument.array, seen, levels.true_sound_speed_m_per_s, noise,
        timed_sd(levels.element_sd_s, snr_db, levels),
    )  # fmt: skip
    return direction(instrument.array, differences, levels.sound_speed_m_per_s, instrument.metric)


@compiled
def _across(offset: Vector, believed: Floats, snr_db: float, instrument: Instrument) -> Across:
    """Return what the direction of an offset (3,), m, errs by, without what is known to be slow."""
    levels = instrument.levels
    if levels.has_sheet:
        return across_by_sheet(offset, angle_sds(snr_db, levels), 1.0 - levels.slow_share)
    timing_sd = math.sqrt(1.0 - levels.slow_share) * timed_sd(levels.element_sd_s, snr_db, levels)
    direction_sd = levels.sound_speed_m_per_s * timing_sd
    return across_by_array(offset, believed, instrument.metric, direction_sd)


@compiled
def timed_sd(floor: float, snr_db: float, levels: Row) -> float:
    """Return the noise (s) of an element that has a `floor` (s) of its own, and what a signal of
    that SNR adds; nothing where no SNR is known.
    """
    if levels.timing_sd_s > 0.0 and not math.isnan(snr_db):
        return math.sqrt(floor**2 + levels.timing_sd_s**2 * 10.0 ** (-snr_db / 10.0))
    return floor


@compiled
def clocked(travel_time: float, noise: Floats, instrument: Instrument) -> float:
    """Return a travel time (s) as it is measured: below 0 where noise or a clock makes it so, for
    what is cut off there would err by something that no covariance tells.
    """
    levels = instrument.levels
    sd = math.hypot(levels.travel_time_sd_s, levels.path_share * travel_time)
    return float(travel_time + sd * noise[TIME_NOISE])


@compiled
def placed(
    seen: Sighting, reach: float, ranging_sd: float, noise: Floats, instrument: Instrument
) -> tuple[Floats, Floats]:
    """Return the fix (3,), m, at a range `reach` (m, of standard deviation `ranging_sd`) in the
    direction that was seen, and its covariance (3, 3), m2, without what is known to change slowly.
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
    """Return the covariance (3, 3), m2, of what lies so far `away` (m) in the direction that was
    seen, by the errors of the direction alone.
    """
    offset, attitude_sd = not_nothing(scaled(seen.unit, away)), instrument.levels.attitude_sd_rad
    across = _across(offset, seen.believed, seen.snr_db, instrument)
    return fix_covariance(offset, seen.believed, across, 0.0, attitude_sd, 0.0)


@compiled
def offset_of(
    fix: Floats, vessel: Vector, reach: float, noise: Floats, instrument: Instrument
) -> Vector:
    """Return the offset (3,), m, at whose end a fix was placed, without what moved it as a whole:
    GNSS and the spread that a sheet states.
    """
    levels = instrument.levels
    gnss = scaled(gnss_noise(noise), levels.gnss_sd_m)
    spread = scaled(_spread_noise(noise), spread_sd(reach, levels))
    return minus(minus(minus((fix[0], fix[1], fix[2]), vessel), gnss), spread)


@compiled
def gnss_noise(noise: Floats) -> Vector:
    """Return the numbers along x, y and z that a vessel is off by, in standard deviations."""
    return noise[GNSS_NOISE], noise[GNSS_NOISE + 1], noise[GNSS_NOISE + 2]


@compiled
def _spread_noise(noise: Floats) -> Vector:
    return noise[SPREAD_NOISE], noise[SPREAD_NOISE + 1], noise[SPREAD_NOISE + 2]
