"""A published number and what was measured here in its place."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..published import Published
from ..verdicts import CANNOT_BE, DIFFERS, Claim, Limit, Prediction, agrees, verdict

if TYPE_CHECKING:
    import pandas as pd

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
