"""Vessels that sail, and keep station by the wind alone.

Theory of operation
-------------------
A vessel has a position, a heading and a speed through the water.  Ten times a second the helm looks
at the wind *through the water* (the wind less the current, which carries the hull), at an angle
`off` the bow, and

* chooses where to go.  To keep station it goes to and fro between two marks, `SWING` of the radius
  `within_m` to either side of the station: across the wind (`figure_of_eight`, with a loop at each
  mark) or up and down it (`beat`).  Or it waits `hove_to`, drifts with wind and current, and sails
  back to the station once it is `within_m` from it;
* lays a course: straight to the mark, less what the current sets it off.  Where that is nearer to
  the wind than the angle at which the polar makes best way to windward, it sails close-hauled on
  its tack until the mark lies on the other one;
* turns towards it, at a rate that falls with its speed.  As the bow passes the wind (a tack) or the
  stern does (a gybe), a share of the speed is lost.

The speed approaches that of the polar (:mod:`.wind`) exponentially.  Within the no-go angle the
polar has none: a vessel there makes no way, and turns out of it.  The hull makes leeway, most close
to the wind, none before it.  What it does over ground is that and the current.

All of it follows from wind and current alone, never from what happens in the mission, so the whole
motion is worked out as the mission begins, a line of a log for each step (:mod:`.motion`).

Left out: waves, heel (its effect on attitude is part of the USBL's attitude errors), the time that
sails take to be set, other vessels and land.
"""

from math import asin, atan2, cos, exp, hypot, pi, radians, sin
from typing import Annotated, NamedTuple

import numpy as np

from ...support.arrays import Floats
from ...support.compiled import compiled
from .currents import STILL, Field, beyond, flows
from .motion import (
    COLUMNS,
    COS,
    DISTANCE,
    RATES,
    SIN,
    YAW,
    Bearing,
    Motion,
    Stride,
    X,
    Y,
    turned_over,
    walked,
)
from .wind import polar_of

FIGURE_OF_EIGHT, BEAT, HOVE_TO = range(3)
KEEPING = {"figure_of_eight": FIGURE_OF_EIGHT, "beat": BEAT, "hove_to": HOVE_TO}

# Marks lie at this share of the radius from the station: what is left is for turns.
SWING = 0.5
# A vessel hove-to lies so far off the wind (rad), and drifts before it at this share of its speed:
# assumed, as of small hulls with little keel.
LYING, DRIFT = radians(60.0), 0.03
# It sails back from this share of the radius, since turning and gathering way take it further, and
# heaves to again within that.
LEAVES, BACK = 0.6, 0.2
# A hull that has no way on turns at half its rate, by sails that are backed: assumed.
LEAST_STEERING = 0.5
# Time constants after which a speed is within 5 % of another
WITHIN_5_PERCENT = 3.0


class Rig(NamedTuple):
    """A sailing vessel, as compiled code takes it.

    Its polar, `winds` (k,) and `speeds` (181, k), m/s, as of :class:`.wind.Polar`; `beating` (61,)
    as of :func:`best_to_windward`; leeway (rad), rate of turn (rad/s), most speed (m/s), shares
    that tacks and gybes leave, the time constant (s) of speed; `keeping` is one of
    :data:`KEEPING`, `within` the radius (m).
    """

    winds: Floats
    speeds: Annotated[Floats, 2]
    beating: Floats
    leeway: float
    turn: float
    most: float
    tack_keeps: float
    gybe_keeps: float
    recovers: float
    keeping: int
    within: float


def rig_of(
    *, polar: str, most_m_per_s: float, no_go_deg: float, leeway: float, turn_deg_per_s: float,
    tack_keeps: float, gybe_keeps: float, recover_s: float, keeping: str, within_m: float,
) -> Rig:  # fmt: skip
    """Return the rig that the settings of a sailboat describe; `leeway` in deg.

    Raises:
        ValueError: when the file of a polar is none.
    """
    winds, speeds = polar_of(polar, no_go_deg)
    beating = np.empty(61)
    best_to_windward(winds, speeds, most_m_per_s, beating)
    return Rig(
        winds, speeds, beating, radians(leeway), radians(turn_deg_per_s), most_m_per_s, tack_keeps,
        gybe_keeps, recover_s / WITHIN_5_PERCENT, KEEPING[keeping], within_m,
    )  # fmt: skip


def sailed(
    rig: Rig,
    stations: Floats,
    starts: Floats,
    winds: Floats,
    currents: Floats,
    step: float,
    field: Field = STILL,
) -> Motion:
    """Return the motion of vessels that keep their stations (m, 2), m, from their starts (m, 4): x,
    y (m), heading (rad), speed (m/s).

    `winds` (n, 2) and `currents` (n, 2), m/s, along x and y, both towards, hold for a step (s)
    each; the `field` adds to the current.
    """
    lines = len(winds) + 1
    logs = np.zeros((len(stations), lines, COLUMNS))
    for log, station, start in zip(logs, stations, starts, strict=True):
        _sail(*rig, station, start, winds, currents, field, step, log)
    table = logs.reshape(-1, COLUMNS)
    first = np.arange(len(stations) + 1, dtype=np.int64) * lines
    return Motion(table, first, np.full(len(stations), step))


@compiled
def _turned(angle: float) -> float:
    """Return an angle (rad) within -pi to pi."""
    return (angle + pi) % (2.0 * pi) - pi


