"""Frames of AUVs on MF: they forward frames of fixes, and acknowledge the fixes that they have.

A frame of an AUV is a sound at every other vehicle, beside those of ASVs, on the same sea
(:mod:`..acoustics.sounds`): it is lost or drowned, and deafens its sender, as any frame.

An AUV that has decoded a frame counts turns from then on, by no clock.  After a broadcast there is
a turn for each AUV that relays, hop by hop, and then one for each AUV that has a fix in it, to
acknowledge that; :class:`.slots.Behind` has their lengths.  Later copies of a fix change nothing;
each is acknowledged.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from math import inf, isfinite, nan
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...support.arrays import Ints
from ...support.streams import Purpose, Streams
from ..acoustics.messages import Message
from ..acoustics.signals import ROUNDING, Sounds, luck_keys
from ..records.events import (
    BLOCKED,
    BY_AUV_FRAME,
    BY_OWN_FRAME,
    DELIVERED,
    HEARD,
    IN_FLIGHT,
    NONE,
    OUT_OF_RANGE,
    AuvFrame,
    FixService,
)
from ..records.rows import AUV_FRAME_RECEPTION, Rows
from .acknowledged import Acknowledged
from .deliveries import Deliveries
from .frames import MfDownlink
from .slots import Behind
from .steps import moment

NOTHING = np.empty(0, dtype=np.int64)


class Following(NamedTuple):
    """What follows a broadcast: the end of its last frame (s); its number of frames (`parts`); the
    length of a turn to forward one, and the longest delay of a modem; the pause before the first
    turn; and, for each AUV that has fixes in it, when its turn to acknowledge begins, counted from
    the first turn.  All in s.
    """

    ends_at_s: float
    parts: int
    turn_s: float
    delay_s: float
    pause_s: float
    acknowledge_s: dict[int, float]


class AsvFrame(NamedTuple):
    """A frame of an ASV: its number in broadcasts, its fixes (rows of the record), its message, its
    part of the broadcast, its end (s), and what follows.
    """

    number: int
    fixes: Ints
    message: Message
    part: int
    ends_at_s: float
    following: Following | None


class Exchange(MfDownlink):
    """The MF band where AUVs send, too; an AUV has a fix by the first copy that it decodes.

    Each frame is decided as it ends at an AUV that needs it; nothing is known before.
    """

    def __init__(
        self, *given: Any, behind: Behind | None, acknowledged: Acknowledged | None, by_ping: bool,
        asked: set[int], streams: Streams, **named: Any,
    ) -> None:  # fmt: skip
        """Take the arguments of :class:`MfDownlink`; what AUVs send `behind` a broadcast; the store
        of `acknowledged` fixes, which pings (`by_ping`) or frames report; and the AUVs `asked` to
        forward frames, by number.
        """
        super().__init__(*given, streams=streams, **named)
        self._behind, self.acknowledged, self._relays = behind, acknowledged, sorted(asked)
        if acknowledged is not None and by_ping:
            acknowledged.update = self._hear_pings
        fleets = self._auvs, self._asvs
        self._listeners, count = len(self._auvs) + len(self._asvs), len(self._auvs)
        #: The sounds of HF, where AUVs hear no call while they send frames; else None.
        self.deafens_auvs: Sounds | None = None
        self._keys = [luck_keys(streams, Purpose.AUV_FRAME, (auv,), fleets) for auv in range(count)]
        self._follows: dict[int, Following] = {}  # by ASV: after its last broadcast
        self._sent_by = Counter[int]()  # frames of each AUV
        self._decoded = dict[tuple[int, int], float]()  # by frame and AUV: since when (s)
        self._came = dict[int, tuple[int, int, int]]()  # by fix: hops, last relay, frame
        self._repeats, self._duplicates = Counter[int](), Counter[int]()
        self._owed: list[list[tuple[float, int]]] = [[] for _ in range(count)]  # by AUV: since, fix
        self._pings_seen = 0  # pings before this one are decided or in `_undecided`
        self._undecided: list[int] = []

    # Frames of ASVs

    def follow(self, asv: int, time: float, messages: Sequence[Message], fixes: Ints) -> float:
        """Schedule what AUVs send after a broadcast of some messages and fixes that an ASV begins
        at an instant (s); return how long (s) that takes.
        """
        behind = self._behind
        assert behind is not None
        counts = Counter[int](self._fixes.array["auv"][fixes].tolist())
        turns, begins = dict[int, float](), 0.0
        for auv, count in counts.items() if behind.acknowledgement is not None else ():
            turns[auv] = begins
            begins += behind.acknowledgement_turn_s(count)
        lasts = sum(message.airtime_s for message in messages)
        longest = max(message.airtime_s for message in messages)
        delay = max(message.delay_s for message in messages)
        self._follows[asv] = Following(
            time + lasts, len(messages), behind.relay_turn_s(longest), delay,
            behind.pause_s(len(messages)), turns,
        )  # fmt: skip
        return behind.lasts_s(messages, tuple(counts.values()))

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
        """Send the fixes `rows` (k,) of a round in a frame that starts at `time` (s), for the first
        time or again; their arrivals are not written yet.
        """
        number, fixes = len(self._first), self._fixes.array
        for row in rows:
            if isfinite(fixes[row]["broadcast_at_s"]):
                self._repeats[int(row)] += 1
            else:
                fixes["broadcast_at_s"][row], fixes["broadcast_by"][row] = time, asv
                fixes["frame"][row] = number
        super().send(round_number, rows, asv, time, message, part, NOTHING)
        airtime = message.airtime_s
        self.sounds.deafen(BY_OWN_FRAME, number, len(self._auvs) + asv, time, airtime)
        following = self._follows.get(asv) if self._behind is not None else None
        sent = AsvFrame(number, rows, message, part, time + airtime, following)
        for auv in self._waiting(sent):
            self._when_over(self._first[number] + auv, partial(self._frame_is_over, sent, auv))

    def _waiting(self, sent: AsvFrame) -> list[int]:
        """Return the AUVs that need a frame and have not decoded it."""
        if not len(sent.fixes):
            return []
        matters = {*self._fixes.array["auv"][sent.fixes].tolist(), *self._relays}
        if sent.message.named:
            matters = {*range(len(self._auvs))}
        return sorted(auv for auv in matters if (sent.number, auv) not in self._decoded)

    def _frame_is_over(self, sent: AsvFrame, auv: int, row: int) -> None:
        """Deliver an ASV's frame that has just ended at an AUV, if the AUV has decoded it."""
        found = self._received(np.array([sent.number]), np.array([auv]), self._env.now + ROUNDING)
        if found[0]["outcome"] == HEARD:
            self._hand_over(row, sent.message.delay_s, partial(self._take, sent, auv, 0, -1, NONE))

    def _when_over(self, row: int, verb: Callable[[int], None]) -> None:
        """Call `verb` with a sound's row once that is over at its listener, unless out of range."""
        if self.sounds.array[row]["outcome"] == OUT_OF_RANGE:
            return

        def look(_: Any) -> None:
            self.sounds.known(self._env.now)
            if self.sounds.expected_end(row, self._env.now) > self._env.now + ROUNDING:
                self._when_over(row, verb)
            else:
                verb(row)

        expected = self.sounds.expected_end(row, self._env.now)
        moment(self._env, expected).callbacks.append(look)

    def _hand_over(self, row: int, delay_s: float, verb: Callable[[float, float], None]) -> None:
        """Call `verb` when the modem delivers a frame, `delay_s` after the end of its sound `row`:
        with that instant (s), exact and on the clock.
        """
        sound = self.sounds.array[row]
        sent_at = float(sound["sent_at_s"])
        lasts = float(sound["ended_at_s"]) - sent_at + delay_s
        exact, on_clock = sent_at + lasts, self._clock.after(sent_at, lasts)
        if delay_s > 0.0:
            moment(self._env, exact).callbacks.append(lambda _: verb(exact, on_clock))
        else:
            verb(exact, on_clock)

    # Frames that AUVs take and send

    def _take(
        self, sent: AsvFrame, auv: int, hops: int, turn: int, by: int, time: float, on_clock: float
    ) -> None:
        """Let an AUV take a frame that its modem delivers at `time` (s), `on_clock` with ticks: its
        own fixes, and its turns to forward and to acknowledge.

        The frame came over `hops` AUVs, last over the AUV `by` in its `turn`; straight from its ASV
        over 0, with NONE and -1.
        """
        if (sent.number, auv) in self._decoded:
            return
        self._decoded[sent.number, auv] = on_clock
        own = [int(fix) for fix in sent.fixes if self._fixes.array["auv"][fix] == auv]
        for fix in own:
            self._owed[auv].append((on_clock, fix))
            if fix in self._came:
                self._duplicates[fix] += 1
            else:
                self._came[fix] = hops, by, sent.number
                self._expect(fix, on_clock)
        following, behind = sent.following, self._behind
        if following is None or behind is None:
            return
        begins = _first_turn(sent, following, turn, time)
        if hops < behind.hops and auv in self._relays:
            place = hops * len(self._relays) + self._relays.index(auv)
            later = (place * following.parts + sent.part) * following.turn_s
            self._send_at(begins + later, partial(self._relay, sent, auv, hops + 1, place))
        if own and behind.acknowledgement is not None:
            later = behind.turns(following.parts) * following.turn_s
            later += (behind.hops - hops) * following.delay_s + following.acknowledge_s[auv]
            self._send_at(begins + later, partial(self._acknowledge, sent, auv, hops))

    def _send_at(self, time: float, verb: Callable[[float], None]) -> None:
        """Let an AUV send at an instant (s): call `verb` with it."""
        moment(self._env, time).callbacks.append(lambda _: verb(max(time, self._env.now)))

    def _relay(self, sent: AsvFrame, auv: int, hops: int, turn: int, time: float) -> None:
        """Let an AUV forward a frame at `time` (s) in its `turn`, as the last of `hops` AUVs."""
        message = sent.message
        row = AuvFrame(
            len(self._record.auv_frames), "relay", auv, sent.number, hops, time, message.airtime_s,
            message.size_bytes, message.fixes,
        )  # fmt: skip
        heard = self._sound(row)
        for listener in self._waiting(sent):
            if listener in heard:
                over = partial(self._copy_is_over, sent, listener, hops, turn, auv)
                self._when_over(heard[listener], over)

    def _copy_is_over(
        self, sent: AsvFrame, auv: int, hops: int, turn: int, by: int, row: int
    ) -> None:
        """Deliver a forwarded frame whose sound `row` has just ended at an AUV, if the AUV has
        decoded it; `hops`, `turn` and `by` as of :meth:`_take`.
        """
        if self._became(row, self._env.now)[0] == HEARD:
            taken = partial(self._take, sent, auv, hops, turn, by)
            self._hand_over(row, sent.message.delay_s, taken)

    def _acknowledge(self, sent: AsvFrame, auv: int, hops: int, time: float) -> None:
        """Let an AUV acknowledge at an instant (s) all fixes that it has decoded since its last
        acknowledgement; each broadcast is acknowledged once.
        """
        owed, self._owed[auv] = self._owed[auv], []
        fixes = sorted({fix for _, fix in owed})
        if not fixes:
            return
        assert self._behind is not None
        size, airtime, delay = self._behind.acknowledging(len(fixes))
        row = AuvFrame(
            len(self._record.auv_frames), "acknowledgement", auv, sent.number, hops, time, airtime,
            size, len(fixes),
        )  # fmt: skip
        for listener, sound in self._sound(row).items():
            if listener >= len(self._auvs):
                self._when_over(sound, partial(self._is_acknowledged, fixes, delay))

    def _is_acknowledged(self, fixes: list[int], delay_s: float, row: int) -> None:
        """Deliver an acknowledgement that has just ended at an ASV, if the ASV has decoded it."""
        if self._became(row, self._env.now)[0] == HEARD:
            self._hand_over(row, delay_s, partial(self._know, fixes))

    def _know(self, fixes: list[int], time: float, _: float) -> None:
        """Note that fixes are acknowledged from an instant (s) on."""
        assert self.acknowledged is not None
        for fix in fixes:
            self.acknowledged.note(fix, time)

    def _sound(self, row: AuvFrame) -> dict[int, int]:
        """Send a frame of an AUV; return the rows of its sounds, by listener."""
        self._record.auv_frames.append(row)
        by, channel = self._spreading, self._band.channel
        if channel is not None:
            by = by._replace(channel=channel(row.payload_bytes, row.airtime_s))
        signal = BY_AUV_FRAME, row.auv_frame, row.auv, row.sent_at_s, row.airtime_s
        sent = self.sounds.send(*signal, by, self._keys[row.auv], self._sent_by[row.auv])
        self._sent_by[row.auv] += 1
        if self.deafens_auvs is not None:
            self.deafens_auvs.deafen(BY_OWN_FRAME, *signal[1:])
        return {int(self.sounds.array[at]["listener"]): at for at in sent}

    def _became(self, row: int, time: float) -> tuple[int, int, int]:
        """Return the outcome of the sound of an AUV's frame at its listener by an instant (s), the
        reason, and the number of the signal that overlapped it.
        """
        return self.sounds.outcome(row, time, self._band.capture)

    # Outcomes

    def _hear_pings(self) -> None:
        """Note the fixes that decided pings acknowledge: each ping reports those that its AUV has
        had since its ping before, whether that was heard or not.
        """
        assert self.acknowledged is not None
        pings, receptions = self._record.pings.rows, self._record.receptions.rows
        asked = [*self._undecided, *range(self._pings_seen, len(pings))]
        self._pings_seen = len(pings)
        self._undecided = [ping for ping in asked if isfinite(pings["passed_at_s"][ping])]
        for ping in pings[sorted({*asked}.difference(self._undecided))]:
            if ping["call"] not in (NONE, HEARD):  # its AUV did not hear the call
                continue
            auv, sent_at = int(ping["auv"]), float(ping["sent_at_s"])
            told = [fix for time, fix in self._owed[auv] if time <= sent_at]
            self._owed[auv] = [owed for owed in self._owed[auv] if owed[0] > sent_at]
            if told and ping["heard_by"] > 0:
                met = receptions[ping["first"] : ping["end"]]
                passed = met["arrived_at_s"][met["outcome"] != OUT_OF_RANGE].max() + self._ping_s
                for fix in told:
                    self.acknowledged.note(fix, float(passed))

    def deliver(self, time: float) -> None:
        """Deliver every fix that has reached its AUV by an instant (s)."""
        Deliveries.deliver(self, time)

    def decoded(self, broadcast: int, time: float) -> NDArray[np.bool_]:
        """Return which AUVs (n,) have decoded a broadcast, or a forwarded copy, by `time` (s)."""
        found = super().decoded(broadcast, time)
        for auv in range(len(self._auvs)):
            found[auv] |= self._decoded.get((broadcast, auv), inf) <= time
        return found

    def close(self, time: float) -> None:
        """Deliver the fixes that have arrived by the mission's last instant (s); record the
        outcomes of fixes and frames.
        """
        if self.acknowledged is not None:
            self.acknowledged.update()
        self.deliver(time)
        fixes = self._fixes.rows
        never = np.flatnonzero((fixes["outcome"] == IN_FLIGHT) & (fixes["frame"] != NONE))
        received = self._received(fixes["frame"][never], fixes["auv"][never], time)
        became = np.where(received["why"] == BLOCKED, BLOCKED, received["outcome"])
        fixes["outcome"][never] = np.where(became == HEARD, IN_FLIGHT, became)
        super().close(time)
        self._record.services = [
            self._service(fix, outcome) for fix, outcome in enumerate(fixes["outcome"].tolist())
        ]
        self._record.auv_frame_receptions = self._met(time)

    def _service(self, fix: int, outcome: int) -> FixService:
        """Return the row on how a fix came, with its outcome, and on its acknowledgement."""
        known = {} if self.acknowledged is None else self.acknowledged.since_s
        hops, by, frame = self._came.get(fix, (None, NONE, None))
        if outcome != DELIVERED:
            hops, by, frame = None, NONE, None
        relayed_by = None if by == NONE else f"AUV{by}"
        return FixService(
            hops, relayed_by, frame, self._repeats[fix], self._duplicates[fix], known.get(fix)
        )

    def _met(self, time: float) -> Rows:
        """Return the outcomes of the frames of AUVs by the mission's last instant (s), (k,), a row
        for each vehicle at which one sounds, :data:`..records.rows.AUV_FRAME_RECEPTION`.
        """
        sounds = self.sounds.array
        rows = np.flatnonzero(self.sounds.rows["kind"] == BY_AUV_FRAME)
        met = np.empty(len(rows), AUV_FRAME_RECEPTION)
        for line, row in zip(met, rows.tolist(), strict=True):
            line["outcome"], line["why"], line["overlapped_by"] = self._became(row, time)
            sound = sounds[row]
            line["auv_frame"], line["vehicle"] = sound["signal"], sound["listener"]
            line["loss_probability"], arrived = sound["loss"], sound["arrived_at_s"]
            line["arrived_at_s"] = arrived if arrived < time else nan
        return met


def _first_turn(sent: AsvFrame, following: Following, turn: int, time: float) -> float:
    """Return when (s) the first turn begins, as an AUV reckons that got a frame at `time` (s),
    which was sent in a `turn` (-1: by its ASV).
    """
    late = following.delay_s - sent.message.delay_s
    if turn < 0:
        return time + late + (following.ends_at_s - sent.ends_at_s) + following.pause_s
    passed = (turn * following.parts + sent.part) * following.turn_s
    return time + late - passed - sent.message.airtime_s
