"""Which signals of a protocol may overlap at a receiver: one inequality for each kind of pair.

**What is proved.** An AUV of depth d is heard over ways between straight up and the longest within
range R (`Case.shortest_m`, `Case.longest_m`), and pings up to 2 e late against another (e bounds
each clock, `Case.late_s`); AUVs and ASVs approach each other at v at most (`closing_m_per_s`),
sound travels at c, within `sound_speeds`.  With these intervals each function below says how much
time is left between the end of one signal and the beginning of the other, at worst (`margin_s`), or
how much farther the conflict graph looks than it must (`margin_m`).  No margin is negative: no two
signals of the kind overlap in any mission within the bounds.  Touching is no overlap.

**What is refused.** A negative margin alone refuses nothing.  A kind is refused once two signals
have overlapped in a scenario that was run (:mod:`.witnesses`, :mod:`.playing`).

**What is left undecided.** Whatever nothing here bounds: the order of user-defined parts, fixes of
several ASVs by which AUVs share slots, channels whose sound ends at no range, echoes.

T_P is a ping's length, T the uplink slot, T_tx a frame's airtime, T_DL its slot, T_ta the
turnaround, D a travel time.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import partial
from itertools import product
from typing import NamedTuple

import numpy as np

from ...core.acoustics.propagation import TOUCH
from ...support.arrays import Floats
from .bounds import Beside, farthest_off
from .case import ACCEPTED, REFUSED, UNDECIDED, Case, Plan, SignalPair, by_time, undecided
from .witnesses import (
    answer_late,
    answer_passing,
    at_the_edge,
    beacons_meet,
    come_in_together,
    comes_into_range,
    far_then_near,
    frames_meet,
    out_of_hearing,
    rounds_shown,
    two_calls,
)

# From one slot, round or broadcast to the next


def round_gap(case: Case) -> float:
    """Return the least time (s) from the last uplink slot of a round to the first of the next.

    A frame's rounds may begin a tick earlier, since frames are rounded up to ticks.
    """
    gap = case.slot_s
    if case.setup.downlink.waits:
        gap = case.slots.clock.after(gap, case.slots.downlink_slot(0))
    return max(gap, frame_s(case))


def frame_s(case: Case) -> float:
    """Return the least time (s) from one round to the next by their frames.

    0 where rounds have none.  Where some outlast theirs, one that begins late may be followed by
    one that does not: after the shortest round there is.
    """
    rounds, clock = case.rounds, case.slots.clock
    frame = max(rounds.frame - (1.0 / clock.rate if clock.rate else 0.0), 0.0)
    if round_s(case) <= rounds.frame:
        return frame
    return min(frame, replace(rounds, named=0).least(1, 0))


def round_s(case: Case) -> float:
    """Return how long (s) the longest round of a schedule with frames lasts."""
    turns = 1 + case.recalls
    one_named = replace(case.rounds, named=min(case.rounds.named, 1) * turns)
    return one_named.length(turns, 0 if case.setup.downlink.replies else turns)


def answering_s(case: Case) -> float:
    """Return how long after it has heard a call's front an AUV answers (s)."""
    return case.slots.ping_duration + case.scenario.protocol.turnaround_s


# Pings of one way


class Succession(NamedTuple):
    """AUVs that may ping one after the other: the pair, and how long after (s)."""

    first: int
    second: int
    gap_s: float


def consecutive_slots(case: Case) -> Iterator[SignalPair]:
    """Yield whether a ping from afar may meet the next slot's ping from nearby at an ASV.

    AUV i pings at t, AUV k at t + T, both heard by one ASV after D_i and D_k; arrivals last T_P.
    They do not overlap iff T + D_k >= D_i + T_P.  An AUV that is heard is at most R away,
    horizontally or aslant, and none is nearer than straight above it.  One clock may be late by
    2 e against the other, and an ASV that moves at u meets sound u / c later or earlier.  So the
    margin is T - T_P - max(longest_i / (c - u) - shortest_k / (c + u)) - 2 e, at the slowest speed
    of sound c and the pair for which it is least.
    """
    followers = sorted(_followers(case), key=partial(_margin, case))
    if not followers:
        return
    first, second, gap = followers[0]
    what = "of a round" if gap == case.slot_s else "at the end of a round"
    why = (
        f"AUV{first} pings from {case.longest_m(first):.4g} m, {1e3 * gap:.4g} ms later "
        f"AUV{second} from {case.shortest_m(second):.4g} m"
    )
    margin, witnesses = _margin(case, followers[0]), partial(_in_succession, case, followers)
    yield by_time("consecutive slots", what, margin, why, witnesses)


