"""What a range or a fix tells of a believed position: an extended Kalman filter over a log.

A range to a beacon tells of the position along the line to it, the line as it is where the vehicle
believes to be.  Ranges at sea have a heavy tail (reflections, wrong detections), so noise is a
mixture: a share of the sights has a further error, of a larger standard deviation.  A sight counts
by how likely it is to be of either kind, which is what the expectation step of the EM algorithm
says of a scale mixture; what not even the wider kind explains is refused.  Source: K. L. Lange, R.
J. A. Little, J. M. G. Taylor, Robust statistical modeling using the t distribution, Journal of the
American Statistical Association 84, 1989.
"""

from dataclasses import dataclass, replace
from math import exp, hypot, inf, log, log1p, pi, sqrt
from typing import NamedTuple

import numpy as np

from ...support.arrays import Floats
from ...support.compiled import compiled, inlined
from ..records.rows import Row, Rows
from ..vehicles.reckoning import DeadReckoned
from .assumptions import NONE, Further, beginning
from .belief import Belief, Growth, begun_at, carry
from .dead_reckoning import Odometry, dr_at
from .fix_update import EXPECTED, MOST_REFUSED, doubted
from .smoothing import Sights, Smoothed, absorb, smooth

# A sight: at which instant, its number; the beacon, m, and the measured range (m), or where a fix
# lies and NaN; how far beacon and vehicle are apart in depth (m); along two axes at right angles
# the variances (m2) of a fix, and the first of them (a unit vector).
SIGHT = np.dtype(
    [("node", "i8")]
    + [(name, "f8") for name in ("x_m", "y_m", "z_m", "range_m", "along_m2", "across_m2")]
    + [("axis_x", "f8"), ("axis_y", "f8")]
)

# What became of a sight: how far it was from what was believed (m) along its first axis, the square
# of that by its variance if it is no outlier, the probability of that, and whether it was taken in;
# the logarithm of its density.
SEEN = np.dtype([(name, "f8") for name in ("off_m", "nis", "inlier", "density")] + [("taken", "?")])


class Mixture(NamedTuple):
    """The noise of sights: standard deviation of a range (m), share of outliers, standard deviation
    of their further error (m); refused is beyond so many variances of an outlier, 0: nothing.
    """

    sd: float
    share: float
    outlier_sd: float
    gate: float


# How far off a start that was found may be, per axis (m), and its heading (rad): it was found from
# the very ranges that navigate, so they must be free to move it.
START_SD, HEADING_SD = 10.0, 0.1