@compiled
def polar_speed(winds: Floats, speeds: Floats, most: float, wind: float, off: float) -> float:
    """Return the speed (m/s), at most `most`, by a polar, `off` (rad) off a wind (m/s)."""
    where = min(abs(off) * 180.0 / pi, 180.0)
    row = min(int(where), 179)
    column = 0
    while column < winds.size - 2 and winds[column + 1] <= wind:
        column += 1
    share = min((wind - winds[column]) / (winds[column + 1] - winds[column]), 1.0)
    part = where - row
    near = speeds[row, column] + share * (speeds[row, column + 1] - speeds[row, column])
    far = speeds[row + 1, column] + share * (speeds[row + 1, column + 1] - speeds[row + 1, column])
    found: float = near + part * (far - near)
    if part > 0.0 and min(near, far) == 0.0:  # between the no-go zone and the next degree
        found = 0.0
    return min(found, most)


@compiled
def best_to_windward(winds: Floats, speeds: Floats, most: float, beating: Floats) -> None:
    """Write the angle off the wind (rad), of whole degrees, at which a polar and a hull of at most
    so many m/s make best way to windward in winds of 0, 1, 2, ... m/s, to `beating` (n,).
    """
    for wind in range(beating.size):
        best = -1.0
        for degrees in range(91):
            off = degrees * pi / 180.0
            made = polar_speed(winds, speeds, most, max(1.0 * wind, 1.0), off) * cos(off)
            if made > best:
                best, beating[wind] = made, off


@compiled
def _sail(
    winds: Floats, speeds: Floats, beating: Floats, leeway: float, turn: float, most: float,
    tack_keeps: float, gybe_keeps: float, recovers: float, keeping: int, within: float,
    station: Floats, start: Floats, air: Floats, currents: Floats, field: Field, step: float,
    log: Floats,
) -> None:  # fmt: skip
    """Write the log (n + 1, COLUMNS) of one vessel; arguments as of :class:`Rig` and
    :func:`sailed`.
    """
    x, y, yaw, speed = start[0], start[1], start[2], start[3]
    side, leg, lies = 0.0, 1.0, False
    gained = 1.0 - exp(-step / recovers)
    u = v = rate = 0.0
    for k in range(len(air) + 1):
        now = min(k, len(air) - 1)
        current_x, current_y = currents[now, 0], currents[now, 1]
        if flows(field):
            more_x, more_y = beyond(field, k * step, x, y, 0.0)
            current_x, current_y = current_x + more_x, current_y + more_y
        wind_x, wind_y = air[now, 0] - current_x, air[now, 1] - current_y
        wind, upwind = hypot(wind_x, wind_y), atan2(-wind_y, -wind_x)
        off = _turned(yaw - upwind)
        if side == 0.0:
            side = 1.0 if off >= 0.0 else -1.0
        # where to go
        from_x, from_y = x - station[0], y - station[1]
        to_x, to_y = -from_x, -from_y
        if keeping == HOVE_TO:
            far = hypot(from_x, from_y)
            lies = far < LEAVES * within if lies else far < BACK * within
        else:
            axis = upwind if keeping == BEAT else upwind + 0.5 * pi
            ahead = from_x * cos(axis) + from_y * sin(axis)
            if leg * ahead >= SWING * within:
                leg = -leg
            to_x += leg * SWING * 1.2 * within * cos(axis)
            to_y += leg * SWING * 1.2 * within * sin(axis)
        # the course
        tight = beating[min(round(wind), beating.size - 1)]
        if lies:
            wanted, aim = upwind + side * LYING, 0.0
        else:
            bearing = atan2(to_y, to_x)
            across = -current_x * sin(bearing) + current_y * cos(bearing)
            makes = polar_speed(winds, speeds, most, wind, _turned(bearing - upwind))
            makes = max(makes, 0.2 * most)
            wanted = bearing - asin(min(max(across / makes, -0.9), 0.9))
            meets = _turned(wanted - upwind)
            if abs(meets) < tight:
                if side * meets < -0.9 * tight:  # the mark lies on the other tack
                    side = -side
                wanted = upwind + side * tight
            else:
                side = 1.0 if meets >= 0.0 else -1.0
            aim = polar_speed(winds, speeds, most, wind, off)
        # the log: what it does from here on
        slips = leeway * 0.5 * (1.0 + cos(off)) * (1.0 if off >= 0.0 else -1.0)
        drift = DRIFT if lies else 0.0
        u_was, v_was = u, v
        u = speed * cos(yaw + slips) + drift * wind_x + current_x
        v = speed * sin(yaw + slips) + drift * wind_y + current_y
        turns = _turned(wanted - yaw)
        steers = turn * min(max(speed / most, LEAST_STEERING), 1.0)
        rate_was, rate = rate, min(max(turns / step, -steers), steers)
        line = log[k]
        line[X], line[Y], line[YAW] = x, y, yaw
        line[RATES + X], line[RATES + Y], line[RATES + YAW] = u, v, rate
        if k:
            was = log[k - 1]
            old = Bearing(cos(was[YAW]), sin(was[YAW]), rate_was)
            cosine, sine = turned_over(old, Bearing(cos(yaw), sin(yaw), rate), step)
            line[COS], line[SIN] = was[COS] + cosine, was[SIN] + sine
            began = Stride(was[X], was[Y], u_was, v_was, hypot(u_was, v_was))
            line[DISTANCE] = was[DISTANCE] + walked(began, Stride(x, y, u, v, hypot(u, v)), step)
        # the step
        x, y = x + step * u, y + step * v
        speed += gained * (aim - speed)
        yaw += step * rate
        after = _turned(yaw - upwind)
        if after * off < 0.0:
            speed *= tack_keeps if abs(off) < 0.5 * pi else gybe_keeps
