"""The smallest circle around places: the best station of one vessel that must hear them all."""

from itertools import combinations
from math import hypot, inf, isfinite
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..formation import stations

Floats = NDArray[np.float64]

# A place beyond a circle by no more than this share of its radius lies on it: rounding.
ROUNDING = 1e-12


class Circle(NamedTuple):
    """A circle: the place of its middle and its radius (m)."""

    x: float
    y: float
    radius: float


def enclosing_circle(places: ArrayLike) -> Circle:
    """Return the smallest circle that encloses places (n, 2), in m.

    Two or three places determine it (Welzl 1991, "Smallest enclosing disks").  Beginning with any
    one of them, the place farthest outside is taken in, until none is: the radius grows with each
    step, so there are finitely many (the pivot rule of Gärtner 1999).
    Raises ValueError as :func:`.formation.stations` does.

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
        if away[farthest] <= circle.radius * (1.0 + ROUNDING):
            break
        wider, support = _smallest(np.vstack((support, points[farthest])))
        if wider.radius <= circle.radius:  # what is still outside, rounding put there
            circle = circle._replace(radius=float(away[farthest]))
            break
        circle = wider
    return Circle(circle.x + float(origin[0]), circle.y + float(origin[1]), circle.radius)


def _smallest(points: Floats) -> tuple[Circle, Floats]:
    """Return the smallest circle around two to four places, and those that determine it.

    It passes through two of them, as its diameter, or through three.
    """
    best: tuple[Circle, Floats] | None = None
    for size in (2, 3):
        for chosen in combinations(range(len(points)), size):
            support = points[list(chosen)]
            circle = diametral(support) if size == 2 else circumscribed(support)
            away = np.hypot(points[:, 0] - circle.x, points[:, 1] - circle.y).max()
            encloses = away <= circle.radius * (1.0 + ROUNDING)
            if encloses and (best is None or circle.radius < best[0].radius):
                best = circle, support
    if best is None:  # three in a row but for rounding: the two farthest apart
        pairs = list(combinations(points, 2))
        support = np.array(max(pairs, key=lambda it: float(np.hypot(*(it[0] - it[1])))))
        best = diametral(support), support
    return best


def diametral(pair: Floats) -> Circle:
    """Return the circle of which two places (2, 2) are a diameter."""
    x, y = (pair[0] + pair[1]) / 2.0
    return Circle(float(x), float(y), float(np.hypot(*(pair[1] - pair[0]))) / 2.0)


def circumscribed(triple: Floats) -> Circle:
    """Return the circle through three places (3, 2); of three in a row its radius is infinite."""
    (ax, ay), (bx, by), (cx, cy) = triple.tolist()
    bx, by, cx, cy = bx - ax, by - ay, cx - ax, cy - ay
    twice_area = 2.0 * (bx * cy - by * cx)
    if twice_area == 0.0:
        return Circle(ax, ay, inf)
    b_square, c_square = bx * bx + by * by, cx * cx + cy * cy
    x = (cy * b_square - by * c_square) / twice_area
    y = (bx * c_square - cx * b_square) / twice_area
    return Circle(ax + x, ay + y, hypot(x, y)) if isfinite(hypot(x, y)) else Circle(ax, ay, inf)
