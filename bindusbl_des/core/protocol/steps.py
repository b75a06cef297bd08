"""Events of a mission at given instants, and checked generators of user-defined parts."""

import math
from collections.abc import Callable, Generator
from typing import Any, NoReturn

import simpy
from simpy.events import Condition

from ...support.clock import Clock
from ...support.plugins import OwnPart
from ..vehicles.fleet import VehicleFleet

# Instants (s) that differ by less are the same: now plus a wait is rounded.
SAME = 1e-6

# So many steps of a user-defined part may follow each other at one instant.
MOST_STEPS = 10_000

HELD = "a mission runs its events itself: mission.advance(until)"

# Stands for the next event of a generator that has ended
_NONE = object()


class MissionEnvironment(simpy.Environment):
    """SimPy's environment of a mission; the mission alone runs its events.

    SimPy's own would lose all events after one at nan s; this one refuses to wait for nan.
    """

    def run(self, until: Any = None) -> NoReturn:
        """Refuse: events that run past the mission would leave it at another time than theirs.

        Raises:
            RuntimeError: always.
        """
        raise RuntimeError(HELD)

    def step(self) -> NoReturn:
        """Refuse, as :meth:`run` does.

        Raises:
            RuntimeError: always.
        """
        raise RuntimeError(HELD)

    def timeout(self, delay: float = 0.0, value: Any = None) -> simpy.Timeout:
        """Return the event `delay` (s) from now.

        Raises:
            ValueError: when that is negative or no number.
        """
        if math.isnan(delay):
            raise ValueError("a wait must last a number of seconds; got nan")
        return simpy.Timeout(self, delay, value)

    def happen(self, last: float) -> None:
        """Run all events up to an instant (s), that instant included."""
        queue, step = self._queue, super().step
        while queue and queue[0][0] <= last:  # `run(until)` may stop beside it by a rounding
            step()

    def show(self, instant: float) -> None:
        """Let the clock show an instant (s) up to which all has happened: who acts from outside
        acts then, not at the last event.
        """
        self._now = max(self._now, instant)

    def happen_next(self) -> None:
        """Run the next event."""
        super().step()

    def end(self) -> None:
        """Drop the callbacks of all events that are still to come.

        Event, process, the process's objects and the environment are a reference cycle, which would
        keep the memory of a finished mission until Python's garbage collector finds it.
        """
        for *_, event in self._queue:
            for callback in event.callbacks:
                waited_for = getattr(callback, "__self__", None)
                if isinstance(waited_for, Condition):  # this event or others, `a | b`
                    waited_for.callbacks.clear()
            event.callbacks.clear()


def moment(env: simpy.Environment, instant: float) -> simpy.Timeout:
    """Return the event of an instant (s), now if that is past."""
    now = env.now
    return simpy.Timeout(env, instant - now if instant > now else 0.0)


def event_of(env: simpy.Environment, instant: float) -> simpy.Timeout:
    """Return the event of an instant (s), now if that is past, for user-defined parts.

    Raises:
        ValueError: when the instant is not finite.
    """
    if not math.isfinite(instant):
        raise ValueError(f"{instant} s is no instant that can be waited for")
    return moment(env, instant)


def check_now(env: simpy.Environment, time: float, wait: str) -> None:
    """Refuse an instant (s) that is not now; `wait` is the message's hint how to wait for it.

    Raises:
        ValueError: when it is another one, or none.
    """
    try:
        is_now = abs(time - env.now) < SAME
    except TypeError:
        kind = type(time).__name__
        raise ValueError(f"the time must be a number of seconds; got a {kind}: {wait}") from None
    if not is_now:
        raise ValueError(f"it is {env.now:g} s, not {time:g} s: {wait}")


def some_work(
    env: simpy.Environment, asvs: VehicleFleet, clock: Clock, time: float
) -> Generator[simpy.Event, None, float]:
    """Wait as long as no ASV works; return the instant (s), `time` or later, when one does."""
    starts = asvs.works_from(time)
    if starts == math.inf:
        yield env.event()  # which never happens
    if starts > time:
        time = clock.after(0.0, starts)
        yield moment(env, time)
    return time


def checked_steps(
    part: OwnPart, steps: Any, env: simpy.Environment, when: str | Callable[[], str]
) -> Generator[simpy.Event, Any, Any]:
    """Run the steps of a user-defined part, and return what they return.

    Raises:
        PluginError: naming key, part and instance (`when`), if they are no generator, raise
            anything, yield anything but an event of this mission, or let no time go by.
    """
    now = when() if callable(when) else when
    if not isinstance(steps, Generator):
        needed = "it must be a generator function, with `yield`"
        part.refuse(steps, f"{now}; {needed}", when=now)
    advance, value = steps.send, None
    since, taken = env.now, 0
    while True:
        now = when() if callable(when) else when
        event, ends = part.ask(_advanced, advance, value, when=now)
        if event is _NONE:
            return ends
        since, taken = (since, taken + 1) if env.now == since else (env.now, 0)
        if taken > MOST_STEPS:
            part.fail(
                f"takes more than {MOST_STEPS:,} steps{now} while no time goes by; it must wait "
                "for later instants"
            )
        if not isinstance(event, simpy.Event) or event.env is not env:
            needed = "it must be an event, as `yield from` gives"
            part.refuse(event, f"{now}; {needed}", when=now, verb="yielded")
        try:
            advance, value = steps.send, (yield event)
        except Exception as error:
            advance, value = steps.throw, error


def _advanced(advance: Callable[[Any], Any], value: Any) -> tuple[Any, Any]:
    """Return a generator's next event and None, or `_NONE` and what it returned; `advance` is its
    `send` or `throw`.
    """
    try:
        return advance(value), None
    except StopIteration as end:
        return _NONE, end.value
