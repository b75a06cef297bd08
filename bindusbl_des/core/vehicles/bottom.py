"""The bottom of the sea: its depth below any place, and the depth at which AUVs keep an altitude.

A :class:`Bottom` is known at the nodes of a grid and bilinear between them.  It is the one answer
to how deep the sea is at a place: plans, autopilots, bottom lock, echoes and tables ask it.
"""

from math import isfinite, nan
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...support.arrays import Floats
from ...support.compiled import compiled
from .currents import between

# The least and greatest distance (m) at which a bottom is sampled along a path
STEPS_M = 0.5, 10.0


class Bottom(NamedTuple):
    """Depths (n, m), m below the surface, of the bottom at `xs` (n,) and `ys` (m,), m, which rise.

    NaN where it is not known.  A bottom without nodes is known nowhere.
    """

    xs: Floats
    ys: Floats
    depths: Annotated[Floats, 2]

    @property
    def is_known(self) -> bool:
        """Whether there is any."""
        return self.depths.size > 0

    @property
    def deepest(self) -> float:
        """The greatest depth (m) that is known of it."""
        return float(np.nanmax(self.depths))

    @property
    def step_m(self) -> float:
        """The distance (m) at which it is sampled along a path: half a cell, within 0.5 to 10 m."""
        cell = min(float(np.diff(axis).min()) for axis in (self.xs, self.ys))
        return float(np.clip(cell / 2.0, *STEPS_M))

    def below(self, places: ArrayLike) -> Floats:
        """Return the depth (m), (n,), of the bottom below positions (n, 2 or more), m; NaN where it
        is not known.

        >>> axis, depths = np.array([0.0, 10.0]), np.array([[5.0, 5.0], [9.0, 9.0]])
        >>> Bottom(axis, axis, depths).below([(5.0, 3.0), (11.0, 3.0)]).tolist()
        [7.0, nan]
        """
        where = np.ascontiguousarray(np.asarray(places, dtype=np.float64)[:, :2])
        found = np.empty(len(where))
        _below_all(self, where, found)
        return found


UNKNOWN = Bottom(np.zeros(0), np.zeros(0), np.zeros((0, 0)))


@compiled
def below(bottom: Bottom, x: float, y: float) -> float:
    """Return the depth (m) of the bottom below a position (m); NaN where it is not known."""
    xs, ys = bottom.xs, bottom.ys
    if bottom.depths.size == 0:
        return nan
    if not (xs[0] <= x <= xs[xs.size - 1] and ys[0] <= y <= ys[ys.size - 1]):
        return nan
    south, norther = between(xs, x)
    west, easter = between(ys, y)
    depth = 0.0
    for corner in range(4):
        n, m = corner & 1, corner >> 1
        weight = (norther if n else 1.0 - norther) * (easter if m else 1.0 - easter)
        if weight > 0.0:
            depth += weight * bottom.depths[south + n, west + m]
    return depth


@compiled
def _below_all(bottom: Bottom, places: Floats, found: Floats) -> None:
    for k in range(found.size):
        found[k] = below(bottom, places[k, 0], places[k, 1])


class Keeping(NamedTuple):
    """How AUVs keep an altitude (m): no shallower and no deeper than these depths (m)."""

    altitude_m: float
    shallowest_m: float
    deepest_m: float

    def depths(self, bottom: Bottom, places: ArrayLike) -> Floats:
        """Return the depths (n,), m, that keep it at positions (n, 2 or more), m."""
        wanted = bottom.below(places) - self.altitude_m
        return np.maximum(np.minimum(wanted, self.deepest_m), self.shallowest_m)


@compiled
def kept_depth(bottom: Bottom, x: float, y: float, kept: Keeping, depth: float) -> float:
    """Return the depth (m) that keeps an altitude at a position (m); `depth` where the bottom is
    not known.
    """
    floor = below(bottom, x, y)
    if not isfinite(floor):
        return depth
    return max(min(floor - kept.altitude_m, kept.deepest_m), kept.shallowest_m)
