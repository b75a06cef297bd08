"""Direct replies: pings are answered one by one, by the ASVs that hear them (conventional USBL)."""

from functools import partial

import simpy

from ..records.events import IN_FLIGHT, Broadcast
from ..records.recorder import Recorder
from .hf.outcomes import Outcomes
from .mf.downlink import MfDownlink


class Replies:
    """The first ASV that decodes a ping answers it with a fix of its own; no fix waits.

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
