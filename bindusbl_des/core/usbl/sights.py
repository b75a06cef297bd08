"""What one array measures of a ping, apart from what others make of it: written for navigators.

A fix's covariance lies across the direction that was measured, and both err together.  Who knows
better where the AUV is turns it to the direction that he believes in, for which he must know the
measurement itself: from where, in which direction, how far, and how large the errors of each are.
"""

from math import atan2, degrees, hypot, isnan, nan

from ...support.arrays import Floats
from ...support.compiled import compiled
from ..records.events import HEARD
from ..records.rows import Row, Rows
from .array import (
    Vector,
    arrival_differences,
    direction,
    divided,
    dot,
    length,
    minus,
    scaled,
    tangents,
    turned,
    turned_back,
)
from .measuring import Instrument, Sighting, path_sd, spread_sd

# A direction so unsure (rad2, both axes together) is none: the second order does not describe it.
UNSURE = 0.5


@compiled
def note_direction(row: Row, unit: Vector, believed: Floats) -> None:
    """Write to a reception the direction that was measured of it, as an instrument tells it.

    `unit` is the unit vector (3,) to who pinged in the survey frame, `believed` the rotation (3, 3)
    from array to survey frame that its AHRS tells.
    """
    row.azimuth_deg, row.elevation_deg = _angles(unit)
    row.body_azimuth_deg, row.body_elevation_deg = _angles(turned_back(believed, unit))


@compiled
def _angles(unit: Vector) -> tuple[float, float]:
    """Return azimuth, in [0, 360), and elevation (deg) of a unit vector (3,)."""
    azimuth = degrees(atan2(unit[1], unit[0])) % 360.0
    azimuth %= 360.0  # of -1e-20 deg the first remainder is 360
    return azimuth, degrees(atan2(unit[2], hypot(unit[0], unit[1])))


@compiled
def copy_direction(fix: Row, receptions: Rows) -> None:
    """Write to a fix the direction measured by the one ASV that it is made of; NaN where several
    are, or nobody knows it.
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
    """Write to a reception what was measured of it.

    `fix` (3,), m, was placed in the direction of the AUV by the range `reach` (m), and shortened
    (:func:`.measuring.debias`); `noise` (3, 3), m2, is its covariance.  The attitude believed in
    is negative if it was the AUV that measured, in the other direction.
    """
    levels, unit, believed = instrument.levels, seen.unit, seen.believed
    row.caller_x_m = row.caller_y_m = row.caller_z_m = row.called_before_s = row.is_caller = nan
    white = 1.0 - levels.slow_share  # the rest is an error in common with other fixes
    own = levels.gnss_sd_m**2 + white * spread_sd(reach, levels) ** 2
    row.turn_rad2 = levels.attitude_sd_rad[2] ** 2
    east, down = tangents(unit)
    by_east, by_down = turned(noise, east), turned(noise, down)
    square = max(reach * reach, 1e-6)
    level, steep = dot(by_east, east) - own, dot(by_down, down) - own
    both = dot(by_east, down)
    row.level_rad2, row.steep_rad2, row.both_rad2 = level / square, steep / square, both / square
    angles = row.level_rad2 + row.steep_rad2
    shortened = scaled(unit, reach * max(1.0 - 0.5 * angles, 0.0))
    row.from_x_m, row.from_y_m, row.from_z_m = minus((fix[0], fix[1], fix[2]), shortened)
    if angles > UNSURE or reach < 0.0:  # a place behind the array lies in no direction
        row.range_m2 = nan
        return
    second = 0.5 * (level * level + 2.0 * both * both + steep * steep) / square
    row.level_rad2 -= row.turn_rad2 * (unit[0] ** 2 + unit[1] ** 2)
    row.range_m2 = max(dot(turned(noise, unit), unit) - own - second, 0.0)
    row.from_m2 = own
    towards = unit
    if not levels.has_sheet:
        # An array fits a plane wave to a spherical one: what it would make of a source there is as
        # far from `unit` as that is from the truth, to first order in the array's size over range
        array, speed = instrument.array, levels.sound_speed_m_per_s
        within, unused = turned_back(believed, unit), array.reshape(-1)  # as noise of 0 s
        plane = arrival_differences(array, scaled(within, reach), speed, unused, 0.0)
        made_out = direction(array, plane, speed, instrument.metric)
        within = minus(scaled(within, 2.0), made_out)
        towards = turned(believed, divided(within, length(within)))
    row.ahead_x_m, row.ahead_y_m, row.ahead_z_m = scaled(towards, reach)


@compiled
def note_answer(row: Row, ping: Row, path: float, baseline: Vector, levels: Row) -> None:
    """Write to a reception, noted as half as far away as call and answer went together (m), what
    the `path` was; `baseline` (3,), m, as of :func:`.two_way.way_to_caller`.
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
    """Note that what was measured is not known apart from what others measured, nor who called,
    nor when: rows begin with what lay in memory.
    """
    for row in range(len(receptions)):
        reception = receptions[row]
        reception.range_m2 = reception.caller_x_m = reception.called_before_s = nan


@compiled
def no_sights(receptions: Rows) -> None:
    """Note that of what was measured nothing is known, not even from where."""
    unknown_sights(receptions)
    for row in range(len(receptions)):
        receptions[row].from_x_m = nan


@compiled
def note_call(receptions: Rows, ping: Row) -> None:
    """Write to receptions how long (s) before its answer an AUV has heard a call."""
    for row in range(len(receptions)):
        receptions[row].called_before_s = ping.sent_at_s - (ping.called_at_s + ping.call_time_s)
