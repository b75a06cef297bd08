"""What a route must agree on: a place, a way or a file for each AUV."""

from collections.abc import Iterator
from itertools import pairwise
from math import dist

from ..on_earth import origin_of, positioned
from ..scenario_keys import ScenarioKeys
from .problem import Problem
from .survey import SHORTEST_WAY


def problems(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield lists of places, ways and files that do not fit the number of AUVs, or are no ways."""
    auvs, route = scenario.auvs, scenario.auvs.route
    if route.kind == "hold":
        places = route.positions_deg or route.positions_m
        if len(places) != auvs.count:
            unit, each = ("deg", "[lat, lon]") if route.positions_deg else ("m", "[x, y]")
            yield Problem(
                f"auvs.route.positions_{unit}",
                f"needs one {each} per AUV: {auvs.count} expected, {len(places)} given",
                ("auvs.count", "auvs.route.kind"),
            )
    if route.kind == "track" and route.tracks and len(route.tracks) != auvs.count:
        yield Problem(
            "auvs.route.tracks",
            f"needs one name per AUV: {auvs.count} expected, {len(route.tracks)} given",
            ("auvs.count", "auvs.route.kind"),
        )
    if route.kind == "track" and len(route.files) != auvs.count:
        yield Problem(
            "auvs.route.files",
            f"needs one file per AUV: {auvs.count} expected, {len(route.files)} given",
            ("auvs.count", "auvs.route.kind"),
        )
    if route.kind == "waypoints":
        name = "points_deg" if route.points_deg else "points_m"
        count = len(route.points_deg or route.points_m)
        if count != auvs.count:
            yield Problem(
                f"auvs.route.{name}",
                f"needs one list of points per AUV: {auvs.count} expected, {count} given",
                ("auvs.count", "auvs.route.kind"),
            )
        if route.points_deg and origin_of(scenario) is None:
            return  # which has been told
        for number, points in enumerate(positioned(scenario, route).points_m):
            if len(points) < 2 or any(dist(a, b) < SHORTEST_WAY for a, b in pairwise(points)):
                yield Problem(
                    f"auvs.route.{name}.{number}",
                    f"needs at least two points, those in a row {SHORTEST_WAY:g} m apart or more",
                )
