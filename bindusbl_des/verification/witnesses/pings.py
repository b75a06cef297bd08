"""Witnesses of pings that follow each other, and of AUVs that come within range in a slot."""

import math
from collections.abc import Iterator

from ...preflight.round_lengths import rounds_of
from ...scenario.declared import schedule_of
from ..case import Case
from ..pair import Plan
from .stage import LATEST_S, SLIVER, Actor, staged, stations_of

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
    rounds, count = rounds_of(case.scenario), case.scenario.auvs.count
    if rounds.frame:
        by_lot = schedule_of(case.scenario).turn == "lot"
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
    """Yield scenarios of a schedule of which nothing is proved: AUVs on their planned ways, and two
    that come within range of an ASV or lie at its edge, by the groups that it makes of these.
    """
    if case.stations is None:
        return
    plan = case.scenario.model_dump(mode="json", exclude_defaults=True)
    plan["acoustics"] = {**plan.get("acoustics", {}), "loss": {"law": "none"}}
    if "modem" in plan["acoustics"].get("mf", {}):
        plan["acoustics"]["mf"].pop("airtimes", None)  # which the modem brings
    yield plan | {"duration_s": min(case.scenario.duration_s, LONGEST_SHOWN_S)}
    if case.scenario.auvs.count > 1:
        yield at_the_edge(case)
        if case.closing_m_per_s > 0.0:
            yield come_in_together(case, min(20 * rounds_shown(case), LONGEST_SHOWN_S))
