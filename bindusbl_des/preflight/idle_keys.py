"""Keys that do nothing in the mode that a scenario has chosen; each rule was found by experiment.

`tests/preflight/test_worth_knowing.py` toggles every key in every mode and compares the missions'
tables: it fails where a key does nothing and no rule here says so, and where a rule here is wrong.
"""

from collections.abc import Iterator
from typing import Any

from ..core.wording import plain
from ..scenario.consistency import Problem
from ..scenario.key_types import Part
from ..scenario.scenario import Scenario
from ..scenario.vehicle_choice import VehicleChoice
from .idle_rules import RULES, Idle


def idle_keys(scenario: Scenario) -> Iterator[Problem]:
    """Yield the keys that somebody has set and that do nothing, each told once."""
    told: set[str] = set()
    wholly_dumped = _is_whole(scenario)
    for rule in RULES:
        if not all(_value(scenario, key) in values for key, values in rule.mode.items()):
            continue
        if rule.but(scenario):
            continue
        for key in rule.keys:
            if key not in told and _is_given(scenario, key, but_defaults=wholly_dumped):
                told.add(key)
                yield Problem(key, f"{rule.effect} {_with(scenario, rule)}", tuple(rule.mode))


def _with(scenario: Scenario, rule: Idle) -> str:
    chosen = ", ".join(f"{key}: {plain(_value(scenario, key))}" for key in rule.mode)
    return f"with {chosen} ({rule.why}); {rule.remedy}"


def _value(scenario: Scenario, key: str) -> Any:
    """Return the value of a dotted key, of a vehicle its model; None where there is no such key."""
    value: Any = scenario
    for name in key.split("."):
        value = getattr(value, name, None)
    return value.model if isinstance(value, VehicleChoice) else value


def _is_given(scenario: Scenario, key: str, *, but_defaults: bool) -> bool:
    """Tell whether somebody has set a key; `but_defaults`: to another value than its default."""
    part: Any = scenario
    *sections, last = key.split(".")
    for name in sections:
        if name not in part.model_fields_set:
            return False
        part = getattr(part, name)
    if last not in part.model_fields_set or last not in type(part).model_fields:
        return False
    return not but_defaults or getattr(part, last) != type(part).model_fields[last].default


def _is_whole(part: Part) -> bool:
    """Tell whether every key is set, as where a scenario was written out by the program itself."""
    values = [getattr(part, name) for name in type(part).model_fields]
    return part.model_fields_set == set(type(part).model_fields) and all(
        _is_whole(value) for value in values if isinstance(value, Part)
    )
