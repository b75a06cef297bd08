"""The MF band: frames carry fixes from ASVs to every AUV in range; which AUV gets which fix when.

A frame that begins at t and lasts T_A reaches the AUVs that are in range at t, as one sound at each
(:mod:`..acoustics.sounds`).  At an AUV it begins when its front arrives, and ends when the sound
that left its ASV at t + T_A does.  An AUV that decodes it has its fixes `delay_s` later.

A frame's outcome at an AUV is worked out when it is asked for, once the frame has ended there, when
all sounds that could overlap it are on record; but not as long as no two frames have ever
overlapped.  Fixes are delivered in the order of their arrival, not of sending: a frame from nearby
overtakes one from far away.
"""

import math
from functools import cache, partial
from math import inf, nan
from typing import Annotated, NamedTuple

import numpy as np
import simpy
from numpy.typing import NDArray

from ...support.arrays import Ints
from ...support.clock import Clock, after
from ...support.compiled import compiled
from ...support.packed import Packed, unpacked
from ...support.streams import Purpose, Streams
from ..acoustics.bursts import burst_chances
from ..acoustics.channel import NO_LOSS, AskedChannel
from ..acoustics.messages import Message
from ..acoustics.named_channels import FrameChannel
from ..acoustics.propagation import TOUCH, within
from ..acoustics.signals import NO_PINGS, Sounds, Spreading, signal_outcome
from ..acoustics.sounds import Sea, emit, place_of, solve
from ..acoustics.travel_time import NEARLY_THERE, travel_time, travel_time_to
from ..navigation.navigators import Navigator
from ..records.events import (
    BLOCKED,
    BURST,
    BY_FRAME,
    BY_OWN_FRAME,
    BY_OWN_PING,
    CHANCE,
    COLLIDED,
    FAILED,
    FAILED_MEANWHILE,
    HEARD,
    IN_FLIGHT,
    LOST,
    OUT_OF_RANGE,
    Broadcast,
)
from ..records.rows import FIX, FRAME_RECEPTION, NONE, Recorder, Rows
from ..vehicles.fleet import VehicleFleet
from ..vehicles.motion import where
from ..vehicles.vehicle import Place
from .deliveries import Deliveries
from .outcomes import Outcomes

# A frame at an AUV by a channel other than the disc: its outcome (IN_FLIGHT if the AUV decodes it
# unless another sound overlaps it) and why; its loss probability, its strength, and how much later
# (s) than on a straight ray it arrives (:data:`..acoustics.propagation.PROSPECT`).
PROMISE = np.dtype(
    [("outcome", "i8"), ("why", "i8"), ("loss", "f8"), ("sound", "f8"), ("late_s", "f8")]
)
NO_PROMISES: Rows = np.empty(0, PROMISE)


class FrameBand(NamedTuple):
    """What holds for all frames.  AUVs within a horizontal (`slant`: slant) `reach` (m) decode
    them, or as often as the `channel` says, if any; they travel at `sound_speed` (m/s).  Frames
    that overlap at an AUV destroy each other, but for `capture` as of
    :class:`..acoustics.channel.Receiver`.  Losses by the channel come in `bursts` (AUVs, ASVs),
    :data:`..acoustics.bursts.PAIR`, if not None; a frame is lost where the range changes faster
    than `doppler_limit` (m/s).
    """

    reach: float
    sound_speed: float
    channel: FrameChannel | None
    capture: float = math.inf
    bursts: Rows | None = None
    slant: bool = False
    doppler_limit: float | None = None


class FixFrames(NamedTuple):
    """What :func:`begin_frame` works with, packed once: all fixes, `slant` and `reach` (m) as of
    :class:`FrameBand`, the `rate` of the clock (Hz, see :func:`after`), and the channel's answer
    about the frame that begins, `promised` (listeners,), empty on the disc.
    """

    fixes: Annotated[Rows, FIX]
    slant: bool
    reach: float
    rate: float
    promised: Annotated[Rows, PROMISE]


