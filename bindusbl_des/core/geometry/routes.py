"""Survey routes: the order of lanes, the turns between them, and ascents to the surface.

To surface, an AUV leaves its path, climbs in circles beside it, circles at the surface, dives in
circles, and continues the path where it left it, as by the manoeuvre PopUp of IMC (LSTS toolchain).
Whole circles end at the same position and heading, so that no part of the survey is left out.
"""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from .area import Box, Point
from .lanes import LANE_TOLERANCE, Lane, Share
from .paths import Path, Pose, Segment, dubins_segments, through

# A part of a circle smaller than this (circles) adds no circle: rounding.
CIRCLE_ROUNDING = 1e-9

# The most ascents of a path, which is planned as a whole before the mission.
MOST_ASCENTS = 20_000


# The distances (m) along a path at which lanes begin and end.
Lengths = tuple[tuple[float, float], ...]


class FlightPlan(NamedTuple):
    """The path of one AUV, and the distances (m) along it at which lanes begin and end.

    `tour` is the path made endless, there and back; a path whose AUV waits at the end is its own
    tour.
    """

    path: Path
    lanes: Lengths
    tour: Path


class Turning(NamedTuple):
    """How an AUV turns: radius (m), order of its lanes ("bulb", "skip_lane", "shortest"), and the
    angle (rad) at which it joins a line again.
    """

    radius: float
    order: str = "shortest"
    join_angle: float = math.radians(20.0)


def lane_order(count: int, skip: int) -> list[int]:
    """Return the order of `count` lanes in which turns are `skip` lanes wide where possible.

    >>> lane_order(5, 1)
    [0, 1, 2, 3, 4]
    >>> lane_order(6, 3)
    [0, 3, 1, 4, 2, 5]
    """
    order: list[int] = []
    for first in range(0, count, 2 * skip):
        lower = range(first, min(first + skip, count))
        upper = list(range(first + skip, min(first + 2 * skip, count)))
        for lane in lower:
            order.append(lane)
            if upper:
                order.append(upper.pop(0))
        order.extend(upper)
    return order


def lawnmower(
    share: Share,
    spacing: float,
    turning: Turning,
    *,
    begin: Point | None,
    recovery: Point | None = None,
    box: Box,
) -> tuple[Path, Lengths]:
    """Return the boustrophedon path of one AUV over its lanes, and where along it each lane is (m).

    From `begin` the AUV goes straight to the -x end of its first lane, then turns about onto it, or
    enters it directly when it comes from behind; with None the path begins at the lane.  Dubins
    curves join the lanes, so lanes closer than twice the turning radius get bulb turns, or are
    flown in skip-lane order.  After the last lane the AUV goes to `recovery`, if given.  Of two
    equal turns onto the first lane, the AUV takes the one that stays within `box`, which bounds the
    survey.
    """
    skip = max(1, math.ceil(2 * turning.radius / spacing - LANE_TOLERANCE))
    skips = {"bulb": [1], "skip_lane": [skip], "shortest": [1, skip]}[turning.order]
    orders = dict.fromkeys(tuple(lane_order(len(share.lanes), skip)) for skip in skips)
    candidates = [_over([share.lanes[lane] for lane in order], turning.radius) for order in orders]
    path, lanes = min(candidates, key=lambda candidate: candidate[0].length)
    if begin is not None:
        path, lanes = _entered(path, lanes, begin, turning, box)
    return (path if recovery is None else ended(path, recovery, turning.radius)), lanes


def _over(lanes: Sequence[Lane], radius: float) -> tuple[Path, Lengths]:
    """Return the path over lanes in this order, to and fro, and where along it each lane is (m)."""
    ends: list[Pose] = []
    for number, lane in enumerate(lanes):
        start, end, yaw = lane.x_min, lane.x_max, 0.0
        if number % 2:
            start, end, yaw = end, start, math.pi
        ends += [Pose(start, lane.y, yaw), Pose(end, lane.y, yaw)]
    path, passed = through(ends, radius)
    return path, tuple(zip(passed[::2], passed[1::2], strict=True))


