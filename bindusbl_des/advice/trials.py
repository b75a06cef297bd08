"""Missions flown beside a plan, as long as there is time for them."""

from collections.abc import Callable
from dataclasses import dataclass
from statistics import median
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from ..core.compiled import compiling_s
from ..mission.mission import Mission
from ..results.result import Result
from ..scenario.scenario import Scenario
from .changes import Change, changed

Floats = NDArray[np.float64]
Told = Callable[[int, float], None]

# What a mission may raise that cannot be flown: the change is no good, whatever the reason.
FAILURES = (ValueError, ArithmeticError, RuntimeError, LookupError, MemoryError)

# On a machine that has compiled nothing all time would go there: up to so much (s) of it is free.
MOST_COMPILING_S = 10.0

# So often within a mission it is asked whether there is still time for it.
STEPS = 16

AS_IT_IS = Change("", "the plan as it is", {})


class OutOfTime(Exception):
    """There is no time to end this mission."""


@dataclass(frozen=True)
class Trial:
    """One mission: the worst AUV's mean error, and each AUV's with and without fixes (n, 2), m."""

    error: float
    own: Floats


class Trials:
    """Trials of changes by seed, each flown once, until the time is up."""

    def __init__(self, scenario: Scenario, seconds: float, told: Told | None = None) -> None:
        """Take the plan and how long (s) all trials may take from now on.

        `told` hears after each mission how many were flown, and how much time (s) is left.
        """
        self._began, self._seconds, self._told = perf_counter(), seconds, told
        self._compiled = compiling_s()
        self._plan = changed(scenario, {"record.detail": "summary"}) or scenario
        self._flown: dict[tuple[Change, int], Trial] = {}
        self._spent: dict[Change, list[float]] = {}
        self.failed: dict[Change, str] = {}

    @property
    def missions(self) -> int:
        """How many missions were flown to their end."""
        return len(self._flown)

    @property
    def spent(self) -> float:
        """Time (s) since the trials began, without compiling."""
        compiling = min(compiling_s() - self._compiled, MOST_COMPILING_S)
        return perf_counter() - self._began - compiling

    @property
    def left(self) -> float:
        """Time (s) that is left."""
        return self._seconds - self.spent

    @property
    def quickest(self) -> float | None:
        """How long (s) the quickest took: the first loads what others find; None where none was
        flown.
        """
        return min((min(it) for it in self._spent.values()), default=None)

    @property
    def setup(self) -> float:
        """How long (s) the first mission of a change takes more than others: routes are kept."""
        extra = [spent[0] - median(spent[1:]) for spent in self._spent.values() if len(spent) > 1]
        return max(0.0, median(extra)) if extra else 0.0

    def cost(self, change: Change) -> float:
        """Return how long (s) one more mission with a change takes, as far as one knows."""
        spent, plain = self._spent.get(change), min(self._spent.get(AS_IT_IS, [0.0]))
        if not spent:
            return plain
        return min(spent) if len(spent) > 1 else min(spent[0], max(spent[0] - self.setup, plain))

    def fly(self, change: Change, seed: int) -> Trial:
        """Return the trial of a change at a seed.

        Raises:
            OutOfTime: when it would not be over in time.
            ValueError: when such a mission cannot be flown.
        """
        if (change, seed) in self._flown:
            return self._flown[change, seed]
        if change in self.failed:
            raise ValueError(self.failed[change])
        if self.left < self.cost(change):
            raise OutOfTime
        began = self.spent
        try:
            trial = self._flown[change, seed] = self._trial(change, seed)
        except FAILURES as error:
            self.failed[change] = str(error) or type(error).__name__
            raise ValueError(self.failed[change]) from error
        self._spent.setdefault(change, []).append(self.spent - began)
        if self._told is not None:
            self._told(self.missions, self.left)
        return trial

    def _trial(self, change: Change, seed: int) -> Trial:
        plan = changed(self._plan, change.settings)
        if plan is None:
            raise ValueError(f"{change.words}: contradicts the plan")
        tables = self._in_time(Mission(plan, seed)).arrow
        mission, auvs = tables["mission"].to_pylist()[0], tables["auvs"]
        own = [auvs[name].to_numpy() for name in ("position_error_m", "imu_error_m")]
        return Trial(mission["worst_position_error_m"], np.column_stack(own))

    def _in_time(self, mission: Mission) -> Result:
        """Return what a mission comes to.

        Raises:
            OutOfTime: when the time is up before it ends.
        """
        for step in range(1, STEPS):
            mission.advance(mission.scenario.duration_s * step / STEPS)
            if self.left < 0:
                raise OutOfTime
        return mission.result()

    def differences(self, change: Change, seeds: list[int]) -> Floats:
        """Return what a change did (m) to the worst AUV's error at those seeds that were flown."""
        pairs = [(self._flown.get((AS_IT_IS, s)), self._flown.get((change, s))) for s in seeds]
        return np.array([two.error - one.error for one, two in pairs if one and two])

    def unchanged(self, seeds: list[int]) -> list[Trial]:
        """Return the missions of the plan as it is that were flown at these seeds."""
        return [self._flown[AS_IT_IS, s] for s in seeds if (AS_IT_IS, s) in self._flown]
