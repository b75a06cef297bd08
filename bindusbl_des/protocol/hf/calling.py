"""How ASVs call AUVs in two-way ranging: who hears the call, and which pings it drowns.

Compiled, as :mod:`...acoustics.propagation`.
"""

from math import inf, nan

import numpy as np

from ...acoustics.bursts import burst_luck
from ...acoustics.loss import chance_of
from ...acoustics.propagation import Spread, drowns, late, lost, reaches, sound, within
from ...acoustics.sounds import DEAFENING, Sea, emit, interference, solve
from ...core.arrays import Floats, Ints
from ...core.compiled import compiled
from ...core.packed import unpacked
from ...records.events import BURST, BY_CALL, CHANCE, COLLIDED, HEARD, LOST, OUT_OF_RANGE
from ...records.rows import NONE, Rows
from ...vehicles.motion import where


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
    packed: int, packed_sea: int, group: Ints, callers: Ints, chances: Floats, time: float,
    answers: Rows, count: int, capture: float, bursts: Rows | None,
) -> int:  # fmt: skip
    """Let ASVs call the AUVs of a group at an instant (s), one for each; one call may name several.

    Write what becomes of each call to `answers` (n,), :data:`...records.rows.CALLED`, and its
    sounds at all vehicles behind the first `count`; return how many there are then.  Calls that
    overlap at an AUV destroy each other, and each is lost as a ping over the same way: if its one
    of `chances` (n,), in [0, 1), is below the probability of that, or that of `bursts`, as of
    :func:`.reception.resolve`.  `packed` is the address of a :class:`Spread`, `packed_sea` that of
    a :class:`Sea`, `capture` as of :class:`...acoustics.channel.Receiver`.
    """
    into, sea, first = unpacked(packed, Spread), unpacked(packed_sea, Sea), count
    auvs, asvs, way, band = into.senders, into.listeners, into.way, into.way.band
    fleet = auvs.first.size - 1
    for caller in np.unique(callers):
        count = _call(caller, time, count, into, sea)
    for row in range(first, count):
        if sea.sounds[row].listener >= fleet:  # what pings meet at ASVs
            solve(sea.sounds[row], inf, sea)
    for k in range(len(group)):
        answer, auv, caller = answers[k], group[k], callers[k]
        here, there = where(auvs, auv, time), where(asvs, caller, time)
        answer.called_at_s, answer.called_by = time, caller
        answer.call, answer.call_time_s = OUT_OF_RANGE, nan
        answer.call_why = OUT_OF_RANGE
        if not reaches(here, there, auv, caller, way):
            continue
        row = first
        while sea.sounds[row].sender != fleet + caller or sea.sounds[row].listener != auv:
            row += 1
        call = sea.sounds[row]
        solve(call, inf, sea)  # where the AUV will be is known, or predicted
        chance = lost((call.travel_s - call.late_s) * band.sound_speed, auv, caller, way)
        drawn = chances[k]
        if bursts is not None:
            drawn = chance_of(burst_luck(bursts[auv, caller], call.arrived_at_s, chance))
        answer.call, answer.call_why, answer.call_time_s = HEARD, NONE, call.travel_s
        if drawn < chance:
            answer.call, answer.call_why = LOST, CHANCE if bursts is None else BURST
        others, _ = interference(
            sea.sounds[:count], row, row + 1, auv, call.arrived_at_s, call.ended_at_s,
            sea.sounds[count - 1].longest_s, None, sea, inf,
        )  # fmt: skip
        if drowns(call.sound, others, capture):
            answer.call, answer.call_why = COLLIDED, BY_CALL
    return count


@compiled
def _call(caller: int, time: float, count: int, into: Spread, sea: Sea) -> int:
    """Let an ASV call at an instant (s); return how many sounds there are then.

    No ASV within its range hears pings meanwhile, itself least of all, however strong they are.
    """
    auvs, asvs, way, band = into.senders, into.listeners, into.way, into.way.band
    fleet, vessels = auvs.first.size - 1, asvs.first.size - 1
    strengths, lates = np.full(fleet + vessels, nan), np.zeros(fleet + vessels)
    there = where(asvs, caller, time)
    for auv in range(fleet):
        here = where(auvs, auv, time)
        strength, lates[auv] = sound(here, there, auv, caller, way), late(auv, caller, way)
        if strength > 0.0 or reaches(here, there, auv, caller, way):
            strengths[auv] = strength
    for asv in range(vessels):
        if asv == caller or within(there, where(asvs, asv, time), band.slant, band.reach):
            strengths[fleet + asv] = DEAFENING
    lasts = band.duration
    return emit(sea, count, BY_CALL, caller, fleet + caller, time, lasts, strengths, lates)
