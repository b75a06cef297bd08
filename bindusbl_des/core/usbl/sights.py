"""What one array alone measures of a ping, and what of it is written to the reception.

A fix's covariance lies across the measured direction, and both have the same error.  A navigator
that knows the AUV's position better rotates the covariance to its own direction, for which it needs
the measurement itself: origin, direction, range, and their errors.
"""

from math import atan2, degrees, hypot, isnan, nan, sqrt
from typing import NamedTuple

from ...support.arrays import Floats
from ...support.compiled import compiled, inlined
from ..records.events import HEARD
from ..records.rows import Row, Rows
from ..vehicles.motion import Motion, where
from .array import (
    NOTHING,
    Vector,
    arrival_differences,
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
)
from .fusion import product
from .measuring import (
    SHORTEST_RANGE,
    Instrument,
    Sighting,
    clocked,
    path_sd,
    sighted,
    spread_sd,
)
from .systematic_effects import Systematic, gnss_error

# Largest variance (rad2, both axes together) of a direction that the second order still describes
UNSURE = 0.5


@compiled
def note_direction(row: Row, unit: Vector, believed: Floats) -> None:
    """Write the measured direction to a reception.

    `unit` (3,) is the unit vector to the sender in the survey frame, `believed` the rotation (3, 3)
    from array to survey frame by the AHRS.
    """
    row.azimuth_deg, row.elevation_deg = _angles(unit)
    row.body_azimuth_deg, row.body_elevation_deg = _angles(rotated_back(believed, unit))


@compiled
def _angles(unit: Vector) -> tuple[float, float]:
    """Return azimuth, in [0, 360), and elevation (deg) of a unit vector (3,)."""
    azimuth = degrees(atan2(unit[1], unit[0])) % 360.0
    azimuth %= 360.0  # of -1e-20 deg the first remainder is 360
    return azimuth, degrees(atan2(unit[2], hypot(unit[0], unit[1])))


@compiled
def copy_direction(fix: Row, receptions: Rows) -> None:
    """Write to a fix the direction measured by the only ASV that heard its ping; NaN if there are
    several, or it is not known.
    """
    fix.azimuth_deg = fix.elevation_deg = fix.body_azimuth_deg = fix.body_elevation_deg = nan
    hearers, only = 0, 0
    for row in range(len(receptions)):
        if receptions[row].outcome == HEARD:
            hearers, only = hearers + 1, row
    if hearers == 1:
        reception = receptions[only]
        fix.azimuth_deg, fix.elevation_deg = reception.azimuth_deg, reception.elevation_deg
        fix.body_azimuth_deg, fix.body_elevation_deg = (
            reception.body_azimuth_deg,
            reception.body_elevation_deg,
        )


@compiled
def note_sight(
    row: Row, fix: Floats, seen: Sighting, reach: float, noise: Floats, instrument: Instrument
) -> None:
    """Write an array's measurement to its reception: origin, direction, range, and their errors.

    `fix` (3,), m, is the position by the range `reach` (m) in the measured direction, shortened
    (:func:`.measuring.debias`); `noise` (3, 3), m2, is its covariance.  The measured attitude is
    negated if the AUV measured, in the opposite direction.
    """
    levels, unit, believed = instrument.levels, seen.unit, seen.believed
    row.caller_x_m = row.caller_y_m = row.caller_z_m = row.called_before_s = row.is_caller = nan
    white = 1.0 - levels.slow_share  # the rest is an error in common with other fixes
    own = levels.gnss_sd_m**2 + white * spread_sd(reach, levels) ** 2
    row.turn_rad2 = levels.attitude_sd_rad[2] ** 2
    east, down = tangents(unit)
    by_east, by_down = rotated(noise, east), rotated(noise, down)
    square = max(reach * reach, 1e-6)
    level, steep = dot(by_east, east) - own, dot(by_down, down) - own
    both = dot(by_east, down)
    row.level_rad2, row.steep_rad2, row.both_rad2 = level / square, steep / square, both / square
    angles = row.level_rad2 + row.steep_rad2
    shortened = scaled(unit, reach * max(1.0 - 0.5 * angles, 0.0))
    row.from_x_m, row.from_y_m, row.from_z_m = minus((fix[0], fix[1], fix[2]), shortened)
    if angles > UNSURE or reach < 0.0:  # a position behind the array has no direction
        row.range_m2 = nan
        return
    second = 0.5 * (level * level + 2.0 * both * both + steep * steep) / square
    row.level_rad2 -= row.turn_rad2 * (unit[0] ** 2 + unit[1] ** 2)
    row.range_m2 = max(dot(rotated(noise, unit), unit) - own - second, 0.0)
    row.from_m2 = own
    towards = unit
    if not levels.has_sheet:
        # An array fits a plane wave to a spherical one: it would measure a source at `unit` as far
        # off `unit` as that is off the truth, to first order in the array's size over range
        array, speed = instrument.array, levels.sound_speed_m_per_s
        within, unused = rotated_back(believed, unit), array.reshape(-1)  # as noise of 0 s
        plane = arrival_differences(array, scaled(within, reach), speed, unused, 0.0)
        made_out = direction(array, plane, speed, instrument.metric)
        within = minus(scaled(within, 2.0), made_out)
        towards = rotated(believed, divided(within, length(within)))
    row.ahead_x_m, row.ahead_y_m, row.ahead_z_m = scaled(towards, reach)


