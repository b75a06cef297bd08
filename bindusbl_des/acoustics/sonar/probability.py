"""The normal distribution and Marcum's Q, vectorised."""

import math
from statistics import NormalDist

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

_erfc = np.frompyfunc(math.erfc, 1, 1)


def normal_cdf(value: ArrayLike) -> Floats:
    """Return Phi, the probability that a standard normal number lies below a value.

    >>> float(normal_cdf(0.0))
    0.5
    """
    tails = _erfc(-np.asarray(value, dtype=float) / math.sqrt(2.0))
    return 0.5 * np.asarray(tails, dtype=float)


def normal_quantile(chance: float) -> float:
    """Return the value below which a standard normal number lies with a probability in (0, 1)."""
    return NormalDist().inv_cdf(chance)


def poisson_at_least(mean: ArrayLike, other: float) -> Floats:
    """Return the probability that a Poisson number of a mean is at least another's of mean `other`.

    That is Marcum's Q1(sqrt(2 mean), sqrt(2 other)), within 1e-13: of the two numbers' joint
    distribution only as much is summed as the second ever reaches.  Source: J. I. Marcum, IRE
    Trans. Inf. Theory 6, 59 (1960); the sum is that of the non-central chi-square distribution.

    >>> round(float(poisson_at_least(10.0, -math.log(1e-4))), 9)
    0.616135849
    """
    first = np.asarray(mean, dtype=float)
    exactly, whole = np.exp(-first), math.exp(-other)
    above = 1.0 - whole
    below = exactly * above
    for number in range(1, _most(other)):
        exactly = exactly * first / number
        whole *= other / number
        above = max(above - whole, 0.0)
        below = below + exactly * above
    return np.asarray(np.maximum(1.0 - below, 0.0))


def _most(mean: float) -> int:
    """Return a number that a Poisson number of a mean exceeds less often than 1e-16."""
    return math.ceil(mean + 10.0 * math.sqrt(mean) + 25.0)
