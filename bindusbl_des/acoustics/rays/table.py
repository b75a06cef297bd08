"""Travel time and loss of sound over range and two depths, interpolated in a table.

Tables keep what bending changes: travel time beyond that of the straight way, and loss beyond
spherical spreading.  Both are smooth, and none where ways are steep or short, so that coarse grids
tell them finely, and places off the grid's ends (nearer than its first range, too) have sensible
values.
"""

from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...sea.profile import Profile, cumulated_slowness

Floats = NDArray[np.float64]

# The shortest way (m) that counts: levels of sources are those at 1 m.
NEAREST_M = 1.0


class Grid(NamedTuple):
    """The axes of a table, increasing (m): horizontal ranges, depths of sources and receivers."""

    ranges_m: Floats
    source_depths_m: Floats
    receiver_depths_m: Floats


class SoundTable(NamedTuple):
    """What rays differ in from straight ways: on a grid, the time (s) that they take longer, and
    the loss (dB) beyond spherical spreading; arrays of ranges by depths of sources by receivers.

    Absorption is not in it: that depends on the frequency.
    """

    profile: Profile
    grid: Grid
    longer_s: Floats
    beyond_db: Floats

    def travel_time_s(
        self, range_m: ArrayLike, source_depth_m: ArrayLike, receiver_depth_m: ArrayLike
    ) -> Floats:
        """Return how long sound travels (s) over horizontal ranges (m) between two depths (m)."""
        straight = straight_time_s(self.profile, range_m, source_depth_m, receiver_depth_m)
        return straight + self.excess_time_s(range_m, source_depth_m, receiver_depth_m)

    def excess_time_s(
        self, range_m: ArrayLike, source_depth_m: ArrayLike, receiver_depth_m: ArrayLike
    ) -> Floats:
        """Return how much longer (s) that is than on the straight way; rays take no longer."""
        return interpolated(self.grid, self.longer_s, range_m, source_depth_m, receiver_depth_m)

    def loss_db(
        self, range_m: ArrayLike, source_depth_m: ArrayLike, receiver_depth_m: ArrayLike
    ) -> Floats:
        """Return what spreading takes (dB re 1 m) over horizontal ranges (m) between depths (m).

        Absorption comes on top, over :func:`slant_range_m`.
        """
        slant = slant_range_m(range_m, source_depth_m, receiver_depth_m)
        spherical = 20.0 * np.log10(np.maximum(slant, NEAREST_M))
        beyond = interpolated(self.grid, self.beyond_db, range_m, source_depth_m, receiver_depth_m)
        return np.asarray(spherical + beyond)


def slant_range_m(
    range_m: ArrayLike, source_depth_m: ArrayLike, receiver_depth_m: ArrayLike
) -> Floats:
    """Return the straight distance (m) over a horizontal range between two depths (m)."""
    apart = np.asarray(receiver_depth_m, dtype=float) - np.asarray(source_depth_m, dtype=float)
    return np.asarray(np.hypot(np.asarray(range_m, dtype=float), apart))


def straight_time_s(
    profile: Profile,
    range_m: ArrayLike,
    source_depth_m: ArrayLike,
    receiver_depth_m: ArrayLike,
) -> Floats:
    """Return how long (s) sound would travel on the straight way between two depths (m)."""
    above, below = (np.asarray(it, dtype=float) for it in (source_depth_m, receiver_depth_m))
    apart = below - above
    passed = cumulated_slowness(profile, below) - cumulated_slowness(profile, above)
    level = 1.0 / profile.at((above + below) / 2.0)
    # within a millimetre of depth the speed is one
    slowness = np.where(np.abs(apart) < 1e-3, level, passed / np.where(apart == 0.0, 1.0, apart))
    return np.asarray(slant_range_m(range_m, above, below) * slowness)


def interpolated(
    grid: Grid,
    values: Floats,
    range_m: ArrayLike,
    source_depth_m: ArrayLike,
    receiver_depth_m: ArrayLike,
) -> Floats:
    """Return values on a grid interpolated linearly along each axis; constant beyond its ends."""
    asked = np.broadcast_arrays(range_m, source_depth_m, receiver_depth_m)
    cells = [_cell(axis, np.asarray(it, dtype=float)) for axis, it in zip(grid, asked, strict=True)]
    total = np.zeros(asked[0].shape)
    for corner in product((0, 1), repeat=3):
        weight = np.ones(())
        for cell, step in zip(cells, corner, strict=True):
            weight = weight * (cell.share if step else 1.0 - cell.share)
        corners = zip(cells, corner, strict=True)
        places = tuple(cell.above if step else cell.below for cell, step in corners)
        total += weight * values[places]
    return total


class _Cell(NamedTuple):
    """Between which places of an axis values lie, and how far up from the lower one (0 to 1)."""

    below: NDArray[np.intp]
    above: NDArray[np.intp]
    share: Floats


def _cell(axis: Floats, values: Floats) -> _Cell:
    last = len(axis) - 1
    above = np.clip(np.searchsorted(axis, values, side="right"), min(1, last), last)
    below = np.maximum(above - 1, 0)
    step = np.where(above > below, axis[above] - axis[below], 1.0)
    return _Cell(below, above, np.clip((values - axis[below]) / step, 0.0, 1.0))
