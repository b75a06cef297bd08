"""Differences between two points, paired by seed: with equal seeds both had the same noise."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import nan
from pathlib import Path
from typing import Literal

import numpy as np

from .intervals import Interval, interval
from .outcomes import Floats, Outcomes, Whole
from .pairing import Pair, Side

# The outcomes of each campaign, by its folder.
Found = Mapping[Path, Outcomes]

Verdict = Literal["better", "worse", "higher", "lower", "same", "not shown", "no pairs", "one pair"]

# Metrics of which one knows which way is better; the rest are higher or lower.
LOWER_IS_BETTER = ("error", "latency", "interval", "collisions", "lost", "saturated")
HIGHER_IS_BETTER = ("fix_rate_hz", "fixes_delivered", "hf_coverage", "pings_heard")


@dataclass(frozen=True)
class Difference:
    """How one metric differs between two points: means over the seeds that both have."""

    pair: Pair
    metric: str
    baseline: float
    other: float
    found: Interval

    @property
    def low(self) -> float:
        """Lower end of the 95 % interval of the mean difference."""
        return self.found.mean - self.found.half_width

    @property
    def high(self) -> float:
        """Upper end of the 95 % interval of the mean difference."""
        return self.found.mean + self.found.half_width

    @property
    def relative(self) -> float:
        """The mean difference as a share of the baseline's mean, nan where that is zero."""
        return self.found.mean / abs(self.baseline) if self.baseline else nan

    @property
    def verdict(self) -> Verdict:
        """What the interval shows: `better`, `worse`, or that no difference was shown."""
        if self.found.count < 2:
            return "one pair" if self.found.count else "no pairs"
        if self.found.mean == 0 and self.found.half_width == 0:
            return "same"
        if self.low <= 0 <= self.high:
            return "not shown"
        more = self.found.mean > 0
        if any(word in self.metric for word in LOWER_IS_BETTER):
            return "worse" if more else "better"
        if self.metric in HIGHER_IS_BETTER:
            return "better" if more else "worse"
        return "higher" if more else "lower"


def difference(pair: Pair, metric: str, found: Found) -> Difference:
    """Return how a metric differs over the seeds at which both points have a value."""
    seeds, values = _known(pair.baseline, metric, found)
    others, their_values = _known(pair.other, metric, found)
    _, mine, theirs = np.intersect1d(seeds, others, assume_unique=True, return_indices=True)
    one, two = values[mine], their_values[theirs]
    return Difference(pair, metric, _mean(one), _mean(two), interval((two - one).tolist()))


def _mean(values: Floats) -> float:
    return float(values.mean()) if len(values) else nan


def _known(side: Side, metric: str, found: Found) -> tuple[Whole, Floats]:
    seeds, values = found[side.campaign.folder].at(side.point, metric)
    there = ~np.isnan(values)
    return seeds[there], values[there]


def left_out(pairs: Sequence[Pair], found: Found) -> Iterator[str]:
    """Yield what was not compared, and why."""
    sides = {(s.campaign.folder, s.point): s for p in pairs for s in (p.baseline, p.other)}
    failed = sum(found[folder].failed(point) for folder, point in sides)
    if failed:
        yield f"failed missions are left out ({failed}), and those they would be paired with"
    for campaign in {side.campaign.folder: side.campaign for side in sides.values()}.values():
        missing = campaign.state().missing
        if missing:
            yield f"{campaign.folder} is not finished: {missing} missions have no row yet"
    uneven = sum(_seeds(pair.baseline, found) != _seeds(pair.other, found) for pair in pairs)
    if uneven:
        which = f"{uneven} of {len(pairs)} pairs" if len(pairs) > 1 else "the pair"
        yield f"the points of {which} have different seeds; those that both have count"


def _seeds(side: Side, found: Found) -> set[int]:
    return found[side.campaign.folder].seeds(side.point)