@dataclass(frozen=True)
class Noise:
    """What is unsure in a log: of ranges (m), a share of outliers and their further error (m), dead
    reckoning's random walk (m/sqrt(s)) and velocity bias (m/s, ahead and to the side of y).

    `bias_sd` is what a bias may be beyond the one given (m/s), which wanders with a time constant
    `bias_time_constant_s` (s) or, if that is infinite, is constant; the scale of the way is off by
    `scale_sd`, its heading by `heading_sd` (rad), both constant.  A sight that not even the
    variance of an outlier explains is refused: its normalised square is above `gate`; 0: none is.
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
        """Return noise that leaves a start that was found free to move."""
        start_sd, heading_sd = max(self.start_sd, START_SD), max(self.heading_sd, HEADING_SD)
        return replace(self, start_sd=start_sd, heading_sd=heading_sd)

    @property
    def mixture(self) -> Mixture:
        """The noise of sights."""
        return Mixture(*map(float, (self.range_sd, self.outlier_share, self.outlier_sd, self.gate)))

    @property
    def beliefs(self) -> tuple[Belief, Growth]:
        """What is believed at the start, and how that becomes less sure."""
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
            else NONE,
        )


class Prepared(NamedTuple):
    """A log as navigators take it: its odometry at all instants of rows and sights, the sights."""

    odometry: Odometry
    sights: Rows

    def beliefs(self, noise: Noise) -> tuple[Belief, Growth]:
        """Return what is believed at the first instant, and how that becomes less sure."""
        first, growth = noise.beliefs
        x, y = self.odometry.position[0].tolist()
        return begun_at(first, (x, y)), growth


class NavigatedTrack(NamedTuple):
    """Where a vehicle was taken for at n instants (n,), s: places (n, 2), m, and their covariances
    xx, yy, xy (n, 3), m2; what became of each of m sights (m,), SEEN.
    """

    times: Floats
    places: Floats
    covariances: Floats
    seen: Rows

    def at(self, times: Floats) -> Floats:
        """Return the places (k, 2), m, of some of the instants (k,), s."""
        return self.places[np.searchsorted(self.times, times)]


class SightGradient(NamedTuple):
    """How a sight looks from a place: the unit vector (x, y) by which its number rises with the
    error of dead reckoning, how far off it is (m), and its variance (m2).
    """

    x: float
    y: float
    off: float
    variance: float


@inlined
def aimed(sight: Row, x: float, y: float, sd: float) -> SightGradient:
    """Return how a sight looks from a place (m) that a vehicle believes in."""
    if np.isnan(sight.range_m):  # a fix says: dead reckoning is ahead by what it is behind
        off = (x - sight.x_m) * sight.axis_x + (y - sight.y_m) * sight.axis_y
        return SightGradient(sight.axis_x, sight.axis_y, off, sight.along_m2)
    ahead, aside = x - sight.x_m, y - sight.y_m
    away = max(sqrt(ahead * ahead + aside * aside + sight.z_m * sight.z_m), 1e-9)
    return SightGradient(-ahead / away, -aside / away, sight.range_m - away, sd * sd)


@inlined
def across(sight: Row, x: float, y: float) -> SightGradient:
    """Return how a fix looks along its second axis."""
    off = (y - sight.y_m) * sight.axis_x - (x - sight.x_m) * sight.axis_y
    return SightGradient(-sight.axis_y, sight.axis_x, off, sight.across_m2)


@inlined
def mixed(variance: float, inlier: float, noise: Mixture) -> float:
    """Return the variance (m2) by which a sight counts that is no outlier with a probability."""
    return 1.0 / (inlier / variance + (1.0 - inlier) / (variance + noise.outlier_sd**2))


@compiled
def inlier_of(near: float, far: float, noise: Mixture) -> tuple[float, float]:
    """Return the probability that a sight is no outlier, and the logarithm of its density, from
    those of its density as either kind.
    """
    if noise.share <= 0.0:
        return 1.0, near
    near, far = near + log1p(-noise.share), far + log(noise.share)
    most = max(near, far)
    total = most + log(exp(near - most) + exp(far - most))
    return exp(near - total), total


@inlined
def _density(first: float, second: float, xx: float, yy: float, xy: float) -> tuple[float, float]:
    """Return the normalised square of two offsets (m) with a covariance (m2), and the logarithm of
    their Gaussian density.
    """
    determinant = xx * yy - xy * xy
    square = (yy * first * first - 2.0 * xy * first * second + xx * second * second) / determinant
    return square, -0.5 * (square + log(determinant)) - log(2.0 * pi)


@compiled
def _judged(
    aim: SightGradient, other: SightGradient, spread: Floats, is_fix: bool, noise: Mixture
) -> tuple[float, float, float, float]:
    """Return NIS as an inlier, NIS as an outlier, the probability that it is none, log density."""
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
    """Return the covariance of a position's error along two axes (m2)."""
    x = spread[0, 0] * other.x + spread[0, 1] * other.y
    y = spread[1, 0] * other.x + spread[1, 1] * other.y
    together: float = one.x * x + one.y * y
    return together


def filter_log(log: Prepared, noise: Noise) -> NavigatedTrack:
    """Return where the vehicle would have taken itself for, sight by sight, as an extended Kalman
    filter has it.
    """
    (odometry, sights), (own, growth) = log, log.beliefs(noise)
    places, covariances = np.empty((len(odometry.times), 2)), np.empty((len(odometry.times), 3))
    seen = blank_seen(len(sights))
    follow(own, odometry, sights, noise.mixture, growth, seen, places, covariances)
    return NavigatedTrack(odometry.times, places, covariances, seen)


