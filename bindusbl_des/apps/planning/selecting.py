"""Select the candidate that meets all goals at the least cost, and is the best of that cost.

A candidate gets a verdict once the confidence bound of its mean, corrected for skewness, lies
beyond the limit.  Candidates of one cost are compared until one is the best that meets the goals.

Each look at each candidate is one more chance of a wrong verdict.  Looks are therefore at fixed
numbers of seeds, and the risk (1 - confidence) is divided among three mistakes and their occasions
(Bonferroni's inequality, which also holds for paired seeds):

* a candidate that misses a goal is chosen: divided among all candidates and their looks;
* the right candidate, one and unknown, is judged to miss a goal: among its looks and goals only;
* a worse candidate outdoes it: among the other candidates and their looks.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from itertools import groupby
from math import inf, isfinite, nan, sqrt
from typing import Literal

import numpy as np

from ...support.arrays import Floats
from ...support.wording import counted, plain, refuse
from ..campaigns.experiments.experiment import FEWEST_SEEDS, checkpoints
from ..campaigns.statistics.intervals import intervals, student
from .goals import Goal

# The least skewness: effectively symmetric
SYMMETRIC = 1e-6

# At so few seeds candidates may only drop out; skewed errors do not raise the risk of that.
FEW_SEEDS = (4, 6)

# For candidates that are judged independently: the seeds of each look, and its share of the risk.
# Early looks take little, so that the last look is hardly stricter than a single one would be
# (O'Brien and Fleming 1979, Biometrics 35:549; Lan and DeMets 1983, Biometrika 70:659).
SPENT = {8: 0.1, 16: 0.1, 32: 0.8}

# A candidate without a verdict after so many seeds waits until costlier ones were tried.
PATIENCE = 24

# Return the goals' values (k, goals) of k missions, given by numbers of candidate and seed.
# nan: that mission failed or had no value, and misses the goal.  If the budget is used up, only
# the first missions are returned.
Sample = Callable[[Sequence[tuple[int, int]]], Floats]

# met: all goals.  not met: one is missed.  needs more missions: neither is shown, or goals are met
# by less than the zone of indifference; it is not chosen.  outdone: another of its cost met the
# goals, and this one is not better by more than that zone.  not needed: it costs more than the
# answer.  not flown: the budget was used up before.
Verdict = Literal["met", "not met", "needs more missions", "outdone", "not needed", "not flown"]


@dataclass(frozen=True)
class Choice:
    """A candidate: its cost, in any unit, and the predicted values of its goals.

    Predictions only decide which cost is tried first; nan is unknown.
    """

    cost: float
    prior: Sequence[float] | None = None


@dataclass(frozen=True)
class Estimate:
    """A goal's mean over a candidate's missions; nan if unknown.

    `low` and `high` are the ends of its 95 % interval (two-sided Student's t).  `missed` is the
    share of missions that miss the goal.
    """

    mean: float
    low: float
    high: float
    missed: float = nan


@dataclass(frozen=True)
class Selection:
    """The chosen candidate (None: none meets the goals), and the results of all candidates.

    `estimates` has one :class:`Estimate` for each candidate and goal, over its first `missions`
    seeds. `doubts` tells why the answer lacks the stated confidence, or "".
    """

    answer: int | None
    verdicts: tuple[Verdict, ...]
    estimates: tuple[tuple[Estimate, ...], ...]
    missions: tuple[int, ...]
    doubts: str = ""

    @property
    def is_settled(self) -> bool:
        """Whether the answer has the stated confidence."""
        return not self.doubts


def upper_bounds(values: Floats, t: float) -> Floats:
    """Return upper bounds (n,) of the means of columns (k, n), `t` standard errors above.

    For values skewed to the right, as errors are, the mean of few and its standard error are too
    low more often than too high: Student's t would pass candidates that are rarely, but badly off.
    Hall's transformation (1992, J. R. Stat. Soc. B 54:221-228) corrects for that.  Skewness to the
    left is ignored.
    """
    count = len(values)
    errors = intervals(values.T).error
    apart = values - values.mean(axis=0)
    variance = (apart**2).mean(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = (apart**3).mean(axis=0) / variance**1.5
    found = np.where(errors > 0, ratio, 0.0) * sqrt(count * (count - 1)) / (count - 2)
    skewness = np.maximum(found, SYMMETRIC)
    most = t / sqrt(count) + skewness / (6 * count)
    factor = 3 / skewness * (1 - np.cbrt(1 - skewness * most))
    return np.asarray(values.mean(axis=0) + factor * sqrt(count) * errors, np.float64)


@dataclass(frozen=True)
class Look:
    """A number of seeds, and the standard errors between mean and limit for each verdict.

    `met` is None, and `outdone` infinite, if it is too early for that verdict.
    """

    seeds: int
    met: float | None
    missed: float
    outdone: float


@cache
def looks(most_seeds: int, confidence: float, candidates: int, goals: int) -> tuple[Look, ...]:
    """Return all looks at a candidate, by number of seeds.

    >>> [look.seeds for look in looks(20, 0.95, 12, 1)]
    [4, 6, 8, 12, 16, 20]
    """
    judged = list(checkpoints(most_seeds))
    risk = (1 - confidence) / 3
    missed = risk / ((len(FEW_SEEDS) + len(judged)) * goals)
    met = risk / (len(judged) * candidates)
    outdone = risk / (len(judged) * max(candidates - 1, 1))
    few = [Look(seeds, None, _errors(seeds, missed), inf) for seeds in FEW_SEEDS]
    risks = (met, missed, outdone)
    return (*few, *(Look(seeds, *(_errors(seeds, chance) for chance in risks)) for seeds in judged))


@cache
def looks_at_each(confidence: float, goals: int) -> tuple[Look, ...]:
    """Return looks for candidates that are judged independently.

    The confidence is that of each candidate over all its looks, two-sided: half of the risk is a
    wrong "met", half a wrong "not met".

    >>> [(look.seeds, round(look.met, 2)) for look in looks_at_each(0.95, 1)]
    [(8, 4.03), (16, 3.29), (32, 2.14)]
    >>> [(round(look.met, 2), round(look.missed, 2)) for look in looks_at_each(0.95, 2)]
    [(4.03, 4.59), (3.29, 3.62), (2.14, 2.45)]
    """
    risk = (1 - confidence) / 2
    shares = {seeds: share * risk for seeds, share in SPENT.items()}
    return tuple(
        Look(seeds, _errors(seeds, share), _errors(seeds, share / goals), inf)
        for seeds, share in shares.items()
    )


def _errors(seeds: int, risk: float) -> float:
    """Return the one-sided quantile of a mean, in standard errors, for a risk."""
    return student(seeds - 1, 1 - 2 * risk)


class CutOff(Exception):
    """The budget ended before all missions of a look were simulated."""


class Evidence:
    """The missions of candidates at equal seeds, and the verdicts that they allow.

    Goals are signed so that less is always better; a difference below the share `zone` of a limit
    does not matter.
    """

    def __init__(
        self, count: int, goals: Sequence[Goal], looks: Sequence[Look], zone: float, sample: Sample
    ) -> None:
        self.goals, self.looks = goals, looks
        self._sample = sample
        self._signs = np.array([1.0 if goal.is_below else -1.0 for goal in goals])
        self._limits = self._signs * [goal.limit for goal in goals]
        self._zones = zone * np.abs(self._limits)
        self._values = [np.empty((0, len(goals))) for _ in range(count)]
        self.verdicts: list[Verdict | None] = [None] * count
        self.is_cut_short = [False] * count

    def missions(self, candidate: int) -> int:
        """Return the number of a candidate's missions, at seeds 0, 1, ..."""
        return len(self._values[candidate])

    def values(self, candidate: int) -> Floats:
        """Return the goals' values (k, goals) of a candidate's missions."""
        return np.asarray(self._signs * self._values[candidate], np.float64)

    def fly(self, candidates: Sequence[int], look: int) -> None:
        """Simulate the missions that candidates lack at a look.

        Raises:
            CutOff: when the budget ended first; finished missions count.
        """
        seeds = self.looks[look].seeds
        pairs = [
            (candidate, seed)
            for candidate in candidates
            for seed in range(self.missions(candidate), seeds)
        ]
        if not pairs:
            return
        found = np.asarray(self._sample(pairs), dtype=np.float64).reshape(-1, len(self.goals))
        whose = np.array([candidate for candidate, _ in pairs[: len(found)]])
        for candidate in candidates:
            self._values[candidate] = np.concatenate(
                [self._values[candidate], self._signs * found[whose == candidate]]
            )
        if len(found) < len(pairs):
            raise CutOff

    def judge(self, candidate: int, look: int) -> None:
        """Give a candidate the verdict that its missions allow at a look, if any."""
        now, values = self.looks[look], self._values[candidate]
        if not np.isfinite(values).all():
            self.verdicts[candidate] = "not met"
            return
        errors = intervals(values.T).error
        least = values.mean(axis=0) - now.missed * errors
        if now.met is not None and np.all(upper_bounds(values, now.met) <= self._limits):
            self.verdicts[candidate] = "met"
        elif np.any((least > self._limits) & ((errors > 0) | (now.met is not None))):
            self.verdicts[candidate] = "not met"
        elif now.met is not None and np.any(least > self._limits - self._zones):
            self.verdicts[candidate] = "needs more missions"
        elif look == len(self.looks) - 1:
            self.verdicts[candidate] = "needs more missions"
            self.is_cut_short[candidate] = True

    def keeps(self, values: Sequence[float]) -> bool:
        """Tell whether values of the goals are within all limits; nan is not."""
        return bool(np.all(self._signs * values <= self._limits))

    def mean(self, candidate: int) -> float:
        """Return the mean of the first goal, which ranks candidates of equal cost."""
        return float(self._values[candidate][:, 0].mean())

    def outdoes(self, leader: int, other: int, look: int) -> bool:
        """Tell whether a candidate is shown to be at most `zone` worse than another."""
        differences = self._values[leader][:, :1] - self._values[other][:, :1]
        error = intervals(differences.T).error[0]
        return bool(differences.mean() + self.looks[look].outdone * error < self._zones[0])

    def estimates(self, candidate: int) -> tuple[Estimate, ...]:
        """Return the estimate of each goal of a candidate."""
        found = []
        for values, sign, limit in zip(
            self._values[candidate].T, self._signs, self._limits, strict=True
        ):
            missed = float(np.mean(~(values <= limit))) if len(values) else nan
            found.append(replace(estimated(sign * values), missed=missed))
        return tuple(found)


def estimated(values: Floats) -> Estimate:
    """Return the mean of values (k,) with its interval; nan if any value is missing."""
    if not len(values) or not np.isfinite(values).all():
        return Estimate(nan, nan, nan)
    found = intervals(values[None, :]).at(0)
    return Estimate(found.mean, found.low, found.high)


class Search:
    """The search among candidates, from their costs and predictions.

    Candidates of one cost form a group, whose members get more seeds until one is the best that
    meets the goals.  Those that cannot be the best get no more.
    """

    def __init__(
        self,
        candidates: Sequence[Choice],
        evidence: Evidence,
        note: Callable[[Selection], None] = lambda _: None,
    ) -> None:
        self._candidates, self._evidence, self._note = candidates, evidence, note
        by_cost = sorted(range(len(candidates)), key=lambda number: candidates[number].cost)
        groups = groupby(by_cost, key=lambda number: candidates[number].cost)
        self._groups = [list(members) for _, members in groups]
        self._next_look = [0] * len(self._groups)
        self._outdone: set[int] = set()
        self._cheapest: int | None = (
            None  # the cheapest group with a candidate that meets the goals
        )

    def run(self) -> None:
        """Find the cheapest group with a candidate that meets the goals, then its best one.

        Groups are tried downwards from the cheapest that is predicted to meet the goals, then
        upwards; first with few seeds, so that there is an early answer, then all cheaper ones with
        as many as needed.

        Raises:
            CutOff: when the budget was used up before.
        """
        looks = self._evidence.looks
        for seeds in (min(PATIENCE, looks[-1].seeds), looks[-1].seeds):
            self._look_for_cheapest(seeds)
        best = self._cheapest
        if best is not None:
            while len(self._running(best)) > 1 and self._next_look[best] < len(looks):
                self._look(best)

    def _look_for_cheapest(self, seeds: int) -> None:
        """Try each group cheaper than the answer with at most `seeds` seeds."""
        start = self._predicted()
        for group in (*range(start, -1, -1), *range(start + 1, len(self._groups))):
            if self._cheapest is not None and group >= self._cheapest:
                continue
            while (
                self._having(group, None)
                and not self._having(group, "met")
                and self._evidence.looks[self._next_look[group]].seeds <= seeds
            ):
                self._look(group)
            if self._having(group, "met"):
                self._cheapest = group

    def _predicted(self) -> int:
        """Return the cheapest group with a candidate that is predicted to meet the goals."""
        for group, members in enumerate(self._groups):
            for member in members:
                prior = self._candidates[member].prior
                if prior is not None and self._evidence.keeps(prior):
                    return group
        return 0

    def _having(self, group: int, verdict: Verdict | None) -> list[int]:
        """Return the candidates of a group with a verdict, or (None) without one."""
        return [n for n in self._groups[group] if self._evidence.verdicts[n] == verdict]

    def _running(self, group: int) -> list[int]:
        """Return the candidates of a group that may still be the best that meets the goals."""
        either = self._having(group, "met") + self._having(group, None)
        return [number for number in either if number not in self._outdone]

    def _leader(self, group: int) -> int:
        """Return the best candidate of a group among those that meet the goals."""
        met = [number for number in self._having(group, "met") if number not in self._outdone]
        return min(met, key=self._evidence.mean)

    def _look(self, group: int) -> None:
        """Simulate a group's open candidates at more seeds, and judge them.

        Raises:
            CutOff: when the budget was used up before.
        """
        look, evidence = self._next_look[group], self._evidence
        evidence.fly(self._running(group), look)
        self._next_look[group] += 1
        for number in self._having(group, None):
            evidence.judge(number, look)
        if self._having(group, "met"):
            leader = self._leader(group)
            for number in self._running(group):
                if number != leader and evidence.outdoes(leader, number, look):
                    self._outdone.add(number)
                    evidence.verdicts[number] = evidence.verdicts[number] or "outdone"
        self._note(self.selection())

    def selection(self) -> Selection:
        """Return the present result."""
        best, evidence = self._cheapest, self._evidence
        numbers = range(len(self._candidates))
        verdicts = [
            verdict or ("needs more missions" if evidence.missions(number) else "not flown")
            for number, verdict in enumerate(evidence.verdicts)
        ]
        for group in [] if best is None else range(best + 1, len(self._groups)):
            for number in self._having(group, None):
                verdicts[number] = "not needed"
        return Selection(
            None if best is None else self._leader(best),
            tuple(verdicts),
            tuple(map(evidence.estimates, numbers)),
            tuple(map(evidence.missions, numbers)),
            " ".join(self._doubts()),
        )

    def _doubts(self) -> Iterator[str]:
        """Yield why the answer lacks the stated confidence."""
        best, is_cut_short = self._cheapest, self._evidence.is_cut_short
        cheaper = range(len(self._groups) if best is None else best)
        whose = "candidate" if best is None else "cheaper candidate"
        flown = f"not settled with {self._evidence.looks[-1].seeds} seeds"
        if untold := sum(len(self._having(group, None)) for group in cheaper):
            yield f"{counted(untold, whose)} may meet the goals."
        if unsure := sum(is_cut_short[n] for group in cheaper for n in self._groups[group]):
            yield f"{counted(unsure, whose)} may meet the goals: {flown}."
        if best is None:
            return
        unsure = sum(is_cut_short[number] for number in self._groups[best])
        if rivals := len(self._running(best)) - 1 + unsure:
            is_flown = self._next_look[best] == len(self._evidence.looks)
            until = f": {flown}" if is_flown else ""
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

    With that confidence it meets them, no cheaper candidate meets them by `zone` or more, and no
    other of equal cost that meets them is better in the first goal by more than that; `zone` is a
    share of a goal's limit.  This holds over all looks at all candidates if means of missions are
    normal.

    All candidates use the same seeds 0, 1, ..., so that their noise is paired.  The result depends
    on the missions alone; it is not settled if `sample` returns fewer than asked.  `note` receives
    the present result after each look.

    Raises:
        ValueError: when there are no candidates or goals, or a setting is out of bounds.
    """
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
    seen = looks(most_seeds, confidence, len(candidates), len(goals))
    search = Search(candidates, Evidence(len(candidates), goals, seen, zone, sample), note)
    with suppress(CutOff):
        search.run()
    return search.selection()