def _in_succession(case: Case, followers: list[Succession]) -> Iterator[Plan]:
    for pair in followers:
        if _margin(case, pair) >= 0.0 or pair.first == pair.second:
            return
        yield far_then_near(case, *pair)


def _margin(case: Case, pair: Succession) -> float:
    late = case.late_s if pair.first != pair.second else 0.0
    return pair.gap_s - case.slots.ping_duration - spread_s(case, pair.first, pair.second) - late


def spread_s(case: Case, first: int, second: int) -> float:
    """Return how much longer (s) a ping of one AUV may be under way to an ASV than another's."""
    wanders, (slowest, fastest) = case.bounds.asv_speed_m_per_s, case.sound_speeds

    def apart(sound_speed: float) -> float:
        late = case.longest_m(first) / (sound_speed - wanders)
        return late - case.shortest_m(second) / (sound_speed + wanders)

    if first == second:  # it cannot be elsewhere so soon
        moved = case.closing_m_per_s * round_gap(case)
        return min(moved / (slowest - wanders), apart(slowest))
    return max(apart(slowest), apart(fastest))


def _followers(case: Case) -> Iterator[Succession]:
    """Yield who may ping after whom: of fleets whose order is free the worst pairs."""
    count, schedule = case.auvs, case.setup.schedule
    within, between = case.slot_s, round_gap(case)
    if case.recalls:  # whoever is lost leaves its slot to the next, and may be called back last
        yield from (Succession(i, k, within) for i, k in _worst(case))
    elif schedule.turn == "rotation":
        yield from (Succession(i, (i + 1) % count, between) for i in range(count))
        yield from (Succession(i, k, 2 * between) for i, k in _worst(case))
    elif schedule.groups == "each":
        yield from (Succession(i, i + 1, within) for i in range(count - 1))
        yield Succession(count - 1, 0, between)
        yield from (Succession(i, k, 2 * within) for i, k in _worst(case))
    else:
        for i, k in _worst(case):
            yield Succession(i, k, between if schedule.turn == "lot" else within)
        yield Succession(0, 0, between)


def _worst(case: Case) -> Iterable[tuple[int, int]]:
    """Return the pairs of different AUVs of which one is heard farthest, the other nearest."""
    if case.auvs == 1:
        return ()
    far = sorted(range(case.auvs), key=case.longest_m, reverse=True)[:2]
    near = sorted(range(case.auvs), key=case.shortest_m)[:2]
    apart = {(i, k): case.longest_m(i) - case.shortest_m(k) for i in far for k in near if i != k}
    return [pair for pair in apart if apart[pair] == max(apart.values())]


# AUVs that ping in one slot because no ASV hears both, as far as the fleet knows

# What a margin lacks by less (m) is rounding.
TOUCH_M = 1e-9


def same_slot(case: Case) -> Iterator[SignalPair]:
    """Yield whether an ASV may hear two AUVs of one group by the time at which they ping.

    They share a group because no ASV had both within R + m where they were believed, m the conflict
    margin.  What was believed is wrong by e and has aged by a when they ping, at a relative speed
    of v: an ASV that hears both within R then had both believed within R + v a + e.  So they are
    apart iff m >= v a + e.  (Aslant the AUV comes nearer by less than it moves: R + m is the slant
    range of a place v a farther, seen from above.)

    With true positions e = 0 and a is the way from the round's start to their slot.  An AUV in slot
    s is there because AUVs of all slots before are in conflict with it, and so is the other: of N
    AUVs two share slot N - 2 at most.  One ASV alone hears all that conflict, and has none share
    but slot 0, a = 0.  Clocks make a longer by 2 e_c.  With last fixes a may be the whole mission:
    who is not heard is not fixed.
    """
    if not case.shares_slots:
        return
    kind, what = "same slot", "AUVs of one ping group"
    for failure in case.scenario.asvs.failures:
        if failure.until_s is not None:
            why = (
                f"ASV{failure.asv} works again at {failure.until_s:g} s, and may hear AUVs of one "
                "group that was formed without it"
            )
            yield undecided(kind, what, why)
            return
    is_set, needed = case.scenario.protocol.conflict_margin_m, margin_needed(case)
    age, speed = position_age_s(case), case.closing_m_per_s
    if needed == math.inf:
        why = "nothing bounds how far AUVs may be from where they are believed"
    else:
        rule = f"positions may be {age:.4g} s old, and {speed:.3g} m/s makes of that"
        if case.scenario.protocol.positions == "truth":
            slot = f"slot {most_shared_slot(case)} is {1e3 * age:.4g} ms after the round's start"
            rule = f"{slot}, at {speed:.3g} m/s"
        why = f"{rule}: {needed:.3g} m of conflict margin needed, {is_set:.3g} m set"
    if is_set - needed > -TOUCH_M:
        yield SignalPair(kind, what, ACCEPTED, why, margin_m=max(is_set - needed, 0.0))
    else:
        margin, witnesses = bounded(is_set - needed), partial(_in_one_slot, case)
        yield SignalPair(kind, what, REFUSED, why, margin_m=margin, witnesses=witnesses)


