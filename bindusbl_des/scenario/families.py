"""Which keys of a scenario name a part of the mission, by a shipped name or as `module:object`.

Another family is a key of type :class:`.part_choice.PartChoice`, its line here, and a room that
makes its parts: those that ship by name, one's own with :func:`.part_settings.own_part`.
"""

from collections.abc import Iterator, Mapping
from operator import attrgetter
from typing import Any

from ..core.plugins import Family, PluginError, allow, is_plugin
from .channel_settings import Curve, Disc, Lossy, PingSonar, PingTable, Sonar, Table
from .instruments.datasheet import Datasheet
from .part_choice import PartChoice
from .part_settings import own_mistakes, own_part
from .scenario_keys import ScenarioKeys
from .sections.vehicle_choice import AsvVehicle, AuvVehicle
from .shipped_settings import (
    Broadcast,
    CarrierSense,
    DirectReply,
    Fixed,
    FixedGain,
    Kalman,
    Kinematic,
    Polling,
    Smoothing,
    SuperTdma,
    TwoWay,
    WorstFirst,
)

# AUVs ping as they like, in no slots that the fleet gives them.
RANDOM_ACCESS = ("aloha", "slotted_aloha", "csma")
# Each frame belongs to one AUV.
FRAMED_SCHEDULES = ("round_robin", "random")
# Slots are not all of the uplink slot T_UL.
UNEQUAL_SLOTS = ("polling", "super_tdma")
SCHEDULES = (
    *("spatial_reuse", "dsatur", "one_per_slot", "round_robin", "random"),
    *("worst_first", *UNEQUAL_SLOTS),
    *RANDOM_ACCESS,
)
DOWNLINKS = ("sequential", "pipelined_round", "pipelined_group", "direct_reply")
BROADCASTERS = ("rotate", "random", "most_fixes", "nearest", "fixed", "parallel")
FILTERS = ("fixed_gain", "kalman", "smoother", "dead_reckoning")
INSTRUMENTS = ("array", "datasheet")
PLACEMENTS = ("ring", "positions", "follow", "assign", "zigzag", "track")
ROUTES = ("lawnmower", "hold", "waypoints", "track")
CHANNELS = ("disc", "curve", "sonar", "table")
RANGINGS = ("owtt_sync", "twtt", "passive")
KNOWLEDGES = ("shared", "broadcast")


SCHEDULE = Family(
    *("protocol.schedule", "schedule", SCHEDULES, ("view",)),
    settings={
        "worst_first": WorstFirst,
        "polling": Polling,
        "super_tdma": SuperTdma,
        "csma": CarrierSense,
    },
)
DOWNLINK = Family(
    *("protocol.downlink", "downlink", DOWNLINKS, ("network", "turn", "time")),
    settings={"direct_reply": DirectReply},
)
BROADCASTER = Family(
    "protocol.broadcaster", "broadcaster", BROADCASTERS, ("view",), settings={"fixed": Fixed}
)
RANGING = Family(
    "protocol.ranging", "ranging", RANGINGS, ("slot", "time"), settings={"twtt": TwoWay}
)
KNOWLEDGE = Family(
    *("protocol.knowledge", "knowledge", KNOWLEDGES, ()),
    settings={"broadcast": Broadcast},
    is_open=False,
)
CHANNEL = Family(
    *("acoustics.hf.channel", "channel", CHANNELS, ("signals",)),
    settings={"disc": Disc, "curve": Curve, "sonar": PingSonar, "table": PingTable},
    common=Lossy,
)
MF_CHANNEL = Family(
    *("acoustics.mf.channel", "mf_channel", CHANNELS, ("signals",)),
    settings={"disc": Disc, "curve": Curve, "sonar": Sonar, "table": Table},
    common=Lossy,
)
INSTRUMENT = Family(
    *("usbl.model", "instrument", INSTRUMENTS, ("sounding",)), settings={"datasheet": Datasheet}
)
NAVIGATOR = Family(
    *("navigation.filter", "filter", FILTERS, ("reckoning", "auvs")),
    settings={"fixed_gain": FixedGain, "kalman": Kalman, "smoother": Smoothing},
)
PLACEMENT = Family("asvs.formation", "placement", PLACEMENTS, ("plan",), word="model")
ROUTE = Family("auvs.route", "route", ROUTES, ("plan",), word="kind")
AUV = Family(
    "auvs.vehicle", "vehicle", AuvVehicle.MODELS, ("way",), settings={"kinematic": Kinematic}
)
ASV = Family("asvs.vehicle", "vessel", AsvVehicle.MODELS, ("way",))
FAMILIES = (
    *(SCHEDULE, DOWNLINK, BROADCASTER, RANGING, KNOWLEDGE, CHANNEL, MF_CHANNEL, INSTRUMENT),
    *(NAVIGATOR, PLACEMENT, ROUTE, AUV, ASV),
)


def is_random(scenario: ScenarioKeys) -> bool:
    """Tell whether AUVs ping as they like: nobody gives them slots, and no round waits for them."""
    return scenario.protocol.schedule in RANDOM_ACCESS and not scenario.protocol.is_passive


def parts_of(scenario: ScenarioKeys) -> Iterator[tuple[Family, PartChoice]]:
    """Yield each family and the choice of its part in a scenario."""
    for family in FAMILIES:
        found = attrgetter(family.key)(scenario)
        yield family, found if isinstance(found, PartChoice) else found.choice


def plugins_of(scenario: ScenarioKeys) -> dict[str, str]:
    """Return the plug-ins that a scenario names, by key."""
    return {family.key: str(name) for family, name in parts_of(scenario) if is_plugin(name)}


def leave_of(scenario: ScenarioKeys) -> str:
    """Return what a command that runs a scenario needs behind it, so that its plug-ins are loaded:
    " --allow-plugins", or nothing.
    """
    return " --allow-plugins" if plugins_of(scenario) else ""


def load_plugins(scenario: ScenarioKeys) -> Iterator[PluginError]:
    """Admit and load the plug-ins that a scenario names; yield why any of them cannot be used."""
    for family, name in parts_of(scenario):
        if is_plugin(name):
            allow([name])
            yield from own_mistakes(family, name)


def ready_plugins(scenario: ScenarioKeys) -> None:
    """Load the admitted plug-ins that a scenario names: a mission asks what they say of themselves
    (`slot_s`, `framed`) before it calls them, and must be told so in every process.

    Raises:
        PluginError: when one is not allowed, or cannot be loaded or called.
    """
    for family, name in parts_of(scenario):
        if is_plugin(name):
            own_part(family, name)


def without_plugins(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the plain data of a scenario with the first shipped part in place of each plug-in."""
    plain: Any = data
    for family in FAMILIES:
        plain = _without(plain, family.key.split("."), family)
    return dict(plain)


def _without(data: Any, words: list[str], family: Family) -> Any:
    if words:
        return {**data, words[0]: _without(data[words[0]], words[1:], family)}
    if not is_plugin(named(data)):
        return data
    return {family.word: family.siblings[0]} if family.word else family.siblings[0]


def named(value: Any) -> str:
    """Return the name of the part in what stands at a key; "" where it is none.

    >>> named("dsatur"), named({"model": "my_parts:fast", "depth": 2}), named(3)
    ('dsatur', 'my_parts:fast', '')
    """
    name = value.get("model", value.get("kind")) if isinstance(value, Mapping) else value
    return name if isinstance(name, str) else ""
