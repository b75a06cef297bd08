"""How sound spreads from one vehicle to others that move: who is in range, how late, who is deaf.

These are the compiled inner loops of the bands.  ASVs that fail miss pings that come to them.
"""

from math import inf, isfinite, isnan, nan
from typing import Annotated, NamedTuple

import numpy as np

from ..core.arrays import Floats, Ints
from ..core.compiled import compiled
from ..core.packed import unpacked
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
from .travel_time import travel_time_to

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
    """What happens to signals of a group of AUVs on their way: the law of the disc (:mod:`.loss`),
    or what becomes of each at each ASV or from it (n, m), where another channel was asked.
    """

    band: SignalBand
    loss: LossTerms
    prospects: Annotated[Rows, PROSPECT, 2]


@compiled
def reaches(here: Place, there: Place, number: int, asv: int, way: SignalPath) -> bool:
    """Tell whether a signal between an AUV, `number` of its group, and an ASV may be decoded."""
    if way.prospects.size:
        return bool(way.prospects[number, asv].loss < 1.0)
    return within(here, there, way.band.slant, way.band.reach)


@compiled
def sound(here: Place, there: Place, number: int, asv: int, way: SignalPath) -> float:
    """Return how strong a signal between them is where it overlaps others (:data:`PROSPECT`)."""
    if way.prospects.size:
        return float(way.prospects[number, asv].sound)
    return 1.0 if within(here, there, way.band.slant, way.band.reach) else 0.0


@compiled
def lost(slant_range: float, number: int, asv: int, way: SignalPath) -> float:
    """Return how likely a signal between them is lost that travels a slant range (m)."""
    if way.prospects.size:
        return float(way.prospects[number, asv].loss)
    return loss_probability(slant_range, way.loss)


@compiled
def snr(number: int, asv: int, way: SignalPath) -> float:
    """Return the SNR (dB) of a signal between them; NaN on the disc, which knows of none."""
    return float(way.prospects[number, asv].snr_db) if way.prospects.size else nan


@compiled
def late(number: int, asv: int, way: SignalPath) -> float:
    """Return how much later (s) a signal between them is there than straight on."""
    return float(way.prospects[number, asv].late_s) if way.prospects.size else 0.0


@compiled
def drowns(strength: float, others: float, capture: float) -> bool:
    """Tell whether sounds that overlap a signal, of so much together, destroy it (:class:`.channel.
    Receiver`).
    """
    return others > 0.0 and strength < capture * (1.0 + others)


@compiled
def overlap(one: float, other: float, duration: float) -> bool:
    """Tell whether two sounds of one length (s) that begin at two instants (s) overlap."""
    return meet(one, one + duration, other, other + duration)


@compiled
def meet(begins: float, ends: float, other_begins: float, other_ends: float) -> bool:
    """Tell whether two sounds overlap that last from an instant (s) to another; touching is none.

    >>> meet(0.0, 1.0, 0.9, 3.0), meet(0.0, 1.0, 1.0, 3.0)
    (True, False)
    """
    return bool(other_begins < ends - TOUCH and other_ends > begins + TOUCH)


class Spread(NamedTuple):
    """What pings spread in, handed over once: who moves how, what happens on the way, and the rows
    of pings and receptions, which have room for more.  Without `everything` who is out of range
    gets no row.
    """

    pings: Annotated[Rows, PING]
    receptions: Annotated[Rows, RECEPTION]
    way: SignalPath
    auvs: Motion
    asvs: Motion
    everything: bool


@compiled
def spread(
    packed: int, group: Ints, round_number: int, slot: int, time: float, called: Rows, calls: int,
    ping: int, row: int,
) -> int:  # fmt: skip
    """Let a group of AUVs ping at an instant (s): write their rows, the first of which is `ping`,
    and from `row` on one for each of their ASVs.

    Return the row that comes after the last reception.  `packed` is the address of a
    :class:`Spread`.  An AUV that was `called` in vain (1,), :data:`..records.rows.CALLED`, does not
    ping (:func:`silence`).  So many `calls` are on record by now.
    """
    into = unpacked(packed, Spread)
    pings, receptions, auvs, asvs = into.pings, into.receptions, into.auvs, into.asvs
    way, duration = into.way, into.way.band.duration
    vessels, call = Vessels(asvs, _places(asvs, time)), called[0]
    silent = call.call not in (NONE, HEARD)
    longest_so_far = pings[ping - 1].longest_s if ping else 0.0
    for number in range(group.size):
        here = where(auvs, group[number], time)
        line, auv = pings[ping], group[number]
        line.ping, line.round, line.slot, line.auv = ping, round_number, slot, auv
        line.asv = NONE
        line.sent_at_s, line.waited_s = time, nan
        line.x_m, line.y_m, line.z_m = here[0], here[1], here[2]
        line.called_at_s, line.called_by = call.called_at_s, call.called_by
        line.call, line.call_why, line.call_time_s = call.call, call.call_why, call.call_time_s
        line.first = row
        row, in_range, longest = _reach(
            line, here, number, receptions, row, into.everything, vessels, way
        )
        longest_so_far = max(longest_so_far, line.longest_s)
        line.end, line.in_range_of, line.heard_by = row, in_range, 0
        line.passed_at_s = inf if silent or not in_range else time + longest + duration
        line.longest_s, line.calls = longest_so_far, calls
        ping += 1
    return row


