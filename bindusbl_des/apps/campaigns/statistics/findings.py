"""Findings of a campaign in sentences: the best point, AUVs without fixes, and harmful fixes.

A point is judged by each mission's worst AUV, averaged over seeds; it is surely below a limit if
the upper end of its 95 % interval is.  Fixes harm an AUV if its error with fixes exceeds that of
its dead reckoning: a fix of a distant array may be worse than a good inertial system, and a filter
that trusts it moves the estimate away from the truth.
"""

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ....core.scenario import families
from ....core.scenario.part_choice import PartChoice
from ....core.scenario.scenario import Scenario
from ....core.scenario.shipped_settings import FixedGain
from ....support.arrays import Floats
from ....support.wording import counted, decimals, number, plus_minus, significant
from ..experiments.experiment import ExperimentPlan
from ..storage.folder import LIMIT, read_record
from .intervals import (
    CONFIDENCE,
    MOST_NAMED,
    ROUND_OFF,
    Interval,
    Intervals,
    chance,
    discoveries,
    interval,
    intervals,
    listed,
    point_name,
    points_named,
)
from .outcomes import (
    Fleets,
    MissionOutcomes,
    Starved,
    failed_because,
    fleets,
    outcomes,
    starved,
)

NEEDED = ("position_error_m", "imu_error_m", "fixes_delivered")
NAVIGATION = "navigation."
# Harm that is a smaller share of the error without fixes is not told.
RELEVANT = 0.01


@dataclass(frozen=True)
class Tried:
    """A point that differs from another in navigation keys only, and an AUV's mean error there."""

    point: int
    error: float


@dataclass(frozen=True)
class HarmfulFixes:
    """An AUV with a larger error with fixes than by dead reckoning; means over seeds (m).

    `change` is the error with fixes minus that without, paired by seed.  `tried` is the point at
    which other navigation surely improved it, if there is one.
    """

    point: int
    auv: str
    with_fixes: float
    without: float
    change: Interval
    tried: Tried | None = None


@dataclass(frozen=True)
class Harms:
    """AUVs that fixes surely harm, by point; and AUVs harmed in a point's only mission.

    The most harmed points and AUVs come first.
    """

    sure: list[list[HarmfulFixes]]
    once: list[HarmfulFixes]
    missions: int = 0


def harmed(found: Fleets, plan: ExperimentPlan) -> Harms:
    """Return the AUVs that fixes harm.

    At most one in twenty of them is expected to be a chance result, for all AUVs and points tested.
    """
    if not len(found.point):
        return Harms([], [])
    who, error = found.by_seed("position_error_m")
    alone = found.by_seed("imu_error_m")[1] + 0.0 * error  # of the same missions
    with_fixes, without, change = intervals(error), intervals(alone), intervals(error - alone)
    tested = np.flatnonzero((change.count > 1) & ~((change.mean == 0) & (change.half_width == 0)))
    probable = np.array([chance(change.at(row)) for row in tested.tolist()])
    matters = change.mean > RELEVANT * without.mean
    rivals, places = _of_other_navigation(plan), {key: row for row, key in enumerate(who)}

    def harm(row: int, rivals: list[int]) -> HarmfulFixes:
        means = float(with_fixes.mean[row]), float(without.mean[row])
        tried = _tried(places, error, who[row], rivals)
        return HarmfulFixes(who[row][0], f"AUV{who[row][1]}", *means, change.at(row), tried)

    at: dict[int, list[HarmfulFixes]] = {}
    for row in tested[discoveries(probable) & matters[tested]].tolist():
        at.setdefault(who[row][0], []).append(harm(row, rivals[who[row][0]]))
    once = [harm(row, []) for row in np.flatnonzero(matters & (change.count == 1)).tolist()]
    ordered = [sorted(them, key=_worst_first) for them in at.values()]
    return Harms(
        sorted(ordered, key=lambda them: _worst_first(them[0])),
        sorted(once, key=_worst_first),
        len({point for (point, _), count in zip(who, change.count, strict=True) if count == 1}),
    )


def _worst_first(harm: HarmfulFixes) -> float:
    return -harm.change.mean


def _of_other_navigation(plan: ExperimentPlan) -> dict[int, list[int]]:
    """Return for each point those that differ from it in navigation keys only."""
    groups: dict[str, list[int]] = {}
    for place, point in enumerate(plan.points):
        held = [item for item in point.varied.items() if not item[0].startswith(NAVIGATION)]
        groups.setdefault(repr(held), []).append(place)
    return {
        point: [other for other in them if other != point]
        for them in groups.values()
        for point in them
    }


