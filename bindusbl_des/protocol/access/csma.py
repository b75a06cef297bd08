"""Carrier sense with random backoff: AUVs listen before they ping, and hold back while they hear.

The rule is that of ns-3's `UanMacCw` (Parrish, Tracy, Roy, Arabshahi and Fox, "System design
considerations for undersea networks", IEEE JSAC 26(9), 2008).  An AUV that hears nothing as it has
something to send pings at once.  One that hears another's ping, or is pinging itself, draws a
number of slots and counts them down while it is quiet; the count stands still while a ping is
heard.  What else it has to send meanwhile is dropped.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from heapq import heapify, heapreplace

from .aloha import Sending
from .listening import Listening


@dataclass(slots=True)
class Held:
    """A ping that is held back: since when (s) there has been one, for how long (s) it is still
    counted down, and the instant (s) up to which that takes account of all that was heard.
    """

    packet_at_s: float
    left_s: float
    counted_to_s: float


class Csma:
    """Carrier sense: who pings when, by what each AUV hears."""

    def __init__(
        self,
        packets: Sequence[Iterator[float]],
        listening: Listening,
        backoff: Callable[[int], float],
        ping_s: float,
    ) -> None:
        """Take the instants (s) at which each AUV has something to send; what AUVs hear; how long
        (s) an AUV is to hold back in quiet, drawn whenever it is asked for; how long it pings (s).
        """
        self._packets, self._listening, self._backoff = packets, listening, backoff
        self._lasts = ping_s
        self._next = [(next(own), auv) for auv, own in enumerate(packets)]
        heapify(self._next)
        self._held: dict[int, Held] = {}
        self._silent_from = [0.0] * len(packets)  # when the own ping of each AUV is over

    @property
    def next_at(self) -> float:
        """The next instant (s) at which an AUV has something to send, or has counted down."""
        return self._next[0][0]

    def due(self) -> Sending:
        """Return the AUV that pings then, if it does."""
        time, auv = self._next[0]
        self._listening.forget(min([time, *(it.counted_to_s for it in self._held.values())]))
        held = self._held.get(auv)
        if held is None:
            if not self._busy(auv, time, time):
                return self._ping(auv, time, time)
            held = self._held[auv] = Held(time, self._backoff(auv), time)
        counted_down = self._count_down(auv, held, time)
        if counted_down <= time:
            del self._held[auv]
            return self._ping(auv, time, held.packet_at_s)
        heapreplace(self._next, (counted_down, auv))
        return Sending([])

    def _ping(self, auv: int, time: float, packet_at: float) -> Sending:
        self._listening.begin(auv, time)
        self._silent_from[auv] = time + self._lasts
        later = next(it for it in self._packets[auv] if it > time)
        heapreplace(self._next, (later, auv))
        return Sending([auv], time - packet_at)

    def _busy(self, auv: int, since: float, time: float) -> list[tuple[float, float]]:
        """Return from when to when (s) an AUV hears a ping between two instants (s), or sends."""
        begun = self._listening.heard(auv, since, time)
        if self._silent_from[auv] > since:
            begun = sorted([*begun, self._silent_from[auv] - self._lasts])
        return [(at, at + self._lasts) for at in begun]

    def _count_down(self, auv: int, held: Held, time: float) -> float:
        """Count down what is left up to an instant (s); return when it may be over (s)."""
        for begins, ends in self._busy(auv, held.counted_to_s, time):
            held.left_s = max(held.left_s - max(begins - held.counted_to_s, 0.0), 0.0)
            held.counted_to_s = max(held.counted_to_s, ends)
        return held.counted_to_s + held.left_s