class Vessels(NamedTuple):
    """ASVs: how they move, and where they are as a ping begins (m, 3), m."""

    motion: Motion
    places: Floats


@compiled
def _places(motion: Motion, time: float) -> Floats:
    """Return x, y, z (m) of all vehicles at an instant (s), (n, 3)."""
    places = np.empty((motion.first.size - 1, 3))
    for vehicle in range(len(places)):
        places[vehicle, 0], places[vehicle, 1], places[vehicle, 2], _ = where(motion, vehicle, time)
    return places


@compiled
def _reach(
    ping: Row, here: Place, number: int, receptions: Rows, row: int, everything: bool,
    vessels: Vessels, way: SignalPath,
) -> tuple[int, int, float]:  # fmt: skip
    """Write the receptions of a ping, `number` of its group, from a row on.

    Return the row after the last, how many ASVs are in range, and how long (s) the ping travels to
    the last of these; to the last that it is any sound at, write it to the ping.
    """
    in_range, longest, sound_speed = 0, 0.0, way.band.sound_speed
    asvs, places = vessels.motion, vessels.places
    ping.longest_s = 0.0
    for asv in range(len(places)):
        there = places[asv, 0], places[asv, 1], places[asv, 2], 0.0
        heard = reaches(here, there, number, asv, way)
        strength = sound(here, there, number, asv, way)
        if heard or everything or strength > 0.0:
            bent = late(number, asv, way)
            straight = travel_time_to(here, asvs, asv, ping.sent_at_s + bent, sound_speed)
            travel = straight + bent
            line = receptions[row]
            line.ping, line.auv, line.asv = ping.ping, ping.auv, asv
            line.arrived_at_s, line.travel_time_s = ping.sent_at_s + travel, travel
            line.slant_range_m, line.bent_s = straight * sound_speed, bent
            line.loss = lost(line.slant_range_m, number, asv, way) if heard else 1.0
            line.outcome = IN_FLIGHT if heard else OUT_OF_RANGE
            line.why, line.overlapped_by = NONE if heard else OUT_OF_RANGE, NONE
            line.slow_range = nan
            line.sound, line.snr_db = strength, snr(number, asv, way)
            line.late_s = line.lowered = nan
            line.azimuth_deg = line.elevation_deg = nan  # until it is measured
            line.body_azimuth_deg = line.body_elevation_deg = nan
            row += 1
            if strength > 0.0:
                ping.longest_s = max(ping.longest_s, travel)
            if heard:
                in_range += 1
                longest = max(longest, travel)
    return row, in_range, longest


def deafen(failures: Failures, pings: Rows, receptions: Rows, band: SignalBand) -> None:
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
    receptions["arrived_at_s"] = receptions["snr_db"] = nan
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
        latest, last, longest = _travel(ping, receptions, of.asvs, band.sound_speed)
        if ping.sent_at_s + latest > time:
            under_way = min(under_way, number)
        ping.longest_s = max(longest, pings[number - 1].longest_s if number else 0.0)
        if isfinite(ping.passed_at_s):
            ping.passed_at_s = ping.sent_at_s + last + band.duration
    return under_way


@compiled
def _travel(
    ping: Row, receptions: Rows, asvs: Motion, sound_speed: float
) -> tuple[float, float, float]:
    """Write how long (s) a ping travels to its ASVs; return the longest way (s): to any of them, to
    any in range, and to any where it is a sound at all.
    """
    here = ping.x_m, ping.y_m, ping.z_m, 0.0
    latest, last, longest = 0.0, 0.0, 0.0
    for line in receptions:
        sent_at = ping.sent_at_s + line.bent_s
        straight = travel_time_to(here, asvs, line.asv, sent_at, sound_speed)
        travel = straight + line.bent_s
        line.travel_time_s, line.slant_range_m = travel, straight * sound_speed
        if not isnan(line.arrived_at_s):  # whom no call reached does not ping
            line.arrived_at_s = ping.sent_at_s + travel
        latest = max(latest, travel)
        if line.outcome != OUT_OF_RANGE:
            last = max(last, travel)
        if line.sound > 0.0:
            longest = max(longest, travel)
    return latest, last, longest
