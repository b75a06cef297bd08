"""An extended Kalman filter over a recorded log of ranges and fixes.

A range to a beacon measures position along the line to it, the line from the vehicle's estimate.
Ranges at sea have a heavy tail (reflections, wrong detections), so noise is a mixture: a share of
the sights has a further error, of a larger standard deviation.  A sight is weighted by the
probability of either kind, as in the expectation step of the EM algorithm for a scale mixture; a
sight that not even the wider kind explains is refused.  Source: K. L. Lange, R. J. A. Little, J. M.
G. Taylor, Robust statistical modeling using the t distribution, Journal of the American Statistical
Association 84, 1989.
"""

from dataclasses import dataclass, replace
from math import exp, hypot, inf, log, log1p, pi, sqrt
from typing import NamedTuple

import numpy as np

from ...support.arrays import Floats
from ...support.compiled import compiled, inlined
from ..records.rows import Row, Rows
from ..vehicles.reckoning import DeadReckoned
from .assumptions import NO_STATES, Further, beginning
from .belief import Belief, Growth, begun_at, carry
from .dead_reckoning import Odometry, dr_at
from .fix_update import EXPECTED, MOST_REFUSED, doubted
from .smoothing import Sights, Smoothed, absorb, smooth

# A sight: the index of its instant; the beacon's position x, y (m) and the measured range (m), or a
# fix's position and NaN; the difference in depth of beacon and vehicle (m); the variances (m2) of a
# fix along two axes at right angles, and the first of these (a unit vector).
SIGHT = np.dtype(
    [("node", "i8")]
    + [(name, "f8") for name in ("x_m", "y_m", "z_m", "range_m", "along_m2", "across_m2")]
    + [("axis_x", "f8"), ("axis_y", "f8")]
)

# The outcome of a sight: its innovation (m) along its first axis, its NIS if it is no outlier, the
# probability of that, the logarithm of its density, and whether it was accepted.
SEEN = np.dtype([(name, "f8") for name in ("off_m", "nis", "inlier", "density")] + [("taken", "?")])


class Mixture(NamedTuple):
    """The noise of sights: standard deviation of a range (m), share of outliers, standard deviation
    of their further error (m); the gate on an outlier's NIS, 0: none.
    """

    sd: float
    share: float
    outlier_sd: float
    gate: float


# Standard deviations of an estimated start, per axis (m), and of its heading (rad): the start comes
# from the very ranges that navigate, so they must be free to move it.
START_SD, HEADING_SD = 10.0, 0.1


@dataclass(frozen=True)
class Noise:
    """The noise of a log: of ranges (m), a share of outliers and their further error (m), dead
    reckoning's random walk (m/sqrt(s)) and velocity bias (m/s, ahead and to the side of y).

    `bias_sd` is the standard deviation of a bias beyond the given one (m/s), which wanders with a
    time constant `bias_time_constant_s` (s) or, if that is infinite, is constant; `scale_sd` and
    `heading_sd` (rad) are constant errors of the path's scale and heading.  A sight whose NIS as an
    outlier is above `gate` is refused; 0: none is.
    """

    range_sd: float
    outlier_share: float
    outlier_sd: float
    random_walk: float
    bias: tuple[float, float] = (0.0, 0.0)
    bias_sd: float = 0.0
    gate: float = 0.0
    start_sd: float = 0.0
    in_body: bool = True
    scale_sd: float = 0.0
    heading_sd: float = 0.0
    bias_time_constant_s: float = inf

    def with_start_found(self) -> "Noise":
        """Return noise that leaves an estimated start free to move."""
        start_sd, heading_sd = max(self.start_sd, START_SD), max(self.heading_sd, HEADING_SD)
        return replace(self, start_sd=start_sd, heading_sd=heading_sd)

    @property
    def mixture(self) -> Mixture:
        """The noise of sights, as compiled code takes it."""
        return Mixture(*map(float, (self.range_sd, self.outlier_share, self.outlier_sd, self.gate)))

    @property
    def beliefs(self) -> tuple[Belief, Growth]:
        """The first belief, and the growth of its covariance."""
        wanders = self.bias_sd > 0.0 and self.bias_time_constant_s < inf
        constant = 0.0 if wanders else self.bias_sd
        ahead, aside = (hypot(bias, constant) for bias in self.bias)
        return beginning(
            self.start_sd,
            (ahead, aside),
            float(self.random_walk) ** 2,
            in_body=self.in_body,
            skew=Further((self.scale_sd, self.heading_sd), (inf, inf)),
            wandering=Further((self.bias_sd,) * 2, (self.bias_time_constant_s,) * 2)
            if wanders
            else NO_STATES,
        )


