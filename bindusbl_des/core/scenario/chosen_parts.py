"""The parts that a scenario has chosen, a family each; user-defined ones are loaded."""

from collections.abc import Iterator
from operator import attrgetter
from typing import Any

from ...support.plugins import Family, PluginError, allow, is_plugin, loaded
from .families import FAMILIES
from .part_choice import PartChoice, own_mistakes, own_part
from .scenario_keys import ScenarioKeys


def parts_of(scenario: ScenarioKeys) -> Iterator[tuple[Family[Any], PartChoice]]:
    """Yield each family and the choice of its part in a scenario."""
    for family in FAMILIES:
        found = attrgetter(family.key)(scenario)
        yield family, found if isinstance(found, PartChoice) else found.choice


def loaded_parts(scenario: ScenarioKeys) -> tuple[object, ...]:
    """Return the user-defined parts of a scenario that are loaded by now."""
    return tuple(loaded(str(name)) for _, name in parts_of(scenario) if is_plugin(name))


def load_plugins(scenario: ScenarioKeys) -> Iterator[PluginError]:
    """Admit and load the plug-ins that a scenario names; yield why any of them cannot be used."""
    for family, name in parts_of(scenario):
        if is_plugin(name):
            allow([name])
            yield from own_mistakes(family, name)
            yield from family.undeclarable(name)


def ready_plugins(scenario: ScenarioKeys) -> None:
    """Load the admitted plug-ins that a scenario names: a mission asks what they say of themselves
    (`slot_s`, `framed`) before it calls them, and must be told so in every process.

    Raises:
        PluginError: when one is not allowed, or cannot be loaded or called.
    """
    for family, name in parts_of(scenario):
        if is_plugin(name):
            own_part(family, name)