# Sights are looked at anew from where they have put the vehicle until that moves by less (m).
SETTLED, MOST_LOOKS = 1e-3, 50


def smooth_log(
    log: Prepared, noise: Noise, begin: NavigatedTrack
) -> tuple[NavigatedTrack, Smoothed]:
    """Return where all sights together say that it was, and what is believed of all states.

    Sights are looked at from `begin`, and from where that leads, until nothing changes: the most
    likely track.
    """
    (odometry, sights), (first, growth), places = log, log.beliefs(noise), begin.places
    most, seen = 2 * len(sights), blank_seen(len(sights))
    for _ in range(MOST_LOOKS):
        nodes, values, variances = np.zeros(most, np.int64), np.zeros(most), np.zeros(most)
        linear = Sights(nodes, np.zeros((most, len(first.state))), values, variances)
        n = look(sights, places, odometry.position, noise.mixture, linear, seen)
        own = Sights(nodes[:n], linear.rows[:n], values[:n], variances[:n])
        found = smooth(first, odometry, own, growth)
        before, places = places, odometry.position - found.states[:, :2]
        if np.abs(places - before).max() < SETTLED:
            break
    spread = found.covariances
    covariances = np.column_stack((spread[:, 0, 0], spread[:, 1, 1], spread[:, 0, 1]))
    return NavigatedTrack(odometry.times, places, covariances, seen), found


def blank_seen(count: int) -> Rows:
    """Return rows of what became of so many sights, :data:`SEEN`, of which nothing is known yet."""
    return np.zeros(count, dtype=SEEN).view(np.recarray)


@compiled
def follow(
    own: Belief, odometry: Odometry, sights: Rows, noise: Mixture, growth: Growth, seen: Rows,
    places: Floats, spreads: Floats,
) -> None:  # fmt: skip
    """Take sights into a belief, in its place, in the order of their instants.

    Write what became of each into `seen` (m,), SEEN; the places believed into `places` (n, 2), m,
    and their covariances xx, yy, xy into `spreads` (n, 3), m2, each with the sights of its instant.
    """
    state, covariance, sight = own.state, own.covariance, 0
    row, gain = np.zeros((1, state.size)), np.empty((1, state.size))
    for n in range(odometry.times.size):
        dr = dr_at(odometry, n)
        carry(own, dr, growth)
        while sight < sights.size and sights[sight].node == n:
            _take(own, sights[sight], dr, noise, seen[sight], row, gain)
            sight += 1
        places[n, 0], places[n, 1] = dr.x - state[0], dr.y - state[1]
        spreads[n, 0], spreads[n, 1] = covariance[0, 0], covariance[1, 1]
        spreads[n, 2] = covariance[0, 1]


@compiled
def _take(
    own: Belief, sight: Row, dr: DeadReckoned, noise: Mixture, seen: Row, row: Floats, gain: Floats
) -> None:
    """Take one sight into a belief, and note what became of it."""
    is_fix = np.isnan(sight.range_m)
    x, y = dr.x - own.state[0], dr.y - own.state[1]
    aim, other = aimed(sight, x, y, noise.sd), across(sight, x, y)
    nis, wide_nis, inlier, density = _judged(aim, other, own.covariance, is_fix, noise)
    seen.off_m, seen.nis, seen.inlier, seen.density = aim.off, nis, inlier, density
    moment = own.moment[0]
    is_far = noise.gate > 0.0 and wide_nis > noise.gate
    if moment.refused >= MOST_REFUSED:  # it is the belief that was wrong
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
def look(
    sights: Rows, places: Floats, position: Floats, noise: Mixture, linear: Sights, seen: Rows
) -> int:
    """Write sights (m,) made linear at places (n, 2), m, where dead reckoning is at `position`.

    What is written are `linear` ones (2 m,) or fewer, whose number is returned, and what is thought
    of each sight if the places are right, SEEN.
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