def _in_one_slot(case: Case) -> Iterator[Plan]:
    protocol, speed = case.scenario.protocol, case.closing_m_per_s
    if protocol.positions == "last_fix" and speed > 0.0:
        shown = protocol.conflict_margin_m / speed + rounds_shown(case)
        yield come_in_together(case, min(shown, case.scenario.duration_s))
    if protocol.positions != "truth":
        yield at_the_edge(case)
        return
    if most_shared_slot(case):
        yield from comes_into_range(case)
    if case.late_s:
        yield come_in_together(case, rounds_shown(case), case.late_s)


def bounded(value: float) -> float | None:
    """Return a number, None for one that is infinite."""
    return value if math.isfinite(value) else None


def margin_needed(case: Case) -> float:
    """Return the least conflict margin (m) with which no ASV hears two AUVs of one group."""
    if not case.shares_slots:
        return 0.0
    moved, hf = case.closing_m_per_s * position_age_s(case), case.hf
    steered = any(group.vehicle.is_steered for group in case.setup.groups)
    if hf.range_metric == "slant" and not steered:
        aslant = [  # how much nearer an AUV at the edge of range comes that moves so far
            math.hypot(math.sqrt(hf.range_m**2 - depth**2) + moved, depth) - hf.range_m
            for depth, _ in set(case.depths)
            if depth < hf.range_m
        ]
        moved = max([0.0, *aslant])
    return moved + believed_off_m(case)


def believed_off_m(case: Case) -> float:
    """Return how far (m) an AUV may have been from where it is believed, as it was fixed.

    Infinite where nothing bounds it: of user-defined instruments; of fixes of several ASVs, since
    where ranges nearly agree in direction, weighing makes any way across of what both err by; and
    of fixes carried along a tour, which may be taken for those of another leg.
    """
    setup, bounds, usbl = case.setup, case.bounds, case.scenario.usbl
    positions, called = case.scenario.protocol.positions, setup.ranging.calls
    if positions == "truth":
        return 0.0
    tours = any(route.is_flown for route in setup.routes)
    if usbl.model.is_own or (positions == "carried_forward" and tours):
        return math.inf
    several = len(case.apart_m) and float(case.apart_m.min()) <= 2 * case.hf.range_m
    if several or (called and bounds.asv_speed_m_per_s > 0.0):
        return math.inf
    lasting = {kind.name: kind.sds[0] for kind in setup.lasting_errors}
    beside = Beside(
        lasting.get("misalignment", 0.0),
        lasting.get("gnss", 0.0),
        usbl.outlier_sd_m if usbl.outlier_share > 0.0 else 0.0,
        0.0 if called else bounds.clock_error_s,
        bounds.sound_speed_error_m_per_s,
        case.closing_m_per_s * answering_s(case) if called else 0.0,
    )
    given = case.nearest_m, case.farthest_m, beside, bounds.sigmas
    return max(farthest_off(usbl, *given) for usbl in setup.usbls)


def position_age_s(case: Case) -> float:
    """Return the largest age (s) of a believed AUV position at a slot that AUVs share."""
    if case.scenario.protocol.positions != "truth":
        return case.scenario.duration_s
    return most_shared_slot(case) * _slot_in_round(case) + case.late_s