def _tried(
    places: dict[tuple[int, int], int], error: Floats, mine: tuple[int, int], rivals: list[int]
) -> Tried | None:
    """Return the rival with the smallest error of an AUV, if surely smaller, paired by seed."""
    rows = {rival: places[rival, mine[1]] for rival in rivals if (rival, mine[1]) in places}
    own = error[places[mine]]
    gains = {rival: interval((own - error[row]).tolist()) for rival, row in rows.items()}
    limit = (1 - CONFIDENCE) / 2 / max(len(rivals), 1)  # each of many may look better by chance
    better = [
        Tried(rival, interval(error[rows[rival]].tolist()).mean)
        for rival, gain in gains.items()
        if chance(gain) < limit
    ]
    return min(better, key=lambda tried: tried.error, default=None)


ERROR, ERROR_P95 = "worst_position_error_m", "worst_position_error_p95_m"
COLLISIONS = ("collisions", "frame_collisions")
# A point is accurate where every AUV is surely below this (m), unless a plan asks for another.
SUB_METRE = 1.0
# More sentences of one kind than this are counted.
MOST_SAID = 3


@dataclass(frozen=True)
class Findings:
    """Sentences on the best point, accurate points, failed missions, harm by fixes, AUVs without
    fixes, and signals that collided.
    """

    best: str
    sure: str = ""
    failed: str = ""
    harm: tuple[str, ...] = ()
    starved: tuple[str, ...] = ()
    collided: str = ""

    def sentences(self) -> list[str]:
        """Return all of them, the most important first."""
        said = (self.best, self.sure, self.failed, *self.harm, *self.starved, self.collided)
        return [text for text in said if text]


def findings(folder: Path, plan: ExperimentPlan) -> Findings:
    """Return the findings of the missions with a row.

    Accurate points keep the limit of a plan, or else a metre.
    """
    limit_m = float(read_record(folder).get(LIMIT) or SUB_METRE)
    found = outcomes(folder, (ERROR, ERROR_P95, *COLLISIONS), len(plan.points))
    if not found.ok.any():
        count = len(found.ok)
        failed = f": all {count} failed{failed_because(folder)}"
        return Findings(f"No mission has gone well{failed if count else ' yet'}.")
    if np.isnan(found.metrics[ERROR][found.ok]).all():
        return Findings(f"No mission that went well has a {ERROR}.")
    served = fleets(folder, NEEDED)
    everywhere = range(len(plan.points))
    return Findings(
        _best(found, plan),
        _sure(found, plan, limit_m),
        _failed(folder, found),
        tuple(harm_said(harmed(served, plan), plan, everywhere)),
        tuple(starved_said(starved(served), plan, everywhere)),
        _collided(found, plan),
    )


def _failed(folder: Path, found: MissionOutcomes) -> str:
    """Return how many missions failed, and why; empty where none did."""
    failed, ran = int((~found.ok).sum()), counted(len(found.ok), "mission")
    return f"{failed} of {ran} failed{failed_because(folder)}." if failed else ""


def _best(found: MissionOutcomes, plan: ExperimentPlan) -> str:
    """Return the point with the smallest error of the worst AUV, and those as good."""
    known = found.means(ERROR)
    best = int(np.nanargmin(known.mean))
    error, tail = known.at(best), found.means(ERROR_P95).at(best)
    where = point_name(best, plan.points[best].varied)
    begun = f"Smallest error of the worst AUV: {where}," if len(plan.points) > 1 else "Worst AUV:"
    return (
        f"{begun} {plus_minus(error.mean, error.half_width)} m over {counted(error.count, 'seed')} "
        f"({who_is_worst(found.who(best, ERROR))}); 95 % of the time every AUV is below "
        f"{plus_minus(tail.mean, tail.half_width)} m.{_rivals(found.by_seed(ERROR), best)}"
    )


def _rivals(table: Floats, best: int) -> str:
    """Return which points are not surely worse than the best, paired by seed."""
    if len(table) == 1:
        return ""
    found = compared_with_best(table, best)
    if not (found.count[best] > 1):
        return " One seed shows no interval: whether another point is as good is not known."
    is_near = (found.count > 1) & (found.mean - found.half_width <= 0)
    is_same = is_near & (found.mean == 0) & (found.half_width == 0)
    is_near[best] = is_same[best] = False
    same, near = np.flatnonzero(is_same).tolist(), np.flatnonzero(is_near & ~is_same).tolist()
    said = f" Equal in every seed: {points_named(same)}." if same else ""
    if near:
        which = "which is best is partly chance"
        said += f" No difference shown, paired by seed: {points_named(near)}; {which}."
    return said


