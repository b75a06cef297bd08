"""What AUVs hear of each other's pings, which is what they sense the channel by."""

from collections import deque
from math import dist, inf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...acoustics.channel import AskedChannel, between
from ...acoustics.propagation import TOUCH, Band
from ...acoustics.travel_time import travel_time
from ...vehicles.fleet import Fleet
from ...vehicles.motion import places
from ...vehicles.vehicle import Place
from ..conflicts import hearing


class Sounding(NamedTuple):
    """A ping on its way to other AUVs: who sent it when (s) and where, to which (n,) it is a sound,
    and how far (m) the farthest of these was.
    """

    auv: int
    sent_at_s: float
    place: Place
    audible: NDArray[np.bool_]
    farthest_m: float


class Listening:
    """AUVs that hear each other: all pings that are still on their way to one of them.

    A ping is a sound to another AUV as it is to an ASV: on the disc within the HF range of where
    that is as the ping begins, on other channels wherever it would drown a signal.  When it arrives
    there is the light-time equation's; it lasts as long as it was sent for.
    """

    def __init__(self, auvs: Fleet, band: Band, channel: AskedChannel | None) -> None:
        """Take the fleet and the HF band; a channel is asked, None is the disc."""
        self._auvs, self._band, self._channel = auvs, band, channel
        self._pings: deque[Sounding] = deque()

    def begin(self, auv: int, time: float) -> None:
        """Note that an AUV begins to ping at an instant (s)."""
        self._auvs.advance(time)
        all_places = places(self._auvs.motion, time)[:, :3]
        here = all_places[[auv]]
        signals = between(time, here, all_places, self._band.reach, calling=False)
        if self._channel is not None:
            audible = self._channel.prospects(signals)["sound"][0] > 0.0
        else:
            audible = hearing(here, all_places, self._band.reach, self._band.slant)[0]
        audible[auv] = False
        farthest = float(signals.ranges[0][audible].max(initial=0.0))
        place = self._auvs.vehicles[auv].at(time)
        self._pings.append(Sounding(auv, time, place, audible, farthest))

    def forget(self, time: float) -> None:
        """Forget pings that were over everywhere by an instant (s): nobody asks of earlier."""
        lasts = self._band.duration
        while self._pings:
            first = self._pings[0]
            # AUVs that recede are met later than where they were; none is half as fast as sound
            if first.sent_at_s + 2.0 * first.farthest_m / self._band.sound_speed + lasts >= time:
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

    def _arrival(self, ping: Sounding, auv: int, time: float) -> float:
        """Return when (s) a ping began to arrive at an AUV; infinite if it has not by now (s)."""
        vehicle, speed = self._auvs.vehicles[auv], self._band.sound_speed
        lasts = time + TOUCH - ping.sent_at_s
        under_way = dist(ping.place[:3], vehicle.at(time)[:3]) > speed * lasts
        if under_way or not ping.audible[auv]:
            return inf

        def so_far(instant: float) -> Place:
            return vehicle.at(min(instant, time))

        return ping.sent_at_s + travel_time(ping.place, so_far, ping.sent_at_s, speed)
