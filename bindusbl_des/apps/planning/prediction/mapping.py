"""Maps of errors over a survey: of the AUV whose path is nearest, or of an AUV that dwells.

The size of an error follows from its mean and covariance: the square of a plane Gaussian error is
approximated by a gamma variable of the same mean and variance (Satterthwaite 1946), exactly if it
is isotropic with zero mean, one-dimensional with zero mean, or constant.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ....support.arrays import Floats, Ints
from ...preflight.fix_chance import by_first
from .inputs import FixNoise, Inputs, PlannedWays
from .march import Errors
from .rounds import RoundPlan, planned_rounds
from .sights import ExpectedSights, fixes, located, seen, sights

# Quantiles of the standard normal distribution at the middle of each upper twentieth.
QUANTILES = (
    *(0.062706777943, 0.189118426273, 0.318639363964, 0.45376219017, 0.597760126042),
    *(0.75541502636, 0.934589291073, 1.150349380376, 1.439531470938, 1.95996398454),
)
TWENTIETHS = np.array([-number for number in reversed(QUANTILES)] + list(QUANTILES))

# The shift of the gamma quotient's argument before its expansion.
RAISED = 8


def squares(mean: Floats, covariance: Floats) -> tuple[Floats, Floats]:
    """Return the mean square (...; m2) of errors, and the shape of its gamma distribution.

    `mean` is (..., 2; m), `covariance` xx, yy, xy (..., 3; m2).  The shape is the squared ratio of
    the mean square to its standard deviation, infinite if that is 0.
    """
    x, y = mean[..., 0], mean[..., 1]
    xx, yy, xy = (covariance[..., k] for k in range(3))
    square = x * x + y * y + xx + yy
    varies = 2.0 * (xx * xx + yy * yy + 2.0 * xy * xy)
    varies = varies + 4.0 * (x * x * xx + y * y * yy + 2.0 * x * y * xy)
    sure = varies <= 1e-12 * square * square
    shape = square * square / np.where(sure, 1.0, varies)
    return square, np.where(sure, np.inf, shape)


def mean_size(square: Floats, shape: Floats) -> Floats:
    """Return the mean length of errors (m) from their mean square (m2) and gamma shape."""
    known = np.where(np.isinf(shape), 1.0, shape)
    varying = np.sqrt(square / known) * gamma_quotient(known)
    return np.asarray(np.where(np.isinf(shape), np.sqrt(square), varying))


def gamma_quotient(shape: Floats) -> Floats:
    """Return G(k + 1/2) / G(k) of the gamma function, to 1e-7.

    Source: Abramowitz and Stegun, Handbook of Mathematical Functions, 1964, 6.1.15 and 6.1.47.

    >>> round(float(gamma_quotient(np.array(1.0))), 6), round(float(np.sqrt(np.pi) / 2), 6)
    (0.886227, 0.886227)
    """
    quotient: Floats = np.ones(np.shape(shape))
    for k in range(RAISED):
        quotient = quotient * (shape + k) / (shape + k + 0.5)
    z = shape + RAISED
    by = 1.0 / z
    last = 5.0 / 1024.0 - 21.0 / 32768.0 * by
    expansion = 1.0 + by * (-1.0 / 8.0 + by * (1.0 / 128.0 + by * last))
    return np.asarray(quotient * np.sqrt(z) * expansion)


def sizes_of_all(square: Floats, shape: Floats) -> Floats:
    """Return the lengths (..., 20; m) of errors in the middle of each twentieth of all cases.

    Source: Wilson and Hilferty, Proc. National Academy of Sciences 17, 1931.
    """
    third = 1.0 / (9.0 * shape[..., np.newaxis])
    root = np.maximum(1.0 - third + TWENTIETHS * np.sqrt(third), 0.0)
    return np.asarray(np.sqrt(square[..., np.newaxis] * root * root * root))


def quantile(values: Floats, share: float) -> Floats:
    """Return a quantile (n,) of each row of values (n, m), interpolated linearly."""
    rising = np.sort(values, axis=1)
    place = share * (rising.shape[1] - 1)
    low = min(int(place), rising.shape[1] - 2)
    return np.asarray(rising[:, low] + (place - low) * (rising[:, low + 1] - rising[:, low]))


def scatter(errors: Errors, square: Floats, size: Floats) -> Floats:
    """Return the standard deviation (n,) of a mission's mean error, as a share of the mean.

    `square` (m2) and `size` (m), both (n, k), are the mean square and mean length of errors.
    Lengths are assumed as correlated as their squares.  The variance of a mean over time is a mean
    over pairs of instants; a few first instants stand for all.
    """
    spread = np.sqrt(np.maximum(square - size * size, 0.0))
    auvs, count, instants = errors.alike.shape
    total, known = np.zeros(auvs), np.zeros(auvs)
    rows = np.arange(auvs)
    for anchor in range(count):
        begin = errors.since[:, anchor]
        own = spread[rows, begin] * spread[rows, begin]
        pairs = (errors.alike[:, anchor] * spread).sum(axis=1) * spread[rows, begin] - 0.5 * own
        total = total + np.where(begin >= 0, 2.0 * pairs / instants, 0.0)
        known = known + (begin >= 0)
    variance = np.maximum(total / np.maximum(known, 1.0), 0.0)
    return np.asarray(np.sqrt(variance) / np.maximum(size.mean(axis=1), 1e-30))


def expected_largest(values: Floats, varies: Floats) -> float:
    """Return the expected largest of n independent values with relative standard deviations (n,).

    Each is a gamma variable, approximated by twenty equally likely values.
    """
    third = varies[:, np.newaxis] / 3.0
    cases = values[:, np.newaxis] * np.maximum(1.0 - third**2 + TWENTIETHS * third, 0.0) ** 3
    order = np.argsort(cases, axis=None, kind="stable")
    passed, below, total = np.zeros(len(values)), 0.0, 0.0
    for place in order.tolist():
        passed[place // len(TWENTIETHS)] += 1.0 / len(TWENTIETHS)
        largest = float(passed.prod())
        total += (largest - below) * float(cases.flat[place])
        below = largest
    return total


class OnWays(NamedTuple):
    """The nearest point of the AUVs' paths to each of p places: AUV, instant before it, and share
    of the leg to the next instant, (p,) each.
    """

    auv: Ints
    instant: Ints
    share: Floats


# The most pairs of a place and a leg in one array.
MOST_PAIRS = 1_000_000


def nearest_on_ways(ways: PlannedWays, places: ArrayLike) -> OnWays:
    """Return the nearest points of the AUVs' paths to `places` (p, 2; m)."""
    spots = np.asarray(places, dtype=np.float64)
    begins = ways.places_m[:, :-1].reshape(-1, 2)
    legs = np.diff(ways.places_m, axis=1).reshape(-1, 2)
    square = np.maximum((legs * legs).sum(axis=1), 1e-30)
    found, shares = [np.empty(0, np.int64)], [np.empty(0)]
    for some in np.array_split(spots, -(-len(spots) * len(legs) // MOST_PAIRS)):
        away = some[:, np.newaxis] - begins
        share = np.clip((away * legs).sum(axis=2) / square, 0.0, 1.0)
        away -= share[:, :, np.newaxis] * legs
        leg = (away * away).sum(axis=2).argmin(axis=1)
        found.append(leg)
        shares.append(share[np.arange(len(some)), leg])
    auv, instant = np.divmod(np.concatenate(found), ways.places_m.shape[1] - 1)
    return OnWays(auv, instant, np.concatenate(shares))


def lane_map(nearest: OnWays, error_over_time: Floats) -> Floats:
    """Return the mean error (p,; m) of the AUV that passes nearest to each place, as it passes."""
    auv, instant, share = nearest
    before, after = error_over_time[auv, instant], error_over_time[auv, instant + 1]
    return np.asarray((1.0 - share) * before + share * after)


# A smaller probability of a fix per round counts as none.
SELDOM = 1e-3


class ErrorMap(NamedTuple):
    """The mean error (p,; m) of an AUV that dwells at each place; a round's chance of a fix.

    Without fixes the error is the drift of dead reckoning, averaged over the mission.
    """

    error_m: Floats
    chance: Floats


def error_map(inputs: Inputs, stations: ArrayLike, places: ArrayLike) -> ErrorMap:
    """Return the errors at `places` (p, 2; m) with ASVs at `stations` (m, 2; m).

    Rounds have the fleet's mean length, and the AUV is the first of it.  Its filter knows the
    sources of drift as well as the fixes of a mission allow (Kalman), or not at all (fixed gain).
    """
    asvs, spots = (np.asarray(given, dtype=np.float64) for given in (stations, places))
    plan = planned_rounds(inputs, seen(inputs, asvs))
    period = 1.0 / float((1.0 / plan.period_s).mean())
    noise, ways = inputs.noise, inputs.ways
    here = replace(
        inputs,
        ways=PlannedWays(ways.times_s, spots[np.newaxis], ways.headings_s[:1], ways.depths_m[:1]),
        noise=FixNoise(noise.step_m, *(table[:1] for table in _tables(noise))),
    )
    around = sights(here, spots[np.newaxis], asvs)
    found, own = located(here, around)[0], fixes(here, around, spots[np.newaxis], asvs)
    if inputs.access.ranging.asvs_ping:
        chance, kind = found.max(axis=1), found.argmax(axis=1)
        period *= len(asvs) / np.maximum(found.sum(axis=1) / np.maximum(chance, SELDOM), 1.0)
    else:
        chance, kind = found[:, 0] * _delivered(here, around), np.zeros(len(spots), dtype=np.int64)
    if inputs.access.schedule.turn != "each":
        period *= len(ways.places_m)
    spread = own.noise[0, np.arange(len(spots)), kind]
    lasts = own.lasts[0, np.arange(len(spots)), kind]
    lost = _drifted(inputs)
    pauses = Pauses(period / np.maximum(chance, SELDOM), chance, _late(inputs, plan))
    mean, settled = _settled(inputs, pauses, spread)
    error = mean_size(*squares(mean, settled + lasts))
    corrected = (chance > SELDOM) & (not inputs.navigator.kind.ignores_fixes)
    return ErrorMap(np.where(corrected, np.minimum(error, lost), lost), chance)


def _tables(noise: FixNoise) -> tuple[Floats, ...]:
    return noise.along_m2, noise.across_m2, noise.down_m2, noise.leaning_m2, noise.slow


def _delivered(inputs: Inputs, around: ExpectedSights) -> Floats:
    """Return the probability (p,) that an AUV decodes a broadcast."""
    chosen, delivered = inputs.access.broadcaster, around.delivered[0]
    if inputs.access.downlink.replies:
        if not inputs.access.replies_in_frames:
            return np.ones(len(delivered))
        return by_first(around.heard[0], delivered, around.level_m[0])
    if chosen.chosen_by == "one":
        return np.asarray(delivered[:, inputs.access.fixed_asv])
    if chosen.serves_nearest:
        return np.asarray(delivered[np.arange(len(delivered)), around.level_m[0].argmin(axis=1)])
    return np.asarray(delivered.mean(axis=1))


class Pauses(NamedTuple):
    """The mean interval of fixes (p,; s), a round's chance of one (p,), and their latency (s)."""

    interval_s: Floats
    chance: Floats
    late_s: float


def _late(inputs: Inputs, plan: RoundPlan) -> float:
    """Return the mean latency (s) of a fix."""
    if inputs.access.ranging.asvs_ping:
        return 0.0
    if inputs.access.downlink.replies:
        return inputs.access.reply_s
    waited = 0.0 if inputs.access.downlink.by_group else plan.slot * plan.pitch_s
    return float((plan.send_s + plan.frame_s - waited).mean())


def _settled(inputs: Inputs, pauses: Pauses, noise: Floats) -> tuple[Floats, Floats]:
    """Return the mean (p, 2; m) and covariance xx, yy, xy (p, 3; m2) of errors in steady state.

    Drift that is not estimated lies along x.
    """
    navigator, (interval, chance, late) = inputs.navigator, pauses
    walk, biases, mean = navigator.walk_m2_per_s, _velocities(inputs), np.zeros((len(noise), 2))
    varies = interval * interval * (1.0 - np.minimum(chance, 1.0))
    age = (interval * interval + varies) / (2.0 * interval) + late  # mean age of the last fix
    if navigator.kind.has_gain:
        gain = navigator.gain
        left = (1.0 - gain) ** 2 / (gain * (2.0 - gain))
        since = interval * interval / 12.0 + varies
        mean[:, 0] = np.sqrt(biases) * ((1.0 - gain) / gain * interval + age)
        grown = left * walk * interval + walk * age
        out = gain / (2.0 - gain) * noise
        out[:, 0] += biases * (varies * left + since)
    else:
        half = 0.5 * walk * interval
        grown = walk * age - half
        count = np.maximum(inputs.duration_s / interval, 1.0)
        out = _settling(walk * interval, noise) + (4.0 / count)[:, np.newaxis] * noise
    out[:, 0] += grown
    out[:, 1] += grown
    return mean, out


def _settling(walk: Floats, noise: Floats) -> Floats:
    """Return sqrt(q^2 / 4 + q R) for walks q (p,; m2) and noise R of xx, yy, xy (p, 3; m2).

    It is a Kalman filter's covariance halfway between two fixes (scalar Riccati equation).  The
    square root of a 2 x 2 matrix M is (M + s) / t, s the root of its determinant, t that of its
    trace + 2 s.
    """
    quarter = 0.25 * walk * walk
    xx, yy = quarter + walk * noise[:, 0], quarter + walk * noise[:, 1]
    xy = walk * noise[:, 2]
    root = np.sqrt(np.maximum(xx * yy - xy * xy, 0.0))
    trace = np.maximum(np.sqrt(xx + yy + 2.0 * root), 1e-30)
    return np.stack(((xx + root) / trace, (yy + root) / trace, xy / trace), axis=-1)


def _velocities(inputs: Inputs) -> float:
    """Return the mean square (m2/s2) of dead reckoning's velocity error."""
    ways, total = inputs.ways, 0.0
    moved = np.diff(ways.places_m[0], axis=0)
    speed = float(np.sqrt((moved * moved).sum(axis=1)).sum()) / inputs.duration_s
    for source in inputs.navigator.sources:
        scale = speed if source.frame == "way" else 1.0
        total += sum((scale * velocity) ** 2 for velocity in (*source.mean, *source.drawn_sd))
    return total


def _drifted(inputs: Inputs) -> float:
    """Return the drift (m) of dead reckoning on a straight path, averaged over the mission."""
    end, walk = inputs.duration_s, inputs.navigator.walk_m2_per_s
    start = 2.0 * inputs.navigator.start_sd_m**2
    return float(np.sqrt(start + _velocities(inputs) * end * end / 4.0 + walk * end))
