"""Sound of ASVs at AUVs: frames of fixes on MF, and pings of passive ranging on HF."""

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from ..preflight.round_lengths import rounds_of
from .case import Array, Case
from .pair import Pair, by_time, undecided
from .uplink import frame_s, slot_gap
from .witnesses.broadcasts import beacons_meet, frames_meet, rounds_slip

# Of more fixes than this only the largest frame is looked at.
MANY = 200


def spread_m(apart: float, reach: float, depth: float) -> float | None:
    """Return how much farther (m) an AUV may be from one ASV than from another, hearing both.

    The ASVs are `apart` (m), heard within `reach` (m) seen from above by an AUV a depth (m) below.
    It is heard farthest from one at the edge of its range, and nearest to the other on the line
    through both: sqrt(R^2 + d^2) - sqrt((L - R)^2 + d^2).  None where nobody hears both: L > 2 R.

    >>> spread_m(50.0, 50.0, 0.0), spread_m(101.0, 50.0, 0.0)
    (50.0, None)
    """
    if apart > 2 * reach:
        return None
    return math.hypot(reach, depth) - math.hypot(apart - reach, depth)


def widest(
    case: Case, apart: Array, reach: float, slant: bool, moved: float
) -> tuple[float, float]:
    """Return the greatest such way (m) of ASVs so far `apart` (m, (n,)), and how far apart those
    are; AUVs in range when a signal begins may go on by so much (m) until it ends.

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
            best = max(best, (spread_m(far, level, depth) or 0.0, far))
    return best


def beacons(case: Case) -> Iterator[Pair]:
    """Yield whether pings of ASVs in consecutive slots may overlap at an AUV (passive ranging).

    Of ASVs A and B, B a slot T after A, an AUV hears A's ping last where it is at the edge of A's
    range and as near to B as it can be then (:func:`spread_m`); it may come nearer to B meanwhile.
    The margin is T - T_P - spread / c.  ASVs share one clock.
    """
    hf, slowest = case.scenario.acoustics.hf, case.sound_speeds[0]
    moved = case.closing_m_per_s * (case.slot_s + hf.range_m / slowest)
    wide, apart = widest(case, case.in_turn_m, hf.range_m, hf.range_metric == "slant", moved)
    margin = slot_gap(case) - hf.ping_s - wide / slowest
    still = widest(case, case.in_turn_m, hf.range_m, hf.range_metric == "slant", 0.0)[0]
    why = f"an AUV may be {wide:.4g} m farther from one ASV than from the next"
    witnesses = partial(beacons_meet, case, apart)
    what, unshown = "pings of ASVs at an AUV", (wide - still) / slowest
    yield by_time("consecutive beacons", what, margin, why, witnesses, unshown)


def broadcasts(case: Case) -> Iterator[Pair]:
    """Yield whether a frame of fixes may meet the next one at an AUV in range of both.

    The first ends at its ASV T_tx after it began, and at an AUV on the edge of range up to
    spread / c later than the second, T_DL after it, begins there.  An AUV in range as a frame
    begins may go on by v T_tx until it ends.  The margin is T_DL - T_tx - spread / c, and an uplink
    slot more where rounds are sequential; of all sizes of a frame the largest leaves least.
    """
    kind, what = "consecutive frames", "broadcasts at an AUV"
    if case.scenario.protocol.downlink == "direct_reply":
        return
    if case.scenario.protocol.broadcaster == "parallel":
        why = "which ASVs broadcast at once is decided by where AUVs are believed to be"
        yield undecided(kind, what, why)
        return
    margin = downlink_gap(case) - frame_spread(case)
    wide, apart = _widest_frames(case, _moved(case))
    unshown = (wide - _widest_frames(case, 0.0)[0]) / case.sound_speeds[0]
    unshown += steady_gap(case) - downlink_gap(case)
    why = f"an AUV may be {wide:.4g} m farther from one ASV than from the next to broadcast"
    witnesses = partial(frames_meet, case, apart)
    yield by_time(kind, what, margin, why, witnesses, unshown)


def most_fixes(case: Case) -> int:
    """Return the most fixes that a broadcast of the scenario carries.

    A group is of one AUV, or where slots are shared of as many as there are ASVs to hear them.
    """
    scenario, messages = case.scenario, case.slots.messages
    most = scenario.auvs.count
    if rounds_of(scenario).frame:
        most = 1
    elif scenario.protocol.downlink == "pipelined_group":
        most = min(most, fixes_of_group(case))
    return most if messages.splits or messages.most is None else min(most, messages.most)


def fixes_of_group(case: Case) -> int:
    """Return the most AUVs of one slot that are heard: an ASV hears one."""
    return 1 if case.scenario.protocol.schedule == "one_per_slot" else case.scenario.asvs.count


def downlink_gap(case: Case) -> float:
    """Return the least time (s) from the end of a broadcast to the beginning of the next.

    Whatever the round before, the next one has as few slots as there may be.
    """
    return _least_gap(case, lambda _: rounds_of(case.scenario).fewest)


def steady_gap(case: Case) -> float:
    """Return the same where rounds are alike: as many slots as it takes for the fixes before."""
    fewest, of_slot = rounds_of(case.scenario).fewest, fixes_of_group(case)
    return _least_gap(case, lambda fixes: max(fewest, math.ceil(fixes / of_slot)))


def _least_gap(case: Case, slots_with: Callable[[int], int]) -> float:
    """Return the least time of any number of fixes, where a round has so many slots with them."""
    return min(_gap(case, fixes, slots_with(fixes)) for fixes in sizes(case))


def sizes(case: Case) -> Sequence[int]:
    """Return how many fixes a broadcast may carry, of many the largest number alone."""
    most = most_fixes(case)
    return range(most + 1) if most < MANY else (most,)


def _gap(case: Case, fixes: int, groups: int) -> float:
    """Return that time after a frame of so many fixes, in a round of so many slots."""
    slots, downlink = case.slots, case.scenario.protocol.downlink
    lasts = slots.clock.after(0.0, slots.downlink_slot(fixes))
    meanwhile = case.slot_s * (1 if downlink == "pipelined_group" else groups)
    every = lasts + meanwhile if downlink == "sequential" else max(lasts, meanwhile)
    return max(every, frame_s(case)) - slots.airtime(fixes)


def frame_spread(case: Case) -> float:
    """Return how much later (s) a frame's end may come than a front that leaves another ASV."""
    return _widest_frames(case, _moved(case))[0] / case.sound_speeds[0]