def most_shared_slot(case: Case) -> int:
    """Return the last slot of a round that two AUVs may share and an ASV hear both."""
    last = min(case.auvs - 2, case.rounds.most - 1)  # whoever finds no room has no slot
    if last < 1 or not len(case.apart_m):
        return 0
    ways = case.closing_m_per_s * (last * _slot_in_round(case) + case.late_s)
    met = case.apart_m <= 2 * case.hf.range_m + case.scenario.protocol.conflict_margin_m + ways
    return last if bool(np.any(met)) else 0


def _slot_in_round(case: Case) -> float:
    """Return the most time (s) from one slot of a round to the next."""
    if not case.setup.downlink.by_group:
        return case.slot_s
    slots = case.slots
    return max(case.slot_s, slots.clock.after(0.0, slots.downlink_slot(case.auvs)))


# Calls and answers: at AUVs calls meet calls, at ASVs answers meet calls


def calls_of_a_slot(case: Case) -> Iterator[SignalPair]:
    """Yield whether an AUV may hear the calls of two ASVs at once.

    Who pings in one slot is called at its start, each by the ASV nearest to it, be it in range or
    not.  An AUV half-way between two ASVs hears both if they call: the other calls an AUV that
    perhaps no ASV hears, and that so no conflict keeps from its slot.  No margin of the conflict
    graph helps.  With one AUV to a slot there is one call; ASVs more than 2 R + v a apart have no
    listener, and no AUV on its way, in common.
    """
    kind, what = "calls of one slot", "calls of two ASVs at an AUV"
    if not case.shares_slots or not len(case.apart_m):
        return
    reach, nearest = case.hf.range_m, float(case.apart_m.min())
    moved = case.closing_m_per_s * (position_age_s(case) + case.slot_s)
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
    heard = case.apart_m[case.apart_m <= case.hf.range_m]
    if case.stations is None and len(case.apart_m):
        heard = np.array([case.hf.range_m])
    if not len(heard):
        return
    apart = float(heard.max())
    moved = case.closing_m_per_s * answering_s(case)
    detour = math.hypot(apart, 2 * case.nearest_m) - apart
    margin = case.scenario.protocol.turnaround_s + (detour - moved) / case.sound_speeds[1]
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
    schedule, slowest, longest = case.setup.schedule, case.sound_speeds[0], case.farthest_m
    within = case.auvs > 1 and schedule.is_proved and not schedule.framed
    gap = case.slot_s if within else round_gap(case)
    auv = max(range(case.auvs), key=case.longest_m)
    called = longest / (slowest - case.bounds.max_speed_m_per_s)
    answered = longest / (slowest - case.bounds.asv_speed_m_per_s)
    margin = gap - (case.slots.ping_duration + answering_s(case) + called + answered)
    why = f"AUV{auv} answers from {longest:.4g} m; the next call is {1e3 * gap:.4g} ms later"
    witnesses = partial(answer_late, case, auv, gap)
    yield by_time("answer and next call", "at an ASV", margin, why, witnesses)


def answers(case: Case) -> Iterator[SignalPair]:
    """Yield whether an answer is over before the next slot's pings and answers come.

    The ping of a slot that begins at t is decoded at an ASV by t + T_P + D of the longest way (2 D
    where the AUV is called first), answered for T_tx, and the answer's end is at an AUV on the edge
    of MF range R_MF / c later.  In the next slot, T later, a ping may come at once, and its answer
    begins T_P later.  One clock may be late by 2 e against the other.  So the margin is
    T - D - T_tx - T_P - 2 e, and where there are other ASVs R_MF / c stands for T_P if it is more.

    Frames of AUVs that share a slot are on the air at the same time: nothing is proved of these.
    """
    mf, slots, bounds = case.scenario.acoustics.mf, case.slots, case.bounds
    kind, what = "consecutive answers", "answers at an AUV, and pings at an ASV that answers"
    if not case.scenario.protocol.replies_in_frames:
        return
    airtime, after = slots.airtime(1), slots.ping_duration
    speed = case.sound_speeds[0] - bounds.max_speed_m_per_s - bounds.asv_speed_m_per_s
    if case.scenario.asvs.count > 1:
        if case.shares_slots:
            yield undecided(
                kind, what, "pings of one slot are answered at once, by several ASVs", None
            )
        if not mf.traits.ends_at_range:
            why = f"with the channel {str(mf.channel)!r} sound ends at no range"
            yield undecided(kind, what, why, None)
        deepest = max(deep for both in case.depths for deep in both)
        reach = mf.longest_path_m(deepest, case.closing_m_per_s * airtime)
        after = max(after, reach / speed)
    up = (2 if case.scenario.protocol.calls else 1) * case.farthest_m / speed
    gap = round_gap(case) if case.rounds.frame else case.slot_s
    margin = gap - up - airtime - after - case.late_s
    why = f"the next slot begins {1e3 * gap:.4g} ms later, an answer lasts {airtime:.4g} s"
    verdict = ACCEPTED if margin > -TOUCH else UNDECIDED
    yield SignalPair(kind, what, verdict, why, margin, band=None)


