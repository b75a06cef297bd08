"""What AUVs have believed, and since when: where they took themselves for at any instant."""

from math import inf

import numpy as np

from ..core.compiled import compiled
from ..core.growing import lengthened
from ..core.handed import Handed, opened
from ..vehicles.motion import Floats, Ints
from ..vehicles.reckoning import ExpectedDrift, Told, expected_error, way_since
from .belief import Beliefs, Growth, carry, error_spread, expected, on_circle, one, step_on, write
from .correcting import Desk, Holding, Known
from .dead_reckoning import Odometry


class Held:
    """All beliefs that the AUVs of a fleet have held, in the order in which they came about."""

    def __init__(self, first: Beliefs) -> None:
        """Take the first beliefs (n,), held from the start on."""
        self.count = self._fleet = len(first.moments)
        self._sorted = 0
        #: Those of the first `count` rows, and room for more.
        self.all = Holding(np.arange(self.count), np.zeros(self.count), first)

    def make_room(self, count: int, handed: Handed) -> None:
        """Have room in the rows for further ones, also in the field `held` of what is handed."""
        room = len(self.all.holders)
        if self.count + count > room:
            length = max(2 * room, self.count + count)
            holders, since, beliefs = self.all
            longer = Beliefs(*[lengthened(part[: self.count], length) for part in beliefs])
            self.all = Holding(
                lengthened(holders[: self.count], length),
                lengthened(since[: self.count], length),
                longer,
            )
            handed.renew("held", self.all)

    def of(self, auv: int) -> Ints:
        """Return the rows of what an AUV has believed (k,), one after the other."""
        if self._sorted != self.count:  # not a search of all for each AUV
            holders = self.all.holders[: self.count]
            self._order = np.argsort(holders, kind="stable")
            self._ends = np.searchsorted(holders[self._order], np.arange(self._fleet + 1)).tolist()
            self._sorted = self.count
        return self._order[self._ends[auv] : self._ends[auv + 1]]


@compiled
def believed(
    handed: int, auv: int, own: Ints, sure: bool, times: Floats, position: Floats,
    headings: Floats, out: Floats,
) -> None:  # fmt: skip
    """Write the positions (n, 2), m, that an AUV believed in at instants (n,), s, that rise.

    Or how `sure` it was of them: covariances xx, yy, xy (n, 3), m2.  `handed` is the address of a
    :class:`.correcting.Known`, in which its `own` beliefs (k,), by their rows, are held, the first
    from before all `times`; times, position and headings as in :class:`.dead_reckoning.Odometry`.
    """
    known = opened(handed, Known)
    growth, beliefs, since = known.growth, known.held.beliefs, known.held.since
    belief, told, n = known.desk.belief, Odometry(times, position, headings), 0
    for k in range(own.size):
        until = since[own[k + 1]] if k + 1 < own.size else inf
        if n < times.size and times[n] < until:
            write(one(beliefs, own[k]), belief)
        while n < times.size and times[n] < until:
            stop = step_on(belief, auv, times[n], growth, known.reckoning)
            end = n
            while end < times.size and times[end] < until and times[end] <= stop:
                end += 1
            if sure:
                _spread(out, told, n, end, known.desk, growth)
            else:
                _places(out, told, n, end, expected(belief, growth), growth.in_body)
            n = end


@compiled
def _places(
    out: Floats, odometry: Odometry, begin: int, end: int, drift: ExpectedDrift, in_body: bool
) -> None:
    """Write where dead reckoning less the drift expected of it is, of some instants."""
    times, position, headings = odometry.times, odometry.position, odometry.headings
    for n in range(begin, end):
        told = Told(times[n], position[n, 0], position[n, 1], headings[n, 0], headings[n, 1])
        x, y = expected_error(drift, way_since(drift, told, in_body))
        out[n, 0], out[n, 1] = told.x - x, told.y - y


@compiled
def _spread(
    out: Floats, odometry: Odometry, begin: int, end: int, desk: Desk, growth: Growth
) -> None:
    """Write what the covariance of the belief on a desk has become at some instants."""
    times, position, headings = odometry.times, odometry.position, odometry.headings
    spread = desk.ahead.covariance
    for n in range(begin, end):
        told = Told(times[n], position[n, 0], position[n, 1], headings[n, 0], headings[n, 1])
        if growth.stretched + growth.wandering + growth.aligned == 0:
            out[n, 0], out[n, 1], out[n, 2] = error_spread(desk.belief, told, growth)
        else:
            write(desk.belief, desk.ahead)
            carry(desk.ahead, told, growth)
            out[n, 0], out[n, 1], out[n, 2] = on_circle(spread, growth.aligned)
