"""The clock on which slots start and fixes are delivered: time as it is, or whole ticks."""

import math
from dataclasses import dataclass
from typing import Protocol

from .compiled import compiled

# A tick count within this of a whole number is that number: 2.5 * 420 / 1500 * 30 is 21, not 22.
TICK_TOLERANCE = 1e-9

# What lies farther from a tick (ticks) than rounding may put it began between two.
OFF_TICK = 1e-6


@compiled
def after(rate: float, start: float, duration: float) -> float:
    """Return the first instant at least `duration` after `start` (s) on a clock of a rate (Hz).

    From a tick the duration is rounded up to whole ticks (eq. UL_tick, deliver_tick), from between
    two ticks their sum is: a reply begins as it can.  A rate of 0 rounds nothing.
    """
    if rate == 0.0:
        return start + duration
    first = math.ceil(start * rate - TICK_TOLERANCE)
    if first - start * rate > OFF_TICK:
        return math.ceil((start + duration) * rate - TICK_TOLERANCE) / rate
    return (first + math.ceil(duration * rate - TICK_TOLERANCE)) / rate


class Clock(Protocol):
    """The clock on which slots start and fixes are delivered; its rate (Hz) as in :func:`after`."""

    @property
    def rate(self) -> float: ...

    def after(self, start: float, duration: float) -> float:
        """Return the first instant of the clock at least `duration` after `start` (s)."""


class ExactClock:
    """Time as it is: nothing is rounded."""

    rate = 0.0

    def after(self, start: float, duration: float) -> float:
        return start + duration


@dataclass(frozen=True)
class TickClock:
    """Time in ticks of 1/rate: durations are rounded up to whole ticks.

    >>> TickClock(30).after(0.1, 0.498), TickClock(30).after(0.11, 0.19)
    (0.6, 0.3)
    """

    rate: float

    def after(self, start: float, duration: float) -> float:
        return after(self.rate, start, duration)
