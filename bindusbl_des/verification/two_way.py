"""Calls and answers: of two-way ranging (at AUVs calls meet calls, at ASVs answers meet calls), of
`direct_reply` on MF, and of random access.
"""

import math
from collections.abc import Iterator
from functools import partial

import numpy as np

from ..acoustics.propagation import TOUCH
from ..preflight.round_lengths import rounds_of
from .case import ACCEPTED, REFUSED, UNDECIDED, Case, SignalPair, by_time, undecided
from .reuse import age_s
from .signals import answer_late, answer_passing, out_of_hearing, two_calls
from .uplink import answering_s, round_gap

KIND = "consecutive answers"
WHAT = "answers at an AUV, and pings at an ASV that answers"


def answers(case: Case) -> Iterator[SignalPair]:
    """Yield whether an answer is over before the next slot's pings and answers come.

    The ping of a slot that begins at t is decoded at an ASV by t + T_P + D of the longest way (2 D
    where the AUV is called first), answered for T_tx, and the answer's end is at an AUV on the edge
    of MF range R_MF / c later.  In the next slot, T later, a ping may come at once, and its answer
    begins T_P later.  One clock may be late by 2 e against the other.  So the margin is
    T - D - T_tx - T_P - 2 e, and where there are other ASVs R_MF / c stands for T_P if it is more.

    Frames of AUVs that share a slot are on the air at the same time: nothing is proved of these.
    """
    scenario, slots = case.scenario, case.slots
    setup = case.setup
    mf, count = scenario.acoustics.mf, scenario.auvs.count
    if not scenario.protocol.replies_in_frames:
        return
    if scenario.asvs.count > 1:
        if count > 1 and setup.schedule.is_shared_and_proved:
            why = "pings of one slot are answered at once, by several ASVs"
            yield undecided(KIND, WHAT, why, None)
        if not mf.traits.ends_at_range:
            why = f"with the channel {str(mf.channel)!r} sound ends at no range"
            yield undecided(KIND, WHAT, why, None)
    speed = case.sound_speeds[0] - case.bounds.max_speed_m_per_s - case.bounds.asv_speed_m_per_s
    up = (2 if scenario.protocol.calls else 1) * max(map(case.longest_m, range(count))) / speed
    after = slots.ping_duration
    if scenario.asvs.count > 1:
        moved = case.closing_m_per_s * slots.airtime(1)
        deepest = max(deep for both in case.depths for deep in both)
        after = max(after, mf.longest_path_m(deepest, moved) / speed)
    gap = round_gap(case) if rounds_of(setup).frame else case.slot_s
    margin = gap - up - slots.airtime(1) - after - case.late_s
    why = f"the next slot begins {1e3 * gap:.4g} ms later, an answer lasts {slots.airtime(1):.4g} s"
    found = ACCEPTED if margin > -TOUCH else UNDECIDED
    yield SignalPair(KIND, WHAT, found, why, margin, band=None)


def calls_of_a_slot(case: Case) -> Iterator[SignalPair]:
    """Yield whether an AUV may hear the calls of two ASVs at once.

    Who pings in one slot is called at its start, each by the ASV nearest to it, be it in range or
    not.  An AUV half-way between two ASVs hears both if they call: the other calls somebody whom
    perhaps no ASV hears, and whom so no conflict keeps from its slot.  No margin of the conflict
    graph helps.  With one AUV to a slot there is one call; ASVs more than 2 R + v a apart have no
    listener, and no AUV on its way, in common.
    """
    scenario = case.scenario
    setup = case.setup
    kind, what = "calls of one slot", "calls of two ASVs at an AUV"
    if not setup.schedule.is_shared_and_proved or scenario.auvs.count < 2:
        return
    if not len(case.apart_m):
        return
    reach, nearest = scenario.acoustics.hf.range_m, float(case.apart_m.min())
    moved = case.closing_m_per_s * (age_s(case) + case.slot_s)
    why = f"ASVs are {nearest:.4g} m apart or more, and share AUVs up to {2 * reach + moved:.4g} m"
    if nearest > 2 * reach + moved:
        yield SignalPair(kind, what, ACCEPTED, why)
    elif nearest <= 2 * reach:
        yield SignalPair(kind, what, REFUSED, why, witnesses=partial(two_calls, case))
    else:
        yield undecided(kind, what, why)


