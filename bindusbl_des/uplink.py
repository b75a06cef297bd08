"""The HF band: who hears a ping, how late, and whether at all."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import simpy
from numpy.typing import NDArray

from .events import COLLIDED, HEARD, IN_FLIGHT, LOST
from .fleet import Fleet
from .propagation import ARRIVED_AT, AT_ASV, HEARD_BY, OUTCOME, SLANT_RANGE, TRAVEL_TIME, spread
from .recorder import Recorder
from .streams import Draws, Purpose, Streams
from .usbl import NOISE_WIDTH
from .vehicles import Place

Row = NDArray[np.float64]

# Arrivals that overlap by less (s) only touch: rounding of the instants is far smaller.
TOUCH = 1e-9


# Who has heard a ping: the ASV, its row in the record, the travel time (s) by which it ranges, and
# the noise of its instruments.
Heard = tuple[int, int, float, Row]


@dataclass(slots=True)
class Flight:
    """A ping under way, with what has become of it at the ASVs it can reach.

    A ping that answers an interrogation names the ASV and how long its call travelled (s).
    """

    ping: int
    round: int
    auv: int
    sent_at: float
    interrogation: tuple[int, float] | None = None
    pending: int = 0
    answered: bool = False
    heard: list[Heard] = field(default_factory=list)

    def travelled(self, asv: int, travel_time: float) -> float:
        """Return the time (s) by which an ASV ranges: half the round trip if it called (eq. rtt).

        The AUV's turnaround is known and removed.
        """
        if self.interrogation is None or self.interrogation[0] != asv:
            return travel_time
        return (self.interrogation[1] + travel_time) / 2


@dataclass(slots=True)
class Arrival:
    """A ping on its way to one ASV: its row in the record, and when its sound is there (s)."""

    row: int
    asv: int
    starts: float
    ends: float
    travel_time: float
    slant_range: float


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
        loss: Callable[[float], float],
        streams: Streams,
        record: Recorder,
        settled: Callable[[Flight], None],
    ) -> None:
        self._env, self._auvs, self._asvs, self._record = env, auvs, asvs, record
        self._range, self._slant = hf_range, metric == "slant"
        self._sound_speed = sound_speed
        self._duration = ping_duration
        self._loss = loss
        self._streams = streams
        self._settled = settled
        self._draws: dict[tuple[int, int], Draws] = {}
        self._arrivals: list[list[Arrival]] = [[] for _ in range(len(asvs))]

    def send(
        self,
        round_number: int,
        slot: int,
        auv: int,
        time: float,
        interrogation: tuple[int, float] | None = None,
    ) -> None:
        """Let an AUV ping now, at `time` (s); its sound sets out to every ASV."""
        pings, receptions = self._record.pings, self._record.receptions
        ping, first = pings.count, receptions.count
        self._auvs.reach(time)
        written = spread(
            *self._auvs.motion, auv, round_number, slot, time, *self._asvs.motion, self._range,
            self._slant, self._sound_speed, self._record.everything, pings.room_for(1), ping,
            receptions.room_for(len(self._asvs)), first,
        )  # fmt: skip
        pings.count += 1
        receptions.count += written
        flight = Flight(ping, round_number, auv, time, interrogation)
        for row, line in enumerate(receptions.array[first : first + written].tolist(), first):
            if line[OUTCOME] == IN_FLIGHT:
                self._await(flight, row, line)

    def in_range(self, place: Place, vessel: Place) -> bool:
        """Tell whether an AUV and an ASV are within HF range; the edge counts."""
        rise = place.z - vessel.z if self._slant else 0.0
        square = (place.x - vessel.x) ** 2 + (place.y - vessel.y) ** 2 + rise**2
        return square <= self._range**2

    def _await(self, flight: Flight, row: int, line: list[float]) -> None:
        """Schedule the instant at which a ping has arrived at an ASV in range."""
        asv, starts = int(line[AT_ASV]), line[ARRIVED_AT]
        ends = starts + self._duration
        arrival = Arrival(row, asv, starts, ends, line[TRAVEL_TIME], line[SLANT_RANGE])
        self._arrivals[asv].append(arrival)
        flight.pending += 1
        event = self._env.timeout(max(ends - self._env.now, 0.0))
        event.callbacks.append(partial(self._arrive, flight, arrival))

    def _arrive(self, flight: Flight, arrival: Arrival, _: simpy.Event) -> None:
        """Decide at the end of an arrival, when everything that could overlap it is known."""
        noise = self._noise(flight.auv, arrival.asv)  # drawn before branching
        if self._overlapped(arrival):
            outcome = COLLIDED
        elif _uniform(noise[NOISE_WIDTH]) < self._loss(arrival.slant_range):
            outcome = LOST
        else:
            outcome = HEARD
            self._record.pings.array[flight.ping, HEARD_BY] += 1
            travelled = flight.travelled(arrival.asv, arrival.travel_time)
            flight.heard.append((arrival.asv, arrival.row, travelled, noise))
        self._record.receptions.array[arrival.row, OUTCOME] = outcome
        flight.pending -= 1
        self._settled(flight)

    def _overlapped(self, arrival: Arrival) -> bool:
        """Tell whether another ping overlaps this one here; touching is no overlap."""
        # Arrivals end in the order in which they start, so what ended before can overlap no more.
        begun = arrival.starts + TOUCH
        known = [other for other in self._arrivals[arrival.asv] if other.ends > begun]
        self._arrivals[arrival.asv] = known
        return sum(1 for other in known if other.starts < arrival.ends - TOUCH) > 1

    def _noise(self, auv: int, asv: int) -> Row:
        draws = self._draws.get((auv, asv))
        if draws is None:
            stream = self._streams.of(Purpose.MEASUREMENT, auv, asv)
            draws = self._draws[auv, asv] = Draws(stream, NOISE_WIDTH + 1)
        return draws.normal()


def _uniform(normal: float) -> float:
    """Return the uniform number that belongs to a standard normal one."""
    return 0.5 * math.erfc(-normal / math.sqrt(2.0))
