"""Bays drawn at random for tests, as shapely's alone has them: an area, and land of each kind."""

import math
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

Corners = list[list[float]]


class Bay(NamedTuple):
    """Corners of an area and of polygons of land and of water where nobody goes (m); and what that
    makes: land, all that is closed, and water to be surveyed.
    """

    area: Corners
    land: list[Corners]
    keep_out: list[Corners]

    @property
    def ashore(self) -> BaseGeometry:
        """The land."""
        return shapely.union_all([shapely.Polygon(ring) for ring in self.land])

    @property
    def closed(self) -> BaseGeometry:
        """Where nobody goes."""
        return shapely.union_all([shapely.Polygon(ring) for ring in (*self.land, *self.keep_out)])

    @property
    def water(self) -> BaseGeometry:
        """What is to be surveyed."""
        return shapely.Polygon(self.area) - self.closed

    @property
    def survey(self) -> dict[str, object]:
        """The section of a scenario."""
        return {"polygon_m": self.area, "land": self.land, "keep_out": self.keep_out}


def blob(draw: np.random.Generator, middle: tuple[float, float], size: float) -> Corners:
    """Return the corners of a star-shaped polygon, which is concave as a rule."""
    turns = np.sort(draw.uniform(0.0, 2.0 * math.pi, draw.integers(4, 11)))
    turns += np.linspace(0.0, 0.3, len(turns))  # no two in one direction
    reach = size * draw.uniform(0.35, 1.0, len(turns))
    x, y = middle[0] + reach * np.cos(turns), middle[1] + reach * np.sin(turns)
    return [[round(float(a), 3), round(float(b), 3)] for a, b in zip(x, y, strict=True)]


def drawn_bay(seed: int) -> Bay:
    """Return a bay of some 200 m: an island in it, one outside, a coast that cuts the area, and a
    fairway; each is left out now and then.
    """
    draw = np.random.default_rng(seed)
    while True:
        area = blob(draw, (0.0, 0.0), 150.0)
        if not shapely.Polygon(area).is_valid or shapely.Polygon(area).area < 15_000.0:
            continue
        places = {
            "hole": ((float(draw.uniform(-40, 40)), float(draw.uniform(-40, 40))), 30.0),
            "outside": ((170.0, float(draw.uniform(-60, 60))), 25.0),
            "coast": ((float(draw.uniform(-60, 60)), -110.0), 70.0),
        }
        land = [blob(draw, *where) for where in places.values() if draw.random() < 0.8]
        kept = [blob(draw, (-60.0, 40.0), 25.0)] if draw.random() < 0.6 else []
        rings = [shapely.Polygon(ring) for ring in (*land, *kept)]
        bay = Bay(area, land, kept)
        if all(ring.is_valid and ring.area > 50.0 for ring in rings) and bay.water.area > 8_000.0:
            return bay
