"""What a scenario looks like and is worth, as the page draws it: plain data, from what the commands
`validate`, `coverage`, `timing` and `plan` ask.
"""

from collections.abc import Iterable, Sequence
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
from .desk import Ground, drawn

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
        self._sketched: Ground | None = None
        self.refusal = ""
        source = Source(text, file.name, file.parent)
        try:
            reading = read_scenario(source)
        except ScenarioError as error:
            self.mistakes = error.mistakes
            self._sketched = source.sketch()
            return
        self.warnings, self.mistakes = reading.warnings, reading.unloaded
        if not reading.unloaded:
            self._reading = reading

    @property
    def setup(self) -> Setup | None:
        """The facts of the scenario; None where it is none."""
        return None if self._reading is None else self._reading.setup

    @property
    def site(self) -> Ground | None:
        """What its keys mean, also where they do not agree; None where they mean nothing."""
        return self._sketched or self.setup

    def data(self) -> dict[str, Any]:
        """Return what is wrong, what is warned of, and what the map shows without predictions."""
        chart = None
        try:
            if self.setup is not None:
                chart = chart_of(self.setup)
            elif self.site is not None:  # a vessel on land can be moved off it
                chart = sketch_of(self.site)
        except (ValueError, ArithmeticError) as error:  # of a route that cannot be flown
            if not self.mistakes:
                key, _, message = str(error).partition(": ")
                self.mistakes = (Mistake.at(FilePlace("", 1, 1), key, message),)
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


def sketch_of(site: Ground) -> dict[str, Any]:
    """Return what a map shows of a scenario that cannot be flown: places in m, x north and y east.

    Raises:
        ValueError: when its area is none.
    """
    keys = site.scenario
    return {
        "name": keys.name,
        "outline": [list(corner) for corner in site.area.outline],
        **drawn(site),
        "stations": [list(place) for place in site.kept_stations_m],
        "is_flown": False,
    }


def chart_of(setup: Setup) -> dict[str, Any]:
    """Return what a map of a scenario shows: places in m, x north and y east.

    Raises:
        ValueError: when its route cannot be flown.
    """
    scenario = setup.scenario
    area = setup.area
    return {
        **survey_data(setup),
        **sketch_of(setup),
        "is_flown": True,
        "shadows": shadows(setup, setup.kept_stations_m),
        "area": area.words,
        "duration": timed(scenario.duration_s),
        "vessels": scenario.asvs.count,
        "placement": scenario.asvs.words,
        "reach": reach_of(setup),
        "route": str(scenario.auvs.route.choice),
        "points": [[list(point) for point in way] for way in _points(setup)],
        "ways": [way.round(2).tolist() for way in _ways(setup)],
    }


def reach_of(setup: Setup) -> dict[str, float]:
    """Return how far (m), seen from above, pings and frames go."""
    return {"hf": setup.horizontal_reach_m, "mf": setup.horizontal_mf_reach_m}


def shadows(setup: Setup, stations: Iterable[Sequence[float]]) -> list[list[list[list[float]]]]:
    """Return what land hides from stations (m) within the range of pings: polygons, each its rings
    of corners (m).
    """
    import shapely

    if setup.land is None:
        return []
    hidden = [setup.land.shadow((x, y), setup.horizontal_reach_m) for x, y in stations]
    parts = shapely.get_parts(shapely.simplify(hidden, setup.horizontal_reach_m / 1000.0))
    return [
        [shapely.get_coordinates(ring).round(1).tolist() for ring in shapely.get_rings(part)]
        for part in parts
        if part.geom_type == "Polygon" and not part.is_empty
    ]


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
