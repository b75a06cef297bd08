"""The HF band: who hears a ping, how late, and whether at all."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import simpy
from numpy.typing import NDArray

from .acoustics import travel_time
from .events import Ping, Reception
from .fleet import Asv, Auv
from .recorder import Recorder
from .streams import Draws, Purpose, Streams
from .usbl import NOISE_WIDTH
from .vehicles import Place

Row = NDArray[np.float64]

# Arrivals that overlap by less (s) only touch: rounding of the instants is far smaller.
TOUCH = 1e-9


@dataclass(slots=True)
class Flight:
    """A ping under way, with what has become of it at the ASVs it can reach.

    A ping that answers an interrogation names the ASV and how long its call travelled (s).
    """

    ping: Ping
    source: Place
    interrogation: tuple[int, float] | None = None
    pending: int = 0
    answered: bool = False
    heard: list[tuple[Reception, Row]] = field(default_factory=list)


Listener = Callable[[Flight], None]


class Uplink:
    """The HF uplink: sound spreads at a finite speed, overlapping arrivals destroy each other."""

    def __init__(
        self,
        env: simpy.Environment,
        asvs: list[Asv],
        *,
        hf_range: float,
        metric: str,
        ping_duration: float,
        sound_speed: float,
        loss: Callable[[float], float],
        streams: Streams,
        record: Recorder,
        settled: Listener,
    ) -> None:
        self._env, self._asvs, self._record = env, asvs, record
        self._square = hf_range**2
        self._slant = metric == "slant"
        self._duration = ping_duration
        self._sound_speed = sound_speed
        self._loss = loss
        self._streams = streams
        self._settled = settled
        self._draws: dict[tuple[int, int], Draws] = {}
        self._arrivals: list[list[tuple[float, float]]] = [[] for _ in asvs]

    def send(
        self,
        round_number: int,
        slot: int,
        auv: Auv,
        time: float,
        interrogation: tuple[int, float] | None = None,
    ) -> None:
        """Let an AUV ping now, at `time` (s); its sound sets out to every ASV."""
        source = auv.vehicle.at(time)
        ping = Ping(len(self._record.pings), round_number, slot, auv.index, time, *source[:3])
        self._record.pings.append(ping)
        flight = Flight(ping, source, interrogation)
        for asv in self._asvs:
            self._travel(flight, asv, time)

    def _travel(self, flight: Flight, asv: Asv, time: float) -> None:
        source = flight.source
        travel = travel_time(source, asv.vehicle.at, time, self._sound_speed)
        ping = flight.ping
        arrival = Reception(
            ping.ping, ping.auv, asv.index, time + travel, travel * self._sound_speed, travel
        )
        self._record.receptions.append(arrival)
        if not self.in_range(source, asv.vehicle.at(time)):
            arrival.outcome = "out_of_range"
            return
        ping.in_range_of += 1
        flight.pending += 1
        ends = arrival.arrived_at_s + self._duration
        self._arrivals[asv.index].append((arrival.arrived_at_s, ends))
        event = self._env.timeout(max(ends - self._env.now, 0.0))
        event.callbacks.append(lambda _: self._arrive(flight, arrival, ends))

    def in_range(self, place: Place, vessel: Place) -> bool:
        """Tell whether an AUV and an ASV are within HF range; the edge counts."""
        rise = place.z - vessel.z if self._slant else 0.0
        return (place.x - vessel.x) ** 2 + (place.y - vessel.y) ** 2 + rise**2 <= self._square

    def _arrive(self, flight: Flight, arrival: Reception, ends: float) -> None:
        """Decide at the end of an arrival, when everything that could overlap it is known."""
        noise = self._noise(arrival.auv, arrival.asv)  # drawn before branching
        if self._overlapped(arrival, ends):
            arrival.outcome = "collided"
        elif _uniform(noise[NOISE_WIDTH]) < self._loss(arrival.slant_range_m):
            arrival.outcome = "lost"
        else:
            arrival.outcome = "heard"
            flight.ping.heard_by += 1
            flight.heard.append((arrival, noise))
        flight.pending -= 1
        self._settled(flight)

    def _overlapped(self, arrival: Reception, ends: float) -> bool:
        """Tell whether another ping overlaps [arrival, ends) here; touching is no overlap."""
        starts = arrival.arrived_at_s
        # Arrivals end in the order in which they start, so what ended before can overlap no more.
        known = [span for span in self._arrivals[arrival.asv] if span[1] > starts + TOUCH]
        self._arrivals[arrival.asv] = known
        return sum(1 for start, _ in known if start < ends - TOUCH) > 1

    def _noise(self, auv: int, asv: int) -> Row:
        draws = self._draws.get((auv, asv))
        if draws is None:
            stream = self._streams.of(Purpose.MEASUREMENT, auv, asv)
            draws = self._draws[auv, asv] = Draws(stream, NOISE_WIDTH + 1)
        return draws.normal()


def _uniform(normal: float) -> float:
    """Return the uniform number that belongs to a standard normal one."""
    return 0.5 * math.erfc(-normal / math.sqrt(2.0))
