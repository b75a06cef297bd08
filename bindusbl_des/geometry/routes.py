"""Survey routes: in which order lanes are flown, and how an AUV gets from one to the next."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from .area import Box, Point
from .lanes import LANE_TOLERANCE, Lane, Share
from .paths import Path, Pose, Segment, dubins_segments, through
from .turns import turned_onto

# Where along a path lanes begin and end (m).
Lengths = tuple[tuple[float, float], ...]


class FlightPlan(NamedTuple):
    """What an AUV is to fly: its path once through, and where along it lanes begin and end (m).

    `tour` is the same path without an end, there and back; a path with an end, which is to wait
    there, is its own tour.
    """

    path: Path
    lanes: Lengths
    tour: Path


class Turning(NamedTuple):
    """How an AUV turns: its radius (m), the order of its lanes, and at which angle (rad) it joins
    a line again.
    """

    radius: float
    order: str = "shortest"
    join_angle: float = math.radians(20.0)


def lane_order(count: int, skip: int) -> list[int]:
    """Return the order in which lanes are flown so that turns are `skip` lanes wide where possible.

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
    """Return the boustrophedon path of one AUV over its lanes, and where along it each is (m).

    From where it begins the AUV goes straight to the -x end of its first lane, turns about and
    joins it, or from behind goes straight onto it; with None it begins there.  Turns between lanes
    are Dubins curves, so lanes closer than twice the turning radius get bulb turns, or are flown in
    skip-lane order.  Behind the last lane it goes to where it is recovered, if anywhere.  Of two
    equal turns onto the first lane that which stays within a box about the survey is taken.
    """
    skip = max(1, math.ceil(2 * turning.radius / spacing - LANE_TOLERANCE))
    skips = {"bulb": [1], "skip_lane": [skip], "shortest": [1, skip]}[turning.order]
    orders = dict.fromkeys(tuple(lane_order(len(share.lanes), skip)) for skip in skips)
    candidates = [_over([share.lanes[lane] for lane in order], turning.radius) for order in orders]
    path, lanes = min(candidates, key=lambda it: it[0].length)
    if begin is not None:
        path, lanes = _entered(path, lanes, begin, turning, box)
    return (path if recovery is None else ended(path, recovery, turning.radius)), lanes


def _over(lanes: Sequence[Lane], radius: float) -> tuple[Path, Lengths]:
    """Return the path over lanes in this order, to and fro, and where along it each is (m)."""
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
    """Return the path over lanes with the way from a place to the first of them."""
    first, (x, y) = path.start, begin
    bearing = math.atan2(first.y - y, first.x - x)
    if math.cos(bearing - first.yaw) >= 0.0:  # from behind: straight onto it
        onto = dubins_segments(Pose(x, y, bearing), first, turning.radius)
        whole = Path(Pose(x, y, bearing), (*onto, *path.segments))
        before = whole.length - path.length
        return whole, tuple((start + before, end + before) for start, end in lanes)
    way = Segment(0.0, math.hypot(first.x - x, first.y - y))
    entry = Path(Pose(x, y, bearing), (way,))
    turn, joined = turned_onto(entry.end, path, box, turning.radius, turning.join_angle)
    whole = Path(entry.start, (way, *turn))
    later = whole.length - path.length
    return whole, tuple((max(start, joined) + later, end + later) for start, end in lanes)


def ended(path: Path, place: Point, radius: float) -> Path:
    """Return a path with the way from its end to a place (m), where it ends."""
    bearing = math.atan2(place[1] - path.end.y, place[0] - path.end.x)
    way = dubins_segments(path.end, Pose(*place, bearing), radius)
    return Path(path.start, (*path.segments, *way))


def waypoint_poses(points: Sequence[Point]) -> list[Pose]:
    """Return waypoints (m) with the heading at each: towards the next, at the last one onwards."""
    poses = []
    for number, (x, y) in enumerate(points):
        ahead = points[number + 1] if number + 1 < len(points) else None
        behind = points[number - 1]
        dx, dy = (ahead[0] - x, ahead[1] - y) if ahead else (x - behind[0], y - behind[1])
        poses.append(Pose(x, y, math.atan2(dy, dx)))
    return poses
