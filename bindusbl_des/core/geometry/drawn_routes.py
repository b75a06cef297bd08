"""Paths that a vehicle can follow along a route drawn on a chart.

A drawn route has straight legs, and draws a turn as a corner or as many short legs.  The path
follows the legs and cuts corners by arcs where there is room, else by Dubins curves.  It may pass
beside points of short legs as long as it stays near them: to pass each point at its drawn heading,
which the vehicle may be slightly unable to reach, would cost a full circle.
"""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import shapely

from ...support.arrays import Floats
from .area import Point
from .paths import Path, Pose, dubins_segments

# Shares of the turning radius: how far the path may pass from a point of the route, and how close
# to a leg a point may lie to be left out.
NEAR, STRAIGHT = 0.1, 0.02

# The path may pass beside at most so many poses in a row.
BESIDE = 30

# Cost (m for each m beyond the allowed distance) of missing a point: more than any detour.
MISSED = 1e6


def along_route(points: Sequence[Point], radius: float) -> Path:
    """Return the path along a route's points (m), two or more, for a turning radius (m).

    Of all paths that join some of the poses of :func:`_poses` by Dubins curves, it is the shortest
    that stays within `NEAR` radii of the poses left out (dynamic programming).
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
    """Return points (m) without those that lie within `off` (m) of the simplified line."""
    line = shapely.LineString(points).simplify(off, preserve_topology=False)
    return [(float(x), float(y)) for x, y in line.coords]


def _poses(points: Sequence[Point], radius: float) -> list[Pose]:
    """Return the poses at which a vehicle may pass along legs between points (m).

    A corner with enough room has two: where its arc begins and ends.  A corner without has one,
    headed along the mean of both legs, weighted by the squares of their lengths.
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
    """Return the poses at which a vehicle may pass along legs between points (m), without ends."""
    return _poses(points, radius)[1:-1]


def _off(path: Path, places: Floats) -> float:
    """Return the largest distance (m) from positions (n, 2), m, to a path; 0 without any."""
    if not len(places):
        return 0.0
    way = shapely.LineString(path.line())
    return float(shapely.distance(way, shapely.points(places)).max())
