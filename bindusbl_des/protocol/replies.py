"""Direct replies: pings are answered one by one, by the ASVs that hear them (conventional USBL)."""

from functools import partial

import numpy as np
import simpy

from ..acoustics.messages import Message
from ..records.events import IN_FLIGHT
from ..records.rows import Recorder
from .hf.outcomes import Outcomes
from .mf.downlink import MfDownlink


class Replies:
    """The first ASV that decodes a ping answers it with a fix of its own; no fix waits.

    An answer is a frame of its own (`message`), which sets out once the ping is decoded.  An ASV
    hears no ping while it answers one, as transponders are locked out meanwhile, so that it never
    has two to answer; another ASV may hear the ping and answer it.

    Without a message answers take no airtime.  They set out `after` (s) the ping's front has
    arrived: 0 is what the paper's latencies need, although nobody can have decoded the ping by
    then; its duration is the earliest in truth.
    """

    def __init__(
        self,
        env: simpy.Environment,
        outcomes: Outcomes,
        downlink: MfDownlink,
        record: Recorder,
        message: Message | None,
        after: float,
    ) -> None:
        self._env, self._outcomes, self._downlink, self._record = env, outcomes, downlink, record
        self._message, self._after = message, after

    def expect(self, pings: range) -> None:
        """Wait for each ping at each ASV in range by itself."""
        for ping in self._record.pings.array[pings.start : pings.stop]:
            for row in range(ping["first"], ping["end"]):
                reception = self._record.receptions.array[row]
                if reception["outcome"] == IN_FLIGHT:
                    heard = partial(self._hear, int(ping["ping"]), row)
                    self._outcomes.when_over(self._env, row, heard)

    def _hear(self, ping: int, row: int, arrived: float) -> None:
        """Answer a ping when it has just been heard for the first time."""
        if self._outcomes.resolve(ping, row):
            reception = self._record.receptions.array[row]
            number = int(self._record.pings.array[ping]["round"])
            self._record.rounds[number].fixes += 1
            time, late = arrived + self._after, float(reception["bent_s"])
            self._answer(int(reception["asv"]), number, time, late)

    def _answer(self, asv: int, number: int, time: float, late: float) -> None:
        """Let an ASV answer with the last fix, in a round, at an instant (s)."""
        fix = self._record.fixes.count - 1
        if self._message is None:
            self._downlink.reply(number, fix, asv, time, late)
        else:
            self._downlink.send(number, np.array([fix]), asv, time, self._message)
