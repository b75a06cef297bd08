"""Signals in slots that follow each other: pings, the last sound of one and the first of the next;
with two-way ranging calls at AUVs and answers at ASVs; `direct_reply` on MF; and random access.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from ..acoustics.propagation import TOUCH
from ..preflight.round_lengths import rounds_of
from ..scenario.declared import channel_named
from ..scenario.families import downlink_of, schedule_of
from .case import ACCEPTED, REFUSED, UNDECIDED, Case, Plan, SignalPair, by_time, undecided
from .reuse import age_s
from .signals import answer_late, answer_passing, far_then_near, out_of_hearing, two_calls

# Kinds of pairs, as verdicts name them, and what meets where
SLOTS = "consecutive slots"
ANSWERS = "consecutive answers"
AT_BOTH = "answers at an AUV, and pings at an ASV that answers"


class Succession(NamedTuple):
    """AUVs that may ping one after the other: the pair, and how long after (s)."""

    first: int
    second: int
    gap_s: float


def consecutive_slots(case: Case) -> Iterator[SignalPair]:
    """Yield whether a ping from afar may meet the next slot's ping from nearby at an ASV.

    AUV i pings at t, AUV k at t + T, both heard by one ASV after D_i and D_k; arrivals last T_P.
    They do not overlap iff T + D_k >= D_i + T_P.  An AUV that is heard is at most R away,
    horizontally or aslant, and nobody is nearer than straight above it.  One clock may be late by
    2 e against the other, and an ASV that moves at u meets sound u / c later or earlier.  So the
    margin is T - T_P - max(longest_i / (c - u) - shortest_k / (c + u)) - 2 e, at the slowest speed
    of sound c and the pair for which it is least.
    """
    followers = list(_followers(case))
    if not followers:
        return
    worst = min(followers, key=lambda it: _margin(case, it))
    margin = _margin(case, worst)
    within = worst.gap_s == slot_gap(case)
    what = "of a round" if within else "at the end of a round"
    why = (
        f"AUV{worst.first} pings from {case.longest_m(worst.first):.4g} m, "
        f"{1e3 * worst.gap_s:.4g} ms later AUV{worst.second} from "
        f"{case.shortest_m(worst.second):.4g} m"
    )
    yield by_time(SLOTS, what, margin, why, partial(_witnesses, case, followers))


def answering_s(case: Case) -> float:
    """Return how long after it has heard a call's front an AUV answers (s)."""
    return case.slots.ping_duration + case.scenario.protocol.turnaround_s


def slot_gap(case: Case) -> float:
    """Return the least time (s) from one uplink slot of a round to the next."""
    return case.slot_s


def round_gap(case: Case) -> float:
    """Return the least time (s) from the last uplink slot of a round to the first of the next.

    A frame's rounds may begin a tick earlier, since frames are rounded up to ticks.
    """
    clock, gap = case.slots.clock, case.slot_s
    if downlink_of(case.scenario).waits:
        gap = clock.after(gap, case.slots.downlink_slot(0))
    return max(gap, frame_s(case))


def frame_s(case: Case) -> float:
    """Return the least time (s) from one round to the next by their frames.

    0 where rounds have none.  Where some outlast theirs, one that begins late may be followed by
    one that does not: after the shortest round there is.
    """
    rounds, clock = rounds_of(case.scenario), case.slots.clock
    frame = max(rounds.frame - (1.0 / clock.rate if clock.rate else 0.0), 0.0)
    if round_s(case) <= rounds.frame:
        return frame
    return min(frame, replace(rounds, named=0).least(1, 0))


def round_s(case: Case) -> float:
    """Return how long (s) the longest round of a schedule with frames lasts."""
    rounds = rounds_of(case.scenario)
    turns = 1 + case.recalls
    one_named = replace(rounds, named=min(rounds.named, 1) * turns)
    return one_named.length(turns, 0 if downlink_of(case.scenario).replies else turns)


def _margin(case: Case, it: Succession) -> float:
    late = case.late_s if it.first != it.second else 0.0
    return it.gap_s - case.slots.ping_duration - spread_s(case, it.first, it.second) - late


