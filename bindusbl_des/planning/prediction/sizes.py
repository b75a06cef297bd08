"""How large errors are whose mean and covariance are known: the mean, and quantiles over time.

The square of a plane Gaussian error is taken for a gamma variable of the same mean and variance
(Satterthwaite 1946), which it is where it is round and has no mean, where it lies along a line, and
where it does not vary at all.
"""

import numpy as np
from numpy.typing import NDArray

from .march.errors import Errors

Floats = NDArray[np.float64]

# Of a standard normal number: quantiles in the middle of each twentieth, those above a half
QUANTILES = (
    *(0.062706777943, 0.189118426273, 0.318639363964, 0.45376219017, 0.597760126042),
    *(0.75541502636, 0.934589291073, 1.150349380376, 1.439531470938, 1.95996398454),
)
TWENTIETHS = np.array([-it for it in reversed(QUANTILES)] + list(QUANTILES))

# By so much the argument of a quotient of gamma functions is raised before it is expanded.
RAISED = 8


def squares(mean: Floats, covariance: Floats) -> tuple[Floats, Floats]:
    """Return the mean square (...), m2, of errors with a mean (..., 2), m, and a covariance xx, yy,
    xy (..., 3), m2, and how many of its standard deviations that is, squared: infinite where they
    do not vary.
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
    """Return the mean length of errors (m) by their mean square (m2) and its `shape`."""
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
    """Return the lengths (..., 20), m, that errors have in each twentieth of all cases.

    Source: Wilson and Hilferty, Proc. National Academy of Sciences 17, 1931.
    """
    third = 1.0 / (9.0 * shape[..., np.newaxis])
    root = np.maximum(1.0 - third + TWENTIETHS * np.sqrt(third), 0.0)
    return np.asarray(np.sqrt(square[..., np.newaxis] * root * root * root))


def quantile(values: Floats, share: float) -> Floats:
    """Return a quantile of values (n, m), linear between the two beside it, (n,)."""
    rising = np.sort(values, axis=1)
    place = share * (rising.shape[1] - 1)
    low = min(int(place), rising.shape[1] - 2)
    return np.asarray(rising[:, low] + (place - low) * (rising[:, low + 1] - rising[:, low]))


def scatter(errors: Errors, square: Floats, size: Floats) -> Floats:
    """Return the standard deviations (n,) of the mean length over one mission, as shares of it.

    `square` (m2) and `size` (m), (n, k), are the mean square and mean length of errors.  Lengths
    are taken to be as much alike as their squares; the variance of a mean over time is the mean
    over all pairs of instants, of which those with the first of the two at one of a few stand for
    all.
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
    """Return the expected largest of independent numbers (n,) that each scatter by a share (n,).

    They are taken for gamma variables, each for its twenty values that are as likely.
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
