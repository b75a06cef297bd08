"""What the water must agree on: one statement of its sound speed, and what a law of it needs."""

from collections.abc import Iterator
from importlib.util import find_spec

from ..on_earth import origin_of
from ..scenario_keys import ScenarioKeys
from ..sections.environment import Environment
from .problem import Problem

# The speed of sound (m/s) that is not given
USUAL_SPEED = Environment.model_fields["sound_speed_m_per_s"].default


def problems(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield what is wrong with where a scenario is, and with the water there."""
    yield from _origin(scenario)
    yield from _water(scenario)


def _origin(scenario: ScenarioKeys) -> Iterator[Problem]:
    given = scenario.environment.origin
    for name, other in (("lat_deg", "lon_deg"), ("lon_deg", "lat_deg")):
        if getattr(given, name) is not None and getattr(given, other) is None:
            yield Problem(
                f"environment.origin.{name}",
                f"needs {other} as well; add it",
                (f"environment.origin.{other}",),
            )


def _water(scenario: ScenarioKeys) -> Iterator[Problem]:
    water = scenario.environment
    key = "temperature_c" if water.ctd is None else "ctd"
    if getattr(water, key) is None:
        return
    if water.ctd is not None and water.temperature_c is not None:
        yield Problem(
            "environment.ctd",
            "says how warm the water is; remove temperature_c, or the cast",
            ("environment.temperature_c",),
        )
    given, whole = water.model_fields_set, set(type(water).model_fields)
    speed = water.sound_speed_m_per_s
    if speed != USUAL_SPEED or ("sound_speed_m_per_s" in given and given != whole):
        yield Problem(
            "environment.sound_speed_m_per_s",
            f"follows from {key}; keep one of them (assumed_sound_speed_m_per_s is what the fleet "
            "takes it for)",
            (f"environment.{key}",),
        )
    if water.sound_speed_law == "teos10":
        yield from _teos10(scenario, key)


def _teos10(scenario: ScenarioKeys, key: str) -> Iterator[Problem]:
    if origin_of(scenario) is None:
        yield Problem(
            "environment.sound_speed_law",
            "teos10 needs to know where that is: set environment.origin, or use mackenzie",
            (f"environment.{key}", "environment.origin"),
        )
    elif find_spec("gsw") is None:
        yield Problem(
            "environment.sound_speed_law",
            "teos10 needs the package gsw (pip install 'bindusbl-des[ocean]'); or use mackenzie",
            (f"environment.{key}",),
        )
