"""The MF band: a frame of fixes travels from one ASV to every AUV in range."""

import math
from functools import cache, partial
from typing import NamedTuple

import simpy

from ...acoustics.channel import AskedChannel, between
from ...acoustics.channels import FrameChannel
from ...acoustics.propagation import arrivals
from ...acoustics.travel_time import travel_time
from ...core.clock import Clock
from ...core.streams import Purpose, Streams
from ...navigation.navigators import Navigator
from ...records.events import IN_FLIGHT, LOST, OUT_OF_RANGE
from ...records.recorder import Recorder
from ...records.rows import Rows
from ...vehicles.fleet import Fleet
from ...vehicles.motion import places
from ...vehicles.vehicle import Place
from .deliveries import Deliveries

# Share of the way after which an arrival is worked out; vehicles are a thousand times slower.
NEARLY_THERE = 0.98


class FrameBand(NamedTuple):
    """What holds for all frames: AUVs within a horizontal `reach` (m) decode them, or as often as
    the `channel` says, where one is asked; they travel at `sound_speed` (m/s).
    """

    reach: float
    sound_speed: float
    channel: FrameChannel | None


class MfDownlink(Deliveries):
    """The MF downlink: a fix is delivered when its frame has reached the AUV, or never."""

    def __init__(
        self,
        env: simpy.Environment,
        auvs: Fleet,
        asvs: Fleet,
        navigator: Navigator,
        record: Recorder,
        *,
        band: FrameBand,
        clock: Clock,
        streams: Streams,
    ) -> None:
        super().__init__(env, auvs, navigator, record)
        self._channel, self._range, sound_speed = band.channel, band.reach, band.sound_speed
        self._luck = cache(partial(streams.of, Purpose.FRAME))
        self._asvs, self._clock, self._sound_speed = asvs, clock, sound_speed
        limit = math.inf if band.channel else band.reach  # who is asked has no limit
        self._limits = limit, sound_speed, clock.rate

    def send(
        self, rows: range, asv: int, time: float, airtime: float, processing: float = 0.0
    ) -> None:
        """Send fixes in a frame that starts at `time` and lasts `airtime` (eq. deliver_tick).

        A modem hands a frame over `processing` (s) after its end has arrived.
        """
        if self.on_broadcast is not None:
            self.on_broadcast()
        if not rows:
            return
        self._auvs.reach(time)
        self._asvs.reach(time)
        foreseen = self._auvs.foreseen and self._asvs.sure_s >= airtime
        if self._asvs.works_for(asv, time, airtime) < airtime:  # the frame is cut
            self._fixes.array["outcome"][rows.start : rows.stop] = LOST
        if self._channel is not None:
            frame = self._fixes.array[rows.start : rows.stop]
            self._decode(self._channel(len(rows), airtime), frame, asv, time)
        last = arrivals(
            self._fixes.array, rows.start, rows.stop, asv, time, airtime, processing, foreseen,
            *self._limits, *self._auvs.motion, *self._asvs.motion,
        )  # fmt: skip
        if last >= 0.0:
            self._deliver_at(last)
            if self.on_frame is not None:
                self.on_frame(rows)
        elif not foreseen:  # they steer meanwhile by other fixes, or who knows by what
            event = self._env.timeout(airtime)
            event.callbacks.append(partial(self._leave, rows, asv, (time, airtime, processing)))

    def _decode(self, channel: AskedChannel, fixes: Rows, asv: int, time: float) -> None:
        """Note which AUVs do not decode a frame of fixes that an ASV begins at an instant (s)."""
        addressed: list[int] = sorted(set(fixes["auv"].tolist()))
        auvs = places(self._auvs.motion, time)[addressed, :3]
        vessel = places(self._asvs.motion, time)[asv : asv + 1, :3]
        signals = between(time, auvs, vessel, self._range, calling=True)
        losses = channel.prospects(signals)["loss"][:, 0].tolist()
        for auv, loss in zip(addressed, losses, strict=True):
            if self._luck(auv, asv).random() < loss:
                fixes["outcome"][fixes["auv"] == auv] = LOST if loss < 1.0 else OUT_OF_RANGE

    def _leave(
        self, rows: range, asv: int, frame: tuple[float, float, float], _: simpy.Event
    ) -> None:
        """Let the end of a frame set out to AUVs that have moved since the frame began."""
        ends = frame[0] + frame[1]
        vessel = self._asvs.vehicles[asv].at(ends)
        for fix in rows:
            if self._fixes.array[fix]["outcome"] == IN_FLIGHT:
                event = self._nearly_there(fix, vessel, ends)
                event.callbacks.append(partial(self._arrive, fix, asv, frame))

    def _nearly_there(self, fix: int, vessel: Place, time: float) -> simpy.Timeout:
        """Return the event at which what left a vessel at an instant (s) is nearly at its AUV."""
        now, auv = self._env.now, self._fixes.array[fix]["auv"]
        place = self._auvs.vehicles[auv].at(now)
        way = NEARLY_THERE * math.dist(vessel[:3], place[:3]) / self._sound_speed
        return self._env.timeout(max(time - now + way, 0.0))

    def _arrive(
        self, fix: int, asv: int, frame: tuple[float, float, float], _: simpy.Event
    ) -> None:
        """Find the exact arrival when it is near: who steers by fixes has no sure future."""
        time, airtime, processing = frame
        travel = self._travel(asv, fix, time + airtime)
        self._expect(fix, self._clock.after(time, airtime + travel + processing))

    def _travel(self, asv: int, fix: int, time: float) -> float:
        """Return how long (s) sound from an ASV at an instant (s) travels to the AUV of a fix."""
        vessel = self._asvs.vehicles[asv].at(time)
        auv = self._auvs.vehicles[self._fixes.array[fix]["auv"]]
        return travel_time(vessel, auv.at, time, self._sound_speed)

    def reply(self, fix: int, asv: int, time: float) -> None:
        """Answer a ping that reached the ASV at `time` (s); the answer takes only its way."""
        row = self._fixes.array[fix]
        row["broadcast_at_s"], row["broadcast_by"] = time, asv
        if self.on_broadcast is not None:
            self.on_broadcast()
        if self._auvs.predicted:
            event = self._nearly_there(fix, self._asvs.vehicles[asv].at(time), time)
            event.callbacks.append(lambda _: self._answered(fix, asv, time))
        else:
            self._answered(fix, asv, time)

    def _answered(self, fix: int, asv: int, time: float) -> None:
        """Let an AUV have the answer that an ASV sent at an instant (s)."""
        pinged_at = float(self._fixes.array[fix]["pinged_at_s"])
        two_way = time - pinged_at + self._travel(asv, fix, time)
        self._expect(fix, self._clock.after(pinged_at, two_way))
