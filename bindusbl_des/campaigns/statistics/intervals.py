"""Means with confidence intervals, without scipy."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import atan, cos, inf, nan, pi, sin, sqrt, tan
from statistics import NormalDist, fmean

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import Floats

# Student's t for 95 % confidence (two-sided) by degrees of freedom 1, 2, ...; standard tables.
STUDENT_95 = (
    12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160,
    2.145, 2.131, 2.120, 2.110, 2.101, 2.093, 2.086, 2.080, 2.074, 2.069, 2.064, 2.060, 2.056,
    2.052, 2.048, 2.045, 2.042,
)  # fmt: skip
CONFIDENCE = 0.95
NORMAL_95 = NormalDist().inv_cdf((1 + CONFIDENCE) / 2)

# Numbers that differ by less than this share of their size differ by how they were rounded.
ROUND_OFF = 1e-9


@dataclass(frozen=True)
class Interval:
    """A mean, half the width of its 95 % confidence interval (nan for one value), and the count."""

    mean: float
    half_width: float
    count: int

    @property
    def low(self) -> float:
        """Lower end, nan where one value tells of no spread."""
        return self.mean - self.half_width

    @property
    def high(self) -> float:
        """Upper end, nan where one value tells of no spread."""
        return self.mean + self.half_width


@dataclass(frozen=True)
class Intervals:
    """Means of many points, half their 95 % intervals (nan for one value), and the counts."""

    mean: Floats
    half_width: Floats
    count: NDArray[np.int64]

    def at(self, point: int) -> Interval:
        """Return the interval of one point."""
        return Interval(
            float(self.mean[point]), float(self.half_width[point]), int(self.count[point])
        )


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
    """Return the mean of the values that are known and how sure it is; round-off is no spread.

    >>> found = interval([1.0, 2.0, 3.0])
    >>> found.mean, round(found.half_width, 3)
    (2.0, 2.484)
    >>> interval([0.1 + 0.2, 0.3]).half_width
    0.0
    """
    known = np.array(values, dtype=float)  # None becomes nan
    known = known[~np.isnan(known)]
    count = len(known)
    if count < 2:
        return Interval(float(known[0]) if count else nan, nan, count)
    mean = fmean(known.tolist())
    half = student_95(count - 1) * float(np.std(known, ddof=1)) / sqrt(count)
    is_round_off = half <= ROUND_OFF * float(np.abs(known).max())
    return Interval(mean, 0.0 if is_round_off else half, count)


def intervals(values: Floats, together: int = 1) -> Intervals:
    """Return the same of each row (n, k); nan is not known, and not counted.

    Each is one of so many that hold `together` with 95 %.

    >>> intervals(np.array([[1.0, 2.0, 3.0, np.nan]])).at(0).count
    3
    """
    known = ~np.isnan(values)
    count, filled = known.sum(axis=1), np.where(known, values, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = filled.sum(axis=1) / count
        square = np.where(known, (filled - mean[:, None]) ** 2, 0.0).sum(axis=1)
        half = _student(count, together) * np.sqrt(square / (count - 1) / count)
    largest = np.abs(filled).max(axis=1, initial=0.0)
    return Intervals(mean, np.where(half <= ROUND_OFF * largest, 0.0, half), count)


def _student(count: NDArray[np.int64], together: int) -> Floats:
    """Return Student's t for means of so many values each, nan for fewer than two."""
    confidence, table = 1 - (1 - CONFIDENCE) / together, np.full(int(count.max(initial=2)) + 1, nan)
    for number in np.unique(count[count > 1]).tolist():
        freedom = number - 1
        table[number] = student_95(freedom) if together == 1 else student(freedom, confidence)
    return table[count]


def chance(it: Interval) -> float:
    """Return how probable a mean as far above zero as this would be by chance alone (one-sided).

    nan for fewer than two values.

    >>> round(chance(interval([1.0, 2.0, 3.0])), 3), chance(interval([-1.0, 1.0]))
    (0.037, 0.5)
    """
    if it.count < 2:
        return nan
    freedom = it.count - 1
    error = it.half_width / student_95(freedom)
    t = it.mean / error if error else inf * it.mean if it.mean else 0.0
    within = _within(abs(atan(t / sqrt(freedom))), freedom)
    return (1 - within) / 2 if t > 0 else (1 + within) / 2


@lru_cache(maxsize=1024)
def student(freedom: int, confidence: float) -> float:
    """Return Student's t for any confidence (two-sided) and whole degrees of freedom.

    The probability within +-t is a finite sum of powers of cos(atan(t / sqrt(freedom)))
    (Abramowitz and Stegun 26.7.3, 26.7.4); t is found by bisection of that angle.

    >>> round(student(4, 0.95), 3), round(student(9, 0.99), 3), round(student(1, 0.9), 3)
    (2.776, 3.25, 6.314)
    """
    low, high = 0.0, pi / 2
    for _ in range(60):
        angle = (low + high) / 2
        low, high = (angle, high) if _within(angle, freedom) < confidence else (low, angle)
    return tan(low) * sqrt(freedom)


def _within(angle: float, freedom: int) -> float:
    """Return the probability of Student's t within +-sqrt(freedom) tan(angle).

    It is a finite sum of powers of the cosine (Abramowitz and Stegun 26.7.3, 26.7.4).
    """
    odd = freedom % 2
    first = 0.0 if freedom == 1 else (cos(angle) if odd else 1.0)
    k = np.arange(2 + odd, freedom, 2)
    terms = np.cumprod(np.concatenate(([first], cos(angle) ** 2 * (k - 1) / k)))
    total = float(np.cumsum(terms)[-1])
    return 2 / pi * (angle + sin(angle) * total) if odd else sin(angle) * total


def discoveries(chances: Floats) -> NDArray[np.bool_]:
    """Tell which of many findings to believe, so that one in twenty of them is wrong at most.

    `chances` (n,) is how probable each would be by chance alone; nan was not tested.  Benjamini and
    Hochberg (1995): of the k smallest the largest must be below 5 % k / n.

    >>> discoveries(np.array([0.001, 0.03, 0.04, 0.9, nan])).tolist()
    [True, False, False, False, False]
    """
    known = np.sort(chances[~np.isnan(chances)])
    allowed = (1 - CONFIDENCE) * np.arange(1, len(known) + 1) / max(len(known), 1)
    passing = known[known <= allowed]
    return chances <= passing[-1] if len(passing) else np.zeros(len(chances), bool)
