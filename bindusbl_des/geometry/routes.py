"""Survey routes: how a team of AUVs divides a square and sweeps it in lanes."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from .paths import Path, Pose, Segment, smooth
from .turns import turned_onto

# Rounding that must not cost a strip its last lane (m).
LANE_TOLERANCE = 1e-9


class Strip(NamedTuple):
    """One of the equal strips along x, `total` of them, that divide a square of `side` (m); the
    lowest has the number 0.
    """

    side: float
    total: int
    number: int


def lane_ordinates(strip: Strip, spacing: float) -> list[float]:
    """Return the y (m) of the lanes of a strip, lowest first.

    The first lane lies half a spacing above the strip's lower edge, the others one spacing apart;
    a strip narrower than the spacing has one lane along its middle.

    >>> lane_ordinates(Strip(140, 3, 0), 10)
    [-65.0, -55.0, -45.0, -35.0]
    """
    height = strip.side / strip.total
    lower = -strip.side / 2 + strip.number * height
    if height < spacing:
        return [lower + height / 2]
    count = math.floor((height - spacing) / spacing + LANE_TOLERANCE) + 1
    return [lower + spacing * (lane + 0.5) for lane in range(count)]


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
    strip: Strip,
    *,
    spacing: float,
    margin: float,
    radius: float,
    start: str = "strip_centre",
    turns: str = "shortest",
    join_angle: float = math.radians(20.0),
) -> Path:
    """Return the boustrophedon path of one AUV in its strip of the survey (m).

    Lanes run along x and end `margin` inside the square.  From the strip's centre the AUV goes
    straight to the -x end of its first lane, turns about and joins it at `join_angle` (rad).
    Turns between lanes are Dubins curves, so lanes closer than twice the turning radius get bulb
    turns, or are flown in skip-lane order.
    """
    ordinates = lane_ordinates(strip, spacing)
    skip = max(1, math.ceil(2 * radius / spacing - LANE_TOLERANCE))
    skips = {"bulb": [1], "skip_lane": [skip], "shortest": [1, skip]}[turns]
    reach = strip.side / 2 - margin
    candidates = [
        smooth(
            _lane_ends([ordinates[lane] for lane in lane_order(len(ordinates), s)], reach), radius
        )
        for s in skips
    ]
    lanes = min(candidates, key=lambda path: path.length)
    if start == "strip_corner":
        return lanes
    centre = -strip.side / 2 + (strip.number + 0.5) * strip.side / strip.total
    return _entered(lanes, centre, strip.side, radius, join_angle)


def _entered(lanes: Path, centre: float, side: float, radius: float, join_angle: float) -> Path:
    """Return the lanes with the way from the strip's centre (0, centre) to the first of them."""
    first = lanes.start
    bearing = math.atan2(first.y - centre, first.x)
    way = Segment(0.0, math.hypot(first.x, first.y - centre))
    entry = Path(Pose(0.0, centre, bearing), (way,))
    turn, _ = turned_onto(entry.end, lanes, side, radius, join_angle)
    return Path(entry.start, (way, *turn))


def _lane_ends(ordinates: Sequence[float], reach: float) -> list[Pose]:
    ends: list[Pose] = []
    for number, y in enumerate(ordinates):
        sign = 1.0 if number % 2 == 0 else -1.0
        yaw = 0.0 if sign > 0 else math.pi
        ends += [Pose(-sign * reach, y, yaw), Pose(sign * reach, y, yaw)]
    return ends


def waypoint_path(points: Sequence[tuple[float, float]], radius: float) -> Path:
    """Return the Dubins path through waypoints (m), each left towards the next."""
    poses = []
    for number, (x, y) in enumerate(points):
        ahead = points[number + 1] if number + 1 < len(points) else None
        behind = points[number - 1]
        dx, dy = (ahead[0] - x, ahead[1] - y) if ahead else (x - behind[0], y - behind[1])
        poses.append(Pose(x, y, math.atan2(dy, dx)))
    return smooth(poses, radius)
