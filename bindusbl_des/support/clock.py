"""The clock on which slots start and fixes are delivered: time as it is, or whole ticks."""

import math
from dataclasses import dataclass

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


@dataclass(frozen=True)
class Clock:
    """The clock on which slots start and fixes are delivered; its rate (Hz) as in :func:`after`.

    >>> Clock(30).after(0.1, 0.498), Clock(30).after(0.11, 0.19), Clock().after(0.1, 0.5)
    (0.6, 0.3, 0.6)
    """

    rate: float = 0.0

    def after(self, start: float, duration: float) -> float:
        """Return the first instant of the clock at least `duration` after `start` (s)."""
        return after(self.rate, start, duration) if self.rate else start + duration
