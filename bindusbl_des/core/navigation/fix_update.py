"""Corrections of a belief by a fix: the innovation, and the gain.

A fix of a position p is

    z = p + J(p) c + B c^2 / 2 + noise

with errors c that it has in common with other fixes; B c^2 is the curvature of a rotated offset.
It is expanded about the belief of both, with the means of its second order.  Source: Y. Bar-Shalom,
X. R. Li, T. Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, sec. 10.3
(second-order extended Kalman filter).
"""

from math import nan
from typing import NamedTuple

import numpy as np

from ...support.arrays import Floats, Ints
from ...support.compiled import compiled, inlined
from .belief import Belief

Noise = tuple[float, float, float]


class Said(NamedTuple):
    """A fix as a measurement: the true position (m) plus `noise` (covariance xx, yy, xy, m2) and
    errors in common.
    """

    x: float
    y: float
    noise: Noise


class Expected(NamedTuple):
    """A belief: a position (m), n errors (n,), their variances (n,), and its covariances with
    these, (2, n).
    """

    x: float
    y: float
    errors: Floats
    variances: Floats
    together: Floats


@compiled
def at_place(
    at: tuple[float, float], jacobians: Floats, x: float, y: float, spread: Floats, common: Floats
) -> float:
    """Write J, extrapolated from `at` to the position x, y (m), to `common` (2, n), m per unit;
    `jacobians` as of :func:`said_of`.  Return the variance (m2) that the last n states, by the
    covariance `spread` of all, add to a fix.
    """
    n, unsure = common.shape[1], 0.0
    begin = len(spread) - n
    for k in range(n):
        for i in range(2):
            by_x = (x - at[0]) * jacobians[i, n + k]
            by_y = (y - at[1]) * jacobians[i, 2 * n + k]
            common[i, k] = jacobians[i, k] + (by_x + by_y)
            unsure += common[i, k] ** 2 * spread[begin + k, begin + k]
    return unsure


@compiled
def said_of(
    fix: Said, at: tuple[float, float], jacobians: Floats, own: Expected, common: Floats
) -> Said:
    """Return a fix expanded about a belief; write its Jacobian, m per unit, by the last n states to
    `common` (2, n).

    `jacobians` (2, 4 n or more) are J `at` a position (m), its derivatives along x and along y, and
    B.
    """
    n = own.errors.size
    place, seen, (xx, yy, xy) = np.array((own.x, own.y)), np.array((fix.x, fix.y)), fix.noise
    first, second, slope = place.copy(), np.zeros(2), np.eye(2)
    left = np.array(((xx, xy), (xy, yy)))
    for k in range(n):
        error, variance = own.errors[k], own.variances[k]
        for i in range(2):
            bend, moved = jacobians[i, 3 * n + k], 0.0
            for j in range(2):
                change = jacobians[i, (1 + j) * n + k]
                moved += change * (place[j] - at[j])
                slope[i, j] += change * error
                second[i] += change * own.together[j, k]
            first[i] += (jacobians[i, k] + moved) * error + bend * error**2 / 2
            second[i] += bend * variance / 2
            for j in range(2):
                left[i, j] += bend * jacobians[j, 3 * n + k] * variance**2 / 2
    determinant = slope[0, 0] * slope[1, 1] - slope[0, 1] * slope[1, 0]
    back = np.array(((slope[1, 1], -slope[0, 1]), (-slope[1, 0], slope[0, 0]))) / determinant
    out = place.copy()
    common[:] = 0.0
    for i in range(2):
        for j in range(2):
            out[i] += back[i, j] * (seen[j] - first[j] - second[j])
            for k in range(n):  # by an error k, at what is believed: J + B c
                jacobian = jacobians[j, k] + jacobians[j, 3 * n + k] * own.errors[k]
                for m in range(2):
                    jacobian += jacobians[j, (1 + m) * n + k] * (place[m] - at[m])
                common[i, k] += back[i, j] * jacobian
    for k in range(n):
        for i in range(2):
            out[i] += common[i, k] * own.errors[k]
    return Said(out[0], out[1], _turned(left, back))


