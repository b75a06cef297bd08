"""Witnesses: scenarios in which two signals overlap that a verdict says may overlap.

Pings that follow each other and AUVs that come within range in a slot; sound from ASVs: pings or
frames that meet at an AUV, rounds that slip; calls and answers of two-way ranging; AUVs that share
a slot and come to be heard by one ASV before they ping in it.
"""

import math
from collections.abc import Iterator
from itertools import permutations, product

import numpy as np

from ..core.arrays import Floats
from ..preflight.round_lengths import rounds_of
from ..protocol.conflicts import GROUPINGS
from .case import Case, Plan
from .playing import LATEST_S, OUT_OF_THE_WAY, SLIVER, Actor, lossless, staged, stations_of

# Draws by lot are waited for so many frames for each AUV.
FRAMES_OF_CHANCE = 20

# Planned ways are shown for so long (s).
LONGEST_SHOWN_S = 600.0

# Nobody waits longer for a turn than so many empty rounds take: where a fix is hours on the air,
# the time of a few full rounds has room for millions of them.
MOST_EMPTY = 1000

# What is left to chance is given twice the time so many times.
MOST_DOUBLINGS = 14


def far_then_near(case: Case, first: int, second: int, gap_s: float) -> Plan:
    """Return a scenario in which one AUV pings from the edge of an ASV's range, the next below it.

    The first is as late, and as far, as it takes for both to arrive at once; no later and no
    farther than may be.
    """
    x, y = stations_of(case)[0]
    slowest, shallow = case.sound_speeds[0], case.shortest_m(second)
    longest, arrives = case.longest_m(first) * (1 - SLIVER), gap_s + shallow / slowest
    way = max(min(longest, slowest * arrives), case.depths[first][1])
    late = min(max(arrives - way / slowest, 0.0), case.late_s, LATEST_S)
    deep = case.depths[first][1]
    actors = {
        first: Actor(x + math.sqrt(max(way**2 - deep**2, 0.0)), y, deep, late_s=late),
        second: Actor(x, y, shallow),
    }
    return staged(case, actors, rounds_shown(case), slowest)


def rounds_shown(case: Case) -> float:
    """Return how long (s) a witness lasts: until each AUV has had its turn, and a round more."""
    rounds, count = rounds_of(case.setup), case.scenario.auvs.count
    if rounds.frame:
        by_lot = case.setup.schedule.turn == "lot"
        each = FRAMES_OF_CHANCE * count if by_lot else count
        return (each + 2) * rounds.period(1, 1) + case.late_s
    full, empty = rounds.period(rounds.most, count), rounds.period(1, 0)
    return min(2 * full, MOST_EMPTY * empty) + case.late_s


def come_in_together(case: Case, lasts_s: float, late_s: float = 0.0) -> Plan:
    """Return a scenario in which two AUVs come within range of an ASV at once, from both sides.

    Whoever believes them where they were has them ping in one slot.
    """
    x, y = stations_of(case)[0]
    actors = {}
    for auv, side in ((0, -1.0), (1, 1.0)):
        deep = case.depths[auv][1]
        reach = case.scenario.acoustics.hf.range_m + case.scenario.protocol.conflict_margin_m
        if case.scenario.acoustics.hf.range_metric == "slant":
            reach = math.sqrt(max(reach**2 - deep**2, 0.0))
        begins = x + side * (reach * (1 + SLIVER) + SLIVER)
        actors[auv] = Actor(begins, y, deep, towards=(x, y), late_s=min(late_s, LATEST_S))
    return staged(case, actors, lasts_s, case.sound_speeds[0])


def at_the_edge(case: Case) -> Plan:
    """Return a scenario in which two AUVs lie at the edge of an ASV's range, where fixes that are
    a little off have them beyond it.
    """
    x, y = stations_of(case)[0]
    actors = {}
    for auv, side in ((0, -1.0), (1, 1.0)):
        deep = case.depths[auv][1]
        way = case.longest_m(auv) * (1 - SLIVER)
        actors[auv] = Actor(x + side * math.sqrt(max(way**2 - deep**2, 0.0)), y, deep)
    return staged(case, actors, 20 * rounds_shown(case), case.sound_speeds[0])


