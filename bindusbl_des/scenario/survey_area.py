"""The area that a scenario's survey covers, whichever of its keys says so."""

import math
from functools import lru_cache

from ..geometry.area import Area, polygon, rectangle
from .key_types import Position
from .on_earth import in_metres, origin_of
from .scenario_keys import ScenarioKeys
from .sections.survey import Survey


def area_of(scenario: ScenarioKeys) -> Area:
    """Return the area to be surveyed.

    Raises:
        ValueError: when its polygon is none, saying why.
    """
    return _area(scenario.survey, origin_of(scenario) if scenario.survey.area else None)


@lru_cache(maxsize=16)
def _area(survey: Survey, origin: Position | None) -> Area:
    turn = math.radians(survey.rotation_deg)
    if origin is not None:
        return polygon(in_metres(survey.corners_deg, origin))
    if survey.polygon_m is not None:
        return polygon(survey.polygon_m)
    if survey.size_m is not None:
        return rectangle(*survey.size_m, turn)
    assert survey.side_m is not None, "a scenario has one shape"
    return rectangle(survey.side_m, survey.side_m, turn)


def swath_of(scenario: ScenarioKeys) -> float | None:
    """Return how wide (m) a strip an AUV surveys; None where nobody says."""
    return scenario.survey.swath_m or getattr(scenario.auvs.route, "lane_spacing_m", None)


def lanes_heading(scenario: ScenarioKeys) -> float:
    """Return the heading of the frame in which routes are planned (rad): that of the lanes."""
    asked = getattr(scenario.auvs.route, "lane_heading_deg", None)
    return area_of(scenario).turn if asked is None else math.radians(asked)