def _entered(
    path: Path, lanes: Lengths, begin: Point, turning: Turning, box: Box
) -> tuple[Path, Lengths]:
    """Return a path over lanes after an approach from a position, and where (m) each lane is."""
    first, (x, y) = path.start, begin
    bearing = math.atan2(first.y - y, first.x - x)
    if math.cos(bearing - first.yaw) >= 0.0:  # from behind: straight onto it
        onto = dubins_segments(Pose(x, y, bearing), first, turning.radius)
        whole = Path(Pose(x, y, bearing), (*onto, *path.segments))
        before = whole.length - path.length
        return whole, tuple((start + before, end + before) for start, end in lanes)
    straight = Segment(0.0, math.hypot(first.x - x, first.y - y))
    entry = Path(Pose(x, y, bearing), (straight,))
    turn, joined = turned_onto(entry.end, path, box, turning.radius, turning.join_angle)
    whole = Path(entry.start, (straight, *turn))
    later = whole.length - path.length
    return whole, tuple((max(start, joined) + later, end + later) for start, end in lanes)


def begun(path: Path, place: Point, radius: float) -> Path:
    """Return a path with an approach from a position (m) to its start."""
    start = Pose(*place, math.atan2(path.start.y - place[1], path.start.x - place[0]))
    return Path(start, (*dubins_segments(start, path.start, radius), *path.segments))


def ended(path: Path, place: Point, radius: float) -> Path:
    """Return a path with a further leg from its end to a position (m)."""
    bearing = math.atan2(place[1] - path.end.y, place[0] - path.end.x)
    homewards = dubins_segments(path.end, Pose(*place, bearing), radius)
    return Path(path.start, (*path.segments, *homewards))


def there_and_back(path: Path, box: Box, radius: float, join_angle: float) -> Path:
    """Return the endless tour along a path and back; after each end it joins the line at
    `join_angle` (rad).
    """
    back, _ = turned_onto(path.end, path.reversed(), box, radius, join_angle)
    there = (*path.segments, *back)
    home = Path(path.start, there).end
    again, joined = turned_onto(home, path, box, radius, join_angle)
    turn = again[: len(again) - len(path.segments)]
    return Path(path.start, (*there, *turn), repeats_from=joined)


def turned_onto(
    end: Pose, path: Path, box: Box, radius: float, join_angle: float
) -> tuple[tuple[Segment, ...], float]:
    """Return segments that turn from a pose onto a path and follow it, and where they join it (m).

    The pose is at the path's start, and heads more backwards than forwards.  The vehicle takes the
    shorter turn (of two equal ones, the one that stays within `box`) until it approaches the path's
    first straight at `join_angle` (rad), and turns onto it.  A path without such a straight is
    entered at its very start, by a Dubins curve.
    """
    first = path.segments[0]
    yaw = end.yaw - path.start.yaw
    options = []
    if first.curvature == 0.0 and math.cos(yaw) < 0.0:
        for hand in (1.0, -1.0):
            turn, joined = turn_about(yaw, radius, join_angle, hand)
            if joined < first.length:
                reached = Path(end, turn).box
                beyond = max(
                    box.beyond(reached.x_max, reached.y_max),
                    box.beyond(reached.x_min, reached.y_min),
                )
                overshoot = beyond - max(0.0, box.beyond(end.x, end.y))
                length = sum(segment.length for segment in turn) - joined
                options.append((round(length, 6), max(overshoot, 0.0), hand, turn, joined))
    if not options:
        return (*dubins_segments(end, path.start, radius), *path.segments), 0.0
    *_, turn, joined = min(options)
    rest = Segment(0.0, first.length - joined)
    return (*turn, rest, *path.segments[1:]), joined