def out_of_hearing(case: Case) -> Iterator[Plan]:
    """Yield scenarios in which half the AUVs are at one edge of an ASV's range and half at the
    other, each longer than the one before: sooner or later two ping at once.
    """
    x, y = map(float, stations_of(case)[0])
    actors = {}
    for auv, (_, deep) in enumerate(case.depths):
        across = math.sqrt(max((case.longest_m(auv) * (1 - SLIVER)) ** 2 - deep**2, 0.0))
        actors[auv] = Actor(x + across * (-1) ** auv, y, deep)
    each = case.scenario.protocol.frame_s
    for doubled in range(MOST_DOUBLINGS):
        yield staged(case, actors, min(10 * each * 2**doubled, 1e6), case.sound_speeds[0])


def groups_shown(case: Case) -> Iterator[Plan]:
    """Yield scenarios of what is not proved: AUVs on their planned ways, and two that come within
    range of an ASV or lie at its edge, by the groups that the schedule makes of these.
    """
    plan = case.scenario.model_dump(mode="json", exclude_unset=True)
    plan.pop("record", None)  # which may leave out what is looked at
    length = min(case.scenario.duration_s, LONGEST_SHOWN_S)
    yield plan | {"acoustics": lossless(plan), "duration_s": length}
    if case.scenario.auvs.count > 1:
        yield at_the_edge(case)
        if case.closing_m_per_s > 0.0:
            yield come_in_together(case, min(20 * rounds_shown(case), LONGEST_SHOWN_S))


# So many rounds of a scenario whose broadcasters are drawn at random
ROUNDS_OF_CHANCE = 4

# In fleets of so many AUVs every number of others is tried.
MOST_CROWDS = 12

# No witness lasts longer (s).
LONGEST_S = 600.0


def beacons_meet(case: Case, apart: float) -> Iterator[Plan]:
    """Yield scenarios in which an AUV is at the edge of one ASV's range, and beyond it another's,
    so far apart (m), whose ping is next.
    """
    hf = case.scenario.acoustics.hf
    for actors in _between(case, apart, hf.range_m, hf.range_metric == "slant"):
        yield staged(case, actors, rounds_shown(case), case.sound_speeds[0])


def frames_meet(case: Case, apart: float) -> Iterator[Plan]:
    """Yield the same for frames of fixes, with ever more others that are fixed, below an ASV."""
    lasts = min(ROUNDS_OF_CHANCE * case.scenario.asvs.count * rounds_shown(case), LONGEST_S)
    x, y = map(float, stations_of(case)[0])
    hf, mf, count = case.scenario.acoustics.hf, case.scenario.acoustics.mf, case.scenario.auvs.count
    crowds = range(count) if count <= MOST_CROWDS else (0, count - 1)
    # At the edge of range, or where the AUV that listens is fixed as well
    for crowd, reach in product(crowds, {mf.range_m, min(apart + hf.range_m / 2, mf.range_m)}):
        for actors in _between(case, apart, reach, mf.range_metric == "slant"):
            others = [n for n in range(count) if n not in actors][:crowd]
            fixed = {n: Actor(x, y, case.depths[n][1]) for n in others}
            yield staged(case, {**fixed, **actors}, lasts, case.sound_speeds[0])


def _between(case: Case, apart: float, reach: float, slant: bool) -> Iterator[dict[int, Actor]]:
    """Yield the AUV nearest to the surface, on the line through two ASVs."""
    stations = stations_of(case)
    away = np.linalg.norm(stations[:, None] - stations, axis=2)
    auv = min(range(len(case.depths)), key=case.shortest_m)
    deep = case.shortest_m(auv)
    level = math.sqrt(max(reach**2 - deep**2, 0.0)) if slant else reach
    for one, other in np.argwhere((away > 0.0) & (np.abs(away - apart) <= SLIVER * apart)):
        way = (stations[other] - stations[one]) / away[one, other]
        x, y = stations[one] + level * (1 - SLIVER) * way
        yield {auv: Actor(float(x), float(y), deep)}


