"""Differences between two points, paired by seed: with equal seeds both had the same noise."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import nan
from pathlib import Path
from typing import Literal

import numpy as np

from .fleets import Fleets
from .intervals import ROUND_OFF, Floats, Interval, interval
from .judging import lower_is_better, of_an_auv
from .outcomes import Flags, Outcomes, Whole
from .pairing import Pair, Side

# The outcomes of each campaign, and of its AUVs, by its folder.
Found = Mapping[Path, Outcomes]
Served = Mapping[Path, Fleets]

# Higher and lower are said of metrics of which neither is better.  Of one pair nothing is shown.
Verdict = Literal[
    "better", "worse", "higher", "lower", "equal", "no difference shown", "not comparable"
]


@dataclass(frozen=True)
class End:
    """One of two points: the mean of a metric over the missions that have it.

    Of `missions` in pairs, `whole` have a value for every AUV; `without` counts those in which an
    AUV has none, `who` those in which an AUV was the worst.
    """

    mean: float
    missions: int
    whole: int
    without: Mapping[str, int] = field(default_factory=dict)
    who: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class Difference:
    """How one metric differs between two points, over the seeds at which both have a value.

    Where an AUV of either has no value, means compare different AUVs, and nothing is said of them.
    """

    pair: Pair
    metric: str
    baseline: End
    other: End
    found: Interval

    @property
    def low(self) -> float:
        """Lower end of the 95 % interval of the mean difference."""
        return self.found.low

    @property
    def high(self) -> float:
        """Upper end of the 95 % interval of the mean difference."""
        return self.found.high

    @property
    def relative(self) -> float:
        """The mean difference as a share of the baseline's mean, nan where that is zero."""
        return self.found.mean / abs(self.baseline.mean) if self.baseline.mean else nan

    @property
    def missions(self) -> int:
        """How many seeds both points have missions of that went well."""
        return self.baseline.missions

    @property
    def lacks(self) -> bool:
        """Whether an AUV of either has no value in some mission."""
        return bool(self.baseline.without or self.other.without)

    @property
    def verdict(self) -> Verdict:
        """What the interval shows: `better`, `worse`, or that no difference was shown."""
        if not self.found.count or self.lacks:
            return "not comparable"
        if self.found.count > 1 and self.found.mean == 0 and self.found.half_width == 0:
            return "equal"
        if self.found.count < 2 or self.low <= 0 <= self.high:
            return "no difference shown"
        more, lower = self.found.mean > 0, lower_is_better(self.metric)
        if lower is None:
            return "higher" if more else "lower"
        return "worse" if more == lower else "better"


def difference(pair: Pair, metric: str, found: Found, served: Served) -> Difference:
    """Return how a metric differs over the seeds at which both points have a value."""
    (mine, one), (theirs, two) = (_values(side, metric, found) for side in _sides(pair))
    seeds, here, there = np.intersect1d(mine, theirs, assume_unique=True, return_indices=True)
    one, two = one[here], two[there]
    lack = _lack(pair.baseline, metric, seeds, here, found, served)
    their_lack = _lack(pair.other, metric, seeds, there, found, served)
    gaps = two - one
    gaps[np.abs(gaps) <= ROUND_OFF * np.maximum(np.abs(one), np.abs(two))] = 0.0
    known, their_known = ~np.isnan(one), ~np.isnan(two)
    if lack.missions.any() or their_lack.missions.any():
        gaps[:] = nan
    else:
        known = their_known = known & their_known
    names, their_names = (found[s.campaign.folder].who(s.point, metric) for s in _sides(pair))
    baseline = _end(one, known, lack, names)
    other = _end(two, their_known, their_lack, their_names)
    return Difference(pair, metric, baseline, other, interval(gaps.tolist()))


def _sides(pair: Pair) -> tuple[Side, Side]:
    return pair.baseline, pair.other


def _values(side: Side, metric: str, found: Found) -> tuple[Whole, Floats]:
    return found[side.campaign.folder].at(side.point, metric)


@dataclass(frozen=True)
class _Lack:
    """In which missions an AUV has no value, and in how many each AUV has none."""

    missions: Flags
    auvs: Mapping[str, int]


def _lack(
    side: Side, metric: str, seeds: Whole, rows: Whole, found: Found, served: Served
) -> _Lack:
    """Return what AUVs lack in the missions of some seeds, which are those rows of the point."""
    missions = found[side.campaign.folder].unserved_at(side.point, metric)[rows]
    if not missions.any():
        return _Lack(missions, {})
    fleet = served[side.campaign.folder]
    return _Lack(missions, fleet.without(side.point, of_an_auv(metric), seeds))


def _end(values: Floats, known: Flags, lack: _Lack, who: Mapping[str, int]) -> End:
    mean = float(values[known].mean()) if known.any() else nan
    return End(mean, len(values), int((known & ~lack.missions).sum()), lack.auvs, who)


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
