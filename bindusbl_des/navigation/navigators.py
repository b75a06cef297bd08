"""AUVs' own idea of where they are: dead reckoning, corrected by the fixes that they receive.

A navigator serves the whole fleet, and never sees the true position: it is given fixes as they are
delivered, and what the AUVs' own sensors tell.  Those that ship differ in one thing, the gain by
which a fix changes what is believed of dead reckoning (:mod:`.belief`): a fixed share of the
position (eq. update), the share that the covariances say (Kalman), or none.
"""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..core.handed import Handed
from ..records.recorder import EventBuffer, Levers
from ..records.rows import RECEPTION, Rows
from ..vehicles.motion import Ints
from .belief import Belief, Growth, begun_at, copies
from .correcting import correct
from .dead_reckoning import DeadReckoning, Odometry
from .held import Held, believed
from .memory import Known, desk_for, memory_of
from .weighing import Rule

Array = NDArray[np.float64]

# Fixes of which each errs by itself
NOTHING = Levers(0)


class Navigator(Protocol):
    """What the AUVs make of the fixes that reach them."""

    def correct(self, fixes: Rows, due: Ints) -> None:
        """Take in the fixes (:data:`.rows.FIX`) whose rows are due, in the order of delivery."""

    def estimate(self, auv: int, odometry: Odometry) -> Array:
        """Return where an AUV believed to be (n, 2), m, at the instants of its odometry."""

    def covariance(self, auv: int, odometry: Odometry) -> Array:
        """Return how sure it was of that: variances and covariance xx, yy, xy (n, 3), m2."""


class LinearNavigator:
    """Navigators that believe in a drift of their dead reckoning, and correct it by one rule.

    A fix takes effect when it is delivered, as knowledge about the instant at which it holds.  One
    that arrives after fixes of later instants is put in its place, and those are weighed anew.
    """

    def __init__(
        self,
        reckoning: DeadReckoning,
        rule: Rule,
        growth: Growth,
        first: Belief,
        corrections: Array,
        learnt: Rows,
        common: Levers = NOTHING,
        receptions: EventBuffer | None = None,
    ) -> None:
        """Take dead reckoning, how to correct it, and what is believed at first.

        `first` as of :func:`.belief.first_belief`; for autopilots, `corrections` and `learnt` are
        written as of :class:`.memory.Known`.  Fixes contain of the last states what `common` says,
        and are made of some of the `receptions`.
        """
        #: What each fix contains of the last states.
        self.common = common
        start = copies(first, len(corrections))
        if growth.stretched > 0:
            for auv in range(len(corrections)):
                start.moments[auv] = begun_at(first, reckoning.at(auv, 0.0)).moment[0]
        self._held = Held(start)
        memory, desk = memory_of(first, start), desk_for(first, common.columns)
        receptions = EventBuffer(RECEPTION) if receptions is None else receptions
        known, held, rows = reckoning.known, self._held.all, receptions.array
        self._known = Handed(
            Known(rule, growth, known, memory, held, desk, rows, corrections, learnt)
        )
        receptions.hand_on(self._known, "receptions")

    def correct(self, fixes: Rows, due: Ints) -> None:
        """Take in the fixes whose rows are due; note innovation, its weight, and the change (m)."""
        self._held.make_room(len(due), self._known)
        common, left = self.common.of, self.common.left
        told = (common, left) if self.common.columns else (None, None)
        correct(self._known.address, self._held.count, fixes, due, *told)
        self._held.count += len(due)

    def latest(self, auv: int) -> tuple[Array, Array]:
        """Return the states (k,) that an AUV believes in after its last fix, and their covariance
        (k, k).
        """
        beliefs, last = self._held.all.beliefs, self._held.of(auv)[-1]
        return beliefs.states[last], beliefs.covariances[last]

    def estimate(self, auv: int, odometry: Odometry) -> Array:
        """Return where an AUV believed to be (n, 2), m, at the instants of its odometry."""
        return self._believed(auv, odometry, sure=False)

    def covariance(self, auv: int, odometry: Odometry) -> Array:
        """Return how sure it was of that: variances and covariance xx, yy, xy (n, 3), m2."""
        return self._believed(auv, odometry, sure=True)

    def _believed(self, auv: int, odometry: Odometry, *, sure: bool) -> Array:
        found = np.empty((len(odometry.times), 2 + sure))
        times, position, headings = [np.ascontiguousarray(column) for column in odometry]
        own = self._held.of(auv)
        believed(self._known.address, auv, own, sure, times, position, headings, found)
        return found
