"""Scenarios in which two signals overlap that may: each inequality of :mod:`.rules` at its bound.

An AUV acts: it lies where its ping is heard latest or soonest, half-way between two ASVs, or comes
within range in a slot.  All others are out of the way.  Whether two signals do overlap is seen when
the scenario is played (:mod:`.playing`).
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import permutations, product
from typing import Any

import numpy as np

from ...core.protocol.conflicts import GROUPINGS
from ...support.arrays import Floats
from .case import Case, Plan

# What lies at a range is put so much nearer, or farther: roundings of its place are smaller.
SLIVER = 1e-9

# Who moves by no metre a minute counts as still: a route needs a speed.
STILL_M_PER_S = 0.001

# The other AUVs are so many reaches away from all ASVs.
OUT_OF_THE_WAY = 20.0

LATEST_S = 10.0

# Of a witness that lasts longer (s), so many instants are sampled: what matters is when it sounds.
LONG_S, SAMPLES = 5000.0, 10_000


@dataclass(frozen=True)
class Actor:
    """An AUV of a witness: where it begins (m), how deep (m), where it heads for, how late (s).

    It heads for a place (m) at the largest relative speed, or lies still.
    """

    x: float
    y: float
    depth: float
    towards: tuple[float, float] | None = None
    late_s: float = 0.0


def stations_of(case: Case) -> Floats:
    """Return where the ASVs of a witness lie (m), (m, 2): those that move on a ring."""
    found = case.stations
    return np.array(case.setup.nominal_stations_m) if found is None else found


def staged(case: Case, actors: Mapping[int, Actor], duration_s: float, sound_speed: float) -> Plan:
    """Return the plain data of a witness: some AUVs act, all others are out of the way."""
    scenario, stations = case.scenario, stations_of(case)
    dumped = scenario.model_dump(mode="json", exclude_unset=True)
    kept = ("acoustics", "protocol", "usbl")
    data: Plan = {name: dumped[name] for name in kept if name in dumped}
    survey = dumped.get("survey", {})
    shape = ("side_m", "size_m", "polygon_m", "rotation_deg")
    outline = {name: survey[name] for name in shape if name in survey}
    if scenario.survey.corners_deg:  # which are about an origin that a witness has not
        outline = {"polygon_m": [list(corner) for corner in case.setup.area.outline]}
    closed = (("land", case.setup.land), ("keep_out", case.setup.keep_out))
    outline |= {name: what.undivided for name, what in closed if what is not None}
    # Who does not act is where no ASV hears it, apart from all others.
    reach = case.hf.range_m + scenario.protocol.conflict_margin_m
    x, y = (stations.max(axis=0) + OUT_OF_THE_WAY * reach).tolist()
    auvs = [actors.get(n) or Actor(x + n, y, case.depths[n][1]) for n in range(case.auvs)]
    data |= {
        "name": f"{scenario.name}: witness",
        "duration_s": duration_s,
        "survey": {**outline, "depths_m": [auv.depth for auv in auvs]},
        "auvs": {"count": len(auvs), **_routes(case, auvs, duration_s)},
        "asvs": {"formation": {"positions_m": stations.tolist()}, **_carried(dumped, stations)},
        "navigation": {"filter": "dead_reckoning"},  # which changes nothing that is sent
        "environment": {
            "sound_speed_m_per_s": sound_speed,
            "assumed_sound_speed_m_per_s": case.setup.assumed_sound_speed_m_per_s,
        },
    }
    if duration_s > LONG_S:
        rate = SAMPLES / duration_s
        data["record"] = {"metrics_hz": rate, "tracks_hz": rate}
        data["navigation"]["imu_rate_hz"] = max(rate, 0.001)
    if any(auv.late_s for auv in auvs):
        data["auvs"]["ping_late_s"] = [auv.late_s for auv in auvs]
    data["acoustics"] = lossless(data)
    return data


def _carried(dumped: Mapping[str, Any], stations: Floats) -> dict[str, Any]:
    """Return how many moored vessels lie at stations (m), and what USBLs they have."""
    groups = dumped.get("asvs", {}).get("groups", ())
    own = [{name: group[name] for name in ("count", "usbl") if name in group} for group in groups]
    return {"groups": own} if own else {"count": len(stations)}


def lossless(plan: Plan) -> dict[str, Any]:
    """Return the section `acoustics` of a scenario in which no sound is lost."""
    acoustics = {**plan.get("acoustics", {}), "loss": {"law": "none"}}
    mf = acoustics.get("mf", {})
    if "modem" in mf:
        mf.pop("airtimes", None)  # which the modem brings
    return acoustics


def _routes(case: Case, auvs: list[Actor], duration_s: float) -> dict[str, Any]:
    """Return the routes of AUVs, with their speeds: way points if any of them moves."""
    if all(auv.towards is None for auv in auvs):
        return {"route": {"kind": "hold", "positions_m": [[auv.x, auv.y] for auv in auvs]}}
    speed = min(case.closing_m_per_s, 20.0)
    ways, speeds = [], []
    for auv in auvs:
        x, y = auv.towards or (auv.x + 1.0, auv.y)
        away = math.hypot(x - auv.x, y - auv.y)
        far = max(1.0, 2 * speed * duration_s) / away
        ways.append([[auv.x, auv.y], [auv.x + far * (x - auv.x), auv.y + far * (y - auv.y)]])
        speeds.append(max(speed, STILL_M_PER_S) if auv.towards else STILL_M_PER_S)
    return {"route": {"kind": "waypoints", "points_m": ways}, "speeds_m_per_s": speeds}


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
    slowest, shallow, deep = case.sound_speeds[0], case.shortest_m(second), case.depths[first][1]
    longest, arrives = case.longest_m(first) * (1 - SLIVER), gap_s + shallow / slowest
    way = max(min(longest, slowest * arrives), deep)
    late = min(max(arrives - way / slowest, 0.0), case.late_s, LATEST_S)
    actors = {
        first: Actor(x + _level(way, deep), y, deep, late_s=late),
        second: Actor(x, y, shallow),
    }
    return staged(case, actors, rounds_shown(case), slowest)


def _level(slant: float, depth: float) -> float:
    """Return how far (m) off, seen from above, what lies so far aslant and so deep (m)."""
    return math.sqrt(max(slant**2 - depth**2, 0.0))


def rounds_shown(case: Case) -> float:
    """Return how long (s) a witness lasts: until each AUV has had its turn, and a round more."""
    rounds, count = case.rounds, case.auvs
    if rounds.frame:
        each = count * (FRAMES_OF_CHANCE if case.setup.schedule.turn == "lot" else 1)
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
        deep, reach = (
            case.depths[auv][1],
            case.hf.range_m + case.scenario.protocol.conflict_margin_m,
        )
        if case.hf.range_metric == "slant":
            reach = _level(reach, deep)
        begins = x + side * (reach * (1 + SLIVER) + SLIVER)
        actors[auv] = Actor(begins, y, deep, towards=(x, y), late_s=min(late_s, LATEST_S))
    return staged(case, actors, lasts_s, case.sound_speeds[0])


def _at_edges(case: Case, auvs: int, first: float) -> dict[int, Actor]:
    """Return so many AUVs at the edge of an ASV's range, by turns on one side (the `first`: 1.0 or
    -1.0 along x) and on the other.
    """
    x, y = map(float, stations_of(case)[0])
    actors = {}
    for auv, (_, deep) in enumerate(case.depths[:auvs]):
        across = _level(case.longest_m(auv) * (1 - SLIVER), deep)
        actors[auv] = Actor(x + first * across * (-1) ** auv, y, deep)
    return actors


def at_the_edge(case: Case) -> Plan:
    """Return a scenario in which two AUVs lie at the edge of an ASV's range, where fixes that are
    a little off have them beyond it.
    """
    return staged(case, _at_edges(case, 2, -1.0), 20 * rounds_shown(case), case.sound_speeds[0])


def out_of_hearing(case: Case) -> Iterator[Plan]:
    """Yield scenarios in which half the AUVs are at one edge of an ASV's range and half at the
    other, each longer than the one before: sooner or later two ping at once.
    """
    actors, each = _at_edges(case, case.auvs, 1.0), case.scenario.protocol.frame_s
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
    if case.auvs > 1:
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
    for actors in _between(case, apart, case.hf.range_m, case.hf.range_metric == "slant"):
        yield staged(case, actors, rounds_shown(case), case.sound_speeds[0])


def frames_meet(case: Case, apart: float) -> Iterator[Plan]:
    """Yield the same for frames of fixes, with ever more others that are fixed, below an ASV."""
    lasts = min(ROUNDS_OF_CHANCE * case.scenario.asvs.count * rounds_shown(case), LONGEST_S)
    x, y = map(float, stations_of(case)[0])
    hf, mf, count = case.hf, case.scenario.acoustics.mf, case.auvs
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
    level = _level(reach, deep) if slant else reach
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
    stations, reach = stations_of(case), case.hf.range_m
    for number, (one, other) in enumerate(permutations(range(len(stations)), 2)):
        if number == MOST_PAIRS:
            return
        middle = stations[one] + (0.5 - SLIVER) * (stations[other] - stations[one])
        far = _outside(stations, other, OUT_OF_THE_WAY * (reach + np.ptp(stations)))
        if far is None or math.dist(stations[one], stations[other]) > 2 * reach:
            continue
        x, y = middle.tolist()
        actors = {0: Actor(x, y, case.depths[0][1]), 1: Actor(*far, case.depths[1][1])}
        yield staged(case, actors, rounds_shown(case), case.sound_speeds[0])


def _outside(stations: Floats, asv: int, way: float) -> tuple[float, float] | None:
    """Return a place so far (m) from an ASV that is nearest to it; None if it lies within others'
    midst.
    """
    for bearing in BEARINGS:
        place = stations[asv] + way * np.array((math.cos(bearing), math.sin(bearing)))
        away = np.linalg.norm(stations - place, axis=1)
        if int(np.argmin(away)) == asv and np.sum(away <= away[asv]) == 1:
            x, y = place.tolist()
            return x, y
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
        to_x, to_y = stations[other].tolist()
        actor = Actor(float(x), float(y), case.shortest_m(auv), towards=(to_x, to_y))
        yield staged(case, {auv: actor}, rounds_shown(case), case.sound_speeds[1])


def answer_late(case: Case, auv: int, gap_s: float) -> Iterator[Plan]:
    """Yield scenarios in which an AUV answers from so far that the next call drowns that."""
    stations, slowest, deep = stations_of(case), case.sound_speeds[0], case.depths[auv][1]
    longest = case.longest_m(auv) * (1 - SLIVER)
    answered = case.slots.ping_duration + case.scenario.protocol.turnaround_s
    way = max(min(longest, slowest * (gap_s - answered) / 2), deep)
    count = case.auvs
    for asv, (x, y) in enumerate(stations.tolist()):
        place = _outside(stations, asv, _level(way, deep))
        if place is None:
            continue
        for other in dict.fromkeys(((auv + 1) % count, (auv - 1) % count)):
            nearby = {other: Actor(x, y, case.shortest_m(other))}
            actors = nearby | {auv: Actor(*place, deep)}
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
        if (plan := _arranged(case, *arrangement)) is not None:
            yield plan


def _arrangements(case: Case) -> Iterator[tuple[Floats, Floats, float, float]]:
    """Yield an ASV, another, and the bearings (rad) from the first of the two AUVs."""
    stations = stations_of(case)
    reach = case.hf.range_m + case.scenario.protocol.conflict_margin_m
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


def _arranged(case: Case, asv: Floats, other: Floats, first: float, second: float) -> Plan | None:
    """Return the scenario of an arrangement, None where its AUVs would not share a slot in time."""
    speed, depths, stations = case.closing_m_per_s, case.depths, stations_of(case)
    reach, slant = case.hf.range_m, case.hf.range_metric == "slant"
    looked = reach + case.scenario.protocol.conflict_margin_m
    one, two = case.auvs - 2, case.auvs - 1

    def across(way: float, auv: int) -> float:
        return _level(way, depths[auv][1] if slant else 0.0)

    outside = across(looked, one) * (1 + SLIVER) + SLIVER
    way, shared = outside - across(reach, one), range(1, one + 1)
    slots = next((n for n in shared if speed * (n * case.slot_s + case.late_s) > way), None)
    if slots is None:  # the first is never within range
        return None
    # At its ping the second is as far as the first, or it begins at the edge of what is heard.
    begins = (outside, across(looked, two) * (1 - SLIVER))
    x, y = ((asv + other) / 2).tolist()
    actors = {auv: Actor(x, y, depths[auv][1]) for auv in range(slots)}
    for auv, bearing, away in ((one, first, begins[0]), (two, second, begins[1])):
        x, y = (asv + away * np.array((math.cos(bearing), math.sin(bearing)))).tolist()
        actors[auv] = Actor(x, y, depths[auv][1], tuple(asv.tolist()), case.late_s)
    places = np.array([(actor.x, actor.y) for actor in actors.values()])
    ways = np.linalg.norm(places[:, None] - stations, axis=2)
    if slant:
        ways = np.hypot(ways, np.array([actor.depth for actor in actors.values()])[:, None])
    groups = [set(group) for group in GROUPINGS[case.setup.schedule.groups](ways <= looked)]
    pair = {slots, slots + 1}  # both, counted after those that have the slots before
    if not speed or pair not in groups or groups.index(pair) != slots:
        return None
    return staged(case, actors, rounds_shown(case), case.sound_speeds[0])
