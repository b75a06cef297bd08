"""Which of many candidates meets all goals at the least cost, and is the best of that cost.

A mean of missions has a bound that knows of skewed values; a verdict is given where that is far
enough from the limit.  Candidates of one cost are looked at together until one is the best that
meets the goals.

Many looks at many candidates mislead: each is one more chance of a wrong verdict.  Looks are
therefore at numbers of seeds that were fixed before, and the risk that is left by the confidence is
shared among three mistakes, and of each among the occasions of making it (Bonferroni's inequality,
which seeds that are paired cannot break):

* a candidate that misses a goal is chosen: among all candidates and their looks;
* the right candidate, one and unknown, drops out as missing a goal: among its looks and goals, not
  among candidates, since what happens to others does not matter;
* it is outdone by one that is worse: among those that could do so, and their looks.
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

# A skewness that makes no difference
SYMMETRIC = 1e-6

# At so few seeds candidates may only drop out, which skewed errors do not make riskier.
FEW_SEEDS = (4, 6)

# Where each candidate is told by itself: the seeds of looks, and the share of the risk that each
# takes.  Little is spent early, so that the last look is hardly stricter than a single one would be
# (O'Brien and Fleming 1979, Biometrics 35:549; Lan and DeMets 1983, Biometrika 70:659).
SPENT = {8: 0.1, 16: 0.1, 32: 0.8}

# Still open after so many seeds, a candidate is close to a limit: costlier ones come first.
PATIENCE = 24

# Return the goals' values (k, goals) of k missions, each of a candidate's and a seed's number from
# 0.  nan: that mission failed, or had no value, and does not meet the goal.  Where the budget is
# used up it may return those of the first of them only.
Sample = Callable[[Sequence[tuple[int, int]]], Floats]

# met: all goals.  not met: one is missed.  needs more missions: neither is shown, or they are met
# by less than would matter; it is not chosen.  outdone: it was open when another of its cost met
# the goals, and is better than that by less than would matter, if at all.  not needed: it costs
# more than the answer.  not flown: the budget was used up before.
Verdict = Literal["met", "not met", "needs more missions", "outdone", "not needed", "not flown"]


@dataclass(frozen=True)
class Choice:
    """What may be chosen: its cost, in any unit, and what its goals are predicted to be.

    A prediction decides which cost is tried first and nothing else; nan is not known.
    """

    cost: float
    prior: Sequence[float] | None = None


@dataclass(frozen=True)
class Estimate:
    """A goal's mean over the missions of a candidate, and how sure it is; nan where none is.

    `low` and `high` are the ends of its 95 % interval by itself (Student's t, two-sided, as
    everywhere).  `missed` is the share of those missions that do not keep the goal.
    """

    mean: float
    low: float
    high: float
    missed: float = nan


@dataclass(frozen=True)
class Selection:
    """The candidate chosen (None: none meets the goals), and what was found of each.

    `estimates` are those of each candidate's goals, over its first `missions` seeds.  `doubts` are
    what keeps the answer from holding with the stated confidence.
    """

    answer: int | None
    verdicts: tuple[Verdict, ...]
    estimates: tuple[tuple[Estimate, ...], ...]
    missions: tuple[int, ...]
    doubts: str = ""

    @property
    def is_settled(self) -> bool:
        """Whether the answer holds with the stated confidence."""
        return not self.doubts


def upper_bounds(values: Floats, t: float) -> Floats:
    """Return bounds (n,) that the means of columns (k, n) stay below, `t` standard errors above.

    Where values are skewed to the right, as errors are, the mean of few is too low more often than
    too high, and its standard error with it: Student's t would let many pass that are rarely, but
    badly off.  Hall's transformation (1992, J. R. Stat. Soc. B 54:221-228) makes up for that.
    Skewness to the left is not made use of.
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
    """A number of seeds, and so many standard errors from a limit to be sure of each verdict.

    `met` is None, and `outdone` infinite, where such a verdict would be premature.
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
    """Return looks at candidates of which each is told by itself whether it meets the goals.

    The confidence is that of each, over all its looks, and two-sided as that of an interval: half
    of the risk is that of telling that it meets them, half that it misses one.

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
    """Return how many standard errors a mean is off at most, but for a risk (one-sided)."""
    return student(seeds - 1, 1 - 2 * risk)


class CutOff(Exception):
    """Not all missions of a look were flown when the budget was used up."""


