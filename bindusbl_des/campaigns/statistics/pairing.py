"""Which points of campaigns are compared with which."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from ...core.wording import did_you_mean, lettered, plain
from ...scenario.files.plain_yaml import read_yaml
from ..campaign import Campaign
from ..storage.folder import CampaignError


@dataclass(frozen=True)
class Side:
    """A point of a campaign: its value of the key that is compared, or its campaign's folder, and
    the letter by which that is called in a comparison, A for the baseline.
    """

    campaign: Campaign
    point: int
    name: str
    label: str


@dataclass(frozen=True)
class Pair:
    """Two points: `other` is compared with `baseline`.  They differ in `key`, or else are of two
    campaigns; `held` are the varied keys in which they are alike."""

    baseline: Side
    other: Side
    held: Mapping[str, Any]
    key: str = ""


def pairs_within(campaign: Campaign, by: str | None, baseline: str | None) -> Iterator[Pair]:
    """Yield pairs of points that differ in one key only, each with the baseline's value first.

    Raises:
        ValueError: when there are none; the message says what can be compared.
    """
    key = _key(campaign, by)
    groups: dict[str, dict[str, int]] = {}
    for number, point in enumerate(campaign.plan.points):
        held = {name: value for name, value in point.varied.items() if name != key}
        groups.setdefault(plain(list(held.items())), {})[plain(point.varied[key])] = number
    first = _baseline(campaign, key, baseline)
    values = dict.fromkeys(plain(point.varied[key]) for point in campaign.plan.points)
    labels = {name: lettered(n) for n, name in enumerate(dict.fromkeys((first, *values)))}
    pairs = 0
    for points in groups.values():
        start = points.get(first)
        for value, number in points.items() if start is not None else ():
            if start is not None and number != start:
                pairs += 1
                held = campaign.plan.points[start].varied
                yield Pair(
                    Side(campaign, start, first, labels[first]),
                    Side(campaign, number, value, labels[value]),
                    {name: it for name, it in held.items() if name != key},
                    key,
                )
    if not pairs:
        raise CampaignError(
            f"{campaign.folder}: no two points differ in {key} alone, with {key}={first} as the "
            "baseline; vary it in a grid, as in `--vary`"
        )


def _key(campaign: Campaign, by: str | None) -> str:
    """Return the varied key that is meant by its last words, or the only one there is.

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
    """Return the value to compare with: the one asked for, or the first."""
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


def pairs_between(one: Campaign, other: Campaign, label: str = "B") -> Iterator[Pair]:
    """Yield pairs of points of two campaigns that vary the same keys to the same values; the other
    is called by a letter, the first A.

    A campaign of one point is compared with every point of the other.

    Raises:
        CampaignError: when no points match.
    """
    points, others = one.plan.points, other.plan.points
    alone = len(points) == 1 or len(others) == 1
    if not alone and set(one.plan.columns) != set(other.plan.columns):
        raise CampaignError(
            f"{one.folder} varies {_listed(one)} and {other.folder} {_listed(other)}; campaigns "
            "are compared when they vary the same keys, or when one has a single point"
        )
    pairs = 0
    for number, point in enumerate(points):
        for match, twin in enumerate(others):
            if alone or point.varied == twin.varied:
                pairs += 1
                held = dict((point if len(others) == 1 else twin).varied)
                yield Pair(
                    Side(one, number, str(one.folder), lettered(0)),
                    Side(other, match, str(other.folder), label),
                    held,
                )
    if not pairs:
        raise CampaignError(f"{one.folder} and {other.folder} have no point in common")


def _listed(campaign: Campaign) -> str:
    return ", ".join(campaign.plan.columns) or "nothing"
