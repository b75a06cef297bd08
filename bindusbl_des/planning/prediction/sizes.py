"""How large errors are whose mean and covariance are known: the mean, and quantiles over time.

The square of a plane Gaussian error is taken for a gamma variable of the same mean and variance
(Satterthwaite 1946), which it is where it is round and has no mean, where it lies along a line, and
where it does not vary at all.
"""

import numpy as np
from numpy.typing import NDArray

from .errors import Errors

Floats = NDArray[np.float64]

# Of a standard normal number: quantiles in the middle of each twentieth, those above a half
QUANTILES = (
    *(0.062706777943, 0.189118426273, 0.318639363964, 0.45376219017, 0.597760126042),
    *(0.75541502636, 0.934589291073, 1.150349380376, 1.439531470938, 1.95996398454),
)
TWENTIETHS = np.array([-it for it in reversed(QUANTILES)] + list(QUANTILES))

# By so much the argument of a quotient of gamma functions is raised before it is expanded.
RAISED = 8


def squares(errors: Errors) -> tuple[Floats, Floats]:
    """Return the mean square (n, k), m2, of errors, and how many of its standard deviations that
    is, squared: infinite where they do not vary.
    """
    x, y = errors.mean[..., 0], errors.mean[..., 1]
    xx, yy, xy = (errors.covariance[..., k] for k in range(3))
    square = x * x + y * y + xx + yy
    varies = 2.0 * (xx * xx + yy * yy + 2.0 * xy * xy)
    varies = varies + 4.0 * (x * x * xx + y * y * yy + 2.0 * x * y * xy)
    sure = varies <= 1e-12 * square * square
    shape = square * square / np.where(sure, 1.0, varies)
    return square, np.where(sure, np.inf, shape)


def mean_size(square: Floats, shape: Floats) -> Floats:
    """Return the mean length of errors (m) by their mean square (m2) and its `shape`."""
    known = np.where(np.isinf(shape), 1.0, shape)
    return np.where(
        np.isinf(shape), np.sqrt(square), np.sqrt(square / known) * gamma_quotient(known)
    )


def gamma_quotient(shape: Floats) -> Floats:
    """Return G(k + 1/2) / G(k) of the gamma function, to 1e-9.

    Source: Abramowitz and Stegun, Handbook of Mathematical Functions, 1964, 6.1.15 and 6.1.47.

    >>> round(float(gamma_quotient(np.array(1.0))), 9), round(float(np.sqrt(np.pi) / 2), 9)
    (0.886226925, 0.886226925)
    """
    quotient = np.ones(np.shape(shape))
    for k in range(RAISED):
        quotient = quotient * (shape + k) / (shape + k + 0.5)
    z = shape + RAISED
    expansion = 1.0 - 1.0 / (8.0 * z) + 1.0 / (128.0 * z**2) + 5.0 / (1024.0 * z**3)
    return np.asarray(quotient * np.sqrt(z) * (expansion - 21.0 / (32768.0 * z**4)))


def sizes_of_all(square: Floats, shape: Floats) -> Floats:
    """Return the lengths (..., 20), m, that errors have in each twentieth of all cases.

    Source: Wilson and Hilferty, Proc. National Academy of Sciences 17, 1931.
    """
    third = 1.0 / (9.0 * shape[..., np.newaxis])
    root = np.maximum(1.0 - third + TWENTIETHS * np.sqrt(third), 0.0)
    return np.sqrt(square[..., np.newaxis] * root**3)


def quantile(values: Floats, share: float) -> Floats:
    """Return a quantile of values (n, m), linear between the two beside it, (n,)."""
    rising = np.sort(values, axis=1)
    place = share * (rising.shape[1] - 1)
    low = min(int(place), rising.shape[1] - 2)
    return np.asarray(rising[:, low] + (place - low) * (rising[:, low + 1] - rising[:, low]))
