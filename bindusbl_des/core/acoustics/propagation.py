"""Propagation of pings to vehicles that move: which are in range, when the ping arrives, which
failed.

These are the compiled inner loops of the bands.
"""

from math import inf, isfinite, isnan, nan
from typing import Annotated, NamedTuple

import numpy as np

from ...support.arrays import Flags, Floats, Ints
from ...support.compiled import compiled
from ...support.packed import unpacked
from ..records.events import (
    BLOCKED,
    FAILED,
    FAILED_MEANWHILE,
    HEARD,
    IN_FLIGHT,
    LOST,
    OUT_OF_RANGE,
    UNANSWERED,
)
from ..records.rows import CALLED, NONE, PING, RECEPTION, Row, Rows
from ..vehicles.fleet import Failures
from ..vehicles.motion import Motion, Place, where
from .loss import LossTerms, loss_probability
from .travel_time import NEARLY_THERE, distance, travel_time_to

# A channel's answer about a signal: its loss probability if nothing overlaps it; its SNR (dB, or
# NaN); its strength where it overlaps others, as intensity in units of the noise (0: too weak to
# matter, 1: no levels are known); and how much later (s) it arrives than on a straight ray at the
# speed of sound (negative: sooner).  `blocked`: it never arrives, since land is between.
PROSPECT = np.dtype(
    [("loss", "f8"), ("snr_db", "f8"), ("sound", "f8"), ("late_s", "f8"), ("blocked", "i8")]
)

# The disc is compiled and answers no prospects.
NO_PROSPECTS: Rows = np.empty((0, 0), PROSPECT)

# Arrivals that overlap by less (s) only touch; rounding errors of the instants are far smaller.
TOUCH = 1e-9


class SignalBand(NamedTuple):
    """What holds for the signals of a band.

    They reach `reach` (m), inclusive, in slant range if `slant`, else in horizontal range; they
    last `duration` (s), and travel at `sound_speed` (m/s).
    """

    slant: bool
    reach: float
    duration: float
    sound_speed: float


@compiled
def within(here: Place, there: Place, slant: bool, reach: float) -> bool:
    """Return whether positions (x, y, z, m) are within a reach (m), horizontally unless `slant`."""
    rise = here[2] - there[2] if slant else 0.0
    return bool((here[0] - there[0]) ** 2 + (here[1] - there[1]) ** 2 + rise**2 <= reach**2)


class SignalPath(NamedTuple):
    """What happens to the signals of a group between sender and listener: the disc's law of loss
    (:mod:`.loss`), or another channel's `prospects` (n, m).
    """

    band: SignalBand
    loss: LossTerms
    prospects: Annotated[Rows, PROSPECT, 2]


@compiled
def prospect(
    here: Place, there: Place, number: int, listener: int, way: SignalPath
) -> tuple[bool, float, float, float, int]:
    """Return whether a listener may decode a signal of sender `number` of its group, its strength
    there, its SNR (dB), and how much later (s) than on a straight ray it arrives, as of
    :data:`PROSPECT`; and why it is not decoded, if it is not.
    """
    if way.prospects.size:
        told = way.prospects[number, listener]
        why = BLOCKED if told.blocked else OUT_OF_RANGE
        heard, sound = bool(told.loss < 1.0), float(told.sound)
        return heard, sound, float(told.snr_db), float(told.late_s), why
    near = within(here, there, way.band.slant, way.band.reach)
    return near, 1.0 if near else 0.0, nan, 0.0, OUT_OF_RANGE


@compiled
def all_within(auvs: Floats, asvs: Floats, slant: bool, reach: float) -> Flags:
    """Return :func:`within` of positions (n, 3) and others (m, 3), m, shape (n, m)."""
    near = np.empty((len(auvs), len(asvs)), np.bool_)
    for i in range(len(auvs)):
        here = auvs[i, 0], auvs[i, 1], auvs[i, 2], 0.0
        for j in range(len(asvs)):
            near[i, j] = within(here, (asvs[j, 0], asvs[j, 1], asvs[j, 2], 0.0), slant, reach)
    return near


@compiled
def loss_at(slant_range: float, number: int, listener: int, way: SignalPath) -> float:
    """Return how likely a signal over a slant range (m) is lost, from sender `number` of its group
    to a listener.
    """
    if way.prospects.size:
        return float(way.prospects[number, listener].loss)
    return loss_probability(slant_range, way.loss)


@compiled
def drowns(strength: float, others: float, capture: float) -> bool:
    """Return whether overlapping sounds of summed strength `others` destroy a signal
    (:class:`.channel.Receiver`).
    """
    return others > 0.0 and strength < capture * (1.0 + others)


@compiled
def overlap(begins: float, ends: float, other_begins: float, other_ends: float) -> bool:
    """Return whether two sounds overlap, by their begins and ends (s); touching does not count.

    >>> overlap(0.0, 1.0, 0.9, 3.0), overlap(0.0, 1.0, 1.0, 3.0)
    (True, False)
    """
    return bool(other_begins < ends - TOUCH and other_ends > begins + TOUCH)