# Sound of ASVs at AUVs: frames of fixes on MF, and pings of passive ranging on HF

# Fixes in a frame, and AUVs that it tells their slots
Size = tuple[int, int]

# Of more sizes than this only the largest frame is looked at.
MANY = 400


def widest(
    case: Case, apart: Floats, reach: float, slant: bool, moved: float
) -> tuple[float, float]:
    """Return how much farther (m) an AUV may be from one ASV than from another, hearing both, at
    most, and how far apart (m) those are: of ASVs so far `apart` (m, (n,)).

    An AUV a depth d below hears both where L <= 2 R, R seen from above.  It is heard farthest from
    one at the edge of its range, and nearest to the other on the line through both:
    sqrt(R^2 + d^2) - sqrt((L - R)^2 + d^2).  AUVs in range when a signal begins may have `moved` so
    much (m) until it ends.
    By how much they come nearer to the other ASV does not count: two sounds overlap iff one has not
    ended where the AUV is when the other begins there, which is a matter of that place alone.
    """
    best = (0.0, 0.0)
    for depth in {deep for both in case.depths for deep in both}:
        if slant and depth > reach:
            continue
        level = (math.sqrt(reach**2 - depth**2) if slant else reach) + moved
        near = apart[apart <= 2 * level]
        if case.stations is None and len(near):
            near = np.array([level])
        for far in map(float, near):
            best = max(best, (math.hypot(level, depth) - math.hypot(far - level, depth), far))
    return best


def beacons(case: Case) -> Iterator[SignalPair]:
    """Yield whether pings of ASVs in consecutive slots may overlap at an AUV (passive ranging).

    Of ASVs A and B, B a slot T after A, an AUV hears A's ping last where it is at the edge of A's
    range and as near to B as it can be then (:func:`widest`); it may come nearer to B meanwhile.
    The margin is T - T_P - spread / c.  ASVs share one clock.
    """
    hf, slowest = case.hf, case.sound_speeds[0]
    moved = case.closing_m_per_s * (case.slot_s + hf.range_m / slowest)
    wide, apart = widest(case, case.in_turn_m, hf.range_m, hf.range_metric == "slant", moved)
    margin = case.slot_s - hf.ping_s - wide / slowest
    why = f"an AUV may be {wide:.4g} m farther from one ASV than from the next"
    witnesses = partial(beacons_meet, case, apart)
    yield by_time("consecutive beacons", "pings of ASVs at an AUV", margin, why, witnesses)


def broadcasts(case: Case) -> Iterator[SignalPair]:
    """Yield whether a frame of fixes may meet the next one at an AUV in range of both.

    The first ends at its ASV T_tx after it began, and at an AUV on the edge of range up to
    spread / c later than the second, T_DL after it, begins there.  An AUV in range as a frame
    begins may go on by v T_tx until it ends.  The margin is T_DL - T_tx - spread / c, and an uplink
    slot more where rounds are sequential; of all sizes of a frame the largest leaves least.
    """
    kind, what = "consecutive frames", "broadcasts at an AUV"
    if case.setup.downlink.replies:
        return
    if case.setup.broadcaster.at_once:
        why = "which ASVs broadcast at once is decided by where AUVs are believed to be"
        yield undecided(kind, what, why, "mf")
        return
    margin = downlink_gap(case) - frame_spread(case)
    wide, apart = _widest_frames(case, _moved(case))
    why = f"an AUV may be {wide:.4g} m farther from one ASV than from the next to broadcast"
    yield by_time(kind, what, margin, why, partial(frames_meet, case, apart), "mf")


