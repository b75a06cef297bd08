"""Happenings of a mission, for code that waits for them: reported at the instant at which they
occur.

The protocol decides pings late and many at once, and applies the fixes of a frame together.  Code
that waits for an arrival, its outcome or a delivery gets an event of its own at the true instant;
what is decided, and every table, stays the same.
"""

from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields, replace
from functools import partial
from math import isnan, nan
from numbers import Real
from typing import Any, NamedTuple, get_args, get_type_hints

import numpy as np
import simpy

from ...support.arrays import Ints
from ...support.wording import did_you_mean
from ..records.events import (
    BLOCKED,
    BY_PING,
    BY_SIGNAL,
    IN_FLIGHT,
    LASTING_ERRORS,
    OUTCOMES,
    TOLD_WHY,
    WORDS,
    Broadcast,
    Fix,
    Ping,
    Reception,
    Signal,
    SignalReception,
)
from ..records.rows import NONE, Recorder, Row, fused
from .deliveries import Deliveries
from .outcomes import Outcomes
from .pings import HfBand
from .steps import moment

# Each kind of happening, and the class of its row
KINDS: dict[str, type] = {
    "ping": Ping,
    "arrival": Reception,
    "reception": Reception,
    "broadcast": Broadcast,
    "delivery": Fix,
    "signal": Signal,
    "signal_reception": SignalReception,
}

# Outcomes that the row may have then
ENDS = {
    "arrival": ("in_flight",),
    "reception": ("heard", "lost", "collided"),
    "delivery": ("delivered",),
    "signal_reception": ("heard", "lost", "collided", "out_of_range", "blocked"),
}


class Happening(NamedTuple):
    """Something that has happened at an instant (s): its kind, and its row as it is then.

    `ping`: an AUV begins to ping (:class:`Ping`), with passive ranging an ASV. `arrival`: the
    ping's front reaches an ASV in range (Reception), with passive ranging an AUV. `reception`: the
    ping has ended there, and was `heard`, `lost` or `collided` (Reception).  `broadcast`: an ASV
    begins a frame or an answer (Broadcast).  `delivery`: an AUV has received a fix, and its
    navigator has used or refused it (Fix).  `signal`: a vehicle begins to send a signal of its
    program, modem, or to peers (Signal).  `signal_reception`: that, or a ping, has ended at a
    vehicle that it has reached (SignalReception).

    A row has the columns of the table of its name; vehicles are numbers, in signals names,
    and missing values None.
    """

    kind: str
    time: float
    row: Any


class Watch:
    """A queue of happenings of some kinds whose rows have the values of `which`, by column: each
    comes once, in order, and none is missed.
    """

    def __init__(
        self,
        env: simpy.Environment,
        kinds: Iterable[str],
        which: dict[str, Any],
        close: Callable[["Watch"], None],
    ) -> None:
        self.kinds, self._which, self._env, self._close = frozenset(kinds), which, env, close
        self._seen, self._waiting = deque[Happening](), deque[simpy.Event]()

    def next(self) -> simpy.Event:
        """Return the event of the next happening; its value is that :class:`Happening`."""
        event = self._env.event()
        if self._seen:
            event.succeed(self._seen.popleft())
        else:
            self._waiting.append(event)
        return event

    def tell(self, happening: Happening) -> None:
        """Take a happening of one of the kinds, if its row has the values that are waited for."""
        if any(getattr(happening.row, name) != value for name, value in self._which.items()):
            return
        if self._waiting:
            self._waiting.popleft().succeed(happening)
        else:
            self._seen.append(happening)

    def close(self) -> None:
        """Stop waiting."""
        self._close(self)


def refuse_unknown(
    kinds: Iterable[str], which: Mapping[str, Any], counts: Mapping[str, int]
) -> None:
    """Refuse unknown kinds and columns, and values that a column never has.

    `which` maps columns of the kinds' rows to values that are waited for; `counts` maps the columns
    `auv` and `asv` to the numbers of these vehicles.

    Raises:
        ValueError: naming what there is instead.
    """
    if not kinds:
        raise ValueError(f"nothing is waited for; wait for one or more of {', '.join(KINDS)}")
    for kind in kinds:
        if kind not in KINDS:
            raise ValueError(
                f"nothing of the kind {kind!r} happens{did_you_mean(kind, KINDS)}; wait for "
                f"one of {', '.join(KINDS)}"
            )
        columns = get_type_hints(KINDS[kind])
        for name, value in which.items():
            if name not in columns:
                raise ValueError(
                    f"a {kind} has no column {name!r}{did_you_mean(name, columns)}; it has "
                    f"{', '.join(columns)}"
                )
            _refuse_value(kind, name, value, columns[name], counts)