class Spread(NamedTuple):
    """What pings propagate in, packed once: the rows of pings and receptions, with free rows; the
    signal path; the motions of senders and listeners.  AUVs send and ASVs listen, or the reverse if
    `asvs_send`.  Without `everything` listeners out of range get no row.  An AUV that was `called`
    in vain (1,) does not ping (:func:`silence`).
    """

    pings: Annotated[Rows, PING]
    receptions: Annotated[Rows, RECEPTION]
    way: SignalPath
    senders: Motion
    listeners: Motion
    asvs_send: bool
    everything: bool
    called: Annotated[Rows, CALLED]


@compiled
def spread_pings(
    packed: int, group: Ints, round_number: int, slot: int, time: float, calls: int, sure: bool,
    ping: int, row: int,
) -> int:  # fmt: skip
    """Let a group of vehicles ping at an instant (s): write the pings from row `ping` on, and from
    `row` on a reception for each listener.

    Return the row after the last reception.  `packed` is the address of a :class:`Spread`.  There
    are `calls` sounds on record by now.  Unless it is `sure` how listeners will move, the
    arrivals written are those at which a ping is nearly there (:func:`arrive`).
    """
    into = unpacked(packed, Spread)
    pings, duration, call = into.pings, into.way.band.duration, into.called[0]
    places = places_of(into.listeners, time)
    silent = call.call not in (NONE, HEARD)
    longest_so_far = pings[ping - 1].longest_s if ping else 0.0
    for number in range(group.size):
        here, line = where(into.senders, group[number], time), pings[ping]
        line.ping, line.round, line.slot = ping, round_number, slot
        line.auv = NONE if into.asvs_send else group[number]
        line.asv = group[number] if into.asvs_send else NONE
        line.sent_at_s, line.waited_s = time, nan
        line.x_m, line.y_m, line.z_m = here[0], here[1], here[2]
        line.called_at_s, line.called_by = call.called_at_s, call.called_by
        line.call, line.call_why, line.call_time_s = call.call, call.call_why, call.call_time_s
        line.first = row
        row, in_range, longest = _reach(line, number, row, places, sure, into)
        longest_so_far = max(longest_so_far, line.longest_s)
        line.end, line.in_range_of, line.heard_by = row, in_range, 0
        line.passed_at_s = inf if silent or not in_range else time + longest + duration
        line.longest_s, line.calls = longest_so_far, calls
        ping += 1
    return row


@compiled
def places_of(motion: Motion, time: float) -> Floats:
    """Return the positions x, y, z (m) of all vehicles at an instant (s), (n, 3)."""
    places = np.empty((motion.first.size - 1, 3))
    for vehicle in range(len(places)):
        places[vehicle, 0], places[vehicle, 1], places[vehicle, 2], _ = where(motion, vehicle, time)
    return places


@compiled
def _reach(
    ping: Row, number: int, row: int, places: Floats, sure: bool, into: Spread
) -> tuple[int, int, float]:
    """Write the receptions of a ping, `number` of its group, from a row on; listeners are at
    `places` (n, 3), m, as it begins.

    Return the row after the last, how many listeners are in range, and the longest travel time (s)
    to these; write the longest to any at which the ping sounds to its row.
    """
    in_range, longest, way, sound_speed = 0, 0.0, into.way, into.way.band.sound_speed
    here = ping.x_m, ping.y_m, ping.z_m, 0.0
    ping.longest_s = 0.0
    for listener in range(len(places)):
        there = places[listener, 0], places[listener, 1], places[listener, 2], 0.0
        heard, strength, snr_db, bent, why = prospect(here, there, number, listener, way)
        if heard or into.everything or strength > 0.0:
            if sure:
                sent_at = ping.sent_at_s + bent
                straight = travel_time_to(here, into.listeners, listener, sent_at, sound_speed)
            else:
                straight = NEARLY_THERE * distance(here, there) / sound_speed
                bent *= NEARLY_THERE if bent > 0.0 else 1.0 / NEARLY_THERE
            line = into.receptions[row]
            line.ping, line.listener = ping.ping, listener
            line.auv = listener if into.asvs_send else ping.auv
            line.asv = ping.asv if into.asvs_send else listener
            _set_arrival(line, ping.sent_at_s, straight, bent, way.band)
            line.loss = loss_at(line.slant_range_m, number, listener, way) if heard else 1.0
            line.outcome = IN_FLIGHT if heard else OUT_OF_RANGE
            line.why, line.overlapped_by = NONE if heard else why, NONE
            line.slow_range = nan
            line.sound, line.snr_db = strength, snr_db
            line.late_s = line.lowered = nan
            line.azimuth_deg = line.elevation_deg = nan  # until it is measured
            line.body_azimuth_deg = line.body_elevation_deg = line.range_rate_m_per_s = nan
            row += 1
            if strength > 0.0:
                ping.longest_s = max(ping.longest_s, line.travel_time_s)
            if heard:
                in_range += 1
                longest = max(longest, line.travel_time_s)
    return row, in_range, longest


