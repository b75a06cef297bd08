"""How much of a survey vehicles sweep, and by when: on a grid, by their true ways.

A point is swept once a vehicle has passed within half a swath of it, seen from above.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.arrays import Floats
from ..geometry.area import Area
from .vehicle import Vehicle

# Cells are this share of a swath wide, unless there were too many of them, or ways too long.
CELL = 1 / 8
MOST_CELLS, MOST_PLACES = 250_000, 250_000

# Ways are looked at in steps of so many cells: the scallops between circles about two places are
# a fourth of a cell deep.
STEP = 2.0

# Cells coarser than this share of a swath tell nothing.
COARSEST = 0.5

# A vehicle so much (m) above its depth is on its way up.
LEVEL_M = 0.1

# Places whose surroundings are worked out at a time.
BLOCK = 2_000


class Sweep(NamedTuple):
    """When each cell of a survey was first swept (s; infinite: never) and by which vehicle."""

    at_s: Floats
    by: NDArray[np.int64]
    cell_m2: float

    def area(self, times: Floats, vehicle: int | None = None) -> Floats:
        """Return how much (m2) was swept by some instants (s), (n,): by all, or first by one."""
        mine = self.at_s if vehicle is None else self.at_s[self.by == vehicle]
        return np.asarray(self.cell_m2 * np.searchsorted(np.sort(mine), times, side="right"))


def sweep(
    area: Area,
    vehicles: Sequence[Vehicle],
    swath: float,
    until: float,
    depths: Sequence[float] | None = None,
) -> Sweep | None:
    """Return which parts of a survey vehicles sweep until an instant (s), with a swath (m).

    A cell counts with its middle, so that the edge of what is swept is off by half a cell at most.
    Vehicles that come up sweep nothing above their `depths` (m).  None where the survey is too
    large, or the ways too long, for cells that tell anything.
    """
    box = area.box
    ways = [vehicle.distance(until) for vehicle in vehicles]
    cell = max(
        CELL * swath,
        math.sqrt((box.x_max - box.x_min) * (box.y_max - box.y_min) / MOST_CELLS),
        sum(ways) / STEP / MOST_PLACES,
    )
    if cell > COARSEST * swath:
        return None
    x, y = (
        np.arange(low + cell / 2, high, cell)
        for low, high in ((box.x_min, box.x_max), (box.y_min, box.y_max))
    )
    times, places, who = _passed(
        vehicles, [math.ceil(way / cell / STEP) + 1 for way in ways], until, depths
    )
    first = np.full(len(x) * len(y), len(times))  # of all places, the first near each cell
    reach = math.ceil(swath / 2 / cell)
    offsets = np.arange(-reach, reach + 1)
    for begin in range(0, len(times), BLOCK):
        block = np.arange(begin, min(begin + BLOCK, len(times)))
        column = np.floor((places[block, 0] - box.x_min) / cell).astype(np.int64)[:, None] + offsets
        row = np.floor((places[block, 1] - box.y_min) / cell).astype(np.int64)[:, None] + offsets
        off_x = box.x_min + cell * (column + 0.5) - places[block, :1]
        off_y = box.y_min + cell * (row + 0.5) - places[block, 1:]
        off_x[(column < 0) | (column >= len(x))] = np.inf
        off_y[(row < 0) | (row >= len(y))] = np.inf
        near = (off_x**2)[:, :, None] + (off_y**2)[:, None, :] <= (swath / 2) ** 2
        cells = (column * len(y))[:, :, None] + row[:, None, :]
        who_is_near = np.repeat(block, near.sum(axis=(1, 2)))
        np.minimum.at(first, cells.ravel()[np.flatnonzero(near)], who_is_near)
    at, by = np.append(times, np.inf)[first], np.append(who, -1)[first]
    middles = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    within = area.contains(middles)
    return Sweep(at[within], by[within], area.square_m / max(within.sum(), 1))


def _passed(
    vehicles: Sequence[Vehicle],
    counts: Sequence[int],
    until: float,
    depths: Sequence[float] | None,
) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Return instants (n,), s, in their order, at which a vehicle is at a place (n, 2), m, and
    which one it is.
    """
    times = [np.linspace(0.0, until, count) for count in counts]
    places = [it.sample(at)[:, :3] for it, at in zip(vehicles, times, strict=True)]
    if depths is not None:
        deep = [way[:, 2] > depth - LEVEL_M for way, depth in zip(places, depths, strict=True)]
        times = [at[kept] for at, kept in zip(times, deep, strict=True)]
        places = [way[kept] for way, kept in zip(places, deep, strict=True)]
    who = np.repeat(np.arange(len(vehicles)), [len(at) for at in times])
    together = np.concatenate(times)
    order = np.argsort(together, kind="stable")
    return together[order], np.concatenate(places)[order, :2], who[order]
