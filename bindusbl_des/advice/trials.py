"""Missions flown beside a plan, as many as there are to be flown."""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from ..core.compiled import compiling_s
from ..mission.simulation import simulate
from ..preflight.effort import effort
from ..scenario.scenario import Scenario
from .changes import Change, changed

Floats = NDArray[np.float64]
Told = Callable[[int, int], None]

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


def missions_for(scenario: Scenario) -> int:
    """Return how many missions are tried beside one of a scenario, by its size alone; 0 for one
    that takes too long.
    """
    each = effort(scenario).seconds
    return max(FEWEST, min(MOST, int(WORK_S / each))) if FEWEST * each <= LONGEST_S else 0


class Trials:
    """Trials of changes by seed, each flown once, `most` in all.

    After `seconds`, in which compiling does not count, none is begun (`is_cut`).  `told` hears
    after each mission how many were flown, and how many are left.
    """

    def __init__(
        self,
        scenario: Scenario,
        most: int,
        seconds: float | None = None,
        told: Told = lambda flown, left: None,
    ) -> None:
        self.spent, self.is_cut = 0, False
        self._most, self._seconds, self._told = most, seconds, told
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
            self._told(self.missions, self.left)
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
