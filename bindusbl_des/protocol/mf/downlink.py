"""The MF band: frames of fixes travel from ASVs to every AUV in range, who has which fix when."""

import math
from collections.abc import Callable, Iterable
from functools import cache, partial
from typing import NamedTuple

import numpy as np
import simpy
from numpy.typing import NDArray

from ...acoustics.bursts import burst_chances
from ...acoustics.channel import AskedChannel, heard_from
from ...acoustics.doppler import beyond
from ...acoustics.messages import Message
from ...acoustics.named_channels import FrameChannel
from ...acoustics.sounds import Sounds
from ...acoustics.travel_time import NEARLY_THERE, travel_time
from ...core.arrays import Ints
from ...core.clock import Clock
from ...core.packed import Packed
from ...core.streams import Purpose, Streams
from ...navigation.gnss import GnssReceivers
from ...navigation.navigators import Navigator
from ...records.events import (
    BURST,
    BY_OWN_FRAME,
    BY_OWN_PING,
    CHANCE,
    COLLIDED,
    DOPPLER,
    HEARD,
    IN_FLIGHT,
    LOST,
    OUT_OF_RANGE,
    Broadcast,
)
from ...records.rows import FRAME_RECEPTION, NONE, EventBuffer, Recorder, Rows
from ...vehicles.fleet import VehicleFleet
from ...vehicles.motion import places
from ...vehicles.vehicle import Place
from ..steps import moment
from .reception import DISC, FRAME, PROMISE, Sent, begin_frame, delivered, receive, way_s


class Deliveries:
    """The fixes of a mission that AUVs are yet to have, however they come to them."""

    def __init__(
        self, env: simpy.Environment, auvs: VehicleFleet, navigator: Navigator, record: Recorder
    ) -> None:
        self._env, self._auvs, self._fixes, self._navigator = env, auvs, record.fixes, navigator
        self._undelivered = 0  # fixes before this one are delivered, or never will be
        self._due = np.empty(0, dtype=np.int64)
        #: What makes AUVs fixes of their own at the surface; None where they have no receivers.
        self.gnss: GnssReceivers | None = None
        #: Whom to tell that a broadcast begins, of fixes whose arrivals are known, and of those
        #: that are delivered: nobody unless somebody waits for that.
        self.on_broadcast: Callable[[], None] | None = None
        self.on_frame: Callable[[Iterable[int]], None] | None = None
        self.on_delivered: Callable[[Ints], None] | None = None

    def _expect(self, fix: int, instant: float) -> None:
        """Let an AUV have a fix at an instant (s), but not before now."""
        arrives = max(instant, self._env.now)
        self._fixes.array[fix]["arrives_at_s"] = arrives
        self._deliver_by(arrives, [fix])

    def _deliver_by(self, instant: float, rows: Iterable[int]) -> None:
        """Let AUVs have fixes of which the last arrives at an instant (s), if anybody can tell."""
        if self.on_frame is not None:
            self.on_frame(rows)
        elif not self._auvs.foreseen:  # they steer by them, or who knows by what
            moment(self._env, instant).callbacks.append(lambda _: self.deliver(instant))

    @property
    def first_under_way(self) -> int:
        """The first fix that may still be delivered."""
        return self._undelivered

    def settle(self, time: float) -> None:
        """Let AUVs have what has reached them by an instant (s), all of whose events are over.

        Fixes that nobody waits for are delivered when somebody wants to know, in the order of their
        arrival.  Who steers by them has had each at its own instant, and nothing is left to do.
        """
        if self._auvs.foreseen:
            self.deliver(time)

    def deliver(self, time: float) -> None:
        """Let AUVs have every fix that has reached them by an instant (s)."""
        fixes = self._fixes
        waiting = fixes.count - self._undelivered
        if waiting > len(self._due):
            self._due = np.empty(2 * waiting, dtype=np.int64)
        self._auvs.advance(time)  # up to now AUVs have steered without these fixes
        count, self._undelivered = delivered(
            fixes.array, self._undelivered, fixes.count, time, self._due
        )
        due = numbers = self._due[:count]
        if self.gnss is not None:
            numbers = self.gnss.among(fixes.array, due, time)
        if len(numbers):
            self._navigator.correct(fixes.array, numbers)
        if count and self.on_delivered is not None:
            self.on_delivered(due)


