"""Stations from which k vessels hear all of many positions, or as many as possible.

The centre of the smallest enclosing circle is the best station of one vessel; k equal circles of
the least radius give those of k.  If that radius is at most the range R, k vessels cover every
position (objective O1: the k-centre problem, NP-hard in k).  With a larger radius, the k-centre
objective may put a vessel midway between positions that it then does not hear; `max_cover` gives up
the farthest positions instead (objective O2).
"""

from itertools import combinations
from math import hypot, inf, isfinite
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...support.arrays import Flags, Floats
from .formation import distances, stations

# A point outside a circle by at most this share of its radius is on it: rounding.
CIRCLE_ROUNDING = 1e-12


class Circle(NamedTuple):
    """A circle: x and y of its centre, and its radius (m)."""

    x: float
    y: float
    radius: float


def enclosing_circle(places: ArrayLike) -> Circle:
    """Return the smallest circle that encloses points (n, 2), m.

    Two or three of the points determine it (Welzl 1991, "Smallest enclosing disks").  The farthest
    point outside joins the circle until none is outside: each step enlarges the radius, so the
    steps end (the pivot rule of Gärtner 1999).  Raises ValueError as :func:`.formation.stations`
    does.

    >>> enclosing_circle([(-60.0, -60.0), (60.0, 60.0), (0.0, 0.0)])
    Circle(x=0.0, y=0.0, radius=84.8528137423857)
    """
    points = stations(places)
    origin = points.mean(axis=0)
    points = points - origin  # so that digits are spent on the shape
    support = points[:1]
    circle = Circle(float(support[0, 0]), float(support[0, 1]), 0.0)
    while True:
        away = np.hypot(points[:, 0] - circle.x, points[:, 1] - circle.y)
        farthest = int(away.argmax())
        if away[farthest] <= circle.radius * (1.0 + CIRCLE_ROUNDING):
            break
        wider, support = _smallest(np.vstack((support, points[farthest])))
        if wider.radius <= circle.radius:  # only rounding put that point outside
            circle = circle._replace(radius=float(away[farthest]))
            break
        circle = wider
    return Circle(circle.x + float(origin[0]), circle.y + float(origin[1]), circle.radius)


def _smallest(points: Floats) -> tuple[Circle, Floats]:
    """Return the smallest circle around two to four points, and the two or three that determine it.

    Two are the ends of a diameter; three lie on the circle.
    """
    best: tuple[Circle, Floats] | None = None
    for size in (2, 3):
        for chosen in combinations(range(len(points)), size):
            support = points[list(chosen)]
            circle = diametral(support) if size == 2 else circumscribed(support)
            away = np.hypot(points[:, 0] - circle.x, points[:, 1] - circle.y).max()
            encloses = away <= circle.radius * (1.0 + CIRCLE_ROUNDING)
            if encloses and (best is None or circle.radius < best[0].radius):
                best = circle, support
    if best is None:  # nearly collinear points: the two farthest apart
        pairs = list(combinations(points, 2))
        support = np.array(max(pairs, key=lambda pair: float(np.hypot(*(pair[0] - pair[1])))))
        best = diametral(support), support
    return best


def diametral(pair: Floats) -> Circle:
    """Return the circle that has two points (2, 2), m, as the ends of a diameter."""
    x, y = (pair[0] + pair[1]) / 2.0
    return Circle(float(x), float(y), float(np.hypot(*(pair[1] - pair[0]))) / 2.0)


def circumscribed(triple: Floats) -> Circle:
    """Return the circle through three points (3, 2), m: of infinite radius if they are in line."""
    (ax, ay), (bx, by), (cx, cy) = triple.tolist()
    bx, by, cx, cy = bx - ax, by - ay, cx - ax, cy - ay
    twice_area = 2.0 * (bx * cy - by * cx)
    if twice_area == 0.0:
        return Circle(ax, ay, inf)
    b_square, c_square = bx * bx + by * by, cx * cx + cy * cy
    x = (cy * b_square - by * c_square) / twice_area
    y = (bx * c_square - cx * b_square) / twice_area
    return Circle(ax + x, ay + y, hypot(x, y)) if isfinite(hypot(x, y)) else Circle(ax, ay, inf)


