"""How much of the survey the ASVs can hear: exactly, by geometry, not on a grid.

The survey is an :class:`.area.Area`, or a square given by its side, with its middle at the origin
and its edges at x, y = +-side/2.  What is not such a square is cut up by which ASV is nearest
(Voronoi cells): within the cell of an ASV only its own range circle counts, and the point farthest
from it is a corner, for a distance is convex.  An ASV hears what lies within `hf_range` of it, the
edge included.  Distances here are horizontal: for a slant range R and AUVs at depth z take
sqrt(R^2 - z^2).
"""

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from ..core.arrays import Flags, Floats
from .area import Area, rectangle
from .formation import stations

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
    return [(part, place) for part, place in zip(own, places, strict=True) if not part.is_empty]


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


# What a cell of the map shows: heard by no ASV, by one, by two or more, and a station that
# digits cannot name; and what is outside the survey.
UNCOVERED, ONCE, SEVERAL, STATION, OUTSIDE = ".", "o", "#", "*", " "

# ASVs whose distances to all points are worked out at a time.
BLOCK = 200

# A character of a terminal is about twice as high as it is wide.
CHARACTER_HEIGHT = 2.0


def covering_radius(survey: Area | float, asvs: ArrayLike) -> float:
    """Return the distance (m) from the loneliest point of the survey to its nearest ASV.

    The survey is fully covered exactly if the HF range is not below this.  The loneliest point is
    a corner, a point of the edge as far from two ASVs, or an inner point as far from three.
    `survey` is an area, or the side of a square in m, `asvs` of shape (n, 2) in m; for a square the
    work grows with n^4, 50 ASVs take a moment.
    Raises ValueError for a side that is not positive and as :func:`.formation.stations` does.
    Source: physics of eq. coverage, whose corners alone are not enough.

    >>> round(covering_radius(60.0, [(50.0, 0.0), (-50.0, 0.0)]), 3)
    58.31
    """
    places = np.unique(stations(asvs), axis=0)
    return float(_distances(np.array(loneliest_point(survey, places)), places).min())


def loneliest_point(survey: Area | float, asvs: ArrayLike) -> tuple[float, float]:
    """Return the point x, y (m) of the survey that is farthest from its nearest ASV.

    Arguments and errors are those of :func:`covering_radius`; the first of points that are equally
    far.

    >>> loneliest_point(60.0, [(50.0, 0.0), (-50.0, 0.0)])
    (0.0, -30.0)
    """
    side, places = _side(survey), np.unique(stations(asvs), axis=0)
    if isinstance(survey, Area) and side is None:
        return farthest_point(survey, places)
    half = _half(side)
    corners = half * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    candidates = np.concatenate((corners, _edge_ties(half, places), _centres(half, places)))
    x, y = candidates[_distances(candidates, places).min(axis=1).argmax()].tolist()
    return x, y


def _edge_ties(half: float, places: Floats) -> Floats:
    """Return the points (m, 2) of the square's edge as far from one ASV as from another."""
    first, second = np.triu_indices(len(places), k=1)
    apart, middle = places[second] - places[first], (places[second] + places[first]) / 2.0
    found = []
    for fixed, free in ((0, 1), (1, 0)):  # edges of constant x, then of constant y
        for edge in (-half, half):
            slanted = apart[:, free] != 0.0
            step, centre = apart[slanted], middle[slanted]
            # A bisector almost along the edge meets it too far away to count.
            with np.errstate(over="ignore", invalid="ignore"):
                away = (edge - centre[:, fixed]) * (step[:, fixed] / step[:, free])
            along = centre[:, free] - away
            points = np.full((len(along), 2), edge)
            points[:, free] = along
            found.append(points[np.abs(along) <= half])
    return np.concatenate(found)


def _centres(half: float, places: Floats) -> Floats:
    """Return the points (m, 2) inside the square that are as far from each of three ASVs."""
    triples = np.array(list(combinations(range(len(places)), 3)), dtype=np.intp).reshape(-1, 3)
    origin = places[triples[:, 0]]
    (bx, by), (cx, cy) = (places[triples[:, 1]] - origin).T, (places[triples[:, 2]] - origin).T
    twice_area = bx * cy - by * cx
    b_square, c_square = bx**2 + by**2, cx**2 + cy**2
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # three in a row: no centre
        x = (cy * b_square - by * c_square) / (2.0 * twice_area)
        y = (bx * c_square - cx * b_square) / (2.0 * twice_area)
    centres = origin + np.column_stack((x, y))
    inside: Flags = (np.abs(centres) <= half).all(axis=1)  # false for what is not a number
    kept: Floats = centres[inside]
    return kept


