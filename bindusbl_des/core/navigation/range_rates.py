"""Corrections by range rates: an AUV's velocity along the line of sight to each ASV that heard it.

Dead reckoning measures a velocity w, that of the last displacement, rotated to the compass heading
of now.  Its error has the causes of the position error e (:mod:`.belief`):

    v = w - R b + c - (k + l J) (w - R b) - walk

so that a range rate measures velocity bias, current, scale and rotation along the line of sight,
and a little of the direction of that line.  The walk over that displacement is noise of w, the same
for all ASVs that have heard a ping, and is in e as well: it is a state while the range rates are
applied one after the other.

Assumptions: with a fix come the range rates and velocities of all ASVs that have heard its ping;
the AUV knows its vertical velocity; a body that rotates goes on ahead at the same speed.
"""

from math import hypot, inf, isnan, sqrt
from typing import NamedTuple

import numpy as np

from ...support.arrays import Floats, Ints
from ...support.compiled import compiled, inlined
from ..records.events import HEARD
from ..records.rows import Row, Rows
from ..vehicles.motion import velocity, where
from ..vehicles.reckoning import DeadReckoned
from .belief import Belief, Growth
from .dead_reckoning import Reckoned, reckoned

# The velocity is the mean over at most LONGEST_S, or since the fix before, at least SHORTEST_S (s).
# Over longer times the walk matters less, and a hull's acceleration more.
LONGEST_S, SHORTEST_S = 0.5, 0.05

# The heading of now is the mean over this time (s).
NOW_S = 1e-3

# An ASV at a smaller distance (m) has no direction.
NEAREST_M = 1.0


class Rates(NamedTuple):
    """The errors of range rates: a variance (m2/s2), and the relative error (standard deviation) of
    the assumed sound speed.
    """

    variance: float
    share: float


class ReckonedMotion(NamedTuple):
    """The velocity by dead reckoning (m/s) along x and y, the cosine and sine of the compass
    heading, and the time (s) over which it was measured; 0: there is none.
    """

    x: float
    y: float
    cosine: float
    sine: float
    lasts: float


@inlined
def _dr_motion(auv: int, dr: DeadReckoned, since: float, reckoning: Reckoned) -> ReckonedMotion:
    """Return the velocity by dead reckoning; the fix before holds at `since` (s)."""
    begin = max(dr.time - LONGEST_S, since, 0.0)
    lasts = dr.time - begin
    if lasts < SHORTEST_S:
        return ReckonedMotion(0.0, 0.0, 1.0, 0.0, 0.0)
    was, last = reckoned(auv, begin, reckoning), reckoned(auv, dr.time - NOW_S, reckoning)
    c, s = dr.cosine - was.cosine, dr.sine - was.sine
    straight = c * c + s * s
    if straight < 0.25 * lasts * lasts:  # it turns on the spot
        return ReckonedMotion(0.0, 0.0, 1.0, 0.0, 0.0)
    x, y = dr.x - was.x, dr.y - was.y
    ahead, aside = (x * c + y * s) / straight, (y * c - x * s) / straight
    c, s = dr.cosine - last.cosine, dr.sine - last.sine
    length = hypot(c, s)
    c, s = c / length, s / length
    return ReckonedMotion(c * ahead - s * aside, s * ahead + c * aside, c, s, lasts)


class EstimatedMotion(NamedTuple):
    """An AUV's velocity: by dead reckoning less biases (wx, wy), and estimated (x, y), m/s; the
    cosine and sine by which biases rotate; and the time (s) over which it was measured.
    """

    wx: float
    wy: float
    x: float
    y: float
    cosine: float
    sine: float
    lasts: float


@inlined
def _motion_of(
    auv: int, since: float, belief: Belief, dr: DeadReckoned, growth: Growth, reckoning: Reckoned
) -> EstimatedMotion:
    """Return an AUV's estimated velocity; the fix before holds at `since` (s)."""
    state, told = belief.state, _dr_motion(auv, dr, since, reckoning)
    ahead, aside = state[2], state[3]
    if growth.wandering > 0:
        ahead, aside = ahead + state[growth.wandering], aside + state[growth.wandering + 1]
    c, s = (told.cosine, told.sine) if growth.in_body else (1.0, 0.0)
    wx, wy = told.x - (c * ahead - s * aside), told.y - (s * ahead + c * aside)
    x, y = wx + state[4], wy + state[5]
    if growth.stretched > 0:
        k, turn = state[growth.stretched], state[growth.stretched + 1]
        x, y = x - (k * wx - turn * wy), y - (k * wy + turn * wx)
    return EstimatedMotion(wx, wy, x, y, c, s, told.lasts)


