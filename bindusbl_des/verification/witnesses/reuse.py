"""Witnesses of AUVs that share a slot, and come to be heard by one ASV before they ping in it."""

import math
from collections.abc import Iterator
from itertools import product

import numpy as np

from ...protocol.conflicts import dsatur_groups, greedy_groups
from ...scenario.declared import schedule_of
from ..case import Array, Case
from ..pair import Plan
from .pings import rounds_shown
from .stage import SLIVER, Actor, staged, stations_of

# How AUVs share slots; of equal claims, as all are at first, the first AUV has its way.
GROUPS = {"first_fit": greedy_groups, "saturation": dsatur_groups}

# Directions (deg) from which AUVs come in, beside that of the other ASV, and away from it
BESIDE = (0.0, 20.0, -20.0, 45.0, -45.0, 70.0, -70.0)

# So many pairs of ASVs are tried, the nearest first.
MOST_PAIRS = 40


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


def _arrangements(case: Case) -> Iterator[tuple[Array, Array, float, float]]:
    """Yield an ASV, another, and the bearings (rad) from the first of the two AUVs."""
    stations = stations_of(case)
    reach = case.scenario.acoustics.hf.range_m + case.scenario.protocol.conflict_margin_m
    away = np.linalg.norm(stations[:, None] - stations, axis=2)
    rows, columns = np.nonzero((away > 0.0) & (away <= 2 * reach))
    order = np.argsort(away[rows, columns], kind="stable")[:MOST_PAIRS]
    for row, column in zip(rows[order], columns[order], strict=True):
        x, y = stations[column] - stations[row]
        ahead = math.atan2(y, x)
        for first, second in product(BESIDE, BESIDE):
            yield (
                stations[row], stations[column],
                ahead + math.radians(first), ahead + math.pi + math.radians(second),
            )  # fmt: skip


def _played(case: Case, asv: Array, other: Array, first: float, second: float) -> Plan | None:
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
        actors[auv] = Actor(float(x), float(y), depths[auv][1], tuple(asv.tolist()), _late(case))
    for auv in range(slots):
        actors[auv] = Actor(float(middle[0]), float(middle[1]), depths[auv][1])
    places = np.array([(it.x, it.y) for it in actors.values()])
    away = np.linalg.norm(places[:, None] - stations, axis=2)
    if slant:
        away = np.hypot(away, np.array([it.depth for it in actors.values()])[:, None])
    groups = GROUPS[schedule_of(case.scenario).groups](
        _in_order(actors, away <= hf.range_m + margin)
    )
    shared = [set(group) for group in groups].index
    names = sorted(actors)
    group = {names.index(one), names.index(two)}
    if group not in [set(it) for it in groups] or shared(group) != slots:
        return None
    return staged(case, actors, rounds_shown(case), case.sound_speeds[0]) if speed else None


def _in_order(actors: dict[int, Actor], heard: np.ndarray) -> np.ndarray:
    """Return who is heard by whom in the order of the AUVs' numbers."""
    return np.ascontiguousarray(heard[np.argsort(list(actors))])


def _slots_before(case: Case, way: float) -> int | None:
    """Return after how many slots the first AUV is within range; None if it never is."""
    speed, most = case.closing_m_per_s, case.scenario.auvs.count - 2
    late = _late(case)
    for slots in range(1, most + 1):
        if speed * (slots * case.slot_s + late) > way:
            return slots
    return None


def _late(case: Case) -> float:
    return case.late_s