def compared_with_best(table: Floats, best: int) -> Intervals:
    """Return the differences of points from the one with the least mean, paired by seed.

    `table` (points, seeds) holds values of which less is better.  All intervals hold together
    (Bonferroni), so that the true best point is not surely worse, however many points there are.
    """
    gaps = table - table[best]
    gaps[np.abs(gaps) <= ROUND_OFF * np.abs(table[best])] = 0.0
    return intervals(gaps, together=len(table) - 1)


def who_is_worst(who: Mapping[str, int]) -> str:
    """Return which AUV was the worst, and how often if that varies.

    The argument maps AUVs to numbers of missions, most often first.

    >>> who_is_worst({"AUV0": 3, "AUV2": 1}), who_is_worst({"AUV1": 4})
    ('AUV0 is the worst in 3 of 4 seeds, AUV2 in 1', 'AUV1 is the worst in all')
    """
    first, *others = who.items()
    if not others:
        return f"{first[0]} is the worst" + " in all" * (first[1] > 1)
    rest = "".join(f", {name} in {count}" for name, count in others[:MOST_SAID])
    rest += ", others in the rest" * (len(others) > MOST_SAID)
    return f"{first[0]} is the worst in {first[1]} of {counted(sum(who.values()), 'seed')}{rest}"


def who_lacks(auvs: Mapping[str, int], missions: int) -> str:
    """Return which AUVs lacked something, and in how many seeds.

    >>> who_lacks({"AUV0": 20, "AUV2": 3}, 20), who_lacks({"AUV0": 3, "AUV2": 3}, 3)
    ('AUV0 in 20 and AUV2 in 3 of 20 seeds', 'AUV0 and AUV2 in 3 of 3 seeds')
    """
    counts = set(auvs.values())
    if len(counts) == 1 and len(auvs) <= MOST_NAMED:
        return f"{listed(list(auvs))} in {counts.pop()} of {counted(missions, 'seed')}"
    shown = [f"{auv} in {count}" for auv, count in list(auvs.items())[:MOST_NAMED]]
    if more := len(auvs) - len(shown):
        shown.append(f"{more} more AUVs")
    return f"{listed(shown)} of {counted(missions, 'seed')}"


def _sure(found: MissionOutcomes, plan: ExperimentPlan, limit_m: float) -> str:
    """Return how many points are surely below a limit for every AUV, or the best upper ends."""
    points = len(plan.points)
    if max(found.well) < 2:
        return f"With one seed a point nothing is surely below {limit_m:g} m; run more."
    mean, tail = found.means(ERROR), found.means(ERROR_P95)
    upper = [known.mean + known.half_width for known in (mean, tail)]
    below = [ends < limit_m for ends in upper]
    count, always = int(below[0].sum()), int((below[0] & below[1]).sum())
    ends = "(upper ends of the 95 % intervals)"
    if points == 1:
        most, mostly = (significant(float(bound[0])) for bound in upper)
        return (
            f"Every AUV is surely below {most} m in the mean over time, and below {mostly} m for "
            f"95 % of the time {ends}."
        )
    rest = f", {always or 'none'} of them for 95 % of the time as well" * bool(count)
    ran = found.ran
    without = {
        "no mission that went well": int(np.sum((mean.count == 0) & (ran > 0))),
        "no mission yet": int(np.sum(ran == 0)),
    }
    lacks = "".join(
        f" {n} {'have' if n > 1 else 'has'} {lack}." for lack, n in without.items() if n
    )
    if not count and np.isfinite(upper[0]).any():
        best = int(np.nanargmin(upper[0]))
        rest = f": {point_name(best, plan.points[best].varied)} keeps them below "
        rest += f"{significant(float(upper[0][best]))} m"
    return (
        f"{count or 'None'} of {points} points keep{'s' * (count < 2)} every AUV surely below "
        f"{limit_m:g} m in the mean over time{rest} {ends}.{lacks}"
    )


def _collided(found: MissionOutcomes, plan: ExperimentPlan) -> str:
    """Return the points at which a schedule's signals collided; "" also in random access."""
    met = np.sum([np.nan_to_num(found.metrics[metric]) for metric in COLLISIONS], axis=0)
    scheduled = {
        point: not Scenario.model_validate_json(plan.points[point].scenario).protocol.random_access
        for point in np.unique(found.point[found.ok & (met > 0)]).tolist()
    }
    points = [point for point, is_kept in scheduled.items() if is_kept]
    if not points:
        return ""
    there = found.ok & np.isin(found.point, points)
    where = f" at {points_named(points)}" * (len(plan.points) > 1)
    return (
        f"Signals of the schedule collided in {int((met[there] > 0).sum())} of "
        f"{counted(int(there.sum()), 'mission')}{where}, {significant(met[there].mean())} times a "
        "mission in the mean; `verify` tells why."
    )


