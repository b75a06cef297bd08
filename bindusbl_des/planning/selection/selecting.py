"""The least cost at which a candidate meets all goals, and the best candidate of that cost."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from math import isfinite

from ...campaigns.experiments.precision import FEWEST_SEEDS
from ...core.wording import plain, refuse
from .evidence import CutOff, Evidence
from .goals import Goal
from .looks import looks
from .search import Search
from .selection import Candidate, Sample, Selection

CONFIDENCE = 0.95
ZONE = 0.05
MOST_SEEDS = 128


def select(
    candidates: Sequence[Candidate],
    sample: Sample,
    goals: Sequence[Goal],
    *,
    confidence: float = CONFIDENCE,
    zone: float = ZONE,
    most_seeds: int = MOST_SEEDS,
    note: Callable[[Selection], None] = lambda _: None,
) -> Selection:
    """Return the candidate of the least cost that meets all goals, with the stated confidence.

    With that confidence it meets them, none of less cost meets them by `zone` or more, and none of
    equal cost that does is better in the first goal by more than it; `zone` is a share of a goal's
    limit.  This holds over all looks at all candidates if means of missions are normal.

    Candidates are flown at seeds 0, 1, ... alike, so that their noise is.  What is found depends on
    the missions alone; where `sample` returns fewer than it was asked for, it is not settled.
    `note` hears of what is known after each look.

    Raises:
        ValueError: when there is nothing to choose from, or nothing to choose it by.
    """
    _check(candidates, goals, confidence, zone, most_seeds)
    seen = looks(most_seeds, confidence, len(candidates), len(goals))
    search = Search(candidates, Evidence(len(candidates), goals, seen, zone, sample), note)
    with suppress(CutOff):
        search.run()
    return search.selection()


def _check(
    candidates: Sequence[Candidate],
    goals: Sequence[Goal],
    confidence: float,
    zone: float,
    most_seeds: int,
) -> None:
    if not candidates or not goals:
        raise ValueError("a selection needs one candidate and one goal at least")
    if not 0.5 <= confidence < 1:
        refuse("confidence", plain(confidence), "lie in [0.5, 1)", "0.95 is usual")
    if not 0 <= zone < 1:
        refuse("zone", plain(zone), "be a share of the goal in [0, 1)", "0.05 is usual")
    if most_seeds < FEWEST_SEEDS:
        rule = f"be at least {FEWEST_SEEDS}"
        refuse("most_seeds", most_seeds, rule, "fewer seeds tell too little of their spread")
    for number, it in enumerate(candidates):
        if not isfinite(it.cost):
            raise ValueError(f"candidate {number}: needs a cost; got {plain(it.cost)}")
        if it.prior is not None and len(it.prior) != len(goals):
            raise ValueError(f"candidate {number}: needs one prediction for each goal")
