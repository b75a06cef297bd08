"""What a plan may take, and how far it is in one line."""

import math
from collections.abc import Sequence
from time import monotonic

from ..campaigns.workers.batches import Row
from ..core.progress import ProgressLine, duration
from .flying import Flights, Pair
from .measuring import values
from .questions.question import Question
from .selection.goals import Floats


class Budget:
    """How many missions of a plan may still be flown, and for how long (s); None: as many, and as
    long, as its rule takes.

    Time counts while missions are flown, so that compiling and predicting take nothing of it.
    `cut_by` is the option that left missions unflown, empty while none did; `best` is told besides.
    """

    def __init__(self, question: Question, *, quiet: bool) -> None:
        self.question = question
        self.flown = 0
        self.best = self.cut_by = ""
        self._most = question.budget_missions
        self._seconds = question.budget_s
        self._took = 0.0
        self._began = self._asked = math.nan
        self._doing = "proposing teams"
        self._line = ProgressLine(quiet=quiet)

    def sample(self, missions: Flights, pairs: Sequence[Pair]) -> Floats:
        """Return the goals' values of missions, which are flown where that has not been done; of
        the first of them only where the budget is not enough for all.
        """
        self._began, before = monotonic(), self._took
        until = math.inf if self._seconds is None else self._began + self._seconds - before
        most = None if self._most is None else self._most - self.flown
        self._asked = self.flown + missions.lacking(pairs)
        try:
            rows = missions.rows(pairs, until, most)
        finally:
            self._took = before + monotonic() - self._began
            self._began = math.nan
        if len(rows) < len(pairs):
            used_up = self._most is not None and self.flown >= self._most
            by_missions = f"--budget-missions {self._most}"
            self.cut_by = by_missions if used_up else f"--budget-s {self._seconds:g}"
        return values(self.question.goals, rows)

    def begin(self, what: str) -> None:
        """Say what is done from now on."""
        self._doing = what
        self._line.tell(self._text)

    def note(self, rows: Sequence[Row]) -> None:
        """Count missions that have ended."""
        self.flown += len(rows)
        self._line.tell(self._text)

    def end(self) -> None:
        """End the line."""
        self._line.end(self._text)

    def _text(self) -> str:
        took = self._took + (0.0 if math.isnan(self._began) else monotonic() - self._began)
        left = [f"{self._doing}: {self.flown} missions flown"]
        if self.flown and self._asked > self.flown:
            seconds = took / self.flown * (self._asked - self.flown)
            left.append(f"at least {duration(seconds)} left")
        if self._seconds is not None:
            left.append(f"cut off in {duration(max(self._seconds - took, 0.0))}")
        return ", ".join(left) + (f"; best so far {self.best}" if self.best else "")
