"""The fleet at the start of a mission: each vehicle on its route, each AUV with its drift."""

import math

import numpy as np
from numpy.typing import NDArray

from .dead_reckoning import Drift, SteeredDrift, bias_drift
from .fleet import Asv, Auv
from .formations import formation, formation_radius
from .guidance import Voyage, smallest_turn
from .navigation import INNOVATIONS, FixedGain, Position
from .paths import Path
from .routes import lawnmower, waypoint_path
from .scenario import Scenario
from .streams import Streams
from .track_file import read_track
from .turns import there_and_back
from .vehicles import Kinematic, Moored, Place, Recorded, Vehicle
from .voyages import Water, asv_voyage, auv_voyage, walks

Array = NDArray[np.float64]


def launch_auvs(scenario: Scenario, streams: Streams, water: Water) -> list[Auv]:
    """Return the AUVs of a scenario, in index order."""
    auvs, lost = scenario.auvs, walks(scenario, streams, water)
    voyage = None
    if auvs.vehicle.has_dynamics:
        tours = [planned_tour(scenario, index) for index in range(auvs.count)]
        voyage = auv_voyage(scenario, tours, water, lost)
    return [_auv(scenario, index, walk, voyage) for index, walk in enumerate(lost)]


def _auv(scenario: Scenario, index: int, walk: Array, voyage: Voyage | None) -> Auv:
    navigation = scenario.navigation
    rate, bias, frame = (
        navigation.imu_rate_hz,
        navigation.velocity_bias_m_per_s,
        navigation.bias_frame,
    )
    vehicle = kinematic_vehicle(scenario, index) if voyage is None else voyage.member(index)
    drift: Drift | SteeredDrift
    if scenario.auvs.feedback == "estimate":
        drift = SteeredDrift(Drift(rate, walk), bias, frame, vehicle.heading_integral)
    else:
        times = np.arange(len(walk)) / rate
        biased = bias_drift(bias, frame, times, vehicle.heading_integral(times))
        drift = Drift(rate, walk + biased)

    def dead_reckoned(time: float) -> Position:
        place, (x, y) = vehicle.at(time), drift.at(time)
        return place.x + x, place.y + y

    def steer(corrections: Position) -> None:
        if voyage is not None:
            voyage.corrections[index] = corrections

    reference = INNOVATIONS[navigation.delay_compensation]
    return Auv(index, vehicle, drift, FixedGain(dead_reckoned, navigation.gain, reference, steer))


def kinematic_vehicle(scenario: Scenario, index: int) -> Vehicle:
    """Return one AUV without dynamics on its route, at its depth."""
    route, depth = scenario.auvs.route, scenario.survey.depth_m
    if route.kind == "hold":
        return Moored(Place(*route.positions_m[index], depth, 0.0))
    if route.kind == "track":
        return Recorded(*read_track(route.files[index]))
    return Kinematic(planned_tour(scenario, index), scenario.auvs.speed_m_per_s, depth)


def turning_radius(scenario: Scenario) -> float:
    """Return the radius (m) of planned turns: as asked for, or as the vehicle model can turn."""
    auvs = scenario.auvs
    if not auvs.vehicle.has_dynamics:
        return auvs.turning_radius_m
    try:
        return smallest_turn(
            auvs.vehicle.model, auvs.speed_m_per_s, dict(auvs.vehicle.coefficients)
        )
    except ValueError as error:
        raise ValueError(f"auvs.speed_m_per_s: {error}; ask for less") from None


def planned_tour(scenario: Scenario, index: int) -> Path:
    """Return the endless tour of one AUV along its planned path, there and back."""
    return there_and_back(
        planned_path(scenario, index),
        scenario.survey.side_m,
        turning_radius(scenario),
        math.radians(scenario.auvs.join_angle_deg),
    )


def planned_path(scenario: Scenario, index: int) -> Path:
    """Return the path that one AUV is to fly, once through (routes lawnmower and waypoints).

    Raises:
        ValueError: when the route has no plan: an AUV that holds or repeats a track.
    """
    auvs, side, route = scenario.auvs, scenario.survey.side_m, scenario.auvs.route
    if route.kind == "waypoints":
        return waypoint_path(route.points_m[index], turning_radius(scenario))
    if route.kind != "lawnmower":
        raise ValueError(f"an AUV whose route is {route.kind!r} has no planned path")
    spacing, margin = route.lane_spacing_m, route.end_margin_m
    radius = turning_radius(scenario)
    if 2 * radius > side:
        raise ValueError(
            f"auvs.vehicle: at {auvs.speed_m_per_s:g} m/s {auvs.vehicle} turns with a radius of "
            f"{radius:.1f} m, too wide for a survey of {side:g} m; use another vehicle (bluerov2 "
            "turns tightly), another speed or a larger survey"
        )
    return lawnmower(
        side,
        auvs.count,
        index,
        spacing=spacing,
        margin=spacing / 2 if margin is None else margin,
        radius=radius,
        start=route.start,
        turns=route.turns,
        join_angle=math.radians(auvs.join_angle_deg),
    )


def launch_asvs(scenario: Scenario, streams: Streams, water: Water) -> list[Asv]:
    """Return the ASVs of a scenario at their stations, in index order."""
    stations = asv_stations(scenario)
    if scenario.asvs.vehicle.has_dynamics:
        voyage = asv_voyage(scenario, stations, streams, water)
        return [Asv(index, voyage.member(index)) for index in range(len(stations))]
    return [Asv(index, Moored(Place(x, y, 0.0, 0.0))) for index, (x, y) in enumerate(stations)]


def asv_stations(scenario: Scenario) -> list[tuple[float, float]]:
    """Return where the ASVs keep station, [x, y] in m (eq. formation)."""
    asked, asvs = scenario.asvs.formation, scenario.asvs
    if asked.positions_m is not None:
        return list(asked.positions_m)
    radius = asked.radius_m
    if radius is None:
        radius = formation_radius(scenario.acoustics.hf.range_m, asked.clearance_m)
    vertices = formation(asvs.count, radius, math.radians(asked.angle_deg))
    return [(x, y) for x, y in vertices.tolist()]
