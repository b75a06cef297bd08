"""Turning about: how a vehicle that has come to the end of a line gets back onto one."""

import math

from .area import Box
from .paths import Path, Pose, Segment, dubins_segments


def there_and_back(path: Path, box: Box, radius: float, join_angle: float) -> Path:
    """Return the endless tour along a path and back again, with a turn at either end (m, rad)."""
    back, _ = turned_onto(path.end, path.reversed(), box, radius, join_angle)
    way = (*path.segments, *back)
    home = Path(path.start, way).end
    again, joined = turned_onto(home, path, box, radius, join_angle)
    turn = again[: len(again) - len(path.segments)]
    return Path(path.start, (*way, *turn), repeats_from=joined)


def turned_onto(
    end: Pose, path: Path, box: Box, radius: float, join_angle: float
) -> tuple[tuple[Segment, ...], float]:
    """Return the segments that turn from a pose onto a path and follow it to its end.

    The pose is where the path starts, heading more backwards than forwards.  The vehicle turns the
    shorter way (of two equal ones that which stays within the `box` about the survey) until it
    heads for the path's first straight at `join_angle` (rad), and turns onto it; also returned is
    how far along the path (m) that is.  A path without such a straight is entered at its very
    start, by a Dubins curve.
    """
    first = path.segments[0]
    yaw = end.yaw - path.start.yaw
    options = []
    if first.curvature == 0.0 and math.cos(yaw) < 0.0:
        for hand in (1.0, -1.0):
            turn, joined = turn_about(yaw, radius, join_angle, hand)
            if joined < first.length:
                overshoot = _beyond(Path(end, turn), box) - max(0.0, box.beyond(end.x, end.y))
                length = sum(segment.length for segment in turn) - joined
                options.append((round(length, 6), max(overshoot, 0.0), hand, turn, joined))
    if not options:
        return (*dubins_segments(end, path.start, radius), *path.segments), 0.0
    *_, turn, joined = min(options)
    rest = Segment(0.0, first.length - joined)
    return (*turn, rest, *path.segments[1:]), joined


def _beyond(path: Path, box: Box) -> float:
    """Return how far (m) a path leaves a box, negative within it."""
    reached = path.box
    return max(box.beyond(reached.x_max, reached.y_max), box.beyond(reached.x_min, reached.y_min))


def turn_about(
    yaw: float, radius: float, join_angle: float, hand: float
) -> tuple[tuple[Segment, Segment, Segment], float]:
    """Return the turn from heading `yaw` (rad) onto a line of heading 0, and where it joins (m).

    The vehicle begins on the line and turns towards +yaw (`hand` 1) or -yaw (-1) until it heads
    for the line at `join_angle`; it turns onto it `joined` metres ahead of where it began.

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
