"""The noise in a log: that under which what was measured is likeliest, given what was known before.

The likelihood of a log is the product of the densities of its sights, each as the filter predicts
it from those before.  Source: F. C. Schweppe, Evaluation of likelihood functions for Gaussian
signals, IEEE Transactions on Information Theory 11(1), 1965.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from .log import Array, Log
from .navigating import Prepared, filter_log, prepared, smooth_log
from .noise import Noise

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
    """The noise found, the sum of the logarithms of the sights' densities with it, and how sure the
    velocity bias is (m/s, along both axes).
    """

    noise: Noise
    log_likelihood: float
    bias_sds: tuple[float, float]


def fit(log: Log) -> Fit:
    """Return the noise under which a log, which is placed, is likeliest.

    A fix brings its own covariance, so that a log without ranges tells of no range's noise.
    Outliers are two numbers more, which the log must bear out: where its likelihood rises by less
    than a factor of n, the sights, there are none.
    Source: G. Schwarz, Estimating the dimension of a model, Annals of Statistics 6(2), 1978.
    """
    known, guess = prepared(log), _guess(log)
    plain = _likeliest(known, replace(guess, outlier_share=0.0, outlier_sd=0.0), log.has_ranges)
    tailed = _likeliest(known, guess, log.has_ranges)
    borne_out = _score(known, tailed) - _score(known, plain) > np.log(len(known.sights))
    noise = tailed if borne_out else plain
    (ahead, aside), sds = _bias(known, noise)
    found = replace(noise, bias=(ahead, aside), bias_sd=float(np.sqrt(np.mean(sds**2))))
    return Fit(found, _score(known, noise), (float(sds[0]), float(sds[1])))


def _bias(log: Prepared, noise: Noise) -> tuple[list[float], Array]:
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
    mean, square = (np.average(it, axis=0, weights=weights) for it in (means, squares))
    return mean.tolist(), np.sqrt(square - mean**2)


def _guess(log: Log) -> Noise:
    """Return noise to begin with: of metres, and of a hundredth of the way."""
    speed = log.distance / float(log.times[-1])
    guess = Noise(
        range_sd=2.0,
        outlier_share=0.1,
        outlier_sd=20.0,
        random_walk=0.1 * speed,
        bias_sd=BIAS_SHARE * speed,
    )
    return guess.with_start_found() if log.start_found else guess


def _likeliest(log: Prepared, guess: Noise, has_ranges: bool) -> Noise:
    """Return the likeliest noise, by pattern search: each number in turn, by ever smaller factors.

    Source: R. Hooke, T. A. Jeeves, "Direct search" solution of numerical and statistical problems,
    Journal of the ACM 8(2), 1961.
    """
    names = ["range_sd"] * has_ranges + ["random_walk"]
    names += ["outlier_share", "outlier_sd"] * (guess.outlier_share > 0.0)
    best, score, factor = guess, _score(log, guess), FIRST_FACTOR
    while factor > LAST_FACTOR:
        found = score
        for name in names:
            for by in (factor, 1.0 / factor):
                tried = _scaled(best, name, by)
                if (value := _score(log, tried)) > score + GAIN:
                    best, score = tried, value
                    break
        if score <= found:
            factor = factor**0.5
    return best


def _scaled(noise: Noise, name: str, by: float) -> Noise:
    value = getattr(noise, name) * by
    if name == "outlier_share":
        value = min(max(value, LEAST_SHARE), MOST_SHARE)
    return replace(noise, **{name: value})


def _score(log: Prepared, noise: Noise) -> float:
    return float(filter_log(log, noise).seen["density"].sum())
