"""What keeps the frames of a downlink from telling AUVs their slots."""

from collections.abc import Iterator

from ...presets.modems import airtime_table
from ..declared import DOWNLINKS
from ..families import downlink_of, schedule_of
from ..scenario_keys import ScenarioKeys
from ..telling import tells_slots
from .problem import Problem

# Rounds of these downlinks begin when a frame a round ahead can say that they do.
FORESEEN_DOWNLINKS = [name for name, it in DOWNLINKS.items() if it.is_foreseen]


def problems(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield why AUVs cannot be told their slots, where they have to be."""
    if not tells_slots(scenario):
        return
    downlink = scenario.protocol.downlink
    if not downlink_of(scenario).is_foreseen:
        why = (
            "answers each ping at once, and broadcasts nothing that could tell AUVs their slots"
            if downlink_of(scenario).replies
            else "begins its rounds at instants that no frame can tell beforehand"
        )
        yield Problem(
            "protocol.knowledge",
            f"broadcast needs frames that tell AUVs the slots of a round to come; {downlink} {why};"
            f" use {' or '.join(FORESEEN_DOWNLINKS)}, or knowledge shared",
            ("protocol.downlink",),
        )
    schedule = scenario.protocol.schedule
    names_all = schedule_of(scenario).names_all
    if scenario.protocol.dissemination.missed == "contention" and not names_all:
        yield Problem(
            "protocol.knowledge.missed",
            f"contention needs rounds that name all AUVs but those that are lost; {schedule} names "
            "some, and the others cannot tell; use silent or last_slot, or another schedule",
            ("protocol.schedule",),
        )
    room = _room(scenario)
    if room is not None:
        yield from _overfull(scenario, room)


def _room(scenario: ScenarioKeys) -> int | None:
    """Return how many bytes a message has room for beside its header; None for any number."""
    mf = scenario.acoustics.mf
    try:
        measured = None if mf.airtimes is None else airtime_table(mf.airtimes).most_bytes
    except ValueError:
        return None  # which has been told
    sizes = [size for size in (mf.payload_bytes, measured) if size is not None]
    return min(sizes) - mf.header_bytes if sizes else None


def _overfull(scenario: ScenarioKeys, room: int) -> Iterator[Problem]:
    """Yield why messages with room for so many bytes cannot tell AUVs their slots."""
    each, count, mf = (
        scenario.protocol.dissemination.assignment_bytes,
        scenario.auvs.count,
        scenario.acoustics.mf,
    )
    key, others = (
        "protocol.knowledge.assignment_bytes",
        ("acoustics.mf.payload_bytes", "acoustics.mf.modem"),
    )
    if each > room:
        yield Problem(
            key,
            f"a message has room for {room} B beside its header, and one slot is told in {each} B; "
            "make it smaller, or use a modem with larger messages",
            others,
        )
    elif mf.overfull != "split" and each * count + mf.fix_bytes > room:
        yield Problem(
            key,
            f"a broadcast of one message (overfull {mf.overfull}) has room for {room} B beside its "
            f"header, and tells {count} AUVs their slots in {each * count} B, which leaves no fix "
            f"of {mf.fix_bytes} B; use overfull split, or larger messages",
            (*others, "acoustics.mf.overfull", "auvs.count"),
        )
