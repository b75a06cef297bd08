"""The motion of a whole fleet, in one array in which compiled equations look up any instant.

A vehicle without dynamics keeps to legs of constant speed, turn rate and climb; one with dynamics
leaves a log at equal steps (:mod:`.logs`).  Both have a line for each leg or step, and
a reader need not know which it is.  Survey frame: m, z down, yaw in rad from +x towards +y.
"""

from collections.abc import Sequence
from math import cos, nan, sin
from typing import Annotated, NamedTuple

import numpy as np

from ..core.arrays import Floats, Ints
from ..core.compiled import compiled, inlined
from . import logs

# A leg: its first place (m) and heading (rad), horizontal speed (m/s), turn rate (rad/s), climb
# (m/s, downwards), instant at which it begins (s); then, as in a log, what has summed up to there:
# the integrals of cos(yaw) and sin(yaw) (s) and the distance (m).
X, Y, Z, YAW, SPEED, TURN, CLIMB, BEGIN = range(8)
COS, SIN, DISTANCE, COLUMNS = logs.COS, logs.SIN, logs.DISTANCE, logs.COLUMNS
COS_YAW, SIN_YAW, LEG_COLUMNS = COLUMNS, COLUMNS + 1, COLUMNS + 2  # of its first heading

# Where a vehicle is: x, y, z (m), yaw (rad); integrals of cos(yaw) and sin(yaw) (s); distance (m)
Place = logs.Place
Line = tuple[float, float, float, float, float, float, float]
PLACE, HEADINGS = slice(0, 4), slice(4, 6)


class Motion(NamedTuple):
    """The motion of a fleet: vehicle v has the lines first[v] to first[v + 1] of the table.

    `step` is the time (s) between the lines of logs; it is 0 for legs, which know their own.
    """

    table: Annotated[Floats, 2]
    first: Ints
    step: float


def together(tables: Sequence[Floats]) -> Motion:
    """Return the motion of a fleet from the legs of its vehicles."""
    first = np.concatenate(([0], np.cumsum([len(table) for table in tables])))
    return Motion(np.concatenate(tables), first.astype(np.int64), 0.0)


def legs(rows: Floats) -> Floats:
    """Return the legs of a vehicle, given by their first eight columns, with their sums."""
    table = np.zeros((len(rows), LEG_COLUMNS))
    table[:, :COS] = rows
    table[:, COS_YAW], table[:, SIN_YAW] = np.cos(rows[:, YAW]), np.sin(rows[:, YAW])
    _sum_up(table)
    return table


@compiled
def _sum_up(table: Floats) -> None:
    """Write the sums of a vehicle's legs, counted from the start of the mission."""
    for leg in range(1, len(table)):
        _, _, _, _, cosine, sine, distance = _on_leg(table, leg - 1, table[leg, BEGIN])
        table[leg, COS], table[leg, SIN], table[leg, DISTANCE] = cosine, sine, distance
    _, _, _, _, cosine, sine, distance = _on_leg(table, _leg_at(table, 0, len(table), 0.0), 0.0)
    for leg in range(len(table)):
        table[leg, COS] -= cosine
        table[leg, SIN] -= sine
        table[leg, DISTANCE] -= distance


@inlined
def _on_leg(table: Floats, leg: int, time: float) -> Line:
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
    return (
        table[leg, X] + speed * ahead,
        table[leg, Y] + speed * aside,
        table[leg, Z] + table[leg, CLIMB] * past,
        yaw,
        table[leg, COS] + ahead,
        table[leg, SIN] + aside,
        table[leg, DISTANCE] + speed * past,
    )


@compiled
def _leg_at(table: Floats, first: int, end: int, time: float) -> int:
    """Return the last of the legs first..end that has begun by an instant (s), or the first."""
    low, high = first, end - 1
    while low < high:
        middle = (low + high + 1) // 2
        if table[middle, BEGIN] <= time:
            low = middle
        else:
            high = middle - 1
    return low


