"""Lanes that land has cut into parts: in which order they are flown, and how an AUV gets from one
to the next on the water.

Parts that lie side by side, each beside one of the lane before, are flown together as lanes of open
water are; then the AUV goes round land to the nearest of the others.  Where there is no room to
turn at the end of a lane, it is left somewhat sooner, and the next one joined somewhat later.
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
# Where along a path a lane begins and ends (m)
Length = tuple[float, float]

# Of a lane no more than this share is left out at either end.
MOST_LEFT = 0.4

# Round land so many of these are tried: a way there takes longer to find than a turn.
FEW = 3

# How far back (radii) a line is joined on which an AUV turns about.
BACK = (0.0, 1.0, 2.0, 3.0, 4.0, 6.0)


def over_water(
    lanes: Sequence[Lane], spacing: float, order: str, water: Water, begin: Point | None,
    recovery: Point | None,
) -> FlightPlan:  # fmt: skip
    """Return the plan of an AUV over lanes, the lowest first, from where it begins (None: at the
    end of the first) to where it is recovered, if anywhere; else there and back, again and again.

    Lanes a `spacing` (m) apart are flown in an `order` as of :class:`.routes.Turning`.  What cannot
    be joined over water is joined straight on: whoever asks sees that it leads over land.
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
    """Return lanes, the lowest first, in groups each of which is swept to and fro.

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
    """Return the lanes of all groups as they are flown, each next group from its nearest end."""
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
    """Lanes in the order in which they are flown, joined over water."""

    def __init__(self, legs: Sequence[Leg], water: Water) -> None:
        cut = [[0.0, 0.0] for _ in legs]  # of each lane, at its beginning and end (m)
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
    """Return a pose so far (m) straight ahead."""
    return Pose(pose.x + way * math.cos(pose.yaw), pose.y + way * math.sin(pose.yaw), pose.yaw)


def _joined(
    leg: Leg, following: Leg, gone: float, water: Water
) -> tuple[float, tuple[Segment, ...]]:
    """Return how much (m) sooner a lane is left and the next one joined later, and the way between.

    So much (m) of the lane has gone at its beginning.
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
    """Return how an AUV heads at a place (m), and its way from there to a pose."""
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
    """Return how much (m) before its end a path is left, how far (m) before that it is joined the
    other way round, and the turn between.
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