def _refuse_value(kind: str, name: str, value: Any, hint: Any, counts: Mapping[str, int]) -> None:
    """Refuse a `value` that the column `name` of a `kind` cannot have by its type `hint`, or
    because it is the number of no vehicle (`counts` as of :func:`refuse_unknown`).
    """
    types = get_args(hint) or (hint,)
    needed = "a number; vehicles are numbers, too"
    fits = isinstance(value, Real)
    if str in types:
        known = (
            ENDS[kind] if name == "outcome" else OUTCOMES if name in ("call", "call_why") else ()
        )
        needed = f"one of {', '.join(known)}" if known else "a text such as 'ASV0 ASV2'"
        fits = isinstance(value, str) and (not known or value in known)
    if not (fits or (value is None and type(None) in types)):
        raise ValueError(f"{name} of a {kind} is never {value!r}; it is {needed}")
    count = counts.get(name)
    if count is not None and value is not None and value not in range(count):
        raise ValueError(
            f"{name} of a {kind} is never {value!r}; there are {count}, of numbers from 0 on"
        )


# Columns of a reception that are unknown before it is over
LEVELS = (
    *("snr_db", "level_db", "margin_db"),
    *("azimuth_deg", "elevation_deg", "body_azimuth_deg", "body_elevation_deg"),
    "range_rate_m_per_s",
    *TOLD_WHY,
    *LASTING_ERRORS,
)