@compiled
def where(motion: Motion, vehicle: int, time: float) -> Place:
    """Return x, y, z (m) and yaw (rad) of a vehicle at an instant (s)."""
    begin, end = motion.first[vehicle], motion.first[vehicle + 1]
    if motion.step > 0.0:
        x, y, z, yaw = logs.place_at(motion.table, begin, end, motion.step, time)
    else:
        leg = _leg_at(motion.table, begin, end, time)
        x, y, z, yaw, _, _, _ = _on_leg(motion.table, leg, time)
    return x, y, z, yaw


@compiled
def velocity(motion: Motion, vehicle: int, time: float) -> tuple[float, float, float]:
    """Return the velocity (m/s) of a vehicle along x, y and z at an instant (s)."""
    begin, end = motion.first[vehicle], motion.first[vehicle + 1]
    if motion.step > 0.0:
        return logs.velocity_at(motion.table, begin, end, motion.step, time)
    leg = _leg_at(motion.table, begin, end, time)
    _, _, _, yaw, _, _, _ = _on_leg(motion.table, leg, time)
    speed: float = motion.table[leg, SPEED]
    return speed * cos(yaw), speed * sin(yaw), motion.table[leg, CLIMB]


@inlined
def headed(
    motion: Motion, vehicle: int, time: float
) -> tuple[float, float, float, float, float, float]:
    """Return where a vehicle is at an instant (s), and the integrals of cos(yaw) and sin(yaw)."""
    begin, end = motion.first[vehicle], motion.first[vehicle + 1]
    if motion.step > 0.0:
        x, y, z, yaw = logs.place_at(motion.table, begin, end, motion.step, time)
        ahead, aside = logs.headings_at(motion.table, begin, end, motion.step, time)
    else:
        leg = _leg_at(motion.table, begin, end, time)
        x, y, z, yaw, ahead, aside, _ = _on_leg(motion.table, leg, time)
    return x, y, z, yaw, ahead, aside


@compiled
def place_at(table: Floats, first: Ints, step: float, vehicle: int, time: float) -> Place:
    """Return x, y, z (m) and yaw (rad) of a vehicle at an instant (s): :func:`where` for Python."""
    return where(Motion(table, first, step), vehicle, time)


@compiled
def distance_at(table: Floats, first: Ints, step: float, vehicle: int, time: float) -> float:
    """Return how far (m) a vehicle has travelled by an instant (s)."""
    begin, end = first[vehicle], first[vehicle + 1]
    if step > 0.0:
        return logs.distance_at(table, begin, end, step, time)
    _, _, _, _, _, _, distance = _on_leg(table, _leg_at(table, begin, end, time), time)
    return distance


def places(motion: Motion, time: float) -> Floats:
    """Return x, y, z (m) and yaw (rad) of the whole fleet at an instant (s), shape (n, 4)."""
    out = np.empty((len(motion.first) - 1, 4))
    _places(*motion, time, out)
    return out


@compiled
def _places(table: Floats, first: Ints, step: float, time: float, out: Floats) -> None:
    # an array made here and returned would cost ten times as much
    for vehicle in range(first.size - 1):
        x, y, z, yaw = where(Motion(table, first, step), vehicle, time)
        out[vehicle, 0], out[vehicle, 1], out[vehicle, 2], out[vehicle, 3] = x, y, z, yaw


def lines(table: Floats, first: Ints, step: float, vehicle: int, times: Floats) -> Floats:
    """Return x, y, z (m), yaw (rad), the integrals of cos(yaw) and sin(yaw) (s), and these two,
    (n, 8), of a vehicle at n instants (s).
    """
    begin, end, out = first[vehicle], first[vehicle + 1], np.empty((times.size, 8))
    if step > 0.0:
        logs.look_up(table, begin, end, step, times, out)
    else:
        _lines_of_legs(table, begin, end, times, out)
    return out


@compiled
def _lines_of_legs(table: Floats, begin: int, end: int, times: Floats, out: Floats) -> None:
    known = cosine = sine = nan
    for k in range(times.size):
        leg = _leg_at(table, begin, end, times[k])
        x, y, z, yaw, ahead, aside, _ = _on_leg(table, leg, times[k])
        if yaw != known:  # lanes keep theirs
            known, cosine, sine = yaw, cos(yaw), sin(yaw)
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = x, y, z, yaw
        out[k, 4], out[k, 5], out[k, 6], out[k, 7] = ahead, aside, cosine, sine
