"""What could be changed about a plan: changes race in missions flown beside it, the worse drop out,
and the best are measured on seeds that had no part in choosing them.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import combinations
from math import isfinite
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from ...core.mission.simulation import simulate
from ...core.results.effects import (
    FILTER,
    GAIN,
    HARMS,
    HELPS,
    NEGLIGIBLE,
    NO_EFFECT,
    Advice,
    Effect,
    Harm,
)
from ...core.scenario.files.scenario_file import Source
from ...core.scenario.scenario import Scenario
from ...core.setup import Setup
from ...support.arrays import Floats
from ...support.compiled import compiling_s
from ...support.mistakes import ScenarioError
from ...support.wording import counted
from ..campaigns.statistics.intervals import intervals
from ..preflight.effort import effort
from .changes import PAIR, Change, both, changed, may_be_paired, proposals

if TYPE_CHECKING:
    from ...core.results.result import Result

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
# A change of the worst AUV's error by a smaller share of it is of no use.
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


# No more changes than a reader compares, and no more seeds than intervals need to be narrow.
MOST_CHANGES, MOST_SEEDS = 6, 20
# Whether fixes do harm shows at once, or it is little.
SEEDS_OF_NONE = 6
# Rather fewer changes than fewer seeds for each: Student's t is wide for few.
FEWEST_SEEDS, ENOUGH_SEEDS, SEEDS_EACH = 3, {2: 4}, 5


def measured(
    trials: Trials, chosen: Sequence[Change], first_seed: int
) -> tuple[list[Change], list[int]]:
    """Fly the most promising of the chosen changes on fresh seeds; return which, and the seeds.

    How many depends on the missions there are, never on a result, so that none can end the trials.
    """
    count = min(len(chosen), MOST_CHANGES)
    while count > 1 and trials.left // (1 + count) < ENOUGH_SEEDS.get(count, SEEDS_EACH):
        count -= 1
    now, left = list(chosen[:count]), trials.left // (1 + count)
    most = max(FEWEST_SEEDS, min(left, MOST_SEEDS if now else SEEDS_OF_NONE))
    seeds = list(range(first_seed, first_seed + most))
    with suppress(OutOfMissions):
        for seed in seeds:
            for change in (AS_IT_IS, *now):
                with suppress(ValueError):  # it cannot be flown at one of the seeds
                    trials.fly(change, seed)
    return now, seeds


def effect(change: Change, differences: Floats, error: float, together: int) -> Effect:
    """Return what differences (m) of the worst AUV's error, `error` m as it is, say of a change.

    The interval is one of so many that hold `together` with 95 %.
    """
    found = intervals(differences[None], together).at(0)
    if found.high < 0:
        verdict = HELPS if -found.mean >= WORTHWHILE * error else NEGLIGIBLE
    else:
        verdict = HARMS if found.low > 0 else NO_EFFECT
    known = found.mean, found.low, found.high, found.count
    return Effect(change.kind, change.words, change.lines, *known, verdict)


def may_harm(missions: Sequence[Trial]) -> bool:
    """Tell whether fixes raise any AUV's mean error over these missions, be it by chance."""
    with_fixes, without = np.mean([mission.own for mission in missions], axis=0).T
    return bool(np.any(with_fixes > without))


def harms(missions: Sequence[Trial], together: int = 1) -> list[Harm]:
    """Return the AUVs whose error fixes raise, the worst first.

    What is said of the whole fleet is one of so many statements that hold `together` with 95 %.
    """
    if len(missions) < FEWEST_SEEDS:
        return []
    own = np.stack([mission.own for mission in missions])
    found = []
    for auv in range(own.shape[1]):
        with_fixes, without = own[:, auv].T
        worse = intervals((with_fixes - without)[None], own.shape[1] * together).at(0)
        means = float(with_fixes.mean()), float(without.mean())
        if worse.low > 0 and worse.mean > WORTHWHILE * means[1]:
            known = worse.mean, worse.low, worse.high
            found.append(Harm(f"AUV{auv}", *means, *known, worse.count))
    return sorted(found, key=lambda harm: -harm.mean_m)


# Reads the user's scenario again with further `--set` options laid over it.
Reader = Callable[[Sequence[str]], Scenario]

# A race on these seeds after the mission's own, and measurements on those.
CHOOSING, MEASURING = 1, 1001
# Half of the missions to choose, half to measure what was chosen.
SHARE_TO_CHOOSE = 0.5


