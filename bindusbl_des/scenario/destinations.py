"""Where the vehicles of a scenario are to go or to keep station, and which ASVs fail, when.

Whoever wants to know asks here: what somebody's own placement or route says is asked for once.
"""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Literal

from ..core.plugins import PluginError, load
from .families import PLACEMENT, ROUTE
from .key_types import Point
from .part_choice import PartChoice
from .scenario_keys import ScenarioKeys
from .sections.placements import OwnPlacement
from .sections.routes import Hold, Lawnmower, OwnRoute, Track, Waypoints
from .site import area_of, positioned, positioned_stations, recorded_tracks

if TYPE_CHECKING:
    from ..core.arrays import Floats
    from ..geometry.routes import Surfacing
    from ..vehicles.fleet import Failures
    from ..vehicles.tracks import Track as RecordedTrack
    from .own_routes import PlanView, Points, Tracks


class NoStations(ValueError):
    """ASVs keep no stations: they move during the mission."""

    def __init__(self, model: str) -> None:
        super().__init__(
            f"asvs.formation.model: with {model} ASVs move and keep no stations; use ring or "
            "positions, or simulate the mission"
        )


def turning_radius(scenario: ScenarioKeys, auv: int) -> float:
    """Return the radius (m) of an AUV's planned turns: as asked for, or as its model can turn."""
    auvs = scenario.auvs
    if not auvs.vehicle.has_dynamics:
        return auvs.turning_radius_m
    from ..vehicles.guidance import smallest_turn

    try:
        return smallest_turn(auvs.vehicle.model, auvs.speed(auv), dict(auvs.vehicle.coefficients))
    except ValueError as error:
        name = "speeds_m_per_s" if auvs.speeds_m_per_s else "speed_m_per_s"
        raise ValueError(f"auvs.{name}: {error}; ask for less") from None


def surfacing_of(scenario: ScenarioKeys, auv: int) -> "Surfacing | None":
    """Return how an AUV comes up to the surface on its route; None if it does not."""
    from ..geometry.routes import Surfacing

    route, speed = scenario.auvs.route.surfacing, scenario.auvs.speed(auv)
    if route is None or route.surface_every_s is None:
        return None
    return Surfacing(
        speed * route.surface_every_s,
        turning_radius(scenario, auv),
        scenario.survey.depth(auv),
        math.radians(route.climb_angle_deg),
        speed * route.surface_for_s,
    )


def route_of(scenario: ScenarioKeys) -> "Lawnmower | Hold | Waypoints | Track | Points | Tracks":
    """Return the route of a scenario: that of somebody's own as its way points or tracks.

    Raises:
        PluginError: when one's own is not allowed, cannot be used, or makes no route.
    """
    route = scenario.auvs.route
    if not isinstance(route, OwnRoute):
        return positioned(scenario, route)
    return _own_route(scenario, route.choice, id(load(ROUTE, str(route.choice))))


@lru_cache(maxsize=4)
def _own_route(scenario: ScenarioKeys, choice: PartChoice, _loaded: int) -> "Points | Tracks":
    from .own_routes import own_route

    return own_route(scenario, choice, _view(scenario))


def known_route(scenario: ScenarioKeys) -> "Lawnmower | Hold | Waypoints | Track | Points | Tracks":
    """Return the route for an estimate: lanes stand in for one's own that cannot be asked."""
    try:
        return route_of(scenario)
    except PluginError:
        return Lawnmower()


def tracks_of(scenario: ScenarioKeys) -> "list[RecordedTrack] | None":
    """Return the tracks (times (n,), s, places (n, 3), m) that AUVs repeat; None if they do not."""
    route = route_of(scenario)
    if route.recording is not None:
        return recorded_tracks(scenario, route.recording)
    made: tuple[RecordedTrack, ...] | None = getattr(route, "tracks", None)
    return None if made is None else list(made)


def held_places(scenario: ScenarioKeys) -> list[Point] | None:
    """Return where AUVs hold still, [x, y] in m; None if they do not."""
    route = route_of(scenario)
    return [place for (place,) in route.places] if route.is_held else None


def asv_stations(scenario: ScenarioKeys) -> list[tuple[float, float]]:
    """Return where the ASVs keep station, [x, y] in m (eq. formation).

    Raises:
        PluginError: when a placement of one's own is not allowed, cannot be used, or makes none.
        NoStations: when ASVs move.
    """
    asked, asvs = scenario.asvs.formation, scenario.asvs
    if isinstance(asked, OwnPlacement):
        return list(_own_stations(scenario, asked.choice, id(load(PLACEMENT, str(asked.choice)))))
    ring = asked.moored
    if ring is None:
        raise NoStations(asked.choice)
    given = positioned_stations(scenario)
    if given is not None:
        return list(given)
    from ..geometry.formation import formation, formation_radius

    radius = ring.radius_m
    if radius is None:
        radius = formation_radius(scenario.acoustics.hf.range_m, ring.clearance_m)
    return _about_centroid(scenario, formation(asvs.count, radius, math.radians(ring.angle_deg)))


