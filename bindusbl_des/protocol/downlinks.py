"""When which fixes travel: the downlinks, each written as the timeline of one round.

All return the instant at which the next round may start.  A scenario can name one of one's own as
``module:object``.
"""

import math
from dataclasses import dataclass
from numbers import Real
from typing import Any

from ..core.plugins import PluginError, asked, shown
from ..scenario.families import DOWNLINK
from ..scenario.part_choice import own_part
from .network import Downlink, Network, Steps, Turn
from .steps import SAME, checked_steps
from .tdma import broadcast, downlink_free, ping_group


def sequential(network: Network, turn: Turn, time: float) -> Steps:
    """All groups ping; then the fixes of the round are broadcast; then the next round starts."""
    for slot in range(len(turn.groups)):
        time = yield from ping_group(network, turn, slot, time)
    broadcast(network, turn, time)
    return (yield from downlink_free(network, time))


def pipelined_round(network: Network, turn: Turn, time: float) -> Steps:
    """All groups ping; their fixes are broadcast while the next round pings."""
    for slot in range(len(turn.groups)):
        time = yield from ping_group(network, turn, slot, time)
    time = yield from downlink_free(network, time)
    broadcast(network, turn, time)
    return time


def pipelined_group(network: Network, turn: Turn, time: float) -> Steps:
    """Each group's fixes are broadcast while the next group pings."""
    for slot in range(len(turn.groups)):
        time = yield from ping_group(network, turn, slot, time)
        time = yield from downlink_free(network, time)
        broadcast(network, turn, time)
    return time


def direct_reply(network: Network, turn: Turn, time: float) -> Steps:
    """All groups ping; the ASV that hears a ping first answers it at once (conventional USBL)."""
    for slot in range(len(turn.groups)):
        time = yield from ping_group(network, turn, slot, time)
    turn.row.downlink_s = 0.0
    return time


DOWNLINKS: dict[str, Downlink] = {
    downlink.__name__: downlink
    for downlink in (sequential, pipelined_round, pipelined_group, direct_reply)
}


def downlink_named(name: str) -> Downlink:
    """Return a downlink by its name in the scenario; one's own is named ``module:object``.

    Raises:
        PluginError: when one's own is not allowed, or cannot be loaded or called.
    """
    if name in DOWNLINKS:
        return DOWNLINKS[name]
    return OwnDownlink(name, own_part(DOWNLINK, name))


# Sound goes a metre in such a time (s): shorter rounds of somebody's own would go on for ever.
SHORTEST_S = 1e-3


@dataclass(frozen=True)
class OwnDownlink:
    """A downlink of somebody's own, by its name in the scenario; it has the queue of fixes, unless
    it declares that each ping is answered by itself (`replies`).
    """

    name: str
    rounds: Downlink

    def __call__(self, network: Network, turn: Turn, time: float) -> Steps:
        """Go through a round from an instant (s); return the instant at which the next begins.

        Raises:
            PluginError: when it raises anything, yields what is no event, or returns what is no
                instant after this one.
        """
        when = f" in round {turn.row.round}"
        steps = asked(DOWNLINK.key, self.name, self.rounds, network, turn, time, when=when)
        answer = yield from checked_steps(DOWNLINK.key, self.name, steps, network.env, when)
        return (yield from self._ended(network, answer, time, when))

    def _ended(self, network: Network, answer: Any, time: float, when: str) -> Steps:
        """Wait for the end of a round and return it (s), if what was returned is one."""
        ends, now = _instant(answer), network.env.now
        if ends is None or ends < time + SHORTEST_S or ends < now - SAME:
            needed = (
                "it must be the instant (s) at which the next round begins, "
                f"{SHORTEST_S:g} s after {time:g} or later"
            )
            waited = f" and not before {now:g}, until when it has waited" if now > time else ""
            said = shown(DOWNLINK.key, self.name, answer, when)
            raise PluginError(
                DOWNLINK.key, f"{self.name!r} returned {said}{when}; {needed}{waited}"
            )
        if ends > now:
            yield network.env.timeout(ends - now)
        return ends


def _instant(answer: Any) -> float | None:
    """Return an answer as a finite instant (s); None for what is none."""
    if not isinstance(answer, Real) or isinstance(answer, bool):
        return None
    try:
        return float(answer) if math.isfinite(answer) else None
    except OverflowError:  # a whole number of hundreds of digits
        return None
