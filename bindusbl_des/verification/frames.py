"""Sound of ASVs at AUVs: frames of fixes on MF, and pings of passive ranging on HF."""

import math
from collections.abc import Iterator
from functools import partial
from itertools import product

import numpy as np

from ..core.arrays import Floats
from ..preflight.round_lengths import rounds_of
from .case import Case, SignalPair, by_time, undecided
from .signals import beacons_meet, frames_meet
from .uplink import frame_s

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
    hf, slowest = case.scenario.acoustics.hf, case.sound_speeds[0]
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
    witnesses = partial(frames_meet, case, apart)
    yield by_time(kind, what, margin, why, witnesses, "mf")


def most_fixes(case: Case) -> int:
    """Return the most fixes that a broadcast of the scenario carries.

    A group is of one AUV, or where slots are shared of as many as there are ASVs to hear them.
    """
    scenario, messages = case.scenario, case.slots.messages
    setup = case.setup
    most = scenario.auvs.count
    if rounds_of(setup).frame:
        most = 1 + case.recalls
    elif setup.downlink.by_group:
        most = min(most, fixes_of_group(case))
    return most if messages.splits or messages.most is None else min(most, messages.most)


def fixes_of_group(case: Case) -> int:
    """Return the most AUVs of one slot that are heard: an ASV hears one."""
    schedule = case.setup.schedule
    own = schedule.groups == "each" and schedule.is_proved
    return 1 if own else case.scenario.asvs.count


def downlink_gap(case: Case) -> float:
    """Return the least time (s) from the end of a broadcast to the beginning of the next.

    Whatever the round before, the next one has as few slots as there may be.
    """
    return min(_gap(case, size) for size in sizes(case))


def fewest_slots(case: Case) -> int:
    """Return the fewest slots of a round; an AUV that is lost has none."""
    return 1 if case.recalls else rounds_of(case.setup).fewest


def sizes(case: Case) -> list[Size]:
    """Return how many fixes a broadcast may carry, and of how many AUVs it may tell the slots; of
    many numbers the largest alone.
    """
    rounds = rounds_of(case.setup)
    named = min(rounds.named + case.recalls, case.scenario.auvs.count)
    fewest = named if rounds.fewest == rounds.most and not case.recalls else 0
    if (named - fewest + 1) * (most_fixes(case) + 1) > MANY:
        return [(most_fixes(case), named)]
    return list(product(range(most_fixes(case) + 1), range(fewest, named + 1)))


def _gap(case: Case, size: Size) -> float:
    """Return that time after a frame of a size.

    Where only the largest is looked at, a slot is not rounded up to ticks: another may just fit.
    """
    slots, downlink = case.slots, case.setup.downlink
    lasts = slots.downlink_slot(*size)
    if len(sizes(case)) > 1:
        lasts = slots.clock.after(0.0, lasts)
    meanwhile = case.slot_s * (1 if downlink.by_group else fewest_slots(case))
    every = lasts + meanwhile if downlink.waits else max(lasts, meanwhile)
    return max(every, frame_s(case)) - slots.airtime(*size)


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
    way = case.scenario.acoustics.mf.range_m / case.sound_speeds[0]
    return case.closing_m_per_s * (lasts + way)


def _widest_frames(case: Case, moved: float, later: int = 1) -> tuple[float, float]:
    """Return :func:`widest` of the ASVs that send a frame and one so many frames `later`."""
    chosen, mf = case.setup.broadcaster.chosen_by, case.scenario.acoustics.mf
    apart = case.in_turn_m if chosen == "turn" and later == 1 else case.apart_m
    if chosen == "one" and not case.scenario.asvs.failures:
        apart = np.empty(0)
    return widest(case, apart, mf.range_m, mf.range_metric == "slant", moved)