def _about_centroid(scenario: ScenarioKeys, vertices: "Floats") -> list[tuple[float, float]]:
    """Return places (n, 2), m, about the origin as those about the middle of the survey."""
    centre = area_of(scenario).centroid
    places = vertices if centre == (0.0, 0.0) else vertices + centre
    return [(x, y) for x, y in places.tolist()]


@lru_cache(maxsize=4)
def _own_stations(
    scenario: ScenarioKeys, choice: PartChoice, _loaded: int
) -> tuple[tuple[float, float], ...]:
    from .own_routes import own_placement, own_stations

    answer = own_placement(choice, _view(scenario))
    if is_mover(answer):
        raise NoStations(str(choice))
    return tuple(own_stations(scenario, choice, answer))


def are_steered(scenario: ScenarioKeys) -> bool:
    """Tell whether ASVs are told during the mission where to go.

    Raises:
        PluginError: as of :func:`asv_stations`.
    """
    placement = scenario.asvs.formation
    if not isinstance(placement, OwnPlacement):
        return placement.replanned is not None
    return not stations_kept(scenario)


def mover_of(scenario: ScenarioKeys) -> Any:
    """Return what tells ASVs during a mission where to go, made anew, where somebody's own
    placement returns such; None where it returns places, or none is one's own.

    Raises:
        PluginError: when it is not allowed or cannot be used.
    """
    from .own_routes import own_placement

    asked = scenario.asvs.formation
    if not isinstance(asked, OwnPlacement):
        return None
    answer = own_placement(asked.choice, _view(scenario))
    return answer if is_mover(answer) else None


def is_mover(answer: Any) -> bool:
    """Tell whether what a placement returned is to be asked where ASVs go: it has `targets`."""
    return callable(getattr(answer, "targets", None))


def stations_kept(scenario: ScenarioKeys) -> list[tuple[float, float]]:
    """Return where the ASVs keep station, [x, y] in m; none where they move.

    Raises:
        PluginError: as of :func:`asv_stations`.
    """
    try:
        return asv_stations(scenario)
    except NoStations:
        return []


def known_stations(scenario: ScenarioKeys) -> list[tuple[float, float]]:
    """Return where ASVs lie, for an estimate: a ring stands in for those that move, and for a
    placement of one's own that cannot be asked.
    """
    try:
        return asv_stations(scenario)
    except (NoStations, PluginError):
        from ..geometry.formation import formation, formation_radius

        radius = formation_radius(scenario.acoustics.hf.range_m)
        return _about_centroid(scenario, formation(scenario.asvs.count, radius))


def _view(scenario: ScenarioKeys) -> "PlanView":
    from .own_routes import PlanView

    bands, auvs, area = scenario.acoustics, scenario.auvs, area_of(scenario)
    return PlanView(
        auvs=auvs.count,
        asvs=scenario.asvs.count,
        side=area.across,
        depth=scenario.survey.deepest,
        hf_range=bands.hf.range_m,
        mf_range=bands.mf.range_m,
        speed=max(auvs.speeds),
        turning_radius=max(turning_radius(scenario, auv) for auv in _unlike(auvs.speeds)),
        duration=scenario.duration_s,
        corners=area.outline,
    )


def _unlike(speeds: Sequence[float]) -> list[int]:
    """Return one AUV of each speed."""
    return list({speed: auv for auv, speed in enumerate(speeds)}.values())


def horizontal_reach(scenario: ScenarioKeys, name: Literal["hf", "mf"] = "hf") -> float:
    """Return how far (m), seen from above, a band reaches an AUV at the survey's (greatest) depth:
    HF, on which an ASV hears it, or MF.
    """
    bands, depth = scenario.acoustics, scenario.survey.deepest
    band = bands.hf if name == "hf" else bands.mf
    if band.range_metric == "horizontal":
        return band.range_m
    return math.sqrt(max(band.range_m**2 - depth**2, 0.0))


def longest_way(hf_range: float, depth: float, metric: str) -> float:
    """Return the longest way (m) of a ping that is heard, from a depth (m) to the surface.

    A horizontal range says nothing of the depth: sound takes the slant way.

    >>> longest_way(40.0, 30.0, "horizontal"), longest_way(40.0, 30.0, "slant")
    (50.0, 40.0)
    """
    return math.hypot(hf_range, depth) if metric == "horizontal" else hf_range


def failures_of(scenario: ScenarioKeys) -> "Failures | None":
    """Return the failures of a scenario's ASVs; None where none fails."""
    given = scenario.asvs.failures
    if not given:
        return None
    import numpy as np  # which validating a scenario does not wait for

    from ..vehicles.fleet import Failures

    return Failures(
        scenario.asvs.count,
        np.array([failure.asv for failure in given], dtype=np.intp),
        np.array([failure.at_s for failure in given]),
        np.array([np.inf if failure.until_s is None else failure.until_s for failure in given]),
    )


def alive(scenario: ScenarioKeys, time: float) -> tuple[bool, ...]:
    """Return which ASVs of a scenario work at an instant (s), in the order of their numbers."""
    failed = {failure.asv for failure in scenario.asvs.failures if failure.lasts(time)}
    return tuple(asv not in failed for asv in range(scenario.asvs.count))
