"""The HF band for access programs: every vehicle sends, and hears all others.

Pings of AUVs are receptions at ASVs, as always (:mod:`..pings`), which the program of an ASV hears
as they end there.  At other AUVs they are sounds beside all other signals, on the same sea
(:mod:`...acoustics.sounds`): a signal is lost as a ping is over the same path, drowned by sounds
that overlap it, and deafens its sender meanwhile.
"""

from bisect import bisect_left
from collections.abc import Callable, Sequence
from heapq import heappop, heappush
from itertools import count
from math import inf, isfinite, isnan, log10, nan
from operator import itemgetter
from typing import Any

import numpy as np
import simpy
from numpy.typing import NDArray
from simpy.events import EventPriority

from ....support.arrays import Floats, by_number
from ....support.compiled import compiled
from ....support.facts import cached_property
from ....support.streams import Purpose, Streams
from ....support.wording import did_you_mean, refuse
from ...acoustics.signals import ROUNDING, Pings, luck_keys, signal_outcome
from ...acoustics.sounds import heard_meanwhile
from ...records.events import (
    BY_PING,
    BY_SIGNAL,
    FAILED_MEANWHILE,
    HEARD,
    IN_FLIGHT,
    LOST,
    Signal,
)
from ...records.rows import NONE, SIGNAL_RECEPTION, Recorder, Rows
from ..data import Data
from ..happenings import Happenings
from ..outcomes import Outcomes
from ..pings import HfBand
from ..steps import moment
from . import PING
from .node import HeardSignal, Node, ToSend

# Pings of one instant become one ping group, after all other events of that instant.
LATE = EventPriority(2)

# What says from when to when a ping is where it arrives
SPAN = ("arrived_at_s", "ended_at_s")

# Bytes of a signal, at most
MOST_BYTES = 65_535


