"""What a scenario looks like and is worth, as the page draws it: plain data, from what the commands
`validate`, `coverage`, `timing` and `plan` ask.
"""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ...core.scenario.files.scenario_file import Source
from ...core.setup import Setup
from ...support.arrays import Floats
from ...support.facts import cached_property
from ...support.mistakes import FilePlace, Mistake, ScenarioError
from ...support.wording import timed
from ..planning.prediction.gathering import inputs_of
from ..planning.prediction.mapping import error_map, lane_map, nearest_on_ways
from ..planning.prediction.predicting import predict
from ..preflight.fix_chance import Grid, fix_chance, mean_chance, survey_grid
from ..preflight.warnings import Reading, read_scenario
from ..report.run_data import survey_data

# What a map is shaded by: the error of AUVs on their lanes, of one that dwells at a place, and the
# chance that a ping from there makes a fix.
Shade = Literal["lanes", "dwells", "chance"]

# Cells along a side of the survey: at rest, and while something is dragged.
FINE, COARSE = 48, 20
# So many points of each AUV's way are drawn.
MOST_POINTS = 800
# So far apart (m) they lie at least, for turns to look round.
LEAST_STEP_M = 2.0

COLUMNS = (
    "position_error_m", "position_error_p95_m", "hf_coverage", "fix_rate_hz", "fix_age_mean_s",
    "fix_age_max_s",
)  # fmt: skip


class Look:
    """A scenario file as it is now: what is wrong with it, and what it means.

    What is worked out for one placement of the vessels serves for others, so that they can be
    dragged.
    """

    def __init__(self, text: str, file: Path) -> None:
        """Look at the text of a file, by which messages call it."""
        self.mistakes: Sequence[Mistake] = ()
        self.warnings: Sequence[Mistake] = ()
        self._reading: Reading | None = None
        self.refusal = ""
        try:
            reading = read_scenario(Source(text, file.name, file.parent))
        except ScenarioError as error:
            self.mistakes = error.mistakes
            return
        self.warnings, self.mistakes = reading.warnings, reading.unloaded
        if not reading.unloaded:
            self._reading = reading

    @property
    def setup(self) -> Setup | None:
        """The facts of the scenario; None where it is none."""
        return None if self._reading is None else self._reading.setup

    def data(self) -> dict[str, Any]:
        """Return what is wrong, what is warned of, and what the map shows without predictions."""
        try:
            chart = None if self.setup is None else chart_of(self.setup)
        except (ValueError, ArithmeticError) as error:  # of a route that cannot be flown
            key, _, message = str(error).partition(": ")
            found = Mistake.at(FilePlace("", 1, 1), key, message)
            self.mistakes, chart = (*self.mistakes, found), None
        return {
            "mistakes": [asdict(mistake) for mistake in self.mistakes],
            "warnings": [asdict(warning) for warning in self.warnings],
            "chart": chart,
        }

    @cached_property
    def forecast(self) -> "Forecast | None":
        """What predicts its errors; None, and a `refusal`, where nothing does."""
        if self.setup is None:
            return None
        try:
            return Forecast(self.setup)
        except (ValueError, ArithmeticError) as error:
            self.refusal = str(error)
        return None


def chart_of(setup: Setup) -> dict[str, Any]:
    """Return what a map of a scenario shows: places in m, x north and y east.

    Raises:
        ValueError: when its route cannot be flown.
    """
    scenario = setup.scenario
    area = setup.area
    return {
        "name": scenario.name,
        **survey_data(setup),
        "area": area.words,
        "duration": timed(scenario.duration_s),
        "stations": [list(place) for place in setup.kept_stations_m],
        "vessels": scenario.asvs.count,
        "placement": scenario.asvs.words,
        "reach": {"hf": setup.horizontal_reach_m, "mf": setup.horizontal_mf_reach_m},
        "route": str(scenario.auvs.route.choice),
        "points": [[list(point) for point in way] for way in _points(setup)],
        "ways": [way.round(2).tolist() for way in _ways(setup)],
    }


def _points(setup: Setup) -> Sequence[Sequence[Sequence[float]]]:
    """Return the places that a route gives each AUV, which can be dragged; none of lanes."""
    return setup.route.places if setup.scenario.auvs.route.places_key != "files" else ()


def _ways(setup: Setup) -> list[Floats]:
    """Return the way (n, 2), m, of each AUV."""
    found: list[Floats] = []
    every = zip(setup.plans, setup.auv_tracks, setup.held_places_m, strict=True)
    for plan, track, held in every:
        if track is not None:
            way = track[1][:, :2]
            found.append(way[:: max(1, -(-len(way) // MOST_POINTS))])
        elif plan is not None:
            length = plan.path.length
            count = int(min(max(length / LEAST_STEP_M, 2), MOST_POINTS))
            found.append(plan.path.sample(np.linspace(0.0, length, count))[:, :2])
        else:
            found.append(np.array([held], dtype=np.float64))
    return found


class Forecast:
    """What is predicted of a scenario with its vessels at any stations.

    `left_out` are sentences on what predictions leave out.
    """

    def __init__(self, setup: Setup) -> None:
        """Work out all that does not depend on the stations.

        Raises:
            ValueError: when nothing is predicted of such a scenario, saying why.
        """
        if not setup.kept_stations_m:
            raise ValueError("vessels that move are not predicted; simulate the mission")
        self.setup, self._inputs = setup, inputs_of(setup)
        self.left_out = self._inputs.approximations
        self._grids = {cells: survey_grid(setup, cells) for cells in (FINE, COARSE)}
        self._nearest = {
            cells: nearest_on_ways(self._inputs.ways, grid.middles[:, :2])
            for cells, grid in self._grids.items()
        }

    def at(self, stations: ArrayLike, shade: Shade, cells: int = FINE) -> dict[str, Any]:
        """Return what is predicted with vessels at `stations` (m, 2), m: of the worst AUV of a
        mission and of each AUV, the chance of a fix over the survey, and the map's shades.
        """
        asvs = np.asarray(stations, dtype=np.float64)
        found = predict(self._inputs, asvs)
        grid = self._grids[cells]
        chance = (
            self._chance(asvs, grid) if cells == COARSE else mean_chance(self.setup, asvs, cells)
        )
        if shade == "lanes":
            values = lane_map(self._nearest[cells], found.error_over_time)
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
            "chance": None if chance is None else list(chance),
            "shade": {"kind": shade, **_drawn(grid, values)},
        }

    def _chance(self, asvs: Floats, grid: Grid) -> tuple[float, float] | None:
        """Return the mean and the least chance of a fix by the middles of cells."""
        found = fix_chance(self.setup, asvs, grid.middles[grid.inside])
        if found is None:
            return None
        return float(np.average(found, weights=grid.share[grid.inside])), float(found.min())


def _drawn(grid: Grid, values: Floats) -> dict[str, Any]:
    """Return the cells of a grid as a page draws them: None outside the survey, or not known."""
    known = grid.inside & np.isfinite(values)
    found = [float(f"{value:.4g}") if told else None
             for value, told in zip(values.tolist(), known.tolist(), strict=True)]  # fmt: skip
    return {"box": list(grid.box), "across": grid.across, "values": found}