def advise(
    result: "Result",
    seconds: float | None = None,
    *,
    missions: int | None = None,
    again: Reader | None = None,
    progress: Progress = lambda flown, left: None,
) -> Advice:
    """Return what would change the worst AUV's error of a mission, as measured in other missions.

    Changes are chosen and measured in so many `missions`, with other seeds than its own: by default
    as many as the scenario's size allows in some seconds (20 to 150, or none where one mission is
    too long), so that the same mission has the same advice on any machine.  After `seconds`, in
    which compiling does not count, none is begun any more, and the advice says that it was cut.
    `again` reads the scenario as the user wrote it: what is proposed can be laid over that with
    `--set`, and gives what was measured.  `progress` hears after each mission how many were flown
    and how many are left.  Assign the advice to `result.advice` to have it in its summary, its
    report and its folder.

    Raises:
        ValueError: when `seconds` is no finite number, or `missions` below 0.
    """
    if seconds is not None and not isfinite(seconds):
        raise ValueError(f"advice takes a finite time; met {seconds}; give seconds")
    if missions is not None and missions < 0:
        raise ValueError(f"advice needs 0 missions or more; met {missions}")
    scenario = result.scenario
    setup = result.setup
    most = missions_for(setup) if missions is None else missions
    trials = Trials(scenario, most, seconds, progress)
    changes, needless = proposals(result)
    race = Race(trials, changes, result.seed + CHOOSING)
    try:
        race.run(int(SHARE_TO_CHOOSE * most))
    except OutOfMissions:
        return Advice(
            most,
            seconds,
            untried=_words(changes),
            needless=tuple(needless),
            shortage=_short(trials, most),
            is_cut=trials.is_cut,
        )
    except ValueError as error:
        return Advice(most, shortage=f"the plan cannot be flown with another seed: {error}")
    reader = again or _as_it_was_run(scenario)
    first = (GAIN, FILTER) if may_harm(trials.unchanged(race.seeds)) else ()
    chosen = [change for change in race.promising(first) if _can_be_said(change, scenario, reader)]
    finalists, seeds = measured(trials, chosen, result.seed + MEASURING)
    together = len(finalists) + 1  # and whether fixes do harm
    effects = _effects(trials, finalists, seeds, together)
    unchanged = trials.unchanged([*race.seeds, *seeds])
    said = {*_words(race.inert), *(effect.words for effect in effects)}
    unknown = chosen if race.tried else changes  # what might help, had there been missions
    return Advice(
        budget_missions=most,
        budget_s=seconds,
        is_cut=trials.is_cut,
        missions=trials.missions,
        error_m=_mean([trial.error for trial in trials.unchanged(seeds)]),
        effects=tuple(effects),
        harms=tuple(harms(unchanged, together)),
        harm_seeds=len(unchanged) if len(unchanged) >= FEWEST_SEEDS else 0,
        inert=_words(race.inert),
        needless=tuple(needless),
        dropped=tuple(words for words in _words(race.tried) if words not in said),
        untried=_words(race.untried),
        shortage=_short(trials, most) if unknown and not effects else "",
        fixed_gain=setup.navigator.has_gain,
    )


def _as_it_was_run(scenario: Scenario) -> Reader:
    source = Source(scenario.model_dump_json())  # JSON is YAML
    return lambda options: source._replace(overrides=tuple(options)).read()[1]


def _can_be_said(change: Change, scenario: Scenario, reader: Reader) -> bool:
    """Tell whether the options of a change, laid over the user's scenario, are that change."""
    try:
        return reader(change.lines) == changed(scenario, change.settings)
    except ScenarioError:
        return False


def _effects(
    trials: Trials, finalists: Sequence[Change], seeds: list[int], together: int
) -> list[Effect]:
    """Return the effects of what was measured, the best first."""
    error = _mean([trial.error for trial in trials.unchanged(seeds)]) or 0.0
    effects = [
        effect(change, differences, error, together)
        for change in finalists
        if len(differences := trials.differences(change, seeds)) >= FEWEST_SEEDS
    ]
    return sorted(effects, key=lambda outcome: outcome.mean_m)


def _mean(values: Sequence[float]) -> float | None:
    return sum(values) / len(values) if values else None


def _words(changes: Iterable[Change]) -> tuple[str, ...]:
    return tuple(change.words for change in changes)


def _short(trials: Trials, most: int) -> str:
    """Return why too few missions were flown, and what would be enough."""
    flown = counted(trials.spent, "mission")
    if trials.is_cut:
        return f"it was cut off after {flown}; give --advice-s more, or leave it out"
    if not most:
        return f"missions this large are not tried unasked; --advice-missions {FEWEST} does it"
    are = "is" if trials.spent == 1 else "are"
    return f"{flown} {are} too few for any change; try --advice-missions {max(4 * most, FEWEST)}"
