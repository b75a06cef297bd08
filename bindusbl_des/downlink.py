"""The MF band: a frame of fixes travels from one ASV to every AUV in range."""

import math
from collections.abc import Sequence

import simpy

from .acoustics import travel_time
from .events import Fix
from .fleet import Asv, Auv
from .slots import Clock
from .vehicles import Place

# Share of the way after which an arrival is worked out; vehicles are a thousand times slower.
NEARLY_THERE = 0.98


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

    def send(self, fixes: Sequence[Fix], asv: Asv, time: float, airtime: float) -> None:
        """Send fixes in a frame that starts at `time` and lasts `airtime` (eq. deliver_tick)."""
        vessel = asv.vehicle.at(time)
        reached = []
        for fix in fixes:
            fix.broadcast_at_s, fix.broadcast_by = time, asv.index
            place = self._auvs[fix.auv].vehicle.at(time)
            if math.hypot(place.x - vessel.x, place.y - vessel.y) > self._range:
                fix.outcome = "out_of_range"
            else:
                reached.append(fix)
        event = self._env.timeout(airtime)
        event.callbacks.append(lambda _: self._leave(reached, asv, time, airtime))

    def _leave(self, fixes: Sequence[Fix], asv: Asv, time: float, airtime: float) -> None:
        """Let the end of a frame set out to AUVs that have moved since the frame began."""
        ends = time + airtime
        vessel = asv.vehicle.at(ends)
        for fix in fixes:
            distance = math.dist(vessel[:3], self._auvs[fix.auv].vehicle.at(ends)[:3])
            event = self._env.timeout(NEARLY_THERE * distance / self._sound_speed)
            event.callbacks.append(
                lambda _, fix=fix: self._arrive(fix, vessel, time, airtime)  # type: ignore[misc]
            )

    def _arrive(self, fix: Fix, vessel: Place, time: float, airtime: float) -> None:
        """Find the exact arrival when it is near: who steers by fixes has no sure future."""
        ends = time + airtime
        vehicle = self._auvs[fix.auv].vehicle
        travel = travel_time(vessel, vehicle.at, ends, self._sound_speed)
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
