"""What is planned for each AUV of a scenario, and the chart by which its fleet schedules."""

from functools import lru_cache

from ..geometry.paths import Path
from ..protocol.chart import Array, CarriedForward, Chart, Course, LastFixes, Shifted, Touring
from ..scenario.planned import planned_tour, tracks_of
from ..scenario.scenario import Scenario
from ..vehicles.vehicle import Place, moored, recorded


def chart_of(scenario: Scenario, launched: Array) -> Chart | None:
    """Return the chart by which a fleet schedules; None where it knows the truth."""
    match scenario.protocol.positions:
        case "last_fix":
            return LastFixes(launched)
        case "carried_forward":
            return CarriedForward(launched, courses(scenario))
        case _:
            return None


def courses(scenario: Scenario) -> list[Course]:
    """Return what is planned for each AUV of a scenario."""
    auvs = scenario.auvs
    if auvs.route.kind == "hold":
        depth = scenario.survey.depth_m
        return [Shifted(moored(Place(x, y, depth, 0.0))) for x, y in auvs.route.positions_m]
    tracks = tracks_of(scenario)
    if tracks is not None:
        return [Shifted(recorded(*track)) for track in tracks]
    return [Touring(tour, auvs.speed_m_per_s) for tour in _tours(scenario)]


@lru_cache(maxsize=2)
def _tours(scenario: Scenario) -> tuple[Path, ...]:
    return tuple(planned_tour(scenario, auv) for auv in range(scenario.auvs.count))
