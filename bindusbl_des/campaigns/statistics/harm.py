"""Whom fixes make worse: an AUV's error with its fixes beside that of its dead reckoning alone.

A fix of an acoustic array far away is worth less than the dead reckoning of a good inertial system;
a filter that trusts it all the same moves the estimate away from the truth.
"""

from dataclasses import dataclass

import numpy as np

from ..experiments.plan import Plan
from .fleets import Fleets
from .intervals import CONFIDENCE, Floats, Interval, chance, discoveries, interval, intervals

NEEDED = ("position_error_m", "imu_error_m", "fixes_delivered")
NAVIGATION = "navigation."
# Harm that is a smaller share of the error without fixes is nobody's concern.
RELEVANT = 0.01


@dataclass(frozen=True)
class Tried:
    """A point that differs from another in its navigation alone, and an AUV's mean error there."""

    point: int
    error: float


@dataclass(frozen=True)
class Harm:
    """An AUV that navigates worse with fixes than by dead reckoning alone; means over seeds, m.

    `change` is the error with fixes minus that without, paired by seed.  `tried` is the point at
    which other navigation made it surely better, if the campaign has one.
    """

    point: int
    auv: str
    with_fixes: float
    without: float
    change: Interval
    tried: Tried | None = None


@dataclass(frozen=True)
class Harms:
    """Whom fixes surely make worse, a list per point, and who was worse in a point's one mission.

    The most harmed points and AUVs come first.
    """

    sure: list[list[Harm]]
    once: list[Harm]
    missions: int = 0


def harmed(found: Fleets, plan: Plan) -> Harms:
    """Return whom fixes make worse.

    That is sure where chance would rarely do it, counting how many AUVs and points were looked at,
    so that of all that is said one in twenty is wrong at most.
    """
    if not len(found.point):
        return Harms([], [])
    who, error = found.by_seed("position_error_m")
    alone = found.by_seed("imu_error_m")[1] + 0.0 * error  # of the same missions
    with_fixes, without, change = intervals(error), intervals(alone), intervals(error - alone)
    tested = np.flatnonzero((change.count > 1) & ~((change.mean == 0) & (change.half_width == 0)))
    probable = np.array([chance(change.at(row)) for row in tested.tolist()])
    matters = change.mean > RELEVANT * without.mean
    rivals, places = _rivals(plan), {key: row for row, key in enumerate(who)}

    def harm(row: int, rivals: list[int]) -> Harm:
        means = float(with_fixes.mean[row]), float(without.mean[row])
        tried = _tried(places, error, who[row], rivals)
        return Harm(who[row][0], f"AUV{who[row][1]}", *means, change.at(row), tried)

    at: dict[int, list[Harm]] = {}
    for row in tested[discoveries(probable) & matters[tested]].tolist():
        at.setdefault(who[row][0], []).append(harm(row, rivals[who[row][0]]))
    once = [harm(row, []) for row in np.flatnonzero(matters & (change.count == 1)).tolist()]
    ordered = [sorted(them, key=_worst_first) for them in at.values()]
    return Harms(
        sorted(ordered, key=lambda them: _worst_first(them[0])),
        sorted(once, key=_worst_first),
        len({point for (point, _), count in zip(who, change.count, strict=True) if count == 1}),
    )


def _worst_first(harm: Harm) -> float:
    return -harm.change.mean


def _rivals(plan: Plan) -> dict[int, list[int]]:
    """Return of each point those that differ from it in keys of the navigation alone."""
    groups: dict[str, list[int]] = {}
    for number, point in enumerate(plan.points):
        held = [it for it in point.varied.items() if not it[0].startswith(NAVIGATION)]
        groups.setdefault(repr(held), []).append(number)
    return {point: [it for it in them if it != point] for them in groups.values() for point in them}


def _tried(
    places: dict[tuple[int, int], int], error: Floats, mine: tuple[int, int], rivals: list[int]
) -> Tried | None:
    """Return the rival with the smallest error of an AUV that is surely smaller, paired by seed."""
    rows = {it: places[it, mine[1]] for it in rivals if (it, mine[1]) in places}
    own = error[places[mine]]
    gains = {it: interval((own - error[row]).tolist()) for it, row in rows.items()}
    limit = (1 - CONFIDENCE) / 2 / max(len(rivals), 1)  # each of many may look better by chance
    better = [
        Tried(it, interval(error[rows[it]].tolist()).mean)
        for it, gain in gains.items()
        if chance(gain) < limit
    ]
    return min(better, key=lambda it: it.error, default=None)
