"""Detours round land: shortest paths between two positions on the water, and curves that stay on
it.

A detour keeps as far off corners of land as the turning radius, so that the vehicle can turn round
them: the shortest one runs along a visibility graph.  Where a position or another shore is closer,
the detour keeps less far off.
"""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

import networkx as nx
import numpy as np
import shapely

from ...support.facts import cached_property
from .area import Area, Point
from .drawn_routes import corner_poses
from .paths import Path, Pose, Segment, dubins_curves

# Distances off land (turning radii) at which detours are searched, in this order.
OFF = (1.0, 0.5, 0.2, 0.0)

# Sides of a quarter turn round a corner; and by how much (turning radii) a coast may be simplified.
QUARTER, STRAIGHTER = 8, 0.05

# A path may be on land by so little (m): rounding.
TOUCHES = 1e-6

# A coast with more corners than this is simplified further.
MOST_CORNERS = 400

# How much (turning radii) sooner an AUV leaves a lane, and later it joins the next one, where there
# is no room to turn between their ends.
SOONER = (0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0)

# No detour leads farther (m) from an area.
FARTHEST = 1e6

# How far (turning radii) turns may leave an area that its paths should stay inside.
BEYOND = 2.5


class Water:
    """The regions of water in which a vehicle of a turning radius (m) may go, the preferred first.

    The last, `sea`, holds all the water.  Planners use the first region in which a path exists.
    """

    def __init__(self, rooms: Sequence[shapely.Geometry], radius: float) -> None:
        self.radius, self.rooms = radius, [WaterRegion(room, radius) for room in rooms]
        self.sea = self.rooms[-1]


class WaterRegion:
    """A region of water (shapely) in which a vehicle of a turning radius (m) is to stay."""

    def __init__(self, room: shapely.Geometry, radius: float) -> None:
        self.room, self.radius = room, radius
        self._open = shapely.buffer(room, TOUCHES)
        shapely.prepare(self._open)

    def afloat(self, place: Point) -> bool:
        """Tell whether a position (m) is in the region."""
        return bool(shapely.covers(self._open, shapely.Point(place)))

    def holds(self, path: Path) -> bool:
        """Tell whether a path stays in the region."""
        return bool(shapely.covers(self._open, shapely.LineString(path.line())))

    def curve(self, start: Pose, end: Pose) -> tuple[Segment, ...] | None:
        """Return the shortest Dubins curve between poses that stays in the region, or None."""
        for curve in dubins_curves(start, end, self.radius):
            if self.holds(Path(start, curve)):
                return curve
        return None

    def joined(self, start: Pose, end: Pose) -> tuple[Segment, ...] | None:
        """Return the shortest curve in the region between poses, direct or round land, or None."""
        direct = self.curve(start, end)
        straight = math.hypot(end.x - start.x, end.y - start.y)
        if direct is not None and length_of(direct) < straight + 2.0 * math.pi * self.radius:
            return direct
        found = [] if direct is None else [direct]
        for corners in self.around((start.x, start.y), (end.x, end.y)):
            poses = [start, *corner_poses(corners, self.radius), end]
            legs = [self.curve(one, other) for one, other in pairwise(poses)]
            if all(leg is not None for leg in legs):
                found.append(tuple(segment for leg in legs for segment in leg or ()))
                break
        return min(found, key=length_of, default=None)

    def around(self, start: Point, end: Point) -> Iterator[list[Point]]:
        """Yield detours between two positions (m) as corners, the one farthest off land first."""
        for off in OFF:
            if (way := self._sought(start, end, off * self.radius)) is not None:
                yield way

    def _sought(self, start: Point, end: Point, off: float) -> list[Point] | None:
        """Return the corners (m) of the shortest detour `off` (m) off land; None without one."""
        within, corners, graph = self._graph(off)
        ends, places = np.array([start, end]), np.vstack((corners, [start, end]))
        for number, place in enumerate(ends):
            lines = shapely.linestrings(np.stack(np.broadcast_arrays(place[None], places), axis=1))
            # a detour that begins near land leaves it first, at whatever distance
            free = shapely.covers(within if off == 0.0 else self._open, lines)
            for other in np.flatnonzero(free).tolist():
                away = float(math.dist(place, places[other]))
                graph.add_edge(len(corners) + number, other, weight=away)
        try:
            found = nx.dijkstra_path(graph, len(corners), len(corners) + 1)
        except (nx.NetworkXNoPath, nx.NodeNotFound):
            return None
        finally:
            graph.remove_nodes_from([len(corners), len(corners) + 1])
        return [(float(x), float(y)) for x, y in places[found]]

    @cached_property
    def _graphs(self) -> "dict[float, tuple[shapely.Geometry, np.ndarray, nx.Graph[int]]]":
        return {}

    def _graph(self, off: float) -> "tuple[shapely.Geometry, np.ndarray, nx.Graph[int]]":
        """Return the region `off` (m) off land, its corners (n, 2), m, and their visibility graph.

        An edge joins two corners with a clear line between them; its weight is its length (m).
        """
        if off not in self._graphs:
            round_it = off / math.cos(math.pi / 4.0 / QUARTER)  # its sides touch the circle
            room, finely = shapely.buffer(self.room, -round_it, quad_segs=QUARTER), STRAIGHTER
            corners = _corners(room)
            while len(corners) > MOST_CORNERS:
                corners = _corners(shapely.simplify(room, finely * self.radius))
                finely *= 2.0
            within = shapely.buffer(room, max(TOUCHES, 2.0 * finely * self.radius * (off > 0.0)))
            shapely.prepare(within)
            graph: nx.Graph[int] = nx.Graph()
            one, other = np.triu_indices(len(corners), 1)
            lines = shapely.linestrings(np.stack((corners[one], corners[other]), axis=1))
            seen = shapely.covers(within, lines)
            apart = shapely.length(lines)
            graph.add_weighted_edges_from(
                zip(one[seen].tolist(), other[seen].tolist(), apart[seen].tolist(), strict=True)
            )
            self._graphs[off] = within, corners, graph
        return self._graphs[off]


def _corners(room: shapely.Geometry) -> "np.ndarray":
    """Return a region's corners (n, 2), m, at which detours may turn: convex corners of land."""
    found = [np.empty((0, 2))]
    for part in shapely.get_parts(room):
        if part.is_empty:
            continue
        for number, ring in enumerate(shapely.get_rings(part)):
            at = shapely.get_coordinates(ring)[:-1]
            if shapely.is_ccw(ring) != (number == 0):  # so that the room is on the left
                at = at[::-1]
            into, out = at - np.roll(at, 1, axis=0), np.roll(at, -1, axis=0) - at
            found.append(at[into[:, 0] * out[:, 1] - into[:, 1] * out[:, 0] < 0.0])
    return np.concatenate(found)


def length_of(segments: Sequence[Segment]) -> float:
    """Return the total length (m) of segments."""
    return sum(segment.length for segment in segments)


def water_of(area: Area, radius: float, *, inside: bool) -> Water:
    """Return the water in an area's frame for a turning radius (m): everything that is not closed.

    If vehicles are to stay `inside` the area, they leave it only where there is no room to turn: at
    first by `BEYOND` radii, at last without limit.
    """
    (x, y), wide = area.centroid, FARTHEST
    sea = shapely.difference(shapely.box(x - wide, y - wide, x + wide, y + wide), area.closed_shape)
    if not inside:
        return Water((sea,), radius)
    near = shapely.intersection(shapely.buffer(area.shape, BEYOND * radius), sea)
    return Water((area.shape, near, sea), radius)
