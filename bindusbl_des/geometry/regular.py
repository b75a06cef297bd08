"""The best regular formation: radius and angle of a polygon of vessels about a middle."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..core.arrays import Floats
from .area import Area
from .coverage import covering_radius
from .formation import formation
from .placement import descended

# Formations tried at first: radii up to the widest, and angles between two that look alike.
RADII, ANGLES = 12, 8
# The best so many of them are improved, to this share of the widest radius, in so many steps.
IMPROVED, FINELY, MOST_ASKED = 3, 1e-7, 400


class Ring(NamedTuple):
    """A regular formation: its radius (m), the angle (rad) of its first vessel, and its worth."""

    radius: float
    angle: float
    value: float


def best_ring(
    count: int,
    value: Callable[[Floats], float],
    widest: float,
    middle: tuple[float, float] = (0.0, 0.0),
    *,
    finely: float = FINELY,
) -> Ring:
    """Return the regular formation of `count` vessels whose `value` is least.

    `value` takes places (count, 2), m.  Radii up to the `widest` (m) and angles are tried on a
    grid, and the best improved (:mod:`.placement`) to a share `finely` of the widest radius; no
    formation is wider than that, nor turned by more than to the one that looks alike.
    Raises ValueError as :func:`.formation.formation` does.
    """
    if count <= 1:
        return Ring(0.0, 0.0, value(formation(count, 0.0) + middle))
    turn = 2.0 * math.pi / count

    def at(place: Floats) -> float:
        radius, angle = float(place[0]) * widest, float(place[1]) * turn
        if not 0.0 <= radius <= widest:
            return math.inf
        return value(formation(count, radius, angle) + middle)

    grid = [np.array((r, a)) for r in _steps(RADII, closed=True) for a in _steps(ANGLES)]
    ranked = sorted(((at(place), n) for n, place in enumerate(grid)), key=lambda it: it)
    tried = [descended(at, grid[n], 0.5 / RADII, finely, MOST_ASKED) for _, n in ranked[:IMPROVED]]
    place, least = min(tried, key=lambda it: it[1])
    return Ring(float(place[0]) * widest, float(place[1] % 1.0) * turn, least)


def _steps(count: int, *, closed: bool = False) -> Floats:
    """Return so many shares of 1 from 0 on, the last included if `closed`."""
    return np.linspace(0.0, 1.0, count + closed, endpoint=closed)


def least_covering_ring(survey: Area | float, count: int) -> Ring:
    """Return the regular formation from which every point of a survey is nearest to some vessel.

    `survey` is an area, or the side of a square in m; its value is the covering radius (m), the
    least range at which such a formation hears everywhere.

    >>> ring = least_covering_ring(100.0, 2)
    >>> round(ring.radius, 3), round(ring.value, 4)
    (25.0, 55.9017)
    """
    return best_ring(count, lambda places: covering_radius(survey, places), *_around(survey))


def _around(survey: Area | float) -> tuple[float, tuple[float, float]]:
    """Return how far the survey's corners are from its middle (m), and where that is (m)."""
    if isinstance(survey, Area):
        middle = survey.centroid
        return max(math.dist(middle, corner) for corner in survey.outline), middle
    return survey / math.sqrt(2.0), (0.0, 0.0)
