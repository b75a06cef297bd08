"""Which keys of a scenario name a part of the mission, by a shipped name or as `module:object`."""

from collections.abc import Iterator, Mapping
from typing import Any

from ..core.plugins import Family, PluginError, allow, is_plugin, load
from .sections import ScenarioKeys

SCHEDULES = ("spatial_reuse", "dsatur", "one_per_slot", "round_robin", "random")
DOWNLINKS = ("sequential", "pipelined_round", "pipelined_group", "direct_reply")
BROADCASTERS = ("rotate", "random", "most_fixes", "nearest", "fixed")
FILTERS = ("fixed_gain", "kalman", "dead_reckoning")

SCHEDULE = Family("protocol.schedule", "schedule", SCHEDULES, ("view",))
DOWNLINK = Family("protocol.downlink", "downlink", DOWNLINKS, ("network", "turn", "time"))
BROADCASTER = Family("protocol.broadcaster", "broadcaster", BROADCASTERS, ("view",))
NAVIGATOR = Family("navigation.filter", "filter", FILTERS, ("reckoning", "auvs"))
FAMILIES = (SCHEDULE, DOWNLINK, BROADCASTER, NAVIGATOR)


def parts_of(scenario: ScenarioKeys) -> Iterator[tuple[Family, str]]:
    """Yield each family and the name of its part in a scenario."""
    for family in FAMILIES:
        section, _, name = family.key.partition(".")
        yield family, getattr(getattr(scenario, section), name)


def plugins_of(scenario: ScenarioKeys) -> dict[str, str]:
    """Return the plug-ins that a scenario names, by key."""
    return {family.key: name for family, name in parts_of(scenario) if is_plugin(name)}


def load_plugins(scenario: ScenarioKeys) -> Iterator[PluginError]:
    """Admit and load the plug-ins that a scenario names; yield why any of them cannot be used."""
    for family, name in parts_of(scenario):
        if is_plugin(name):
            allow([name])
            try:
                load(family, name)
            except PluginError as error:
                yield error


def without_plugins(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the plain data of a scenario with the first shipped part in place of each plug-in."""
    plain = dict(data)
    for family in FAMILIES:
        section, _, name = family.key.partition(".")
        if is_plugin(plain[section][name]):
            plain[section] = {**plain[section], name: family.siblings[0]}
    return plain