@compiled
def _set_arrival(line: Row, sent_at: float, straight: float, bent: float, band: SignalBand) -> None:
    """Write when a ping arrives: `straight` (s) is its travel time on a straight ray, `bent` (s)
    how much later it arrives.
    """
    line.travel_time_s, line.bent_s, line.sent_at_s = straight + bent, bent, sent_at
    line.slant_range_m = straight * band.sound_speed
    line.arrived_at_s = sent_at + line.travel_time_s
    line.ended_at_s = line.arrived_at_s + band.duration


@compiled
def arrive(packed: int, row: int, straight: float, bent: float) -> None:
    """Write the arrival of a ping that is nearly there to its reception (a row): `straight` (s) is
    its travel time on a straight ray, `bent` (s) how much later it arrives; `packed` as of
    :func:`spread_pings`.
    """
    into = unpacked(packed, Spread)
    line, way = into.receptions[row], into.way
    _set_arrival(line, line.sent_at_s, straight, bent, way.band)
    if line.outcome != OUT_OF_RANGE:
        line.loss = loss_at(line.slant_range_m, 0, line.listener, way)


def lose_at_failed(failures: Failures, pings: Rows, receptions: Rows, band: SignalBand) -> None:
    """Mark receptions of pings that have just been sent at ASVs that fail by their end.

    A ping is out of range of an ASV that failed before it arrives, and lost at one that fails while
    it arrives.
    """
    sender = receptions["ping"] - pings["ping"][0]
    arrive = pings["sent_at_s"][sender] + receptions["travel_time_s"]
    missed, cut = failures.met(receptions["asv"], arrive, arrive + band.duration)
    missed &= receptions["outcome"] != OUT_OF_RANGE
    cut &= receptions["outcome"] == IN_FLIGHT
    receptions["outcome"][missed], receptions["outcome"][cut] = OUT_OF_RANGE, LOST
    receptions["why"][missed], receptions["why"][cut] = FAILED, FAILED_MEANWHILE
    receptions["loss"][missed | cut] = 1.0
    np.subtract.at(pings["in_range_of"], sender[missed], 1)
    for number in np.unique(sender[missed]):
        ping = pings[number]
        if ping["passed_at_s"] < np.inf:
            others = (sender == number) & (receptions["outcome"] != OUT_OF_RANGE)
            last = (arrive[others] + band.duration).max(initial=-np.inf)
            ping["passed_at_s"] = last if others.any() else np.inf


def silence(receptions: Rows, outcome: int) -> None:
    """Let a ping that its AUV does not send, since its call had another `outcome` than heard,
    arrive nowhere: change its receptions.
    """
    for name in ("arrived_at_s", "ended_at_s", "snr_db"):
        receptions[name] = nan
    unanswered = receptions["outcome"] != OUT_OF_RANGE
    receptions["outcome"][unanswered], receptions["why"][unanswered] = outcome, UNANSWERED


# The motion of an ASV that an outside program moves is not known ahead.  A ping's arrival is first
# predicted at constant velocity (:mod:`..vehicles.poses`), which is right within a microsecond.
# The sound of a call that may drown the ping at other ASVs keeps its predicted arrival.


@compiled
def amend(packed: int, time: float, first: int, end: int) -> int:
    """Work out again when the pings `first` to `end` (not included) arrive, as ASVs have moved by
    an instant (s).

    Arrivals up to then are exact now, later ones are predicted anew.  Return the first ping that
    has not arrived everywhere.  `packed` is the address of a :class:`.propagation.Spread`.
    """
    of = unpacked(packed, Spread)
    pings, band, under_way = of.pings, of.way.band, end
    for number in range(first, end):
        ping = pings[number]
        receptions = of.receptions[ping.first : ping.end]
        latest, last, longest = _travel(ping, receptions, of.listeners, band)
        if ping.sent_at_s + latest > time:
            under_way = min(under_way, number)
        ping.longest_s = max(longest, pings[number - 1].longest_s if number else 0.0)
        if isfinite(ping.passed_at_s):
            ping.passed_at_s = ping.sent_at_s + last + band.duration
    return under_way


@compiled
def _travel(
    ping: Row, receptions: Rows, listeners: Motion, band: SignalBand
) -> tuple[float, float, float]:
    """Write the travel times (s) of a ping to its listeners; return the longest (s): to any of
    them, to any in range, and to any at which it sounds.
    """
    here = ping.x_m, ping.y_m, ping.z_m, 0.0
    latest, last, longest = 0.0, 0.0, 0.0
    for line in receptions:
        sent_at = ping.sent_at_s + line.bent_s
        straight = travel_time_to(here, listeners, line.listener, sent_at, band.sound_speed)
        silent = isnan(line.arrived_at_s)  # an AUV that no call reached does not ping
        _set_arrival(line, ping.sent_at_s, straight, line.bent_s, band)
        if silent:
            line.arrived_at_s = line.ended_at_s = nan
        latest = max(latest, line.travel_time_s)
        if line.outcome != OUT_OF_RANGE:
            last = max(last, line.travel_time_s)
        if line.sound > 0.0:
            longest = max(longest, line.travel_time_s)
    return latest, last, longest