@compiled
def _turned(spread: Floats, by: Floats) -> Noise:
    """Return A P A^T as xx, yy, xy, for a covariance `spread` P (2, 2) and `by` A (2, 2)."""
    out = np.zeros((2, 2))
    for i in range(2):
        for j in range(2):
            for k in range(2):
                for m in range(2):
                    out[i, j] += by[i, k] * spread[k, m] * by[j, m]
    return out[0, 0], out[1, 1], (out[0, 1] + out[1, 0]) / 2


@compiled
def said_of_all(
    polar: Ints, places: Floats, at: Floats, noise: Floats, jacobians: Floats, believed: Floats,
    errors: Floats, variances: Floats,
) -> tuple[Floats, Floats, Floats]:  # fmt: skip
    """Return positions (n, 2), m, noise xx, yy, xy (n, 3), m2, and Jacobians (n, 2, m) of fixes
    expanded about m errors and positions `believed` (n, 2), m.  Their J is `at` positions (n, 2),
    m; if `polar` (n,), J is linear in these.
    """
    count = len(places)
    means, left = np.empty((count, 2)), np.empty((count, 3))
    common, together = np.empty((count, 2, errors.size)), np.zeros((2, errors.size))
    nothing = np.zeros((errors.size, errors.size))
    for k in range(count):
        own = Expected(believed[k, 0], believed[k, 1], errors, variances, together)
        fix = Said(places[k, 0], places[k, 1], (noise[k, 0], noise[k, 1], noise[k, 2]))
        if polar[k]:
            at_place((at[k, 0], at[k, 1]), jacobians[k], own.x, own.y, nothing, common[k])
            said = fix
        else:
            said = said_of(fix, (at[k, 0], at[k, 1]), jacobians[k], own, common[k])
        means[k, 0], means[k, 1] = said.x, said.y
        left[k, 0], left[k, 1], left[k, 2] = said.noise
    return means, left, common


# Stands for a gain worked out for each fix from the covariances (Kalman)
WEIGHED = -1.0

# Mean NIS of consistent fixes along two axes; a gate below refuses good ones
EXPECTED = 2.0

# After so many refused in a row the belief is wrong: its whole covariance is inflated so that the
# last of them would just have passed, and the next is accepted.
MOST_REFUSED = 5

# A covariance is singular when det P is below this share of the square of tr P.
SURE = 1e-12


class Rule(NamedTuple):
    """How a fix changes a belief.

    `gain` is the share of the innovation that is added to the position, or WEIGHED; a fix is
    compared with the belief of its instant (`at_ping`), or of its delivery, as in the paper.  A fix
    with a NIS above the `gate` is refused; 0: none is.
    """

    gain: float
    at_ping: bool
    gate: float


@compiled
def write_seen(seen: Floats, slopes: Floats, spread: Floats) -> None:
    """Write H P to `seen` (m, k), for slopes H (m, k) and a covariance `spread` P (k, k)."""
    seen[:] = 0.0
    for n in range(len(slopes)):
        for j in range(len(spread)):
            if slopes[n, j] != 0.0:
                for k in range(len(spread)):
                    seen[n, k] += slopes[n, j] * spread[j, k]


@compiled
def joseph(spread: Floats, gain: Floats, slopes: Floats, noise: Noise) -> None:
    """Replace P (k, k) by (1 - K H) P (1 - K H)^T + K R K^T, with a gain K^T and slopes H (1 or 2,
    k) and a noise R; valid for any gain.  Source: Y. Bar-Shalom, X. R. Li, T. Kirubarajan,
    Estimation with Applications to Tracking and Navigation, 2001, eq. 5.2.3-18.
    """
    (xx, yy, xy), count, seen = noise, len(spread), np.empty(slopes.shape)
    write_seen(seen, slopes, spread)
    if len(slopes) == 1:
        for i in range(count):
            for k in range(count):
                spread[i, k] -= gain[0, i] * seen[0, k]
        write_seen(seen, slopes, spread.T)
        for i in range(count):
            for k in range(count):
                spread[i, k] = spread[i, k] - gain[0, k] * seen[0, i] + gain[0, i] * xx * gain[0, k]
        return
    for i in range(count):
        for k in range(count):
            spread[i, k] -= gain[0, i] * seen[0, k] + gain[1, i] * seen[1, k]
    write_seen(seen, slopes, spread.T)
    for i in range(count):
        over, beside = gain[0, i] * xx + gain[1, i] * xy, gain[0, i] * xy + gain[1, i] * yy
        for k in range(count):
            less = gain[0, k] * seen[0, i] + gain[1, k] * seen[1, i]
            spread[i, k] = spread[i, k] - less + (over * gain[0, k] + beside * gain[1, k])


