"""Means with confidence intervals of missions, paired differences and a plan's candidates, without
scipy; and names of points.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import atan, cos, inf, nan, pi, sin, sqrt, tan
from statistics import NormalDist
from typing import Any

import numpy as np

from ....support.arrays import Flags, Floats, Ints
from ....support.wording import ROUND_OFF as ROUND_OFF

# Student's t for 95 % confidence (two-sided) by degrees of freedom 1, 2, ...; standard tables.
STUDENT_95 = (
    12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160,
    2.145, 2.131, 2.120, 2.110, 2.101, 2.093, 2.086, 2.080, 2.074, 2.069, 2.064, 2.060, 2.056,
    2.052, 2.048, 2.045, 2.042,
)  # fmt: skip
CONFIDENCE = 0.95
NORMAL_95 = NormalDist().inv_cdf((1 + CONFIDENCE) / 2)

# More values than this are named in a sentence by the first few.
MOST_NAMED = 6


@dataclass(frozen=True)
class Interval:
    """A mean, half the width of its 95 % interval, its standard error (both nan for a single
    value), and the number of values.
    """

    mean: float
    half_width: float
    error: float
    count: int

    @property
    def low(self) -> float:
        """The lower end; nan for a single value."""
        return self.mean - self.half_width

    @property
    def high(self) -> float:
        """The upper end; nan for a single value."""
        return self.mean + self.half_width


@dataclass(frozen=True)
class Intervals:
    """Intervals of many points, in arrays."""

    mean: Floats
    half_width: Floats
    error: Floats
    count: Ints

    def at(self, point: int) -> Interval:
        """Return the interval of one point."""
        mean, half, error = (float(own[point]) for own in (self.mean, self.half_width, self.error))
        return Interval(mean, half, error, int(self.count[point]))


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
    """Return the interval of the known values; equal values but for rounding have no spread.

    >>> found = interval([1.0, 2.0, 3.0])
    >>> found.mean, round(found.half_width, 3)
    (2.0, 2.484)
    >>> interval([0.1 + 0.2, 0.3]).half_width
    0.0
    """
    return intervals(np.array([values], dtype=float)).at(0)  # None becomes nan


def intervals(values: Floats, together: int = 1) -> Intervals:
    """Return the interval of each row (n, k), without its nan values.

    All of `together` such intervals hold with 95 % confidence (Bonferroni).

    >>> intervals(np.array([[1.0, 2.0, 3.0, np.nan]])).at(0).count
    3
    """
    known = ~np.isnan(values)
    count, filled = known.sum(axis=1), np.where(known, values, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = filled.sum(axis=1) / count
        square = np.where(known, (filled - mean[:, None]) ** 2, 0.0).sum(axis=1)
        error = np.where(count > 1, np.sqrt(square / (count - 1) / count), nan)
    half = _student(count, together) * error
    exact = half <= ROUND_OFF * np.abs(filled).max(axis=1, initial=0.0)
    half, error = (np.where(exact, 0.0, width) for width in (half, error))
    return Intervals(mean, half, error, count)


def _student(count: Ints, together: int) -> Floats:
    """Return Student's t for means of this many values, nan for fewer than two."""
    confidence, table = 1 - (1 - CONFIDENCE) / together, np.full(int(count.max(initial=2)) + 1, nan)
    for number in np.unique(count[count > 1]).tolist():
        freedom = number - 1
        table[number] = student_95(freedom) if together == 1 else student(freedom, confidence)
    return table[count]


def chance(estimate: Interval) -> float:
    """Return the one-sided probability of a mean this far above zero by chance alone.

    >>> round(chance(interval([1.0, 2.0, 3.0])), 3), chance(interval([-1.0, 1.0]))
    (0.037, 0.5)
    """
    if estimate.count < 2:
        return nan
    freedom, error = estimate.count - 1, estimate.error
    t = estimate.mean / error if error else inf * estimate.mean if estimate.mean else 0.0
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


def discoveries(chances: Floats) -> Flags:
    """Tell which of many findings to report, so that at most one in twenty is expected to be wrong.

    `chances` (n,) are their probabilities by chance alone; nan was not tested.  Benjamini and
    Hochberg (1995): of the k smallest the largest must be below 5 % k / n.

    >>> discoveries(np.array([0.001, 0.03, 0.04, 0.9, nan])).tolist()
    [True, False, False, False, False]
    """
    known = np.sort(chances[~np.isnan(chances)])
    allowed = (1 - CONFIDENCE) * np.arange(1, len(known) + 1) / max(len(known), 1)
    passing = known[known <= allowed]
    return chances <= passing[-1] if len(passing) else np.zeros(len(chances), bool)


def short_key(key: str, keys: Sequence[str]) -> str:
    """Return the last words of a key that distinguish it from the others.

    >>> short_key("asvs.count", ["asvs.count"]), short_key("a.count", ["a.count", "b.count"])
    ('count', 'a.count')
    """
    words = key.split(".")
    for length in range(1, len(words)):
        tail = ".".join(words[-length:])
        if sum(other == tail or other.endswith(f".{tail}") for other in keys) == 1:
            return tail
    return key


def short_names(keys: Sequence[str]) -> dict[str, str]:
    """Return each key with its short name, which says what is counted.

    >>> short_names(["asvs.count", "acoustics.hf.range_m"])
    {'asvs.count': 'asvs.count', 'acoustics.hf.range_m': 'range_m'}
    """
    names = {key: short_key(key, keys) for key in keys}
    return {key: key if name == "count" else name for key, name in names.items()}


def written(value: Any) -> str:
    """Return one value of a key as text, numbers to six digits.

    >>> written(70.0), written(99.55962284528422), written("dsatur"), written([0, None])
    ('70', '99.5596', 'dsatur', '[0, null]')
    """
    if isinstance(value, int | float) and not isinstance(value, bool):
        return f"{value:.6g}"
    return value if isinstance(value, str) else json.dumps(value)


def point_name(point: int, varied: Mapping[str, Any]) -> str:
    """Return a point's number with its varied values.

    >>> point_name(3, {"asvs.count": 2, "navigation.filter.gain": 0.9})
    'point 3 (asvs.count=2, gain=0.9)'
    """
    names = short_names(list(varied))
    set_to = ", ".join(f"{names[key]}={written(value)}" for key, value in varied.items())
    return f"point {point} ({set_to})" if set_to else f"point {point}"


def points_named(points: Sequence[int]) -> str:
    """Return several points by their numbers, the first few of many.

    >>> points_named([1, 4, 5]), points_named(range(9))
    ('points 1, 4 and 5', 'points 0, 1, 2, 3, 4, 5 and 3 more')
    """
    if len(points) == 1:
        return f"point {points[0]}"
    if len(points) > MOST_NAMED:
        shown = ", ".join(map(str, points[:MOST_NAMED]))
        return f"points {shown} and {len(points) - MOST_NAMED} more"
    return "points " + listed([str(point) for point in points])


def listed(words: Sequence[str]) -> str:
    """Return words as an enumeration.

    >>> listed(["AUV0"]), listed(["AUV0", "AUV1", "AUV2"])
    ('AUV0', 'AUV0, AUV1 and AUV2')
    """
    return " and ".join(part for part in (", ".join(words[:-1]), words[-1]) if part)
