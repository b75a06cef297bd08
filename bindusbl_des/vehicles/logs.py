"""Where a vehicle with dynamics has been: its log, and any instant between two lines of it.

A line is written at each boundary of the integration, k * step (s). Between two lines position and
yaw are cubic polynomials through both ends with the rates there (Hermite), which for these vehicles
is within a micrometre of the motion itself.
"""

from math import cos, hypot, sin

import numpy as np
from numpy.typing import NDArray

from ..core.compiled import compiled, inlined

Floats = NDArray[np.float64]
Place = tuple[float, float, float, float]
Velocity = tuple[float, float, float]

# A line: place (m) and yaw (rad), their rates (m/s, rad/s), integrals of cos(yaw) and sin(yaw) (s),
# horizontal distance travelled (m)
X, Y, Z, YAW, RATES, COS, SIN, DISTANCE, COLUMNS = 0, 1, 2, 3, 4, 8, 9, 10, 11


@inlined
def headings(
    log: Floats, line: int, duration: float, yaw: float, turn: float
) -> tuple[float, float]:
    """Return the integrals of cos(yaw) and sin(yaw) (s) `duration` past a line.

    `yaw` (rad) and its rate `turn` (rad/s) are those of that later instant.  Trapezoid with its end
    correction (Euler-Maclaurin).
    """
    before, turned = log[line, YAW], log[line, RATES + YAW]
    c_before, s_before, c_now, s_now = cos(before), sin(before), cos(yaw), sin(yaw)
    half, twelfth = duration / 2.0, duration * duration / 12.0
    ahead = half * (c_before + c_now) + twelfth * (s_now * turn - s_before * turned)
    aside = half * (s_before + s_now) + twelfth * (c_before * turned - c_now * turn)
    return log[line, COS] + ahead, log[line, SIN] + aside


@inlined
def distance(
    log: Floats, line: int, duration: float, x: float, y: float, u: float, v: float
) -> float:
    """Return the distance (m) travelled until `duration` past a line.

    What follows are place (m) and velocity (m/s) at that later instant.  Simpson's rule, the speed
    half way taken from the cubic of the position.
    """
    so_far: float = log[line, DISTANCE]
    if duration <= 0.0:
        return so_far
    u_was, v_was = log[line, RATES + X], log[line, RATES + Y]
    share = 1.5 / duration
    u_half = share * (x - log[line, X]) - 0.25 * (u_was + u)
    v_half = share * (y - log[line, Y]) - 0.25 * (v_was + v)
    walked: float = hypot(u_was, v_was) + 4.0 * hypot(u_half, v_half) + hypot(u, v)
    return so_far + duration / 6.0 * walked


@inlined
def read(log: Floats, line: int, share: float, step: float, axis: int) -> tuple[float, float]:
    """Return a coordinate (x, y, z or yaw) and its rate after a share of the step after a line."""
    rest = 1.0 - share
    begin, end = log[line, axis], log[line + 1, axis]
    leaves, arrives = step * log[line, RATES + axis], step * log[line + 1, RATES + axis]
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
def before(first: int, end: int, step: float, time: float) -> tuple[int, float, float]:
    """Return the line before an instant (s) in a log of the lines `first` up to `end`, and how long
    before, as a share of the step and in s; beyond the end of the log it is where it ended.
    """
    time = min(time, (end - first - 1) * step)
    whole = min(max(int(time / step), 0), end - first - 2)
    return first + whole, time / step - whole, time - whole * step


@inlined
def place_at(log: Floats, first: int, end: int, step: float, time: float) -> Place:
    """Return x, y, z (m) and yaw (rad) at an instant (s)."""
    line, share, _ = before(first, end, step, time)
    x, _ = read(log, line, share, step, X)
    y, _ = read(log, line, share, step, Y)
    z, _ = read(log, line, share, step, Z)
    yaw, _ = read(log, line, share, step, YAW)
    return x, y, z, yaw


@inlined
def headings_at(log: Floats, first: int, end: int, step: float, time: float) -> tuple[float, float]:
    """Return the integrals of cos(yaw) and sin(yaw) from 0 to an instant (s)."""
    line, share, past = before(first, end, step, time)
    yaw, turn = read(log, line, share, step, YAW)
    return headings(log, line, past, yaw, turn)


@inlined
def distance_at(log: Floats, first: int, end: int, step: float, time: float) -> float:
    """Return the distance (m) travelled until an instant (s)."""
    line, share, past = before(first, end, step, time)
    x, u = read(log, line, share, step, X)
    y, v = read(log, line, share, step, Y)
    return distance(log, line, past, x, y, u, v)


@compiled
def velocity_at(log: Floats, first: int, end: int, step: float, time: float) -> Velocity:
    """Return the velocity (m/s) along x, y and z at an instant (s)."""
    line, share, _ = before(first, end, step, time)
    _, u = read(log, line, share, step, X)
    _, v = read(log, line, share, step, Y)
    _, w = read(log, line, share, step, Z)
    return u, v, w
