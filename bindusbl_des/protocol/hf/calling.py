"""How ASVs call AUVs in two-way ranging: who hears the call, and which pings it drowns.

Compiled, as :mod:`...acoustics.propagation`.
"""

from dataclasses import dataclass
from math import inf, nan, sqrt

import numpy as np

from ...acoustics.bursts import burst_luck
from ...acoustics.loss import chance_of
from ...acoustics.propagation import (
    SignalBand,
    Spread,
    drowns,
    late,
    lost,
    overlap,
    reaches,
    sound,
    within,
)
from ...acoustics.travel_time import PASSED, travel_time_to
from ...core.arrays import Floats, Ints
from ...core.compiled import compiled
from ...core.packed import unpacked
from ...records.events import BURST, BY_CALL, CHANCE, COLLIDED, HEARD, LOST, OUT_OF_RANGE
from ...records.rows import NONE, Row, Rows, row_type
from ...vehicles.motion import Motion, where


@dataclass(slots=True)
class Call:
    """The sound of an ASV's call where it drowns pings: at itself as it calls, at others later.

    `asv` is where it is heard, `sent_by` the ASV that calls, `longest_s` the longest way of any
    call so far.
    """

    sent_at_s: float
    sent_by: int
    asv: int
    arrived_at_s: float
    longest_s: float


CALL = row_type(Call)


@compiled
def choose_callers(auvs: Floats, asvs: Floats, group: Ints, failed: Ints, callers: Ints) -> None:
    """Write who calls each AUV of a group (n,), of ASVs that have not `failed`: the nearest one.

    `auvs` (k, 3) and `asvs` (m, 3) are where they are believed to be (m), seen from above here.
    """
    works = np.ones(len(asvs), dtype=np.bool_)
    for asv in failed:
        works[asv] = False
    for k in range(len(group)):
        callers[k], least = 0, inf
        for asv in range(len(asvs)):
            ahead = auvs[group[k], 0] - asvs[asv, 0]
            aside = auvs[group[k], 1] - asvs[asv, 1]
            square = ahead * ahead + aside * aside
            if works[asv] and square < least:
                callers[k], least = asv, square


@compiled
def interrogate(
    packed: int, group: Ints, callers: Ints, chances: Floats, time: float, answers: Rows,
    calls: Rows, count: int, capture: float, bursts: Rows | None,
) -> int:  # fmt: skip
    """Let ASVs call the AUVs of a group at an instant (s), one for each; one call may name several.

    Write what becomes of each call to `answers` (n,), :data:`...records.rows.CALLED`, and the
    calls' sound at ASVs after the first `count` of `calls`; return how many these are then.  Calls
    that overlap at an AUV destroy each other, and each is lost as a ping over the same way: if its
    one of `chances` (n,), in [0, 1), is below the probability of that, or that of `bursts`, as of
    :func:`.reception.resolve`.  `packed` is the address of a :class:`Spread`, `capture` as of
    :class:`...acoustics.channel.Receiver`.
    """
    into = unpacked(packed, Spread)
    auvs, asvs, way, band = into.senders, into.listeners, into.way, into.way.band
    duration, sound_speed = band.duration, band.sound_speed
    calling = np.unique(callers)
    for k in range(len(group)):
        answer = answers[k]
        answer.called_at_s, answer.called_by = time, callers[k]
        answer.call, answer.call_time_s = OUT_OF_RANGE, nan
        answer.call_why = OUT_OF_RANGE
        here, auv = where(auvs, group[k], time), group[k]
        caller = where(asvs, callers[k], time)
        if reaches(here, caller, k, callers[k], way):
            bent = late(k, callers[k], way)
            straight = travel_time_to(caller, auvs, auv, time + bent, sound_speed)
            travel = straight + bent
            chance = lost(straight * sound_speed, k, callers[k], way)
            drawn = chances[k]
            if bursts is not None:
                drawn = chance_of(burst_luck(bursts[auv, callers[k]], time + travel, chance))
            answer.call, answer.call_why = HEARD, NONE
            if drawn < chance:
                answer.call, answer.call_why = LOST, CHANCE if bursts is None else BURST
            answer.call_time_s = travel
            others = 0.0
            for other in calling:
                there = where(asvs, other, time)
                strength = sound(here, there, k, other, way)
                if other != callers[k] and strength > 0.0:
                    beside = late(k, other, way)
                    beside += travel_time_to(there, auvs, auv, time + beside, sound_speed)
                    if overlap(travel, beside, duration):
                        others += strength
            others += _still_there(calls, count, time, travel, k, auv, callers[k], into)
            if drowns(sound(here, caller, k, callers[k], way), others, capture):
                answer.call, answer.call_why = COLLIDED, BY_CALL
    return _sound(calling, time, calls, count, asvs, band)


