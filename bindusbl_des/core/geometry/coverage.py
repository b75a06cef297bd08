"""How much of the survey the ASVs hear: exactly, by geometry, not on a grid.

The survey is an :class:`.area.Area`, or the side of a square about the origin.  It is cut into
Voronoi cells: within the cell of an ASV only that ASV's range circle counts, and the farthest point
of a cell is one of its corners, since distance is convex.  An ASV hears up to `hf_range`, edge
included.  Distances are horizontal: for a slant range R and AUVs at depth z take sqrt(R^2 - z^2).
"""

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from ...support.arrays import Flags, Floats
from .area import Area, Point, rectangle
from .formation import distances, stations
from .land import QUARTER, Land

# ASVs at equal positions, rounded to so many decimals (m), are one: their bisector is rounding.
MICROMETRES = 6

# A distance that exceeds a range by less than this share equals it: rounding.
EQUAL = 1e-9

# A corner that lies beyond a bisector by less than this (m) is on it: rounding.
ROUNDING = 1e-10


def _cells(area: Area, asvs: ArrayLike) -> list[tuple[shapely.Geometry, Floats]]:
    """Return the Voronoi cell of each ASV within an area, and the ASV's position; no empty cells.

    Bisectors cut a cell one by one, first the one beyond which its corners reach farthest.
    """
    return _cells_of(area, tuple(map(tuple, stations(asvs).tolist())))


@lru_cache(maxsize=1)  # coverage, the loneliest point and its distance need the same cells
def _cells_of(area: Area, asvs: tuple[Point, ...]) -> list[tuple[shapely.Geometry, Floats]]:
    given = np.array(asvs)
    places = given[np.sort(np.unique(np.round(given, MICROMETRES), axis=0, return_index=True)[1])]
    cells = []
    for number, place in enumerate(places):
        cell, offsets = area.shape, np.delete(places, number, axis=0) - place
        apart = np.hypot(*offsets.T)
        towards, bisector = offsets / apart[:, np.newaxis], apart / 2.0
        while len(offsets) and not cell.is_empty:
            corners = shapely.get_coordinates(cell) - place
            beyond = (corners @ towards.T).max(axis=0) - bisector
            other = beyond.argmax()
            if beyond[other] <= ROUNDING:
                break
            bisector[other] = np.inf  # cuts once
            far = _farthest(area.shape, place) + apart[other]  # beyond all of the area
            along, back = (
                far * np.array((-towards[other, 1], towards[other, 0])),
                far * towards[other],
            )
            middle = place + offsets[other] / 2.0
            nearer = (middle - along, middle + along, middle + along - back, middle - along - back)
            cell = shapely.intersection(cell, shapely.polygons(nearer))
        if not cell.is_empty:
            cells.append((cell, place))
    return cells


def _farthest(cell: shapely.Geometry, place: Floats) -> float:
    """Return the distance (m) from a position to the farthest corner of a cell."""
    return float(np.hypot(*(shapely.get_coordinates(cell) - place).T).max())


