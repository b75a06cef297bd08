"""Carrier sense with random backoff: AUVs listen before they ping, and hold back while they hear.

The rule is that of ns-3's `UanMacCw` (Parrish, Tracy, Roy, Arabshahi and Fox, "System design
considerations for undersea networks", IEEE JSAC 26(9), 2008).  An AUV that hears nothing as it has
something to send pings at once.  One that hears another's ping, or is pinging itself, draws a
number of slots and counts them down while it is quiet; the count stands still while a ping is
heard.  What else it has to send meanwhile is dropped.
"""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from heapq import heapify, heapreplace
from math import dist, inf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...acoustics.channel import AskedChannel, between
from ...acoustics.propagation import TOUCH, SignalBand
from ...acoustics.travel_time import travel_time
from ...core.arrays import Floats
from ...vehicles.fleet import VehicleFleet
from ...vehicles.motion import places
from ...vehicles.vehicle import Place
from ..conflicts import hearing
from .aloha import Sending


class PingInFlight(NamedTuple):
    """A ping on its way to other AUVs: who sent it when (s) and where, to which (n,) it is a sound,
    how far (m) the farthest of these was, and how much later (s) than straight on it is there (n,).
    """

    auv: int
    sent_at_s: float
    place: Place
    audible: NDArray[np.bool_]
    farthest_m: float
    late_s: Floats


class Listening:
    """AUVs that hear each other: all pings that are still on their way to one of them.

    A ping is a sound to another AUV as it is to an ASV: on the disc within the HF range of where
    that is as the ping begins, on other channels wherever it would drown a signal.  When it arrives
    there is the light-time equation's; it lasts as long as it was sent for.
    """

    def __init__(self, auvs: VehicleFleet, band: SignalBand, channel: AskedChannel | None) -> None:
        """Take the fleet and the HF band; a channel is asked, None is the disc."""
        self._auvs, self._band, self._channel = auvs, band, channel
        self._pings: deque[PingInFlight] = deque()

    def begin(self, auv: int, time: float) -> None:
        """Note that an AUV begins to ping at an instant (s)."""
        self._auvs.advance(time)
        all_places = places(self._auvs.motion, time)[:, :3]
        here = all_places[[auv]]
        signals = between(time, here, all_places, self._band.reach, calling=False)
        late = np.zeros(len(all_places))
        if self._channel is not None:
            (found,) = self._channel.prospects(signals)
            audible, late = found["sound"] > 0.0, found["late_s"]
        else:
            audible = hearing(here, all_places, self._band.reach, self._band.slant)[0]
        audible[auv] = False
        farthest = float(signals.ranges[0][audible].max(initial=0.0))
        place = self._auvs.vehicles[auv].at(time)
        self._pings.append(PingInFlight(auv, time, place, audible, farthest, late))

    def forget(self, time: float) -> None:
        """Forget pings that were over everywhere by an instant (s): nobody asks of earlier."""
        lasts = self._band.duration
        while self._pings:
            first = self._pings[0]
            # AUVs that recede are met later than where they were; none is half as fast as sound
            way = 2.0 * first.farthest_m / self._band.sound_speed + max(first.late_s.max(), 0.0)
            if first.sent_at_s + way + lasts >= time:
                break
            self._pings.popleft()

    def heard(self, auv: int, since: float, time: float) -> list[float]:
        """Return when (s) others' pings began to arrive at an AUV, in order: those that it hears
        anything of between two instants (s), the later of which is now.

        One that begins as another ends is heard on.
        """
        self._auvs.advance(time)
        # nobody knows of a ping that begins at the very instant, be it side by side
        known = (ping for ping in self._pings if ping.sent_at_s < time - TOUCH)
        arrivals = (self._arrival(ping, auv, time) for ping in known)
        lasts = self._band.duration
        return sorted(at for at in arrivals if at <= time + TOUCH and at + lasts > since + TOUCH)

    def _arrival(self, ping: PingInFlight, auv: int, time: float) -> float:
        """Return when (s) a ping began to arrive at an AUV; infinite if it has not by now (s)."""
        vehicle, speed = self._auvs.vehicles[auv], self._band.sound_speed
        begins = ping.sent_at_s + float(ping.late_s[auv])
        lasts = time + TOUCH - begins
        under_way = dist(ping.place[:3], vehicle.at(time)[:3]) > speed * lasts
        if under_way or not ping.audible[auv]:
            return inf

        def so_far(instant: float) -> Place:
            return vehicle.at(min(instant, time))

        return begins + travel_time(ping.place, so_far, begins, speed)


@dataclass(slots=True)
class HeldPing:
    """A ping that is held back: since when (s) there has been one, for how long (s) it is still
    counted down, and the instant (s) up to which that takes account of all that was heard.
    """

    packet_at_s: float
    left_s: float
    counted_to_s: float


class Csma:
    """Carrier sense: who pings when, by what each AUV hears."""

    def __init__(
        self,
        packets: Sequence[Iterator[float]],
        listening: Listening,
        backoff: Callable[[int], float],
        ping_s: float,
    ) -> None:
        """Take the instants (s) at which each AUV has something to send; what AUVs hear; how long
        (s) an AUV is to hold back in quiet, drawn whenever it is asked for; how long it pings (s).
        """
        self._packets, self._listening, self._backoff = packets, listening, backoff
        self._lasts = ping_s
        self._next = [(next(own), auv) for auv, own in enumerate(packets)]
        heapify(self._next)
        self._held: dict[int, HeldPing] = {}
        self._silent_from = [0.0] * len(packets)  # when the own ping of each AUV is over

    @property
    def next_at(self) -> float:
        """The next instant (s) at which an AUV has something to send, or has counted down."""
        return self._next[0][0]

    def due(self) -> Sending:
        """Return the AUV that pings then, if it does."""
        time, auv = self._next[0]
        self._listening.forget(min([time, *(held.counted_to_s for held in self._held.values())]))
        held = self._held.get(auv)
        if held is None:
            if not self._busy(auv, time, time):
                return self._ping(auv, time, time)
            held = self._held[auv] = HeldPing(time, self._backoff(auv), time)
        counted_down = self._count_down(auv, held, time)
        if counted_down <= time:
            del self._held[auv]
            return self._ping(auv, time, held.packet_at_s)
        heapreplace(self._next, (counted_down, auv))
        return Sending([])

    def _ping(self, auv: int, time: float, packet_at: float) -> Sending:
        self._listening.begin(auv, time)
        self._silent_from[auv] = time + self._lasts
        later = next(instant for instant in self._packets[auv] if instant > time)
        heapreplace(self._next, (later, auv))
        return Sending([auv], time - packet_at)

    def _busy(self, auv: int, since: float, time: float) -> list[tuple[float, float]]:
        """Return from when to when (s) an AUV hears a ping between two instants (s), or sends."""
        begun = self._listening.heard(auv, since, time)
        if self._silent_from[auv] > since:
            begun = sorted([*begun, self._silent_from[auv] - self._lasts])
        return [(at, at + self._lasts) for at in begun]

    def _count_down(self, auv: int, held: HeldPing, time: float) -> float:
        """Count down what is left up to an instant (s); return when it may be over (s)."""
        for begins, ends in self._busy(auv, held.counted_to_s, time):
            held.left_s = max(held.left_s - max(begins - held.counted_to_s, 0.0), 0.0)
            held.counted_to_s = max(held.counted_to_s, ends)
        return held.counted_to_s + held.left_s
