"""What the surface fleet does with the pings it has heard: collect them, or answer at once."""

from functools import partial

import numpy as np
import simpy
from numpy.typing import NDArray

from ..records.events import HEARD, IN_FLIGHT, Broadcast
from ..records.recorder import Recorder
from ..records.rows import Rows
from .hf.outcomes import Outcomes
from .mf.downlink import MfDownlink


class FixBatch:
    """The fixes that one broadcast carries: rows of the record."""

    def __init__(self, record: Recorder, rows: range) -> None:
        self.rows, self._record = rows, record

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def _fixes(self) -> Rows:
        return self._record.fixes.array[self.rows.start : self.rows.stop]

    @property
    def positions(self) -> NDArray[np.float64]:
        """x, y, z (m) of each fix, shape (k, 3)."""
        fixes = self._fixes
        return np.column_stack((fixes["x_m"], fixes["y_m"], fixes["z_m"]))

    def hearers(self, asvs: int) -> NDArray[np.bool_]:
        """Return whose measurements were fused for each fix, shape (k, `asvs`)."""
        fused = np.zeros((len(self.rows), asvs), dtype=np.bool_)
        if len(self.rows):
            fixes = self._fixes
            begin = int(fixes["first"].min())
            receptions = self._record.receptions.array[begin : int(fixes["end"].max())]
            heard = np.flatnonzero(receptions["outcome"] == HEARD)
            first = np.searchsorted(heard, fixes["first"] - begin)
            end = np.searchsorted(heard, fixes["end"] - begin)
            before = np.repeat(np.cumsum(end - first) - end, end - first)
            rows = heard[np.arange(len(before)) - before]
            fix = np.repeat(np.arange(len(fixes)), end - first)
            fused[fix, receptions["asv"][rows]] = True
        return fused


class FixQueue:
    """The fleet's shared queue: pings wait here for the next broadcast.

    A broadcast takes `most` fixes at most (None: any number); the others go on waiting.
    """

    def __init__(self, outcomes: Outcomes, record: Recorder, most: int | None = None) -> None:
        self._outcomes, self._record, self._most = outcomes, record, most
        self._waiting = 0  # fixes before this one have been taken

    def expect(self, pings: range) -> None:
        """Wait until pings have passed every ASV in range, which measure them together."""

    def has_fix(self, time: float) -> bool:
        """Tell whether a fix waits, of pings that have been heard by an instant (s)."""
        return self._outcomes.decide_passed(time).stop > self._waiting

    def take(self, time: float) -> FixBatch:
        """Return the fixes of pings that have been heard by an instant (s), the oldest first."""
        first, end = self._waiting, self._outcomes.decide_passed(time).stop
        self._waiting = end if self._most is None else min(end, first + self._most)
        return FixBatch(self._record, range(first, self._waiting))


class ReplyQueue:
    """No waiting: the first ASV that decodes a ping answers it with a fix of its own.

    The answer sets out `after` (s) the ping's front has arrived.  0 is what the paper's latencies
    need, although nobody can have decoded the ping by then; its duration is the earliest in truth.
    """

    def __init__(
        self,
        env: simpy.Environment,
        outcomes: Outcomes,
        downlink: MfDownlink,
        record: Recorder,
        after: float,
    ) -> None:
        self._env, self._outcomes, self._downlink, self._record = env, outcomes, downlink, record
        self._after = after

    def expect(self, pings: range) -> None:
        """Wait for each ping at each ASV in range by itself."""
        for ping in self._record.pings.array[pings.start : pings.stop]:
            for row in range(ping["first"], ping["end"]):
                reception = self._record.receptions.array[row]
                if reception["outcome"] == IN_FLIGHT:
                    self._hear_at(float(reception["arrived_at_s"]), int(ping["ping"]), row)

    def _hear_at(self, arrives: float, ping: int, row: int) -> None:
        ends = arrives + self._outcomes.band.duration
        event = self._env.timeout(max(ends - self._env.now, 0.0))
        event.callbacks.append(partial(self._hear, arrives, ping, row))

    def _hear(self, expected: float, ping: int, row: int, _: simpy.Event) -> None:
        """Answer a ping when it has just been heard for the first time."""
        self._outcomes.amend(self._env.now)
        arrived = float(self._record.receptions.array[row]["arrived_at_s"])
        if arrived > expected:  # the ASV was predicted to be nearer
            self._hear_at(arrived, ping, row)
        elif self._outcomes.decide(ping, row):
            fix, reception = self._record.fixes.count - 1, self._record.receptions.array[row]
            asv, time = int(reception["asv"]), float(reception["arrived_at_s"]) + self._after
            number = int(self._record.pings.array[ping]["round"])
            self._record.broadcasts.append(Broadcast(number, asv, time, 0.0, 0, 1))
            self._record.rounds[number].fixes += 1
            self._downlink.reply(fix, asv, time)

    def take(self, time: float) -> FixBatch:
        """Return no fixes: none has to wait."""
        return FixBatch(self._record, range(0))