Numbers = NDArray[np.intp]

# k_centre is exact up to so many different points and centres.
EXACT_PLACES, EXACT_COUNT = 16, 6
# Farthest-first starts, and how many rounds may improve each.
STARTS, ROUNDS = 8, 100
# A point outside a circle by at most this share of its radius is inside: rounding.
RADIUS_ROUNDING = 1e-9


class Centres(NamedTuple):
    """Centres (k, 2), m; for each point (n,) the index of its nearest centre; the radius (m)."""

    places: Floats
    nearest: Numbers
    radius: float


def k_centre(places: ArrayLike, count: int) -> Centres:
    """Return `count` centres that make the largest distance (m) of points (n, 2) to a centre least.

    Exact for at most `EXACT_PLACES` different points and `EXACT_COUNT` centres.  Otherwise the best
    of `STARTS` farthest-first traversals (Gonzalez 1985: at most twice the least radius), each
    improved by moving every centre to the middle of the smallest circle around its own points.
    Equal points give equal centres.  With more centres than different points, the surplus repeats
    others. Raises ValueError for less than one centre, and as :func:`.formation.stations` does.

    >>> found = k_centre([(-60, -60), (60, 60), (0, 0), (-50, 60)], 2)
    >>> found.places.tolist(), found.radius
    ([[-30.0, -30.0], [5.0, 60.0]], 55.0)
    """
    points = stations(places)
    if count < 1:
        raise ValueError(f"at least one centre is needed; met {count}; raise the count")
    different = np.unique(points, axis=0)
    if len(different) <= count:
        centres = different[np.arange(count) % len(different)]
    elif len(different) <= EXACT_PLACES and count <= EXACT_COUNT:
        centres = _exact(different, count)
    else:
        starts = _starts(different)
        tried = [_improved(different, farthest_first(different, count, start)) for start in starts]
        centres = min(
            tried, key=lambda centres: float(distances(different, centres).min(axis=1).max())
        )
    centres = centres[np.lexsort(centres.T[::-1])]  # by x, then y
    away = distances(points, centres)
    return Centres(centres, away.argmin(axis=1), float(away.min(axis=1).max()))


def _exact(points: Floats, count: int) -> Floats:
    """Return the optimal centres (count, 2), m, of at most `EXACT_PLACES` different points.

    Each optimal circle is determined by one, two or three points, so its radius is one of finitely
    many.  A bisection over these asks :func:`_cover` whether circles of that radius suffice.
    """
    pairs = [diametral(np.array(combination)) for combination in combinations(points, 2)]
    triples = [circumscribed(np.array(combination)) for combination in combinations(points, 3)]
    circles = np.array([*pairs, *(triple for triple in triples if np.isfinite(triple.radius))])
    away = distances(points, np.vstack((points, circles[:, :2])))  # (n, circles)
    critical = np.unique(circles[:, 2])
    low, high = 0, len(critical) - 1
    best = [np.arange(len(points))]  # one circle holds all points, whatever rounding says
    while low <= high:
        tried = (low + high) // 2
        within = away <= critical[tried] * (1.0 + RADIUS_ROUNDING)
        groups = _cover(np.unique(within, axis=1), count)
        if groups is None:
            low = tried + 1
        else:
            best, high = groups, tried - 1
    centres = [enclosing_circle(points[group])[:2] for group in best]
    return np.array([*centres, *[centres[-1]] * (count - len(centres))])


