"""The fleet at the start of a mission: each vehicle on its route, each AUV with its drift."""

import math

import numpy as np

from . import dead_reckoning
from .dead_reckoning import Drift
from .fleet import Asv, Auv
from .formation import formation, formation_radius
from .navigation import INNOVATIONS, FixedGain, Position
from .paths import Path
from .routes import lawnmower, waypoint_path
from .scenario import Scenario
from .streams import Purpose, Streams
from .track_file import read_track
from .turns import there_and_back
from .vehicles import Kinematic, Moored, Place, Recorded, Vehicle


def launch_auvs(scenario: Scenario, streams: Streams) -> list[Auv]:
    """Return the AUVs of a scenario, in index order."""
    return [_auv(scenario, streams, index) for index in range(scenario.auvs.count)]


def _auv(scenario: Scenario, streams: Streams, index: int) -> Auv:
    vehicle = auv_vehicle(scenario, index)
    drift = _drift(scenario, vehicle, streams, index)

    def dead_reckoned(time: float) -> Position:
        place, (x, y) = vehicle.at(time), drift.at(time)
        return place.x + x, place.y + y

    navigation = scenario.navigation
    reference = INNOVATIONS[navigation.delay_compensation]
    return Auv(index, vehicle, drift, FixedGain(dead_reckoned, navigation.gain, reference))


def _drift(scenario: Scenario, vehicle: Vehicle, streams: Streams, index: int) -> Drift:
    navigation, rate = scenario.navigation, scenario.navigation.imu_rate_hz
    count = max(1, math.ceil(scenario.duration_s * rate))
    times = np.arange(count + 1) / rate
    bias = dead_reckoning.bias_drift(
        navigation.velocity_bias_m_per_s,
        navigation.bias_frame,
        times,
        vehicle.heading_integral(times),
    )
    noise = streams.of(Purpose.DRIFT, index).standard_normal((count, 2))
    return Drift(rate, bias, navigation.random_walk_m_per_sqrt_s, noise)


def auv_vehicle(scenario: Scenario, index: int) -> Vehicle:
    """Return one AUV on its route, at its depth."""
    route, depth = scenario.auvs.route, scenario.survey.depth_m
    if route.kind == "hold":
        return Moored(Place(*route.positions_m[index], depth, 0.0))
    if route.kind == "track":
        return Recorded(*read_track(route.files[index]))
    auvs = scenario.auvs
    tour = there_and_back(
        planned_path(scenario, index),
        scenario.survey.side_m,
        auvs.turning_radius_m,
        math.radians(auvs.join_angle_deg),
    )
    return Kinematic(tour, auvs.speed_m_per_s, depth)


def planned_path(scenario: Scenario, index: int) -> Path:
    """Return the path that one AUV is to fly, once through (routes lawnmower and waypoints).

    Raises:
        ValueError: when the route has no plan: an AUV that holds or repeats a track.
    """
    auvs, side, route = scenario.auvs, scenario.survey.side_m, scenario.auvs.route
    if route.kind == "waypoints":
        return waypoint_path(route.points_m[index], auvs.turning_radius_m)
    if route.kind != "lawnmower":
        raise ValueError(f"an AUV whose route is {route.kind!r} has no planned path")
    spacing, margin = route.lane_spacing_m, route.end_margin_m
    return lawnmower(
        side,
        auvs.count,
        index,
        spacing=spacing,
        margin=spacing / 2 if margin is None else margin,
        radius=auvs.turning_radius_m,
        start=route.start,
        turns=route.turns,
        join_angle=math.radians(auvs.join_angle_deg),
    )


def launch_asvs(scenario: Scenario) -> list[Asv]:
    """Return the ASVs of a scenario at their stations, in index order."""
    return [
        Asv(index, Moored(Place(x, y, 0.0, 0.0)))
        for index, (x, y) in enumerate(asv_stations(scenario))
    ]


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
