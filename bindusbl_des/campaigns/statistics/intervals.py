"""Means with confidence intervals, without scipy."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan, sqrt
from statistics import NormalDist, fmean, stdev

# Student's t for 95 % confidence (two-sided) by degrees of freedom 1, 2, ...; standard tables.
STUDENT_95 = (
    12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160,
    2.145, 2.131, 2.120, 2.110, 2.101, 2.093, 2.086, 2.080, 2.074, 2.069, 2.064, 2.060, 2.056,
    2.052, 2.048, 2.045, 2.042,
)  # fmt: skip
CONFIDENCE = 0.95
NORMAL_95 = NormalDist().inv_cdf((1 + CONFIDENCE) / 2)


@dataclass(frozen=True)
class Interval:
    """A mean, half the width of its 95 % confidence interval (nan for one value), and the count."""

    mean: float
    half_width: float
    count: int


def student_95(freedom: int) -> float:
    """Return Student's t for 95 % confidence.

    >>> student_95(4), round(student_95(120), 3)
    (2.776, 1.98)
    """
    if freedom <= len(STUDENT_95):
        return STUDENT_95[freedom - 1]
    # Cornish-Fisher expansion (Abramowitz and Stegun 26.7.5), right to 0.001 beyond the table.
    z = NORMAL_95
    return z + (z**3 + z) / (4 * freedom) + (5 * z**5 + 16 * z**3 + 3 * z) / (96 * freedom**2)


def interval(values: Sequence[float | None]) -> Interval:
    """Return the mean of the values that are known and how sure it is.

    >>> found = interval([1.0, 2.0, 3.0])
    >>> found.mean, round(found.half_width, 3)
    (2.0, 2.484)
    """
    known = [value for value in values if value is not None and value == value]
    if len(known) < 2:
        return Interval(known[0] if known else nan, nan, len(known))
    half = student_95(len(known) - 1) * stdev(known) / sqrt(len(known))
    return Interval(fmean(known), half, len(known))