def spread_s(case: Case, first: int, second: int) -> float:
    """Return how much longer (s) a ping of one AUV may be under way to an ASV than another's."""
    wanders, (slowest, fastest) = case.bounds.asv_speed_m_per_s, case.sound_speeds
    if first == second:  # it cannot be elsewhere so soon
        moved = case.closing_m_per_s * round_gap(case)
        return min(moved / (slowest - wanders), _apart(case, first, second, slowest))
    return max(_apart(case, first, second, c) for c in (slowest, fastest))


def _apart(case: Case, first: int, second: int, sound_speed: float) -> float:
    wanders = case.bounds.asv_speed_m_per_s
    late = case.longest_m(first) / (sound_speed - wanders)
    return late - case.shortest_m(second) / (sound_speed + wanders)


def _followers(case: Case) -> Iterator[Succession]:
    """Yield who may ping after whom: of fleets whose order is free the worst pairs."""
    count, schedule = case.scenario.auvs.count, schedule_of(case.scenario)
    within, between = slot_gap(case), round_gap(case)
    if case.recalls:  # whoever is lost leaves its slot to the next, and may be called back last
        yield from (Succession(i, k, within) for i, k in _worst(case, count))
    elif schedule.turn == "rotation":
        yield from (Succession(i, (i + 1) % count, between) for i in range(count))
        yield from (Succession(i, k, 2 * between) for i, k in _worst(case, count))
    elif schedule.groups == "each":
        yield from (Succession(i, i + 1, within) for i in range(count - 1))
        yield Succession(count - 1, 0, between)
        yield from (Succession(i, k, 2 * within) for i, k in _worst(case, count))
    else:
        for i, k in _worst(case, count):
            yield Succession(i, k, between if schedule.turn == "lot" else within)
        yield Succession(0, 0, between)


def _worst(case: Case, count: int) -> Iterable[tuple[int, int]]:
    """Return the pairs of different AUVs of which one is heard farthest, the other nearest."""
    if count == 1:
        return ()
    far = sorted(range(count), key=case.longest_m, reverse=True)[:2]
    near = sorted(range(count), key=case.shortest_m)[:2]
    apart = {(i, k): case.longest_m(i) - case.shortest_m(k) for i in far for k in near if i != k}
    return [pair for pair in apart if apart[pair] == max(apart.values())]


def _witnesses(case: Case, followers: list[Succession]) -> Iterator[Plan]:
    for it in sorted(followers, key=lambda it: _margin(case, it)):
        if _margin(case, it) >= 0.0 or it.first == it.second:
            return
        yield far_then_near(case, it.first, it.second, it.gap_s)


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
    mf, count = scenario.acoustics.mf, scenario.auvs.count
    if not scenario.protocol.replies_in_frames:
        return
    if scenario.asvs.count > 1:
        if count > 1 and schedule_of(scenario).is_shared_and_proved:
            yield undecided(
                ANSWERS, AT_BOTH, "pings of one slot are answered at once, by several ASVs"
            )
        if not channel_named(mf.channel).ends_at_range:
            why = f"with the channel {str(mf.channel)!r} sound ends at no range"
            yield undecided(ANSWERS, AT_BOTH, why)
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
    yield SignalPair(ANSWERS, AT_BOTH, ACCEPTED if margin > -TOUCH else UNDECIDED, why, margin)


def calls_of_a_slot(case: Case) -> Iterator[SignalPair]:
    """Yield whether an AUV may hear the calls of two ASVs at once.

    Who pings in one slot is called at its start, each by the ASV nearest to it, be it in range or
    not.  An AUV half-way between two ASVs hears both if they call: the other calls somebody whom
    perhaps no ASV hears, and whom so no conflict keeps from its slot.  No margin of the conflict
    graph helps.  With one AUV to a slot there is one call; ASVs more than 2 R + v a apart have no
    listener, and no AUV on its way, in common.
    """
    scenario = case.scenario
    kind, what = "calls of one slot", "calls of two ASVs at an AUV"
    if not schedule_of(scenario).is_shared_and_proved or scenario.auvs.count < 2:
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
    schedule = schedule_of(scenario)
    within = scenario.auvs.count > 1 and schedule.is_proved and not schedule.framed
    gap = slot_gap(case) if within else round_gap(case)
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
    name, kind = str(scenario.protocol.schedule), "random access"
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
        yield undecided("consecutive frames", "broadcasts at an AUV", why)