def call_and_answer(case: Case) -> Iterator[SignalPair]:
    """Yield whether an answer may meet its own call at another ASV.

    The call takes L / c from one ASV to the other; by way of an AUV a depth d below them sound
    takes sqrt(L^2 + 4 d^2) / c at least (the mirrored way), and the turnaround T_ta.  An AUV that
    comes nearer by v (T_P + T_ta) while it answers shortens that.  Only ASVs within range R of each
    other hear each other's calls; the farther apart, the tighter it is.
    """
    heard = case.apart_m[case.apart_m <= case.scenario.acoustics.hf.range_m]
    if case.stations is None and len(case.apart_m):
        heard = np.array([case.scenario.acoustics.hf.range_m])
    if not len(heard):
        return
    apart = float(heard.max())
    depth = min(map(case.shortest_m, range(case.scenario.auvs.count)))
    fastest = case.sound_speeds[1]
    moved = case.closing_m_per_s * answering_s(case)
    detour = math.hypot(apart, 2 * depth) - apart
    margin = case.scenario.protocol.turnaround_s + (detour - moved) / fastest
    why = f"the way by an AUV is {detour:.3g} m longer than that of the call, over {apart:.4g} m"
    witnesses = partial(answer_passing, case, apart)
    yield by_time("call and answer", "at another ASV", margin, why, witnesses)


def answer_and_next_call(case: Case) -> Iterator[SignalPair]:
    """Yield whether an ASV may call while the last slot's answer is still arriving.

    Called at t, an AUV at the edge of range hears that after D, answers T_P + T_ta later, and its
    answer has arrived another D and T_P later; the next call begins at t + T.  They do not meet
    iff T >= 2 T_P + T_ta + 2 D, D of the longest way at the slowest speed of sound, to vehicles
    that go away meanwhile.
    """
    scenario = case.scenario
    setup = case.setup
    schedule = setup.schedule
    within = scenario.auvs.count > 1 and schedule.is_proved and not schedule.framed
    gap = case.slot_s if within else round_gap(case)
    auv = max(range(scenario.auvs.count), key=case.longest_m)
    margin = gap - two_way_needed(case)
    far, later = case.longest_m(auv), 1e3 * gap
    why = f"AUV{auv} answers from {far:.4g} m; the next call is {later:.4g} ms later"
    witnesses = partial(answer_late, case, auv, gap)
    yield by_time("answer and next call", "at an ASV", margin, why, witnesses)


def two_way_needed(case: Case) -> float:
    """Return the slot (s) that holds a call and its answer, whatever the sound speed."""
    slowest, longest = case.sound_speeds[0], max(map(case.longest_m, range(len(case.depths))))
    called = longest / (slowest - case.bounds.max_speed_m_per_s)
    answered = longest / (slowest - case.bounds.asv_speed_m_per_s)
    return case.slots.ping_duration + answering_s(case) + called + answered


def random_access(case: Case) -> Iterator[SignalPair]:
    """Yield that two AUVs within range of one ASV may ping at any two instants, and so at once."""
    scenario = case.scenario
    name, kind = str(scenario.protocol.program), "random access"
    if scenario.auvs.count == 1:
        yield SignalPair(kind, "pings of AUVs", ACCEPTED, "there is no other AUV")
    else:
        why = f"with {name} nothing keeps two AUVs from pinging at once"
        yield SignalPair(
            kind, "pings of AUVs", REFUSED, why, witnesses=partial(out_of_hearing, case)
        )
    if scenario.protocol.replies_in_frames:
        why = f"with {name} pings come whether an ASV answers or not"
        yield undecided("consecutive answers", "pings at an ASV that answers", why)
    elif scenario.asvs.count > 1 and scenario.protocol.sends_frames:
        why = f"with {name} fixes are broadcast as they come"
        yield undecided("consecutive frames", "broadcasts at an AUV", why, "mf")