@compiled
def _still_there(
    calls: Rows, count: int, time: float, travel: float, number: int, auv: int, caller: int,
    spread: Spread,
) -> float:  # fmt: skip
    """Return how strong calls before an instant (s) are together where they overlap one that a
    caller begins then, and that travels so long (s) to an AUV, `number` of its group.
    """
    auvs, asvs, band = spread.senders, spread.listeners, spread.way.band
    others, farthest, latest, here = 0.0, 0.0, 0.0, where(auvs, auv, time)
    for asv in range(asvs.first.size - 1):
        there = where(asvs, asv, time)
        square = (here[0] - there[0]) ** 2 + (here[1] - there[1]) ** 2 + (here[2] - there[2]) ** 2
        farthest, latest = max(farthest, sqrt(square)), max(latest, late(number, asv, spread.way))
    latest += PASSED * farthest / band.sound_speed + band.duration
    for before in range(count - 1, -1, -1):
        call = calls[before]
        if call.sent_at_s + latest < time + travel:
            break
        if call.arrived_at_s > call.sent_at_s or (call.sent_at_s == time and call.asv == caller):
            continue  # how it is heard at others; or the same call, which names several
        there = where(asvs, call.asv, call.sent_at_s)
        place = where(auvs, auv, call.sent_at_s)
        arrives = late(number, call.asv, spread.way)
        arrives += travel_time_to(there, auvs, auv, call.sent_at_s + arrives, band.sound_speed)
        if overlap(time + travel, call.sent_at_s + arrives, band.duration):
            others += sound(place, there, number, call.asv, spread.way)
    return others


@compiled
def _sound(
    callers: Ints, time: float, calls: Rows, count: int, asvs: Motion, band: SignalBand
) -> int:
    """Note where calls that ASVs begin at an instant (s) are heard on the surface."""
    longest = calls[count - 1].longest_s if count else 0.0
    for caller in callers:
        here = where(asvs, caller, time)
        for asv in range(asvs.first.size - 1):
            if within(here, where(asvs, asv, time), band.slant, band.reach):
                travel = 0.0
                if asv != caller:
                    travel = travel_time_to(here, asvs, asv, time, band.sound_speed)
                longest = max(longest, travel)
                line = calls[count]
                line.sent_at_s, line.sent_by, line.asv = time, caller, asv
                line.arrived_at_s, line.longest_s = time + travel, longest
                count += 1
    return count


@compiled
def drowned_by(ping: Row, reception: Row, duration: float, calls: Rows) -> int:
    """Return which ASV's call overlaps a ping at its ASV, which hears nothing while it calls
    itself; NONE if none does.

    `calls` are all on record (:class:`Call`), in the order in which they were sent.
    """
    starts = reception.arrived_at_s
    for number in range(ping.calls - 1, -1, -1):
        call = calls[number]
        if call.sent_at_s + call.longest_s + duration < starts:
            break
        if call.asv == reception.asv and overlap(starts, call.arrived_at_s, duration):
            return int(call.sent_by)
    for number in range(ping.calls, len(calls)):
        call = calls[number]
        if call.sent_at_s > starts + duration:
            break
        if call.asv == reception.asv and overlap(starts, call.arrived_at_s, duration):
            return int(call.sent_by)
    return NONE