class SharedAir:
    """The signals that vehicles send and hear on HF, each by its own program."""

    def __init__(
        self,
        env: simpy.Environment,
        uplink: HfBand,
        record: Recorder,
        streams: Streams,
        *,
        bit_rate_bps: float,
        hearing: bool,
        ping: Callable[[Sequence[int], float, Floats | None, float | None], object] | None = None,
        data: Data | None = None,
        watching: Happenings | None = None,
        outcomes: Outcomes | None = None,
    ) -> None:
        """`ping` takes AUVs, an instant (s), how long (s) each was held back and a level (dB), and
        lets these AUVs ping; None: no program pings.  If `hearing`, AUVs hear each other's pings.
        After its pings an AUV sends its `data`, if any.  ASVs hear pings as `watching` reports
        their `outcomes`.
        """
        self.env, self.bit_rate_bps, self._ping, self._data = env, bit_rate_bps, ping, data
        self._uplink, self._record, self._sounds = uplink, record, uplink.sounds
        self._lasts, self._fleets, self.auvs = (
            uplink.band.duration, uplink.sounds.fleets, uplink.sounds.auvs
        )  # fmt: skip
        if hearing:
            uplink.on_ping.append(self.overhear)
        self.names = [
            f"{kind}{number}"
            for kind, fleet in zip(("AUV", "ASV"), self._fleets, strict=True)
            for number in range(len(fleet))
        ]
        self._streams = streams
        self._sent = np.zeros(len(self.names), dtype=np.int64)  # signals of each so far
        self._sends_until = np.full(len(self.names), -inf)
        #: AUVs that ping now, how long they were held back, and at which level (dB).
        self._due: list[tuple[int, float | None, float | None]] = []
        self._ping_level: float | None = None  # of those that have just been sent
        self._said: list[ToSend] = []
        self._inboxes: dict[int, _Inbox] = {}
        self._watching, self._outcomes = watching, outcomes
        self._quieter: list[tuple[int, float, float, float]] = []  # signals below full power

    @cached_property
    def _keys(self) -> list[NDArray[np.uint64]]:
        """Keys that draw the luck of signals from each vehicle to each."""
        senders = [(kind, number) for kind in (0, 1) for number in range(len(self._fleets[kind]))]
        return [luck_keys(self._streams, Purpose.SIGNAL, whose, self._fleets) for whose in senders]

    # Sending

    def send(self, node: Node, message: ToSend, waited_s: float | None) -> simpy.Event:
        """Send a signal of a vehicle now, as of :meth:`.node.Node.send`."""
        time, lasts = node.now, self._duration(node, message)
        self._check_level(message.level_db)
        if message.kind == PING and self._data is not None:
            lasts += self._data.lasts_s(node.number, time)
        if time < self._sends_until[node.number] - ROUNDING:
            refuse(
                "send", message.kind, "wait until the vehicle's last signal is over",
                "`yield` what the send before it returned",
            )  # fmt: skip
        self._sends_until[node.number] = time + lasts
        if message.kind == PING:
            if not self._due:
                flush = self.env.event()
                flush.callbacks.append(lambda _: self._let_ping(time))
                flush._ok, flush._value = True, None
                self.env.schedule(flush, LATE)
            self._due.append((node.number, waited_s, message.level_db))
        else:
            self._signal(node.number, message, time, lasts)
        return node.at(time + lasts)

    def _check_level(self, level_db: float | None) -> None:
        """Refuse a source level (dB) above the channel's, or any where the channel has no
        levels.
        """
        most = self._uplink.source_level_db
        if level_db is not None and most is None:
            refuse(
                "`level_db`", level_db, "be left out where the channel knows of no levels",
                "choose acoustics.hf.channel: sonar or table",
            )  # fmt: skip
        elif level_db is not None and most is not None and not -inf < level_db <= most:
            full = f"be at most {most:g} dB, the channel's source_level_db"
            refuse("`level_db`", level_db, full, "give dB re 1 uPa at 1 m")

    def _spare(self, sender: int, level_db: float | None, time: float, lasts: float) -> None:
        """Note the share of full power that a signal at a level (dB; None: full) saves for a time
        (s).
        """
        if level_db is not None:
            most = self._uplink.source_level_db
            assert most is not None
            share = 1.0 - 10.0 ** ((level_db - most) / 10.0)
            self._quieter.append((sender, time, lasts, share))

    def spared_s(self, end: float) -> Floats:
        """Return the time (s) at full power that each vehicle (n,) has saved by lower levels up to
        an instant (s).
        """
        spared = np.zeros(len(self.names))
        for sender, time, lasts, share in self._quieter:
            spared[sender] += share * max(min(lasts, end - time), 0.0)
        return spared

    def _duration(self, node: Node, message: ToSend) -> float:
        """Return how long (s) a signal lasts; refuse a signal that cannot be sent."""
        kind, size = message.kind, message.bytes
        if not isinstance(kind, str) or not kind:
            refuse("`kind`", repr(kind), "be a word", f"name it as you like, or {PING!r}")
        if not 0 <= size <= MOST_BYTES:
            refuse("`bytes`", size, f"be 0 to {MOST_BYTES}", "send it in several signals")
        if message.to is not None and message.to not in self.names:
            hint = did_you_mean(str(message.to), self.names)
            refuse("`to`", message.to, "name a vehicle, such as ASV0", f"send it to all{hint}")
        if message.kind == PING:
            if node.is_asv:
                refuse("`kind`", PING, "be another one where an ASV sends", "name it as you like")
            return self._lasts
        lasts = message.lasts_s
        if lasts is None:
            lasts = node.lasts_s(message.bytes)
        if not (0.0 < lasts < inf and isfinite(lasts)):
            refuse(
                "duration (s) of a signal", lasts, "be finite and above 0", "give bytes, or lasts_s"
            )
        return lasts

    def _let_ping(self, time: float) -> None:
        """Let all AUVs that are due ping at an instant (s), in the order of their numbers."""
        due, self._due = sorted(self._due, key=itemgetter(0)), []
        assert self._ping is not None
        for level in dict.fromkeys(level for *_, level in due):
            alike = [(auv, wait) for auv, wait, at in due if at == level]
            auvs, waits = [auv for auv, _ in alike], [wait for _, wait in alike]
            waited = None if None in waits else np.array(waits, dtype=np.float64)
            self._ping_level = level
            self._ping(auvs, time, waited, level)
            for auv in auvs:
                self._spare(auv, level, time, self._lasts)

    def overhear(self, pings: range) -> None:
        """Let AUVs hear each other's pings, and nothing while they ping themselves."""
        for ping in pings:
            row = self._record.pings.array[ping]
            auv, time = int(row["auv"]), float(row["sent_at_s"])
            self._emit(BY_PING, ping, auv, time, self._lasts, self.auvs, self._ping_level)
            self._sends_until[auv] = max(self._sends_until[auv], time + self._lasts)

    def sends_until(self, vehicle: int) -> float:
        """Return when (s) the last signal of a vehicle ends."""
        return float(self._sends_until[vehicle])

    def _signal(self, sender: int, message: ToSend, time: float, lasts: float) -> None:
        number = len(self._record.signals)
        kind, to, size, level = message.kind, message.to, message.bytes, message.level_db
        name = self.names[sender]
        row = Signal(number, kind, name, to, time, lasts, size, level, message.ping)
        self._record.signals.append(row)
        self._said.append(message)
        self._spare(sender, level, time, lasts)
        fleet, own = (0, sender) if sender < self.auvs else (1, sender - self.auvs)
        if self._uplink.on_signal is not None:
            self._uplink.on_signal(row)
        if own not in self._fleets[fleet].failed(time):
            self._emit(BY_SIGNAL, number, sender, time, lasts, len(self.names), level)

    def _emit(
        self, kind: int, number: int, sender: int, time: float, lasts: float, listeners: int,
        level_db: float | None,
    ) -> None:  # fmt: skip
        """Write the sounds of a signal, the `number` of its `kind`, that `sender` begins at `time`
        (s) for `lasts` (s) at a level (dB; None: full), at the first so many `listeners` of all
        vehicles.
        """
        sent = self._sounds.send(
            kind, number, sender, time, lasts, self._uplink.at_level(level_db), self._keys[sender],
            int(self._sent[sender]), listeners,
        )  # fmt: skip
        self._sent[sender] += 1
        for row in sent if self._inboxes else ():
            inbox = self._inboxes.get(int(self._sounds.array[row]["listener"]))
            if inbox is not None:
                inbox.coming.append(row)
                self._look_for(inbox, row)
        if self._uplink.on_sounds is not None:
            self._uplink.on_sounds(sent)

    # Hearing

    def heard(self, node: Node, since: float) -> Floats:
        """Return the intervals (n, 2), s, of sounds at a vehicle (:meth:`.node.Node.heard`)."""
        sea, count, time = self._sounds.sea.address, self._sounds.count, node.now
        spans = heard_meanwhile(sea, count, node.number, since, time, self._sounds.known(time))
        if node.is_asv:
            pings = self._record.receptions.rows
            pings = pings[(pings["asv"] == node.number - self.auvs) & (pings["sound"] > 0.0)]
            here = pings[(pings["arrived_at_s"] <= time) & (pings["ended_at_s"] > since)]
            spans = np.concatenate((spans, np.column_stack([here[name] for name in SPAN])))
            spans = spans[np.argsort(spans[:, 0], kind="stable")]
        return spans

    def hears(self, node: Node) -> simpy.Event:
        """Return the event of the next signal that a vehicle decodes, as of
        :meth:`.node.Node.hears`.
        """
        inbox = self._inboxes.get(node.number)
        if inbox is None:
            rows = self._sounds.rows
            here = (rows["listener"] == node.number) & (rows["sender"] != node.number)
            here &= (rows["kind"] == BY_PING) | (rows["kind"] == BY_SIGNAL)
            inbox = _Inbox(node, np.flatnonzero(here).tolist())
            self._inboxes[node.number] = inbox
            if node.is_asv and self._watching is not None and self._outcomes is not None:
                self._hear_pings(inbox, node.number - self.auvs, self._watching)
        if inbox.waiting is not None and not inbox.waiting.triggered:
            refuse("hears", node.name, "be waited for once at a time", "`yield` it before the next")
        inbox.waiting = self.env.event()
        self._look(inbox)
        if not inbox.waiting.triggered:
            for row in inbox.coming:
                self._look_for(inbox, row)
        return inbox.waiting

    def _hear_pings(self, inbox: "_Inbox", asv: int, watching: Happenings) -> None:
        """Let an ASV hear the pings that it has decoded so far, and each that it will decode."""
        assert self._outcomes is not None
        now, receptions = self.env.now, self._record.receptions.rows
        here = (receptions["asv"] == asv) & (receptions["ended_at_s"] <= now)
        for row in np.flatnonzero(here & np.isin(receptions["outcome"], (IN_FLIGHT, HEARD))):
            outcome, snr_db = self._outcomes.outcome_of(int(row))
            if outcome == HEARD:
                met, levels = receptions[row], self._uplink.receiver.levels(snr_db)
                self._hear_ping(
                    inbox, int(met["ping"]), int(met["auv"]), float(met["arrived_at_s"]),
                    float(met["ended_at_s"]), levels["level_db"],
                )  # fmt: skip
        watch = watching.watch({"reception"}, {"asv": asv, "outcome": "heard"}, now)

        def take(event: simpy.Event) -> None:
            _, time, row = event._value
            self._hear_ping(inbox, row.ping, row.auv, row.arrived_at_s, time, row.level_db)
            self._tell(inbox)
            watch.next().callbacks.append(take)

        watch.next().callbacks.append(take)

    def _hear_ping(
        self, inbox: "_Inbox", ping: int, auv: int, began: float, ended: float,
        level_db: float | None,
    ) -> None:  # fmt: skip
        span, level = (inbox.node.reads(began), inbox.node.reads(ended)), _known(level_db)
        inbox.take(HeardSignal(PING, self.names[auv], None, *span, 0, None, level, ping))

    def sight_of(self, ping: int, asv: int) -> Any:
        """Return an ASV's measurement of a ping, as of :meth:`.node.Node.sight`."""
        return None if self._outcomes is None else self._outcomes.sight_of(ping, asv)

    def give_up(self, event: simpy.Event) -> None:
        """End the wait for a signal that has not come: succeed its event with None."""
        if not event.triggered:
            event.succeed(None)

    def _look_for(self, inbox: "_Inbox", row: int) -> None:
        """Schedule a look at a sound, a row, for when it may be over at a vehicle that waits."""
        if inbox.waiting is None or inbox.waiting.triggered or row in inbox.awaited:
            return
        inbox.awaited.add(row)
        event = moment(self.env, self._sounds.expected_end(row, self.env.now))

        def look(_: simpy.Event) -> None:
            inbox.awaited.discard(row)
            self._look(inbox)
            if row in inbox.coming:
                self._look_for(inbox, row)

        event.callbacks.append(look)

    def _look(self, inbox: "_Inbox") -> None:
        """Decide sounds that are over at a vehicle by now; hand over the first that was decoded."""
        over = []
        for row in inbox.coming:
            outcome, *_ = self._uplink.became(row, self.env.now)
            if outcome != IN_FLIGHT:
                over.append(row)
                if outcome == HEARD:
                    inbox.take(self._told(inbox.node, row))
        inbox.coming = [row for row in inbox.coming if row not in over]
        self._tell(inbox)

    def _tell(self, inbox: "_Inbox") -> None:
        """Hand over the first signal that a vehicle has decoded, if its program waits for one."""
        if inbox.heard and inbox.waiting is not None and not inbox.waiting.triggered:
            inbox.waiting.succeed(heappop(inbox.heard)[-1])

    def _told(self, node: Node, row: int) -> HeardSignal:
        """Return a decoded signal (a row of sounds) as the program of a vehicle gets it."""
        sound = self._sounds.array[row]
        span = node.reads(float(sound["arrived_at_s"])), node.reads(float(sound["ended_at_s"]))
        sender, number, level = self.names[sound["sender"]], int(sound["signal"]), None
        if self._uplink.source_level_db is not None:
            level = self._uplink.receiver.noise_db + 10.0 * log10(float(sound["sound"]))
        if sound["kind"] == BY_PING:
            return HeardSignal(PING, sender, None, *span, 0, None, level, number)
        message = self._said[number]
        return HeardSignal(
            message.kind, sender, message.to, *span, message.bytes, message.data, level
        )

    def close(self, time: float) -> None:
        """Record the outcome of each signal at each vehicle by an instant (s), the end, and the
        ping that it is about.
        """
        if self._ping is not None:
            self._join_pings()
        rows, table = self._sounds.rows, self._record.signal_receptions
        self._sounds.settle(time)
        told = (rows["kind"] == BY_SIGNAL) | (rows["kind"] == BY_PING)
        place = np.cumsum(told) - 1
        table.room_for(len(rows))
        table.count = int(told.sum())
        for here in by_number(rows["listener"], len(self.names)):
            # the sounds of one vehicle alone, so that searches are short
            lines = np.empty(len(here), SIGNAL_RECEPTION)
            capture = self._uplink.receiver.capture
            _note(rows[here], lines, time, *self._met(), self.auvs, capture)
            failing = self._sounds.failing(rows[here]) & np.isin(lines["outcome"], (HEARD, LOST))
            lines["outcome"][failing], lines["why"][failing] = LOST, FAILED_MEANWHILE
            table.rows[place[here[told[here]]]] = lines[told[here]]

    def _join_pings(self) -> None:
        """Note of each signal the next ping of the AUV that sent it, or to which it was sent."""
        pings = self._record.pings.rows
        sent = pings["sent_at_s"].tolist()
        own = zip(self.names, by_number(pings["auv"], self.auvs), strict=False)
        pings_of = {name: here.tolist() for name, here in own}
        for signal in self._record.signals:
            here = pings_of.get(signal.sender, pings_of.get(signal.to or "", []))
            place = bisect_left(here, signal.sent_at_s, key=sent.__getitem__)
            if signal.ping is None and place < len(here):
                signal.ping = here[place]

    def _met(self) -> Pings:
        """Return the pings that sound at ASVs: receptions, pings, and their duration (s)."""
        return self._record.receptions.rows, self._record.pings.rows, self._lasts


