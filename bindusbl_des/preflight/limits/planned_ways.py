"""Where AUVs and ASVs are going to be, if they keep to their plans."""

import numpy as np
from numpy.typing import NDArray

from ...scenario.planned import known_stations, route_of, tracks_of
from ...scenario.plans import planned_tours
from ...scenario.scenario import Scenario
from ...vehicles.vehicle import Place, SegmentedTrajectory, kinematic, moored, recorded

Floats = NDArray[np.float64]


def planned_vehicles(scenario: Scenario) -> list[SegmentedTrajectory]:
    """Return the AUVs of a scenario as they are planned, AUV0 first.

    Those with dynamics are taken for vehicles without, at the speed that they are to go.

    Raises:
        ValueError: when the route cannot be flown.
        PluginError: when one's own is not allowed, or makes none.
    """
    route, tracks = route_of(scenario), tracks_of(scenario)
    if tracks is not None:
        return [recorded(*track) for track in tracks]
    depths = [scenario.survey.depth(auv) for auv in range(scenario.auvs.count)]
    if route.kind == "hold":
        places = zip(route.positions_m, depths, strict=True)
        return [moored(Place(x, y, depth, 0.0)) for (x, y), depth in places]
    ways = zip(planned_tours(scenario), scenario.auvs.speeds, depths, strict=True)
    return [kinematic(tour, speed, depth, scenario.duration_s) for tour, speed, depth in ways]


def planned_places(scenario: Scenario, times: Floats) -> Floats:
    """Return where the n AUVs are to be at k instants (s), shape (k, n, 3), m.

    Raises:
        ValueError, PluginError: as of :func:`planned_vehicles`.
    """
    ways = [vehicle.sample(times)[:, :2] for vehicle in planned_vehicles(scenario)]
    places = np.empty((len(times), len(ways), 3))
    for auv, way in enumerate(ways):
        places[:, auv, :2], places[:, auv, 2] = way, scenario.survey.depth(auv)
    return places


def planned_stations(scenario: Scenario, instants: int) -> Floats:
    """Return where the m ASVs lie at so many instants, shape (instants, m, 3), m; a ring stands in
    for those that move.
    """
    stations = np.array(known_stations(scenario), dtype=np.float64)
    flat = np.column_stack((stations, np.zeros(len(stations))))
    return np.broadcast_to(flat, (instants, *flat.shape))
