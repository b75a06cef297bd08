"""The HF band: who hears a ping, how late, and whether at all."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from .columns import ARRIVED_AT, AUV, OF_PING, OUTCOME, PASSED_AT
from .events import IN_FLIGHT
from .fleet import Fleet
from .motion import Ints
from .propagation import spread
from .reception import NOBODY, Loss, decide, passed
from .recorder import Recorder
from .streams import NoiseStore, Streams
from .usbl import NOISE_WIDTH, Usbl
from .vehicles import Place


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
        loss: Loss,
        usbl: Usbl,
        streams: Streams,
        record: Recorder,
    ) -> None:
        self.ping_duration = ping_duration
        self._auvs, self._asvs, self._record = auvs, asvs, record
        self._range, self._slant = hf_range, metric == "slant"
        self._limits = hf_range, ping_duration, sound_speed
        self._instruments = (*loss, *asvs.motion, usbl.array, usbl.metric, usbl.levels)
        self._noise = NoiseStore(streams, len(auvs), len(asvs), NOISE_WIDTH + 1)
        self._undecided = 0  # pings before this one are decided

    def send(
        self,
        round_number: int,
        slot: int,
        group: Sequence[int],
        time: float,
        caller: int = -1,
        call_time: float = 0.0,
    ) -> range:
        """Let AUVs ping now, at `time` (s); return their pings.

        When they answer the interrogation of an ASV, `call_time` (s) is how long that took.
        """
        pings, receptions = self._record.pings, self._record.receptions
        first, count = pings.count, len(group)
        self._auvs.reach(time)
        receptions.count = spread(
            members(tuple(group)), round_number, slot, time, caller, call_time,
            pings.room_for(count), first, receptions.room_for(count * len(self._asvs)),
            receptions.count, self._record.everything, self._slant, *self._limits,
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
                self.ping_duration, noise.shelf, noise.taken, noise.blocks, *self._instruments,
            )  # fmt: skip
            if asv == NOBODY:
                break
            noise.refill(auv, asv)
        while self._undecided < pings.count and pings.array[self._undecided, PASSED_AT] == np.inf:
            self._undecided += 1
        return range(first, fixes.count)

    def decide(self, ping: int, row: int) -> bool:
        """Decide one reception of a ping that has passed its ASV; tell whether it made a fix."""
        pings, receptions, fixes = self._record.pings, self._record.receptions, self._record.fixes
        noise = self._noise
        while True:
            made, dry = decide(
                ping, row, row + 1, pings.array, receptions.array, receptions.count,
                fixes.room_for(1), fixes.count, self.ping_duration, noise.shelf, noise.taken,
                noise.blocks, *self._instruments,
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

    def in_range(self, place: Place, vessel: Place) -> bool:
        """Tell whether an AUV and an ASV are within HF range; the edge counts."""
        rise = place.z - vessel.z if self._slant else 0.0
        square = (place.x - vessel.x) ** 2 + (place.y - vessel.y) ** 2 + rise**2
        return square <= self._range**2