def covered_area(survey: Area | float, asvs: ArrayLike, hf_range: float) -> float:
    """Return the fraction of the survey within HF range of at least one ASV, in [0, 1].

    Exact up to rounding: the area is the integral of (x dy - y dx) / 2 around the covered region,
    whose boundary is made of arcs of the range circles and pieces of the survey's edge (Green).
    `survey` is an area, or the side of a square in m, `hf_range` in m, `asvs` of shape
    (n, 2) in m.  Raises ValueError for a side that is not positive, a range that is negative or not
    finite, and as :func:`.formation.stations` does.

    >>> round(covered_area(60.0, [(50.0, 0.0), (-50.0, 0.0)], 50.0), 4)
    0.8938
    """
    reach = _reach(hf_range)
    side, places = _side(survey), np.unique(stations(asvs), axis=0)
    if isinstance(survey, Area) and side is None:
        return min(max(area_in_range(survey, places, reach) / survey.square_m, 0.0), 1.0)
    half = _half(side)
    arcs = math.fsum(_arc_integral(half, places, number, reach) for number in range(len(places)))
    edges = half / 2.0 * _covered_edge(half, places, reach)  # x dy - y dx = side / 2 along an edge
    return min(max((arcs + edges) / (2 * half) ** 2, 0.0), 1.0)


def _arc_integral(half: float, places: Floats, number: int, reach: float) -> float:
    """Return the integral along what one circle adds to the boundary, counter-clockwise (m2)."""
    x, y = places[number]
    bearing, opening = _hidden_arcs(half, places, number, reach)
    lower, upper = _wrapped(bearing - opening), _wrapped(bearing + opening)
    angles = np.concatenate(([-np.pi], np.sort(np.concatenate((lower, upper))), [np.pi]))
    start, end = angles[:-1], angles[1:]
    shown = _times_hidden((start + end) / 2.0, lower, upper, opening) == 0
    start, end = start[shown], end[shown]
    swept = x * (np.sin(end) - np.sin(start)) - y * (np.cos(end) - np.cos(start))
    return reach / 2.0 * float(np.sum(reach * (end - start) + swept))


def _times_hidden(
    angles: Floats, lower: Floats, upper: Floats, opening: Floats
) -> NDArray[np.intp]:
    """Return in how many arcs each angle (rad) lies: those begun below it less those ended.

    Arcs across +-pi count as begun before; one all around begins where it ends.
    """
    across = (lower > upper) | ((lower == upper) & (opening > 1.0))
    begun = np.searchsorted(np.sort(lower), angles, side="right")
    ended = np.searchsorted(np.sort(upper), angles, side="left")
    return begun - ended + np.count_nonzero(across)


def _hidden_arcs(half: float, places: Floats, number: int, reach: float) -> tuple[Floats, Floats]:
    """Return the middle and half width (rad) of each arc of a circle that is no boundary.

    Each lies beyond a straight line: the chord shared with another circle, or an edge.  Angles,
    unlike distances, tell the sides apart even where circles touch an edge or all but coincide.
    """
    x, y = places[number]
    others = np.delete(places, number, axis=0) - places[number]
    bearing = np.arctan2(others[:, 1], others[:, 0])
    chords = np.hypot(others[:, 0], others[:, 1]) / 2.0
    edges = (half - x, half + x, half - y, half + y)
    away = np.clip(np.concatenate((chords, edges)), -reach, reach)
    opening = np.arctan2(np.sqrt((reach - away) * (reach + away)), away)
    return np.concatenate((bearing, (0.0, np.pi, np.pi / 2.0, -np.pi / 2.0))), opening


def _wrapped(angles: Floats) -> Floats:
    """Return angles (rad) in [-pi, pi)."""
    return np.remainder(angles + np.pi, 2.0 * np.pi) - np.pi


def _covered_edge(half: float, places: Floats, reach: float) -> float:
    """Return how much of the square's edge is in range of an ASV (m)."""
    covered = 0.0
    for fixed, free in ((0, 1), (1, 0)):
        for edge in (-half, half):
            away = np.abs(places[:, fixed] - edge)
            chord = np.sqrt(np.maximum(reach - away, 0.0) * (reach + away))
            lower, upper = places[:, free] - chord, places[:, free] + chord
            covered += _union_length(np.clip(lower, -half, half), np.clip(upper, -half, half))
    return covered


def _union_length(lower: Floats, upper: Floats) -> float:
    """Return the length that intervals cover together, overlaps counted once."""
    order = np.argsort(lower)
    lower, upper = lower[order], np.maximum.accumulate(upper[order])
    before = np.concatenate(([-np.inf], upper[:-1]))
    return float(np.maximum(upper - np.maximum(lower, before), 0.0).sum())


def is_covered(points: ArrayLike, asvs: ArrayLike, hf_range: float) -> Flags:
    """Tell of each point whether it is within HF range of at least one ASV; the edge counts.

    `points` of shape (..., 2) and `asvs` of shape (n, 2) in m; the answer has the shape (...).
    Raises ValueError for points without two coordinates, a range that is negative or not finite,
    and as :func:`.formation.stations` does.

    >>> is_covered([(0.0, 0.0), (30.0, 40.0)], [(80.0, 0.0)], 80.0).tolist()
    [True, True]
    """
    return _heard_by(points, asvs, [(0.0, _reach(hf_range))]) > 0


