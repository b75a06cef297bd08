"""What the keys of instruments must agree on: one statement of each, and arrays that can tell."""

from collections.abc import Iterator

from ...core.wording import plain
from ..part_choice import PartChoice
from ..scenario_keys import ScenarioKeys
from ..sections.array import size_m
from ..sections.usbl import usbl_values
from .problem import Problem

# What the sheet of an inertial system says with one figure, and what these keys say of nothing
REPLACED_BY_DRIFT = {
    "velocity_bias_m_per_s": (0.0, 0.0),
    "velocity_bias_sd_m_per_s": 0.0,
    "velocity_bias_time_constant_s": None,
    "random_walk_m_per_sqrt_s": 0.0,
}


def problems(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield what instruments' keys contradict each other in."""
    yield from _usbl(scenario)
    yield from _drift(scenario)


def _usbl(scenario: ScenarioKeys) -> Iterator[Problem]:
    name, model = scenario.usbl.preset, scenario.usbl.model
    if name is not None and model != PartChoice.read(usbl_values(name)["model"], str):
        yield Problem(
            "usbl.model",
            f"is not that of the preset {name}, which says what an arrival measures; keep one of "
            f"them; got {model.told}",
            ("usbl.preset",),
        )
    own = not isinstance(scenario.usbl.array, str)
    named = "that is given" if own else scenario.usbl.array
    size, speed = size_m(scenario.usbl.array), scenario.environment.sound_speed_m_per_s
    for name, meant in (("tdoa_sd_s", "noise"), ("quantum_s", "a quantum")):
        time = getattr(scenario.usbl, name)
        if time * speed > size:
            yield Problem(
                f"usbl.{name}",
                f"{meant} of {time:g} s is {time * speed:.3g} m of sound, more than the "
                f"{1e3 * size:.0f} mm of the array {named}: no direction could be "
                f"told; use {0.9 * size / speed:.1e} at most",
                ("usbl.array", "environment.sound_speed_m_per_s"),
            )


def _drift(scenario: ScenarioKeys) -> Iterator[Problem]:
    navigation, drift = scenario.navigation, scenario.navigation.drift
    if not drift.is_stated:
        return
    stated = "percent_of_distance" if drift.m_per_hour is None else "m_per_hour"
    if drift.percent_of_distance is not None and drift.m_per_hour is not None:
        yield Problem(
            "navigation.drift.m_per_hour",
            "is another statement of the same as percent_of_distance; keep one of them",
            ("navigation.drift.percent_of_distance",),
        )
    for name, none in REPLACED_BY_DRIFT.items():
        if (value := getattr(navigation, name)) != none:
            yield Problem(
                f"navigation.{name}",
                f"is replaced by navigation.drift, which says how far dead reckoning goes astray "
                f"in all; remove it or set it to {plain(none)}; got {plain(value)}",
                (f"navigation.drift.{stated}",),
            )
