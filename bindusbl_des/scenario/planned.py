"""Where the vehicles of a scenario are to go, and where they are to keep station.

Whoever wants to know asks here: what somebody's own placement or route says is asked for once.
"""

import math
from functools import lru_cache
from typing import TYPE_CHECKING

from ..core.plugins import PluginError, load
from ..geometry.formation import formation, formation_radius
from ..geometry.paths import Path
from ..geometry.routes import Strip, lawnmower, waypoint_path
from ..geometry.turns import there_and_back
from .families import PLACEMENT, ROUTE
from .part_choice import PartChoice
from .scenario import Scenario
from .sections.own import OwnPlacement, OwnRoute
from .sections.routes import Hold, Lawnmower, Track, Waypoints

if TYPE_CHECKING:
    from ..vehicles.tracks import Track as RecordedTrack
    from .own_plans import PlanView, Points, Tracks


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
    auvs, side, route = scenario.auvs, scenario.survey.side_m, route_of(scenario)
    if route.kind == "waypoints":
        return waypoint_path(route.points_m[index], turning_radius(scenario))
    if not isinstance(route, Lawnmower):
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
        Strip(side, auvs.count, index),
        spacing=spacing,
        margin=spacing / 2 if margin is None else margin,
        radius=radius,
        start=route.start,
        turns=route.turns,
        join_angle=math.radians(auvs.join_angle_deg),
    )


def route_of(scenario: Scenario) -> "Lawnmower | Hold | Waypoints | Track | Points | Tracks":
    """Return the route of a scenario: that of somebody's own as its way points or tracks.

    Raises:
        PluginError: when one's own is not allowed, cannot be used, or makes no route.
    """
    route = scenario.auvs.route
    if not isinstance(route, OwnRoute):
        return route
    return _own_route(scenario, route.choice, id(load(ROUTE, str(route.choice))))


@lru_cache(maxsize=4)
def _own_route(scenario: Scenario, choice: PartChoice, _loaded: int) -> "Points | Tracks":
    from .own_plans import own_route

    return own_route(scenario, choice, _view(scenario))


def known_route(scenario: Scenario) -> "Lawnmower | Hold | Waypoints | Track | Points | Tracks":
    """Return the route for an estimate: lanes stand in for one's own that cannot be asked."""
    try:
        return route_of(scenario)
    except PluginError:
        return Lawnmower()


def tracks_of(scenario: Scenario) -> "list[RecordedTrack] | None":
    """Return the tracks (times (n,), s, places (n, 3), m) that AUVs repeat; None if they do not."""
    route = route_of(scenario)
    if isinstance(route, Track):
        from ..vehicles.tracks import read_tracks

        return read_tracks(route.files, route.time_offset_s, scenario.duration_s)
    return list(route.tracks) if route.kind == "track" else None


def asv_stations(scenario: Scenario) -> list[tuple[float, float]]:
    """Return where the ASVs keep station, [x, y] in m (eq. formation).

    Raises:
        PluginError: when a placement of one's own is not allowed, cannot be used, or makes none.
    """
    asked, asvs = scenario.asvs.formation, scenario.asvs
    if isinstance(asked, OwnPlacement):
        return list(_own_stations(scenario, asked.choice, id(load(PLACEMENT, str(asked.choice)))))
    if asked.positions_m is not None:
        return list(asked.positions_m)
    radius = asked.radius_m
    if radius is None:
        radius = formation_radius(scenario.acoustics.hf.range_m, asked.clearance_m)
    vertices = formation(asvs.count, radius, math.radians(asked.angle_deg))
    return [(x, y) for x, y in vertices.tolist()]


@lru_cache(maxsize=4)
def _own_stations(
    scenario: Scenario, choice: PartChoice, _loaded: int
) -> tuple[tuple[float, float], ...]:
    from .own_plans import own_stations

    return tuple(own_stations(scenario, choice, _view(scenario)))


def known_stations(scenario: Scenario) -> list[tuple[float, float]]:
    """Return where ASVs lie, for an estimate: a ring stands in for a placement of one's own that
    cannot be asked.
    """
    try:
        return asv_stations(scenario)
    except PluginError:
        radius = formation_radius(scenario.acoustics.hf.range_m)
        return [(x, y) for x, y in formation(scenario.asvs.count, radius).tolist()]


def _view(scenario: Scenario) -> "PlanView":
    from .own_plans import PlanView

    bands, auvs = scenario.acoustics, scenario.auvs
    return PlanView(
        auvs=auvs.count,
        asvs=scenario.asvs.count,
        side=scenario.survey.side_m,
        depth=scenario.survey.depth_m,
        hf_range=bands.hf.range_m,
        mf_range=bands.mf.range_m,
        speed=auvs.speed_m_per_s,
        turning_radius=turning_radius(scenario),
        duration=scenario.duration_s,
    )


def horizontal_reach(scenario: Scenario) -> float:
    """Return how far (m), seen from above, an ASV hears an AUV at the survey's depth."""
    hf, depth = scenario.acoustics.hf, scenario.survey.depth_m
    if hf.range_metric == "horizontal":
        return hf.range_m
    return math.sqrt(max(hf.range_m**2 - depth**2, 0.0))