class _Inbox:
    """The incoming signals of a vehicle whose program listens: rows of sounds that are `coming`;
    those `heard` but not handed over, by the instant (s) of their end; rows `awaited`, which have
    an event; and the event that is `waiting`.
    """

    def __init__(self, node: Node, coming: list[int]) -> None:
        self.node, self.coming = node, coming
        self.heard: list[tuple[float, int, HeardSignal]] = []
        self.awaited: set[int] = set()
        self.waiting: simpy.Event | None = None
        self._count = count()  # of two that end at one instant the first comes first

    def take(self, heard: HeardSignal) -> None:
        """Keep a decoded signal until the program asks for it."""
        heappush(self.heard, (heard.ended_at_s, next(self._count), heard))


def _known(level_db: float | None) -> float | None:
    return None if level_db is None or isnan(level_db) else level_db


@compiled
def _note(
    sounds: Rows, lines: Rows, time: float, receptions: Rows, pings: Rows, ping_s: float,
    auvs: int, capture: float,
) -> None:  # fmt: skip
    """Write the outcomes of the sounds (n,) of one vehicle by an instant (s) to lines (n,),
    :data:`...records.rows.SIGNAL_RECEPTION`; other arguments as of
    :func:`...acoustics.signals.signal_outcome`.
    """
    for row in range(len(sounds)):
        line, sound = lines[row], sounds[row]
        line.outcome, line.why, line.overlapped_by = signal_outcome(
            row, sounds, time, receptions, pings, ping_s, auvs, capture, None, inf
        )
        line.signal = sound.signal if sound.kind == BY_SIGNAL else NONE
        line.ping = sound.signal if sound.kind == BY_PING else NONE
        line.vehicle, line.loss_probability = sound.listener, sound.loss
        line.arrived_at_s = sound.arrived_at_s if sound.arrived_at_s < time else nan
