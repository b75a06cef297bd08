"""How much of any survey the ASVs hear: exactly, cut up by which ASV is nearest (Voronoi cells).

Within the cell of an ASV no other is nearer, so that only its own range circle counts; and the
point farthest from it is a corner, for a distance is convex.
"""

import numpy as np
import shapely
from numpy.typing import NDArray

from .area import Area

Floats = NDArray[np.float64]

# Decimals of metres to which ASVs are told apart: bisectors of nearer ones are only rounding.
MICROMETRES = 6


def farthest_point(area: Area, places: Floats) -> tuple[float, float]:
    """Return the point x, y (m) of an area that is farthest from its nearest ASV.

    `places` (n, 2) in m.
    """
    rings = [(shapely.get_coordinates(cell), place) for cell, place in _cells(area, places)]
    corners = np.concatenate([ring for ring, _ in rings])
    apart = np.concatenate([np.hypot(*(ring - place).T) for ring, place in rings])
    x, y = corners[apart.argmax()].tolist()
    return x, y


def area_in_range(area: Area, places: Floats, reach: float) -> float:
    """Return how much (m2) of an area lies within a range (m) of an ASV."""
    found = 0.0
    for cell, place in _cells(area, places):
        for part in shapely.get_parts(cell):
            if part.geom_type == "Polygon":
                ring = shapely.get_coordinates(part.exterior) - place
                found += abs(_ring_in_range(ring, reach))
    return found


def _cells(area: Area, places: Floats) -> list[tuple[shapely.Geometry, Floats]]:
    """Return the part of an area that is nearest to each ASV, for those to which any is."""
    places = np.unique(np.round(places, MICROMETRES), axis=0)
    if len(places) == 1:
        return [(area.shape, places[0])]
    points = shapely.points(places)
    around = shapely.voronoi_polygons(shapely.multipoints(points), extend_to=area.shape)
    cells = shapely.get_parts(around)
    own = shapely.intersection(cells[shapely.STRtree(cells).nearest(points)], area.shape)
    return [(it, place) for it, place in zip(own, places, strict=True) if not it.is_empty]


def _ring_in_range(ring: Floats, reach: float) -> float:
    """Return the signed area (m2) of the disc about the origin inside a closed ring (n, 2), m.

    Each edge adds the triangle with the origin where it is within reach, and the sector of the disc
    that it cuts off where it is not.
    """
    start, step = ring[:-1], np.diff(ring, axis=0)
    length = np.hypot(*step.T)
    start, step, length = start[length > 0.0], step[length > 0.0], length[length > 0.0]
    if not len(start):
        return 0.0
    along = (start * step).sum(axis=1) / length  # from the foot of the perpendicular (m)
    away = _cross(start, step) / length
    half = np.sqrt(np.maximum(reach**2 - away**2, 0.0))
    first = np.clip(np.clip(-half, along, along + length) - along, 0.0, length)
    last = np.clip(np.clip(half, along, along + length) - along, 0.0, length)
    unit = step / length[:, None]
    enters, leaves = start + first[:, None] * unit, start + last[:, None] * unit
    triangles = _cross(enters, leaves) / 2.0
    sectors = reach**2 / 2.0 * (_angle(start, enters) + _angle(leaves, start + step))
    return float((triangles + sectors).sum())


def _cross(first: Floats, second: Floats) -> Floats:
    return np.asarray(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])


def _angle(first: Floats, second: Floats) -> Floats:
    """Return the signed angle (rad) from each vector to another, none where they are one."""
    return np.asarray(np.arctan2(_cross(first, second), (first * second).sum(axis=1)))
