"""Where a vehicle with dynamics has been: its log, and any instant between two lines of it.

A line is written at each boundary of the integration, k * step (s). Between two lines position and
yaw are cubic polynomials through both ends with the rates there (Hermite), which for these vehicles
is within a micrometre of the motion itself.
"""

from math import cos, hypot, sin

import numpy as np
from numpy.typing import NDArray

from .compiled import compiled

Floats = NDArray[np.float64]

# A line: place (m) and yaw (rad), their rates (m/s, rad/s), integrals of cos(yaw) and sin(yaw) (s),
# horizontal distance travelled (m)
X, Y, Z, YAW, RATES, COS, SIN, DISTANCE, COLUMNS = 0, 1, 2, 3, 4, 8, 9, 10, 11


@compiled
def sums(log: Floats, line: int, duration: float, spot: Floats) -> tuple[float, float, float]:
    """Return the integrals of cos(yaw), sin(yaw) (s) and the distance (m), `duration` past a line.

    `spot` (8 or more,) begins like a line, and holds place and rates at that later instant.
    Trapezoid with its end correction for the headings (Euler-Maclaurin), Simpson's rule for the
    distance, the speed half way taken from the cubic of the position.
    """
    before, now = log[line, YAW], spot[YAW]
    was, turns = log[line, RATES + YAW], spot[RATES + YAW]
    c_before, s_before, c_now, s_now = cos(before), sin(before), cos(now), sin(now)
    half, twelfth = duration / 2.0, duration * duration / 12.0
    ahead = half * (c_before + c_now) + twelfth * (s_now * turns - s_before * was)
    aside = half * (s_before + s_now) + twelfth * (c_before * was - c_now * turns)
    u, v = log[line, RATES + X], log[line, RATES + Y]
    u_now, v_now = spot[RATES + X], spot[RATES + Y]
    walked = 0.0
    if duration > 0.0:
        share = 1.5 / duration
        u_half = share * (spot[X] - log[line, X]) - 0.25 * (u + u_now)
        v_half = share * (spot[Y] - log[line, Y]) - 0.25 * (v + v_now)
        walked = hypot(u, v) + 4.0 * hypot(u_half, v_half) + hypot(u_now, v_now)
    return (
        log[line, COS] + ahead,
        log[line, SIN] + aside,
        log[line, DISTANCE] + duration / 6.0 * walked,
    )


@compiled
def read(log: Floats, step: float, time: float, spot: Floats) -> int:
    """Write place and rates, `spot` (8 or more,), at an instant (s); return the line before it."""
    line: int = min(max(int(time / step), 0), log.shape[0] - 2)
    share = time / step - line
    rest = 1.0 - share
    for i in range(4):
        begin, end = log[line, i], log[line + 1, i]
        leaves, arrives = step * log[line, RATES + i], step * log[line + 1, RATES + i]
        moved = end - begin
        spot[i] = begin + share * (
            leaves * rest * rest + share * (moved * (1.0 + 2.0 * rest) - arrives * rest)
        )
        spot[RATES + i] = (
            leaves * rest * (1.0 - 3.0 * share)
            + arrives * share * (3.0 * share - 2.0)
            + 6.0 * moved * share * rest
        ) / step
    return line


@compiled
def line_at(
    log: Floats, step: float, time: float
) -> tuple[float, float, float, float, float, float, float]:
    """Return place, yaw, integrals of cos(yaw) and sin(yaw), and distance at an instant (s).

    Beyond the end of the log it is where it ended.
    """
    time = min(time, (log.shape[0] - 1) * step)
    spot = np.empty(COS)
    before = read(log, step, time, spot)
    ahead, aside, distance = sums(log, before, time - before * step, spot)
    return spot[X], spot[Y], spot[Z], spot[YAW], ahead, aside, distance
