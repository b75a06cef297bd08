"""The motion of a whole fleet, in one array in which compiled equations look up any instant.

A vehicle without dynamics keeps to legs of constant speed, turn rate and climb.  One with dynamics
leaves a log, a line at each boundary of its integration, k * step (s).  Between two lines, position
and yaw are cubic polynomials through both ends with the rates there (Hermite), which for these
vehicles is within a micrometre of the motion itself.  Readers treat legs and logs alike. Survey
frame: m, z down, yaw in rad from +x towards +y.
"""

from collections.abc import Sequence
from math import cos, hypot, nan, sin
from typing import Annotated, NamedTuple

import numpy as np

from ...support.arrays import Floats, Ints
from ...support.compiled import compiled, inlined

# A leg: its first position (m) and heading (rad), horizontal speed (m/s), turn rate (rad/s), climb
# (m/s, downwards), instant at which it begins (s); then, as in a log, the integrals of cos(yaw) and
# sin(yaw) (s) and the distance (m) up to there; cosine and sine of its heading.
X, Y, Z, YAW, SPEED, TURN, CLIMB, BEGIN, COS, SIN, DISTANCE = range(11)
COS_YAW, SIN_YAW, LEG_COLUMNS = 11, 12, 13

# A line of a log has x, y, z, yaw, their rates (m/s, rad/s), the integrals and the distance.
RATES, COLUMNS = 4, 11

# Where a vehicle is: x, y, z (m), yaw (rad); integrals of cos(yaw) and sin(yaw) (s); distance (m)
Place = tuple[float, float, float, float]
Headed = tuple[float, float, float, float, float, float]
PLACE, HEADINGS = slice(0, 4), slice(4, 6)


class Motion(NamedTuple):
    """The motion of a fleet: vehicle v has the lines first[v] to first[v + 1] of the table.

    steps[v] is the time (s) between the lines of a log; it is 0 for legs, which know their own.
    """

    table: Annotated[Floats, 2]
    first: Ints
    steps: Floats


def together(tables: Sequence[Floats]) -> Motion:
    """Return the motion of a fleet from the legs of its vehicles."""
    first = np.concatenate(([0], np.cumsum([len(table) for table in tables])))
    whole = np.concatenate([np.zeros((0, LEG_COLUMNS)), *tables])
    return Motion(whole, first.astype(np.int64), np.zeros(len(tables)))


def legs(rows: Floats) -> Floats:
    """Return the legs (n, LEG_COLUMNS) of a vehicle from their first eight columns (n, 8)."""
    table = np.zeros((len(rows), LEG_COLUMNS))
    table[:, :COS] = rows
    table[:, COS_YAW], table[:, SIN_YAW] = np.cos(rows[:, YAW]), np.sin(rows[:, YAW])
    _sum_up(table)
    return table


@compiled
def _sum_up(table: Floats) -> None:
    """Write the integrals and distances of a vehicle's legs, which are 0 as the mission starts."""
    for leg in range(1, len(table)):
        (_, _, _, _, cosine, sine), distance = _on_leg(table, leg - 1, table[leg, BEGIN])
        table[leg, COS], table[leg, SIN], table[leg, DISTANCE] = cosine, sine, distance
    first = _leg_at(table, 0, len(table), 0.0)
    (_, _, _, _, cosine, sine), distance = _on_leg(table, first, 0.0)
    for leg in range(len(table)):
        table[leg, COS] -= cosine
        table[leg, SIN] -= sine
        table[leg, DISTANCE] -= distance


@inlined
def _on_leg(table: Floats, leg: int, time: float) -> tuple[Headed, float]:
    past = time - table[leg, BEGIN]
    turn, speed = table[leg, TURN], table[leg, SPEED]
    yaw, cosine, sine = table[leg, YAW], table[leg, COS_YAW], table[leg, SIN_YAW]
    half = turn * past / 2.0
    if half == 0.0:
        ahead, aside = cosine * past, sine * past
    else:  # by the chord: a small turn rate would leave nothing of differences of sines
        along, off, chord = cos(half), sin(half), past * (sin(half) / half)
        yaw += turn * past
        ahead, aside = chord * (cosine * along - sine * off), chord * (sine * along + cosine * off)
    there = (
        table[leg, X] + speed * ahead,
        table[leg, Y] + speed * aside,
        table[leg, Z] + table[leg, CLIMB] * past,
        yaw,
        table[leg, COS] + ahead,
        table[leg, SIN] + aside,
    )
    return there, table[leg, DISTANCE] + speed * past


@compiled
def _leg_at(table: Floats, first: int, end: int, time: float) -> int:
    """Return the last of the legs `first` to `end` that has begun by an instant (s), or `first`."""
    low, high = first, end - 1
    while low < high:
        middle = (low + high + 1) // 2
        if table[middle, BEGIN] <= time:
            low = middle
        else:
            high = middle - 1
    return low


