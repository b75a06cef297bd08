"""How sound spreads from one vehicle to others that move: who is in range, how late, who is deaf.

These are the compiled inner loops of the bands.  ASVs that fail miss pings that come to them.
"""

from math import inf, isfinite, isnan, nan
from typing import Annotated, NamedTuple

import numpy as np

from ...support.arrays import Floats, Ints
from ...support.compiled import compiled
from ...support.packed import unpacked
from ..records.events import (
    FAILED,
    FAILED_MEANWHILE,
    HEARD,
    IN_FLIGHT,
    LOST,
    OUT_OF_RANGE,
    UNANSWERED,
)
from ..records.rows import NONE, PING, RECEPTION, Row, Rows
from ..vehicles.fleet import Failures
from ..vehicles.motion import Motion, Place, where
from .loss import LossTerms, loss_probability
from .travel_time import NEARLY_THERE, distance, travel_time_to

# What becomes of a signal on its way: the probability that it is lost if nothing overlaps it; its
# SNR (dB), NaN where the channel knows of none; how strong a sound it is where it overlaps others,
# its intensity in units of the noise: 0 is too weak to matter, 1 where no levels are known; and how
# much later (s) it is there than straight on at the speed of sound, below 0: sooner.
PROSPECT = np.dtype([("loss", "f8"), ("snr_db", "f8"), ("sound", "f8"), ("late_s", "f8")])

# Of the disc, which is compiled, and not asked
DISC: Rows = np.empty((0, 0), PROSPECT)

# Arrivals that overlap by less (s) only touch: rounding of the instants is far smaller.
TOUCH = 1e-9


class SignalBand(NamedTuple):
    """What holds for the signals of a band.

    They reach `reach` (m), the edge included, compared with the slant range if `slant`, else with
    the horizontal one; they last `duration` (s), and travel at `sound_speed` (m/s).
    """

    slant: bool
    reach: float
    duration: float
    sound_speed: float


@compiled
def within(here: Place, there: Place, slant: bool, reach: float) -> bool:
    """Tell whether two places are within a reach (m), seen from above unless `slant`."""
    rise = here[2] - there[2] if slant else 0.0
    return bool((here[0] - there[0]) ** 2 + (here[1] - there[1]) ** 2 + rise**2 <= reach**2)


class SignalPath(NamedTuple):
    """What happens to signals of a group on their way: the law of the disc (:mod:`.loss`), or what
    becomes of each at each who listens (n, m), where another channel was asked.
    """

    band: SignalBand
    loss: LossTerms
    prospects: Annotated[Rows, PROSPECT, 2]


@compiled
def prospect(
    here: Place, there: Place, number: int, listener: int, way: SignalPath
) -> tuple[bool, float, float, float]:
    """Tell whether a signal of a sender, `number` of its group, may be decoded by a listener; how
    strong it is there, its SNR (dB), and how much later (s) than straight on it comes, as of
    :data:`PROSPECT`.
    """
    if way.prospects.size:
        told = way.prospects[number, listener]
        return bool(told.loss < 1.0), float(told.sound), float(told.snr_db), float(told.late_s)
    near = within(here, there, way.band.slant, way.band.reach)
    return near, 1.0 if near else 0.0, nan, 0.0


@compiled
def lost(slant_range: float, number: int, listener: int, way: SignalPath) -> float:
    """Return how likely a signal between them is lost that travels a slant range (m)."""
    if way.prospects.size:
        return float(way.prospects[number, listener].loss)
    return loss_probability(slant_range, way.loss)


@compiled
def drowns(strength: float, others: float, capture: float) -> bool:
    """Tell whether sounds that overlap a signal, of so much together, destroy it (:class:`.channel.
    Receiver`).
    """
    return others > 0.0 and strength < capture * (1.0 + others)


@compiled
def meet(begins: float, ends: float, other_begins: float, other_ends: float) -> bool:
    """Tell whether two sounds overlap that last from an instant (s) to another; touching is none.

    >>> meet(0.0, 1.0, 0.9, 3.0), meet(0.0, 1.0, 1.0, 3.0)
    (True, False)
    """
    return bool(other_begins < ends - TOUCH and other_ends > begins + TOUCH)


class Spread(NamedTuple):
    """What pings spread in, handed over once: how those move who send and who listen, what happens
    on the way, and the rows of pings and receptions, which have room for more.  AUVs send and ASVs
    listen, or the other way round if `asvs_send`.  Without `everything` who is out of range gets no
    row.
    """

    pings: Annotated[Rows, PING]
    receptions: Annotated[Rows, RECEPTION]
    way: SignalPath
    senders: Motion
    listeners: Motion
    asvs_send: bool
    everything: bool