@compiled
def _look_at(
    line: Row, fix: Row, own: EstimatedMotion, belief: Belief, dr: DeadReckoned, growth: Growth,
    reckoning: Reckoned, rates: Rates, row: Floats,
) -> tuple[float, float]:  # fmt: skip
    """Write to `row` (k + 2,) the Jacobian of a range rate by the states and, last, by the walk (m)
    of the velocity; return its innovation (m/s) and the variance of its noise (m2/s2), infinite if
    it cannot be used.
    """
    row[:] = 0.0
    if line.outcome != HEARD or isnan(line.range_rate_m_per_s) or isnan(line.from_x_m):
        return 0.0, inf
    state, motion = belief.state, reckoning.motion
    x, y = dr.x - state[0] - line.from_x_m, dr.y - state[1] - line.from_y_m
    z = where(motion, fix.auv, dr.time)[2] - line.from_z_m
    away = sqrt(x * x + y * y + z * z)
    if away < NEAREST_M:
        return 0.0, inf
    x, y, z = x / away, y / away, z / away
    vx, vy = own.x - line.own_x_m_per_s, own.y - line.own_y_m_per_s
    vz = velocity(motion, fix.auv, dr.time)[2] - line.own_z_m_per_s
    rate = x * vx + y * vy + z * vz
    row[0], row[1] = -(vx - rate * x) / away, -(vy - rate * y) / away
    row[2], row[3] = -(x * own.cosine + y * own.sine), -(y * own.cosine - x * own.sine)
    row[4], row[5] = x, y
    if growth.wandering > 0:
        row[growth.wandering], row[growth.wandering + 1] = row[2], row[3]
    if growth.stretched > 0:
        row[growth.stretched] = -(x * own.wx + y * own.wy)
        row[growth.stretched + 1] = -(y * own.wx - x * own.wy)
    row[-2], row[-1] = -x / own.lasts, -y / own.lasts
    return line.range_rate_m_per_s - rate, rates.variance + (rates.share * rate) ** 2


@compiled
def take_rates(
    fix: Row, receptions: Rows, since: float, belief: Belief, dr: DeadReckoned, growth: Growth,
    reckoning: Reckoned, rates: Rates,
) -> None:  # fmt: skip
    """Correct a belief of the instant of a fix, in place, by the fix's range rates.

    `receptions` are the fix's; the fix before it holds at `since` (s).
    """
    own = _motion_of(fix.auv, since, belief, dr, growth, reckoning)
    if own.lasts == 0.0:
        return
    state, spread, count = belief.state, belief.covariance, belief.state.size
    moved, both = np.zeros(count + 2), np.zeros((count + 2, count + 2))
    row, gain = np.empty(count + 2), np.empty(count + 2)
    both[:count, :count] = spread
    walk = growth.walk * own.lasts  # which the error has in common
    for axis in range(2):
        k = count + axis
        both[k, k] = both[axis, k] = both[k, axis] = walk
    for line in receptions:
        off, total = _look_at(line, fix, own, belief, dr, growth, reckoning, rates, row)
        if total == inf:
            continue
        for i in range(count + 2):
            gain[i] = 0.0
            off -= row[i] * moved[i]
            for j in range(count + 2):
                gain[i] += both[i, j] * row[j]
        for i in range(count + 2):
            total += row[i] * gain[i]
        if not total > 0.0:
            continue
        for i in range(count + 2):
            moved[i] += gain[i] * off / total
            for j in range(count + 2):
                both[i, j] -= gain[i] * gain[j] / total
    for i in range(count):
        state[i] += moved[i]
        for j in range(count):
            spread[i, j] = both[i, j]


@compiled
def rate_sights(
    fix: Row, receptions: Rows, lines: Ints, since: float, belief: Belief, dr: DeadReckoned,
    growth: Growth, reckoning: Reckoned, rates: Rates, rows: Floats, values: Floats,
    variances: Floats,
) -> None:  # fmt: skip
    """Write the range rates of some receptions, `lines` (n,), as sights about a belief of the
    instant of a fix (:class:`.smoothing.Sights`): `rows` (n, k), `values` (n,) and `variances`
    (n,), of independent noise.

    The walk that each has in common with the error of its instant is left out.
    """
    own, count = (
        _motion_of(fix.auv, since, belief, dr, growth, reckoning),
        belief.state.size,
    )
    row, common = np.empty(count + 2), np.zeros((lines.size, lines.size))
    by_walk = np.zeros((lines.size, 2))
    for i in range(lines.size):
        rows[i], values[i], variances[i] = 0.0, 0.0, 1.0
        if own.lasts == 0.0:
            continue
        line = receptions[lines[i]]
        off, noise = _look_at(line, fix, own, belief, dr, growth, reckoning, rates, row)
        if noise == inf:
            continue
        rows[i], by_walk[i], variances[i] = row[:count], row[count:], noise
        values[i] = off
        for k in range(count):
            values[i] += row[k] * belief.state[k]
    for i in range(lines.size):  # L D L^T of the covariance of all noise
        own_noise = variances[i]
        for j in range(i + 1):
            shared = by_walk[i, 0] * by_walk[j, 0] + by_walk[i, 1] * by_walk[j, 1]
            shared *= growth.walk * own.lasts
            for k in range(j):
                shared -= common[i, k] * variances[k] * common[j, k]
            if j < i:
                common[i, j] = shared / variances[j]
                rows[i] -= common[i, j] * rows[j]
                values[i] -= common[i, j] * values[j]
            else:
                variances[i] = own_noise + shared
