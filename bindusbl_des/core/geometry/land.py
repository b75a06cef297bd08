"""Land, which no sound passes, and keep-outs, which no vehicle enters.

Polygons in the survey frame: x north, y east (m); land reaches down to the bottom.  Shores belong
to the water: a point on a shore is not on land, and a path along a shore does not cross it.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ...support.arrays import Flags, Floats
from ...support.facts import cached_property
from .area import Point, Rings, solid
from .crossing import crossing, holding

if TYPE_CHECKING:
    import shapely

# A point less than this (m) inside a shore is on the shore: rounding.
SHORE = 1e-6

# A path less than this (m) inside a shore runs along it; a vessel stops so far (m) off a shore.
ASHORE, OFF_SHORE = 1e-3, 1.0

# A disc is a polygon of four times so many corners.
QUARTER = 90


@dataclass(frozen=True)
class Land:
    """Polygons of land, each its outer ring and the rings of its lakes, x and y (m).

    >>> island = Land(((((10.0, -5.0), (20.0, -5.0), (20.0, 5.0), (10.0, 5.0)),),))
    >>> island.crossed([(0.0, 0.0)], [(30.0, 0.0), (30.0, 18.0), (0.0, 30.0)]).tolist()
    [[True, False, False]]
    """

    polygons: tuple[Rings, ...]

    @cached_property
    def shape(self) -> "shapely.Geometry":
        """The land as one shapely geometry."""
        return solid(self.polygons)

    @cached_property
    def edges(self) -> Floats:
        """The edges (n, 4), m, of the land shrunk by `SHORE`: x and y of both ends."""
        rings = [ring for polygon in self.within(SHORE).polygons for ring in polygon]
        sides = [np.hstack((corners, np.roll(corners, -1, axis=0))) for corners in rings]
        return np.concatenate([np.empty((0, 4)), *sides])

    def within(self, shore: float) -> "Land":
        """Return the part of the land that is more than `shore` (m) from the water.

        A path that crosses this part also crosses the land if its ends are wrong by up to `shore`.
        """
        import shapely

        return Land(_rings(shapely.buffer(self.shape, -shore, join_style="mitre")))

    @cached_property
    def outlines(self) -> tuple[Rings, ...]:
        """The polygons as a chart draws them, x and y (m): overlapping ones merged, outer rings and
        rings of lakes in opposite directions.
        """
        import shapely

        return _rings(shapely.normalize(self.shape))

    @property
    def undivided(self) -> list[list[Point]]:
        """The corners (m) of polygons without lakes that cover the land: lakes cut it up."""
        import shapely

        whole, parts = list(shapely.get_parts(self.shape)), []
        while whole:
            part = whole.pop()
            if not part.interiors:
                parts.append(list(map(tuple, part.exterior.coords[:-1])))
                continue
            x0, y0, x1, y1 = part.bounds
            cut = part.interiors[0].centroid.x
            halves = (shapely.box(x0, y0, cut, y1), shapely.box(cut, y0, x1, y1))
            whole += shapely.get_parts(shapely.intersection(part, halves)).tolist()
        return parts

    def crossed(self, here: ArrayLike, there: ArrayLike) -> Flags:
        """Tell whether the straight path between two positions crosses land, (n, m).

        `here` (n, 2 or more) and `there` (m, 2 or more) are in m; only x and y count.
        """
        return crossing(_rows(here), _rows(there), self.edges)

    def shadow(self, place: Point, reach: float) -> "shapely.Geometry":
        """Return land and water, within `reach` (m) of a position, where its sound does not arrive.

        The shadow of an edge is the area between the edge and its projection from the position to
        beyond the reach.
        """
        import shapely

        ends = self.edges.reshape(-1, 2, 2) - place
        along = ends[:, 1] - ends[:, 0]
        lengths = np.maximum(np.hypot(*along.T), SHORE)
        off = abs(ends[:, 0, 0] * along[:, 1] - ends[:, 0, 1] * along[:, 0]) / lengths
        near = off > SHORE  # an edge in line with the position hides nothing
        ends, stretched = ends[near], np.maximum(1.01 * reach / off[near], 1.0)
        behind = ends[:, ::-1] * stretched[:, None, None]
        hidden = shapely.polygons(np.concatenate((ends, behind), axis=1) + place)
        disc = shapely.Point(place).buffer(reach, quad_segs=QUARTER)
        return shapely.intersection(shapely.union_all([self.shape, *hidden]), disc)

    def seen(self, place: Point, reach: float) -> Floats:
        """Return the outline (n, 2), m, of the water within `reach` (m) that hears a position.

        The last corner repeats the first.  The outline of a position on land is empty (0, 2).
        """
        import shapely

        if self.holds([place])[0]:
            return np.empty((0, 2))
        disc = shapely.Point(place).buffer(reach, quad_segs=QUARTER)
        parts = shapely.get_parts(shapely.difference(disc, self.shadow(place, reach)))
        return np.asarray(shapely.get_coordinates(max(parts, key=shapely.area).exterior))

    def met(self, here: Point, there: Point) -> tuple[float, float]:
        """Return the distances (m) from `there`, towards `here`, at which land begins and ends.

        Raises ValueError where that line crosses no land.
        """
        import shapely

        ashore = shapely.intersection(self.shape, shapely.LineString([here, there]))
        ways = np.hypot(*(shapely.get_coordinates(ashore) - there).T)
        return float(ways.min()), float(ways.max())

    def along(self, places: Floats) -> tuple[float, float]:
        """Return the length (m) of a line over land, and the distance (m) along it to where land
        begins.

        The line leads through `places` (n, 2), in m.  Both are 0 for a line over water.
        """
        import shapely

        legs = shapely.linestrings(np.stack((places[:-1], places[1:]), axis=1))
        ground = shapely.buffer(self.shape, -ASHORE)
        shapely.prepare(ground)
        met = np.flatnonzero(shapely.intersects(ground, legs))
        over = shapely.intersection(legs[met], ground)
        if not (lengths := shapely.length(over)).any():
            return 0.0, 0.0
        first = int((lengths > 0.0).argmax())
        ends = shapely.get_coordinates(over[first]) - places[met[first]]
        begins = shapely.length(legs[: met[first]]).sum() + np.hypot(*ends.T).min()
        return float(lengths.sum()), float(begins)

    def stopped(self, here: Point, there: Point) -> Point:
        """Return the point (m) on the line from `here` to `there` where a vessel stops before land.

        A vessel on land stays where it is.
        """
        if not self.crossed([here], [there])[0, 0]:
            return there
        share = max(self.met(there, here)[0] - OFF_SHORE, 0.0) / math.dist(here, there)
        return here[0] + share * (there[0] - here[0]), here[1] + share * (there[1] - here[1])

    def afloat(self, place: Point) -> Point:
        """Return the point (m) nearest to a position that is at least `OFF_SHORE` off the land."""
        import shapely

        near = shapely.buffer(self.shape, OFF_SHORE)
        if not shapely.contains_xy(near, *place):
            return place
        edge = shapely.shortest_line(near.boundary, shapely.Point(place))
        x, y = shapely.get_coordinates(edge)[0].tolist()
        return x, y

    def holds(self, points: ArrayLike) -> Flags:
        """Tell which points (n, 2 or more), m, are on land, (n,)."""
        return holding(_rows(points), self.edges)

    def ashore(self, x: float, y: float) -> float:
        """Return the distance (m) from a position to the nearest water; 0 on the water."""
        import shapely

        if not self.holds([(x, y)])[0]:
            return 0.0
        return float(shapely.distance(self.shape.boundary, shapely.Point(x, y)))


def _rings(shape: "shapely.Geometry") -> tuple[Rings, ...]:
    """Return the polygons of a shape, each its outer ring and the rings of its holes (m)."""
    import shapely

    parts = [part for part in shapely.get_parts(shape) if not part.is_empty]
    rings = [shapely.get_rings(part) for part in parts]
    corners = [[shapely.get_coordinates(ring)[:-1].tolist() for ring in own] for own in rings]
    return tuple(tuple(tuple(map(tuple, ring)) for ring in own) for own in corners)


def _rows(points: ArrayLike) -> Floats:
    return np.ascontiguousarray(points, dtype=np.float64)
