"""Where the vehicles of a scenario are to go, and where they are to keep station."""

import math

from ..geometry.formation import formation, formation_radius
from ..geometry.paths import Path
from ..geometry.routes import lawnmower, waypoint_path
from ..geometry.turns import there_and_back
from .scenario import Scenario


def turning_radius(scenario: Scenario) -> float:
    """Return the radius (m) of planned turns: as asked for, or as the vehicle model can turn."""
    auvs = scenario.auvs
    if not auvs.vehicle.has_dynamics:
        return auvs.turning_radius_m
    from ..vehicles.guidance import smallest_turn

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


def horizontal_reach(scenario: Scenario) -> float:
    """Return how far (m), seen from above, an ASV hears an AUV at the survey's depth."""
    hf, depth = scenario.acoustics.hf, scenario.survey.depth_m
    if hf.range_metric == "horizontal":
        return hf.range_m
    return math.sqrt(max(hf.range_m**2 - depth**2, 0.0))