class Happenings:
    """All watches of a mission.  With passive ranging an AUV has a fix once it hears a ping."""

    def __init__(
        self, env: simpy.Environment, record: Recorder, uplink: HfBand, outcomes: Outcomes,
        downlink: Deliveries,
    ) -> None:  # fmt: skip
        self._sounds = {"arrival", "reception"}
        if downlink.heard_is_had:
            self._sounds.add("delivery")
        self._env, self._record, self._downlink = env, record, downlink
        self._uplink, self._outcomes = uplink, outcomes
        self._watches: list[Watch] = []
        self._expected: set[tuple[str, int]] = set()  # kinds and rows that have their event

    def watch(self, kinds: Iterable[str], which: dict[str, Any], since: float) -> Watch:
        """Return a watch of happenings later than an instant (s), up to which all has happened.

        `which` are values that columns of their rows must have.

        Raises:
            ValueError: for a kind or column that there is not, or a value that it never has.
        """
        watch = Watch(self._env, kinds, which, self._forget)
        auvs, asvs = self._uplink.sounds.fleets
        refuse_unknown(watch.kinds, which, {"auv": len(auvs), "asv": len(asvs)})
        self._downlink.settle(since)
        waited_for = self._kinds
        self._watches.append(watch)
        self._listen()
        for kind in watch.kinds - waited_for:  # what is under way was not expected yet
            self._expect_what_is_under_way(kind, since)
        return watch

    def next(self, kind: str, which: dict[str, Any], since: float) -> simpy.Event:
        """Return the event of the next happening of a kind, by the arguments of :meth:`watch`."""
        watch = self.watch((kind,), which, since)
        event = watch.next()
        assert event.callbacks is not None
        event.callbacks.append(lambda _: watch.close())
        return event

    @property
    def _kinds(self) -> set[str]:
        return {kind for watch in self._watches for kind in watch.kinds}

    def _forget(self, watch: Watch) -> None:
        if watch in self._watches:
            self._watches.remove(watch)
            self._listen()

    def _listen(self) -> None:
        """Have the bands report the kinds that are watched, and no others."""
        kinds = self._kinds
        sounds = kinds & {"ping", *self._sounds}
        self._uplink.on_sent = self._sent if sounds else None
        self._downlink.on_broadcast = self._broadcast if "broadcast" in kinds else None
        self._downlink.on_frame = self._framed if "delivery" in kinds else None
        self._downlink.on_delivered = self._delivered if "delivery" in kinds else None
        self._uplink.on_signal = self._signalled if "signal" in kinds else None
        self._uplink.on_sounds = self._sounding if "signal_reception" in kinds else None

    def _tell(self, kind: str, time: float, row: Any) -> None:
        happening = Happening(kind, time, row)
        for watch in [watch for watch in self._watches if kind in watch.kinds]:
            watch.tell(happening)

    def _expect_what_is_under_way(self, kind: str, since: float) -> None:
        if kind in self._sounds:
            begin, receptions = self._outcomes.first_under_way(since), self._record.receptions.rows
            for row in range(begin, len(receptions)):
                self._expect(kind, row, since)
        elif kind == "signal_reception":
            rows = self._uplink.sounds.rows
            ours = np.isin(rows["kind"], (BY_SIGNAL, BY_PING)) & (rows["ended_at_s"] > since)
            self._sounding(np.flatnonzero(ours).tolist())
        elif kind == "delivery":
            begin = self._downlink.first_under_way
            fixes = self._record.fixes.rows[begin:]
            arriving = (fixes["outcome"] == IN_FLIGHT) & (fixes["arrives_at_s"] > since)
            self._framed((begin + np.flatnonzero(arriving)).tolist())

    def _sent(self, pings: range) -> None:
        """Report pings that are sent now, and schedule events for their arrivals."""
        kinds = self._kinds
        for ping in self._record.pings.array[pings.start : pings.stop]:
            for kind in kinds & self._sounds:
                for row in range(ping["first"], ping["end"]):
                    self._expect(kind, row, -1.0)
            if "ping" in kinds:
                self._tell("ping", float(ping["sent_at_s"]), _row_of(Ping, ping))

    def _expect(self, kind: str, row: int, since: float) -> None:
        """Schedule an event for a reception's arrival, else its end, if later than `since` (s)."""
        reception, lasts = self._record.receptions.array[row], self._outcomes.band.duration
        instant = float(reception["arrived_at_s"]) + (lasts if kind != "arrival" else 0.0)
        if reception["outcome"] == IN_FLIGHT and instant > since:
            self._call_at(instant, kind, row, partial(self._heard, kind, row, instant))

    def _call_at(self, instant: float, kind: str, row: int, verb: Callable[[], None]) -> None:
        if (kind, row) in self._expected:
            return
        self._expected.add((kind, row))

        def happen(_: simpy.Event) -> None:
            self._expected.discard((kind, row))
            verb()

        moment(self._env, instant).callbacks.append(happen)

    def _heard(self, kind: str, row: int, expected: float) -> None:
        """Report a reception's arrival or end, `expected` at (s); wait again where its listener was
        predicted too near.
        """
        self._outcomes.update_arrivals(self._env.now)
        reception = self._record.receptions.array[row]
        lasts = self._outcomes.band.duration if kind != "arrival" else 0.0
        instant = float(reception["arrived_at_s"]) + lasts
        if instant > expected:
            self._call_at(instant, kind, row, partial(self._heard, kind, row, instant))
            return
        if kind == "delivery":  # `_delivered` reports it once the navigator has it
            self._downlink.settle(instant)
            return
        outcome, snr = self._outcomes.outcome_of(row) if lasts else (IN_FLIGHT, nan)
        levels = {} if isnan(snr) else self._outcomes.receiver.levels(snr)
        known = dict.fromkeys(LEVELS) | levels | {"outcome": OUTCOMES[outcome]}
        self._tell(kind, instant, _row_of(Reception, reception, **known))

    def _signalled(self, signal: Signal) -> None:
        """Report a signal that begins now."""
        self._tell("signal", signal.sent_at_s, replace(signal))

    def _sounding(self, rows: Iterable[int]) -> None:
        """Report each sound of a signal as it ends at its listener."""
        for row in rows:
            end = self._uplink.sounds.expected_end(row, self._env.now)
            self._call_at(end, "signal_reception", row, partial(self._came, row))

    def _came(self, row: int) -> None:
        """Report the outcome of a sound, a row, if it is over by now; else look again later."""
        outcome, why, by = self._uplink.became(row, self._env.now)
        if outcome == IN_FLIGHT:
            self._sounding([row])
            return
        sound, auvs = self._uplink.sounds.array[row], self._uplink.sounds.auvs
        of_ping, listener, loss = sound["kind"] == BY_PING, int(sound["listener"]), sound["loss"]
        number = int(sound["signal"])
        reception = SignalReception(
            None if of_ping else number,
            number if of_ping else None,
            f"AUV{listener}" if listener < auvs else f"ASV{listener - auvs}",
            float(sound["arrived_at_s"]),
            OUTCOMES[BLOCKED if why == BLOCKED else outcome],
            None if why == NONE else WORDS[why],
            None if by == NONE else by,
            None if isnan(loss) or why == BLOCKED else float(loss),
        )
        self._tell("signal_reception", float(sound["ended_at_s"]), reception)

    def _broadcast(self) -> None:
        """Report the broadcast that begins now."""
        sent = self._record.broadcasts[-1]
        self._tell("broadcast", sent.sent_at_s, replace(sent))

    def _framed(self, rows: Iterable[int]) -> None:
        """Schedule the delivery of each fix at its own instant."""
        for row in rows:
            instant = float(self._record.fixes.array[row]["arrives_at_s"])
            if not isnan(instant):
                deliver = partial(self._downlink.deliver, instant)
                self._call_at(instant, "delivery", row, deliver)

    def _delivered(self, rows: Ints) -> None:
        """Report fixes that are delivered now."""
        for fix in self._record.fixes.array[rows]:
            row = _row_of(Fix, fix, asvs=fused(fix, self._record.receptions.array))
            self._tell("delivery", float(fix["delivered_at_s"]), row)


def _row_of(event: type, row: Row, **known: Any) -> Any:
    """Return a row of a buffer as its event's class; `known` are values that replace the row's."""
    for field in fields(event):
        if field.name not in known:
            value = row[field.name].item()
            missing = isnan(value) if isinstance(value, float) else value == NONE
            label = WORDS[value] if field.name in ("outcome", "call", "call_why") else value
            known[field.name] = None if missing else label
    return event(**known)