class Bearing(NamedTuple):
    """Cosine and sine of a yaw, and how fast it turns (rad/s)."""

    cosine: float
    sine: float
    turning: float


class Stride(NamedTuple):
    """A position (m), its rates along x and y, and the speed (m/s)."""

    x: float
    y: float
    u: float
    v: float
    speed: float


@inlined
def turned_over(was: Bearing, now: Bearing, duration: float) -> tuple[float, float]:
    """Return the integrals of cos(yaw) and sin(yaw) (s) over a duration (s) between two bearings.

    Trapezoidal rule with end correction (Euler-Maclaurin).
    """
    half, twelfth = duration / 2.0, duration * duration / 12.0
    ends, begins = now.sine * now.turning, was.sine * was.turning
    ahead = half * (was.cosine + now.cosine) + twelfth * (ends - begins)
    begins, ends = was.cosine * was.turning, now.cosine * now.turning
    aside = half * (was.sine + now.sine) + twelfth * (begins - ends)
    return ahead, aside


@inlined
def walked(was: Stride, now: Stride, duration: float) -> float:
    """Return the distance (m) travelled in a duration (s) between two positions.

    Simpson's rule; the speed half way is that of the cubic of the position.
    """
    share = 1.5 / duration
    u_half = share * (now.x - was.x) - 0.25 * (was.u + now.u)
    v_half = share * (now.y - was.y) - 0.25 * (was.v + now.v)
    return duration / 6.0 * (was.speed + 4.0 * hypot(u_half, v_half) + now.speed)


@inlined
def headings(
    log: Floats, line: int, duration: float, yaw: float, turn: float
) -> tuple[float, float]:
    """Return the integrals of cos(yaw) and sin(yaw) (s) at `duration` (s) past a line.

    `yaw` (rad) and its rate `turn` (rad/s) are those at that later instant.
    """
    began = log[line, YAW]
    was = Bearing(cos(began), sin(began), log[line, RATES + YAW])
    ahead, aside = turned_over(was, Bearing(cos(yaw), sin(yaw), turn), duration)
    return log[line, COS] + ahead, log[line, SIN] + aside


@inlined
def distance(
    log: Floats, line: int, duration: float, x: float, y: float, u: float, v: float
) -> float:
    """Return the distance (m) travelled until `duration` (s) past a line.

    `x`, `y` (m) and `u`, `v` (m/s) are position and velocity at that later instant.
    """
    so_far: float = log[line, DISTANCE]
    if duration <= 0.0:
        return so_far
    u_was, v_was = log[line, RATES + X], log[line, RATES + Y]
    was = Stride(log[line, X], log[line, Y], u_was, v_was, hypot(u_was, v_was))
    return so_far + walked(was, Stride(x, y, u, v, hypot(u, v)), duration)


@inlined
def between(
    begin: float, end: float, leaving: float, arriving: float, share: float, step: float
) -> tuple[float, float]:
    """Return a coordinate and its rate after a share of a step (s), by the cubic through both ends.

    `begin`, `end` are its values, `leaving`, `arriving` its rates, at the ends of the step.
    """
    rest = 1.0 - share
    leaves, arrives = step * leaving, step * arriving
    moved = end - begin
    place = begin + share * (
        leaves * rest * rest + share * (moved * (1.0 + 2.0 * rest) - arrives * rest)
    )
    rate = (
        leaves * rest * (1.0 - 3.0 * share)
        + arrives * share * (3.0 * share - 2.0)
        + 6.0 * moved * share * rest
    ) / step
    return place, rate


@inlined
def read(log: Floats, line: int, share: float, step: float, axis: int) -> tuple[float, float]:
    """Return a coordinate (x, y, z or yaw) and its rate after a share of the step after a line."""
    begin, end = log[line, axis], log[line + 1, axis]
    return between(begin, end, log[line, RATES + axis], log[line + 1, RATES + axis], share, step)


@inlined
def before(first: int, end: int, step: float, time: float) -> tuple[int, float, float]:
    """Return the line before an instant (s) in a log, and the time since: as a share of the step,
    in s.

    The log has the lines `first` up to `end`; an instant beyond its end counts as its end.
    """
    time = min(time, (end - first - 1) * step)
    whole = min(max(int(time / step), 0), end - first - 2)
    return first + whole, time / step - whole, time - whole * step


@inlined
def in_log(log: Floats, first: int, end: int, step: float, time: float) -> Headed:
    """Return x, y, z (m), yaw (rad), and its integrals (s) at an instant (s) of a log."""
    line, share, past = before(first, end, step, time)
    x, _ = read(log, line, share, step, X)
    y, _ = read(log, line, share, step, Y)
    z, _ = read(log, line, share, step, Z)
    yaw, turn = read(log, line, share, step, YAW)
    ahead, aside = headings(log, line, past, yaw, turn)
    return x, y, z, yaw, ahead, aside


