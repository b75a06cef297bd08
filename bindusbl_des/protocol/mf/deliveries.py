"""Fixes on their way to their AUVs: who has which when, and has made of it what he makes of it."""

from collections.abc import Callable, Iterable

import numpy as np
import simpy

from ...core.compiled import compiled
from ...navigation.navigators import Navigator
from ...records.events import DELIVERED, IN_FLIGHT
from ...records.recorder import Recorder
from ...records.rows import Rows
from ...vehicles.fleet import Fleet
from ...vehicles.motion import Ints


class Deliveries:
    """The fixes of a mission that AUVs are yet to have, however they come to them."""

    def __init__(
        self, env: simpy.Environment, auvs: Fleet, navigator: Navigator, record: Recorder
    ) -> None:
        self._env, self._auvs, self._fixes, self._navigator = env, auvs, record.fixes, navigator
        self._undelivered = 0  # fixes before this one are delivered, or never will be
        self._due = np.empty(0, dtype=np.int64)
        #: Whom to tell that a broadcast begins, of fixes whose arrivals are known, and of those
        #: that are delivered: nobody unless somebody waits for that.
        self.on_broadcast: Callable[[], None] | None = None
        self.on_frame: Callable[[Iterable[int]], None] | None = None
        self.on_delivered: Callable[[Ints], None] | None = None

    def _expect(self, fix: int, instant: float) -> None:
        """Let an AUV have a fix at an instant (s), but not before now."""
        arrives = max(instant, self._env.now)
        self._fixes.array[fix]["arrives_at_s"] = arrives
        self._deliver_by(arrives, [fix])

    def _deliver_by(self, instant: float, rows: Iterable[int]) -> None:
        """Let AUVs have fixes of which the last arrives at an instant (s), if anybody can tell."""
        if self.on_frame is not None:
            self.on_frame(rows)
        elif not self._auvs.foreseen:  # they steer by them, or who knows by what
            event = self._env.timeout(max(instant - self._env.now, 0.0))
            event.callbacks.append(lambda _: self.deliver(instant))

    @property
    def first_under_way(self) -> int:
        """The first fix that may still be delivered."""
        return self._undelivered

    def settle(self, time: float) -> None:
        """Let AUVs have what has reached them by an instant (s), all of whose events are over.

        Fixes that nobody waits for are delivered when somebody wants to know, in the order of their
        arrival.  Who steers by them has had each at its own instant, and nothing is left to do.
        """
        if self._auvs.foreseen:
            self.deliver(time)

    def deliver(self, time: float) -> None:
        """Let AUVs have every fix that has reached them by an instant (s)."""
        fixes = self._fixes
        waiting = fixes.count - self._undelivered
        if waiting > len(self._due):
            self._due = np.empty(2 * waiting, dtype=np.int64)
        self._auvs.advance(time)  # up to now AUVs have steered without these fixes
        count, self._undelivered = delivered(
            fixes.array, self._undelivered, fixes.count, time, self._due
        )
        if count:
            self._navigator.correct(fixes.array, self._due[:count])
            if self.on_delivered is not None:
                self.on_delivered(self._due[:count])


@compiled
def delivered(fixes: Rows, first: int, end: int, time: float, due: Ints) -> tuple[int, int]:
    """Note the fixes first..end that have arrived by an instant (s); write their rows to `due`.

    They stand there in the order of their arrival.  Return how many there are, and the first row
    that is still under way.
    """
    count, waiting = 0, end
    for row in range(first, end):
        line = fixes[row]
        if line.outcome != IN_FLIGHT:
            continue
        if line.arrives_at_s <= time:
            line.delivered_at_s, line.outcome = line.arrives_at_s, DELIVERED
            line.latency_s = line.arrives_at_s - line.pinged_at_s
            place = count
            while place > 0 and fixes[due[place - 1]].arrives_at_s > line.arrives_at_s:
                due[place] = due[place - 1]
                place -= 1
            due[place] = row
            count += 1
        elif waiting == end:
            waiting = row
    return count, waiting
