"""ALOHA: AUVs ping without asking whether anybody else does; and how often nobody else does.

Abramson, "The ALOHA system", AFIPS 1970; with slots Roberts, "ALOHA packet system with and without
slots and capture", 1975.
"""

from collections.abc import Iterator, Sequence
from heapq import heapify, heapreplace
from math import ceil
from typing import NamedTuple, Protocol

from ...core.clock import Clock


class Sending(NamedTuple):
    """AUVs that begin to ping at one instant, and for how long (s) they have held back; None where
    nobody ever does.
    """

    auvs: Sequence[int]
    waited_s: float | None = None


class Access(Protocol):
    """Who pings when: asked for one instant after the other."""

    @property
    def next_at(self) -> float:
        """The next instant (s) at which somebody may begin to ping."""

    def due(self) -> Sending:
        """Return who begins to ping at that instant, perhaps nobody, and go on to the next one."""


class Aloha:
    """Pure ALOHA: each AUV pings at the instants of its own Poisson process.

    An instant at which it is still pinging is left out.  Of N AUVs whose pings last T, at mean
    intervals F, each ping is clear of all others' with a probability of
    (e^-a / (1 + a))^(N - 1), a = T / F: the textbook's e^(-2 G (N - 1) / N), G = N a, but for a
    share of (N - 1) a^2 / 2.
    """

    def __init__(self, packets: Sequence[Iterator[float]], ping_s: float) -> None:
        """Take the instants (s) at which each AUV has something to send; pings last `ping_s`."""
        self._packets, self._lasts = packets, ping_s
        self._next = [(next(own), auv) for auv, own in enumerate(packets)]
        heapify(self._next)

    @property
    def next_at(self) -> float:
        """The next instant (s) at which an AUV pings."""
        return self._next[0][0]

    def due(self) -> Sending:
        """Return the AUV that pings then."""
        time, auv = self._next[0]
        later = next(instant for instant in self._packets[auv] if instant >= time + self._lasts)
        heapreplace(self._next, (later, auv))
        return Sending([auv])


class SlottedAloha:
    """Slotted ALOHA: what an AUV has to send in a slot is one ping at the start of the next.

    Of N AUVs each has something to send in a slot of length T with the probability p = 1 - e^(-T /
    F), so that a ping is alone in its slot with (1 - p)^(N - 1) = e^(-G (N - 1) / N), G = N T / F.
    """

    def __init__(self, packets: Sequence[Iterator[float]], slot_s: float, clock: Clock) -> None:
        """Take the instants (s) at which each AUV has something to send, and slots on a clock."""
        self._packets, self._clock = packets, clock
        self._slot = clock.after(0.0, slot_s)
        self._next = [(self._slot_after(next(own)), auv) for auv, own in enumerate(packets)]
        heapify(self._next)

    def _slot_after(self, instant: float) -> int:
        """Return the number of the first slot that begins at an instant (s) or later."""
        return ceil(instant / self._slot)

    @property
    def next_at(self) -> float:
        """The start (s) of the next slot in which an AUV pings."""
        return self._clock.after(0.0, self._next[0][0] * self._slot)

    def due(self) -> Sending:
        """Return the AUVs that ping in that slot."""
        slot, auvs = self._next[0][0], []
        while self._next[0][0] == slot:
            auv = self._next[0][1]
            later = next(
                following
                for following in map(self._slot_after, self._packets[auv])
                if following > slot
            )
            heapreplace(self._next, (later, auv))
            auvs.append(auv)
        return Sending(auvs)