def _cover(within: NDArray[np.bool_], count: int) -> list[Numbers] | None:
    """Return at most `count` groups, each inside one circle, that hold all points; else None.

    `within` (n, circles) tells which points a circle holds.  The search covers the first uncovered
    point by each circle that holds it, in turn.
    """
    weights = 1 << np.arange(len(within), dtype=np.int64)
    masks = sorted(
        {int(mask) for mask in weights @ within}, key=lambda mask: (-mask.bit_count(), mask)
    )
    largest = [
        mask for n, mask in enumerate(masks) if not any(mask & ~big == 0 for big in masks[:n])
    ]

    def chosen(left: int, more: int) -> list[int] | None:
        if left == 0:
            return []
        if more == 0 or left.bit_count() > more * largest[0].bit_count():
            return None
        first = left & -left
        for mask in largest:
            if mask & first:
                rest = chosen(left & ~mask, more - 1)
                if rest is not None:
                    return [mask & left, *rest]
        return None

    groups = chosen((1 << len(within)) - 1, count)
    return None if groups is None else [np.flatnonzero(weights & group) for group in groups]


def _starts(points: Floats) -> Numbers:
    """Return the points (indices) at which traversals begin: the most central one, and far ones."""
    middle = points.mean(axis=0)
    away = np.hypot(*(points - middle).T)
    far = farthest_first(points, min(STARTS, len(points)) - 1, int(away.argmax()))
    return np.concatenate(([int(away.argmin())], far))


def farthest_first(points: Floats, count: int, first: int) -> Numbers:
    """Return indices (count,) of points: `first`, then each the farthest from those before."""
    chosen = [first]
    away = np.hypot(*(points - points[first]).T)
    while len(chosen) < count:
        chosen.append(int(away.argmax()))
        away = np.minimum(away, np.hypot(*(points - points[chosen[-1]]).T))
    return np.array(chosen, dtype=np.intp)


def _improved(points: Floats, chosen: Numbers) -> Floats:
    """Return centres (k, 2), m: at first the points `chosen` (indices), each moved to the middle of
    the points that are nearest to it until none changes.
    """
    centres, before = points[chosen], None
    for _ in range(ROUNDS):
        nearest = distances(points, centres).argmin(axis=1)
        if before is not None and (nearest == before).all():
            break
        before = nearest
        for number in range(len(centres)):
            own = points[nearest == number]
            if len(own):
                centres[number] = enclosing_circle(own)[:2]
    return centres


# Up to so many points, circles come from all pairs; beyond, from a grid of so many cells a range.
MOST_PAIRED, CELLS = 60, 3
# At most so many points are used, evenly spaced in their order; the grid gets coarser rather than
# exceed so many pairs of a cell and a point.
MOST_PLACES, MOST_PAIRS = 2000, 10_000_000
# Distances of at most so many pairs are computed at once.
AT_ONCE = 1_000_000
# The search begins with each of so many circles.
COVER_STARTS = 8
# A point beyond the range by at most this share of it is within: rounding.
REACH_ROUNDING = 1e-9


class Cover(NamedTuple):
    """Stations of k vessels (k, 2), m, and which of n points a vessel reaches (n,)."""

    places: Floats
    reached: Flags


def max_cover(
    places: ArrayLike, count: int, reach: float, weights: ArrayLike | None = None
) -> Cover:
    """Return stations of `count` vessels with a `reach` (m) that covers most of points (n, 2), m.

    A best circle can be moved until two of its points lie on its edge, or one at its centre, so for
    few points these circles are all that matter.  A greedy choice takes the circle that adds most
    (at least 1 - 1/e of the optimum: Nemhauser, Wolsey and Fisher 1978), then circles are exchanged
    while the sum grows.  The search starts from each of the `COVER_STARTS` circles that cover most;
    the first of equal results wins.  Finally each vessel moves to the middle of its own points; a
    vessel without any goes to the point that is farthest from all others.  Points count by
    `weights` (n,), by default 1. Raises ValueError for less than one vessel, a reach that is not
    positive, and as :func:`.formation.stations` does.

    >>> found = max_cover([(0.0, 0.0), (8.0, 0.0), (100.0, 0.0)], 1, 5.0)
    >>> found.places.tolist(), found.reached.tolist()
    ([[4.0, 0.0]], [True, True, False])
    """
    points = stations(places)
    if count < 1:
        raise ValueError(f"at least one vessel is needed; met {count}; raise the count")
    if not 0.0 < reach < np.inf:
        raise ValueError(f"a reach must be positive and finite; met {reach}; give it in metres")
    value = np.ones(len(points)) if weights is None else np.asarray(weights, dtype=np.float64)
    some = np.linspace(0, len(points) - 1, min(len(points), MOST_PLACES)).astype(np.intp)
    middles, value = _middles(points[some], reach), value[some]
    within = _within(middles, points[some], reach)  # (circles, n)
    firsts = np.argsort(-(within @ value), kind="stable")[:COVER_STARTS]
    tried = [
        _exchanged(_greedy(within, value, count, int(first)), within, value) for first in firsts
    ]
    chosen = max(tried, key=lambda circles: float(value[within[circles].any(axis=0)].sum()))
    return _settled(points, _within(middles[chosen], points, reach), reach)


