"""The HF band: who hears a ping, how late, and whether at all."""

from collections.abc import Sequence
from functools import cache, lru_cache, partial
from math import hypot

import numpy as np

from ..acoustics.propagation import spread
from ..core.streams import NoiseStore, Purpose, Streams
from ..records.columns import (
    ARRIVED_AT,
    AT_ASV,
    AUV,
    CALL_TIME,
    CALLED_AT,
    FIRST,
    OF_AUV,
    OF_PING,
    OUTCOME,
    PASSED_AT,
)
from ..records.events import IN_FLIGHT
from ..records.recorder import EventBuffer, Recorder
from ..usbl.instrument import NOISE_WIDTH, Usbl
from ..vehicles.fleet import Fleet
from ..vehicles.motion import Floats, Ints
from .calling import Call, interrogate
from .reception import NOBODY, LossTerms, decide, passed

# Factor on the longest way after which sound has met whoever was in range; nobody is as fast.
PASSED = 1.05

# What a ping that nobody called has from CALLED_AT to CALL_TIME
NO_CALL = np.full(CALL_TIME + 1 - CALLED_AT, np.nan)


@lru_cache(maxsize=4096)
def members(group: tuple[int, ...]) -> Ints:
    """Return a ping group as an array; small fleets have the same groups again and again."""
    return np.array(group, dtype=np.int64)


class Uplink:
    """The HF uplink: sound spreads at a finite speed, overlapping arrivals destroy each other.

    A ping is decided (what becomes of it at each ASV, and the fix of it) not before it has passed,
    when all sound that could overlap it is on record; it does not matter how long after.
    """

    def __init__(
        self,
        auvs: Fleet,
        asvs: Fleet,
        *,
        hf_range: float,
        metric: str,
        ping_duration: float,
        sound_speed: float,
        loss: LossTerms,
        usbl: Usbl,
        streams: Streams,
        strayed: Floats,
        record: Recorder,
    ) -> None:
        """Put a band together; `strayed` (n,), m2, as of :func:`.reception.decide` for each AUV."""
        self.ping_duration, self.hf_range, self.metric = ping_duration, hf_range, metric
        self._auvs, self._asvs, self._record, self._loss = auvs, asvs, record, loss
        self._limits = metric == "slant", hf_range, ping_duration, sound_speed
        self._instruments = (*loss, *asvs.motion, usbl.array, usbl.metric, usbl.levels, strayed)
        self._noise = NoiseStore(streams, len(auvs), len(asvs), NOISE_WIDTH + 1)
        self._luck = cache(partial(streams.of, Purpose.CALL))
        self._calls = EventBuffer(Call)
        self._undecided = 0  # pings before this one are decided

    def call(self, group: Sequence[int], callers: Ints, time: float) -> Floats:
        """Let ASVs call AUVs at an instant (s), one for each, who may name several in its call.

        Return for each AUV what a ping has from CALLED_AT to CALL_TIME, shape (n, 4).
        """
        calls, luck = self._calls, self._luck
        chances = [
            luck(auv, asv).random() for auv, asv in zip(group, callers.tolist(), strict=True)
        ]
        self._foresee(group, time)
        answers, sounds = np.empty((len(group), 2)), len(set(callers.tolist())) * len(self._asvs)
        calls.count = interrogate(
            members(tuple(group)), callers, np.array(chances), time, answers,
            calls.room_for(sounds), calls.count, *self._loss, *self._limits,
            *self._auvs.motion, *self._asvs.motion,
        )  # fmt: skip
        return np.column_stack((np.full(len(group), time), callers, answers))

    def _foresee(self, group: Sequence[int], time: float) -> None:
        """Make known where AUVs are until a sound sent at an instant (s) has met or passed them."""
        self._auvs.reach(time)
        if not self._auvs.foreseen:
            _, hf_range, _, sound_speed = self._limits
            deepest = max(self._auvs.vehicles[auv].at(time).z for auv in group)
            self._auvs.reach(time + PASSED * hypot(hf_range, deepest) / sound_speed)

    def send(
        self,
        round_number: int,
        slot: int,
        group: Sequence[int],
        time: float,
        call: Floats = NO_CALL,
    ) -> range:
        """Let AUVs ping now, at `time` (s); return their pings.

        Those who answer a `call`, or should have, are told of it as :meth:`call` does.
        """
        pings, receptions = self._record.pings, self._record.receptions
        first, count = pings.count, len(group)
        self._auvs.reach(time)
        receptions.count = spread(
            members(tuple(group)), round_number, slot, time, call, self._calls.count,
            pings.room_for(count), first, receptions.room_for(count * len(self._asvs)),
            receptions.count, self._record.everything, *self._limits,
            *self._auvs.motion, *self._asvs.motion,
        )  # fmt: skip
        pings.count = first + count
        return range(first, pings.count)

    def decide_passed(self, time: float) -> range:
        """Decide every ping that has passed all ASVs by an instant (s); return the new fixes."""
        pings, receptions, fixes = self._record.pings, self._record.receptions, self._record.fixes
        noise, first = self._noise, fixes.count
        while True:
            fixes.count, auv, asv = passed(
                time, self._undecided, pings.array, pings.count, receptions.array,
                receptions.count, fixes.room_for(pings.count - self._undecided), fixes.count,
                self._calls.rows, self.ping_duration, noise.shelf, noise.taken, noise.blocks,
                *self._instruments,
            )  # fmt: skip
            if asv == NOBODY:
                break
            for other in {asv, *self._bound_for(auv)}:  # at once: `passed` begins anew each time
                if noise.is_spent(auv, other):
                    noise.refill(auv, other)
        while self._undecided < pings.count and pings.array[self._undecided, PASSED_AT] == np.inf:
            self._undecided += 1
        return range(first, fixes.count)

    def _bound_for(self, auv: int) -> list[int]:
        """Return the ASVs that pings of an AUV are under way to."""
        first = int(self._record.pings.array[self._undecided, FIRST])
        rows = self._record.receptions.rows[first:]
        mine = (rows[:, OF_AUV] == auv) & (rows[:, OUTCOME] == IN_FLIGHT)
        bound: list[int] = rows[mine, AT_ASV].astype(np.int64).tolist()
        return bound

    def decide(self, ping: int, row: int) -> bool:
        """Decide one reception of a ping that has passed its ASV; tell whether it made a fix."""
        pings, receptions, fixes = self._record.pings, self._record.receptions, self._record.fixes
        noise = self._noise
        while True:
            made, dry = decide(
                ping, row, row + 1, pings.array, receptions.array, receptions.count,
                fixes.room_for(1), fixes.count, self._calls.rows, self.ping_duration, noise.shelf,
                noise.taken, noise.blocks, *self._instruments,
            )  # fmt: skip
            if dry == NOBODY:
                fixes.count += made
                return bool(made)
            noise.refill(int(pings.array[ping, AUV]), dry)

    def close(self, time: float) -> None:
        """Decide what of pings still under way has arrived by the end of the mission (s)."""
        receptions, fixes = self._record.receptions.rows, self._record.fixes
        arrived = receptions[:, ARRIVED_AT] + self.ping_duration < time
        count = fixes.count
        for row in np.flatnonzero((receptions[:, OUTCOME] == IN_FLIGHT) & arrived).tolist():
            self.decide(int(receptions[row, OF_PING]), row)
        fixes.count = count  # nobody waits for what others hear of them any more
