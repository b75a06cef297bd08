"""What the keys of the protocol must agree on: slots where parts need them."""

from collections.abc import Iterator

from ...core.plugins import is_plugin
from ..families import is_random
from ..scenario_keys import ScenarioKeys
from .failures import no_such_asv
from .problem import Problem


def problems(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield every contradiction among the keys of the protocol."""
    yield from _fixed(scenario)
    yield from _unslotted(scenario)
    yield from _ordered(scenario)


def _fixed(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield that the one ASV that is to broadcast is not there."""
    broadcaster, count = scenario.protocol.broadcaster, scenario.asvs.count
    asv = broadcaster.settings.get("asv")
    if broadcaster == "fixed" and isinstance(asv, int) and asv >= count:
        yield Problem(
            "protocol.broadcaster.asv",
            no_such_asv(asv, count),
            ("asvs.count",),
        )


def _unslotted(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield parts that need slots where random access gives nobody any."""
    protocol = scenario.protocol
    if not is_random(scenario):
        return
    refused = {"ranging": protocol.ranging != "owtt_sync", "downlink": is_plugin(protocol.downlink)}
    for name, known in (("ranging", "owtt_sync"), ("downlink", "one that ships")):
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
    if protocol.schedule == "polling" and is_plugin(protocol.ranging):
        yield Problem(
            "protocol.ranging",
            f"polling calls the AUVs itself, so that {protocol.ranging} has nothing to do; use "
            "owtt_sync or twtt, or another schedule",
            others,
        )
    if protocol.schedule != "super_tdma":
        return
    if protocol.ranging not in ("owtt_sync", "passive"):
        yield Problem(
            "protocol.ranging",
            "super_tdma tells AUVs when to ping, on their own clocks, which "
            f"{protocol.ranging} does not let them; use owtt_sync, or another schedule",
            others,
        )
    if protocol.downlink == "pipelined_group":
        yield Problem(
            "protocol.downlink",
            "super_tdma packs the pings of a whole round, and pipelined_group would hold them up "
            "for each frame; use sequential, pipelined_round or direct_reply",
            others,
        )
