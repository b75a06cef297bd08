"""Which candidates are worth flying: none is left out that a prediction's error could hide; the
keys that put a team in its places; and whether more ASVs than were tried would meet the goals.
"""

import math
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from ...advice.stations import Ways
from ...core.wording import counted
from ...scenario.sections.vehicles import Formation
from ..question import Question
from ..selection.goals import Floats, Goal
from .candidates import COUNT, FORMATION, Candidate, Foresight, Keys, candidate, doubt_of, excess


@dataclass(frozen=True)
class LeftOut:
    """Candidates that are not flown, and why."""

    told: str
    candidates: tuple[Candidate, ...]


@dataclass(frozen=True)
class _Range:
    """How far a candidate is from its goals (`excess`, a logarithm): in 99 of 100 from `low` to
    `high`.
    """

    low: float
    high: float


def narrowed(
    candidates: Sequence[Candidate], foresight: Foresight, goals: Sequence[Goal]
) -> tuple[list[Candidate], list[LeftOut]]:
    """Return the candidates to fly, the cheapest first, and those that are left out, with reasons.

    Left out is what misses a goal even if it is predicted as wrongly as one in a hundred is, and
    what is worse than another of the same cost even if both are.  The best of each cost is flown in
    any case, and so is what cannot be predicted.
    """
    ranges = {it: _range(it, foresight, goals) for it in candidates}
    by_cost: dict[float, list[Candidate]] = defaultdict(list)
    for it in candidates:
        by_cost[it.cost].append(it)
    flown: list[Candidate] = []
    hopeless: list[Candidate] = []
    outdone: list[Candidate] = []
    for _, equals in sorted(by_cost.items()):
        ranked = sorted(equals, key=foresight.rank)
        sure = min(ranges[it].high for it in equals)
        for it in ranked:
            if it is ranked[0]:
                flown.append(it)
            elif ranges[it].low > sure:
                outdone.append(it)
            elif ranges[it].low > 0:
                hopeless.append(it)
            else:
                flown.append(it)
    return flown, [
        *_left_out(hopeless, "predicted to miss a goal by more than the prediction may be wrong"),
        *_left_out(
            outdone,
            "predicted to be worse than another of the same cost by more than both may be wrong",
        ),
    ]


def _left_out(candidates: Iterable[Candidate], why: str) -> list[LeftOut]:
    found = tuple(candidates)
    return [LeftOut(f"{counted(len(found), 'candidate')}: {why}", found)] if found else []


def _range(candidate: Candidate, foresight: Foresight, goals: Sequence[Goal]) -> _Range:
    """Return how far a candidate may be from its goals; infinitely wide where one is unknown."""
    low, high = -math.inf, -math.inf
    for goal, value in zip(goals, foresight.values(candidate).tolist(), strict=True):
        doubt = doubt_of(goal.metric)
        if value != value or doubt is None:
            high = math.inf
            continue
        far = excess(goal, value)
        low, high = max(low, far - doubt.hardly_more), max(high, far + doubt.hardly_more)
    return _Range(low, high)


def ring_keys(question: Question, radius: float, angle: float) -> dict[str, Any]:
    """Return the keys of a regular formation of a radius (m) and an angle (deg)."""
    ring = {f"{FORMATION}.radius_m": radius, f"{FORMATION}.angle_deg": angle}
    return {**_taken_back(question, "model", "positions_m", "positions_deg"), **ring}


def place_keys(question: Question, places: Floats) -> dict[str, Any]:
    """Return the keys of ASVs at places (n, 2), m."""
    positions = {COUNT: len(places), f"{FORMATION}.positions_m": places.round(3).tolist()}
    return {**_taken_back(question, "model", "radius_m", "positions_deg"), **positions}


def unplaced(question: Question) -> dict[str, Any]:
    """Return the keys that take back the positions of the scenario, where it gives any."""
    return _taken_back(question, "model", "positions_m", "positions_deg")


def placed(question: Question, keys: Keys, places: dict[str, Any]) -> Candidate | None:
    """Return a team whose keys put it somewhere else; None where that is no scenario."""
    kept = {key: value for key, value in keys.items() if not key.startswith(FORMATION)}
    return candidate(question, {**kept, **places})


def _taken_back(question: Question, *names: str) -> dict[str, Any]:
    """Return the keys that undo what the scenario says of its formation, where it says that."""
    asked = question.base.asvs.formation
    given = [name for name in names if getattr(asked, name, None) is not None]
    keys: dict[str, Any] = {f"{FORMATION}.{name}": None for name in given}
    if getattr(asked, "clearance_m", 0.0):
        keys[f"{FORMATION}.clearance_m"] = 0.0
    return keys


# Nobody is asked to send more.
MOST_ASVS = 12


def further(question: Question, tried: Sequence[Candidate], foresight: Foresight) -> str:
    """Return in a sentence how many more ASVs are predicted to be enough; empty if that is unknown.

    They are those of the nearest team, in the regular formation that covers best.
    """
    nearest = min(tried, key=foresight.rank)
    if not isinstance(nearest.scenario.asvs.formation, Formation):
        return ""
    if foresight.prediction(nearest) is None:
        return ""
    most = max(it.asvs for it in tried)
    for count in range(most + 1, MOST_ASVS + 1):
        radius, angle = Ways(nearest.scenario).best(count)
        ring = ring_keys(question, radius, angle)
        team = placed(question, {**nearest.keys, COUNT: count}, ring)
        if team is not None and foresight.rank(team) < 0:
            return (
                f"{counted(count, 'ASV')} on a ring of {radius:g} m, the first at {angle:g} deg, "
                "are predicted to meet the goal."
            )
    return f"Not even {MOST_ASVS} ASVs are predicted to meet the goal." if most < MOST_ASVS else ""
