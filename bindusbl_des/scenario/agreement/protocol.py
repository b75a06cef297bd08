"""What the keys of the protocol must agree on: slots where parts need them."""

from collections.abc import Iterator

from ...core.plugins import is_plugin
from ..declared import DOWNLINKS, RANGINGS, broadcaster_named
from ..families import downlink_of, ranging_of, schedule_of
from ..scenario_keys import ScenarioKeys
from .failures import no_such_asv
from .problem import Problem

# With these AUVs ping by their own clocks, in no slot that must hold more than a ping.
OWN_CLOCKS = [name for name, it in RANGINGS.items() if it.own_clocks]


def problems(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield every contradiction among the keys of the protocol."""
    yield from _fixed(scenario)
    yield from _unslotted(scenario)
    yield from _ordered(scenario)


def _fixed(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield that the one ASV that is to broadcast is not there."""
    broadcaster, count = scenario.protocol.broadcaster, scenario.asvs.count
    asv = broadcaster.settings.get("asv")
    if broadcaster_named(broadcaster).chosen_by == "one" and isinstance(asv, int) and asv >= count:
        yield Problem(
            "protocol.broadcaster.asv",
            no_such_asv(asv, count),
            ("asvs.count",),
        )


def _unslotted(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield parts that need slots where random access gives nobody any."""
    protocol = scenario.protocol
    if not scenario.protocol.random_access:
        return
    works_in_slots = not ranging_of(scenario).own_clocks
    refused = {"ranging": works_in_slots, "downlink": is_plugin(protocol.downlink)}
    for name, known in (("ranging", " or ".join(OWN_CLOCKS)), ("downlink", "one that ships")):
        if refused[name]:
            yield Problem(
                f"protocol.{name}",
                f"{getattr(protocol, name)} works in slots, and with {protocol.schedule} AUVs ping "
                f"as they like; use {known}, or a schedule with slots",
                ("protocol.schedule",),
            )


def _ordered(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield what schedules that call AUVs, or tell them when to ping, do not go with."""
    protocol, others = scenario.protocol, ("protocol.schedule",)
    schedule = schedule_of(scenario)
    if schedule.calls and is_plugin(protocol.ranging):
        known = [name for name, it in RANGINGS.items() if not it.asvs_ping]
        yield Problem(
            "protocol.ranging",
            f"{protocol.schedule} calls the AUVs itself, so that {protocol.ranging} has nothing to "
            f"do; use {' or '.join(known)}, or another schedule",
            others,
        )
    if schedule.pace != "packed":
        return
    ranging = ranging_of(scenario)
    if not ranging.own_clocks and not ranging.asvs_ping:
        yield Problem(
            "protocol.ranging",
            f"{protocol.schedule} tells AUVs when to ping, on their own clocks, which "
            f"{protocol.ranging} does not let them; use {' or '.join(OWN_CLOCKS)}, or another "
            "schedule",
            others,
        )
    if downlink_of(scenario).by_group:
        *known, last = [name for name, it in DOWNLINKS.items() if not it.by_group]
        yield Problem(
            "protocol.downlink",
            f"{protocol.schedule} packs the pings of a whole round, and {protocol.downlink} would "
            f"hold them up for each frame; use {', '.join(known)} or {last}",
            others,
        )