class FrameBand(NamedTuple):
    """What holds for all frames: AUVs within a `reach` (m), seen from above unless `slant`, decode
    them, or as often as the `channel` says, where one is asked; they travel at `sound_speed` (m/s).
    Frames that overlap at an AUV destroy each other, but for `capture` as of
    :class:`...acoustics.channel.Receiver`.  What a channel lets be lost is lost in `bursts` (AUVs,
    ASVs), :data:`...acoustics.bursts.PAIR`, if not None; and where its way changes faster than a
    `doppler_limit` (m/s).
    """

    reach: float
    sound_speed: float
    channel: FrameChannel | None
    capture: float = math.inf
    bursts: Rows | None = None
    slant: bool = False
    doppler_limit: float | None = None


class MfDownlink(Deliveries):
    """The MF downlink: a fix is delivered when its frame has reached the AUV, or never.

    What becomes of a frame at an AUV is worked out when somebody wants to know, and not before it
    has ended there, when all that could overlap it are on record.
    """

    def __init__(
        self,
        env: simpy.Environment,
        auvs: VehicleFleet,
        asvs: VehicleFleet,
        navigator: Navigator,
        record: Recorder,
        *,
        band: FrameBand,
        clock: Clock,
        streams: Streams,
    ) -> None:
        super().__init__(env, auvs, navigator, record)
        self._channel, self._range, self._sound_speed = band.channel, band.reach, band.sound_speed
        self._bursts, self._doppler_limit = band.bursts, band.doppler_limit
        self._luck = cache(partial(streams.of, Purpose.FRAME))
        self._random = None if band.channel is None else streams.of(Purpose.CHANNEL, 1)
        self._overheard = cache(partial(streams.of, Purpose.OVERHEARD))
        self._asvs, self._clock, self._record = asvs, clock, record
        self._frames = EventBuffer(FRAME)
        #: What sounds where: frames, and where AUVs are deaf meanwhile their own pings.
        self.sounds = Sounds(auvs, asvs, band.sound_speed, long=True)
        #: Where ASVs hear nothing while they send frames, if they do: on the HF band.
        self.deafens: Sounds | None = None
        self._sent_in = self._packed(band)
        self._moving = [fleet for fleet in (auvs, asvs) if not fleet.foreseen]
        self._foreseen_s = asvs.sure_s if auvs.foreseen else -math.inf
        self._listeners = len(auvs)  # the first of all vehicles: who hears frames
        self._passed_at = 0.0  # by then (s) all frames so far have passed
        self._is_shared = False  # whether anything may ever have met a frame

    def _packed(self, band: FrameBand) -> Packed:
        """Return what frames are sent in, :class:`Sent`."""
        fixes, rate = self._record.fixes, self._clock.rate
        frames = self._frames.array
        packed = Packed(Sent(frames, fixes.array, band.slant, band.reach, band.capture, rate))
        self._frames.hand_on(packed, "frames")
        fixes.hand_on(packed, "fixes")
        return packed

    def deafen(self, pings: Iterable[tuple[int, int]], time: float, lasts: float) -> None:
        """Let AUVs hear no frames while they ping, by number and AUV, at an instant (s), for so
        long (s).
        """
        self._is_shared = True
        for ping, auv in pings:
            self.sounds.deafen(BY_OWN_PING, ping, auv, time, lasts)

    def send(
        self,
        round_number: int,
        rows: Ints,
        asv: int,
        time: float,
        message: Message,
        part: int = 0,
        told: Ints | None = None,
    ) -> None:
        """Send fixes of a round in a frame that starts at `time`, and lasts as long as its message
        (eq. deliver_tick).

        A modem hands a frame over so much later than its end has arrived.  A channel is asked by
        its size.  When AUVs will have those fixes that are `told` so (None: all) is noted at once.
        """
        told, airtime, processing = (
            rows if told is None else told,
            message.airtime_s,
            message.delay_s,
        )
        on_air = self._asvs.works_for(asv, time, airtime)
        size, count, named = message.size_bytes, message.fixes, message.named
        row = Broadcast(round_number, asv, time, on_air, size, count, part, named)
        self._record.broadcasts.append(row)
        if self.on_broadcast is not None:
            self.on_broadcast()
        for fleet in self._moving:
            fleet.advance(time)
        foreseen, number, sounds = airtime <= self._foreseen_s, self._frames.count, self.sounds
        if on_air < airtime:  # the frame is cut
            self._fixes.array["outcome"][told] = LOST
        promised, auvs = DISC, len(self._auvs)
        if self._channel is not None:
            promised = self._ask(self._channel(size, airtime), rows, asv, time)
        self._is_shared |= time < self._passed_at
        self._frames.room_for(1)
        sounds.room_for(self._listeners)
        last, longest = begin_frame(
            self._sent_in.address, sounds.sea.address, number, sounds.count, asv, time, on_air,
            airtime, processing, told, foreseen, promised, self._listeners,
        )  # fmt: skip
        if self._doppler_limit is not None:
            self._lose_shifted(told, asv, time, self._doppler_limit)
        self._frames.count += 1
        sounds.count += self._listeners - (self._listeners > auvs)  # its sender hears nothing
        self._passed_at = max(self._passed_at, time + longest)
        if self.deafens is not None and on_air > 0.0:
            self.deafens.deafen(BY_OWN_FRAME, number, auvs + asv, time, on_air)
        if last >= 0.0:
            self._deliver_by(last, told)
        elif len(told) and not foreseen:  # they steer meanwhile by other fixes, or who knows
            event = self._env.timeout(airtime)
            event.callbacks.append(partial(self._leave, told, asv, (time, airtime, processing)))

    def _lose_shifted(self, rows: Ints, asv: int, time: float, limit: float) -> None:
        """Let AUVs lose the frame with fixes that an ASV begins at an instant (s) where their way
        changes faster than a limit (m/s).
        """
        auvs, first, fixes = len(self._auvs), self.sounds.count, self._fixes.array
        sender = np.full(auvs, auvs + asv)
        shifted = beyond(self.sounds.sea.address, sender, np.arange(auvs), time, limit)
        sounds = self.sounds.array[first : first + auvs]
        shifted &= sounds["outcome"] == IN_FLIGHT
        sounds["outcome"][shifted], sounds["why"][shifted] = LOST, DOPPLER
        lost = rows[shifted[fixes["auv"][rows]] & (fixes["outcome"][rows] == IN_FLIGHT)]
        fixes["outcome"][lost], fixes["arrives_at_s"][lost] = LOST, math.nan

    def _ask(self, channel: AskedChannel, carried: Ints, asv: int, time: float) -> Rows:
        """Return what becomes of a frame of fixes at those who listen (n,), :data:`PROMISE`, that
        an ASV begins at an instant (s).
        """
        auvs, asvs = (places(fleet.motion, time)[:, :3] for fleet in (self._auvs, self._asvs))
        found = heard_from(
            channel, time, len(auvs) + asv, (auvs, asvs), self._listeners, self._range, "mf",
            self._random,
        )  # fmt: skip
        luck = self._overheard(asv).random(len(auvs))
        for auv in set(self._fixes.array["auv"][carried].tolist()):
            luck[auv] = self._luck(auv, asv).random()
        if self._bursts is not None:
            pairs = np.ascontiguousarray(self._bursts[:, asv])
            losses = np.ascontiguousarray(found["loss"][: len(auvs)])
            luck = burst_chances(pairs, time, losses)
        luck = np.append(luck, np.ones(len(found) - len(auvs)))  # ASVs decode no other's frame
        promised, loss = np.empty(len(found), PROMISE), found["loss"]
        promised["outcome"] = np.where(
            loss < 1.0, np.where(luck < loss, LOST, IN_FLIGHT), OUT_OF_RANGE
        )
        promised["why"] = np.where(promised["outcome"] == IN_FLIGHT, NONE, promised["outcome"])
        promised["why"][promised["outcome"] == LOST] = CHANCE if self._bursts is None else BURST
        for name in ("loss", "sound", "late_s"):
            promised[name] = found[name]
        return promised

    def deliver(self, time: float) -> None:
        """Let AUVs have every fix that has reached them by an instant (s), in a frame that nothing
        has destroyed there.
        """
        if self._is_shared:
            first = self.first_under_way
            fixes = self._fixes.rows[first:]
            arrives = (fixes["outcome"] == IN_FLIGHT) & (fixes["arrives_at_s"] <= time)
            arrives &= fixes["frame"] != NONE  # answers are no frames
            due = fixes[arrives]
            received = self._received(due["frame"], due["auv"], time)
            rows = first + np.flatnonzero(arrives)[received["outcome"] == COLLIDED]
            self._fixes.array["outcome"][rows] = COLLIDED
        super().deliver(time)

    def decoded(self, broadcast: int, time: float) -> NDArray[np.bool_]:
        """Return which AUVs have decoded a broadcast, by its number from 0, by an instant (s) that
        is not to come, shape (n,): its end has come to them, and their modem has handed it over.
        """
        auvs = np.arange(len(self._auvs))
        received = self._received(np.full(len(auvs), broadcast), auvs, time)
        handed_over = received["ended_at_s"] + self._frames.array[broadcast]["processing_s"]
        found: NDArray[np.bool_] = (received["outcome"] == HEARD) & (handed_over <= time)
        return found

    def close(self, time: float) -> None:
        """Let AUVs have what has reached them by an instant (s), the mission's last; put on record
        what became of each frame at each of them: where not everything is, of those destroyed.
        """
        self.deliver(time)
        auvs = np.arange(len(self._auvs))
        if self._record.everything:
            frames = np.arange(self._frames.count)
            received = self._received(
                np.repeat(frames, len(auvs)), np.tile(auvs, len(frames)), time
            )
        elif self._is_shared:
            each = [
                self._received(np.full(len(auvs), frame), auvs, time)
                for frame in range(self._frames.count)
            ]
            destroyed = [rows[rows["outcome"] == COLLIDED] for rows in each]
            received = np.concatenate([np.empty(0, FRAME_RECEPTION), *destroyed])
        else:
            return
        table = self._record.frame_receptions
        table.array, table.count = received, len(received)

    def _received(self, frames: Ints, auvs: Ints, time: float) -> Rows:
        """Return what has become of frames at AUVs, (n,) each, by an instant (s), shape (n,)."""
        self._auvs.advance(time)
        self._asvs.advance(time)
        received = np.empty(len(frames), FRAME_RECEPTION)
        received["broadcast"], received["auv"] = frames, auvs
        sea = self.sounds.sea.address
        receive(self._sent_in.address, sea, received, time, self.sounds.count)
        return received

    def _leave(
        self, rows: Ints, asv: int, frame: tuple[float, float, float], _: simpy.Event
    ) -> None:
        """Let the end of a frame set out to AUVs that have moved since the frame began."""
        ends = frame[0] + frame[1]
        vessel = self._asvs.vehicles[asv].at(ends)
        for fix in rows:
            if self._fixes.array[fix]["outcome"] == IN_FLIGHT:
                late = self._late_s(fix)
                event = self._nearly_there(fix, vessel, ends, late)
                event.callbacks.append(partial(self._arrive, fix, asv, frame, late))

    def _late_s(self, fix: int) -> float:
        """Return how much later (s) the frame of a fix is at its AUV than straight on."""
        if self._channel is None:
            return 0.0
        row = self._fixes.array[fix]
        first = int(self._frames.array[row["frame"]]["first"])
        return float(self.sounds.array[first + row["auv"]]["late_s"])

    def _nearly_there(self, fix: int, vessel: Place, time: float, late: float) -> simpy.Timeout:
        """Return the event at which what left a vessel at an instant (s) is nearly at its AUV, so
        much later (s) than straight on.
        """
        now, auv = self._env.now, self._fixes.array[fix]["auv"]
        place = self._auvs.vehicles[auv].at(now)
        way = NEARLY_THERE * (math.dist(vessel[:3], place[:3]) / self._sound_speed + late)
        return self._env.timeout(max(time - now + way, 0.0))

    def _arrive(
        self, fix: int, asv: int, frame: tuple[float, float, float], late: float, _: simpy.Event
    ) -> None:
        """Find the exact arrival when it is near: who steers by fixes has no sure future."""
        time, airtime, processing = frame
        travel = self._travel(asv, fix, time + airtime, late)
        self._expect(fix, self._clock.after(time, airtime + travel + processing))

    def _travel(self, asv: int, fix: int, time: float, late: float) -> float:
        """Return how long (s) sound from an ASV at an instant (s) travels to the AUV of a fix, so
        much later (s) than straight on.
        """
        auv = int(self._fixes.array[fix]["auv"])
        if self._auvs.foreseen:
            self._asvs.advance(time)
            return way_s(self.sounds.sea.address, asv, auv, time, late)
        # the AUV's way is made known as it is asked for
        vessel, at = self._asvs.vehicles[asv].at(time), self._auvs.vehicles[auv].at
        return late + travel_time(vessel, at, time + late, self._sound_speed)

    def reply(self, round_number: int, fix: int, asv: int, time: float, late: float = 0.0) -> None:
        """Answer a ping that reached the ASV at `time` (s); the answer takes only its way, as much
        later (s) than straight on as the ping did.
        """
        row = self._fixes.array[fix]
        row["broadcast_at_s"], row["broadcast_by"] = time, asv
        self._record.broadcasts.append(Broadcast(round_number, asv, time, 0.0, 0, 1))
        if self.on_broadcast is not None:
            self.on_broadcast()
        if self._auvs.predicted:
            event = self._nearly_there(fix, self._asvs.vehicles[asv].at(time), time, late)
            event.callbacks.append(lambda _: self._answered(fix, asv, time, late))
        else:
            self._answered(fix, asv, time, late)

    def _answered(self, fix: int, asv: int, time: float, late: float) -> None:
        """Let an AUV have the answer that an ASV sent at an instant (s), but not before now."""
        pinged_at = float(self._fixes.array[fix]["pinged_at_s"])
        two_way = time - pinged_at + self._travel(asv, fix, time, late)
        self._expect(fix, self._clock.after(pinged_at, max(two_way, self._env.now - pinged_at)))