# So many pairs of ASVs are tried.
MOST_PAIRS = 200

# Where on the way from one ASV to another an AUV is, as a share of it
SHARES = (0.49, 0.25, 0.05)

# Bearings (deg) in which an AUV is sought that is nearest to a given ASV
BEARINGS = np.radians(np.arange(0.0, 360.0, 1.0))


def two_calls(case: Case) -> Iterator[Plan]:
    """Yield scenarios in which an AUV is half-way between two ASVs, and both call at once: the
    second an AUV that nobody hears.
    """
    stations, reach = stations_of(case), case.scenario.acoustics.hf.range_m
    deep = case.depths[0][1]
    for number, (one, other) in enumerate(permutations(range(len(stations)), 2)):
        if number == MOST_PAIRS:
            return
        middle = stations[one] + (0.5 - SLIVER) * (stations[other] - stations[one])
        far = _outside(stations, other, OUT_OF_THE_WAY * (reach + np.ptp(stations)))
        if far is None or math.dist(stations[one], stations[other]) > 2 * reach:
            continue
        actors = {0: Actor(float(middle[0]), float(middle[1]), deep)}
        actors[1] = Actor(*far, case.depths[1][1])
        yield staged(case, actors, rounds_shown(case), case.sound_speeds[0])


def _outside(stations: Floats, asv: int, way: float) -> tuple[float, float] | None:
    """Return a place so far (m) from an ASV that is nearest to it; None if it lies within others'
    midst.
    """
    for bearing in BEARINGS:
        place = stations[asv] + way * np.array((math.cos(bearing), math.sin(bearing)))
        away = np.linalg.norm(stations - place, axis=1)
        if int(np.argmin(away)) == asv and np.sum(away <= away[asv]) == 1:
            return float(place[0]), float(place[1])
    return None


def answer_passing(case: Case, apart: float) -> Iterator[Plan]:
    """Yield a scenario in which an AUV on the line between two ASVs, at most so far apart (m), is
    called by one of them, and heads for the other.
    """
    stations = stations_of(case)
    away = np.linalg.norm(stations[:, None] - stations, axis=2)
    auv = min(range(len(case.depths)), key=case.shortest_m)
    pairs = np.argwhere((away > 0.0) & (away <= apart * (1 + SLIVER)))
    for share, (one, other) in product(SHARES, pairs[:MOST_PAIRS]):
        x, y = stations[one] + share * (stations[other] - stations[one])
        if int(np.argmin(np.linalg.norm(stations - (x, y), axis=1))) != one:
            continue
        goal = (float(stations[other][0]), float(stations[other][1]))
        actor = Actor(float(x), float(y), case.shortest_m(auv), towards=goal)
        yield staged(case, {auv: actor}, rounds_shown(case), case.sound_speeds[1])


def answer_late(case: Case, auv: int, gap_s: float) -> Iterator[Plan]:
    """Yield scenarios in which an AUV answers from so far that the next call drowns that."""
    stations, slowest, deep = stations_of(case), case.sound_speeds[0], case.depths[auv][1]
    longest = case.longest_m(auv) * (1 - SLIVER)
    answered = case.slots.ping_duration + case.scenario.protocol.turnaround_s
    way = max(min(longest, slowest * (gap_s - answered) / 2), deep)
    across = math.sqrt(max(way**2 - deep**2, 0.0))
    count = len(case.depths)
    for asv in range(len(stations)):
        place = _outside(stations, asv, across)
        if place is None:
            continue
        nearby = (float(stations[asv][0]), float(stations[asv][1]))
        for other in dict.fromkeys(((auv + 1) % count, (auv - 1) % count)):
            actors = {auv: Actor(*place, deep)}
            if other != auv:
                actors[other] = Actor(*nearby, case.shortest_m(other))
            yield staged(case, actors, rounds_shown(case), slowest)


# Directions (deg) from which AUVs come in, beside that of the other ASV, and away from it
BESIDE = (0.0, 20.0, -20.0, 45.0, -45.0, 70.0, -70.0)

# So many pairs of ASVs are tried, the nearest first.
MOST_NEAR_PAIRS = 40