def _within(middles: Floats, points: Floats, reach: float) -> Flags:
    """Tell which points (n, 2) lie within `reach` (m) of each centre (c, 2), shape (c, n)."""
    parts = np.array_split(middles, len(middles) * len(points) // AT_ONCE + 1)
    return np.vstack([distances(part, points) <= reach * (1.0 + REACH_ROUNDING) for part in parts])


def _middles(points: Floats, reach: float) -> Floats:
    """Return the centres (c, 2), m, of candidate circles of radius `reach` (m) for points (n,
    2).
    """
    if len(points) > MOST_PAIRED:
        low, high = points.min(axis=0), points.max(axis=0)
        coarse = np.prod(high - low) * len(points) / MOST_PAIRS, np.max(high - low) / MOST_PLACES
        step = max(reach / CELLS, coarse[0] ** 0.5, coarse[1])
        axes = [np.arange(low[k], high[k] + step, step) for k in (0, 1)]
        grid = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
        return np.vstack((points, grid))
    first, second = np.triu_indices(len(points), k=1)
    apart, middle = points[second] - points[first], (points[second] + points[first]) / 2.0
    half = np.hypot(*apart.T) / 2.0
    near = (half > 0.0) & (half <= reach)
    apart, middle, half = apart[near], middle[near], half[near]
    aside = np.sqrt(reach**2 - half**2) / (2.0 * half)
    across = np.column_stack((-apart[:, 1], apart[:, 0])) * aside[:, None]
    return np.vstack((points, middle + across, middle - across))


def _greedy(within: Flags, value: Floats, count: int, first: int) -> list[int]:
    """Return `count` circles (rows of `within`): `first`, then each that adds most value."""
    chosen, left = [first], value.copy()
    while len(chosen) < count:
        left[within[chosen[-1]]] = 0.0
        chosen.append(int((within @ left).argmax()))
    return chosen


def _exchanged(chosen: list[int], within: Flags, value: Floats) -> list[int]:
    """Exchange `chosen` circles (rows of `within`) while the covered value grows; return them."""
    better = True
    while better:
        better = False
        for number in range(len(chosen)):
            others = [circle for k, circle in enumerate(chosen) if k != number]
            left = np.where(within[others].any(axis=0), 0.0, value)
            gains = within @ left
            best = int(gains.argmax())
            if gains[best] > gains[chosen[number]] * (1.0 + REACH_ROUNDING):
                chosen[number], better = best, True
    return chosen


def _settled(points: Floats, within: Flags, reach: float) -> Cover:
    """Return vessels, each in the middle of the points that belong to it: the first circle of
    `within` (k, n) that holds a point has it.
    """
    own = within & ~np.vstack((np.zeros_like(within[:1]), np.logical_or.accumulate(within)[:-1]))
    middles = np.array([enclosing_circle(points[held])[:2] for held in own if held.any()])
    while len(middles) < len(within):
        farthest = distances(points, middles).min(axis=1).argmax()
        middles = np.vstack((middles, points[farthest]))
    reached = distances(points, middles).min(axis=1) <= reach * (1.0 + REACH_ROUNDING)
    return Cover(middles[np.lexsort(middles.T[::-1])], reached)
