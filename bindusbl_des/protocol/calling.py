"""How ASVs call AUVs in two-way ranging: who hears the call, and which pings it drowns.

Compiled, as :mod:`.propagation`, with motions as there.
"""

from dataclasses import dataclass
from math import nan

import numpy as np

from ..acoustics.loss import loss_probability
from ..acoustics.propagation import overlap, within
from ..acoustics.travel_time import light_time
from ..core.compiled import compiled
from ..records.columns import (
    ARRIVED_AT,
    AT_ASV,
    CALL_ARRIVED_AT,
    CALL_AT_ASV,
    CALL_SENT_AT,
    CALLS,
    LONGEST_CALL,
    OF_PING,
)
from ..records.events import COLLIDED, HEARD, LOST, OUT_OF_RANGE
from ..vehicles.motion import Floats, Ints, where


@dataclass(slots=True)
class Call:
    """The sound of an ASV's call where it drowns pings: at itself as it calls, at others later.

    `longest_s` is the longest way of any call so far.
    """

    sent_at_s: float
    asv: int
    arrived_at_s: float
    longest_s: float


@compiled
def interrogate(
    group: Ints, callers: Ints, chances: Floats, time: float, answers: Floats, calls: Floats,
    count: int, coefficients: Floats, combine: int, contention: float, cap: float, slant: bool,
    hf_range: float, duration: float, sound_speed: float, auv_table: Floats, auv_first: Ints,
    auv_step: float, asv_table: Floats, asv_first: Ints, asv_step: float,
) -> int:  # fmt: skip
    """Let ASVs call the AUVs of a group at an instant (s), one for each; one call may name several.

    Write what becomes of each call, and how long (s) it is under way, to `answers` (n, 2), and the
    calls' sound at ASVs after the first `count` of `calls`; return how many these are then.  Calls
    that overlap at an AUV destroy each other, and each is lost as a ping over the same way: if its
    one of `chances` (n,), in [0, 1), is below the probability of that.
    """
    calling = np.unique(callers)
    for k in range(len(group)):
        answers[k, 0], answers[k, 1] = OUT_OF_RANGE, nan
        x, y, z, _ = where(auv_table, auv_first, auv_step, group[k], time)
        here = where(asv_table, asv_first, asv_step, callers[k], time)
        if not within(x, y, z, here[0], here[1], here[2], hf_range, slant):
            continue
        travel = light_time(
            here[0], here[1], here[2], auv_table, auv_first, auv_step, group[k], time, sound_speed
        )
        lost = loss_probability(travel * sound_speed, coefficients, combine, contention, cap)
        answers[k, 0], answers[k, 1] = LOST if chances[k] < lost else HEARD, travel
        for other in calling:
            there = where(asv_table, asv_first, asv_step, other, time)
            if other != callers[k] and within(
                x, y, z, there[0], there[1], there[2], hf_range, slant
            ):
                beside = light_time(
                    there[0], there[1], there[2], auv_table, auv_first, auv_step, group[k], time,
                    sound_speed,
                )  # fmt: skip
                if overlap(travel, beside, duration):
                    answers[k, 0] = COLLIDED
    return _sound(
        calling, time, calls, count, slant, hf_range, sound_speed, asv_table, asv_first, asv_step,
    )  # fmt: skip


@compiled
def _sound(
    callers: Ints, time: float, calls: Floats, count: int, slant: bool, hf_range: float,
    sound_speed: float, asv_table: Floats, asv_first: Ints, asv_step: float,
) -> int:  # fmt: skip
    """Note where calls that ASVs begin at an instant (s) are heard on the surface."""
    longest = calls[count - 1, LONGEST_CALL] if count else 0.0
    for caller in callers:
        here = where(asv_table, asv_first, asv_step, caller, time)
        for asv in range(asv_first.size - 1):
            there = where(asv_table, asv_first, asv_step, asv, time)
            if within(here[0], here[1], here[2], there[0], there[1], there[2], hf_range, slant):
                travel = 0.0
                if asv != caller:
                    travel = light_time(
                        here[0], here[1], here[2], asv_table, asv_first, asv_step, asv, time,
                        sound_speed,
                    )  # fmt: skip
                longest = max(longest, travel)
                line = calls[count]
                line[CALL_SENT_AT], line[CALL_AT_ASV] = time, asv
                line[CALL_ARRIVED_AT], line[LONGEST_CALL] = time + travel, longest
                count += 1
    return count


@compiled
def drowned(row: int, duration: float, pings: Floats, receptions: Floats, calls: Floats) -> bool:
    """Tell whether a call overlaps a ping at its ASV, which hears nothing while it calls itself.

    `calls` are all on record (:class:`Call`), in the order in which they were sent.
    """
    starts, asv = receptions[row, ARRIVED_AT], receptions[row, AT_ASV]
    since = int(pings[int(receptions[row, OF_PING]), CALLS])
    for call in range(since - 1, -1, -1):
        if calls[call, CALL_SENT_AT] + calls[call, LONGEST_CALL] + duration < starts:
            break
        heard = calls[call, CALL_AT_ASV] == asv
        if heard and overlap(starts, calls[call, CALL_ARRIVED_AT], duration):
            return True
    for call in range(since, len(calls)):
        if calls[call, CALL_SENT_AT] > starts + duration:
            break
        heard = calls[call, CALL_AT_ASV] == asv
        if heard and overlap(starts, calls[call, CALL_ARRIVED_AT], duration):
            return True
    return False
