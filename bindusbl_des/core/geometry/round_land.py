"""Lanes that land has cut into parts: their order, and the path over water between them.

Parts side by side, each beside exactly one of the lane before, form a cell, which is swept to and
fro like open water; then the AUV goes round land to the nearest cell that is left.  Where there is
no room to turn at the end of a lane, the AUV leaves it sooner, and joins the next one later.
"""

import math
from collections.abc import Sequence
from itertools import groupby, pairwise, product

from .area import Point
from .drawn_routes import corner_poses
from .lanes import LANE_TOLERANCE, Lane
from .paths import Path, Pose, Segment, dubins_segments
from .routes import FlightPlan, lane_order
from .ways import SOONER, Water, length_of

Leg = tuple[Pose, Pose]
# The distances (m) along a path at which a lane begins and ends
Length = tuple[float, float]

# At most this share of a lane is left out at either end.
MOST_LEFT = 0.4

# Of the steps in `SOONER`, so many are tried with detours, which take longer to search than turns.
FEW = 3

# How far before its turn (radii) an AUV joins the line again on which it turns about.
BACK = (0.0, 1.0, 2.0, 3.0, 4.0, 6.0)


def over_water(
    lanes: Sequence[Lane], spacing: float, order: str, water: Water, begin: Point | None,
    recovery: Point | None,
) -> FlightPlan:  # fmt: skip
    """Return the flight plan of an AUV over lanes (lowest y first), joined over water.

    Lanes are `spacing` (m) apart; `order` is as in :class:`.routes.Turning`.  The path begins at
    `begin` (m; None: at the end of the first lane) and ends at `recovery` (m); without, the tour
    goes there and back forever.  Lanes that cannot be joined over water are joined by a curve over
    land, which the caller has to detect.
    """
    skip = max(1, math.ceil(2 * water.radius / spacing - LANE_TOLERANCE))
    skips = {"bulb": [1], "skip_lane": [skip], "shortest": [1, skip]}[order]
    plans = [_Flown(_legs(cells(lanes), skip, begin), water) for skip in skips]
    flown = min(plans, key=lambda plan: plan.path.length)
    path, parts = flown.path, flown.lanes
    if begin is not None:
        entry = _from(water, begin, path.start)
        before = length_of(entry[1])
        path = Path(entry[0], (*entry[1], *path.segments))
        parts = [(first + before, last + before) for first, last in parts]
    if recovery is not None:
        onwards = _from(water, recovery, path.end.reversed())
        home = Path(onwards[0], onwards[1]).reversed().segments
        path = Path(path.start, (*path.segments, *home))
        return FlightPlan(path, tuple(parts), path)
    return _there_and_back(path, parts, water)


def cells(lanes: Sequence[Lane]) -> list[list[Lane]]:
    """Return lanes (lowest y first) in groups, each of which can be swept to and fro.

    >>> [len(cell) for cell in cells([Lane(0, 0, 9), Lane(1, 0, 3), Lane(1, 5, 9), Lane(2, 0, 9)])]
    [1, 1, 1, 1]
    """
    found, last = list[list[Lane]](), list[list[Lane]]()
    for _, row in groupby(lanes, key=lambda lane: lane.y):
        parts, now = list(row), list[list[Lane]]()
        for part in parts:
            beside = [cell for cell in last if _overlap(cell[-1], part)]
            alone = len(beside) == 1 and sum(_overlap(beside[0][-1], other) for other in parts) == 1
            cell = beside[0] if alone else []
            if not alone:
                found.append(cell)
            now.append(cell)
        for cell, part in zip(now, parts, strict=True):
            cell.append(part)
        last = now
    return found


def _overlap(one: Lane, other: Lane) -> bool:
    return one.x_min < other.x_max and other.x_min < one.x_max


def _legs(groups: Sequence[Sequence[Lane]], skip: int, begin: Point | None) -> list[Leg]:
    """Return the lanes of all groups in the order flown, from `begin` (m) on: the nearest group
    left comes next.  Turns within a group are `skip` lanes wide.
    """
    left, legs, here = list(groups), list[Leg](), begin
    while left:
        options = [
            (number, upwards, ahead)
            for number in range(len(left))
            for upwards in ((True, False) if legs else (True,))
            for ahead in ((True, False) if legs else (True,))
        ]
        if not legs:
            options = options[:1]
        ways = {option: _swept(left[option[0]], skip, *option[1:]) for option in options}

        def away(option: tuple[int, bool, bool]) -> float:
            first = ways[option][0][0]  # noqa: B023 (asked at once)
            return 0.0 if here is None else math.dist(here, first[:2])  # noqa: B023

        chosen = min(options, key=away)
        legs += ways[chosen]
        del left[chosen[0]]
        here = legs[-1][1][:2]
    return legs


def _swept(cell: Sequence[Lane], skip: int, upwards: bool, ahead: bool) -> list[Leg]:
    order = lane_order(len(cell), skip)
    legs = []
    for number, lane in enumerate(order if upwards else [len(cell) - 1 - n for n in order]):
        y, low, high = cell[lane]
        is_ahead = (number % 2 == 0) == ahead
        yaw = 0.0 if is_ahead else math.pi
        first, last = (low, high) if is_ahead else (high, low)
        legs.append((Pose(first, y, yaw), Pose(last, y, yaw)))
    return legs


