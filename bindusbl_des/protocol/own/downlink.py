"""A downlink that somebody has written: its steps and the end of its rounds are checked."""

import math
from dataclasses import dataclass
from numbers import Real
from typing import Any

from ...core.plugins import PluginError, asked, shown
from ...scenario.families import DOWNLINK
from ..network import Downlink, Network, Steps, Turn
from .steps import SAME, checked_steps


@dataclass(frozen=True)
class OwnDownlink:
    """A downlink of somebody's own, by its name in the scenario; it always has the queue of fixes:
    only `direct_reply` answers at once.
    """

    name: str
    policy: Downlink

    def __call__(self, network: Network, turn: Turn, time: float) -> Steps:
        """Go through a round from an instant (s); return the instant at which the next begins.

        Raises:
            PluginError: when it raises anything, yields what is no event, or returns what is no
                instant after this one.
        """
        when = f" in round {turn.row.round}"
        steps = asked(DOWNLINK.key, self.name, self.policy, network, turn, time, when=when)
        answer = yield from checked_steps(DOWNLINK.key, self.name, steps, network.env, when)
        return (yield from self._ended(network, answer, time, when))

    def _ended(self, network: Network, answer: Any, time: float, when: str) -> Steps:
        """Wait for the end of a round and return it (s), if what was returned is one."""
        ends, now = _instant(answer), network.env.now
        if ends is None or ends <= time or ends < now - SAME:
            needed = f"it must be the instant (s) at which the next round begins, after {time:g}"
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