def most_fixes(case: Case) -> int:
    """Return the most fixes that one broadcast of the scenario carries.

    A ping group has one AUV; if AUVs share slots, it has at most one for each ASV that hears it.
    """
    schedule, messages = case.setup.schedule, case.slots.messages
    most = case.auvs
    if case.rounds.frame:
        most = 1 + case.recalls
    elif case.setup.downlink.by_group:
        alone = schedule.groups == "each" and schedule.is_proved
        most = min(most, 1 if alone else case.scenario.asvs.count)
    return most if messages.splits or messages.most is None else min(most, messages.most)


def downlink_gap(case: Case) -> float:
    """Return the least time (s) from the end of a broadcast to the beginning of the next, of all
    sizes.  Whatever the round before, the next one has as few slots as there may be.

    Where only the largest is looked at, a slot is not rounded up to ticks: another may just fit.
    """
    slots, downlink, several = case.slots, case.setup.downlink, sizes(case)
    meanwhile = case.slot_s * (1 if downlink.by_group else fewest_slots(case))
    gaps = []
    for size in several:
        lasts = slots.downlink_slot(*size)
        if len(several) > 1:
            lasts = slots.clock.after(0.0, lasts)
        every = lasts + meanwhile if downlink.waits else max(lasts, meanwhile)
        gaps.append(max(every, frame_s(case)) - slots.airtime(*size))
    return min(gaps)


def fewest_slots(case: Case) -> int:
    """Return the fewest slots of a round; an AUV that is lost has none."""
    return 1 if case.recalls else case.rounds.fewest


def sizes(case: Case) -> list[Size]:
    """Return how many fixes a broadcast may carry, and of how many AUVs it may tell the slots; of
    many numbers the largest alone.
    """
    rounds, most = case.rounds, most_fixes(case)
    named = min(rounds.named + case.recalls, case.auvs)
    fewest = named if rounds.fewest == rounds.most and not case.recalls else 0
    if (named - fewest + 1) * (most + 1) > MANY:
        return [(most, named)]
    return list(product(range(most + 1), range(fewest, named + 1)))


def frame_spread(case: Case) -> float:
    """Return how much later (s) a frame's end may come than a front that leaves another ASV.

    The frame after next comes from any ASV, later by the shortest frame and a gap more: of that
    spread it takes what is left, shared by two gaps.
    """
    moved, slowest = _moved(case), case.sound_speeds[0]
    next_m, after_m = _widest_frames(case, moved)[0], _widest_frames(case, 2 * moved, 2)[0]
    return max(next_m / slowest, (after_m / slowest - case.slots.airtime(0)) / 2)


def _moved(case: Case) -> float:
    """Return how far (m) AUVs and ASVs come from where they were when a frame began."""
    lasts = max(case.slots.downlink_slot(*size) for size in sizes(case)) + downlink_gap(case)
    return case.closing_m_per_s * (
        lasts + case.scenario.acoustics.mf.range_m / case.sound_speeds[0]
    )


def _widest_frames(case: Case, moved: float, later: int = 1) -> tuple[float, float]:
    """Return :func:`widest` of the ASVs that send a frame and one so many frames `later`."""
    chosen, mf = case.setup.broadcaster.chosen_by, case.scenario.acoustics.mf
    apart = case.in_turn_m if chosen == "turn" and later == 1 else case.apart_m
    if chosen == "one" and not case.scenario.asvs.failures:
        apart = np.empty(0)
    return widest(case, apart, mf.range_m, mf.range_metric == "slant", moved)


# Pings of AUVs that ping as they like


def random_access(case: Case) -> Iterator[SignalPair]:
    """Yield that two AUVs within range of one ASV may ping at any two instants, and so at once."""
    protocol, kind, what = case.scenario.protocol, "random access", "pings of AUVs"
    name = str(protocol.program)
    if case.auvs == 1:
        yield SignalPair(kind, what, ACCEPTED, "there is no other AUV")
    else:
        why = f"with {name} nothing keeps two AUVs from pinging at once"
        yield SignalPair(kind, what, REFUSED, why, witnesses=partial(out_of_hearing, case))
    if protocol.replies_in_frames:
        why = f"with {name} pings come whether an ASV answers or not"
        yield undecided("consecutive answers", "pings at an ASV that answers", why)
    elif case.scenario.asvs.count > 1 and protocol.sends_frames:
        why = f"with {name} fixes are broadcast as they come"
        yield undecided("consecutive frames", "broadcasts at an AUV", why, "mf")
