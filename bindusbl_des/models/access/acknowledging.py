"""Acknowledgements of pings by ASVs, and repetitions by AUVs: settings that every program has.

An ASV that has decoded a ping sends an acknowledgement, each ASV in its turn after the ping's end,
so that two never meet at the AUV; an ASV that hears another's before its turn keeps quiet.  An AUV
that hears none from its ping's end until all turns are over backs off, for a random time of up to
2, 4, 8... times a ping, its longest way there and back, and all turns, and pings again, from its
position by then.  One that comes later, as for a ping before, tells nothing of the next ping.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import TYPE_CHECKING, Any

from ...core.protocol.access import PING
from ...core.scenario.key_types import Whole, key
from ...core.scenario.part_choice import Settings

if TYPE_CHECKING:
    import simpy

    from ...core.protocol.access.node import HeardSignal, Node, Steps

ACKNOWLEDGEMENT = "acknowledgement"


class Acknowledging(Settings):
    """Settings that every program has."""

    acknowledgement_bytes: Whole | None = key(
        None,
        "B",
        "size of the signal by which an ASV acknowledges a ping; null = no acknowledgements",
        ge=1,
        le=65_535,
    )
    repeat: Whole = key(
        0,
        "1",
        "how many more times an AUV pings, after a backoff each, until an ASV acknowledges it",
        ge=0,
        le=1000,
    )


def acknowledged_s(node: Node, settings: Acknowledging, asvs: int) -> float:
    """Return how long (s) after its ping an AUV waits for acknowledgements of so many ASVs."""
    size = settings.acknowledgement_bytes
    return 0.0 if size is None else asvs * _turn_s(node, size)


def _turn_s(node: Node, size: int) -> float:
    """Return the length (s) of a turn: the longest round trip, and an acknowledgement."""
    return node.lasts_s(size) + 2.0 * node.slots.longest_travel_time


def is_done(
    node: Node, settings: Acknowledging, sent: simpy.Event, again: int, asvs: int | None = None
) -> Generator[simpy.Event, Any, bool]:
    """Return whether an AUV need not ping again, after its ping number `again`, from 0: one of so
    many ASVs has acknowledged it, or it has been repeated as often as allowed.  If not, wait for
    that, and back off.
    """
    size, is_last = settings.acknowledgement_bytes, again >= settings.repeat
    if size is None and is_last:
        return True
    yield sent
    within = acknowledged_s(node, settings, len(node.asvs) if asvs is None else asvs)
    ended = node.clock
    while size is not None and ended + within > node.clock:
        heard: HeardSignal | None = yield node.hears(within_s=ended + within - node.clock)
        if heard is None or (heard.kind, heard.to) != (ACKNOWLEDGEMENT, node.name):
            continue
        if heard.ended_at_s > ended:
            return True
    if not is_last:
        turn = node.slots.ping_duration + 2.0 * node.slots.longest_travel_time + within
        yield node.wait(turn * 2.0 ** min(again + 1, 10) * node.random.random())
    return is_last


def acknowledge(node: Node, settings: Acknowledging) -> Steps:
    """As an ASV, acknowledge each ping in its turn, unless another ASV has by then; drop an
    acknowledgement that is late.
    """
    size = settings.acknowledgement_bytes
    assert size is not None
    turn_s, place = _turn_s(node, size), node.asvs.index(node.name)
    due: list[tuple[float, str, int | None]] = []
    while True:
        within = max(due[0][0] - node.clock, 0.0) if due else None
        heard: HeardSignal | None = yield node.hears(within_s=within)
        if heard is None:
            time, auv, ping = due.pop(0)
            if node.clock - time < turn_s:
                yield node.send(ACKNOWLEDGEMENT, to=auv, bytes=size, ping=ping)
        elif heard.kind == PING:
            due.append((heard.ended_at_s + place * turn_s, heard.sender, heard.ping))
        elif heard.kind == ACKNOWLEDGEMENT:
            due = [one for one in due if one[1] != heard.to]
