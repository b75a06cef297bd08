"""Witnesses of sound from ASVs: pings that meet at an AUV, frames that do, rounds that slip."""

import math
from collections.abc import Iterator
from itertools import product

import numpy as np

from ..case import Case
from ..pair import Plan
from .pings import rounds_shown
from .stage import SLIVER, Actor, staged, stations_of

# So many rounds of a scenario whose broadcasters are drawn by lot
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
        for actors in _between(case, apart, reach, False):
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
