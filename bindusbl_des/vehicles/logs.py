"""Where a vehicle with dynamics has been: its log, and any instant between two lines of it.

A line is written at each boundary of the integration, k * step (s). Between two lines position and
yaw are cubic polynomials through both ends with the rates there (Hermite), which for these vehicles
is within a micrometre of the motion itself.
"""

from math import cos, hypot, sin
from typing import NamedTuple

from ..core.arrays import Floats
from ..core.compiled import compiled, inlined

Place = tuple[float, float, float, float]

# A line: place (m) and yaw (rad), their rates (m/s, rad/s), integrals of cos(yaw) and sin(yaw) (s),
# horizontal distance travelled (m)
X, Y, Z, YAW, RATES, COS, SIN, DISTANCE, COLUMNS = 0, 1, 2, 3, 4, 8, 9, 10, 11


class Bearing(NamedTuple):
    """Cosine and sine of a yaw, and how fast it turns (rad/s)."""

    cosine: float
    sine: float
    turning: float


class Stride(NamedTuple):
    """A place (m), its rates and its speed (m/s)."""

    x: float
    y: float
    u: float
    v: float
    speed: float


@inlined
def turned_over(was: Bearing, now: Bearing, duration: float) -> tuple[float, float]:
    """Return the integrals of cos(yaw) and sin(yaw) (s) over some time (s) between two bearings.

    Trapezoid with its end correction (Euler-Maclaurin).
    """
    half, twelfth = duration / 2.0, duration * duration / 12.0
    ends, begins = now.sine * now.turning, was.sine * was.turning
    ahead = half * (was.cosine + now.cosine) + twelfth * (ends - begins)
    begins, ends = was.cosine * was.turning, now.cosine * now.turning
    aside = half * (was.sine + now.sine) + twelfth * (begins - ends)
    return ahead, aside


@inlined
def walked(was: Stride, now: Stride, duration: float) -> float:
    """Return the distance (m) travelled in some time (s) between two places.

    Simpson's rule, the speed half way taken from the cubic of the position.
    """
    share = 1.5 / duration
    u_half = share * (now.x - was.x) - 0.25 * (was.u + now.u)
    v_half = share * (now.y - was.y) - 0.25 * (was.v + now.v)
    return duration / 6.0 * (was.speed + 4.0 * hypot(u_half, v_half) + now.speed)


@inlined
def headings(
    log: Floats, line: int, duration: float, yaw: float, turn: float
) -> tuple[float, float]:
    """Return the integrals of cos(yaw) and sin(yaw) (s) `duration` past a line.

    `yaw` (rad) and its rate `turn` (rad/s) are those of that later instant.
    """
    began = log[line, YAW]
    was = Bearing(cos(began), sin(began), log[line, RATES + YAW])
    ahead, aside = turned_over(was, Bearing(cos(yaw), sin(yaw), turn), duration)
    return log[line, COS] + ahead, log[line, SIN] + aside


@inlined
def distance(
    log: Floats, line: int, duration: float, x: float, y: float, u: float, v: float
) -> float:
    """Return the distance (m) travelled until `duration` past a line.

    What follows are place (m) and velocity (m/s) at that later instant.
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
    """Return a coordinate and its rate after a share of a step (s), given both at either end."""
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
def velocity_at(
    log: Floats, first: int, end: int, step: float, time: float
) -> tuple[float, float, float]:
    """Return the velocity (m/s) along x, y and z at an instant (s)."""
    line, share, _ = before(first, end, step, time)
    _, u = read(log, line, share, step, X)
    _, v = read(log, line, share, step, Y)
    _, w = read(log, line, share, step, Z)
    return u, v, w


@inlined
def headings_at(log: Floats, first: int, end: int, step: float, time: float) -> tuple[float, float]:
    """Return the integrals of cos(yaw) and sin(yaw) from 0 to an instant (s)."""
    line, share, past = before(first, end, step, time)
    yaw, turn = read(log, line, share, step, YAW)
    return headings(log, line, past, yaw, turn)


@compiled
def look_up(log: Floats, first: int, end: int, step: float, times: Floats, out: Floats) -> None:
    """Write what :func:`.motion.lines` returns, (n, 8)."""
    for k in range(times.size):
        line, share, past = before(first, end, step, times[k])
        x, _ = read(log, line, share, step, X)
        y, _ = read(log, line, share, step, Y)
        z, _ = read(log, line, share, step, Z)
        yaw, turn = read(log, line, share, step, YAW)
        ahead, aside = headings(log, line, past, yaw, turn)
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = x, y, z, yaw
        out[k, 4], out[k, 5], out[k, 6], out[k, 7] = ahead, aside, cos(yaw), sin(yaw)


@inlined
def distance_at(log: Floats, first: int, end: int, step: float, time: float) -> float:
    """Return the distance (m) travelled until an instant (s)."""
    line, share, past = before(first, end, step, time)
    x, u = read(log, line, share, step, X)
    y, v = read(log, line, share, step, Y)
    return distance(log, line, past, x, y, u, v)
