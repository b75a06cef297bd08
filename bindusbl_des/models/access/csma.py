"""Carrier sense with random backoff: AUVs listen before they ping, and hold back while they hear.

The rule is that of ns-3's `UanMacCw` (Parrish, Tracy, Roy, Arabshahi and Fox, "System design
considerations for undersea networks", IEEE JSAC 26(9), 2008).  An AUV that hears nothing as it has
something to send pings at once.  One that hears another's ping, or is pinging itself, draws a
number of slots and counts them down while it is quiet; the count stands still while a ping is
heard.  What else it has to send meanwhile is dropped.
"""

from __future__ import annotations

from itertools import count
from typing import TYPE_CHECKING

from ...core.protocol.access import PING
from ...core.scenario.families import AccessTraits, ScheduleSettings, ScheduleTraits
from ...core.scenario.key_types import Real, Whole, key
from .acknowledging import Acknowledging, acknowledge, is_done

if TYPE_CHECKING:
    from ...core.protocol.access.node import Node, Steps
    from ...core.protocol.slots import Slots
    from ...core.protocol.view import Groups, View


class CarrierSense(ScheduleSettings, Acknowledging):
    """Settings of the program, and of the schedule, `csma`."""

    window: Whole = key(
        10, "1", "an AUV holds back for 0 to window - 1 slots, drawn at random", ge=1, le=1_000_000
    )
    slot_s: Real | None = key(
        None,
        "s",
        "length of a backoff slot; null = a ping and its largest travel time",
        gt=0,
        le=3600,
    )


@ScheduleTraits(settings=CarrierSense, access="sensing")
def by_csma(view: View, *, settings: CarrierSense) -> Groups:
    """Give no AUV a slot: AUVs run the program `csma`."""
    return []


@AccessTraits(settings=CarrierSense, law="sensing", signals=False, on_asvs=False)
def csma(node: Node, *, settings: CarrierSense) -> Steps:
    """Ping once the band is quiet, after up to `window` - 1 slots of backoff."""
    if node.is_asv:
        yield from acknowledge(node, settings)
    length, pinged_at = backoff_slot_s(settings.slot_s, node.slots), -1.0
    for packet in node.packets:
        if packet > pinged_at:
            yield node.until(packet)
            for again in count():
                if node.busy():
                    yield from hold_back(node, length * int(node.random.integers(settings.window)))
                sent = node.send(PING, waited_s=node.clock - packet)
                if (yield from is_done(node, settings, sent, again)):
                    break
            pinged_at = node.clock


def hold_back(node: Node, left_s: float) -> Steps:
    """Wait until the band has been quiet for so long (s) in all."""
    counted_to = node.clock
    while True:
        for begins, ends in node.heard(counted_to):
            left_s = max(left_s - max(begins - counted_to, 0.0), 0.0)
            counted_to = max(counted_to, ends)
        if counted_to + left_s <= node.clock:
            return
        yield node.until(counted_to + left_s)


def backoff_slot_s(slot_s: float | None, slots: Slots) -> float:
    """Return the length (s) of a backoff slot: by default a ping and its longest travel time."""
    return slots.ping_duration + slots.longest_travel_time if slot_s is None else slot_s
