"""MACA-U: an AUV requests the band of an ASV, and pings once the ASV has cleared it.

Ng, Soh and Motani, "MACA-U: a media access protocol for underwater acoustic networks", IEEE
GLOBECOM 2008.  An AUV that hears a request of another keeps quiet until its answer has passed; an
AUV that hears another cleared, until that one's ping has.  An AUV without an answer doubles the
rounds by which it backs off, up to a limit, and asks the next ASV; after an answer it begins with
one round again.
"""

from __future__ import annotations

from collections.abc import Generator
from itertools import count
from typing import TYPE_CHECKING, Any

from ...core.protocol.access import PING
from ...core.scenario.families import AccessTraits
from ...core.scenario.key_types import Whole, key
from .acknowledging import ACKNOWLEDGEMENT, Acknowledging, acknowledged_s, is_done
from .t_lohi import waiting

if TYPE_CHECKING:
    import simpy

    from ...core.protocol.access.node import HeardSignal, Node, Steps

REQUEST, CLEAR = "request", "clear"


class Macau(Acknowledging):
    """Settings of the program `macau`."""

    request_bytes: Whole = key(4, "B", "size of a request", ge=1, le=65_535)
    clear_bytes: Whole = key(4, "B", "size of a clear", ge=1, le=65_535)
    most_rounds: Whole = key(
        64, "1", "most rounds for which an AUV without clearance backs off", ge=1, le=1_000_000
    )


@AccessTraits(settings=Macau)
def macau(node: Node, *, settings: Macau) -> Steps:
    """As an AUV, request the band, and ping once cleared; as an ASV, clear requests.

    A round is a request, its answer and the travel time there and back; an AUV backs off for up to
    `most_rounds` of them.
    """
    way, request_bytes = node.slots.longest_travel_time, settings.request_bytes
    request_s, clear_s = node.lasts_s(request_bytes), node.lasts_s(settings.clear_bytes)
    answered_s, pinged_s = 2.0 * way + clear_s, 2.0 * way + node.slots.ping_duration
    pinged_s += acknowledged_s(node, settings, 1)
    if node.is_asv:
        yield from clear(node, settings, pinged_s)
        return
    asked, rounds = node.number % len(node.asvs), 1
    for packet in waiting(node):
        yield node.until(packet)
        for again in count():
            yield from keep_quiet(node, answered_s, pinged_s, 0.0)
            while True:
                to = node.asvs[asked]
                yield node.send(REQUEST, to=to, bytes=request_bytes)
                until = node.clock + answered_s
                answer = yield from awaited(node, to, until)
                if answer is not None:
                    break
                asked, rounds = (asked + 1) % len(node.asvs), min(2 * rounds, settings.most_rounds)
                backoff = rounds * node.random.random() * (request_s + answered_s)
                yield from keep_quiet(node, answered_s, pinged_s, backoff)
            rounds = 1
            sent = node.send(PING, waited_s=node.clock - packet)
            if (yield from is_done(node, settings, sent, again, asvs=1)):
                break
        yield sent


def awaited(node: Node, to: str, until: float) -> Generator[simpy.Event, Any, HeardSignal | None]:
    """Return an ASV's answer to a request; None if it has not come by an instant (s)."""
    while until > node.clock:
        heard: HeardSignal | None = yield node.hears(within_s=until - node.clock)
        if heard is not None and (heard.kind, heard.sender, heard.to) == (CLEAR, to, node.name):
            return heard
    return None


def keep_quiet(node: Node, answered_s: float, pinged_s: float, backoff: float) -> Steps:
    """Wait for a `backoff` (s), and for the handshakes of others heard meanwhile: `answered_s` (s)
    after a request, `pinged_s` (s) after a clear.
    """
    until = node.clock + backoff
    while True:
        heard: HeardSignal | None = yield node.hears(within_s=max(until - node.clock, 0.0))
        if heard is None:
            return
        if heard.kind in (REQUEST, CLEAR):
            lasts = answered_s if heard.kind == REQUEST else pinged_s
            until = max(until, heard.ended_at_s + lasts)


def clear(node: Node, settings: Macau, pinged_s: float) -> Steps:
    """Clear requests, the next once the ping of the one before has passed, and has been
    acknowledged where pings are.
    """
    taken_until, partner = 0.0, None
    while True:
        heard: HeardSignal = yield node.hears()
        if heard.kind == REQUEST and heard.to == node.name and node.clock >= taken_until:
            partner = heard.sender
            yield node.send(CLEAR, to=partner, bytes=settings.clear_bytes)
            taken_until = node.clock + pinged_s
        elif heard.kind == PING:
            yield from acknowledge_once(node, settings, heard, partner)
        elif heard.kind == CLEAR:
            taken_until = max(taken_until, heard.ended_at_s + pinged_s)


def acknowledge_once(node: Node, settings: Macau, heard: HeardSignal, partner: str | None) -> Steps:
    """Acknowledge the ping of the AUV that an ASV has cleared, where pings are acknowledged."""
    if settings.acknowledgement_bytes is not None and heard.sender == partner:
        size = settings.acknowledgement_bytes
        yield node.send(ACKNOWLEDGEMENT, to=partner, bytes=size, ping=heard.ping)
