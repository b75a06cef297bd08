"""The water of a scenario: how fast sound travels in it, as given, or by what is known of it."""

from typing import TYPE_CHECKING

from .on_earth import origin_of
from .scenario_keys import ScenarioKeys

if TYPE_CHECKING:
    from ..sea.water import Water
    from ..sea.water_column import Column, Profile


def is_measured(scenario: ScenarioKeys) -> bool:
    """Tell whether a scenario gives the water, and not the speed of sound in it."""
    given = scenario.environment
    return given.temperature_c is not None or given.ctd is not None


def sound_speed_of(scenario: ScenarioKeys) -> float:
    """Return how fast sound travels (m/s) in the water of a scenario.

    It is the number given, or the harmonic mean between the surface and the depth of the survey
    (:func:`..sea.water_column.mean_speed`) of what temperature and salinity or the cast make of it.

    Raises:
        ValueError: naming what is wrong with the cast.
        ImportError: without gsw, where that is asked for.
    """
    if not is_measured(scenario):
        return scenario.environment.sound_speed_m_per_s
    from ..sea.water_column import (
        mean_speed,  # brings numpy, which speeds that are given do not need
    )

    return mean_speed(profile_of(scenario), scenario.survey.deepest)


def assumed_sound_speed_of(scenario: ScenarioKeys) -> float:
    """Return the speed of sound (m/s) that the fleet works with; see :func:`sound_speed_of`."""
    assumed = scenario.environment.assumed_sound_speed_m_per_s
    return sound_speed_of(scenario) if assumed is None else assumed


def profile_of(scenario: ScenarioKeys) -> "Profile":
    """Return the speed of sound over depth (raises as :func:`sound_speed_of`)."""
    from ..sea.water_column import uniform_profile

    if is_measured(scenario):
        return _column(scenario).profile()
    return uniform_profile(scenario.environment.sound_speed_m_per_s)


def water_of(scenario: ScenarioKeys) -> "Water":
    """Return the water that absorbs sound down to the survey (raises as :func:`sound_speed_of`)."""
    from ..sea.water import USUAL_WATER

    return _column(scenario).water() if is_measured(scenario) else USUAL_WATER


def _column(scenario: ScenarioKeys) -> "Column":
    from ..sea.water_column import Column

    given = scenario.environment
    return Column(
        deepest_m=scenario.survey.deepest,
        temperature_c=given.temperature_c,
        salinity_psu=given.salinity_psu,
        cast_file=given.ctd,
        law=given.sound_speed_law,
        place_deg=origin_of(scenario),
    )
