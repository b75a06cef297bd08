"""Answers of `direct_reply` on MF: frames at AUVs, and pings that come while an ASV answers."""

import math
from collections.abc import Iterator

from ..acoustics.propagation import TOUCH
from ..preflight.round_lengths import rounds_of
from ..scenario.declared import channel_named, schedule_of
from .case import Case
from .pair import ACCEPTED, UNDECIDED, Pair, undecided
from .uplink import round_gap, slot_gap

KIND = "consecutive answers"
WHAT = "answers at an AUV, and pings at an ASV that answers"


def answers(case: Case) -> Iterator[Pair]:
    """Yield whether an answer is over before the next slot's pings and answers come.

    The ping of a slot that begins at t is decoded at an ASV by t + T_P + D of the longest way (2 D
    where the AUV is called first), answered for T_tx, and the answer's end is at an AUV on the edge
    of MF range R_MF / c later.  In the next slot, T later, a ping may come at once, and its answer
    begins T_P later.  One clock may be late by 2 e against the other.  So the margin is
    T - D - T_tx - T_P - 2 e, and where there are other ASVs R_MF / c stands for T_P if it is more.

    Frames of AUVs that share a slot are on the air at the same time: nothing is proved of these.
    """
    scenario, slots = case.scenario, case.slots
    mf, count = scenario.acoustics.mf, scenario.auvs.count
    if not scenario.protocol.replies_in_frames:
        return
    if scenario.asvs.count > 1:
        if count > 1 and schedule_of(scenario).is_shared_and_proved:
            yield undecided(KIND, WHAT, "pings of one slot are answered at once, by several ASVs")
        if not channel_named(mf.channel).ends_at_range:
            why = f"with the channel {str(mf.channel)!r} sound ends at no range"
            yield undecided(KIND, WHAT, why)
    speed = case.sound_speeds[0] - case.bounds.max_speed_m_per_s - case.bounds.asv_speed_m_per_s
    up = (2 if scenario.protocol.calls else 1) * max(map(case.longest_m, range(count))) / speed
    after = slots.ping_duration
    if scenario.asvs.count > 1:
        moved = case.closing_m_per_s * slots.airtime(1)
        deepest = max(deep for both in case.depths for deep in both)
        after = max(after, math.hypot(mf.range_m + moved, deepest) / speed)
    gap = round_gap(case) if rounds_of(scenario).frame else slot_gap(case)
    margin = gap - up - slots.airtime(1) - after - case.late_s
    why = f"the next slot begins {1e3 * gap:.4g} ms later, an answer lasts {slots.airtime(1):.4g} s"
    yield Pair(KIND, WHAT, ACCEPTED if margin > -TOUCH else UNDECIDED, why, margin)
