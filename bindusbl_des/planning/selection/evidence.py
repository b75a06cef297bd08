"""What the missions of candidates show: who meets the goals, who does not, who is outdone."""

from collections.abc import Sequence
from dataclasses import replace
from math import nan

import numpy as np

from ...campaigns.statistics.intervals import intervals
from .bounds import standard_errors, upper_bounds
from .goals import Goal
from .looks import Look
from .selection import Estimate, Floats, Sample, Verdict


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

    def fly(self, candidates: Sequence[int], look: int) -> None:
        """Fly the missions of candidates that a look is lacking.

        Raises:
            CutOff: when not all of them were flown; those that were count.
        """
        seeds = self.looks[look].seeds
        pairs = [(it, seed) for it in candidates for seed in range(self.missions(it), seeds)]
        if not pairs:
            return
        found = np.asarray(self._sample(pairs), dtype=np.float64).reshape(-1, len(self.goals))
        whose = np.array([candidate for candidate, _ in pairs[: len(found)]])
        for it in candidates:
            self._values[it] = np.concatenate([self._values[it], self._signs * found[whose == it]])
        if len(found) < len(pairs):
            raise CutOff

    def judge(self, candidate: int, look: int) -> None:
        """Give a candidate the verdict that its missions allow at a look, if any."""
        now, values = self.looks[look], self._values[candidate]
        if not np.isfinite(values).all():
            self.verdicts[candidate] = "not met"
            return
        errors = standard_errors(values)
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
        error = standard_errors(differences)[0]
        return bool(differences.mean() + self.looks[look].outdone * error < self._zones[0])

    def estimates(self, candidate: int) -> tuple[Estimate, ...]:
        """Return what is known of each goal of a candidate."""
        values = self._values[candidate]
        met = next((look.met for look in self.looks if look.seeds == len(values)), None)
        return tuple(
            _estimate(values[:, goal], sign, met) for goal, sign in enumerate(self._signs.tolist())
        )


def _estimate(values: Floats, sign: float, met: float | None) -> Estimate:
    """Return what values (k,) tell of their mean, turned back by `sign`."""
    found = estimated(sign * values)
    if met is None or found.mean != found.mean:
        return found
    return replace(found, bound=sign * float(upper_bounds(values[:, None], met)[0]))


def estimated(values: Floats) -> Estimate:
    """Return what values (k,) tell of their mean: nan where one is missing."""
    if not len(values) or not np.isfinite(values).all():
        return Estimate(nan, nan, nan, nan)
    found = intervals(values[None, :]).at(0)
    return Estimate(found.mean, found.low, found.high, nan)
