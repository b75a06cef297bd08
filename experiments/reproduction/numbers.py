"""The numbers that the paper publishes, what was measured in their place, and verdicts by rule."""

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from math import sqrt
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from bindusbl_des.apps.campaigns.statistics.intervals import interval

if TYPE_CHECKING:
    import pandas as pd

# The numbers that the paper publishes, as it prints them.


TABLE = Path(__file__).with_name("paper_results.csv")


@dataclass(frozen=True)
class Published:
    """One number of the paper: where it stands, for which mission and vehicle, in which unit.

    `side_m`, `auvs`, `asvs` and `angle_deg` are texts, since the paper also gives numbers for
    ranges of them ("3-10", "all").
    """

    source: str
    side_m: str
    auvs: str
    asvs: str
    angle_deg: str
    auv: str
    quantity: str
    text: str
    unit: str

    @property
    def value(self) -> float:
        """The number itself."""
        return float(self.text)

    @property
    def half_digit(self) -> float:
        """Half a unit of the last printed digit: the number was rounded by no more than that.

        >>> row = Published("tab:x", "140", "3", "1", "0", "AUV0", "coverage", "0.70", "1")
        >>> row.half_digit
        0.005
        """
        decimals = len(self.text.partition(".")[2])
        return float(f"5e-{decimals + 1}")

    @property
    def case(self) -> str:
        """The mission and vehicle in a few words."""
        angle = "" if self.angle_deg == "all" or self.asvs == "1" else f" at {self.angle_deg} deg"
        side = "all sides" if self.side_m == "all" else f"{self.side_m} m"
        return f"{side}, {self.auvs} AUVs, {self.asvs} ASV{'s' * (self.asvs != '1')}{angle}"


@cache
def published() -> tuple[Published, ...]:
    """Return every number of the paper, in the order of the table that lists them."""
    return tuple(_rows())


def _rows() -> Iterator[Published]:
    with open(TABLE, encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            text = row.pop("value")
            yield Published(**row, text=text)


# Verdicts by rule: does a published number look like one more result of this simulator?
#
# The paper's numbers are means of few runs, or of one. A number is *reproduced* when it lies, but
# for its rounding, in the interval that holds the mean of as many further runs here with 95 %
# probability. It *cannot be* when it lies beyond a limit that follows from the paper's own
# equations, and *differs* otherwise.


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
    known = interval(values)
    if known.count < 2:
        raise ValueError(f"an interval needs at least 2 runs; met {known.count}")
    half = known.half_width * sqrt(1 + known.count / further_runs)
    return Prediction(known.mean, known.mean - half, known.mean + half, known.count)


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


# What the paper says in words, what theory says, and whether it holds here.


# The verdicts on what is no sentence of the paper
HOLDS, FAILS = "holds", "fails"


@dataclass(frozen=True)
class Claimed:
    """One sentence, its verdict, the numbers it rests on, and why it is not borne out."""

    sentence: str
    verdict: str
    evidence: str
    why: str = ""


# A published number and what was measured here in its place.


Where = Mapping[str, Any]


@dataclass(frozen=True)
class Other:
    """The same number under another reading of the paper."""

    reading: str
    prediction: Prediction


@dataclass(frozen=True)
class Reason:
    """Why a number may differ: the section of docs/errata.md that shows it, and a sentence."""

    errata: str
    argument: str


@dataclass(frozen=True)
class Measured:
    """One published number, measured in the paper's own words and in its other readings."""

    row: Published
    reading: str
    prediction: Prediction
    reason: Reason
    others: tuple[Other, ...] = ()
    claim: Claim = "equals"
    limit: Limit | None = None

    @property
    def verdict(self) -> str:
        """One of reproduced, differs and cannot be."""
        return verdict(self.row, self.prediction, self.claim, self.limit)

    @property
    def agreeing(self) -> list[str]:
        """The other readings under which the number would be reproduced."""
        return [
            other.reading for other in self.others if agrees(self.row, other.prediction, self.claim)
        ]

    def why(self) -> str:
        """Return why a number is not reproduced, with what was computed; "" where it is."""
        if self.verdict == CANNOT_BE and self.limit:
            return f"{self.limit.because} ({self.reason.errata})"
        if self.verdict == DIFFERS:
            return f"{self.reason.argument} ({self.reason.errata})"
        return ""

    def deviation(self) -> float | None:
        """Return (measured - published) / published, None where nothing was published to be 0."""
        return self.prediction.mean / self.row.value - 1 if self.row.value else None


def chosen(frame: "pd.DataFrame", where: Where) -> "pd.DataFrame":
    """Return the rows of a campaign's table in which keys have given values.

    Raises:
        LookupError: when there is none, as after a key was renamed.
    """
    found = frame
    for key, value in where.items():
        found = found[found[key] == value]
    if found.empty:
        raise LookupError(f"no mission has {dict(where)}")
    return found


def per_seed(frame: "pd.DataFrame", column: str, where: Where) -> list[float]:
    """Return a metric for each seed, averaged over whatever else the rows differ in."""
    means = chosen(frame, where).groupby("seed")[column].mean()
    return [float(value) for value in means]