def comes_into_range(case: Case) -> Iterator[Plan]:
    """Yield scenarios in which two AUVs come within range of an ASV on the way to their slot.

    Both begin just beyond its reach, or one within: the first is heard by another ASV, the second
    by none that hears the first.  As many others as it takes lie where both ASVs hear them, and
    have the slots before.
    """
    for arrangement in _arrangements(case):
        plan = _played(case, *arrangement)
        if plan is not None:
            yield plan


def _arrangements(case: Case) -> Iterator[tuple[Floats, Floats, float, float]]:
    """Yield an ASV, another, and the bearings (rad) from the first of the two AUVs."""
    stations = stations_of(case)
    reach = case.scenario.acoustics.hf.range_m + case.scenario.protocol.conflict_margin_m
    away = np.linalg.norm(stations[:, None] - stations, axis=2)
    rows, columns = np.nonzero((away > 0.0) & (away <= 2 * reach))
    order = np.argsort(away[rows, columns], kind="stable")[:MOST_NEAR_PAIRS]
    for row, column in zip(rows[order], columns[order], strict=True):
        x, y = stations[column] - stations[row]
        ahead = math.atan2(y, x)
        for first, second in product(BESIDE, BESIDE):
            yield (
                stations[row], stations[column],
                ahead + math.radians(first), ahead + math.pi + math.radians(second),
            )  # fmt: skip


def _played(case: Case, asv: Floats, other: Floats, first: float, second: float) -> Plan | None:
    """Return the scenario of an arrangement, None where its AUVs would not share a slot in time."""
    hf, protocol = case.scenario.acoustics.hf, case.scenario.protocol
    count, speed, depths = case.scenario.auvs.count, case.closing_m_per_s, case.depths
    slant = hf.range_metric == "slant"
    stations, margin = stations_of(case), protocol.conflict_margin_m

    def across(way: float, auv: int) -> float:
        deep = depths[auv][1] if slant else 0.0
        return math.sqrt(max(way**2 - deep**2, 0.0))

    middle = (asv + other) / 2
    one, two = count - 2, count - 1
    outside = across(hf.range_m + margin, one) * (1 + SLIVER) + SLIVER
    slots = _slots_before(case, outside - across(hf.range_m, one))
    if slots is None:
        return None
    # At its ping the second is as far as the first, or it begins at the edge of what is heard.
    begins = (outside, across(hf.range_m + margin, two) * (1 - SLIVER))
    actors = {}
    for auv, bearing, way in ((one, first, begins[0]), (two, second, begins[1])):
        x, y = asv + way * np.array((math.cos(bearing), math.sin(bearing)))
        actors[auv] = Actor(float(x), float(y), depths[auv][1], tuple(asv.tolist()), case.late_s)
    for auv in range(slots):
        actors[auv] = Actor(float(middle[0]), float(middle[1]), depths[auv][1])
    places = np.array([(actor.x, actor.y) for actor in actors.values()])
    away = np.linalg.norm(places[:, None] - stations, axis=2)
    if slant:
        away = np.hypot(away, np.array([actor.depth for actor in actors.values()])[:, None])
    groups = GROUPINGS[case.setup.schedule.groups](_in_order(actors, away <= hf.range_m + margin))
    shared = [set(group) for group in groups].index
    names = sorted(actors)
    group = {names.index(one), names.index(two)}
    if group not in [set(members) for members in groups] or shared(group) != slots:
        return None
    return staged(case, actors, rounds_shown(case), case.sound_speeds[0]) if speed else None


def _in_order(actors: dict[int, Actor], heard: np.ndarray) -> np.ndarray:
    """Return who is heard by whom in the order of the AUVs' numbers."""
    return np.ascontiguousarray(heard[np.argsort(list(actors))])


def _slots_before(case: Case, way: float) -> int | None:
    """Return after how many slots the first AUV is within range; None if it never is."""
    speed, most = case.closing_m_per_s, case.scenario.auvs.count - 2
    for slots in range(1, most + 1):
        if speed * (slots * case.slot_s + case.late_s) > way:
            return slots
    return None
