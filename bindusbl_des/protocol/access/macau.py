"""MACA-U: an AUV asks an ASV for the band, and pings once that has cleared it.

Ng, Soh and Motani, "MACA-U: a media access protocol for underwater acoustic networks", IEEE
GLOBECOM 2008.  Who hears a request for another keeps quiet until its answer has passed; who hears
another cleared, until the ping has.  An AUV that is not answered doubles the rounds by which it
backs off, up to a limit, and asks the next ASV; an AUV that is takes up with the fewest again.
"""

from collections.abc import Generator
from typing import Any

import simpy

from .node import PING, HeardSignal, Node, Steps
from .t_lohi import waiting

REQUEST, CLEAR = "request", "clear"


def macau(
    node: Node, *, request_bytes: int = 4, clear_bytes: int = 4, most_rounds: int = 64
) -> Steps:
    """Ask, and ping once cleared; as an ASV, clear who asks.

    Requests and clears have so many bytes.  A round is a request, its answer and the way there and
    back; an AUV backs off for up to `most_rounds` of them.
    """
    way = node.slots.longest_travel_time
    request_s, clear_s = node.lasts_s(request_bytes), node.lasts_s(clear_bytes)
    answered_s, pinged_s = 2.0 * way + clear_s, 2.0 * way + node.slots.ping_duration
    if node.is_asv:
        yield from clear(node, clear_bytes, pinged_s)
        return
    asked, rounds = node.number % len(node.asvs), 1
    for packet in waiting(node):
        yield node.until(packet)
        yield from keep_quiet(node, answered_s, pinged_s, 0.0)
        while True:
            to = node.asvs[asked]
            yield node.send(REQUEST, to=to, bytes=request_bytes)
            until = node.clock + answered_s
            answer = yield from awaited(node, to, until)
            if answer is not None:
                break
            asked, rounds = (asked + 1) % len(node.asvs), min(2 * rounds, most_rounds)
            backoff = rounds * node.random.random() * (request_s + answered_s)
            yield from keep_quiet(node, answered_s, pinged_s, backoff)
        rounds = 1
        yield node.send(PING, waited_s=node.clock - packet)


def awaited(node: Node, to: str, until: float) -> Generator[simpy.Event, Any, HeardSignal | None]:
    """Return the answer of an ASV to a request; None if it has not come by an instant (s)."""
    while until > node.clock:
        heard: HeardSignal | None = yield node.hears(within_s=until - node.clock)
        if heard is not None and (heard.kind, heard.sender, heard.to) == (CLEAR, to, node.name):
            return heard
    return None


def keep_quiet(node: Node, answered_s: float, pinged_s: float, backoff: float) -> Steps:
    """Wait for so long (s), and until what others have asked for, as heard meanwhile, has passed:
    so long after a request, or after a clear (s).
    """
    until = node.clock + backoff
    while True:
        heard: HeardSignal | None = yield node.hears(within_s=max(until - node.clock, 0.0))
        if heard is None:
            return
        if heard.kind in (REQUEST, CLEAR):
            lasts = answered_s if heard.kind == REQUEST else pinged_s
            until = max(until, heard.ended_at_s + lasts)


def clear(node: Node, clear_bytes: int, pinged_s: float) -> Steps:
    """Clear who asks, one after the other: nobody until the ping of the one before has passed."""
    taken_until = 0.0
    while True:
        heard: HeardSignal = yield node.hears()
        if heard.kind == REQUEST and heard.to == node.name and node.clock >= taken_until:
            yield node.send(CLEAR, to=heard.sender, bytes=clear_bytes)
            taken_until = node.clock + pinged_s
        elif heard.kind == CLEAR:
            taken_until = max(taken_until, heard.ended_at_s + pinged_s)
