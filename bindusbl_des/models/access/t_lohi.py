"""T-Lohi: AUVs reserve the band by tones, and count other contenders.

Syed, Ye and Heidemann, "Comparison and evaluation of the T-Lohi MAC for underwater acoustic sensor
networks", IEEE JSAC 26(9), 2008, without a common clock.  An AUV that has something to send sends a
tone and listens for a contention round.  If it hears no other it has the band, and pings.  Else it
backs off for a random share of as many rounds as others contend; if it then hears another, it lets
that one go first: it sleeps until the other's turn is over, and a random time longer.

A round is as long as a tone and the longest travel time (`aggressive`), or there and back
(`conservative`): then of two AUVs that hear each other neither can believe to be alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count
from typing import TYPE_CHECKING, Literal

from ...core.protocol.access import PING
from ...core.scenario.families import AccessTraits
from ...core.scenario.key_types import Real, key
from .acknowledging import Acknowledging, acknowledge, is_done

if TYPE_CHECKING:
    from ...core.protocol.access.node import Node, Steps

TONE = "tone"


class TLohi(Acknowledging):
    """Settings of the program `t_lohi`."""

    tone_s: Real = key(0.005, "s", "duration of a tone", gt=0, le=10)
    rounds: Literal["conservative", "aggressive"] = key(
        "conservative",
        "",
        "length of a contention round: a tone and twice, or once, the largest travel time",
    )
    recontend_s: Real = key(
        0.015, "s", "longest random wait before an AUV contends again after another's turn", ge=0,
        le=3600,
    )  # fmt: skip


@AccessTraits(settings=TLohi, on_asvs=False)
def t_lohi(node: Node, *, settings: TLohi) -> Steps:
    """Ping once a tone has met no other for a contention round.

    After another's turn it contends again after up to `recontend_s` (s), drawn at random.
    """
    if node.is_asv:
        yield from acknowledge(node, settings)
    way, tone_s, recontend_s = node.slots.longest_travel_time, settings.tone_s, settings.recontend_s
    length = tone_s + (2.0 * way if settings.rounds == "conservative" else way)
    for packet in waiting(node):
        yield node.until(packet)
        for again in count():
            yield from contend(node, length, tone_s, recontend_s)
            sent = node.send(PING, waited_s=node.clock - packet)
            if (yield from is_done(node, settings, sent, again)):
                break
        yield sent


def contend(node: Node, length: float, tone_s: float, recontend_s: float) -> Steps:
    """Wait until a tone has met no other for a contention round of a `length` (s)."""
    if node.busy():
        yield from sleep(node, length, recontend_s)
    while True:
        yield node.send(TONE, lasts_s=tone_s)
        toned_at = node.clock
        yield node.wait(length)
        contenders = len(node.heard(toned_at))
        if not contenders:
            return
        backed_off_at = node.clock
        yield node.wait(length * contenders * node.random.random())
        if node.heard(backed_off_at):
            yield from sleep(node, length, recontend_s)


def sleep(node: Node, length: float, recontend_s: float) -> Steps:
    """Wait until the band has been quiet for a round, the time between a winner's tone and its
    ping, and a random time longer.
    """
    since = node.clock
    while True:
        over = max((ends for _, ends in node.heard(since)), default=since) + length
        if over <= node.clock:
            break
        yield node.until(over)
    yield node.wait(recontend_s * node.random.random())


def waiting(node: Node) -> Iterator[float]:
    """Yield the instants (s) at which there is something to send; instants while the AUV is busy
    with the one before are dropped.
    """
    for packet in node.packets:
        if packet >= node.clock:
            yield packet
