"""Pings in slots that follow each other: the last sound of one, the first of the next (one way)."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import partial
from typing import NamedTuple

from ..preflight.round_lengths import rounds_of
from .case import Case, Plan, SignalPair, by_time
from .signals import far_then_near

KIND = "consecutive slots"


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
    worst = min(followers, key=lambda pair: _margin(case, pair))
    margin = _margin(case, worst)
    within = worst.gap_s == case.slot_s
    what = "of a round" if within else "at the end of a round"
    why = (
        f"AUV{worst.first} pings from {case.longest_m(worst.first):.4g} m, "
        f"{1e3 * worst.gap_s:.4g} ms later AUV{worst.second} from "
        f"{case.shortest_m(worst.second):.4g} m"
    )
    yield by_time(KIND, what, margin, why, partial(_witnesses, case, followers))


def answering_s(case: Case) -> float:
    """Return how long after it has heard a call's front an AUV answers (s)."""
    return case.slots.ping_duration + case.scenario.protocol.turnaround_s


def round_gap(case: Case) -> float:
    """Return the least time (s) from the last uplink slot of a round to the first of the next.

    A frame's rounds may begin a tick earlier, since frames are rounded up to ticks.
    """
    clock, gap = case.slots.clock, case.slot_s
    if case.setup.downlink.waits:
        gap = clock.after(gap, case.slots.downlink_slot(0))
    return max(gap, frame_s(case))


def frame_s(case: Case) -> float:
    """Return the least time (s) from one round to the next by their frames.

    0 where rounds have none.  Where some outlast theirs, one that begins late may be followed by
    one that does not: after the shortest round there is.
    """
    rounds, clock = rounds_of(case.setup), case.slots.clock
    frame = max(rounds.frame - (1.0 / clock.rate if clock.rate else 0.0), 0.0)
    if round_s(case) <= rounds.frame:
        return frame
    return min(frame, replace(rounds, named=0).least(1, 0))


def round_s(case: Case) -> float:
    """Return how long (s) the longest round of a schedule with frames lasts."""
    rounds = rounds_of(case.setup)
    turns = 1 + case.recalls
    one_named = replace(rounds, named=min(rounds.named, 1) * turns)
    return one_named.length(turns, 0 if case.setup.downlink.replies else turns)


def _margin(case: Case, pair: Succession) -> float:
    late = case.late_s if pair.first != pair.second else 0.0
    return pair.gap_s - case.slots.ping_duration - spread_s(case, pair.first, pair.second) - late


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
    count, schedule = case.scenario.auvs.count, case.setup.schedule
    within, between = case.slot_s, round_gap(case)
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
    for pair in sorted(followers, key=lambda pair: _margin(case, pair)):
        if _margin(case, pair) >= 0.0 or pair.first == pair.second:
            return
        yield far_then_near(case, pair.first, pair.second, pair.gap_s)
