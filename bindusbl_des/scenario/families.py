"""Which keys of a scenario name a part of the mission, by a shipped name or as `module:object`.

Another family is a key of type :class:`.part_choice.PartChoice`, its line here, and a room that
makes its parts: those that ship by name, one's own with :func:`.part_settings.own_part`.
"""

from collections.abc import Iterator, Mapping
from operator import attrgetter
from typing import Any, Literal

from ..core.plugins import Family, PluginError, allow, is_plugin
from .channel_settings import Curve, Disc, Lossy, PingSonar, PingTable, Sonar, Table
from .instruments.datasheet import Datasheet
from .key_types import Real, Whole, key
from .part_choice import PartChoice
from .part_settings import Settings, own_mistakes, own_part
from .scenario_keys import ScenarioKeys
from .sections.vehicle_choice import AsvVehicle, AuvVehicle

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


# Errors that a filter may be left ignorant of
Untold = Literal[
    "misalignment", "gnss", "sound_speed", "clock",
    "velocity_bias", "scale_factor", "heading", "initial_position",
]  # fmt: skip


class Kalman(Settings):
    """The settings of the filter `kalman`."""

    untold: tuple[Untold, ...] = key(
        (), "", "errors of instruments, clocks and AUVs' own sensors that the filter is not told of"
    )
    random_walk_m_per_sqrt_s: Real | None = key(
        None, "m/sqrt(s)", "process noise of the position; null = the scenario's", ge=0, le=1e3
    )
    velocity_bias_sd_m_per_s: Real | None = key(
        None,
        "m/s",
        "prior of the constant velocity bias along each axis; null = the scenario's, "
        "hypot(|velocity_bias_m_per_s|, velocity_bias_sd_m_per_s)",
        ge=0,
        le=20,
    )
    initial_position_sd_m: Real | None = key(
        None, "m", "prior of the start along each axis; null = the scenario's", ge=0, le=1e5
    )


class Smoothing(Kalman):
    """The settings of the filter `smoother`."""

    lag_s: Real | None = key(
        None,
        "s",
        "an estimate knows the fixes delivered up to so much later; null = all of the mission",
        ge=0,
        le=1e7,
    )


class CarrierSense(Settings):
    """The settings of the schedule `csma`."""

    window: Whole = key(
        10, "1", "an AUV holds back for 0 to window - 1 slots, drawn by lot", ge=1, le=1_000_000
    )
    slot_s: Real | None = key(
        None,
        "s",
        "such a slot; null = a ping and its longest way, until all in range have heard it",
        gt=0,
        le=3600,
    )


class WorstFirst(Settings):
    """The settings of the schedule `worst_first`."""

    slots: Whole = key(
        4, "1", "ping groups of a round, at most; further AUVs wait for a later one", ge=1, le=9_999
    )


class Polling(Settings):
    """The settings of the schedule `polling`."""

    side_by_side: bool = key(
        False, "", "call AUVs at once that no ASV hears two of, each by the ASV nearest to it"
    )


class SuperTdma(Settings):
    """The settings of the schedule `super_tdma`."""

    clear_s: Real = key(0.02, "s", "pause between two arrivals at an ASV", ge=0, le=60)
    sds: Real = key(
        2.0, "1", "standard deviations of fixes by which AUVs may be misplaced", ge=0, le=100
    )


class Fixed(Settings):
    """The settings of the broadcaster `fixed`."""

    asv: Whole = key(0, "1", "number of the ASV that always broadcasts", ge=0, le=9_999)


SCHEDULE = Family(
    *("protocol.schedule", "schedule", SCHEDULES, ("view",)),
    settings={
        "worst_first": WorstFirst,
        "polling": Polling,
        "super_tdma": SuperTdma,
        "csma": CarrierSense,
    },
)
DOWNLINK = Family("protocol.downlink", "downlink", DOWNLINKS, ("network", "turn", "time"))
BROADCASTER = Family(
    "protocol.broadcaster", "broadcaster", BROADCASTERS, ("view",), settings={"fixed": Fixed}
)
RANGING = Family("protocol.ranging", "ranging", RANGINGS, ("slot", "time"))
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
    settings={"kalman": Kalman, "smoother": Smoothing},
)
PLACEMENT = Family("asvs.formation", "placement", PLACEMENTS, ("plan",), word="model")
ROUTE = Family("auvs.route", "route", ROUTES, ("plan",), word="kind")
AUV = Family("auvs.vehicle", "vehicle", AuvVehicle.MODELS, ("way",))
ASV = Family("asvs.vehicle", "vessel", AsvVehicle.MODELS, ("way",))
FAMILIES = (
    *(SCHEDULE, DOWNLINK, BROADCASTER, RANGING, CHANNEL, MF_CHANNEL, INSTRUMENT, NAVIGATOR),
    *(PLACEMENT, ROUTE, AUV, ASV),
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
