"""What is planned for each AUV of a scenario, and what its fleet goes by when it schedules."""

from ..protocol.chart import Array, CarriedForward, Chart, Course, LastFixes, Shifted, Touring
from ..protocol.ranging import planned_speeds
from ..protocol.schedules.known import Known, Plans
from ..records.recorder import Recorder
from ..scenario.instruments.own_sensors import straight_drift_rms
from ..scenario.planned import route_of, tracks_of
from ..scenario.plans import planned_tours
from ..scenario.scenario import Scenario
from ..scenario.sections.anchors import Placed
from ..scenario.telling import positions_of
from ..vehicles.fleet import Fleet
from ..vehicles.vehicle import Place, moored, recorded


def chart_of(scenario: Scenario, launched: Array) -> Chart | None:
    """Return the chart by which a fleet schedules; None where it knows the truth."""
    match positions_of(scenario):
        case "last_fix":
            return LastFixes(launched)
        case "carried_forward":
            return CarriedForward(launched, courses(scenario))
        case _:
            return None


def known_of(scenario: Scenario, auvs: Fleet, record: Recorder) -> Known:
    """Return what a fleet will know of its AUVs' estimates and places, by what it has planned."""
    speeds, water = planned_speeds(scenario, auvs), scenario.environment
    carried = 0.0
    if scenario.auvs.vehicle.has_dynamics:
        carried = water.current_m_per_s + 3.0 * water.current_variation_m_per_s
    formation = scenario.asvs.formation
    vessels = formation.speed_m_per_s if isinstance(formation, Placed) else 0.0

    def drift(auv: int, time: float) -> float:
        return straight_drift_rms(scenario, time, float(speeds[auv]))

    initial, positions = scenario.navigation.initial_position_sd_m, positions_of(scenario)
    moving = speeds + carried
    return Known(record, Plans(initial, moving, moving + vessels, drift, positions))


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
    tours = zip(planned_tours(scenario), auvs.speeds, strict=True)
    return [Touring(tour, speed) for tour, speed in tours]
