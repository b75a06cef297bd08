"""Which of many changes of a plan deserve to be measured: they race on some seeds, in missions
flown beside the plan, and the worse drop out.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import combinations
from time import perf_counter

import numpy as np

from ..core.arrays import Floats
from ..core.compiled import compiling_s
from ..mission.simulation import simulate
from ..preflight.effort import effort
from ..results.effects import FILTER
from ..scenario.scenario import Scenario
from ..setup import Setup
from .changes import PAIR, Change, both, changed, may_be_paired

Progress = Callable[[int, int], None]

# What a mission may raise that cannot be flown: the change is no good, whatever the reason.
FAILURES = (ValueError, ArithmeticError, RuntimeError, LookupError, MemoryError)

# So many missions are enough to choose well and to measure what was chosen, so many are needed to
# tell anything; between them they are as many as together are estimated to take so long (s).  Where
# the fewest would take longer than the longest, none is flown unasked.
MOST, FEWEST, WORK_S, LONGEST_S = 150, 20, 10.0, 60.0

AS_IT_IS = Change("", "the plan as it is", {})


class OutOfMissions(Exception):
    """No more missions are to be flown."""


@dataclass(frozen=True)
class Trial:
    """One mission: the worst AUV's mean error, and each AUV's with and without fixes (n, 2), m."""

    error: float
    own: Floats


def missions_for(setup: Setup) -> int:
    """Return how many missions are tried beside one of a scenario, by its size alone; 0 for one
    that takes too long.
    """
    each = effort(setup).seconds
    return max(FEWEST, min(MOST, int(WORK_S / each))) if FEWEST * each <= LONGEST_S else 0


class Trials:
    """Trials of changes by seed, each flown once, `most` in all.

    After `seconds`, in which compiling does not count, none is begun (`is_cut`).  `on_progress`
    hears after each mission how many were flown, and how many are left.
    """

    def __init__(
        self,
        scenario: Scenario,
        most: int,
        seconds: float | None = None,
        on_progress: Progress = lambda flown, left: None,
    ) -> None:
        self.spent, self.is_cut = 0, False
        self._most, self._seconds, self._on_progress = most, seconds, on_progress
        self._began = perf_counter() - compiling_s()
        self._plan = changed(scenario, {"record.detail": "summary"}) or scenario
        self._flown: dict[tuple[Change, int], Trial] = {}
        self.failed: dict[Change, str] = {}

    @property
    def missions(self) -> int:
        """How many missions were flown to their end."""
        return len(self._flown)

    @property
    def left(self) -> int:
        """How many missions are left."""
        return self._most - self.spent

    def fly(self, change: Change, seed: int) -> Trial:
        """Return the trial of a change at a seed.

        Raises:
            OutOfMissions: when none is left, or the time is up.
            ValueError: when such a mission cannot be flown.
        """
        if (change, seed) in self._flown:
            return self._flown[change, seed]
        if change in self.failed:
            raise ValueError(self.failed[change])
        time = perf_counter() - compiling_s() - self._began
        self.is_cut = self.is_cut or (self._seconds is not None and time > self._seconds)
        if not self.left or self.is_cut:
            raise OutOfMissions
        self.spent += 1
        try:
            trial = self._flown[change, seed] = self._trial(change, seed)
        except FAILURES as error:
            self.failed[change] = str(error) or type(error).__name__
            raise ValueError(self.failed[change]) from error
        finally:
            self._on_progress(self.missions, self.left)
        return trial

    def _trial(self, change: Change, seed: int) -> Trial:
        plan = changed(self._plan, change.settings)
        if plan is None:
            raise ValueError(f"{change.words}: contradicts the plan")
        tables = simulate(plan, seed).arrow
        mission, auvs = tables["mission"].to_pylist()[0], tables["auvs"]
        own = [auvs[name].to_numpy() for name in ("position_error_m", "imu_error_m")]
        return Trial(mission["worst_position_error_m"], np.column_stack(own))

    def differences(self, change: Change, seeds: list[int]) -> Floats:
        """Return what a change did (m) to the worst AUV's error at those seeds that were flown."""
        pairs = [(self._flown.get((AS_IT_IS, s)), self._flown.get((change, s))) for s in seeds]
        return np.array([two.error - one.error for one, two in pairs if one and two])

    def unchanged(self, seeds: list[int]) -> list[Trial]:
        """Return the missions of the plan as it is that were flown at these seeds."""
        return [self._flown[AS_IT_IS, s] for s in seeds if (AS_IT_IS, s) in self._flown]


