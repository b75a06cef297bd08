"""The area to be surveyed: a square, a rectangle of any heading, or a simple polygon.

Survey frame: x north, y east (m); angles turn from +x towards +y.  Rectangles are computed in
closed form; all other polygons by shapely, which is imported only when such an area is used.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from ...support.facts import cached_property

if TYPE_CHECKING:
    import numpy as np
    import shapely
    from numpy.typing import ArrayLike, NDArray

Point = tuple[float, float]
# A polygon: its outer ring, then the rings of its holes, x and y (m).
Rings = tuple[tuple[Point, ...], ...]

# A polygon narrower or smaller than this (m, m2) is a mistake: repeated points, or degrees.
LEAST_ACROSS, LEAST_AREA = 0.1, 0.01

# An area that enters a band by less than this share of its width only touches it: rounding.
TOUCHING = 1e-6

# Rectangles whose areas differ by less than this share are equal: rounding.
EQUAL = 1e-9


class Box(NamedTuple):
    """An axis-aligned bounding box (m)."""

    x_min: float
    y_min: float
    x_max: float
    y_max: float

    def beyond(self, x: float, y: float) -> float:
        """Return how far (m) a point lies outside the box along the worse axis; negative inside.

        >>> Box(-30.0, -30.0, 30.0, 30.0).beyond(0.0, 40.0)
        10.0
        """
        middle_x, middle_y = (self.x_min + self.x_max) / 2, (self.y_min + self.y_max) / 2
        out_x = abs(x - middle_x) - (self.x_max - middle_x)
        out_y = abs(y - middle_y) - (self.y_max - middle_y)
        return max(out_x, out_y)


def bounds(points: Sequence[Point]) -> Box:
    """Return the bounding box of points (m).

    >>> bounds([(0.0, 1.0), (2.0, -1.0)])
    Box(x_min=0.0, y_min=-1.0, x_max=2.0, y_max=1.0)
    """
    x, y = zip(*points, strict=True)
    return Box(min(x), min(y), max(x), max(y))


def turned(point: Point, angle: float) -> Point:
    """Return a point rotated about the origin by an angle (rad); by 0 it is the same to the bit."""
    if angle == 0.0:
        return point
    cosine, sine = math.cos(angle), math.sin(angle)
    return point[0] * cosine - point[1] * sine, point[0] * sine + point[1] * cosine


@dataclass(frozen=True)
class Area:
    """A simple polygon: corners (m) in its own frame, which is turned by an angle (rad).

    :func:`rectangle` and :func:`polygon` make areas.  A rectangle's own frame lies along its sides,
    so that a plan made in it does not depend on `turn`.  `closed` holds polygons of the own frame,
    land or keep-outs, that no vehicle enters; an area with any counts as a polygon, not as a
    rectangle.

    >>> rectangle(300.0, 200.0).square_m, polygon([(0, 0), (60, 0), (0, 80)]).square_m
    (60000.0, 2400.0)
    """

    corners: tuple[Point, ...]
    turn: float
    is_rectangle: bool
    closed: tuple[Rings, ...] = ()

    @cached_property
    def outline(self) -> tuple[Point, ...]:
        """The corners (m) of the whole area in the survey frame, each once; ignores `closed`."""
        return tuple(turned(corner, self.turn) for corner in self.corners)

    @property
    def open_corners(self) -> "Sequence[Point] | NDArray[np.float64]":
        """The corners (m) of the open part, those of its holes too; some more than once."""
        if not self.closed:
            return self.outline
        import shapely

        corners: NDArray[np.float64] = shapely.get_coordinates(self.shape)
        return corners

    @cached_property
    def box(self) -> Box:
        """The bounding box of the open part in the survey frame."""
        return Box(*self.shape.bounds) if self.closed else bounds(self.outline)

    @property
    def side(self) -> float | None:
        """The side (m) of an unturned square about the origin with nothing closed; else None."""
        box = bounds(self.corners)
        is_square = box.x_max == box.y_max == -box.x_min == -box.y_min
        return 2 * box.x_max if self.is_rectangle and is_square and self.turn == 0.0 else None

    @property
    def square_m(self) -> float:
        """The open area (m2): closed polygons do not count."""
        return float(self.shape.area) if self.closed else _moments(self.outline)[0]

    @cached_property
    def centroid(self) -> Point:
        """The centroid of the outline, x and y (m); the origin for a rectangle."""
        return (0.0, 0.0) if self.is_rectangle else _moments(self.outline)[1]

    @cached_property
    def across(self) -> float:
        """The longer side (m) of the smallest enclosing rectangle, of any heading."""
        if self.is_rectangle:
            box = bounds(self.corners)
            return max(box.x_max - box.x_min, box.y_max - box.y_min)
        import shapely

        return max(_sides(shapely.Polygon(self.outline)))

    @property
    def farthest(self) -> float:
        """The distance (m) of the farthest corner from the origin."""
        return max(math.hypot(*corner) for corner in self.corners)

    @property
    def words(self) -> str:
        """The size and shape in words, for messages."""
        if not self.is_rectangle:
            without = " without land or water where nobody goes" if self.closed else ""
            corners = len(self.corners)
            return f"{plain_area(self.square_m)}, a polygon of {corners} corners{without}"
        box = bounds(self.corners)
        size_x, size_y = box.x_max - box.x_min, box.y_max - box.y_min
        sides = f"{size_x:g} m" if size_x == size_y else f"{size_x:g} m by {size_y:g} m"
        return f"{sides}, turned by {math.degrees(self.turn):g} deg" if self.turn else sides

    @cached_property
    def closed_shape(self) -> "shapely.Geometry":
        """The closed polygons as one shapely geometry in the survey frame."""
        return solid(_turned(self.closed, self.turn))

    @property
    def is_convex(self) -> bool:
        """Whether the straight line between any two points of the open area stays inside it."""
        return self.is_rectangle or self.shape.area >= self.shape.convex_hull.area * (1.0 - EQUAL)

    @cached_property
    def shape(self) -> "shapely.Geometry":
        """The open area as a shapely geometry in the survey frame."""
        import shapely

        whole = shapely.Polygon(self.outline)
        if not self.closed:
            return whole
        left = shapely.difference(whole, self.closed_shape)
        parts = [part for part in shapely.get_parts(left) if part.geom_type == "Polygon"]
        return shapely.union_all(parts)  # without the points and lines of mere contact

    def along(self, heading: float) -> "Area":
        """Return the area in a frame whose x axis has a heading (rad).

        >>> rectangle(30.0, 20.0, math.radians(70.0)).along(math.radians(70.0)).box
        Box(x_min=-15.0, y_min=-10.0, x_max=15.0, y_max=10.0)
        """
        if heading == self.turn:
            return Area(self.corners, 0.0, self.is_rectangle, self.closed)
        corners = tuple(turned(corner, self.turn - heading) for corner in self.corners)
        return Area(corners, 0.0, False, _turned(self.closed, self.turn - heading))

    def without(self, closed: tuple[Rings, ...]) -> "Area":
        """Return the area with further polygons (survey frame) closed.

        Raises:
            ValueError: when nothing of the area stays open.
        """
        found = Area(self.corners, self.turn, False, _turned(closed, -self.turn))
        if found.shape.area < LEAST_AREA:
            raise ValueError(
                "land, and water where nobody goes, cover all of it; is their place right?"
            )
        return found

    def beyond(self, x: float, y: float) -> float:
        """Return how far (m) a point lies outside the area; 0 or less inside.

        For a rectangle this is :meth:`Box.beyond`, in its own frame.
        """
        if self.is_rectangle:
            return bounds(self.corners).beyond(*turned((x, y), -self.turn))
        import shapely

        return float(shapely.distance(self.shape, shapely.Point(x, y)))

    def contains(self, points: "ArrayLike") -> "NDArray[np.bool_]":
        """Tell which points (n, 2), m, lie inside or on the edge; shape (n,)."""
        import numpy as np

        x, y = np.asarray(points, dtype=np.float64).T
        if self.side is not None:
            return np.asarray(np.maximum(abs(x), abs(y)) <= self.side / 2)
        import shapely

        return np.asarray(shapely.intersects_xy(self.shape, x, y))

    def spans(self, edges: Sequence[Point]) -> list[Point]:
        """Return the x interval (m) that the area occupies in each band of y, a pair of edges (m).

        Raises ValueError for a band outside the area.

        >>> polygon([(0, 0), (60, 0), (60, 20), (0, 20)]).spans([(0.0, 10.0)])
        [(0.0, 60.0)]
        """
        if self.is_rectangle and self.turn == 0.0:
            return [(self.box.x_min, self.box.x_max)] * len(edges)
        import numpy as np
        import shapely

        lower, upper = np.array(edges).T
        inset = TOUCHING * (upper - lower)  # an edge along a band's edge is not within it
        bands = shapely.box(
            self.box.x_min - 1.0, lower + inset, self.box.x_max + 1.0, upper - inset
        )
        left, _, right, _ = shapely.bounds(shapely.intersection(self.shape, bands)).T
        if np.isnan(left).any():
            raise ValueError("a band of y lies outside the survey; use bands within its bounds")
        return list(zip(left.tolist(), right.tolist(), strict=True))


def solid(polygons: Sequence[Rings]) -> "shapely.Geometry":
    """Return polygons with their holes as one shapely geometry."""
    import shapely

    return shapely.union_all([shapely.Polygon(outer, holes) for outer, *holes in polygons])


def _turned(polygons: tuple[Rings, ...], angle: float) -> tuple[Rings, ...]:
    """Return polygons rotated about the origin by an angle (rad)."""
    return tuple(
        tuple(tuple(turned(corner, angle) for corner in ring) for ring in rings)
        for rings in polygons
    )


def plain_area(square_m: float) -> str:
    """Return an area (m2) as text with its unit.

    >>> plain_area(45_000.0), plain_area(12.25)
    ('45,000 m2', '12.2 m2')
    """
    return f"{square_m:,.0f} m2" if square_m >= 1000.0 else f"{square_m:.3g} m2"


def vertices(count: int, radius: float, angle_rad: float) -> list[Point]:
    """Return the vertices (m) of a regular polygon about the origin; a single one is the origin.

    The first lies at `angle_rad` from +x towards +y, the others follow in that sense of rotation.

    >>> [(round(x), round(y)) for x, y in vertices(4, 50.0, 0.0)]
    [(50, 0), (0, 50), (-50, 0), (0, -50)]
    """
    if count == 1:
        return [(0.0, 0.0)]
    angles = [angle_rad + 2.0 * math.pi * number / count for number in range(count)]
    return [(radius * math.cos(angle), radius * math.sin(angle)) for angle in angles]


def rectangle(size_x: float, size_y: float, turn: float = 0.0) -> Area:
    """Return the rectangle of two sides (m) about the origin, rotated by an angle (rad)."""
    x, y = size_x / 2, size_y / 2
    return Area(((x, y), (x, -y), (-x, -y), (-x, y)), turn, True)


def polygon(corners: Sequence[Point]) -> Area:
    """Return the polygon of corners (m); the last may repeat the first.

    Raises:
        ValueError: when there are fewer than three corners, edges cross, or the area is too small.
    """
    points = [(float(x), float(y)) for x, y in corners]
    if len(points) > 1 and points[0] == points[-1]:
        points.pop()
    if len(points) < 3:
        raise ValueError(f"needs at least three corners that differ; got {len(points)}")
    import shapely

    shape = shapely.Polygon(points)
    if not shape.is_valid:
        where = shapely.is_valid_reason(shape).rpartition("[")[2].rstrip("]").replace(" ", ", ")
        raise ValueError(f"crosses or touches itself at ({where}); give its corners going round")
    if shape.area < LEAST_AREA or min(_sides(shape)) < LEAST_ACROSS:
        raise ValueError(
            f"encloses {shape.area:.2g} m2, no area to be surveyed; are its corners in metres?"
        )
    return Area(tuple(points), 0.0, False)


def _sides(shape: "shapely.Polygon") -> tuple[float, float]:
    """Return the sides (m) of the smallest rectangle around a shape; among equal ones the longest.

    One side of it lies along an edge of the convex hull.  About a triangle, all three are equal.
    """
    import numpy as np
    import shapely

    hull = shapely.get_coordinates(shape.convex_hull)
    steps = np.diff(hull, axis=0)
    along = steps / np.hypot(*steps.T)[:, np.newaxis]
    across = np.column_stack((-along[:, 1], along[:, 0]))
    sides = np.stack([np.ptp((hull - hull[0]) @ axes.T, axis=0) for axes in (along, across)])
    square, longer = sides.prod(axis=0), sides.max(axis=0)
    least = square <= square.min() * (1.0 + EQUAL)
    one, other = sides[:, np.where(least, longer, 0.0).argmax()].tolist()
    return one, other


def _moments(points: Sequence[Point]) -> tuple[float, Point]:
    """Return the area (m2) and centroid (m) of a simple polygon, by the shoelace formula.

    Coordinates are taken from the first corner, so that surveys far from the origin keep their
    digits.
    """
    x0, y0 = points[0]
    twice = first_x = first_y = 0.0
    for (ax, ay), (bx, by) in zip(points, [*points[1:], points[0]], strict=True):
        ax, ay, bx, by = ax - x0, ay - y0, bx - x0, by - y0
        cross = ax * by - bx * ay
        twice += cross
        first_x += (ax + bx) * cross
        first_y += (ay + by) * cross
    return abs(twice) / 2, (x0 + first_x / (3 * twice), y0 + first_y / (3 * twice))
