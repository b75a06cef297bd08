"""How long the slots of the TDMA protocol last, and on which clock they start.

All guards are counted in acoustic crossing times of the survey, so that the protocol stays valid
as the survey grows (paper, section TDMA Acoustic Protocol).
"""

import math
from dataclasses import dataclass
from typing import Protocol

from .compiled import compiled

# eq. guard, UL_min, DL_guard, DL_min: factors of the crossing time
UPLINK_GUARD, SHORTEST_UPLINK = 0.5, 2.5
DOWNLINK_GUARD, SHORTEST_DOWNLINK = 1.25, 10.0

# A tick count within this of a whole number is that number: 2.5 * 420 / 1500 * 30 is 21, not 22.
TICK_TOLERANCE = 1e-9


def crossing_time(side: float, sound_speed: float = 1500.0) -> float:
    """Return the time t_C (s) that sound takes to cross the survey (eq. t_cross).

    >>> crossing_time(60)
    0.04
    """
    return side / sound_speed


def longest_way(hf_range: float, depth: float, metric: str) -> float:
    """Return the longest way (m) of a ping that is heard, from a depth (m) to the surface.

    A horizontal range says nothing of the depth: sound takes the slant way.

    >>> longest_way(40.0, 30.0, "horizontal"), longest_way(40.0, 30.0, "slant")
    (50.0, 40.0)
    """
    return math.hypot(hf_range, depth) if metric == "horizontal" else hf_range


def uplink_slot(ping_duration: float, longest_travel_time: float, crossing: float) -> float:
    """Return the slot T_UL (s) that holds a ping, its way and its echoes (eq. UL_slot).

    >>> round(uplink_slot(0.010, 50 / 1500, crossing_time(140)), 6)
    0.233333
    """
    guarded = ping_duration + longest_travel_time + UPLINK_GUARD * crossing
    return max(guarded, SHORTEST_UPLINK * crossing)


def two_way_uplink_slot(
    ping_duration: float, longest_travel_time: float, turnaround: float, crossing: float
) -> float:
    """Return the slot (s) that holds an interrogation, its reply and the echoes (ranging twtt)."""
    return uplink_slot(2 * ping_duration + turnaround, 2 * longest_travel_time, crossing)


def payload_bytes(fix_count: int, header: int = 8, record: int = 16) -> int:
    """Return the bytes of a broadcast of `fix_count` fixes (eq. payload).

    >>> payload_bytes(3)
    56
    """
    return header + fix_count * record


def airtime(size_bytes: int, bit_rate: float = 2000.0, overhead: float = 2.0) -> float:
    """Return how long (s) a payload occupies the downlink, T_tx (eq. Ttx).

    >>> airtime(payload_bytes(3))
    0.448
    """
    return size_bytes * 8 * overhead / bit_rate


def downlink_slot(frame_airtime: float, crossing: float) -> float:
    """Return the slot T_DL (s) that holds a broadcast and its guard (eq. DL_slot).

    >>> round(downlink_slot(0.448, crossing_time(60)), 6)
    0.498
    """
    return max(frame_airtime + DOWNLINK_GUARD * crossing, SHORTEST_DOWNLINK * crossing)


@compiled
def after(rate: float, start: float, duration: float) -> float:
    """Return the first instant at least `duration` after `start` (s) on a clock of a rate (Hz).

    Both are rounded up to whole ticks (eq. UL_tick, deliver_tick); a rate of 0 rounds nothing.
    """
    if rate == 0.0:
        return start + duration
    first = math.ceil(start * rate - TICK_TOLERANCE)
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

    >>> TickClock(30).after(0.1, 0.498)
    0.6
    """

    rate: float

    def after(self, start: float, duration: float) -> float:
        return after(self.rate, start, duration)


@dataclass(frozen=True)
class Slots:
    """Every duration of the protocol for one survey, derived once and configured nowhere else."""

    crossing_time: float
    ping_duration: float
    longest_travel_time: float
    uplink_slot: float
    header_bytes: int
    fix_bytes: int
    bit_rate: float
    overhead: float
    clock: Clock

    def payload_bytes(self, fix_count: int) -> int:
        """Return the bytes of a broadcast of `fix_count` fixes."""
        return payload_bytes(fix_count, self.header_bytes, self.fix_bytes)

    def airtime(self, fix_count: int) -> float:
        """Return the airtime T_tx (s) of a broadcast of `fix_count` fixes."""
        return airtime(self.payload_bytes(fix_count), self.bit_rate, self.overhead)

    def downlink_slot(self, fix_count: int) -> float:
        """Return the downlink slot T_DL (s) for a broadcast of `fix_count` fixes."""
        return downlink_slot(self.airtime(fix_count), self.crossing_time)

    def round_length(self, groups: int, fix_count: int) -> float:
        """Return the length (s) of a sequential round on this clock."""
        end = 0.0
        for _ in range(groups):
            end = self.clock.after(end, self.uplink_slot)
        return self.clock.after(end, self.downlink_slot(fix_count))
