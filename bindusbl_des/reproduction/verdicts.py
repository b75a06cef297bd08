"""Verdicts by rule: does a published number look like one more result of this simulator?

The paper's numbers are means of few runs, or of one.  A number is *reproduced* when it lies, but
for its rounding, in the interval that holds the mean of as many further runs here with 95 %
probability.  It *cannot be* when it lies beyond a limit that follows from the paper's own
equations, and *differs* otherwise.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, sqrt
from statistics import fmean, stdev
from typing import Literal

from ..campaigns.statistics.intervals import student_95
from .published import Published

REPRODUCED, DIFFERS, CANNOT_BE = "reproduced", "differs", "cannot be"

# How a number is meant: as a value, or as a bound that nothing exceeds or falls below.
Claim = Literal["equals", "at most", "at least"]

# What is computed to the last bit may differ from its decimals by this much.
RELATIVE_TOLERANCE = 1e-9


@dataclass(frozen=True)
class Prediction:
    """What further runs would give: the mean of ours and an interval for theirs."""

    mean: float
    low: float
    high: float
    runs: int

    def __str__(self) -> str:
        return f"{self.mean:.3g} [{self.low:.3g}, {self.high:.3g}]"


@dataclass(frozen=True)
class Limit:
    """A limit that the paper's own equations set, and the sentence that derives it."""

    lowest: float
    highest: float
    because: str


def predicted(values: Sequence[float], further_runs: int) -> Prediction:
    """Return where the mean of `further_runs` more runs lies with 95 % probability.

    mean +- t s sqrt(1/n + 1/m) of n runs here and m there; Student's t has n - 1 degrees of
    freedom.

    >>> found = predicted([1.0, 2.0, 3.0], further_runs=1)
    >>> round(found.low, 3), found.mean, round(found.high, 3)
    (-2.969, 2.0, 6.969)

    Raises:
        ValueError: when there are fewer than two runs; one run says nothing of the next.
    """
    known = [float(value) for value in values if isfinite(value)]
    if len(known) < 2:
        raise ValueError(f"an interval needs at least 2 runs; met {len(known)}")
    half = student_95(len(known) - 1) * stdev(known) * sqrt(1 / len(known) + 1 / further_runs)
    mean = fmean(known)
    return Prediction(mean, mean - half, mean + half, len(known))


def agrees(row: Published, prediction: Prediction, claim: Claim = "equals") -> bool:
    """Tell whether a published number is borne out, allowing for its rounding."""
    slack = row.half_digit + RELATIVE_TOLERANCE * abs(row.value)
    if claim == "at most":
        return prediction.mean <= row.value + slack
    if claim == "at least":
        return prediction.mean >= row.value - slack
    return prediction.low - slack <= row.value <= prediction.high + slack


def verdict(
    row: Published,
    prediction: Prediction,
    claim: Claim = "equals",
    limit: Limit | None = None,
) -> str:
    """Return the verdict on a published number."""
    if limit is not None and violates(row, limit):
        return CANNOT_BE
    return REPRODUCED if agrees(row, prediction, claim) else DIFFERS


def violates(row: Published, limit: Limit) -> bool:
    """Tell whether a published number lies beyond a limit even when its rounding is allowed for."""
    slack = row.half_digit
    return row.value - slack > limit.highest or row.value + slack < limit.lowest
