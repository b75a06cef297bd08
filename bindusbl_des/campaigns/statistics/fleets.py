"""What the AUVs of a campaign's missions got, each for itself."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...results.arrow import numpy_columns
from ..storage.parts import read_table
from .intervals import Floats
from .outcomes import Whole, auv_numbers, check_recorded


@dataclass(frozen=True)
class Fleets:
    """A row per AUV of each mission that went well: its point, seed, number and metrics.

    A metric that has no value is nan.
    """

    point: Whole
    seed: Whole
    auv: Whole
    metrics: Mapping[str, Floats]

    def by_seed(self, metric: str) -> tuple[list[tuple[int, int]], Floats]:
        """Return point and number of every AUV, and their metric (AUVs, seeds), nan for none."""
        auvs = int(self.auv.max(initial=0)) + 1
        who, row = np.unique(self.point * auvs + self.auv, return_inverse=True)
        seeds, column = np.unique(self.seed, return_inverse=True)
        table = np.full((len(who), len(seeds)), np.nan)
        table[row, column] = self.metrics[metric]
        return [divmod(it, auvs) for it in who.tolist()], table

    def without(self, point: int, metric: str, seeds: Whole) -> dict[str, int]:
        """Return in how many of some missions of a point each AUV has no value, most first."""
        here = (self.point == point) & np.isin(self.seed, seeds)
        return _counted(self.auv[here & np.isnan(self.metrics[metric])])


@dataclass(frozen=True)
class Starved:
    """AUVs that got no fix at a point, each in how many of its missions."""

    point: int
    missions: int
    auvs: Mapping[str, int]


def fleets(folder: Path, metrics: Sequence[str]) -> Fleets:
    """Read metrics of all AUVs of a campaign's missions that went well.

    Raises:
        CampaignError: when an older version ran it, which did not record one of them.
    """
    rows = read_table(folder, "auvs", ("point", "seed", "auv", *metrics))
    if rows is None:
        none = np.zeros(0, np.int64)
        return Fleets(none, none, none, {name: np.zeros(0) for name in metrics})
    check_recorded(folder, rows, metrics)
    columns = numpy_columns(rows.drop_columns("auv"))
    return Fleets(
        columns["point"],
        columns["seed"],
        auv_numbers(rows["auv"]),
        {name: columns[name].astype(float, copy=False) for name in metrics},
    )


def starved(found: Fleets) -> list[Starved]:
    """Return the points at which some AUV got no fix in some mission, those with most first."""
    none = found.metrics["fixes_delivered"] == 0
    well = np.bincount(found.point[found.auv == 0])  # every mission has that AUV
    order = np.argsort(found.point[none], kind="stable")
    points, starts = np.unique(found.point[none][order], return_index=True)
    auvs = np.split(found.auv[none][order], starts)[1:]
    at = [
        Starved(point, int(well[point]), _counted(who))
        for point, who in zip(points.tolist(), auvs, strict=True)
    ]
    return sorted(at, key=lambda it: (-max(it.auvs.values()) / it.missions, it.point))


def _counted(auvs: Whole) -> dict[str, int]:
    numbers, counts = np.unique(auvs, return_counts=True)
    found = {f"AUV{n}": int(c) for n, c in zip(numbers, counts, strict=True)}
    return dict(sorted(found.items(), key=lambda it: -it[1]))
