"""Witnesses of two-way ranging: two calls at an AUV, a call and an answer at an ASV."""

import math
from collections.abc import Iterator
from itertools import permutations, product

import numpy as np

from ..case import Array, Case
from ..pair import Plan
from .pings import rounds_shown
from .stage import OUT_OF_THE_WAY, SLIVER, Actor, staged, stations_of

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
        if int(np.argmin(np.linalg.norm(stations - middle, axis=1))) == other:
            continue
        actors = {0: Actor(float(middle[0]), float(middle[1]), deep)}
        actors[1] = Actor(*far, case.depths[1][1])
        yield staged(case, actors, rounds_shown(case), case.sound_speeds[0])


def _outside(stations: Array, asv: int, way: float) -> tuple[float, float] | None:
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
