"""The predictions that a page shows: numbers of each AUV, and a map over the survey."""

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ....core.setup import Setup
from ....support.arrays import Floats
from ...preflight.fix_chance import Grid, fix_chance, mean_chance, survey_grid
from ..goals import Goal
from ..teams import value_of
from .gathering import inputs_of
from .inputs import Inputs
from .mapping import OnWays, error_map, lane_map, nearest_on_ways
from .predicting import predict

# What shades a map: the error of AUVs on their lanes, the error of an AUV that dwells, or the
# probability that a ping makes a fix.
Shade = Literal["lanes", "dwells", "chance"]

# Cells along a side of the survey: at rest, and while the user drags.
FINE, COARSE = 48, 20

COLUMNS = (
    "position_error_m", "position_error_rms_m", "position_error_p95_m", "hf_coverage",
    "fix_rate_hz", "fix_age_mean_s", "fix_age_p95_s", "fix_age_max_s",
)  # fmt: skip


class Forecast:
    """Predictions of a scenario with its vessels at any stations.

    `left_out` are sentences on what predictions leave out.
    """

    def __init__(self, setup: Setup, inputs: Inputs | None = None) -> None:
        """Compute what does not depend on stations; `inputs` of the setup may be given if known.

        Raises:
            ValueError: when the scenario cannot be predicted, saying why.
        """
        if not setup.kept_stations_m:
            why = "without a vessel that keeps its place nothing is predicted"
            raise ValueError(f"{why}; simulate the mission")
        self.setup, self._inputs = setup, inputs or inputs_of(setup)
        self.left_out = self._inputs.approximations
        self._grids: dict[int, tuple[Grid, OnWays]] = {}

    def _grid(self, cells: int) -> tuple[Grid, OnWays]:
        """Return a grid of `cells` along a side, and the paths' nearest point to each cell."""
        if cells not in self._grids:
            grid = survey_grid(self.setup, cells)
            self._grids[cells] = grid, nearest_on_ways(self._inputs.ways, grid.middles[:, :2])
        return self._grids[cells]

    def errors(
        self, stations: ArrayLike, shade: Shade, cells: int = FINE, goal: Goal | None = None
    ) -> dict[str, Any]:
        """Return predictions with vessels at `stations` (m, 2; m): the worst AUV of a mission
        (`worst`), each AUV (`auvs`), the map (`shade`), and the value of a `goal` (`asked`), nan
        where its metric is not predicted.
        """
        asvs = np.asarray(stations, dtype=np.float64)
        found = predict(self._inputs, asvs)
        grid, nearest = self._grid(cells)
        if shade == "lanes":
            values = lane_map(nearest, found.error_over_time)
        elif shade == "dwells":
            values = error_map(self._inputs, asvs, grid.middles[:, :2]).error_m
        else:
            known = fix_chance(self.setup, asvs, grid.middles)
            values = np.full(len(grid.middles), np.nan) if known is None else known
        return {
            "worst": {name: found.worst(name) for name in COLUMNS},
            "auvs": [
                {name: float(getattr(found, name)[auv]) for name in COLUMNS}
                for auv in range(len(found.position_error_m))
            ],
            "shade": {"kind": shade, **_drawn(grid, values)},
            **({} if goal is None else {"asked": value_of(goal, found)}),
        }

    def at(
        self, stations: ArrayLike, shade: Shade, cells: int = FINE, goal: Goal | None = None
    ) -> dict[str, Any]:
        """Return the same, and the mean and least chance of a fix over the survey (`chance`)."""
        asvs = np.asarray(stations, dtype=np.float64)
        if cells == COARSE:
            chance = self._chance(asvs, self._grid(cells)[0])
        else:
            chance = mean_chance(self.setup, asvs, cells)
        told = None if chance is None else list(chance)
        return {**self.errors(asvs, shade, cells, goal), "chance": told}

    def _chance(self, asvs: Floats, grid: Grid) -> tuple[float, float] | None:
        """Return the mean and the least probability of a fix at the centres of cells."""
        found = fix_chance(self.setup, asvs, grid.middles[grid.inside])
        if found is None:
            return None
        return float(np.average(found, weights=grid.share[grid.inside])), float(found.min())


def _drawn(grid: Grid, values: Floats) -> dict[str, Any]:
    """Return a grid's cells as plain data, with None outside the survey or if unknown."""
    known = grid.inside & np.isfinite(values)
    found = [float(f"{value:.4g}") if told else None
             for value, told in zip(values.tolist(), known.tolist(), strict=True)]  # fmt: skip
    return {"box": list(grid.box), "across": grid.across, "values": found}