@compiled
def spread(
    packed: int, group: Ints, round_number: int, slot: int, time: float, called: Rows, calls: int,
    sure: bool, ping: int, row: int,
) -> int:  # fmt: skip
    """Let a group of vehicles ping at an instant (s): write their rows, the first of which is
    `ping`, and from `row` on one for each who listens.

    Return the row that comes after the last reception.  `packed` is the address of a
    :class:`Spread`.  An AUV that was `called` in vain (1,), :data:`..records.rows.CALLED`, does not
    ping (:func:`silence`).  So many `calls` are on record by now.  Where it is not `sure` how those
    go on who listen, the arrivals written are those at which a ping is nearly there
    (:func:`arrive`).
    """
    into = unpacked(packed, Spread)
    pings, duration, call = into.pings, into.way.band.duration, called[0]
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
    """Return x, y, z (m) of all vehicles at an instant (s), (n, 3)."""
    places = np.empty((motion.first.size - 1, 3))
    for vehicle in range(len(places)):
        places[vehicle, 0], places[vehicle, 1], places[vehicle, 2], _ = where(motion, vehicle, time)
    return places


@compiled
def _reach(
    ping: Row, number: int, row: int, places: Floats, sure: bool, into: Spread
) -> tuple[int, int, float]:
    """Write the receptions of a ping, `number` of its group, from a row on; who listens is at its
    places (n, 3), m, as it begins.

    Return the row after the last, how many are in range, and how long (s) the ping travels to the
    last of these; to the last that it is any sound at, write it to the ping.
    """
    in_range, longest, way, sound_speed = 0, 0.0, into.way, into.way.band.sound_speed
    here = ping.x_m, ping.y_m, ping.z_m, 0.0
    ping.longest_s = 0.0
    for listener in range(len(places)):
        there = places[listener, 0], places[listener, 1], places[listener, 2], 0.0
        heard, strength, snr_db, bent = prospect(here, there, number, listener, way)
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
            _meet(line, ping.sent_at_s, straight, bent, way.band)
            line.loss = lost(line.slant_range_m, number, listener, way) if heard else 1.0
            line.outcome = IN_FLIGHT if heard else OUT_OF_RANGE
            line.why, line.overlapped_by = NONE if heard else OUT_OF_RANGE, NONE
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
def _meet(line: Row, sent_at: float, straight: float, bent: float, band: SignalBand) -> None:
    """Write when a ping arrives that would travel for so long (s) straight on and comes so much
    later (s).
    """
    line.travel_time_s, line.bent_s, line.sent_at_s = straight + bent, bent, sent_at
    line.slant_range_m = straight * band.sound_speed
    line.arrived_at_s = sent_at + line.travel_time_s
    line.ended_at_s = line.arrived_at_s + band.duration


@compiled
def arrive(packed: int, row: int, straight: float, bent: float) -> None:
    """Write the arrival of a ping that is nearly there, now that it is known for how long (s) it
    travels straight on and how much later (s) it comes; `packed` as of :func:`spread`.
    """
    into = unpacked(packed, Spread)
    line, way = into.receptions[row], into.way
    _meet(line, line.sent_at_s, straight, bent, way.band)
    if line.outcome != OUT_OF_RANGE:
        line.loss = lost(line.slant_range_m, 0, line.listener, way)


def lose_at_failed(failures: Failures, pings: Rows, receptions: Rows, band: SignalBand) -> None:
    """Let ASVs that have failed, or fail meanwhile, not hear pings that have just been sent.

    `receptions` are those of `pings`.  Who has failed before a ping comes is as good as not there:
    nothing is in range of it.  Who fails while one is arriving has lost it.
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
    """Let nothing arrive of a ping whose call had an outcome other than to be heard."""
    for name in ("arrived_at_s", "ended_at_s", "snr_db"):
        receptions[name] = nan
    unanswered = receptions["outcome"] != OUT_OF_RANGE
    receptions["outcome"][unanswered], receptions["why"][unanswered] = outcome, UNANSWERED


# An ASV that an outside program moves has no sure future. So the arrival of a ping is at first
# where a constant velocity would have it (:mod:`..vehicles.poses`), which is right within a
# microsecond. The sound of a call that may drown it at other ASVs stays where it was predicted.


@compiled
def amend(packed: int, time: float, first: int, end: int) -> int:
    """Work out anew when the pings `first` to `end` (not included) arrive, as ASVs have moved by an
    instant (s).

    Arrivals before that are then exact, and what is not there by then has a later one.  Return the
    first of the pings that have not arrived everywhere.  `packed` is the address of a
    :class:`.propagation.Spread`.
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
    """Write how long (s) a ping travels to its ASVs; return the longest way (s): to any of them, to
    any in range, and to any where it is a sound at all.
    """
    here = ping.x_m, ping.y_m, ping.z_m, 0.0
    latest, last, longest = 0.0, 0.0, 0.0
    for line in receptions:
        sent_at = ping.sent_at_s + line.bent_s
        straight = travel_time_to(here, listeners, line.listener, sent_at, band.sound_speed)
        silent = isnan(line.arrived_at_s)  # whom no call reached does not ping
        _meet(line, ping.sent_at_s, straight, line.bent_s, band)
        if silent:
            line.arrived_at_s = line.ended_at_s = nan
        latest = max(latest, line.travel_time_s)
        if line.outcome != OUT_OF_RANGE:
            last = max(last, line.travel_time_s)
        if line.sound > 0.0:
            longest = max(longest, line.travel_time_s)
    return latest, last, longest
