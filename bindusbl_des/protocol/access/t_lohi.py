"""T-Lohi: AUVs reserve the band by tones, and count who else does.

Syed, Ye and Heidemann, "Comparison and evaluation of the T-Lohi MAC for underwater acoustic sensor
networks", IEEE JSAC 26(9), 2008, without a common clock.  An AUV that has something to send sends a
tone and listens for a contention round.  If it has heard nobody it has the band, and pings.  If it
has, it backs off for a share of as many rounds as others contend; whom it then hears, it lets go
first: it sleeps until that is over, and a little longer by chance.

A round is as long as a tone and the longest way (`aggressive`), or there and back (`conservative`):
then no AUV that hears the other can take itself to be alone.
"""

from collections.abc import Iterator
from typing import Literal

from .node import PING, Node, Steps

TONE = "tone"


def t_lohi(
    node: Node,
    *,
    tone_s: float = 0.005,
    rounds: Literal["conservative", "aggressive"] = "conservative",
    recontend_s: float = 0.015,
) -> Steps:
    """Ping once a tone of `tone_s` (s) has met no other for a contention round.

    After somebody else's turn it contends again after up to `recontend_s` (s), drawn at random.
    """
    way = node.slots.longest_travel_time
    length = tone_s + (2.0 * way if rounds == "conservative" else way)
    for packet in waiting(node):
        yield node.until(packet)
        if node.busy():
            yield from sleep(node, length, recontend_s)
        while True:
            yield node.send(TONE, lasts_s=tone_s)
            toned_at = node.clock
            yield node.wait(length)
            contenders = len(node.heard(toned_at))
            if not contenders:
                break
            backed_off_at = node.clock
            yield node.wait(length * contenders * node.random.random())
            if node.heard(backed_off_at):
                yield from sleep(node, length, recontend_s)
        yield node.send(PING, waited_s=node.clock - packet)


def sleep(node: Node, length: float, recontend_s: float) -> Steps:
    """Wait until nothing has been heard for as long as a winner lets pass from its tone to its
    ping, a round, and then a little longer by chance.
    """
    since = node.clock
    while True:
        over = max((ends for _, ends in node.heard(since)), default=since) + length
        if over <= node.clock:
            break
        yield node.until(over)
    yield node.wait(recontend_s * node.random.random())


def waiting(node: Node) -> Iterator[float]:
    """Yield the instants (s) at which there is something to send; what comes while an AUV is busy
    with what it has is left out.
    """
    for packet in node.packets:
        if packet >= node.clock:
            yield packet
