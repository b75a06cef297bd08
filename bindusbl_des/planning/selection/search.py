"""The way to the least cost at which a candidate meets all goals, and to the best of that cost."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from itertools import groupby
from math import isfinite

from ...campaigns.experiments.experiment import FEWEST_SEEDS
from ...core.wording import counted, plain, refuse
from .evidence import Choice, CutOff, Evidence, Group, Sample, Selection, looks
from .goals import Goal

# Who is still open after so many seeds is close to a limit: costlier ones come before more seeds.
PATIENCE = 24


class Search:
    """A search among candidates of which nothing is known but their costs and predictions."""

    def __init__(
        self,
        candidates: Sequence[Choice],
        evidence: Evidence,
        note: Callable[[Selection], None] = lambda _: None,
    ) -> None:
        self._candidates, self._evidence, self._note = candidates, evidence, note
        by_cost = sorted(range(len(candidates)), key=lambda number: candidates[number].cost)
        groups = groupby(by_cost, key=lambda number: candidates[number].cost)
        self._groups = [Group(evidence, list(members)) for _, members in groups]
        self._cheapest: int | None = None  # number of the group in which one meets the goals

    def run(self) -> None:
        """Find the cheapest group in which a candidate meets the goals, then the best of them.

        Costs are tried downwards from the one that is predicted to do, then upwards, and first with
        few seeds, so that there is an answer early; in the end all that are cheaper have been tried
        with as many as it takes.

        Raises:
            CutOff: when the budget was used up before.
        """
        most = self._evidence.looks[-1].seeds
        for seeds in (min(PATIENCE, most), most):
            self._look_for_cheapest(seeds)
        if self._cheapest is not None:
            group = self._groups[self._cheapest]
            while len(group.running) > 1 and not group.is_flown:
                self._look(group)

    def _look_for_cheapest(self, seeds: int) -> None:
        """Try each cost below that of the answer with so many seeds at most."""
        start = self._predicted()
        for number in (*range(start, -1, -1), *range(start + 1, len(self._groups))):
            if self._cheapest is not None and number >= self._cheapest:
                continue
            group = self._groups[number]
            while group.having(None) and not group.meets and group.next_seeds <= seeds:
                self._look(group)
            if group.meets:
                self._cheapest = number

    def _predicted(self) -> int:
        """Return the number of the cheapest group in which one is predicted to meet the goals."""
        for number, group in enumerate(self._groups):
            for member in group.members:
                prior = self._candidates[member].prior
                if prior is not None and self._evidence.keeps(prior):
                    return number
        return 0

    def _look(self, group: Group) -> None:
        group.look()
        self._note(self.selection())

    def selection(self) -> Selection:
        """Return what is known now."""
        best = None if self._cheapest is None else self._groups[self._cheapest]
        costlier = [] if self._cheapest is None else self._groups[self._cheapest + 1 :]
        verdicts = [
            verdict or ("needs more missions" if self._evidence.missions(number) else "not flown")
            for number, verdict in enumerate(self._evidence.verdicts)
        ]
        for group in costlier:
            for number in group.having(None):
                verdicts[number] = "not needed"
        numbers = range(len(verdicts))
        doubts = list(self._doubts(best))
        return Selection(
            None if best is None else best.leader,
            tuple(verdicts),
            tuple(self._evidence.estimates(number) for number in numbers),
            tuple(self._evidence.missions(number) for number in numbers),
            not doubts,
            " ".join([self._found(best), *doubts]),
        )

    def _found(self, best: Group | None) -> str:
        if best is not None:
            cost = plain(self._candidates[best.leader].cost)
            return f"Candidate {best.leader} meets the goals at cost {cost}."
        if all(verdict == "not met" for verdict in self._evidence.verdicts):
            return "No candidate meets the goals."
        return "No candidate is shown to meet the goals."

    def _doubts(self, best: Group | None) -> Iterator[str]:
        """Yield what keeps the answer from being as sure as was asked."""
        cheaper = self._groups if self._cheapest is None else self._groups[: self._cheapest]
        whose = "candidate" if best is None else "cheaper candidate"
        flown = f"not settled with {self._evidence.looks[-1].seeds} seeds"
        if untold := sum(len(group.having(None)) for group in cheaper):
            yield f"{counted(untold, whose)} may meet the goals."
        considered = [member for group in cheaper for member in group.members]
        if unsure := sum(self._evidence.is_cut_short[member] for member in considered):
            yield f"{counted(unsure, whose)} may meet the goals: {flown}."
        if best is None:
            return
        unsure = sum(self._evidence.is_cut_short[member] for member in best.members)
        if rivals := len(best.running) - 1 + unsure:
            until = f": {flown}" if best.is_flown else ""
            yield f"{counted(rivals, 'rival')} of equal cost may be better{until}."


CONFIDENCE = 0.95
ZONE = 0.05
MOST_SEEDS = 128


def select(
    candidates: Sequence[Choice],
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
    candidates: Sequence[Choice],
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
    for number, candidate in enumerate(candidates):
        if not isfinite(candidate.cost):
            raise ValueError(f"candidate {number}: needs a cost; got {plain(candidate.cost)}")
        if candidate.prior is not None and len(candidate.prior) != len(goals):
            raise ValueError(f"candidate {number}: needs one prediction for each goal")