def _ring_in_range(ring: Floats, reach: float) -> float:
    """Return the signed area (m2) of the disc about the origin inside a closed ring (n, 2), m.

    Each edge adds its triangle with the origin where it is inside the disc, and a sector of the
    disc where it is outside.
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
    """Return the signed angle (rad) from each vector of `first` to that of `second`; 0 if equal."""
    return np.asarray(np.arctan2(_cross(first, second), (first * second).sum(axis=1)))


# Characters of the map: a point that no ASV hears, one ASV, two or more; an ASV without a digit of
# its own; a point outside the survey.
UNCOVERED, ONCE, SEVERAL, STATION, OUTSIDE = ".", "o", "#", "*", " "

# Distances to all points are computed for so many ASVs at a time.
BLOCK = 200

# A character of a terminal is about twice as high as it is wide.
CHARACTER_HEIGHT = 2.0


def covering_radius(survey: Area | float, asvs: ArrayLike) -> float:
    """Return the distance (m) from the loneliest point of the survey to its nearest ASV.

    The ASVs cover the survey completely if the HF range is at least this.  The loneliest point is a
    corner, a point of the edge equally far from two ASVs, or an inner point equally far from three.
    `survey` is an area, or the side (m) of a square; `asvs` has shape (n, 2), m. Raises ValueError
    for a side that is not positive, and as :func:`.formation.stations` does. Source: physics of eq.
    coverage, whose corners alone do not suffice.

    >>> round(covering_radius(60.0, [(50.0, 0.0), (-50.0, 0.0)]), 3)
    58.31
    """
    return max(_farthest(cell, place) for cell, place in _cells(_area(survey), asvs))


def is_within(radius: float, reach: float) -> bool:
    """Tell whether a distance (m) is at most a range (m), but for rounding."""
    return radius * (1.0 - EQUAL) <= reach


def loneliest_point(survey: Area | float, asvs: ArrayLike) -> tuple[float, float]:
    """Return the point x, y (m) of the survey that is farthest from its nearest ASV; one of equals.

    Arguments and errors are those of :func:`covering_radius`.

    >>> loneliest_point(60.0, [(50.0, 0.0), (-50.0, 0.0)])
    (0.0, -30.0)
    """
    cell, place = max(_cells(_area(survey), asvs), key=lambda pair: _farthest(*pair))
    corners = shapely.get_coordinates(cell)
    x, y = corners[np.hypot(*(corners - place).T).argmax()].tolist()
    return x, y


def covered_area(survey: Area | float, asvs: ArrayLike, hf_range: float) -> float:
    """Return the fraction, in [0, 1], of the survey within HF range of at least one ASV.

    Exact but for rounding: what an ASV hears of its cell consists of triangles and sectors.
    `survey` is an area, or the side (m) of a square; `asvs` has shape (n, 2), m; `hf_range` is in
    m. Raises ValueError for a side that is not positive, a range that is negative or not finite,
    and as :func:`.formation.stations` does.

    >>> round(covered_area(60.0, [(50.0, 0.0), (-50.0, 0.0)], 50.0), 4)
    0.8938
    """
    area, reach, covered = _area(survey), _reach(hf_range), 0.0
    for cell, place in _cells(area, asvs):
        for part in shapely.get_parts(cell):
            if part.geom_type == "Polygon":
                outer, *holes = (
                    abs(_ring_in_range(shapely.get_coordinates(ring) - place, reach))
                    for ring in (part.exterior, *part.interiors)
                )
                covered += outer - sum(holes)
    return min(max(covered / area.square_m, 0.0), 1.0)


def is_covered(points: ArrayLike, asvs: ArrayLike, hf_range: float) -> Flags:
    """Tell which points are within HF range (m) of at least one ASV, edge included.

    `points` has shape (..., 2) and `asvs` (n, 2), both in m; the result has shape (...). Raises
    ValueError for points without two coordinates, a range that is negative or not finite, and as
    :func:`.formation.stations` does.

    >>> is_covered([(0.0, 0.0), (30.0, 40.0)], [(80.0, 0.0)], 80.0).tolist()
    [True, True]
    """
    return _heard_by(points, asvs, [(0.0, _reach(hf_range))]) > 0


def covered_by_rings(
    area: Area, asvs: ArrayLike, rings: Sequence[tuple[float, float]], land: Land | None = None
) -> float:
    """Return the fraction of an area in a ring of some ASV, with no land between.

    A ring is a pair of distances (m) from the ASV.  One full circle without land is exact;
    otherwise polygons of 360 corners stand for circles.
    """
    if land is None and len(rings) == 1 and rings[0][0] == 0.0:
        return covered_area(area, asvs, rings[0][1])
    places = shapely.points(stations(asvs))
    heard = [
        shapely.difference(
            *(shapely.buffer(places, edge, quad_segs=QUARTER) for edge in (end, begin))
        )
        for begin, end in rings
    ]
    if land is not None:
        reach = max((end for _, end in rings), default=0.0)
        hidden = [land.shadow((x, y), reach) for x, y in stations(asvs).tolist()]
        heard = [shapely.difference(own, hidden) for own in heard]
    inside = shapely.intersection(shapely.union_all(heard), area.shape)
    return float(shapely.area(inside)) / area.square_m


def coverage_map(
    survey: Area | float,
    asvs: ArrayLike,
    heard_between: float | Sequence[tuple[float, float]],
    columns: int = 48,
    land: Land | None = None,
) -> list[str]:
    """Return a map of the survey as lines of text: points that no, one or several ASVs hear.

    An ASV hears up to a range (m), or in rings, pairs of distances (m), with no `land` between.
    North (x) is up, east (y) is right.  A character shows the middle of its cell: '.' heard by no
    ASV, 'o' by one, '#' by several, ' ' outside the survey.  An ASV shows its number, or '*' from
    the eleventh ASV on and where ASVs share a cell.  The map has `columns` characters a line and,
    for a square, half as many lines; a survey more than twice as high as wide has `columns` lines
    instead. Raises ValueError for less than one column, and as :func:`covered_area` does.

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
    area = _area(survey)
    if columns < 1:
        raise ValueError(f"a map must have at least one column; met {columns}; 48 suit a terminal")
    box = area.box
    high, wide = box.x_max - box.x_min, box.y_max - box.y_min
    rows = max(1, round(columns / CHARACTER_HEIGHT * min(high / wide, CHARACTER_HEIGHT)))
    columns = max(1, round(columns * min(CHARACTER_HEIGHT * wide / high, 1.0)))
    x = box.x_max - high * (np.arange(rows) + 0.5) / rows
    y = box.y_min + wide * (np.arange(columns) + 0.5) / columns
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
    if isinstance(heard_between, int | float):
        heard_between = [(0.0, _reach(heard_between))]
    heard = _heard_by(points, asvs, heard_between, land)
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
    points: ArrayLike,
    asvs: ArrayLike,
    rings: Sequence[tuple[float, float]],
    land: Land | None = None,
) -> NDArray[np.intp]:
    """Return for each point (..., 2), m, how many ASVs have it in one of their rings (m), (...)."""
    array = np.asarray(points, dtype=np.float64)
    if array.ndim < 1 or array.shape[-1] != 2:
        raise ValueError(
            f"points must have the shape (..., 2); met {array.shape}; give x and y (m) of each"
        )
    count, places = np.zeros(array.shape[:-1], dtype=np.intp), stations(asvs)
    for first in range(0, len(places), BLOCK):
        away = distances(array, places[first : first + BLOCK])
        heard: Flags = np.zeros(away.shape, bool)
        for begin, end in rings:
            heard |= (away >= begin) & (away <= end)
        if land is not None:
            some = places[first : first + BLOCK]
            heard &= ~land.crossed(array.reshape(-1, 2), some).reshape(heard.shape)
        count += heard.sum(axis=-1, dtype=np.intp)
    return count


def _area(survey: Area | float) -> Area:
    """Return the survey as an area; a number is the side (m) of a square."""
    if isinstance(survey, Area):
        return survey
    if not 0.0 < survey < math.inf:
        raise ValueError(f"side must be positive and finite; met {survey}; give it in metres")
    return rectangle(survey, survey)


def _reach(hf_range: float) -> float:
    if not 0.0 <= hf_range < math.inf:
        raise ValueError(
            f"HF range must be a finite number not below 0; met {hf_range}; give it in metres"
        )
    return hf_range