def turn_about(
    yaw: float, radius: float, join_angle: float, hand: float
) -> tuple[tuple[Segment, Segment, Segment], float]:
    """Return the turn from heading `yaw` (rad) onto a line of heading 0, and where it joins (m).

    The vehicle begins on the line and turns towards +yaw (`hand` 1) or -yaw (-1) until it
    approaches the line at `join_angle`; it joins it `joined` metres ahead of where it began.

    >>> turn, joined = turn_about(math.pi, 5.0, math.radians(30), 1.0)
    >>> end = Path(Pose(0.0, 0.0, math.pi), turn).end
    >>> abs(end.x - joined) < 1e-9, abs(end.y) < 1e-9, round(end.yaw / math.pi, 9)
    (True, True, 2.0)
    """
    mirrored = hand * yaw
    cosine, sine = math.cos(join_angle), math.sin(join_angle)
    straight = radius * (2 * cosine - 1.0 - math.cos(mirrored)) / sine
    joined = radius * (2 * sine - math.sin(mirrored)) + straight * cosine
    turn = (
        Segment(hand / radius, radius * (-mirrored % (2 * math.pi) + join_angle)),
        Segment(0.0, straight),
        Segment(-hand / radius, radius * join_angle),
    )
    return turn, joined


def waypoint_poses(points: Sequence[Point]) -> list[Pose]:
    """Return waypoints (m) as poses that head for the next waypoint; the last keeps its heading."""
    poses = []
    for number, (x, y) in enumerate(points):
        ahead = points[number + 1] if number + 1 < len(points) else None
        behind = points[number - 1]
        dx, dy = (ahead[0] - x, ahead[1] - y) if ahead else (x - behind[0], y - behind[1])
        poses.append(Pose(x, y, math.atan2(dy, dx)))
    return poses


class Surfacing(NamedTuple):
    """How an AUV surfaces: after each `every` (m) of its path, in circles of a radius (m), from a
    depth (m), at a pitch angle (rad), with a least length (m) at the surface, `stay`.
    """

    every: float
    radius: float
    depth: float
    angle: float
    stay: float

    @property
    def segments(self) -> tuple[Segment, ...]:
        """The climb, the stay at the surface and the dive: whole circles to starboard."""
        slope, circle = math.tan(self.angle), 2.0 * math.pi * self.radius
        climb = self.depth / slope
        count = max(math.ceil((2.0 * climb + self.stay) / circle - CIRCLE_ROUNDING), 1)
        parts = (climb, -slope), (count * circle - 2.0 * climb, 0.0), (climb, slope)
        return tuple(Segment(1.0 / self.radius, length, dip) for length, dip in parts)

    @property
    def length(self) -> float:
        """The length (m) of one ascent."""
        return sum(segment.length for segment in self.segments)


def surfaced(path: Path, asked: Surfacing) -> tuple[Path, list[float]]:
    """Return a path with ascents, and the distances (m) along the old path at which they begin.

    A tour surfaces at least as often in each lap.

    Raises:
        ValueError: when the path would have more than `MOST_ASCENTS` ascents.
    """
    count = math.ceil(path.length / asked.every)
    if count > MOST_ASCENTS:
        raise ValueError(
            f"an AUV would come up {count:,} times on its path of {path.length / 1e3:,.3g} km; "
            f"{MOST_ASCENTS:,} times at most: raise surface_every_s or shorten the path"
        )
    breaks = [k * asked.every for k in range(1, count + 1) if k * asked.every < path.length]
    first = path.repeats_from
    if first is not None:
        again = next((ascent for ascent in breaks if ascent > first), path.length)
        if again - first + path.length - max([first, *breaks]) > asked.every:
            breaks.append(path.length)
    segments, begin, left = list[Segment](), 0.0, deque(breaks)
    for number, segment in enumerate(path.segments):
        done, is_last = 0.0, number == len(path.segments) - 1
        while left and (left[0] <= begin + segment.length or is_last):
            into = min(left.popleft() - begin, segment.length)
            segments += (segment._replace(length=into - done), *asked.segments)
            done = into
        segments.append(segment._replace(length=segment.length - done))
        begin += segment.length
    if first is not None:
        first += asked.length * sum(ascent < first for ascent in breaks)
    return replace(path, segments=tuple(segments), repeats_from=first), breaks
