"""Which keys of a scenario name a part of the mission, by a shipped name or as `module:object`.

Another family is a key of type :class:`.part_choice.PartChoice`, its line here, and a room that
makes its parts: those that ship by name, one's own with :func:`.part_choice.own_part`.
"""

from collections.abc import Iterator, Mapping
from operator import attrgetter

from ..core.plugins import Family, PluginError, allow, is_plugin, loaded
from . import declared
from .channel_settings import Curve, Disc, Lossy, PingSonar, PingTable, Series, Sonar, Table
from .declared import Traits
from .part_choice import PartChoice, Settings, own_mistakes, own_part
from .scenario_keys import ScenarioKeys
from .sections.placements import PLACEMENTS
from .sections.routes import ROUTES


def _of(table: Mapping[str, Traits]) -> dict[str, type[Settings]]:
    """Return the models of the settings of those parts that have any."""
    return {name: traits.settings for name, traits in table.items() if traits.settings.model_fields}


SCHEDULE = Family(
    *("protocol.schedule", "schedule", tuple(declared.SCHEDULES), ("view",)),
    settings=_of(declared.SCHEDULES),
)
ACCESS = Family(
    *("protocol.access", "access", tuple(declared.ACCESSES), ("node",)),
    settings=_of(declared.ACCESSES),
)
DOWNLINK = Family(
    *("protocol.downlink", "downlink", tuple(declared.DOWNLINKS), ("network", "turn", "time")),
    settings=_of(declared.DOWNLINKS),
)
BROADCASTER = Family(
    *("protocol.broadcaster", "broadcaster", tuple(declared.BROADCASTERS), ("view",)),
    settings=_of(declared.BROADCASTERS),
)
RANGING = Family(
    *("protocol.ranging", "ranging", tuple(declared.RANGINGS), ("slot", "time")),
    settings=_of(declared.RANGINGS),
)
KNOWLEDGE = Family(
    *("protocol.knowledge", "knowledge", tuple(declared.KNOWLEDGES), ()),
    settings=_of(declared.KNOWLEDGES),
    is_open=False,
)
CHANNEL = Family(
    *("acoustics.hf.channel", "channel", tuple(declared.CHANNELS), ("signals",)),
    settings={
        "disc": Disc,
        "curve": Curve,
        "sonar": PingSonar,
        "table": PingTable,
        "series": Series,
    },
    common=Lossy,
)
MF_CHANNEL = Family(
    *("acoustics.mf.channel", "mf_channel", tuple(declared.CHANNELS), ("signals",)),
    settings={"disc": Disc, "curve": Curve, "sonar": Sonar, "table": Table, "series": Series},
    common=Lossy,
)
INSTRUMENT = Family(
    *("usbl.model", "instrument", tuple(declared.INSTRUMENTS), ("sounding",)),
    settings=_of(declared.INSTRUMENTS),
)
NAVIGATOR = Family(
    *("navigation.filter", "filter", tuple(declared.NAVIGATORS), ("reckoning", "auvs")),
    settings=_of(declared.NAVIGATORS),
)
PLACEMENT = Family("asvs.formation", "placement", tuple(PLACEMENTS), ("plan",), word="model")
ROUTE = Family("auvs.route", "route", tuple(ROUTES), ("plan",), word="kind")
AUV = Family(
    *("auvs.vehicle", "vehicle", tuple(declared.AUVS), ("way",)), settings=_of(declared.AUVS)
)
ASV = Family(
    *("asvs.vehicle", "vessel", tuple(declared.ASVS), ("way",)), settings=_of(declared.ASVS)
)
FAMILIES = (
    *(SCHEDULE, ACCESS, DOWNLINK, BROADCASTER, RANGING, KNOWLEDGE, CHANNEL, MF_CHANNEL),
    *(INSTRUMENT, NAVIGATOR, PLACEMENT, ROUTE, AUV, ASV),
)


def parts_of(scenario: ScenarioKeys) -> Iterator[tuple[Family, PartChoice]]:
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
            yield from declared.declared_mistakes(family.key, name)


def ready_plugins(scenario: ScenarioKeys) -> None:
    """Load the admitted plug-ins that a scenario names: a mission asks what they say of themselves
    (`slot_s`, `framed`) before it calls them, and must be told so in every process.

    Raises:
        PluginError: when one is not allowed, or cannot be loaded or called.
    """
    for family, name in parts_of(scenario):
        if is_plugin(name):
            own_part(family, name)
