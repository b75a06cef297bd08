"""Lines and rings on a chart that goes around the Earth: cut where they cross 180 degrees.

GeoJSON (RFC 7946, 3.1.9) asks for parts of which none crosses the antimeridian, and for exterior
rings that go counter-clockwise (3.1.6).  Positions are longitude and latitude (deg).
"""

import math
from itertools import pairwise

Position = tuple[float, float]
Positions = list[Position]


def counter_clockwise(ring: Positions) -> Positions:
    """Return a closed ring so that its area lies to the left.

    >>> counter_clockwise([(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (0.0, 0.0)])[1]
    (1.0, 1.0)
    """
    # The shoelace formula about the first position, so that no digit is lost to its size.
    along = _unwrapped(ring)
    x0, y0 = along[0]
    twice = sum(
        (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0) for (x1, y1), (x2, y2) in pairwise(along)
    )
    return ring[::-1] if twice < 0.0 else ring


def cut_line(line: Positions) -> list[Positions]:
    """Return a line in the parts that lie between -180 and 180 degrees.

    >>> cut_line([(179.0, 0.0), (-179.0, 2.0)])
    [[(179.0, 0.0), (180.0, 1.0)], [(-180.0, 1.0), (-179.0, 2.0)]]
    """
    parts = [line[:1]]
    for (lon1, lat1), (lon2, lat2) in pairwise(line):
        if abs(lon2 - lon1) > 180.0:  # the shorter way is over the antimeridian
            side = math.copysign(180.0, lon1)
            gone, left = side - lon1, lon2 + side  # to it, and beyond it (deg)
            share = gone / (gone + left) if gone + left else 0.0
            crossing = lat1 + share * (lat2 - lat1)
            if gone or len(parts[-1]) < 2:
                parts[-1].append((side, crossing))
            parts.append([(-side, crossing)])
        parts[-1].append((lon2, lat2))
    return parts


def cut_ring(ring: Positions) -> list[Positions]:
    """Return a closed ring, counter-clockwise, as those of the parts east and west of 180 degrees.

    >>> [len(part) for part in cut_ring([(179., 0.), (-179., 0.), (-179., 1.), (179., 0.)])]
    [4, 5]
    """
    along = _unwrapped(ring)
    if all(abs(lon) <= 180.0 for lon, _ in along):
        return [ring]
    from shapely import Polygon, box  # which other charts do not need

    whole, cut = Polygon(along), []
    for turn in (-360.0, 0.0, 360.0):
        part = whole.intersection(box(turn - 180.0, -90.0, turn + 180.0, 90.0))
        for piece in getattr(part, "geoms", [part]):
            if piece.geom_type == "Polygon" and not piece.is_empty:
                corners = [(lon - turn, lat) for lon, lat in piece.exterior.coords]
                cut.append(counter_clockwise(corners))
    return cut


def _unwrapped(line: Positions) -> Positions:
    """Return a line whose longitudes go on beyond 180 degrees."""
    turn, found = 0.0, line[:1]
    for (before, _), (lon, lat) in pairwise(line):
        if abs(lon - before) > 180.0:
            turn += math.copysign(360.0, before)
        found.append((lon + turn, lat))
    return found
