"""Which of many changes deserve to be measured: a race in which the slower ones drop out."""

from collections.abc import Iterable, Sequence
from contextlib import suppress
from itertools import combinations

from ..results.effects import FILTER
from .changes import PAIR, Change, both, may_be_paired
from .trials import AS_IT_IS, OutOfMissions, Trials

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
        self._trials, self._changes, self._first = trials, changes, first_seed
        self.seeds = [first_seed]
        self._running: list[Change] = []
        self.untried: list[Change] = list(changes)
        self.inert: list[Change] = []
        self.tried: list[Change] = []

    def run(self, until: int) -> None:
        """Fly the heats until so many missions were flown.

        Raises:
            OutOfMissions: when not even the plan as it is can be flown once.
        """
        self._trials.fly(AS_IT_IS, self._first)
        with suppress(OutOfMissions):
            self._first_heat(FIRST_HEAT * until)
            for runners, each, more in HEATS:
                self._fly(list(self._pairs()), until)
                self._running = self._best(runners, each)
                self.seeds += range(self.seeds[-1] + 1, self.seeds[-1] + 1 + more)
                self._fly([AS_IT_IS, *self._running], until)

    def _first_heat(self, until: float) -> None:
        for change in self._changes:
            if self._must_end(until):
                break
            self._try(change, self._first)
            self.untried.remove(change)
            if change in self._trials.failed:
                continue
            self.tried.append(change)
            if self._trials.differences(change, self.seeds)[0] == 0.0:
                self.inert.append(change)
            else:
                self._running.append(change)

    def _must_end(self, until: float) -> bool:
        """Tell whether the first heat is over; while nothing has helped it has all missions."""
        if self._trials.left < MISSIONS_TO_MEASURE:
            return True
        return self._trials.spent >= until and bool(self.promising())

    def _fly(self, changes: Iterable[Change], until: int) -> None:
        for change in changes:
            for seed in self.seeds:
                if self._trials.spent >= until:
                    raise OutOfMissions
                self._try(change, seed)
            if change not in self._running and change != AS_IT_IS:
                self._running.append(change)

    def _try(self, change: Change, seed: int) -> None:
        with suppress(ValueError):  # it is noted among the failed
            self._trials.fly(change, seed)

    def mean(self, change: Change) -> float:
        """Return the mean difference (m) that a change has made so far; below 0 it helped."""
        return float(self._trials.differences(change, self.seeds).mean())

    def _best(self, most: int, each: int) -> list[Change]:
        """Return the best of those that run, at most so many, and of each kind; pairs besides.

        Of equal ones the simpler is the better.
        """
        ranked = sorted(
            (it for it in self._running if it not in self._trials.failed),
            key=lambda it: (self.mean(it), len(it.settings)),
        )
        singles: list[Change] = []
        for change in ranked:
            alike = sum(it.kind == change.kind for it in singles)
            if change.kind != PAIR and alike < each:
                singles.append(change)
        return [*singles[:most], *[it for it in ranked if it.kind == PAIR][:each]]

    def _winners(self) -> list[Change]:
        """Return the best single change of each kind that helped, the best kind first."""
        best = self._best(len(self._running), 1)
        return [it for it in best if it.kind != PAIR and self.mean(it) < 0]

    def _pairs(self) -> Iterable[Change]:
        """Yield the best changes two by two, those that have not run yet.

        A filter that changed nothing is among them: the worst AUV may have had no fix to weigh.
        """
        known = {it.words for it in self._running}
        best = [*self._winners()[:PAIRED], *(it for it in self.inert if it.kind == FILTER)]
        for one, other in combinations(best, 2):
            pair = both(one, other)
            if may_be_paired(one, other) and pair.words not in known:
                yield pair

    def promising(self, first: Sequence[str] = ()) -> list[Change]:
        """Return what is worth measuring, the best first: of each kind one, and the best pair.

        Changes of the kinds `first` lead the list, whatever their rank.
        """
        error = sum(it.error for it in self._trials.unchanged(self.seeds))
        least = -WORTHWHILE * error / len(self._trials.unchanged(self.seeds))
        found = self._winners()
        pairs = [it for it in self._best(len(self._running), 1) if it.kind == PAIR]
        if pairs and found and self.mean(pairs[0]) < self.mean(found[0]):
            found.insert(1, pairs[0])  # after what it is made of, which is simpler
        found = [it for it in found if self.mean(it) < least]
        return sorted(found, key=lambda it: it.kind not in first)
