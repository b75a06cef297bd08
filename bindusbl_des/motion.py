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
COS_YAW, SIN_YAW, LEG_COLUMNS = COLUMNS, COLUMNS + 1, COLUMNS + 2  # of its first heading

# Within this share of its last digit an instant is the same (light-time loop).
LAST_DIGIT = 2.3e-16


class Motion(NamedTuple):
    """The motion of a fleet: vehicle v has the lines first[v] to first[v + 1] of the table.

    `step` is the time (s) between the lines of logs; it is 0 for legs, which know their own.
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
    line = np.empty(COLUMNS)
    for leg in range(1, len(table)):
        _on_leg(table, leg - 1, table[leg, BEGIN], line)
        table[leg, COS:COLUMNS] = line[COS:]
    _on_leg(table, _leg_at(table, 0, len(table), 0.0), 0.0, line)
    table[:, COS:COLUMNS] -= line[COS:]  # sums count from the start of the mission
    return table


@compiled
def _on_leg(table: Floats, leg: int, time: float, line: Floats) -> None:
    """Write the line (COLUMNS,) of an instant (s) of a leg."""
    past = time - table[leg, BEGIN]
    turn, speed = table[leg, TURN], table[leg, SPEED]
    yaw, cosine, sine = table[leg, YAW], table[leg, COS_YAW], table[leg, SIN_YAW]
    if turn == 0.0:
        ahead, aside = cosine * past, sine * past
    else:
        yaw += turn * past
        ahead, aside = (sin(yaw) - sine) / turn, (cosine - cos(yaw)) / turn
    line[X] = table[leg, X] + speed * ahead
    line[Y] = table[leg, Y] + speed * aside
    line[Z] = table[leg, Z] + table[leg, CLIMB] * past
    line[YAW] = yaw
    line[COS] = table[leg, COS] + ahead
    line[SIN] = table[leg, SIN] + aside
    line[DISTANCE] = table[leg, DISTANCE] + speed * past


@compiled
def _leg_at(table: Floats, first: int, end: int, time: float) -> int:
    """Return the last of the legs first..end that has begun by an instant (s)."""
    low, high = first, end - 1
    while low < high:
        middle = (low + high + 1) // 2
        if table[middle, BEGIN] <= time:
            low = middle
        else:
            high = middle - 1
    return low


@compiled
def line_at(motion: Motion, vehicle: int, time: float, line: Floats) -> None:
    """Write the whole line (COLUMNS,), interpolated, of a vehicle at an instant (s)."""
    table, first, end = motion.table, motion.first[vehicle], motion.first[vehicle + 1]
    if motion.step > 0.0:
        logs.line_at(table[first:end], motion.step, time, line)
    else:
        _on_leg(table, _leg_at(table, first, end, time), time, line)


@compiled
def where(motion: Motion, vehicle: int, time: float) -> tuple[float, float, float, float]:
    """Return x, y, z (m) and yaw (rad) of a vehicle at an instant (s)."""
    line = np.empty(COLUMNS)
    line_at(motion, vehicle, time, line)
    return line[X], line[Y], line[Z], line[YAW]


@compiled
def places(motion: Motion, time: float) -> Floats:
    """Return x, y, z (m) and yaw (rad) of the whole fleet at an instant (s), shape (n, 4)."""
    count = motion.first.size - 1
    out = np.empty((count, 4))
    for vehicle in range(count):
        out[vehicle, 0], out[vehicle, 1], out[vehicle, 2], out[vehicle, 3] = where(
            motion, vehicle, time
        )
    return out


@compiled
def lines(motion: Motion, vehicle: int, times: Floats) -> Floats:
    """Return the whole lines, interpolated, of a vehicle at instants (s), shape (n, COLUMNS)."""
    out = np.empty((times.size, COLUMNS))
    for k in range(times.size):
        line_at(motion, vehicle, times[k], out[k])
    return out


@compiled
def light_time(
    x: float, y: float, z: float, motion: Motion, vehicle: int, sent_at: float, sound_speed: float
) -> float:
    """Return how long (s) a sound sent from a place (m) at `sent_at` travels until it meets a
    vehicle: :func:`.acoustics.travel_time` for a motion that is known.

    Raises ValueError when the vehicle outruns the sound.
    """
    settled = SETTLED + LAST_DIGIT * sent_at
    delay = 0.0
    for _ in range(MOST_STEPS):
        there = where(motion, vehicle, sent_at + delay)
        ahead, aside, below = there[0] - x, there[1] - y, there[2] - z
        reached = sqrt(ahead * ahead + aside * aside + below * below) / sound_speed
        if abs(reached - delay) < settled:
            return reached
        delay = reached
    raise ValueError("a vehicle outruns the sound; check its track, its speed and the sound speed")