@inlined
def headed(motion: Motion, vehicle: int, time: float) -> Headed:
    """Return x, y, z (m), yaw (rad), and integrals of cos(yaw) and sin(yaw) (s) at an instant
    (s).
    """
    begin, end, step = motion.first[vehicle], motion.first[vehicle + 1], motion.steps[vehicle]
    if step > 0.0:
        return in_log(motion.table, begin, end, step, time)
    there, _ = _on_leg(motion.table, _leg_at(motion.table, begin, end, time), time)
    return there


@compiled
def where(motion: Motion, vehicle: int, time: float) -> Place:
    """Return x, y, z (m) and yaw (rad) of a vehicle at an instant (s)."""
    x, y, z, yaw, _, _ = headed(motion, vehicle, time)
    return x, y, z, yaw


@compiled
def velocity(motion: Motion, vehicle: int, time: float) -> tuple[float, float, float]:
    """Return the velocity (m/s) of a vehicle along x, y and z at an instant (s)."""
    begin, end, table = motion.first[vehicle], motion.first[vehicle + 1], motion.table
    step = motion.steps[vehicle]
    if step > 0.0:
        line, share, _ = before(begin, end, step, time)
        _, u = read(table, line, share, step, X)
        _, v = read(table, line, share, step, Y)
        _, w = read(table, line, share, step, Z)
        return u, v, w
    leg = _leg_at(table, begin, end, time)
    (_, _, _, yaw, _, _), _ = _on_leg(table, leg, time)
    speed: float = table[leg, SPEED]
    return speed * cos(yaw), speed * sin(yaw), table[leg, CLIMB]


# Entry points for Python.  numba takes arrays ten times faster than a tuple of them, and writes to
# an array that it is given faster than it returns a new one.


@compiled
def place_at(table: Floats, first: Ints, steps: Floats, vehicle: int, time: float) -> Place:
    """Return x, y, z (m) and yaw (rad) of a vehicle at an instant (s)."""
    return where(Motion(table, first, steps), vehicle, time)


@compiled
def distance_at(table: Floats, first: Ints, steps: Floats, vehicle: int, time: float) -> float:
    """Return the distance (m) that a vehicle has travelled by an instant (s)."""
    begin, end, step = first[vehicle], first[vehicle + 1], steps[vehicle]
    if step > 0.0:
        line, share, past = before(begin, end, step, time)
        x, u = read(table, line, share, step, X)
        y, v = read(table, line, share, step, Y)
        return distance(table, line, past, x, y, u, v)
    _, travelled = _on_leg(table, _leg_at(table, begin, end, time), time)
    return travelled


def places(motion: Motion, time: float) -> Floats:
    """Return x, y, z (m) and yaw (rad) of the whole fleet at an instant (s), shape (n, 4)."""
    out = np.empty((len(motion.first) - 1, 4))
    _places(*motion, time, out)
    return out


@compiled
def _places(table: Floats, first: Ints, steps: Floats, time: float, out: Floats) -> None:
    for vehicle in range(first.size - 1):
        x, y, z, yaw = where(Motion(table, first, steps), vehicle, time)
        out[vehicle, 0], out[vehicle, 1], out[vehicle, 2], out[vehicle, 3] = x, y, z, yaw


def lines(table: Floats, first: Ints, steps: Floats, vehicle: int, times: Floats) -> Floats:
    """Return the motion (n, 8) of a vehicle at n instants (s).

    Columns: x, y, z (m), yaw (rad), integrals of cos(yaw) and sin(yaw) (s), cos(yaw), sin(yaw).
    """
    out = np.empty((times.size, 8))
    _lines(table, first, steps, vehicle, times, out)
    return out


@compiled
def _lines(
    table: Floats, first: Ints, steps: Floats, vehicle: int, times: Floats, out: Floats
) -> None:
    known = cosine = sine = nan
    begin, end, step = first[vehicle], first[vehicle + 1], steps[vehicle]
    for k in range(times.size):
        if step > 0.0:
            x, y, z, yaw, ahead, aside = in_log(table, begin, end, step, times[k])
        else:  # not by `headed`: a tuple made for each instant would double the time
            leg = _leg_at(table, begin, end, times[k])
            (x, y, z, yaw, ahead, aside), _ = _on_leg(table, leg, times[k])
        if yaw != known:  # constant along a lane
            known, cosine, sine = yaw, cos(yaw), sin(yaw)
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = x, y, z, yaw
        out[k, 4], out[k, 5], out[k, 6], out[k, 7] = ahead, aside, cosine, sine
