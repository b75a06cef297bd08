"""The HF band: who hears a ping, how late, and whether at all."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np
import simpy

from .events import IN_FLIGHT
from .fleet import Fleet
from .propagation import ARRIVED_AT, OF_AUV, OF_PING, OUTCOME, spread
from .reception import ESTIMATE, NOBODY, Loss, settle
from .recorder import Recorder
from .streams import NoiseStore, Streams
from .usbl import NOISE_WIDTH, Usbl
from .vehicles import Place


@dataclass(slots=True)
class Flight:
    """A ping under way; if it answers an interrogation, by which ASV and how long that took (s)."""

    ping: int
    round: int
    auv: int
    sent_at: float
    caller: int = -1
    called: float = 0.0
    answered: bool = False


@dataclass(slots=True)
class Heard:
    """A ping that has been heard: by which ASVs, of which receptions, and their fix of it."""

    flight: Flight
    asvs: list[int]
    rows: range
    estimate: list[float]


# Schedules that receptions of a ping (their rows) are decided at an instant (s).
Passes = Callable[[range, float], None]


class Listener(Protocol):
    """What the surface fleet does with pings."""

    def expect(self, passes: Passes, rows: range, ends: float) -> None:
        """Choose when receptions are decided, and which together; all have arrived by `ends`."""

    def hear(self, heard: Heard) -> None:
        """Take note of a ping that ASVs have heard whose receptions were decided together."""


class Uplink:
    """The HF uplink: sound spreads at a finite speed, overlapping arrivals destroy each other."""

    def __init__(
        self,
        env: simpy.Environment,
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
        listener: Listener,
    ) -> None:
        self._env, self._auvs, self._asv_count, self._record = env, auvs, len(asvs), record
        self._range, self._slant = hf_range, metric == "slant"
        self._duration = ping_duration
        self._asvs, self._sound_speed, self._everything = asvs, sound_speed, record.everything
        self._longest = 0.0
        self._instruments = (*loss, *asvs.motion, usbl.array, usbl.metric, usbl.levels)
        self._listener = listener
        self._noise = NoiseStore(streams, len(auvs), len(asvs), NOISE_WIDTH + 1)
        self._estimate, self._hearers = np.empty(ESTIMATE), np.empty(len(asvs), dtype=np.int64)

    def send(
        self,
        round_number: int,
        slot: int,
        auv: int,
        time: float,
        interrogation: tuple[int, float] = (-1, 0.0),
    ) -> None:
        """Let an AUV ping now, at `time` (s); its sound sets out to every ASV."""
        pings, receptions = self._record.pings, self._record.receptions
        ping, first = pings.count, receptions.count
        self._auvs.reach(time)
        written, longest = spread(
            *self._auvs.motion, auv, round_number, slot, time, *self._asvs.motion, self._range,
            self._slant, self._sound_speed, self._everything, pings.room_for(1), ping,
            receptions.room_for(self._asv_count), first,
        )  # fmt: skip
        pings.count += 1
        receptions.count += written
        if longest >= 0.0:  # somebody is in range
            self._longest = max(self._longest, longest)
            passes = partial(self._passes, Flight(ping, round_number, auv, time, *interrogation))
            ends = time + longest + self._duration
            self._listener.expect(passes, range(first, first + written), ends)

    def _passes(self, flight: Flight, rows: range, ends: float) -> None:
        event = self._env.timeout(max(ends - self._env.now, 0.0))
        event.callbacks.append(partial(self._decide, flight, rows))

    def _decide(self, flight: Flight, rows: range, _: simpy.Event) -> None:
        """Decide receptions when all sound that could overlap theirs is known."""
        count = self._settle(flight, rows)
        if count:
            asvs = self._hearers[:count].tolist()
            self._listener.hear(Heard(flight, asvs, rows, self._estimate.tolist()))

    def _settle(self, flight: Flight, rows: range) -> int:
        noise = self._noise
        while True:
            heard = settle(
                rows.start, rows.stop, self._record.receptions.count, flight.caller, flight.called,
                self._duration, self._longest, self._record.pings.array,
                self._record.receptions.array, *self._instruments, noise.shelf, noise.taken,
                noise.blocks, self._estimate, self._hearers,
            )  # fmt: skip
            if heard >= 0:
                return heard
            noise.refill(flight.auv, NOBODY - heard)

    def close(self, time: float) -> None:
        """Decide what has arrived by the end of the mission (s) of pings still under way."""
        rows = self._record.receptions.rows
        over = (rows[:, OUTCOME] == IN_FLIGHT) & (rows[:, ARRIVED_AT] + self._duration < time)
        for row in np.flatnonzero(over).tolist():
            ping, auv = int(rows[row, OF_PING]), int(rows[row, OF_AUV])
            self._settle(Flight(ping, -1, auv, math.nan), range(row, row + 1))

    def in_range(self, place: Place, vessel: Place) -> bool:
        """Tell whether an AUV and an ASV are within HF range; the edge counts."""
        rise = place.z - vessel.z if self._slant else 0.0
        square = (place.x - vessel.x) ** 2 + (place.y - vessel.y) ** 2 + rise**2
        return square <= self._range**2