# The first heat, one seed for every change, may take this share of the race's missions.
FIRST_HEAT = 0.75
# Further heats: how many changes run on, how many of a kind, and at how many more seeds.
HEATS = ((15, 3, 1), (8, 2, 2), (6, 1, 3))
# To measure one change, after whatever race, takes so many missions at the least.
MISSIONS_TO_MEASURE = 7
# The best of so many kinds are tried together, two by two.
PAIRED = 4
# A change of the worst AUV's error by a smaller share of it is of no use to anybody.
WORTHWHILE = 0.01


class Race:
    """Trials of changes on a few seeds, the same for all; only the ranking is taken from it."""

    def __init__(self, trials: Trials, changes: Sequence[Change], first_seed: int) -> None:
        self._trials, self.seeds = trials, [first_seed]
        self.untried, self.tried = list(changes), list[Change]()
        self.inert, self._running = list[Change](), list[Change]()

    def run(self, until: int) -> None:
        """Fly the heats until so many missions were flown.

        Raises:
            OutOfMissions: when not even the plan as it is can be flown once.
        """
        self._trials.fly(AS_IT_IS, self.seeds[0])
        with suppress(OutOfMissions):
            self._first_heat(FIRST_HEAT * until)
            for runners, each, more in HEATS:
                self._fly(list(self._pairs()), until)
                self._running = self._best(runners, each)
                self.seeds += range(self.seeds[-1] + 1, self.seeds[-1] + 1 + more)
                self._fly([AS_IT_IS, *self._running], until)

    def _first_heat(self, until: float) -> None:
        """Fly every change once; beyond its share of missions only while nothing has helped."""
        while self.untried and self._trials.left >= MISSIONS_TO_MEASURE:
            if self._trials.spent >= until and self.promising():
                return
            change = self.untried[0]
            with suppress(ValueError):  # it is noted among the failed
                self._trials.fly(change, self.seeds[0])
                self.tried.append(change)
                is_same = self._trials.differences(change, self.seeds)[0] == 0.0
                (self.inert if is_same else self._running).append(change)
            self.untried.remove(change)

    def _fly(self, changes: Sequence[Change], until: int) -> None:
        for change in changes:
            for seed in self.seeds:
                if self._trials.spent >= until:
                    raise OutOfMissions
                with suppress(ValueError):  # it is noted among the failed
                    self._trials.fly(change, seed)
            if change not in self._running and change != AS_IT_IS:
                self._running.append(change)

    def mean(self, change: Change) -> float:
        """Return the mean difference (m) that a change has made so far; below 0 it helped."""
        return float(self._trials.differences(change, self.seeds).mean())

    def _best(self, most: int, each: int) -> list[Change]:
        """Return the best of those that run, at most so many, and of each kind; pairs besides.

        Of equal ones the simpler is the better.
        """
        ranked = sorted(
            (change for change in self._running if change not in self._trials.failed),
            key=lambda change: (self.mean(change), len(change.settings)),
        )
        singles: list[Change] = []
        for change in ranked:
            alike = sum(single.kind == change.kind for single in singles)
            if change.kind != PAIR and alike < each:
                singles.append(change)
        return [*singles[:most], *[change for change in ranked if change.kind == PAIR][:each]]

    def _winners(self) -> list[Change]:
        """Return the best single change of each kind that helped, the best kind first."""
        best = self._best(len(self._running), 1)
        return [change for change in best if change.kind != PAIR and self.mean(change) < 0]

    def _pairs(self) -> Iterator[Change]:
        """Yield the best changes two by two, those that have not run yet.

        A filter that changed nothing is among them: the worst AUV may have had no fix to weigh.
        """
        known = {change.words for change in self._running}
        best = [
            *self._winners()[:PAIRED],
            *(change for change in self.inert if change.kind == FILTER),
        ]
        for one, other in combinations(best, 2):
            pair = both(one, other)
            if may_be_paired(one, other) and pair.words not in known:
                yield pair

    def promising(self, first: Sequence[str] = ()) -> list[Change]:
        """Return what is worth measuring, the best first: of each kind one, and the best pair.

        Changes of the kinds `first` lead the list, whatever their rank.
        """
        error = sum(trial.error for trial in self._trials.unchanged(self.seeds))
        least = -WORTHWHILE * error / len(self._trials.unchanged(self.seeds))
        found = self._winners()
        pairs = [change for change in self._best(len(self._running), 1) if change.kind == PAIR]
        if pairs and found and self.mean(pairs[0]) < self.mean(found[0]):
            found.insert(1, pairs[0])  # after what it is made of, which is simpler
        found = [change for change in found if self.mean(change) < least]
        return sorted(found, key=lambda change: change.kind not in first)