class Prepared(NamedTuple):
    """A log for navigators: its odometry at all instants of rows and sights, and the sights."""

    odometry: Odometry
    sights: Rows

    def beliefs(self, noise: Noise) -> tuple[Belief, Growth]:
        """Return the belief at the first instant, and its growth."""
        first, growth = noise.beliefs
        x, y = self.odometry.position[0].tolist()
        return begun_at(first, (x, y)), growth


class NavigatedTrack(NamedTuple):
    """A vehicle's estimated track at n instants (n,), s: positions (n, 2), m, and their covariances
    xx, yy, xy (n, 3), m2; the outcomes of m sights (m,), SEEN.
    """

    times: Floats
    places: Floats
    covariances: Floats
    seen: Rows

    def at(self, times: Floats) -> Floats:
        """Return the positions (k, 2), m, at some of the instants (k,), s."""
        return self.places[np.searchsorted(self.times, times)]


class SightGradient(NamedTuple):
    """A sight linearised at a position: its gradient by the error of dead reckoning, a unit vector
    (x, y), its innovation (m), and its variance (m2).
    """

    x: float
    y: float
    off: float
    variance: float


@inlined
def aimed(sight: Row, x: float, y: float, sd: float) -> SightGradient:
    """Return a sight linearised at a vehicle's estimated position x, y (m); `sd` (m) of a range."""
    if np.isnan(sight.range_m):  # a fix behind the estimate means an error ahead
        off = (x - sight.x_m) * sight.axis_x + (y - sight.y_m) * sight.axis_y
        return SightGradient(sight.axis_x, sight.axis_y, off, sight.along_m2)
    ahead, aside = x - sight.x_m, y - sight.y_m
    away = max(sqrt(ahead * ahead + aside * aside + sight.z_m * sight.z_m), 1e-9)
    return SightGradient(-ahead / away, -aside / away, sight.range_m - away, sd * sd)


@inlined
def across(sight: Row, x: float, y: float) -> SightGradient:
    """Return a fix linearised at x, y (m) along its second axis."""
    off = (y - sight.y_m) * sight.axis_x - (x - sight.x_m) * sight.axis_y
    return SightGradient(-sight.axis_y, sight.axis_x, off, sight.across_m2)


@inlined
def mixed(variance: float, inlier: float, noise: Mixture) -> float:
    """Return the effective variance (m2) of a sight that is an inlier with a probability."""
    return 1.0 / (inlier / variance + (1.0 - inlier) / (variance + noise.outlier_sd**2))


@compiled
def inlier_of(near: float, far: float, noise: Mixture) -> tuple[float, float]:
    """Return the probability that a sight is no outlier, and the logarithm of its density, from the
    logarithms of its densities as an inlier (`near`) and as an outlier (`far`).
    """
    if noise.share <= 0.0:
        return 1.0, near
    near, far = near + log1p(-noise.share), far + log(noise.share)
    most = max(near, far)
    total = most + log(exp(near - most) + exp(far - most))
    return exp(near - total), total


@inlined
def _density(first: float, second: float, xx: float, yy: float, xy: float) -> tuple[float, float]:
    """Return the NIS of two innovations (m) with a covariance (m2), and their log density."""
    determinant = xx * yy - xy * xy
    square = (yy * first * first - 2.0 * xy * first * second + xx * second * second) / determinant
    return square, -0.5 * (square + log(determinant)) - log(2.0 * pi)