@compiled
def note_answer(row: Row, ping: Row, path: float, baseline: Vector, levels: Row) -> None:
    """Write the whole path of call and answer (m) to a reception that was noted at half of it, and
    where the caller was; `baseline` (3,), m, as of :func:`.two_way.caller_offset`.
    """
    row.ahead_x_m, row.ahead_y_m, row.ahead_z_m = (
        2 * row.ahead_x_m,
        2 * row.ahead_y_m,
        2 * row.ahead_z_m,
    )
    if not isnan(row.range_m2):
        row.range_m2 = path_sd(path, levels) ** 2
    row.caller_x_m = row.from_x_m + baseline[0]
    row.caller_y_m = row.from_y_m + baseline[1]
    row.caller_z_m = row.from_z_m + baseline[2]
    row.is_caller = 1.0 if row.asv == ping.called_by else 0.0
    row.called_before_s = ping.sent_at_s - (ping.called_at_s + ping.call_time_s)


@compiled
def unknown_sights(receptions: Rows) -> None:
    """Mark the measurement of each array, and the caller, as unknown: only the fused fix is known.
    The rows were not initialised.
    """
    for row in range(len(receptions)):
        reception = receptions[row]
        reception.range_m2 = reception.caller_x_m = reception.called_before_s = nan


@compiled
def no_sights(receptions: Rows) -> None:
    """Mark the measurement of each array as unknown, its origin included."""
    unknown_sights(receptions)
    for row in range(len(receptions)):
        receptions[row].from_x_m = nan


@compiled
def note_call(receptions: Rows, ping: Row) -> None:
    """Write to receptions how long (s) before its answer the AUV has heard the call."""
    for row in range(len(receptions)):
        receptions[row].called_before_s = ping.sent_at_s - (ping.called_at_s + ping.call_time_s)


class Heard(NamedTuple):
    """A ping and its receptions (n,), one or more of them heard; the `noise` of each, standard
    normal numbers (n or more, NOISE_WIDTH or more).
    """

    ping: Row
    receptions: Rows
    noise: Floats


@compiled
def sighting(
    heard: Heard, row: int, asvs: Motion, instrument: Instrument, errors: Systematic | None
) -> Sighting:
    """Return an ASV's measurement of a reception, of a ping or an answer, with systematic `errors`
    if any: its travel time by the AUV's clock, or for an answer by the ASVs'.
    """
    ping, reception = heard.ping, heard.receptions[row]
    x, y, z, yaw = where(asvs, reception.asv, reception.arrived_at_s)
    vessel, under_way, off = (x, y, z), reception.travel_time_s, NOTHING
    source = ping.x_m, ping.y_m, ping.z_m
    if not isnan(reception.lowered):  # echoes blend in: it seems later, and higher or lower
        under_way += reception.late_s
        ahead, aside, below = minus(source, vessel)
        reach = max(hypot(hypot(ahead, aside), below), SHORTEST_RANGE)
        sine = min(max(below / reach + reception.lowered, -1.0), 1.0)
        level = reach * sqrt(1.0 - sine * sine) / max(hypot(ahead, aside), SHORTEST_RANGE)
        source = plus(vessel, (level * ahead, level * aside, reach * sine))
    if not isnan(ping.call_time_s):
        under_way = ping.call_time_s + under_way
    elif errors is not None:
        late, later = errors.clocks[ping.auv]
        under_way = under_way + late + later * ping.sent_at_s
    if errors is not None:
        off = gnss_error(reception.asv, reception.arrived_at_s, errors)
    view = ArrayView(source, vessel, yaw, under_way, ping.z_m - z, off)
    return measure(view, reception, reception.asv, heard.noise[row], instrument, errors)


class ArrayView(NamedTuple):
    """What an array sees of a source: its apparent position and the array's (3,), m, the array's
    heading (rad), the apparent travel time (s), the true depth (m) of the source below it, and the
    slow GNSS error (3,), m, of the array's carrier.
    """

    source: Vector
    array: Vector
    yaw: float
    under_way: float
    below: float
    off: Vector


@inlined
def measure(
    view: ArrayView, reception: Row, carrier: int, noise: Floats, instrument: Instrument,
    errors: Systematic | None,
) -> Sighting:  # fmt: skip
    """Return an array's measurement of a source, by a row of noise; `carrier` is the index of its
    vehicle among those with arrays.  Write the direction to the reception.
    """
    snr_db, place = reception.snr_db, view.array
    unit, believed = sighted(view.source, place, view.yaw, snr_db, noise, instrument)
    path = instrument.levels.sound_speed_m_per_s * clocked(view.under_way, noise, instrument)
    if errors is not None:
        turn = rotation(0.0, 0.0, errors.misalignments[carrier])
        unit, believed = rotated(turn, unit), product(turn, believed)
        place = plus(place, view.off)
    note_direction(reception, unit, believed)
    return Sighting(place, unit, believed, path, snr_db, view.below)
