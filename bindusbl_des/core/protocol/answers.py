"""The answers to an ASV's calls, for which polling waits."""

from collections.abc import Generator
from functools import partial

import simpy

from ..records.events import HEARD
from ..records.rows import Recorder
from .outcomes import Outcomes
from .slots import Slots
from .steps import moment

SlotNumber = tuple[int, int]  # number of a round, and of a slot in it


class Answers:
    """The answers to the calls of a slot; the slot ends when each caller has decoded its own, and
    the frame that then answers it, if any, is over.

    If a caller gets no answer, or does not decode it, the slot takes its full length.
    """

    def __init__(
        self, env: simpy.Environment, outcomes: Outcomes, record: Recorder, slots: Slots
    ) -> None:
        self._env, self._outcomes, self._record, self._slots = env, outcomes, record, slots
        self._slot, self._missing, self._last = (-1, -1), 0, 0.0
        self._complete = env.event()

    def begin(self, slot: SlotNumber, calls: int) -> None:
        """Begin a slot in which `calls` AUVs are called; answers to other slots do not count."""
        self._slot, self._missing, self._complete = slot, calls, self._env.event()

    def expect(self, slot: SlotNumber, pings: range, caller: int) -> None:
        """Count those of the `pings`, answers in a slot, that the calling ASV `caller` decodes."""
        self._outcomes.when_over(self._env, pings, partial(self._decode, slot), caller)

    def wait(self, ends: float) -> Generator[simpy.Event, None, float]:
        """Wait for all answers, at most until `ends` (s); return when (s) the slot is over."""
        complete = self._complete
        yield complete | moment(self._env, ends)
        if not complete.triggered:
            return ends
        over = min(self._slots.clock.after(self._last, self._slots.answer), ends)
        if over > self._env.now:
            yield moment(self._env, over)
        return over

    def _decode(self, slot: SlotNumber, row: int, arrived: float) -> None:
        if slot == self._slot and self._outcomes.outcome_of(row)[0] == HEARD:
            self._missing, self._last = self._missing - 1, arrived + self._outcomes.band.duration
            if self._missing == 0:
                self._complete.succeed()
