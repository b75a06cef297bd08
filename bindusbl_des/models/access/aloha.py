"""ALOHA: AUVs ping without listening, and the probability that a ping meets no other.

Abramson, "The ALOHA system", AFIPS 1970; with slots Roberts, "ALOHA packet system with and without
slots and capture", 1975.
"""

from __future__ import annotations

from itertools import count
from math import ceil
from typing import TYPE_CHECKING

from ...core.protocol.access import PING
from ...core.scenario.families import AccessTraits, ScheduleTraits
from .acknowledging import Acknowledging, acknowledge, is_done

if TYPE_CHECKING:
    from ...core.protocol.access.node import Node, Steps
    from ...core.protocol.view import Groups, View


@ScheduleTraits(access="poisson")
def by_aloha(view: View) -> Groups:
    """Give no AUV a slot: AUVs run the program `aloha`."""
    return []


@ScheduleTraits(access="slotted")
def by_slotted_aloha(view: View) -> Groups:
    """Give no AUV a slot: AUVs run the program `slotted_aloha`."""
    return []


@AccessTraits(settings=Acknowledging, law="poisson", hears=False, signals=False, on_asvs=False)
def aloha(node: Node, *, settings: Acknowledging) -> Steps:
    """Ping whenever there is something to send, unless a ping lasts still; then it is dropped.

    Of N AUVs whose pings last T, at mean intervals F, each ping is clear of all others' with a
    probability of (e^-a / (1 + a))^(N - 1), a = T / F: the textbook's e^(-2 G (N - 1) / N), G = N
    a, but for a share of (N - 1) a^2 / 2.
    """
    if node.is_asv:
        yield from acknowledge(node, settings)
    for packet in node.packets:
        if packet >= node.clock:
            yield node.until(packet)
            for again in count():
                sent = node.send(PING)
                if (yield from is_done(node, settings, sent, again)):
                    break
            yield sent


@AccessTraits(settings=Acknowledging, law="slotted", hears=False, signals=False, on_asvs=False)
def slotted_aloha(node: Node, *, settings: Acknowledging) -> Steps:
    """Ping at the start of a slot if there was anything to send in the one before.

    Of N AUVs each has something to send in a slot of length T with the probability p = 1 - e^(-T /
    F), so that a ping is alone in its slot with (1 - p)^(N - 1) = e^(-G (N - 1) / N), G = N T / F.
    """
    if node.is_asv:
        yield from acknowledge(node, settings)
    clock, last = node.slots.clock, -1
    length = clock.after(0.0, node.slots.uplink_slot)
    for packet in node.packets:
        slot = ceil(packet / length)
        for again in count() if slot > last else ():
            yield node.until(clock.after(0.0, slot * length))
            sent, last = node.send(PING), slot
            if (yield from is_done(node, settings, sent, again)):
                last = max(last, int(node.clock / length))
                break
            slot = ceil(node.clock / length)