def covered_by_rings(area: Area, asvs: ArrayLike, rings: Sequence[tuple[float, float]]) -> float:
    """Return the fraction of an area between whose distances (m) from an ASV, of pairs in `rings`,
    it lies: exact for one circle, else for polygons of 360 corners instead of circles.
    """
    if len(rings) == 1 and rings[0][0] == 0.0:
        return covered_area(area, asvs, rings[0][1])
    places = shapely.points(stations(asvs))
    heard = [
        shapely.difference(*(shapely.buffer(places, edge, quad_segs=90) for edge in (end, begin)))
        for begin, end in rings
    ]
    inside = shapely.intersection(shapely.union_all(heard), area.shape)
    return float(shapely.area(inside)) / area.square_m


def coverage_map(
    survey: Area | float,
    asvs: ArrayLike,
    heard_between: float | Sequence[tuple[float, float]],
    columns: int = 48,
) -> list[str]:
    """Return the survey as lines of text: what no ASV, one ASV or several ASVs hear: up to a range
    (m), or between the distances of pairs.

    North (x) is up, east (y) to the right.  A cell shows its middle: '.' heard by none, 'o' by one,
    '#' by several, ' ' outside the survey; ASVs within its bounds appear as their number, '*' from
    the eleventh on and where they share a cell.  `columns` characters wide, of a square half as
    many lines.  Raises ValueError for less than one column and as :func:`covered_area` does.

    >>> for line in coverage_map(140.0, [(0.0, 0.0), (50.0, 0.0)], 40.0, columns=20):
    ...     print(f"|{line}|")
    |.....oooooooooo.....|
    |....oooooo1ooooo....|
    |.....oo######oo.....|
    |.....o########o.....|
    |....oooooooooooo....|
    |....oooooo0ooooo....|
    |.....oooooooooo.....|
    |.......oooooo.......|
    |....................|
    |....................|
    """
    area = survey if isinstance(survey, Area) else rectangle(2 * _half(survey), 2 * _half(survey))
    if columns < 1:
        raise ValueError(f"a map must have at least one column; met {columns}; 48 suit a terminal")
    box = area.box
    high, wide = box.x_max - box.x_min, box.y_max - box.y_min
    rows = max(1, round(columns / CHARACTER_HEIGHT * high / wide))
    x = box.x_max - high * (np.arange(rows) + 0.5) / rows
    y = box.y_min + wide * (np.arange(columns) + 0.5) / columns
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
    if isinstance(heard_between, int | float):
        heard_between = [(0.0, _reach(heard_between))]
    heard = _heard_by(points, asvs, heard_between)
    heard[~area.contains(points.reshape(-1, 2)).reshape(heard.shape)] = -1
    signs = (UNCOVERED, ONCE, SEVERAL, OUTSIDE)
    cells = [[signs[min(count, 2)] for count in row] for row in heard.tolist()]
    taken: set[tuple[int, int]] = set()
    for number, (north, east) in enumerate(stations(asvs).tolist()):
        if box.beyond(north, east) <= 0.0:
            row = min(int((box.x_max - north) / high * rows), rows - 1)
            column = min(int((east - box.y_min) / wide * columns), columns - 1)
            alone = number < 10 and (row, column) not in taken
            cells[row][column] = str(number) if alone else STATION
            taken.add((row, column))
    return ["".join(row) for row in cells]


def _heard_by(
    points: ArrayLike, asvs: ArrayLike, rings: Sequence[tuple[float, float]]
) -> NDArray[np.intp]:
    """Return how many ASVs hear each point, between the distances (m) of pairs."""
    array = np.asarray(points, dtype=np.float64)
    if array.ndim < 1 or array.shape[-1] != 2:
        raise ValueError(
            f"points must have the shape (..., 2); met {array.shape}; give x and y (m) of each"
        )
    count, places = np.zeros(array.shape[:-1], dtype=np.intp), stations(asvs)
    for first in range(0, len(places), BLOCK):
        away = _distances(array, places[first : first + BLOCK])
        heard: Flags = np.zeros(away.shape, bool)
        for begin, end in rings:
            heard |= (away >= begin) & (away <= end)
        count += heard.sum(axis=-1, dtype=np.intp)
    return count


def _distances(points: Floats, places: Floats) -> Floats:
    """Return the distance (m) from each point (..., 2) to each place (n, 2), shape (..., n)."""
    offsets = points[..., None, :] - places
    return np.hypot(offsets[..., 0], offsets[..., 1])


def _side(survey: Area | float) -> float | None:
    """Return the side of a survey that is a square about the origin, else None."""
    return survey.side if isinstance(survey, Area) else survey


def _half(side: float | None) -> float:
    if side is None or not 0.0 < side < math.inf:
        raise ValueError(f"side must be positive and finite; met {side}; give it in metres")
    return side / 2.0


def _reach(hf_range: float) -> float:
    if not 0.0 <= hf_range < math.inf:
        raise ValueError(
            f"HF range must be a finite number not below 0; met {hf_range}; give it in metres"
        )
    return hf_range
