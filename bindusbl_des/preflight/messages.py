"""What is worth knowing of a scenario's modems, of messages that overflow, of short guards, and of
what the fleet believes.
"""

from collections.abc import Iterator
from typing import Any

from ..core.wording import plain
from ..presets.airtimes import airtime_table
from ..scenario.agreement.problem import Problem
from ..scenario.scenario import Scenario
from ..scenario.sections.acoustics import modem_values
from ..scenario.telling import tells_slots
from ..scenario.water import assumed_sound_speed_of


def modems(scenario: Scenario) -> Iterator[Problem]:
    """Yield which keys have other values than the sheet of their band's modem."""
    for name, band in (("hf", scenario.acoustics.hf), ("mf", scenario.acoustics.mf)):
        if band.modem is None:
            continue
        for key, value in modem_values(band.modem, type(band)).items():
            given = getattr(band, key)
            if not _same(key, given, value):
                yield Problem(
                    f"acoustics.{name}.{key}",
                    f"is {plain(given)}, not the {plain(value)} of the modem {band.modem}: what is "
                    "given wins",
                    (f"acoustics.{name}.modem",),
                )


def _same(key: str, given: Any, value: Any) -> bool:
    """Tell whether a key has the value of a sheet; of tables what is in them counts."""
    if key == "airtimes" and given is not None:
        return airtime_table(given) == airtime_table(value)
    return bool(given == value)


def messages(scenario: Scenario) -> Iterator[Problem]:
    """Yield that fixes wait longer and longer for a broadcast that carries the oldest."""
    mf, count = scenario.acoustics.mf, scenario.auvs.count
    if mf.overfull != "oldest_first" or (mf.payload_bytes is None and mf.airtimes is None):
        return
    if scenario.protocol.is_passive or scenario.protocol.downlink == "direct_reply":
        return
    from .round_lengths import rounds_of

    rounds = rounds_of(scenario)
    most = rounds.slots.messages.most
    groups = count if scenario.protocol.downlink == "pipelined_group" else 1
    if most is not None and not rounds.frame and most * groups < count:
        yield Problem(
            "acoustics.mf.overfull",
            f"a message holds {most} fixes and a round may bring {count}, one for each AUV: while "
            "it does, fixes wait longer with every round; split sends them at once",
            ("acoustics.mf.payload_bytes", "acoustics.mf.airtimes", "auvs.count"),
        )


def guards(scenario: Scenario) -> Iterator[Problem]:
    """Yield that slots of one's own end before what was sent in them has passed."""
    protocol, mf = scenario.protocol, scenario.acoustics.mf
    own = protocol.downlink_guard_s, protocol.shortest_downlink_slot_s
    if own == (None, None) or protocol.is_passive or protocol.downlink == "direct_reply":
        return
    from .round_lengths import rounds_of

    slots = rounds_of(scenario).slots
    way = mf.range_m / assumed_sound_speed_of(scenario)
    left = slots.downlink_slot(0) - slots.airtime(0)
    if left < way:
        yield Problem(
            "protocol.downlink_guard_s",
            f"a downlink slot ends {left:.4g} s after its frame, sooner than sound has crossed the "
            f"MF range ({way:.4g} s): the next frame may set out while the end of this one is "
            "under way",
            ("protocol.shortest_downlink_slot_s", "acoustics.mf.range_m"),
        )


def believed(scenario: Scenario) -> Iterator[Problem]:
    """Yield that a fleet does not know where its AUVs are, though it was said to."""
    protocol = scenario.protocol
    truth = protocol.positions == "truth" and "positions" in protocol.model_fields_set
    if truth and tells_slots(scenario):
        yield Problem(
            "protocol.positions",
            "truth is not to be had with knowledge broadcast, where the fleet knows AUVs by their "
            "fixes alone: they are carried_forward; write that, or last_fix",
            ("protocol.knowledge",),
        )