def _moved(case: Case) -> float:
    """Return how far (m) AUVs and ASVs come from where they were when a frame began."""
    lasts = case.slots.downlink_slot(most_fixes(case)) + downlink_gap(case)
    way = case.scenario.acoustics.mf.range_m / case.sound_speeds[0]
    return case.closing_m_per_s * (lasts + way)


def _widest_frames(case: Case, moved: float) -> tuple[float, float]:
    name = case.scenario.protocol.broadcaster
    apart = {"fixed": np.empty(0), "rotate": case.in_turn_m}.get(str(name), case.apart_m)
    return widest(case, apart, case.scenario.acoustics.mf.range_m, False, moved)


def rounds_in_frames(case: Case) -> Iterator[Pair]:
    """Yield whether a round is over when the frame of the next one begins (round_robin, random).

    A round is an uplink slot and, unless pings are answered at once, the broadcast of one fix.
    Where that is longer than a frame, rounds begin later and later against their frames.
    """
    rounds = rounds_of(case.scenario)
    if not rounds.frame:
        return
    lasts = rounds.length(1, 0 if rounds.policy == "direct_reply" else 1)
    why = f"a round lasts {lasts:.4g} s, its frame {rounds.frame:.4g} s"
    witnesses = partial(rounds_slip, case, lasts)
    yield by_time("round and its frame", "an AUV's turn", rounds.frame - lasts, why, witnesses)