def harm_said(harms: Harms, plan: ExperimentPlan, points: Iterable[int]) -> Iterator[str]:
    """Yield sentences on AUVs that fixes harm at some points, the worst first, with remedies."""
    wanted = set(points)
    chosen = [them for them in harms.sure if them[0].point in wanted]
    for them in chosen[:MOST_SAID]:
        yield _harm(them, plan)
    if len(chosen) > MOST_SAID:
        rest = [them[0].point for them in chosen[MOST_SAID:]]
        yield f"Fixes also make AUVs worse at {points_named(sorted(rest))}."
    if chosen:
        yield from _remedies([json.loads(plan.points[them[0].point].scenario) for them in chosen])
    once = [harm for harm in harms.once if harm.point in wanted]
    if once:
        yield _once(once, harms.missions, plan)


def _once(them: list[HarmfulFixes], missions: int, plan: ExperimentPlan) -> str:
    worst, count = them[0], len({harm.point for harm in them})
    place = point_name(worst.point, plan.points[worst.point].varied)
    return (
        f"In {count} of {missions} missions of points with one seed an AUV was worse with fixes "
        f"than without, most {worst.auv} at {place}: {number(worst.with_fixes)} m with, "
        f"{number(worst.without)} m without. One mission may be chance; run more seeds."
    )


def _remedies(scenarios: list[dict[str, Any]]) -> Iterator[str]:
    """Yield remedies against harmful fixes, which were not tried."""
    filters = [PartChoice.read(scenario["navigation"]["filter"], str) for scenario in scenarios]
    gained = [choice for choice in filters if families.NAVIGATOR.declared(choice).has_gain]
    parts = [
        choice.settings_as(FixedGain, families.NAVIGATOR.declared(choice).settings)
        for choice in gained
    ]
    if parts:
        gains = sorted({part.gain for part in parts})
        here = f"{gains[0]:g}" if len(gains) == 1 else f"{gains[0]:g} to {gains[-1]:g}"
        uncompensated = any(part.delay_compensation == "none" for part in parts)
        shift = " navigation.filter.delay_compensation=shift," * uncompensated
        yield (
            f"What may help where fixes harm: a navigation.filter.gain below {here},{shift} or "
            "navigation.filter=kalman, which weighs each fix by its covariance."
        )


def _harm(them: list[HarmfulFixes], plan: ExperimentPlan) -> str:
    worst, place = them[0], point_name(them[0].point, plan.points[them[0].point].varied)
    change = worst.change
    digits = decimals(change.half_width, change.mean)
    most = f", {worst.auv} most" if len(them) > 1 else ""
    said = (
        f"Fixes make {_auvs([harm.auv for harm in them])} worse at {place}{most}: "
        f"{number(worst.with_fixes)} m with, {number(worst.without)} m without"
    )
    said += (
        f", +{change.mean:.{digits}f} m [{change.low:+.{digits}f}, {change.high:+.{digits}f}] "
        f"over {change.count} paired seeds."
    )
    if worst.tried:
        tried = point_name(worst.tried.point, plan.points[worst.tried.point].varied)
        said += f" At {tried} it has {number(worst.tried.error)} m."
    return said


def _auvs(names: list[str]) -> str:
    """Return AUVs by name, many of them by their number."""
    if len(names) > MOST_NAMED:
        return f"{len(names)} AUVs"
    return listed(sorted(names, key=lambda name: int(name.removeprefix("AUV"))))


def starved_said(
    found: list[Starved], plan: ExperimentPlan, points: Iterable[int]
) -> Iterator[str]:
    """Yield sentences on AUVs without fixes at some points, most seeds first."""
    wanted = set(points)
    chosen = [unserved for unserved in found if unserved.point in wanted]
    for unserved in chosen[:MOST_SAID]:
        place = point_name(unserved.point, plan.points[unserved.point].varied)
        yield f"No fix at {place}: {who_lacks(unserved.auvs, unserved.missions)}."
    if len(chosen) > MOST_SAID:
        rest = sorted(unserved.point for unserved in chosen[MOST_SAID:])
        yield f"AUVs got no fix also at {points_named(rest)}."
