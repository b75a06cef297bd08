"""What is planned for each AUV of a scenario, and the chart by which its fleet schedules."""

from ..protocol.chart import Array, CarriedForward, Chart, Course, LastFixes, Shifted, Touring
from ..scenario.planned import route_of, tracks_of
from ..scenario.plans import planned_tour
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
    auvs, route = scenario.auvs, route_of(scenario)
    if route.kind == "hold":
        depth = scenario.survey.depth
        held = enumerate(route.positions_m)
        return [Shifted(moored(Place(x, y, depth(auv), 0.0))) for auv, (x, y) in held]
    tracks = tracks_of(scenario)
    if tracks is not None:
        return [Shifted(recorded(*track)) for track in tracks]
    tours = (planned_tour(scenario, auv) for auv in range(auvs.count))
    return [Touring(tour, speed) for tour, speed in zip(tours, auvs.speeds, strict=True)]