class Evidence:
    """The missions of candidates, flown at equal seeds, and the verdicts that they allow.

    Goals are turned so that less is always better; `zone` is the share of a limit below which no
    difference matters.
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
        """Return how many missions of a candidate are known, at seeds 0, 1, ..."""
        return len(self._values[candidate])

    def values(self, candidate: int) -> Floats:
        """Return the goals' values (k, goals) of the missions of a candidate."""
        return np.asarray(self._signs * self._values[candidate], np.float64)

    def fly(self, candidates: Sequence[int], look: int) -> None:
        """Fly the missions of candidates that a look is lacking.

        Raises:
            CutOff: when not all of them were flown; those that were count.
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
        """Tell whether values of the goals keep all their limits; nan keeps none."""
        return bool(np.all(self._signs * values <= self._limits))

    def mean(self, candidate: int) -> float:
        """Return the mean of the first goal, by which candidates of equal cost are ranked."""
        return float(self._values[candidate][:, 0].mean())

    def outdoes(self, leader: int, other: int, look: int) -> bool:
        """Tell whether a candidate is shown not to be worse than another by what would matter."""
        differences = self._values[leader][:, :1] - self._values[other][:, :1]
        error = intervals(differences.T).error[0]
        return bool(differences.mean() + self.looks[look].outdone * error < self._zones[0])

    def estimates(self, candidate: int) -> tuple[Estimate, ...]:
        """Return what is known of each goal of a candidate."""
        found = []
        for values, sign, limit in zip(
            self._values[candidate].T, self._signs, self._limits, strict=True
        ):
            missed = float(np.mean(~(values <= limit))) if len(values) else nan
            found.append(replace(estimated(sign * values), missed=missed))
        return tuple(found)


def estimated(values: Floats) -> Estimate:
    """Return what values (k,) tell of their mean: nan where one is missing."""
    if not len(values) or not np.isfinite(values).all():
        return Estimate(nan, nan, nan)
    found = intervals(values[None, :]).at(0)
    return Estimate(found.mean, found.low, found.high)


class Search:
    """A search among candidates of which nothing is known but their costs and predictions.

    Candidates of one cost are a group, which is looked at together until one is the best that meets
    the goals.  One that cannot be that is flown no further.
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
        self._cheapest: int | None = None  # number of the group in which one meets the goals

    def run(self) -> None:
        """Find the cheapest group in which a candidate meets the goals, then the best of them.

        Costs are tried downwards from the one that is predicted to do, then upwards, and first with
        few seeds, so that there is an answer early; in the end all that are cheaper have been tried
        with as many as it takes.

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
        """Try each cost below that of the answer with so many seeds at most."""
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
        """Return the number of the cheapest group in which one is predicted to meet the goals."""
        for group, members in enumerate(self._groups):
            for member in members:
                prior = self._candidates[member].prior
                if prior is not None and self._evidence.keeps(prior):
                    return group
        return 0

    def _having(self, group: int, verdict: Verdict | None) -> list[int]:
        """Return the candidates of a group with a verdict, or without any."""
        return [n for n in self._groups[group] if self._evidence.verdicts[n] == verdict]

    def _running(self, group: int) -> list[int]:
        """Return which candidates of a group may still be the best that meets the goals."""
        either = self._having(group, "met") + self._having(group, None)
        return [number for number in either if number not in self._outdone]

    def _leader(self, group: int) -> int:
        """Return the best of those of a group that are shown to meet the goals."""
        met = [number for number in self._having(group, "met") if number not in self._outdone]
        return min(met, key=self._evidence.mean)

    def _look(self, group: int) -> None:
        """Fly those that run at more seeds; judge which meet the goals, miss them, are outdone.

        Raises:
            CutOff: when not all of them were flown.
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
        """Return what is known now."""
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
        """Yield what keeps the answer from being as sure as was asked."""
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

    With that confidence it meets them, none of less cost meets them by `zone` or more, and none of
    equal cost that does is better in the first goal by more than it; `zone` is a share of a goal's
    limit.  This holds over all looks at all candidates if means of missions are normal.

    Candidates are flown at seeds 0, 1, ... alike, so that their noise is.  What is found depends on
    the missions alone; where `sample` returns fewer than it was asked for, it is not settled.
    `note` hears of what is known after each look.

    Raises:
        ValueError: when there is nothing to choose from, or nothing to choose it by.
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
