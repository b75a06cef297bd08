"""What a scenario looks like and is worth, as the page draws it: plain data, from what the commands
`validate`, `coverage`, `timing` and `plan` ask.
"""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from ...core.scenario.files.scenario_file import Source
from ...core.setup import Setup
from ...support.arrays import Floats
from ...support.facts import cached_property
from ...support.mistakes import FilePlace, Mistake, ScenarioError
from ...support.wording import timed
from ..planning.prediction.forecast import Forecast
from ..preflight.warnings import Reading, read_scenario
from ..report.run_data import survey_data

# So many points of each AUV's way are drawn.
MOST_POINTS = 800
# So far apart (m) they lie at least, for turns to look round.
LEAST_STEP_M = 2.0


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
    def forecast(self) -> Forecast | None:
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
