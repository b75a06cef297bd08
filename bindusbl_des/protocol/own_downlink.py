"""A downlink that somebody has written: its steps and the end of its rounds are checked."""

import math
from collections.abc import Callable, Generator
from dataclasses import dataclass
from numbers import Real
from typing import Any, NoReturn

import simpy

from ..core.plugins import PluginError, asked, shown
from ..scenario.families import DOWNLINK
from .network import Downlink, Network, Steps, Turn

# Instants (s) that differ by less are one: a wait ends where its sum with now is rounded to.
SAME = 1e-6


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
        steps = self._asked(when, self.policy, network, turn, time)
        if not isinstance(steps, Generator):
            self._refuse("returned", steps, when, "it must be a generator function, with `yield`")
        advance, value = steps.send, None
        while True:
            event, ends = self._asked(when, _advanced, advance, value)
            if event is _NONE:
                break
            if not isinstance(event, simpy.Event) or event.env is not network.env:
                self._refuse("yielded", event, when, "it must be an event, as `yield from` gives")
            try:
                advance, value = steps.send, (yield event)
            except Exception as error:
                advance, value = steps.throw, error
        return (yield from self._ended(network, ends, time, when))

    def _ended(self, network: Network, answer: Any, time: float, when: str) -> Steps:
        """Wait for the end of a round and return it (s), if what was returned is one."""
        ends, now = _instant(answer), network.env.now
        if ends is None or ends <= time or ends < now - SAME:
            needed = f"it must be the instant (s) at which the next round begins, after {time:g}"
            waited = f" and not before {now:g}, until when it has waited" if now > time else ""
            self._refuse("returned", answer, when, needed + waited)
        if ends > now:
            yield network.env.timeout(ends - now)
        return ends

    def _asked(self, when: str, verb: Callable[..., Any], *arguments: Any) -> Any:
        return asked(DOWNLINK.key, self.name, verb, *arguments, when=when)

    def _refuse(self, verb: str, answer: Any, when: str, needed: str) -> NoReturn:
        said = shown(DOWNLINK.key, self.name, answer, when)
        raise PluginError(DOWNLINK.key, f"{self.name!r} {verb} {said}{when}; {needed}")


# What a generator yields that has come to its end.
_NONE = object()


def _instant(answer: Any) -> float | None:
    """Return an answer as a finite instant (s); None for what is none."""
    if not isinstance(answer, Real) or isinstance(answer, bool):
        return None
    try:
        return float(answer) if math.isfinite(answer) else None
    except OverflowError:  # a whole number of hundreds of digits
        return None


def _advanced(advance: Callable[[Any], Any], value: Any) -> tuple[Any, Any]:
    """Return the next event of a generator and None, or no event and what it returned."""
    try:
        return advance(value), None
    except StopIteration as end:
        return _NONE, end.value
