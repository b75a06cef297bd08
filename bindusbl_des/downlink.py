"""The MF band: a frame of fixes travels from one ASV to every AUV in range."""

import math
from collections.abc import Sequence

import simpy

from .acoustics import travel_time
from .events import Fix
from .fleet import Asv, Auv
from .slots import Clock


class MfDownlink:
    """The MF downlink: a fix is delivered when its frame has reached the AUV, or never."""

    def __init__(
        self,
        env: simpy.Environment,
        auvs: Sequence[Auv],
        *,
        mf_range: float,
        sound_speed: float,
        clock: Clock,
    ) -> None:
        self._env, self._auvs = env, auvs
        self._range, self._sound_speed, self._clock = mf_range, sound_speed, clock

    def send(self, fix: Fix, asv: Asv, time: float, airtime: float) -> None:
        """Send a fix in a frame that starts at `time` and lasts `airtime` (s) (eq. deliver_tick).

        The end of the frame decides: it leaves when the airtime is over and reaches an AUV that
        has moved on meanwhile.
        """
        auv = self._auvs[fix.auv]
        fix.broadcast_at_s, fix.broadcast_by = time, asv.index
        place, vessel = auv.vehicle.at(time), asv.vehicle.at(time)
        if math.hypot(place.x - vessel.x, place.y - vessel.y) > self._range:
            fix.outcome = "out_of_range"
            return
        ends = time + airtime
        travel = travel_time(asv.vehicle.at(ends), auv.vehicle.at, ends, self._sound_speed)
        self.deliver(fix, self._clock.after(time, airtime + travel))

    def reply(self, fix: Fix, asv: Asv, time: float) -> None:
        """Answer a ping that reached the ASV at `time` (s); the answer takes only its way."""
        auv = self._auvs[fix.auv]
        fix.broadcast_at_s, fix.broadcast_by = time, asv.index
        travel = travel_time(asv.vehicle.at(time), auv.vehicle.at, time, self._sound_speed)
        two_way = time - fix.pinged_at_s + travel
        self.deliver(fix, self._clock.after(fix.pinged_at_s, two_way))

    def deliver(self, fix: Fix, instant: float) -> None:
        """Let an AUV have a fix at an instant (s), but not before now."""
        instant = max(instant, self._env.now)
        event = self._env.timeout(instant - self._env.now)
        event.callbacks.append(lambda _: self._correct(fix, instant))

    def _correct(self, fix: Fix, time: float) -> None:
        navigator = self._auvs[fix.auv].navigator
        innovation = navigator.correct((fix.x_m, fix.y_m), fix.pinged_at_s, time)
        fix.delivered_at_s = time
        fix.latency_s = time - fix.pinged_at_s
        fix.innovation_m = math.hypot(*innovation)
        fix.outcome = "delivered"