@compiled
def _judged(
    aim: SightGradient, other: SightGradient, spread: Floats, is_fix: bool, noise: Mixture
) -> tuple[float, float, float, float]:
    """Return a sight's NIS as inlier and as outlier, its probability of an inlier, and log
    density.
    """
    wide = noise.outlier_sd**2
    xx = _between(aim, aim, spread) + aim.variance
    if not is_fix:
        near = -0.5 * (aim.off**2 / xx + log(2.0 * pi * xx))
        far = -0.5 * (aim.off**2 / (xx + wide) + log(2.0 * pi * (xx + wide)))
        inlier, density = inlier_of(near, far, noise)
        return aim.off**2 / xx, aim.off**2 / (xx + wide), inlier, density
    yy = _between(other, other, spread) + other.variance
    xy = _between(aim, other, spread)
    nis, near = _density(aim.off, other.off, xx, yy, xy)
    wide_nis, far = _density(aim.off, other.off, xx + wide, yy + wide, xy)
    inlier, density = inlier_of(near, far, noise)
    return nis, wide_nis, inlier, density


@inlined
def _between(one: SightGradient, other: SightGradient, spread: Floats) -> float:
    """Return the covariance (m2) of a position's error along two axes."""
    x = spread[0, 0] * other.x + spread[0, 1] * other.y
    y = spread[1, 0] * other.x + spread[1, 1] * other.y
    together: float = one.x * x + one.y * y
    return together


def filter_log(log: Prepared, noise: Noise) -> NavigatedTrack:
    """Return the vehicle's track, sight by sight, by an extended Kalman filter."""
    (odometry, sights), (own, growth) = log, log.beliefs(noise)
    places, covariances = np.empty((len(odometry.times), 2)), np.empty((len(odometry.times), 3))
    seen = blank_seen(len(sights))
    follow(own, odometry, sights, noise.mixture, growth, seen, places, covariances)
    return NavigatedTrack(odometry.times, places, covariances, seen)


# Sights are linearised again at the new track until that moves by less (m), at most so many times.
SETTLED, MOST_LOOKS = 1e-3, 50


def smooth_log(
    log: Prepared, noise: Noise, begin: NavigatedTrack
) -> tuple[NavigatedTrack, Smoothed]:
    """Return the track from all sights together, and the estimates of all states.

    Sights are linearised at `begin`, and again at each result, until nothing changes: the most
    likely track.
    """
    (odometry, sights), (first, growth), places = log, log.beliefs(noise), begin.places
    most, seen = 2 * len(sights), blank_seen(len(sights))
    for _ in range(MOST_LOOKS):
        nodes, values, variances = np.zeros(most, np.int64), np.zeros(most), np.zeros(most)
        linear = Sights(nodes, np.zeros((most, len(first.state))), values, variances)
        n = linearise(sights, places, odometry.position, noise.mixture, linear, seen)
        own = Sights(nodes[:n], linear.rows[:n], values[:n], variances[:n])
        found = smooth(first, odometry, own, growth)
        before, places = places, odometry.position - found.states[:, :2]
        if np.abs(places - before).max() < SETTLED:
            break
    spread = found.covariances
    covariances = np.column_stack((spread[:, 0, 0], spread[:, 1, 1], spread[:, 0, 1]))
    return NavigatedTrack(odometry.times, places, covariances, seen), found


def blank_seen(count: int) -> Rows:
    """Return rows of outcomes for so many sights, :data:`SEEN`, all zero."""
    return np.zeros(count, dtype=SEEN).view(np.recarray)


