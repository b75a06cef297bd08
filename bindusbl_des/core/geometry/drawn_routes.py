"""Routes as they are drawn on charts, and the paths along them that a vehicle can go.

A chart has straight legs, and turns as corners or as many short legs.  The path follows legs, turns
inside corners where there is room, and elsewhere by Dubins curves; of short legs it need go over
none, as long as it stays near them: a point and a heading that are a little off what the vehicle
can turn would cost it a full circle.
"""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import shapely

from ...support.arrays import Floats
from .area import Point
from .paths import Path, Pose, dubins_segments

# Shares of the turning radius: how far a path may be from a point of its route, and how far points
# may lie off a leg on which they do not count.
NEAR, STRAIGHT = 0.1, 0.02

# So many points in a row may be passed beside.
BESIDE = 30

# What a point that is not passed nearby costs (m for each m): more than any way around.
MISSED = 1e6


def along_route(points: Sequence[Point], radius: float) -> Path:
    """Return the path along a route's points (m), two or more, for a turning radius (m).

    It is the shortest of those that go along the legs, from one to another of some of the poses
    below by Dubins curves, and stay within a tenth of the radius of the other points.
    """
    poses = _poses(_thinned(points, STRAIGHT * radius), radius)
    places = np.array([(pose.x, pose.y) for pose in poses])
    costs, paths = [0.0], [Path(poses[0], ())]
    for n in range(1, len(poses)):
        best, chosen = math.inf, paths[0]
        for before in range(n - 1, max(-1, n - 1 - BESIDE), -1):
            leg = Path(poses[before], dubins_segments(poses[before], poses[n], radius))
            if costs[before] + leg.length >= best:
                continue
            off = _off(leg, places[before + 1 : n])
            cost = costs[before] + leg.length + MISSED * max(off - NEAR * radius, 0.0)
            if cost < best:
                best, chosen = cost, Path(poses[0], (*paths[before].segments, *leg.segments))
        costs.append(best)
        paths.append(chosen)
    return paths[-1]


def _thinned(points: Sequence[Point], off: float) -> list[Point]:
    """Return points without those that lie within a distance (m) of the line through others."""
    line = shapely.LineString(points).simplify(off, preserve_topology=False)
    return [(float(x), float(y)) for x, y in line.coords]


def _poses(points: Sequence[Point], radius: float) -> list[Pose]:
    """Return where a vehicle may head how: at a corner with room where it begins and ends to turn,
    at others along the legs, the longer the more.
    """
    courses = [math.atan2(y - b, x - a) for (a, b), (x, y) in pairwise(points)]
    legs = [math.dist(one, following) for one, following in pairwise(points)]
    poses = [Pose(*points[0], courses[0])]
    for n in range(1, len(points) - 1):
        (x, y), into, out = points[n], courses[n - 1], courses[n]
        back = radius * math.tan(0.5 * abs(math.remainder(out - into, math.tau)))
        if 2.0 * back <= min(legs[n - 1], legs[n]):
            poses.append(Pose(x - back * math.cos(into), y - back * math.sin(into), into))
            poses.append(Pose(x + back * math.cos(out), y + back * math.sin(out), out))
            continue
        weights = ((into, legs[n - 1] ** 2), (out, legs[n] ** 2))
        north = sum(weight * math.cos(course) for course, weight in weights)
        east = sum(weight * math.sin(course) for course, weight in weights)
        poses.append(Pose(x, y, math.atan2(east, north)))
    return [*poses, Pose(*points[-1], courses[-1])]


def corner_poses(points: Sequence[Point], radius: float) -> list[Pose]:
    """Return where a vehicle may head how along a way (m) with the corners `points`, but at its
    ends.
    """
    return _poses(points, radius)[1:-1]


def _off(path: Path, places: Floats) -> float:
    """Return how far (m) the place (n, 2), m, is from a path that is the farthest from it."""
    if not len(places):
        return 0.0
    way = shapely.LineString(path.line())
    return float(shapely.distance(way, shapely.points(places)).max())