class _Flown:
    """Lanes in the order flown, joined over water: their path, and where (m) along it each lies."""

    def __init__(self, legs: Sequence[Leg], water: Water) -> None:
        cut = [[0.0, 0.0] for _ in legs]  # (m) left out of each lane, at its beginning and end
        joins = []
        for number, (leg, following) in enumerate(pairwise(legs)):
            sooner, curve = _joined(leg, following, cut[number][0], water)
            cut[number][1] = cut[number + 1][0] = sooner
            joins.append(curve)
        segments, lanes, done = list[Segment](), [], 0.0
        for number, leg in enumerate(legs):
            long = _long(leg) - sum(cut[number])
            segments.append(Segment(0.0, long))
            lanes.append((done, done + long))
            done += long
            if number < len(joins):
                segments += joins[number]
                done += length_of(joins[number])
        self.path = Path(_along(legs[0][0], cut[0][0]), tuple(segments))
        self.lanes: list[Length] = lanes


def _long(leg: Leg) -> float:
    return abs(leg[1].x - leg[0].x)


def _along(pose: Pose, way: float) -> Pose:
    """Return the pose a distance (m) straight ahead."""
    return Pose(pose.x + way * math.cos(pose.yaw), pose.y + way * math.sin(pose.yaw), pose.yaw)


def _joined(
    leg: Leg, following: Leg, gone: float, water: Water
) -> tuple[float, tuple[Segment, ...]]:
    """Return the length (m) left out on both sides of a turn between lanes, and its curve.

    `gone` (m) of the lane is left out at its beginning already.
    """
    most = min(MOST_LEFT * _long(leg), MOST_LEFT * _long(following), _long(leg) - gone)
    steps = [step * water.radius for step in SOONER if step * water.radius <= most] or [0.0]
    apart = math.dist(leg[1][:2], following[0][:2])
    turn = apart + 4.0 * math.pi * water.radius
    for room in water.rooms:
        for how in (room.curve, room.joined):
            for step in steps if how == room.curve else steps[:FEW]:
                one, other = _along(leg[1], -step), _along(following[0], step)
                curve = how(one, other)
                if curve is None:
                    continue
                if how == room.joined or length_of(curve) < turn:
                    return step, curve
    return 0.0, dubins_segments(leg[1], following[0], water.radius)


def _from(water: Water, place: Point, pose: Pose) -> tuple[Pose, tuple[Segment, ...]]:
    """Return the pose in which an AUV leaves a position (m), and its path from there to a pose."""
    for room in water.rooms:
        for corners in room.around(place, pose[:2]):
            yaw = math.atan2(corners[1][1] - place[1], corners[1][0] - place[0])
            start = Pose(*place, yaw)
            poses = [start, *corner_poses(corners, water.radius), pose]
            legs = [room.curve(one, other) for one, other in pairwise(poses)]
            if all(leg is not None for leg in legs):
                return start, tuple(segment for leg in legs for segment in leg or ())
    start = Pose(*place, math.atan2(pose.y - place[1], pose.x - place[0]))
    return start, dubins_segments(start, pose, water.radius)


def _there_and_back(path: Path, lanes: Sequence[Length], water: Water) -> FlightPlan:
    """Return the plan of a path that is flown there and back, as far as there is room to turn."""
    sooner, back, turn = _about(path, water)
    there = path.length - sooner
    path = Path(path.start, _piece(path, 0.0, there))
    kept = [(first, min(last, there)) for first, last in lanes if first < there]
    homewards = path.reversed()
    early, forth, again = _about(homewards, water)
    home = _piece(homewards, back, there - early)
    tour = Path(path.start, (*path.segments, *turn, *home, *again), repeats_from=early + forth)
    return FlightPlan(path, tuple(kept), tour)


def _about(path: Path, water: Water) -> tuple[float, float, tuple[Segment, ...]]:
    """Return the turn at the end of a path onto its reverse.

    First come the length (m) of the path left out at its end, and the distance (m) before that at
    which the AUV joins it again.
    """
    radius = water.radius
    for room, sooner in product(water.rooms, SOONER):
        left = path.length - sooner * radius
        found = []
        for back in BACK:
            if back * radius < left and left > 0.0:
                at = path.at(left - back * radius).reversed()
                curve = room.curve(path.at(left), at)
                if curve is not None:
                    longer = length_of(curve) - back * radius
                    found.append((longer, back * radius, curve))
        if found:
            _, back_m, curve = min(found, key=lambda turn: turn[:2])
            return sooner * radius, back_m, curve
    return 0.0, 0.0, dubins_segments(path.end, path.end.reversed(), radius)


def _piece(path: Path, begin: float, end: float) -> tuple[Segment, ...]:
    """Return the segments of a path between two distances along it (m)."""
    found, done = [], 0.0
    for segment in path.segments:
        first, last = max(begin - done, 0.0), min(end - done, segment.length)
        if last > first:
            found.append(segment._replace(length=last - first))
        done += segment.length
    return tuple(found)
