"""What is wrong with places in degrees: no origin, metres given as well, or far away from it."""

from collections.abc import Iterator, Sequence

from ..key_types import Position
from ..on_earth import origin_of
from ..scenario_keys import ScenarioKeys
from ..sections.routes import Hold, Waypoints
from .problem import Problem

ORIGIN = ("environment.origin.lat_deg", "environment.origin.lon_deg")


def problems(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield what is wrong with the places of a scenario that are given in degrees."""
    given, corners = list(_in_degrees(scenario)), scenario.survey.corners_deg
    origin = origin_of(scenario)
    if origin is not None:
        yield from _far("survey.area", [("survey.area", it) for it in corners], origin)
    for key, other, is_double, positions in given:
        section = key.rpartition(".")[0]
        if is_double:
            yield Problem(key, f"excludes {other}; keep one of them", (f"{section}.{other}",))
        if origin is None:
            message = "needs environment.origin.lat_deg and lon_deg, where x = y = 0"
            yield Problem(key, f"{message}; add them", ORIGIN)
        else:
            yield from _far(key, positions, origin)


def _in_degrees(
    scenario: ScenarioKeys,
) -> Iterator[tuple[str, str, bool, list[tuple[str, Position]]]]:
    """Yield each key in degrees, the one in metres beside it, and whether that is given as well;
    and the positions, each with the key of its own.
    """
    route, formation = scenario.auvs.route, scenario.asvs.formation
    if isinstance(route, Hold) and route.positions_deg:
        key = "auvs.route.positions_deg"
        yield key, "positions_m", bool(route.positions_m), _keyed(key, route.positions_deg)
    if isinstance(route, Waypoints) and route.points_deg:
        key = "auvs.route.points_deg"
        points = [it for n, way in enumerate(route.points_deg) for it in _keyed(f"{key}.{n}", way)]
        yield key, "points_m", bool(route.points_m), points
    stations = getattr(formation, "positions_deg", None)
    if stations is not None:
        key = "asvs.formation.positions_deg"
        is_double = getattr(formation, "positions_m", None) is not None
        yield key, "positions_m", is_double, _keyed(key, stations)


def _keyed(key: str, positions: Sequence[Position]) -> list[tuple[str, Position]]:
    return [(f"{key}.{number}", position) for number, position in enumerate(positions)]


def _far(key: str, positions: list[tuple[str, Position]], origin: Position) -> Iterator[Problem]:
    """Yield the first position that is too far away, if there is one."""
    from ...geometry.geodesy import far_apart_m
    from ...vehicles.tracks import FARTHEST, too_far

    if not positions:
        return
    lat, lon = zip(*(it for _, it in positions), strict=True)
    is_far = far_apart_m(lat, lon, origin) > FARTHEST
    if is_far.any():
        place, position = positions[int(is_far.argmax())]
        yield Problem(place, too_far(position, origin), ORIGIN)