@compiled
def follow(
    own: Belief, odometry: Odometry, sights: Rows, noise: Mixture, growth: Growth, seen: Rows,
    places: Floats, spreads: Floats,
) -> None:  # fmt: skip
    """Correct a belief, in place, by sights in the order of their instants.

    Write the outcomes to `seen` (m,), SEEN, the estimated positions to `places` (n, 2), m, and
    their covariances xx, yy, xy to `spreads` (n, 3), m2, each after the sights of its instant.
    """
    state, covariance, sight = own.state, own.covariance, 0
    row, gain = np.zeros((1, state.size)), np.empty((1, state.size))
    for n in range(odometry.times.size):
        dr = dr_at(odometry, n)
        carry(own, dr, growth)
        while sight < sights.size and sights[sight].node == n:
            _apply_sight(own, sights[sight], dr, noise, seen[sight], row, gain)
            sight += 1
        places[n, 0], places[n, 1] = dr.x - state[0], dr.y - state[1]
        spreads[n, 0], spreads[n, 1] = covariance[0, 0], covariance[1, 1]
        spreads[n, 2] = covariance[0, 1]


@compiled
def _apply_sight(
    own: Belief, sight: Row, dr: DeadReckoned, noise: Mixture, seen: Row, row: Floats, gain: Floats
) -> None:
    """Correct a belief by one sight, and write its outcome; `row` and `gain` (1, k) are scratch."""
    is_fix = np.isnan(sight.range_m)
    x, y = dr.x - own.state[0], dr.y - own.state[1]
    aim, other = aimed(sight, x, y, noise.sd), across(sight, x, y)
    nis, wide_nis, inlier, density = _judged(aim, other, own.covariance, is_fix, noise)
    seen.off_m, seen.nis, seen.inlier, seen.density = aim.off, nis, inlier, density
    moment = own.moment[0]
    is_far = noise.gate > 0.0 and wide_nis > noise.gate
    if moment.refused >= MOST_REFUSED:  # the belief was wrong
        is_far, moment.refused = False, 0
    elif is_far or (noise.gate > 0.0 and inlier < 0.5):
        moment.refused += 1
        if moment.refused == MOST_REFUSED:
            believed, variance = _between(aim, aim, own.covariance), aim.variance
            if is_fix:
                believed += _between(other, other, own.covariance)
                variance += other.variance
            excess = nis / max(noise.gate, EXPECTED)
            own.covariance[:] *= doubted(excess, believed, believed + variance)
    else:
        moment.refused = 0
    seen.taken = not is_far
    if is_far:
        return
    row[0, 0], row[0, 1] = aim.x, aim.y
    absorb(own, row, aim.off, mixed(aim.variance, inlier, noise), gain)
    if is_fix:
        x, y = dr.x - own.state[0], dr.y - own.state[1]
        other = across(sight, x, y)
        row[0, 0], row[0, 1] = other.x, other.y
        absorb(own, row, other.off, mixed(other.variance, inlier, noise), gain)


@compiled
def linearise(
    sights: Rows, places: Floats, position: Floats, noise: Mixture, linear: Sights, seen: Rows
) -> int:
    """Linearise sights (m,) at `places` (n, 2), m, with dead reckoning at `position` (n, 2), m.

    Write at most 2 m sights to `linear`, and their outcomes, as if the positions were exact, to
    `seen`, SEEN; return the number of linear sights.
    """
    surely, count = np.zeros((2, 2)), 0
    for k in range(sights.size):
        sight, node = sights[k], sights[k].node
        x, y = places[node, 0], places[node, 1]
        is_fix = np.isnan(sight.range_m)
        aim, other = aimed(sight, x, y, noise.sd), across(sight, x, y)
        nis, wide_nis, inlier, density = _judged(aim, other, surely, is_fix, noise)
        seen[k].off_m, seen[k].nis, seen[k].inlier = aim.off, nis, inlier
        seen[k].density, seen[k].taken = density, noise.gate <= 0.0 or wide_nis <= noise.gate
        if not seen[k].taken:
            continue
        for number in range(2 if is_fix else 1):
            own = aim if number == 0 else other
            error_x, error_y = position[node, 0] - x, position[node, 1] - y
            linear.nodes[count] = node
            linear.rows[count, 0], linear.rows[count, 1] = own.x, own.y
            linear.values[count] = own.off + own.x * error_x + own.y * error_y
            linear.variances[count] = mixed(own.variance, inlier, noise)
            count += 1
    return count