@compiled
def normalised_square(x: float, y: float, xx: float, yy: float, xy: float) -> float:
    """Return the square of an innovation (m) normalised by its covariance (m2): chi-squared with 2
    degrees of freedom where both are right; NaN where the covariance is singular.

    >>> normalised_square(0.6, 0.8, 0.25, 0.25, 0.0), normalised_square(1.0, 1.0, 0.0, 0.0, 0.0)
    (4.0, nan)
    """
    determinant = xx * yy - xy * xy
    if not determinant > SURE * (xx + yy) ** 2:
        return nan
    return (yy * x * x - 2.0 * xy * x * y + xx * y * y) / determinant


@inlined
def doubted(excess: float, believed: float, offset: float) -> float:
    """Return the factor by which to inflate a covariance, so that a NIS of `excess` times the gate
    would just have passed.

    Of the variance of the innovation, `offset` (m2), the belief's part is `believed`.
    """
    return 1.0 + (excess - 1.0) * offset / believed if excess > 1.0 and believed > 0.0 else 1.0


@compiled
def write_gain(gain: Floats, spread: Floats, slopes: Floats, noise: Noise, fixed: float) -> Noise:
    """Write K^T for one or two numbers with slopes H (1 or 2, k) and noise R: the Kalman gain if
    `fixed` is WEIGHED and the covariance P is not singular, else that share of the position, or 0.

    Return the innovation's covariance H P H^T + R; for one number as if it were two independent
    ones.
    """
    write_seen(gain, slopes, spread.T)
    last, xx, yy, xy = len(slopes) - 1, 0.0, 0.0, 0.0
    for j in range(len(spread)):
        xx += slopes[0, j] * gain[0, j]
        yy += slopes[last, j] * gain[last, j]
        xy += slopes[0, j] * gain[last, j]
    xx, yy, xy = xx + noise[0], yy + noise[1], xy + noise[2] if last > 0 else 0.0
    determinant = xx * yy - xy * xy
    if fixed == WEIGHED and determinant > SURE * (xx + yy) ** 2:
        for k in range(len(spread)):
            first, second = gain[0, k], gain[last, k]
            gain[0, k] = (first * yy - second * xy) / determinant
            if last > 0:
                gain[1, k] = (second * xx - first * xy) / determinant
    else:
        gain[:] = 0.0
        if fixed != WEIGHED:
            gain[0, 0] = gain[1, 1] = fixed
    return xx, yy, xy


@compiled
def take(
    belief: Belief, off: tuple[float, float], slopes: Floats, noise: Noise, rule: Rule,
    gain: Floats, whose: int = 0, shared: Floats | None = None, theirs: Noise = (0.0, 0.0, 0.0),
) -> tuple[float, bool]:  # fmt: skip
    """Correct a belief, in place, by one or two numbers with innovations `off`, slopes H (2, k),
    and `noise` R: xx, yy, xy (one number: H (1, k), a second innovation of 0, and its variance
    twice).  `gain` K^T, as large as H, is overwritten.  `whose` is the index of the AUV that
    refuses, of several; `shared` (k, k) is the part of the covariance that other AUVs may have as
    well, updated with the noise `theirs`.

    Return the NIS, NaN where the covariance is singular, and whether the gate let them pass.
    """
    moment, state, (x, y) = belief.moment[whose], belief.state, off
    total = write_gain(gain, belief.covariance, slopes, noise, rule.gain)
    nis = normalised_square(x, y, *total)
    if rule.gate > 0.0 and nis > rule.gate and moment.refused < MOST_REFUSED:
        moment.refused += 1
        if moment.refused == MOST_REFUSED:
            both = total[0] + total[1]
            factor = doubted(nis / max(rule.gate, EXPECTED), both - noise[0] - noise[1], both)
            belief.covariance[:] *= factor
            if shared is not None:
                shared[:] *= factor
        return nis, False
    moment.refused = 0
    for k in range(state.size):
        state[k] += gain[0, k] * x + (gain[1, k] * y if len(gain) > 1 else 0.0)
    joseph(belief.covariance, gain, slopes, noise)
    if shared is not None:
        joseph(shared, gain, slopes, theirs)
    return nis, True
