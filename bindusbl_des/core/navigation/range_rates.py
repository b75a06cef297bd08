"""What range rates say to an AUV: how fast it goes along the way to each ASV that heard it.

Dead reckoning tells a velocity w, that of the way just gone, turned to where the compass points
now.  It errs by what moves its error e (:mod:`.belief`):

    v = w - R b + c - (k + l J) (w - R b) - walk

so that a range rate tells of velocity bias, current, stretch and turn along the line of sight, and
a little of where that line is.  The walk of that way is noise of w, the same for all that have
heard a ping, and it is in e as well: it is a state while these are taken in, one after the other.

It takes for granted that with a fix come the range rates of all ASVs that have heard its ping, and
how fast each of these went; that the AUV knows how fast it sinks; and that a body that turns goes
ahead as it did.
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

# The velocity is that of so long (s), or since the fix before, but not of less.  Of longer ways the
# walk is less, and what a hull gains or loses of its speed is more.
LONGEST_S, SHORTEST_S = 0.5, 0.05

# The heading now is that of this long (s).
NOW_S = 1e-3

# What is nearer (m) lies in no direction.
NEAREST_M = 1.0


class Rates(NamedTuple):
    """How range rates err: by a variance (m2/s2), and by a share of themselves (standard deviation)
    by which the sound speed assumed may be wrong.
    """

    variance: float
    share: float


class Reckoning(NamedTuple):
    """The velocity that dead reckoning tells (m/s) along x and y, the cosine and sine of the
    heading by compass, and over how long a way (s) that is; 0: nothing is known.
    """

    x: float
    y: float
    cosine: float
    sine: float
    lasts: float


@inlined
def _velocity_told(auv: int, dr: DeadReckoned, since: float, reckoning: Reckoned) -> Reckoning:
    """Return what dead reckoning tells of a velocity; `since` (s) the fix before held."""
    begin = max(dr.time - LONGEST_S, since, 0.0)
    lasts = dr.time - begin
    if lasts < SHORTEST_S:
        return Reckoning(0.0, 0.0, 1.0, 0.0, 0.0)
    was, last = reckoned(auv, begin, reckoning), reckoned(auv, dr.time - NOW_S, reckoning)
    c, s = dr.cosine - was.cosine, dr.sine - was.sine
    straight = c * c + s * s
    if straight < 0.25 * lasts * lasts:  # it turns on the spot
        return Reckoning(0.0, 0.0, 1.0, 0.0, 0.0)
    x, y = dr.x - was.x, dr.y - was.y
    ahead, aside = (x * c + y * s) / straight, (y * c - x * s) / straight
    c, s = dr.cosine - last.cosine, dr.sine - last.sine
    length = hypot(c, s)
    c, s = c / length, s / length
    return Reckoning(c * ahead - s * aside, s * ahead + c * aside, c, s, lasts)


class Walked(NamedTuple):
    """What dead reckoning tells of a velocity: that of its way less biases, and what is believed of
    the velocity itself (m/s); the cosine and sine by which biases turn; and over how long (s).
    """

    wx: float
    wy: float
    x: float
    y: float
    cosine: float
    sine: float
    lasts: float


@inlined
def _believed(
    auv: int, since: float, belief: Belief, dr: DeadReckoned, growth: Growth, reckoning: Reckoned
) -> Walked:
    """Return what an AUV believes of its velocity; `since` (s) the fix before held."""
    state, told = belief.state, _velocity_told(auv, dr, since, reckoning)
    ahead, aside = state[2], state[3]
    if growth.wandering > 0:
        ahead, aside = ahead + state[growth.wandering], aside + state[growth.wandering + 1]
    c, s = (told.cosine, told.sine) if growth.in_body else (1.0, 0.0)
    wx, wy = told.x - (c * ahead - s * aside), told.y - (s * ahead + c * aside)
    x, y = wx + state[4], wy + state[5]
    if growth.stretched > 0:
        k, turn = state[growth.stretched], state[growth.stretched + 1]
        x, y = x - (k * wx - turn * wy), y - (k * wy + turn * wx)
    return Walked(wx, wy, x, y, c, s, told.lasts)


@compiled
def _look_at(
    line: Row, fix: Row, own: Walked, belief: Belief, dr: DeadReckoned, growth: Growth,
    reckoning: Reckoned, rates: Rates, row: Floats,
) -> tuple[float, float]:  # fmt: skip
    """Write by which `row` (k + 2,) a range rate goes with the states, and with the walk (m) of the
    velocity told, which is what stands last; return how far (m/s) it is off what is believed of it,
    and the variance of its noise (m2/s2), infinite where it says nothing.
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
    """Correct a belief of the instant of a fix, in its place, by the range rates that come with it.

    `receptions` are those that the fix may be made of; `since` (s) the fix before it held.
    """
    own = _believed(fix.auv, since, belief, dr, growth, reckoning)
    if own.lasts == 0.0:
        return
    state, spread, count = belief.state, belief.covariance, belief.state.size
    moved, both = np.zeros(count + 2), np.zeros((count + 2, count + 2))
    row, gain = np.empty(count + 2), np.empty(count + 2)
    both[:count, :count] = spread
    walk = growth.walk * own.lasts  # of which the error has had its part
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
    """Write what range rates of some receptions, `lines` (n,), say to who believes in something
    of the instant of a fix, as sights (:class:`.smoothing.Sights`): `rows` (n, k), `values` (n,)
    and `variances` (n,), of noise that none has in common with another.

    That each has the walk in common with the error of its instant is left out.
    """
    own, count = _believed(fix.auv, since, belief, dr, growth, reckoning), belief.state.size
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