class MfDownlink(Deliveries):
    """The MF downlink: a fix is delivered when its frame has reached the AUV, or never."""

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
        ping_s: float,
    ) -> None:
        """Instants are those of `clock`; pings last `ping_s` (s)."""
        super().__init__(env, auvs, navigator, record)
        self._ping_s = ping_s
        self._asvs, self._clock, self._record, self._band = asvs, clock, record, band
        self._luck = cache(partial(streams.of, Purpose.FRAME))
        self._overheard = cache(partial(streams.of, Purpose.OVERHEARD))
        random = None if band.channel is None else streams.of(Purpose.CHANNEL, 1)
        self._spreading = Spreading(
            None, NO_LOSS, band.slant, band.reach, "mf", random, band.doppler_limit
        )
        #: All sounds on MF: frames, and an AUV's pings where it hears no frame as it pings.
        self.sounds = Sounds(auvs, asvs, band.sound_speed, long=True)
        #: The sounds of HF, where ASVs hear nothing there while they send frames; else None.
        self.deafens: Sounds | None = None
        self._first: list[int] = []  # by frame: the row of its sound at AUV0; other AUVs' follow
        self._delay_s: list[float] = []  # by frame: how long after its end the modem delivers it
        self._sent_in = Packed(
            FixFrames(self._fixes.array, band.slant, band.reach, clock.rate, NO_PROMISES)
        )
        self._fixes.hand_on(self._sent_in, "fixes")
        self._moving = [fleet for fleet in (auvs, asvs) if not fleet.foreseen]
        self._foreseen_s = asvs.sure_s if auvs.foreseen else -inf
        self._listeners = len(auvs)  # so many vehicles, AUVs first, hear frames
        self._passed_at = 0.0  # instant (s) by which all frames so far have passed
        self._is_shared = False  # whether any sound may have overlapped a frame

    def deafen(self, pings: range) -> None:
        """Let AUVs hear no frames while they send pings that begin now."""
        self._is_shared = True
        for ping in self._record.pings.array[pings.start : pings.stop]:
            number, auv, sent_at = int(ping["ping"]), int(ping["auv"]), float(ping["sent_at_s"])
            self.sounds.deafen(BY_OWN_PING, number, auv, sent_at, self._ping_s)

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
        """Send the fixes `rows` (k,) of a round in a frame that starts at `time` (s), and lasts as
        long as its message (eq. deliver_tick).

        The modem delivers the message some delay after the frame's end has arrived; a channel is
        asked by the message's size.  The arrivals of the fixes `told` (None: all) are written at
        once.
        """
        told, airtime, delay = rows if told is None else told, message.airtime_s, message.delay_s
        on_air = self._asvs.works_for(asv, time, airtime)
        size, count, named = message.size_bytes, message.fixes, message.named
        row = Broadcast(round_number, asv, time, on_air, size, count, part, named)
        self._record.broadcasts.append(row)
        if self.on_broadcast is not None:
            self.on_broadcast()
        for fleet in self._moving:
            fleet.advance(time)
        foreseen, number, sounds = airtime <= self._foreseen_s, len(self._first), self.sounds
        auvs, first = len(self._auvs), sounds.count
        channel = self._band.channel
        if channel is not None:
            promised = self._ask(channel(size, airtime), rows, asv, time)
            self._sent_in.renew("promised", promised)
        self._is_shared |= time < self._passed_at
        self._first.append(first)
        self._delay_s.append(delay)
        sounds.room_for(self._listeners)
        last, longest, sounds.count = begin_frame(
            self._sent_in.address, sounds.sea.address, number, first, asv, time, on_air, airtime,
            delay, told, foreseen, self._listeners,
        )  # fmt: skip
        if self._band.doppler_limit is not None:
            self._lose_shifted(told, first, time, self._band.doppler_limit)
        self._passed_at = max(self._passed_at, time + longest)
        if self.deafens is not None and on_air > 0.0:
            self.deafens.deafen(BY_OWN_FRAME, number, auvs + asv, time, on_air)
        if last >= 0.0:
            self._deliver_by(last, told)
        elif len(told) and not foreseen:  # AUVs steer meanwhile by other fixes, or from outside
            event = self._env.timeout(airtime)
            event.callbacks.append(partial(self._leave, told, asv, (time, airtime, delay)))

    def _lose_shifted(self, rows: Ints, first: int, time: float, limit: float) -> None:
        """Mark a frame as lost at AUVs whose range changes faster than a limit (m/s); its sounds
        begin at row `first`, its fixes are `rows`.
        """
        sounds, fixes = self.sounds.array[first : first + len(self._auvs)], self._fixes.array
        was = sounds["outcome"] == IN_FLIGHT
        self.sounds.lose_shifted(sounds, time, limit)
        shifted = was & (sounds["outcome"] == LOST)
        lost = rows[shifted[fixes["auv"][rows]] & (fixes["outcome"][rows] == IN_FLIGHT)]
        fixes["outcome"][lost], fixes["arrives_at_s"][lost] = LOST, nan

    def _ask(self, channel: AskedChannel, carried: Ints, asv: int, time: float) -> Rows:
        """Return a channel's answer about a frame of fixes that an ASV begins at an instant (s), at
        each listener (n,), :data:`PROMISE`.
        """
        auvs, bursts = len(self._auvs), self._band.bursts
        found = self.sounds.heard_from(
            channel, auvs + asv, time, self._listeners, self._spreading
        )  # fmt: skip
        luck = self._overheard(asv).random(auvs)
        for auv in set(self._fixes.array["auv"][carried].tolist()):
            luck[auv] = self._luck(auv, asv).random()
        if bursts is not None:
            losses = np.ascontiguousarray(found["loss"][:auvs])
            luck = burst_chances(np.ascontiguousarray(bursts[:, asv]), time, losses)
        luck = np.append(luck, np.ones(len(found) - auvs))  # ASVs decode no frames of each other
        promised, loss = np.empty(len(found), PROMISE), found["loss"]
        promised["outcome"] = np.where(
            loss < 1.0, np.where(luck < loss, LOST, IN_FLIGHT), OUT_OF_RANGE
        )
        promised["why"] = np.where(promised["outcome"] == IN_FLIGHT, NONE, promised["outcome"])
        promised["why"][promised["outcome"] == LOST] = CHANCE if bursts is None else BURST
        promised["why"][found["blocked"] > 0] = BLOCKED
        for name in ("loss", "sound", "late_s"):
            promised[name] = found[name]
        return promised

    # Outcomes of frames

    def deliver(self, time: float) -> None:
        """Deliver every fix that has reached its AUV by an instant (s), in a frame that was not
        destroyed there.
        """
        if self._is_shared:
            first = self.first_under_way
            fixes = self._fixes.rows[first:]
            arrives = (fixes["outcome"] == IN_FLIGHT) & (fixes["arrives_at_s"] <= time)
            arrives &= fixes["frame"] != NONE  # instant answers are no frames
            due = fixes[arrives]
            received = self._received(due["frame"], due["auv"], time)
            rows = first + np.flatnonzero(arrives)[received["outcome"] == COLLIDED]
            self._fixes.array["outcome"][rows] = COLLIDED
        super().deliver(time)

    def decoded(self, broadcast: int, time: float) -> NDArray[np.bool_]:
        """Return which AUVs (n,) have decoded a broadcast, by its number from 0, by an instant (s)
        that is not later than now: its end has arrived, and their modem has delivered it.
        """
        auvs = np.arange(len(self._auvs))
        received = self._received(np.full(len(auvs), broadcast), auvs, time)
        handed_over = received["ended_at_s"] + self._delay_s[broadcast]
        found: NDArray[np.bool_] = (received["outcome"] == HEARD) & (handed_over <= time)
        return found

    def close(self, time: float) -> None:
        """Deliver the fixes that have arrived by the mission's last instant (s); record the outcome
        of each frame at each AUV, or only of destroyed ones where not everything is recorded.
        """
        self.deliver(time)
        auvs, frames = np.arange(len(self._auvs)), np.arange(len(self._first))
        if self._record.everything:
            each = [self._received(np.repeat(frames, len(auvs)), np.tile(auvs, len(frames)), time)]
        elif self._is_shared:  # frame by frame: all at once may not fit into memory
            met = (self._received(np.full(len(auvs), frame), auvs, time) for frame in frames)
            each = [rows[rows["outcome"] == COLLIDED] for rows in met]
        else:
            return
        received = np.concatenate([np.empty(0, FRAME_RECEPTION), *each])
        table = self._record.frame_receptions
        table.array, table.count = received, len(received)

    def _received(self, frames: Ints, auvs: Ints, time: float) -> Rows:
        """Return the outcomes of `frames` at `auvs`, both (n,), by `time` (s): rows (n,),
        :data:`..records.rows.FRAME_RECEPTION`.
        """
        self._auvs.advance(time)
        self._asvs.advance(time)
        received = np.empty(len(frames), FRAME_RECEPTION)
        received["broadcast"], received["auv"] = frames, auvs
        rows = np.array([self._first[frame] for frame in frames.tolist()], np.int64) + auvs
        sea, count = self.sounds.sea.address, self.sounds.count
        receive(sea, rows, received, time, count, self._band.capture, *NO_PINGS)
        return received

    # Arrivals at AUVs that steer, or are moved, meanwhile

    def _leave(
        self, rows: Ints, asv: int, frame: tuple[float, float, float], _: simpy.Event
    ) -> None:
        """Wait for the end of an ASV's `frame` (start, airtime, delay, s), sent just now, at the
        AUVs of the fixes `rows`, whose motion is not known ahead.
        """
        ends = frame[0] + frame[1]
        vessel = self._asvs.vehicles[asv].at(ends)
        for fix in rows:
            if self._fixes.array[fix]["outcome"] == IN_FLIGHT:
                late = self._late_s(fix)
                event = self._nearly_there(fix, vessel, ends, late)
                event.callbacks.append(partial(self._arrive, fix, asv, frame, late))

    def _late_s(self, fix: int) -> float:
        """Return how much later (s) than on a straight ray the frame of a fix reaches its AUV."""
        row = self._fixes.array[fix]
        return float(self.sounds.array[self._first[row["frame"]] + row["auv"]]["late_s"])

    def _nearly_there(self, fix: int, vessel: Place, time: float, late: float) -> simpy.Timeout:
        """Return the event at which sound that left an ASV at `vessel` at an instant (s), `late`
        (s) later than on a straight ray, has nearly reached the AUV of a fix.
        """
        now, auv = self._env.now, self._fixes.array[fix]["auv"]
        place = self._auvs.vehicles[auv].at(now)
        way = NEARLY_THERE * (math.dist(vessel[:3], place[:3]) / self._band.sound_speed + late)
        return self._env.timeout(max(time - now + way, 0.0))

    def _arrive(
        self, fix: int, asv: int, frame: tuple[float, float, float], late: float, _: simpy.Event
    ) -> None:
        """Work out the arrival of a fix whose frame is near, now that the AUV's motion until then
        is known; `frame` as of :meth:`_leave`, `late` of :meth:`_late_s`.
        """
        time, airtime, delay = frame
        travel = self._travel(asv, fix, time + airtime, late)
        self._expect(fix, self._clock.after(time, airtime + travel + delay))

    def _travel(self, asv: int, fix: int, time: float, late: float) -> float:
        """Return the travel time (s) of sound from an ASV at an instant (s) to the AUV of a fix,
        `late` (s) longer than on a straight ray.
        """
        auv = int(self._fixes.array[fix]["auv"])
        if self._auvs.foreseen:
            self._asvs.advance(time)
            return frame_travel_s(self.sounds.sea.address, asv, auv, time, late)
        # `at` advances the AUV's motion as it is asked
        vessel, at = self._asvs.vehicles[asv].at(time), self._auvs.vehicles[auv].at
        return late + travel_time(vessel, at, time + late, self._band.sound_speed)

    # Answers that take no airtime

    def reply(self, round_number: int, fix: int, asv: int, time: float, late: float = 0.0) -> None:
        """Answer a ping that reached the ASV at `time` (s) with its fix; the answer takes only its
        travel time, `late` (s) longer than on a straight ray, as the ping's was.
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
        """Deliver an answer that an ASV sent at an instant (s), but not before now."""
        pinged_at = float(self._fixes.array[fix]["pinged_at_s"])
        two_way = time - pinged_at + self._travel(asv, fix, time, late)
        self._expect(fix, self._clock.after(pinged_at, max(two_way, self._env.now - pinged_at)))


class Replies:
    """The first ASV that decodes a ping answers it with a fix of its own; no fix waits
    (conventional USBL).

    An answer is a frame of its own (`message`), sent once the ping is decoded.  An ASV hears no
    ping while it answers one, as transponders are locked out meanwhile, so it never has two to
    answer; another ASV may hear the ping and answer it.

    Without a message answers take no airtime.  They leave `after` (s) the ping's front has arrived:
    0 gives the paper's latencies, although no ASV can have decoded the ping by then; the ping's
    duration is the earliest that is possible.
    """

    def __init__(
        self,
        env: simpy.Environment,
        outcomes: Outcomes,
        downlink: MfDownlink,
        record: Recorder,
        message: Message | None,
        after: float,
    ) -> None:
        self._env, self._outcomes, self._downlink, self._record = env, outcomes, downlink, record
        self._message, self._after = message, after

    def expect(self, pings: range) -> None:
        """Wait for each ping at each ASV in range by itself."""
        self._outcomes.when_over(self._env, pings, self._hear)

    def _hear(self, row: int, arrived: float) -> None:
        """Answer a ping that `arrived` at an instant (s), if this reception (a row) is its first
        heard one.
        """
        reception = self._record.receptions.array[row]
        if not self._outcomes.decide_one(int(reception["ping"]), row):
            return
        number = int(self._record.pings.array[reception["ping"]]["round"])
        self._record.rounds[number].fixes += 1
        asv, fix, time = int(reception["asv"]), self._record.fixes.count - 1, arrived + self._after
        if self._message is None:
            self._downlink.reply(number, fix, asv, time, float(reception["bent_s"]))
        else:
            self._downlink.send(number, np.array([fix]), asv, time, self._message)


@compiled
def begin_frame(
    packed: int, packed_sea: int, number: int, count: int, asv: int, time: float, on_air: float,
    airtime: float, delay: float, carried: Ints, foreseen: bool, listeners: int,
) -> tuple[float, float, int]:  # fmt: skip
    """Let an ASV send the fixes of the rows `carried` (k,) in frame `number` at an instant (s).
    The frame would last `airtime` (s); it is on the air for `on_air` (s), less if its ASV fails.
    Write its sounds behind the first `count`.

    `packed` is the address of a :class:`FixFrames`, `packed_sea` of a :class:`Sea` with enough free
    rows.  The frame sounds at the first so many `listeners` of all vehicles, AUVs first, but not at
    its sender.  Write each fix's arrival, `delay` (s) after the frame's end has come; it stays NaN
    if the AUV is out of range as the frame begins or loses the frame, and for now if its motion is
    not `foreseen`.  Return the latest arrival (s) that is known, or -1; the longest time (s) from
    sending to the end of any sound so far; and the row after the sounds.
    """
    into, sea, last = unpacked(packed, FixFrames), unpacked(packed_sea, Sea), -1.0
    fixes, auvs, promised = into.fixes, sea.auvs, into.promised
    here, sender = where(sea.asvs, asv, time), auvs.first.size - 1 + asv
    strengths, lates = np.zeros(listeners), np.zeros(listeners)
    for listener in range(listeners):
        if listener == sender:
            strengths[listener] = nan
        elif promised.size:
            strengths[listener] = promised[listener].sound
            lates[listener] = promised[listener].late_s
        elif within(place_of(listener, time, sea), here, into.slant, into.reach):
            strengths[listener] = 1.0
    end = emit(sea, count, BY_FRAME, number, sender, time, on_air, strengths, lates)
    for row in range(count, end):
        sound = sea.sounds[row]
        if promised.size:
            promise = promised[sound.listener]
            sound.outcome, sound.why, sound.loss = promise.outcome, promise.why, promise.loss
        elif sound.sound == 0.0:
            sound.outcome = sound.why = OUT_OF_RANGE
        if on_air < airtime and sound.outcome != OUT_OF_RANGE:
            sound.outcome, sound.why = LOST, FAILED_MEANWHILE if on_air > 0.0 else FAILED
        if on_air == 0.0:
            sound.sound = 0.0
    ends = where(sea.asvs, asv, time + airtime)
    for row in carried:
        line, sound = fixes[row], sea.sounds[count + fixes[row].auv]
        line.broadcast_at_s, line.broadcast_by, line.arrives_at_s = time, asv, nan
        line.frame = number
        if sound.outcome != IN_FLIGHT:
            line.outcome = BLOCKED if sound.why == BLOCKED else sound.outcome
        elif foreseen:
            sent_at = time + airtime + sound.late_s
            travel = sound.late_s + travel_time_to(ends, auvs, line.auv, sent_at, sea.sound_speed)
            line.arrives_at_s = after(into.rate, time, airtime + travel + delay)
            last = max(last, line.arrives_at_s)
    return last, sea.sounds[count + auvs.first.size - 2].longest_s, end


@compiled
def frame_travel_s(packed: int, asv: int, auv: int, time: float, late: float) -> float:
    """Return the travel time (s) of sound from an ASV at an instant (s) to an AUV, `late` (s)
    longer than on a straight ray; `packed` is the address of a :class:`Sea`.
    """
    of = unpacked(packed, Sea)
    source = where(of.asvs, asv, time)
    return late + travel_time_to(source, of.auvs, auv, time + late, of.sound_speed)


@compiled
def receive(
    packed: int, rows: Ints, receptions: Rows, known: float, count: int, capture: float,
    met: Rows, pings: Rows, ping_s: float,
) -> None:  # fmt: skip
    """Write the outcomes of frames at AUVs, the sounds `rows` (n,), by the instant `known` (s), up
    to which all motion is known, to `receptions` (n,), :data:`..records.rows.FRAME_RECEPTION`.

    `packed` is the address of a :class:`Sea` with `count` sounds on record: all that have begun by
    then.  A frame that has not ended at its AUV is in flight.  Further arguments as of
    :func:`..acoustics.signals.signal_outcome`.
    """
    sea = unpacked(packed, Sea)
    auvs = sea.auvs.first.size - 1
    for k in range(len(rows)):
        line, sound = receptions[k], sea.sounds[rows[k]]
        solve(sound, known, sea)
        line.arrived_at_s = sound.arrived_at_s if sound.arrived_at_s <= known + TOUCH else nan
        line.ended_at_s, line.loss_probability = sound.ended_at_s, sound.loss
        line.outcome, line.why, line.overlapped_by = signal_outcome(
            rows[k], sea.sounds[:count], known + TOUCH, met, pings, ping_s, auvs, capture, sea,
            known,
        )  # fmt: skip
