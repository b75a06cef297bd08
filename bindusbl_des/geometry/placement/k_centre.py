"""Where k vessels are nearest to all of many places: the smallest k equal circles around them.

What k vessels that hear as far as R cover completely can be covered exactly if the radius found
here is not above R (objective O1 of the k-centre problem, which is NP-hard for k among the input).
"""

from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..formation import stations
from .enclosing_circle import circumscribed, diametral, enclosing_circle

Floats = NDArray[np.float64]
Numbers = NDArray[np.intp]

# Up to so many different places, and vessels, the best centres are found exactly.
EXACT_PLACES, EXACT_COUNT = 16, 6
# Farthest-first starts, each improved until nothing changes or so often.
STARTS, ROUNDS = 8, 100
# A place beyond a circle by no more than this share of its radius is within it: rounding.
ROUNDING = 1e-9


class Centres(NamedTuple):
    """Centres (k, 2), m, the number of its nearest for each place (n,), and the radius (m)."""

    places: Floats
    nearest: Numbers
    radius: float


def k_centre(places: ArrayLike, count: int) -> Centres:
    """Return `count` centres, the farthest of places (n, 2) as near to one of them as possible.

    Positions in m.  Exact for at most `EXACT_PLACES` different places and `EXACT_COUNT` centres;
    else the best of `STARTS` farthest-first traversals (Gonzalez 1985: at most twice the least
    radius), each improved by moving every centre to the middle of the smallest circle around what
    is nearest to it.  The same places give the same centres; of more centres than different places,
    those left over lie where others do.  Raises ValueError for less than one centre and as
    :func:`.formation.stations` does.

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
        tried = [_improved(different, farthest_first(different, count, it)) for it in starts]
        centres = min(tried, key=lambda it: float(distances(different, it).min(axis=1).max()))
    centres = centres[np.lexsort(centres.T[::-1])]  # by x, then y
    away = distances(points, centres)
    return Centres(centres, away.argmin(axis=1), float(away.min(axis=1).max()))


def distances(points: Floats, centres: Floats) -> Floats:
    """Return the distance (m) of each point (n, 2) from each centre (k, 2), shape (n, k)."""
    apart = points[:, None, :] - centres
    return np.hypot(apart[..., 0], apart[..., 1])


def _exact(points: Floats, count: int) -> Floats:
    """Return the best centres (count, 2): the least of critical radii at which circles suffice.

    Each of the best circles is the smallest around its points, hence one point or through two or
    three: the radius is one of finitely many, and whether circles of a radius suffice is found by
    covering the first point that is not yet, in every way.
    """
    pairs = [diametral(np.array(it)) for it in combinations(points, 2)]
    triples = [circumscribed(np.array(it)) for it in combinations(points, 3)]
    circles = np.array([*pairs, *(it for it in triples if np.isfinite(it.radius))])
    away = distances(points, np.vstack((points, circles[:, :2])))  # (n, circles)
    critical = np.unique(circles[:, 2])
    low, high = 0, len(critical) - 1
    best = [np.arange(len(points))]  # one circle holds all, even where rounding says otherwise
    while low <= high:
        tried = (low + high) // 2
        within = away <= critical[tried] * (1.0 + ROUNDING)
        groups = _cover(np.unique(within, axis=1), count)
        if groups is None:
            low = tried + 1
        else:
            best, high = groups, tried - 1
    found = [enclosing_circle(points[group])[:2] for group in best]
    return np.array([*found, *[found[-1]] * (count - len(found))])


def _cover(within: NDArray[np.bool_], count: int) -> list[Numbers] | None:
    """Return at most `count` groups of points that circles hold, of all points; None if none do.

    `within` (n, circles) tells which points each circle holds.
    """
    weights = 1 << np.arange(len(within), dtype=np.int64)
    masks = sorted({int(it) for it in weights @ within}, key=lambda it: (-it.bit_count(), it))
    largest = [it for n, it in enumerate(masks) if not any(it & ~big == 0 for big in masks[:n])]

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
    return None if groups is None else [np.flatnonzero(weights & it) for it in groups]


def _starts(points: Floats) -> Numbers:
    """Return which points farthest-first traversals begin at: the most central, and far ones."""
    middle = points.mean(axis=0)
    away = np.hypot(*(points - middle).T)
    far = farthest_first(points, min(STARTS, len(points)) - 1, int(away.argmax()))
    return np.concatenate(([int(away.argmin())], far))


def farthest_first(points: Floats, count: int, first: int) -> Numbers:
    """Return the numbers (count,) of points, each the farthest from those before it."""
    chosen = [first]
    away = np.hypot(*(points - points[first]).T)
    while len(chosen) < count:
        chosen.append(int(away.argmax()))
        away = np.minimum(away, np.hypot(*(points - points[chosen[-1]]).T))
    return np.array(chosen, dtype=np.intp)


def _improved(points: Floats, chosen: Numbers) -> Floats:
    """Return centres (k, 2) that begin at chosen points and move to the middles of their own."""
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
