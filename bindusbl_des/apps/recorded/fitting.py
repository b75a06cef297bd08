"""The noise in a log: that under which what was measured is likeliest, given what was known before.

The likelihood of a log is the product of the densities of its sights, each as the filter predicts
it from those before.  Source: F. C. Schweppe, Evaluation of likelihood functions for Gaussian
signals, IEEE Transactions on Information Theory 11(1), 1965.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache, partial
from typing import NamedTuple

import numpy as np

from ...support.arrays import Floats
from .log import BadLog, Log
from .losses import Losses, losses_of
from .navigating import Noise, Prepared, filter_log, prepared, smooth_log

# The log-likelihood of a log with a noise
Score = Callable[[Noise], float]

# A velocity bias is taken to be at most some such share of the speed (one standard deviation).
BIAS_SHARE = 0.1

# The search begins with steps of this factor and ends below the other; a share stays inside these.
FIRST_FACTOR, LAST_FACTOR = 2.0, 1.01
LEAST_SHARE, MOST_SHARE = 1e-4, 0.5
# Noise is likelier where the logarithm rises by so much at least; less is no reason to go on.
GAIN = 1e-2


# What random walks leave unsure of the bias is weighed from a 16th of the likeliest on, by this
# factor, up to one whose likelihood is e^8 times less.
WALKS_BELOW, MOST_WALKS, WALK_FACTOR, UNLIKELY = 8, 48, 2.0**0.5, 8.0


class Fit(NamedTuple):
    """The noise found, the sum of the logarithms of the sights' densities with it, how sure the
    velocity bias is (m/s, along both axes), and how receptions were lost, if the log says so.
    """

    noise: Noise
    log_likelihood: float
    bias_sds: tuple[float, float]
    losses: Losses | None = None


def fit(log: Log) -> Fit:
    """Return the noise under which a log, which is placed, is likeliest.

    A fix brings its own covariance, so that a log without ranges tells of no range's noise.
    Outliers are two numbers more, and that the start is unsure one, which the log must bear out:
    each number must make its n sights more likely by a factor of the root of n.
    Source: G. Schwarz, Estimating the dimension of a model, Annals of Statistics 6(2), 1978.

    Raises:
        BadLog: when numbers are so large that no noise makes them likely.
    """
    known, tailed, walks = prepared(log), _guess(log), _walks(log)
    plain = replace(tailed, outlier_share=0.0, outlier_sd=0.0)
    guesses = [(plain, 0.0), (tailed, 2.0)]
    if not log.start_found and (off := _first_off(log)) > 0.0:
        guesses += [(replace(guess, start_sd=off), more + 1.0) for guess, more in guesses]
    score = cache(partial(_score, known))  # searches come to the same numbers again
    tried = [_likeliest(score, guess, walks, log.has_ranges) for guess, _ in guesses]
    worth = 0.5 * np.log(len(known.sights))
    scores = [score(noise) - worth * n for noise, (_, n) in zip(tried, guesses, strict=True)]
    noise = tried[int(np.argmax(scores))]
    with np.errstate(all="ignore"):  # told below
        (ahead, aside), sds = _bias(known, noise)
    if not np.isfinite((ahead, aside, *sds, max(scores))).all():
        raise BadLog(
            f"{log.name}: no noise makes what was measured likely; look for a range, fix or step "
            "that is far too large"
        )
    found = replace(noise, bias=(ahead, aside), bias_sd=float(np.sqrt(np.mean(sds**2))))
    sure = float(sds[0]), float(sds[1])
    return Fit(found, _score(known, noise), sure, losses_of(log.receptions))


def _bias(log: Prepared, noise: Noise) -> tuple[list[float], Floats]:
    """Return the velocity bias ahead and aside (m/s), and its standard deviations (2,).

    A bias is as sure as the random walk beside it is small, of which a log tells little: what each
    walk leaves is weighed by its likelihood, all walks being as probable before.
    """
    best, weights, means, squares = _score(log, noise), [], [], []
    for step in range(-WALKS_BELOW, MOST_WALKS):
        factor = WALK_FACTOR**step
        tried = replace(noise, random_walk=noise.random_walk * factor)
        track = filter_log(log, tried)
        less = best - float(track.seen["density"].sum())
        if step > 0 and less > UNLIKELY:
            break
        _, found = smooth_log(log, tried, track)
        bias = found.states[-1, 2:4]
        weights.append(factor * np.exp(-less))
        means.append(bias)
        squares.append(bias**2 + np.diagonal(found.covariances[-1])[2:4])
    mean, square = (np.average(values, axis=0, weights=weights) for values in (means, squares))
    return mean.tolist(), np.sqrt(square - mean**2)


def _guess(log: Log) -> Noise:
    """Return noise to begin with: of metres, and of a tenth of the way.

    Odometry that stands still, as without a velocity log, misses the vehicle's own speed.
    """
    speed, apparent = _speed(log), 0.0
    for times, off in _offsets(log):
        lag = len(times) // 2
        if lag and (times[lag:] > times[:-lag]).all():
            moved = np.linalg.norm(off[lag:] - off[:-lag], axis=1)
            apparent = max(apparent, float(np.median(moved / (times[lag:] - times[:-lag]))))
    guess = Noise(
        range_sd=2.0,
        outlier_share=0.1,
        outlier_sd=20.0,
        random_walk=0.0,
        bias_sd=max(BIAS_SHARE * speed, apparent),
    )
    return guess.with_start_found() if log.start_found else guess


def _walks(log: Log) -> list[float]:
    """Return random walks (m/sqrt(s)) to begin with: of a tenth of the way, and by how much sights
    move against odometry from one to the next, half of all of them.
    """
    squares = [np.zeros(0)]
    for times, off in _offsets(log):
        passed = np.diff(times)
        moved = np.sum(np.diff(off, axis=0) ** 2, axis=1) / off.shape[1]
        squares.append(moved[passed > 0.0] / passed[passed > 0.0])
    each = np.concatenate(squares)
    found = [0.1 * _speed(log), float(np.sqrt(np.median(each))) if each.size else 0.0]
    return [walk for walk in found if walk > 0.0] or [0.0]


def _speed(log: Log) -> float:
    return log.distance / float(log.times[-1])


def _first_off(log: Log) -> float:
    """Return how far (m, along an axis) odometry is from the first fix, or range; the median of
    the first five, of which one may be an outlier.
    """
    off = [np.median(np.abs(off[:5]), axis=0).max() for _, off in _offsets(log) if len(off)]
    return float(max(off, default=0.0))


def _offsets(log: Log) -> Iterator[tuple[Floats, Floats]]:
    """Yield instants (k,), s, and by how much odometry is off there (k, 1 or 2), m: of fixes along
    both axes, of ranges to a beacon along the line to it.
    """
    ranges, fixes = log.ranges, log.fixes
    yield fixes.times, log.at(log.places, fixes.times) - fixes.places
    away = np.column_stack((log.at(log.places, ranges.times), log.at(log.depths, ranges.times)))
    off = np.linalg.norm(away - log.beacons.places[ranges.beacons], axis=1) - ranges.metres
    for beacon in range(len(log.beacons.names)):
        rows = ranges.beacons == beacon
        yield ranges.times[rows], off[rows, None]


def _likeliest(score: Score, guess: Noise, walks: list[float], has_ranges: bool) -> Noise:
    """Return the likeliest noise, from each random walk to begin with; the first of equals."""
    best, highest = guess, -np.inf
    for walk in walks:
        found = _searched(score, replace(guess, random_walk=walk), has_ranges)
        if (value := score(found)) > highest + 1.0:
            best, highest = found, value
    return best


def _searched(score: Score, guess: Noise, has_ranges: bool) -> Noise:
    """Return likelier noise, by pattern search: each number in turn, by ever smaller factors.

    Source: R. Hooke, T. A. Jeeves, "Direct search" solution of numerical and statistical problems,
    Journal of the ACM 8(2), 1961.
    """
    names = ["range_sd"] * has_ranges + ["random_walk"]
    names += ["start_sd"] * (guess.start_sd > 0.0 and not guess.heading_sd)
    names += ["outlier_share", "outlier_sd"] * (guess.outlier_share > 0.0)
    best, highest, factor = guess, score(guess), FIRST_FACTOR
    while factor > LAST_FACTOR:
        found = highest
        for name in names:
            for by in (factor, 1.0 / factor):
                tried = _scaled(best, name, by)
                if (value := score(tried)) > highest + GAIN:
                    best, highest = tried, value
                    break
        if highest <= found:
            factor = factor**0.5
    return best


def _scaled(noise: Noise, name: str, by: float) -> Noise:
    value = getattr(noise, name) * by
    if name == "outlier_share":
        value = min(max(value, LEAST_SHARE), MOST_SHARE)
    return replace(noise, **{name: value})


def _score(log: Prepared, noise: Noise) -> float:
    """Return the log-likelihood of the sights; the least where it exceeds all numbers."""
    found = float(filter_log(log, noise).seen["density"].sum())
    return -np.inf if np.isnan(found) else found
