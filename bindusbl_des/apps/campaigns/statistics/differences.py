"""Pairs of points to compare, and their differences paired by seed."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from math import nan
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

import numpy as np

from ....core.records.metrics import lower_is_better, of_an_auv
from ....support.plain_yaml import read_yaml
from ....support.wording import counted, did_you_mean, lettered, plain
from ..campaign import Campaign
from ..storage.folder import AS_ASKED, CampaignError
from .intervals import (
    ROUND_OFF,
    Interval,
    interval,
    point_name,
    points_named,
)
from .outcomes import Fleets, MissionOutcomes, failed_because


@dataclass(frozen=True)
class Side:
    """A point of a campaign, its name (the value of the compared key, or the campaign's folder),
    and the letter of it in a comparison, A for the baseline.
    """

    campaign: Campaign
    point: int
    name: str
    label: str


@dataclass(frozen=True)
class Pair:
    """Two points: `other` is compared with `baseline`.

    They differ in `key`, or belong to two campaigns; `held` are the varied keys that they share.
    """

    baseline: Side
    other: Side
    held: Mapping[str, Any]
    key: str = ""


def pairs_within(campaign: Campaign, by: str | None, baseline: str | None) -> Iterator[Pair]:
    """Yield pairs of points that differ in one key only, the baseline's value first.

    Raises:
        ValueError: when there are none; the message says what can be compared.
    """
    key = _key(campaign, by)
    groups: dict[str, dict[str, int]] = {}
    for place, point in enumerate(campaign.plan.points):
        held = {name: value for name, value in point.varied.items() if name != key}
        groups.setdefault(plain(list(held.items())), {})[plain(point.varied[key])] = place
    first = _baseline(campaign, key, baseline)
    values = dict.fromkeys(plain(point.varied[key]) for point in campaign.plan.points)
    labels = {name: lettered(n) for n, name in enumerate(dict.fromkeys((first, *values)))}
    pairs = 0
    for points in groups.values():
        start = points.get(first)
        for value, place in points.items() if start is not None else ():
            if start is not None and place != start:
                pairs += 1
                held = campaign.plan.points[start].varied
                yield Pair(
                    Side(campaign, start, first, labels[first]),
                    Side(campaign, place, value, labels[value]),
                    {name: setting for name, setting in held.items() if name != key},
                    key,
                )
    if not pairs:
        raise CampaignError(
            f"{campaign.folder}: no two points differ in {key} alone, with {key}={first} as the "
            "baseline; vary it in a grid, as in `--vary`"
        )


def _key(campaign: Campaign, by: str | None) -> str:
    """Return the varied key with these last words, or the only varied key.

    Raises:
        CampaignError: when that is not one key.
    """
    keys = list(campaign.plan.columns)
    names = ", ".join(keys)
    if not keys:
        raise CampaignError(
            f"{campaign.folder}: varies nothing, so there is nothing to compare in it; name a "
            "second campaign, or sweep with --vary"
        )
    if by is None:
        if len(keys) == 1:
            return keys[0]
        raise CampaignError(f"{campaign.folder}: say with --by which key to compare: {names}")
    found = [key for key in keys if key == by or key.endswith(f".{by}")]
    if len(found) == 1:
        return found[0]
    hint = did_you_mean(by, keys) or f"; it varies {names}"
    raise CampaignError(f"{campaign.folder}: --by {by}: not a varied key{hint}")


def _baseline(campaign: Campaign, key: str, asked: str | None) -> str:
    """Return the baseline's value: the given one, or the first."""
    values = list(dict.fromkeys(plain(point.varied[key]) for point in campaign.plan.points))
    if asked is None:
        return values[0]
    wanted = plain(read_yaml(asked, "--baseline").data)
    if wanted not in values:
        raise CampaignError(
            f"{campaign.folder}: --baseline {asked}: not a value of {key}; it has "
            f"{', '.join(values)}"
        )
    return wanted


class Chosen(NamedTuple):
    """The one point of a campaign to compare, and its name."""

    point: int
    name: str


def pairs_between(
    one: Campaign,
    other: Campaign,
    label: str = "B",
    chosen: Mapping[Path, Chosen] = MappingProxyType({}),
) -> Iterator[Pair]:
    """Yield pairs of points of two campaigns that vary the same keys to the same values.

    `label` is the letter of the other; the first is A.  A campaign of one point, or with one
    `chosen` (by its folder), is compared with every point of the other.

    Raises:
        CampaignError: when no points match.
    """
    points, others = one.plan.points, other.plan.points
    mine, theirs = chosen.get(one.folder), chosen.get(other.folder)
    numbers = range(len(points)) if mine is None else [mine.point]
    matches = range(len(others)) if theirs is None else [theirs.point]
    alone = len(numbers) == 1 or len(matches) == 1
    if not alone and set(one.plan.columns) != set(other.plan.columns):
        raise CampaignError(
            f"{one.folder} varies {_listed(one)} and {other.folder} {_listed(other)}; campaigns "
            "are compared when they vary the same keys, or when one has a single point"
        )
    pairs = 0
    for place, match in product(numbers, matches):
        varied, twin = points[place].varied, others[match].varied
        if alone or varied == twin:
            pairs += 1
            both = mine is not None and theirs is not None
            held = {} if both else dict(varied if len(matches) == 1 else twin)
            yield Pair(
                Side(one, place, mine.name if mine else str(one.folder), lettered(0)),
                Side(other, match, theirs.name if theirs else str(other.folder), label),
                held,
            )
    if not pairs:
        raise CampaignError(f"{one.folder} and {other.folder} have no point in common")


def _listed(campaign: Campaign) -> str:
    return ", ".join(campaign.plan.columns) or "nothing"


# Differences between two points, paired by seed: with equal seeds both had the same noise.


# The outcomes of each campaign, and of its AUVs, by its folder.
Found = Mapping[Path, MissionOutcomes]
Served = Mapping[Path, Fleets]

# Higher and lower are said of metrics of which neither is better.  Of one pair nothing is shown.
Verdict = Literal[
    "better", "worse", "higher", "lower", "equal", "no difference shown", "not comparable"
]


@dataclass(frozen=True)
class End:
    """One point of a pair: the mean of a metric over the missions that have it.

    Of `missions` in pairs, `whole` have a value for every AUV; `without` counts missions in which
    each AUV has none, `who` missions in which each AUV was the worst.
    """

    mean: float
    missions: int
    whole: int
    without: Mapping[str, int] = field(default_factory=dict)
    who: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class Difference:
    """The difference of a metric between two points, over the seeds at which both have a value.

    `found` is the mean difference with its 95 % interval.  If an AUV of either has no value, means
    compare different AUVs, and there is no verdict.
    """

    pair: Pair
    metric: str
    baseline: End
    other: End
    found: Interval

    @property
    def relative(self) -> float:
        """The mean difference as a share of the baseline's mean; nan if that is zero."""
        return self.found.mean / abs(self.baseline.mean) if self.baseline.mean else nan

    @property
    def missions(self) -> int:
        """The number of seeds with successful missions at both points."""
        return self.baseline.missions

    @property
    def lacks(self) -> bool:
        """Whether an AUV of either point has no value in some mission."""
        return bool(self.baseline.without or self.other.without)

    @property
    def verdict(self) -> Verdict:
        """The verdict by the interval: `better`, `worse`, or no difference shown."""
        if not self.found.count or self.lacks:
            return "not comparable"
        if self.found.count > 1 and self.found.mean == 0 and self.found.half_width == 0:
            return "equal"
        if self.found.count < 2 or self.found.low <= 0 <= self.found.high:
            return "no difference shown"
        more, lower = self.found.mean > 0, lower_is_better(self.metric)
        if lower is None:
            return "higher" if more else "lower"
        return "worse" if more == lower else "better"


def difference(pair: Pair, metric: str, found: Found, served: Served) -> Difference:
    """Return the difference of a metric over the seeds at which both points have a value."""
    sides = (pair.baseline, pair.other)
    own = [found[side.campaign.folder] for side in sides]
    (mine, one), (theirs, two) = (
        them.at(side.point, metric) for them, side in zip(own, sides, strict=True)
    )
    seeds, *rows = np.intersect1d(mine, theirs, assume_unique=True, return_indices=True)
    one, two = one[rows[0]], two[rows[1]]
    lacks = [
        them.unserved_at(side.point, metric)[places]
        for them, side, places in zip(own, sides, rows, strict=True)
    ]
    gaps = two - one
    gaps[np.abs(gaps) <= ROUND_OFF * np.maximum(np.abs(one), np.abs(two))] = 0.0
    known = [~np.isnan(one), ~np.isnan(two)]
    if any(lack.any() for lack in lacks):
        gaps[:] = nan
    else:
        known = [known[0] & known[1]] * 2
    baseline, other = (
        End(
            float(values[has].mean()) if has.any() else nan,
            len(values),
            int((has & ~lack).sum()),
            served[side.campaign.folder].without(side.point, of_an_auv(metric), seeds)
            if lack.any()
            else {},
            them.who(side.point, metric, seeds),
        )
        for them, side, values, has, lack in zip(own, sides, (one, two), known, lacks, strict=True)
    )
    return Difference(pair, metric, baseline, other, interval(gaps.tolist()))


def unpaired(one: Campaign, other: Campaign, pairs: Sequence[Pair]) -> Iterator[str]:
    """Yield the points of two campaigns, or of one, that are in no pair."""
    for campaign, beside in {one.folder: (one, other), other.folder: (other, one)}.values():
        sides = [side for pair in pairs for side in (pair.baseline, pair.other)]
        met = {side.point for side in sides if side.campaign is campaign}
        points = [point for point in range(len(campaign.plan.points)) if point not in met]
        if not points:
            continue
        named = points_named(points)
        if len(points) == 1:
            named = point_name(points[0], campaign.plan.points[points[0]].varied)
        are = "is" if len(points) == 1 else "are"
        if one is not other:
            yield f"{campaign.folder}: {named} {are} left out: {beside.folder} has no equal point"
            continue
        key, first = pairs[0].key, pairs[0].baseline.name
        yield (
            f"{named} {are} left out: no other point differs in {key} alone, with {key}={first} as "
            "the baseline"
        )


def left_out(pairs: Sequence[Pair], found: Found) -> Iterator[str]:
    """Yield what was not compared, and why."""
    sides = {(s.campaign.folder, s.point): s for p in pairs for s in (p.baseline, p.other)}
    failed = sum(found[folder].failed(point) for folder, point in sides)
    if failed:
        why = next(filter(None, (failed_because(folder) for folder, _ in sides)), "")
        missions = counted(failed, "failed mission")
        yield f"{missions} and those they would be paired with are left out{why}"
    for campaign in {side.campaign.folder: side.campaign for side in sides.values()}.values():
        missing = campaign.state().missing
        if missing and campaign.record.get("status") != AS_ASKED:
            yield f"{campaign.folder} is not finished: {missing} missions have no row yet"
    uneven = sum(_seeds(pair.baseline, found) != _seeds(pair.other, found) for pair in pairs)
    if uneven:
        which = f"{uneven} of {len(pairs)} pairs" if len(pairs) > 1 else "the pair"
        yield f"the points of {which} have different seeds; those that both have count"


def _seeds(side: Side, found: Found) -> set[int]:
    return found[side.campaign.folder].seeds(side.point)
