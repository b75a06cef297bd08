"""The motion of a whole fleet, in one array in which compiled equations look up any instant.

A vehicle without dynamics keeps to legs of constant speed, turn rate and climb; one with dynamics
leaves a log at equal steps (:mod:`.logs`).  Both have a line for each leg or step, and
a reader need not know which it is.  Survey frame: m, z down, yaw in rad from +x towards +y.
"""

from collections.abc import Sequence
from math import cos, sin, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import logs
from .acoustics import MOST_STEPS, SETTLED
from .compiled import compiled

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# A leg: its first place (m) and heading (rad), horizontal speed (m/s), turn rate (rad/s), climb
# (m/s, downwards), instant at which it begins (s); then, as in a log, what has summed up to there:
# the integrals of cos(yaw) and sin(yaw) (s) and the distance (m).
X, Y, Z, YAW, SPEED, TURN, CLIMB, BEGIN = range(8)
COS, SIN, DISTANCE, COLUMNS = logs.COS, logs.SIN, logs.DISTANCE, logs.COLUMNS
SUMS = slice(COS, COLUMNS)
COS_YAW, SIN_YAW, LEG_COLUMNS = COLUMNS, COLUMNS + 1, COLUMNS + 2  # of its first heading

# Where a vehicle is: x, y, z (m), yaw (rad); integrals of cos(yaw) and sin(yaw) (s); distance (m)
Line = tuple[float, float, float, float, float, float, float]
PLACE, HEADINGS, WAY = slice(0, 4), slice(4, 6), 6

# Within this share of its last digit an instant is the same (light-time loop).
LAST_DIGIT = 2.3e-16


class Motion(NamedTuple):
    """The motion of a fleet: vehicle v has the lines first[v] to first[v + 1] of the table.

    `step` is the time (s) between the lines of logs; it is 0 for legs, which know their own.
    Compiled equations take the three by themselves (`where(*motion, vehicle, time)`), which numba
    unpacks and reads several times faster than a tuple of arrays.
    """

    table: Floats
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
    for leg in range(1, len(table)):
        table[leg, SUMS] = _on_leg(table, leg - 1, table[leg, BEGIN])[4:]
    # sums count from the start of the mission
    table[:, SUMS] -= np.array(_on_leg(table, _leg_at(table, 0, len(table), 0.0), 0.0)[4:])
    return table


@compiled
def _on_leg(table: Floats, leg: int, time: float) -> Line:
    past = time - table[leg, BEGIN]
    turn, speed = table[leg, TURN], table[leg, SPEED]
    yaw, cosine, sine = table[leg, YAW], table[leg, COS_YAW], table[leg, SIN_YAW]
    if turn == 0.0:
        ahead, aside = cosine * past, sine * past
    else:
        yaw += turn * past
        ahead, aside = (sin(yaw) - sine) / turn, (cosine - cos(yaw)) / turn
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
def line_at(table: Floats, first: Ints, step: float, vehicle: int, time: float) -> Line:
    """Return where a vehicle is at an instant (s), and what has summed up by then."""
    begin, end = first[vehicle], first[vehicle + 1]
    if step > 0.0:
        return logs.line_at(table[begin:end], step, time)
    return _on_leg(table, _leg_at(table, begin, end, time), time)


@compiled
def where(
    table: Floats, first: Ints, step: float, vehicle: int, time: float
) -> tuple[float, float, float, float]:
    """Return x, y, z (m) and yaw (rad) of a vehicle at an instant (s)."""
    x, y, z, yaw, _, _, _ = line_at(table, first, step, vehicle, time)
    return x, y, z, yaw


def places(motion: Motion, time: float) -> Floats:
    """Return x, y, z (m) and yaw (rad) of the whole fleet at an instant (s), shape (n, 4)."""
    out = np.empty((len(motion.first) - 1, 4))
    _places(*motion, time, out)
    return out


@compiled
def _places(table: Floats, first: Ints, step: float, time: float, out: Floats) -> None:
    # an array made here and returned would cost ten times as much
    for vehicle in range(first.size - 1):
        x, y, z, yaw = where(table, first, step, vehicle, time)
        out[vehicle, 0], out[vehicle, 1], out[vehicle, 2], out[vehicle, 3] = x, y, z, yaw


@compiled
def lines(table: Floats, first: Ints, step: float, vehicle: int, times: Floats) -> Floats:
    """Return the line of a vehicle at each of n instants (s), shape (n, 7)."""
    out = np.empty((times.size, 7))
    for k in range(times.size):
        x, y, z, yaw, ahead, aside, distance = line_at(table, first, step, vehicle, times[k])
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = x, y, z, yaw
        out[k, 4], out[k, 5], out[k, 6] = ahead, aside, distance
    return out


@compiled
def light_time(
    x: float, y: float, z: float, table: Floats, first: Ints, step: float, vehicle: int,
    sent_at: float, sound_speed: float,
) -> float:  # fmt: skip
    """Return how long (s) a sound sent from a place (m) at `sent_at` travels until it meets a
    vehicle: :func:`.acoustics.travel_time` for a motion that is known.

    Raises ValueError when the vehicle outruns the sound.
    """
    settled = SETTLED + LAST_DIGIT * sent_at
    delay = 0.0
    for _ in range(MOST_STEPS):
        there = where(table, first, step, vehicle, sent_at + delay)
        ahead, aside, below = there[0] - x, there[1] - y, there[2] - z
        reached = sqrt(ahead * ahead + aside * aside + below * below) / sound_speed
        if abs(reached - delay) < settled:
            return reached
        delay = reached
    raise ValueError("a vehicle outruns the sound; check its track, its speed and the sound speed")
