"""Deliveries of fixes to AUVs: late and together, or each at its instant where that matters.

An AUV that steers by its fixes, or is moved from outside, gets each fix at its instant.  The fixes
of other AUVs are delivered when they are asked for, in the order of their arrival, with the same
result, bit for bit.
"""

from collections.abc import Callable, Iterable

import numpy as np
import simpy

from ...support.arrays import Ints
from ...support.compiled import compiled
from ..navigation.gnss import GnssReceivers
from ..navigation.navigators import Navigator
from ..records.events import DELIVERED, IN_FLIGHT
from ..records.rows import Recorder, Rows
from ..vehicles.fleet import VehicleFleet
from .outcomes import OwnOutcomes
from .steps import moment


class Deliveries:
    """The fixes of a mission that are yet to be delivered to AUVs."""

    #: Whether an AUV has a fix as soon as it has heard a ping.
    heard_is_had = False

    def __init__(
        self, env: simpy.Environment, auvs: VehicleFleet, navigator: Navigator, record: Recorder
    ) -> None:
        self._env, self._auvs, self._fixes, self._navigator = env, auvs, record.fixes, navigator
        #: The first fix that may still be delivered.
        self.first_under_way = 0
        self._due = np.empty(0, dtype=np.int64)
        #: GNSS receivers, by which AUVs fix themselves at the surface; None: they have none.
        self.gnss: GnssReceivers | None = None
        #: Called as a broadcast begins, with fixes whose arrivals are known, and with fixes as they
        #: are delivered; None where no code waits for these.
        self.on_broadcast: Callable[[], None] | None = None
        self.on_frame: Callable[[Iterable[int]], None] | None = None
        self.on_delivered: Callable[[Ints], None] | None = None

    def _expect(self, fix: int, instant: float) -> None:
        """Schedule the delivery of a fix at an instant (s), but not before now."""
        arrives = max(instant, self._env.now)
        self._fixes.array[fix]["arrives_at_s"] = arrives
        self._deliver_by(arrives, [fix])

    def _deliver_by(self, instant: float, rows: Iterable[int]) -> None:
        """Schedule the delivery of the fixes `rows`, the last of which arrives at `instant` (s), if
        code waits for deliveries or AUVs steer by fixes.
        """
        if self.on_frame is not None:
            self.on_frame(rows)
        elif not self._auvs.foreseen:  # AUVs steer by fixes, or are moved from outside
            moment(self._env, instant).callbacks.append(lambda _: self.deliver(instant))

    def settle(self, time: float) -> None:
        """Deliver the fixes that have arrived by `time` (s), once all events up to then are over.

        AUVs that steer by fixes have had each at its own instant: for them nothing is left to do.
        """
        if self._auvs.foreseen:
            self.deliver(time)

    def deliver(self, time: float) -> None:
        """Deliver every fix that has reached its AUV by an instant (s)."""
        fixes = self._fixes
        waiting = fixes.count - self.first_under_way
        if waiting > len(self._due):
            self._due = np.empty(2 * waiting, dtype=np.int64)
        self._auvs.advance(time)  # AUVs have moved up to now without these fixes
        count, self.first_under_way = delivered(
            fixes.array, self.first_under_way, fixes.count, time, self._due
        )
        due = numbers = self._due[:count]
        if self.gnss is not None:
            numbers = self.gnss.among(fixes.array, due, time)
        if len(numbers):
            self._navigator.correct(fixes.array, numbers)
        if count and self.on_delivered is not None:
            self.on_delivered(due)


class OwnFixes(Deliveries):
    """Fixes that AUVs make themselves: each has its own as soon as it has decoded a ping."""

    heard_is_had = True

    def __init__(
        self,
        env: simpy.Environment,
        auvs: VehicleFleet,
        navigator: Navigator,
        record: Recorder,
        outcomes: OwnOutcomes,
    ) -> None:
        super().__init__(env, auvs, navigator, record)
        self._outcomes = outcomes

    def expect(self, pings: range) -> None:
        """Schedule the delivery of the fix that each AUV may make of these pings, if AUVs steer by
        fixes or are moved from outside.
        """
        if not self._auvs.foreseen:
            lasts = self._outcomes.band.duration
            self._outcomes.when_over(self._env, pings, lambda _, came: self.settle(came + lasts))

    def settle(self, time: float) -> None:
        """Deliver the fixes that AUVs have made by an instant (s)."""
        self._outcomes.resolve_passed(time)
        self.deliver(time)


@compiled
def delivered(fixes: Rows, first: int, end: int, time: float, due: Ints) -> tuple[int, int]:
    """Mark the fixes of rows first..end that have arrived by `time` (s) as delivered; write their
    rows to `due` in the order of their arrival.

    Return how many there are, and the first row that is still in flight (`end`: none).
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
