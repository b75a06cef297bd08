"""DACAP: an AUV requests the band of an ASV, and the nearer it is, the longer it waits for a
warning.

Peleato and Stojanovic, "Distance aware collision avoidance protocol for ad-hoc underwater acoustic
sensor networks", IEEE Communications Letters 11(12), 2007.  An ASV clears a request at once.  A
request of another AUV that has not heard this may still arrive: so that it does before the ping, an
AUV at a distance U from the ASV waits t_min - 2 U / c from the clear to its ping, the less the
farther it is.  With t_min, the shortest handshake, of twice the longest travel time no ping is met
where all decode the clear; a shorter one saves time at some risk.  An ASV that hears another
handshake meanwhile warns its AUV, which backs off, as it does if it hears that itself.  An AUV that
hears requests or clears of others sends its own once these handshakes are over.
"""

from __future__ import annotations

from collections.abc import Generator
from itertools import count
from typing import TYPE_CHECKING, Any

from ...core.protocol.access import PING
from ...core.scenario.families import AccessTraits
from ...core.scenario.key_types import Real, Whole, key
from .acknowledging import acknowledged_s, is_done
from .macau import CLEAR, REQUEST, Macau, acknowledge_once, awaited, keep_quiet
from .t_lohi import waiting

if TYPE_CHECKING:
    import simpy

    from ...core.protocol.access.node import HeardSignal, Node, Steps

WARNING = "warning"


class Dacap(Macau):
    """Settings of the program `dacap`."""

    warning_bytes: Whole = key(2, "B", "size of a warning", ge=1, le=65_535)
    handshake_s: Real | None = key(
        None,
        "s",
        "shortest time from request to ping, less the durations of request and clear; null = "
        "twice the largest travel time",
        ge=0,
        le=3600,
    )


@AccessTraits(settings=Dacap)
def dacap(node: Node, *, settings: Dacap) -> Steps:
    """As an AUV, request the band, and ping once cleared and not warned; as an ASV, clear and warn.

    An AUV backs off for up to `most_rounds` handshakes.
    """
    way = node.slots.longest_travel_time
    request_bytes, clear_bytes = settings.request_bytes, settings.clear_bytes
    shortest = 2.0 * way if settings.handshake_s is None else settings.handshake_s
    answered_s = 2.0 * way + node.lasts_s(clear_bytes)
    pinged_s = shortest + 2.0 * way + node.slots.ping_duration
    pinged_s += acknowledged_s(node, settings, 1)
    length = node.lasts_s(request_bytes) + answered_s + shortest
    if node.is_asv:
        yield from serve(node, settings, pinged_s)
        return
    asked, rounds = node.number % len(node.asvs), 1
    for packet in waiting(node):
        yield node.until(packet)
        for again in count():
            yield from keep_quiet(node, answered_s, pinged_s, 0.0)
            while True:
                to = node.asvs[asked]
                yield node.send(REQUEST, to=to, bytes=request_bytes)
                said = node.clock
                clear = yield from awaited(node, to, said + answered_s)
                if clear is not None:
                    there_and_back = clear.began_at_s - said  # the ASV has answered at once
                    warned = yield from disturbed(node, max(shortest - there_and_back, 0.0))
                    if not warned:
                        break
                else:
                    asked = (asked + 1) % len(node.asvs)
                rounds = min(2 * rounds, settings.most_rounds)
                backoff = rounds * node.random.random() * length
                yield from keep_quiet(node, answered_s, pinged_s, backoff)
            rounds = 1
            sent = node.send(PING, waited_s=node.clock - packet)
            if (yield from is_done(node, settings, sent, again, asvs=1)):
                break
        yield sent


def disturbed(node: Node, lasts_s: float) -> Generator[simpy.Event, Any, bool]:
    """Return whether an AUV hears another handshake, or a warning, within a time (s)."""
    until = node.clock + lasts_s
    while until > node.clock:
        heard: HeardSignal | None = yield node.hears(within_s=until - node.clock)
        if heard is not None and (
            heard.kind in (REQUEST, CLEAR) or (heard.kind, heard.to) == (WARNING, node.name)
        ):
            return True
    return False


def serve(node: Node, settings: Dacap, pinged_s: float) -> Steps:
    """Clear requests, one after the other; warn the cleared AUV, once, if others are heard."""
    taken_until, partner = 0.0, None
    while True:
        heard: HeardSignal = yield node.hears()
        if heard.kind == PING:
            yield from acknowledge_once(node, settings, heard, partner)
        if heard.kind not in (REQUEST, CLEAR):
            continue
        if node.clock < taken_until:
            if partner is not None and heard.sender != partner:
                warned, partner = partner, None
                yield node.send(WARNING, to=warned, bytes=settings.warning_bytes)
                taken_until = 0.0  # its AUV backs off
        elif heard.kind == REQUEST and heard.to == node.name:
            partner = heard.sender
            yield node.send(CLEAR, to=partner, bytes=settings.clear_bytes)
            taken_until = node.clock + pinged_s
