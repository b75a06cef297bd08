"""The parts that a scenario names, one for each family; user-defined parts are loaded here."""

from collections.abc import Iterator
from operator import attrgetter
from typing import Any

from ...support.plugins import Family, PluginError, allow, is_plugin, loaded
from .families import ASV, AUV, FAMILIES, INSTRUMENT, ROUTE
from .part_choice import PartChoice, own_mistakes, own_part
from .scenario_keys import ScenarioKeys


def parts_of(scenario: ScenarioKeys) -> Iterator[tuple[str, Family[Any], PartChoice]]:
    """Yield each key of a scenario that names a part, with the family and the choice."""
    for family in FAMILIES:
        found = attrgetter(family.key)(scenario)
        yield family.key, family, found if isinstance(found, PartChoice) else found.choice
    for number, group in enumerate(scenario.auvs.groups):
        for family, own in ((ROUTE, group.route), (AUV, group.vehicle)):
            if own is not None:
                name = family.key.removeprefix("auvs.")
                yield f"auvs.groups.{number}.{name}", family, own.choice
    for number, vessels in enumerate(scenario.asvs.groups):
        key = f"asvs.groups.{number}"
        if vessels.vehicle is not None:
            yield f"{key}.vehicle", ASV, vessels.vehicle.choice
        if vessels.usbl is not None and vessels.usbl.model is not None:
            yield f"{key}.usbl.model", INSTRUMENT, vessels.usbl.model


def loaded_parts(scenario: ScenarioKeys) -> tuple[object, ...]:
    """Return the user-defined parts of a scenario that are loaded already."""
    return tuple(loaded(str(name)) for _, _, name in parts_of(scenario) if is_plugin(name))


def load_plugins(scenario: ScenarioKeys) -> Iterator[PluginError]:
    """Admit and load the plug-ins that a scenario names; yield an error for each unusable one."""
    for _, family, name in parts_of(scenario):
        if is_plugin(name):
            allow([name])
            yield from own_mistakes(family, name)
            yield from family.undeclarable(name)


def ready_plugins(scenario: ScenarioKeys) -> None:
    """Load the admitted plug-ins that a scenario names.

    Every process must do so before a mission, which reads their declarations (`slot_s`, `framed`).

    Raises:
        PluginError: when one is not allowed, or cannot be loaded or called.
    """
    for _, family, name in parts_of(scenario):
        if is_plugin(name):
            own_part(family, name)
