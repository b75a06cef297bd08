"""The MF band: a frame of fixes travels from one ASV to every AUV in range."""

import math
from collections.abc import Sequence
from functools import partial

import numpy as np
import simpy

from .acoustics import travel_time
from .events import Fix
from .fleet import Auv, Fleet
from .motion import where
from .propagation import arrivals
from .slots import Clock

# Share of the way after which an arrival is worked out; vehicles are a thousand times slower.
NEARLY_THERE = 0.98


class MfDownlink:
    """The MF downlink: a fix is delivered when its frame has reached the AUV, or never."""

    def __init__(
        self,
        env: simpy.Environment,
        auvs: Sequence[Auv],
        auv_fleet: Fleet,
        asv_fleet: Fleet,
        *,
        mf_range: float,
        sound_speed: float,
        clock: Clock,
    ) -> None:
        self._env, self._auvs, self._auv_fleet, self._asv_fleet = env, auvs, auv_fleet, asv_fleet
        self._range, self._sound_speed, self._clock = mf_range, sound_speed, clock

    def send(self, fixes: Sequence[Fix], asv: int, time: float, airtime: float) -> None:
        """Send fixes in a frame that starts at `time` and lasts `airtime` (eq. deliver_tick)."""
        if not fixes:
            return
        fleet = self._auv_fleet
        fleet.reach(time)
        after = arrivals(
            *self._asv_fleet.motion, asv, time, airtime, *fleet.motion,
            np.array([fix.auv for fix in fixes]), self._range, fleet.foreseen, self._sound_speed,
        )  # fmt: skip
        reached = []
        for fix, delay in zip(fixes, after, strict=True):
            fix.broadcast_at_s, fix.broadcast_by = time, asv
            if math.isnan(delay):
                fix.outcome = "out_of_range"
            elif fleet.foreseen:
                self.deliver(fix, self._clock.after(time, delay))
            else:
                reached.append(fix)
        if reached:  # they steer meanwhile by other fixes
            event = self._env.timeout(airtime)
            event.callbacks.append(lambda _: self._leave(reached, asv, time, airtime))

    def _leave(self, fixes: Sequence[Fix], asv: int, time: float, airtime: float) -> None:
        """Let the end of a frame set out to AUVs that have moved since the frame began."""
        ends = time + airtime
        vessel = where(*self._asv_fleet.motion, asv, ends)
        for fix in fixes:
            place = self._auvs[fix.auv].vehicle.at(ends)
            event = self._env.timeout(
                NEARLY_THERE * math.dist(vessel[:3], place[:3]) / self._sound_speed
            )
            event.callbacks.append(partial(self._arrive, fix, asv, time, airtime))

    def _arrive(self, fix: Fix, asv: int, time: float, airtime: float, _: simpy.Event) -> None:
        """Find the exact arrival when it is near: who steers by fixes has no sure future."""
        travel = self._travel(asv, fix.auv, time + airtime)
        self.deliver(fix, self._clock.after(time, airtime + travel))

    def _travel(self, asv: int, auv: int, time: float) -> float:
        """Return how long (s) a sound that leaves an ASV at an instant (s) is on its way."""
        vessel = self._asv_fleet.vehicles[asv].at(time)
        return travel_time(vessel, self._auvs[auv].vehicle.at, time, self._sound_speed)

    def reply(self, fix: Fix, asv: int, time: float) -> None:
        """Answer a ping that reached the ASV at `time` (s); the answer takes only its way."""
        fix.broadcast_at_s, fix.broadcast_by = time, asv
        two_way = time - fix.pinged_at_s + self._travel(asv, fix.auv, time)
        self.deliver(fix, self._clock.after(fix.pinged_at_s, two_way))

    def deliver(self, fix: Fix, instant: float) -> None:
        """Let an AUV have a fix at an instant (s), but not before now."""
        instant = max(instant, self._env.now)
        event = self._env.timeout(instant - self._env.now)
        event.callbacks.append(partial(self._correct, fix, instant))

    def _correct(self, fix: Fix, time: float, _: simpy.Event) -> None:
        self._auv_fleet.reach(time)  # up to now AUVs have steered without this fix
        navigator = self._auvs[fix.auv].navigator
        innovation = navigator.correct((fix.x_m, fix.y_m), fix.pinged_at_s, time)
        fix.delivered_at_s = time
        fix.latency_s = time - fix.pinged_at_s
        fix.innovation_m = math.hypot(*innovation)
        fix.outcome = "delivered"
