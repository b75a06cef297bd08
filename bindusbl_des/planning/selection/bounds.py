"""How far a mean may be off: standard errors, and a bound that knows of skewed values."""

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from ...campaigns.statistics.intervals import ROUND_OFF

Floats = NDArray[np.float64]

# A skewness that makes no difference
SYMMETRIC = 1e-6


def standard_errors(values: Floats) -> Floats:
    """Return those of the means of columns (k, n); round-off is no spread."""
    errors = values.std(axis=0, ddof=1) / sqrt(len(values))
    return np.where(errors <= ROUND_OFF * np.abs(values).max(axis=0), 0.0, errors)


def upper_bounds(values: Floats, t: float) -> Floats:
    """Return bounds (n,) that the means of columns (k, n) stay below, `t` standard errors above.

    Where values are skewed to the right, as errors are, the mean of few is too low more often than
    too high, and its standard error with it: Student's t would let many pass that are rarely, but
    badly off.  Hall's transformation (1992, J. R. Stat. Soc. B 54:221-228) makes up for that.
    Skewness to the left is not made use of.
    """
    count = len(values)
    errors = standard_errors(values)
    apart = values - values.mean(axis=0)
    variance = (apart**2).mean(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = (apart**3).mean(axis=0) / variance**1.5
    found = np.where(errors > 0, ratio, 0.0) * sqrt(count * (count - 1)) / (count - 2)
    skewness = np.maximum(found, SYMMETRIC)
    most = t / sqrt(count) + skewness / (6 * count)
    factor = 3 / skewness * (1 - np.cbrt(1 - skewness * most))
    return np.asarray(values.mean(axis=0) + factor * sqrt(count) * errors, np.float64)
