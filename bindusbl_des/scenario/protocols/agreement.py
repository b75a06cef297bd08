"""What the keys of the protocol must agree on: key, message, and the other keys that lead to it."""

from collections.abc import Iterator

from ...core.plugins import is_plugin
from ..families import is_random
from ..scenario_keys import ScenarioKeys

Found = Iterator[tuple[str, str, tuple[str, ...]]]


def disagreements(scenario: ScenarioKeys) -> Found:
    """Yield every contradiction among the keys of the protocol."""
    yield from _fixed(scenario)
    yield from _unslotted(scenario)


def _fixed(scenario: ScenarioKeys) -> Found:
    """Yield that the one ASV that is to broadcast is not there."""
    broadcaster, count = scenario.protocol.broadcaster, scenario.asvs.count
    asv = broadcaster.settings.get("asv")
    if broadcaster == "fixed" and isinstance(asv, int) and asv >= count:
        yield (
            "protocol.broadcaster.asv",
            f"there is no ASV{asv}: {count} ASVs are numbered from 0; use at most {count - 1}",
            ("asvs.count",),
        )


def _unslotted(scenario: ScenarioKeys) -> Found:
    """Yield parts that need slots where random access gives nobody any."""
    protocol = scenario.protocol
    if not is_random(scenario):
        return
    refused = {"ranging": protocol.ranging != "owtt_sync", "downlink": is_plugin(protocol.downlink)}
    for name, known in (("ranging", "owtt_sync"), ("downlink", "one that ships")):
        if refused[name]:
            yield (
                f"protocol.{name}",
                f"{getattr(protocol, name)} works in slots, and with {protocol.schedule} AUVs ping "
                f"as they like; use {known}, or a schedule with slots",
                ("protocol.schedule",),
            )
