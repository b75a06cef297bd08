"""Which candidates are worth flying: none is left out that a prediction's error could hide."""

import math
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from ...core.wording import counted
from ..selection.goals import Goal
from .candidates import Candidate
from .foresight import Foresight, doubt_of, excess


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
