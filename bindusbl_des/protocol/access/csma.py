"""Carrier sense with random backoff: AUVs listen before they ping, and hold back while they hear.

The rule is that of ns-3's `UanMacCw` (Parrish, Tracy, Roy, Arabshahi and Fox, "System design
considerations for undersea networks", IEEE JSAC 26(9), 2008).  An AUV that hears nothing as it has
something to send pings at once.  One that hears another's ping, or is pinging itself, draws a
number of slots and counts them down while it is quiet; the count stands still while a ping is
heard.  What else it has to send meanwhile is dropped.
"""

from ..slots import Slots
from .node import PING, Node, Steps


def csma(node: Node, *, window: int = 10, slot_s: float | None = None) -> Steps:
    """Ping once it is quiet, after up to `window` - 1 slots of backoff, each `slot_s` (s) long."""
    length, pinged_at = backoff_slot_s(slot_s, node.slots), -1.0
    for packet in node.packets:
        if packet > pinged_at:
            yield node.until(packet)
            if node.busy():
                yield from hold_back(node, length * int(node.random.integers(window)))
            pinged_at = node.clock
            node.send(PING, waited_s=pinged_at - packet)


def hold_back(node: Node, left_s: float) -> Steps:
    """Wait until it has been quiet for so long (s) in all."""
    counted_to = node.clock
    while True:
        for begins, ends in node.heard(counted_to):
            left_s = max(left_s - max(begins - counted_to, 0.0), 0.0)
            counted_to = max(counted_to, ends)
        if counted_to + left_s <= node.clock:
            return
        yield node.until(counted_to + left_s)


def backoff_slot_s(slot_s: float | None, slots: Slots) -> float:
    """Return the length (s) of a backoff slot: by default a ping and its longest way."""
    return slots.ping_duration + slots.longest_travel_time if slot_s is None else slot_s
