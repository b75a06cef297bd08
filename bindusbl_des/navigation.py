"""AUVs' own idea of where they are: dead reckoning, corrected by the fixes that they receive."""

from math import hypot

import numpy as np
from numpy.typing import NDArray

from .columns import (
    AUV_OF_FIX,
    CORRECTION,
    DELIVERED_AT,
    INNOVATION,
    MOVED,
    OUTCOME_OF_FIX,
    POSITION,
    VALID_AT,
)
from .compiled import compiled
from .dead_reckoning import DeadReckoning, reckoned
from .events import DELIVERED
from .motion import Floats, Ints

Array = NDArray[np.float64]


class FixedGain:
    """Navigators that move their estimates by a fixed share of each innovation (eq. update).

    An estimate is dead reckoning plus the sum of the AUV's `corrections` (n, 2), m, so that the
    position at any instant needs no stepping from one instant to the next.  Navigators never see
    the true position.
    """

    def __init__(
        self, reckoning: DeadReckoning, gain: float, delay_compensation: str, corrections: Array
    ) -> None:
        """Take dead reckoning, the gain, and where the sums of corrections are to be written.

        A fix is compared with the estimate at its delivery, as the paper does
        (`delay_compensation` "none"), or with that at the instant at which it holds, shifted by
        every correction since ("shift"), so that it is not charged with an error that an earlier
        fix has removed.
        """
        self.corrections = corrections
        self._reckoning, self._gain = reckoning, gain
        self._shifts = delay_compensation == "shift"

    def estimate(self, auv: int, time: float) -> tuple[float, float]:
        """Return where an AUV believes to be (m) at an instant (s), by all corrections so far."""
        x, y = self._reckoning.at(auv, time)
        return x + float(self.corrections[auv, 0]), y + float(self.corrections[auv, 1])

    def correct(self, fixes: Floats, due: Ints) -> None:
        """Apply the fixes whose rows are `due`; note innovations, corrections, sums (m)."""
        _correct(fixes, due, self._gain, self._shifts, self.corrections, *self._reckoning.known)


@compiled
def _correct(
    fixes: Floats, due: Ints, gain: float, shifts: bool, corrections: Floats, table: Floats,
    first: Ints, step: float, walks: Floats, rate: float, biases: Floats, in_body: bool,
) -> None:  # fmt: skip
    for row in due:
        fix = fixes[row]
        auv = int(fix[AUV_OF_FIX])
        time = fix[VALID_AT] if shifts else fix[DELIVERED_AT]
        x, y, _, _, ahead, aside = reckoned(
            auv, time, table, first, step, walks, rate, biases, in_body
        )
        ahead = fix[POSITION] - (x + ahead + corrections[auv, 0])
        aside = fix[POSITION + 1] - (y + aside + corrections[auv, 1])
        fix[INNOVATION] = hypot(ahead, aside)
        fix[MOVED] = gain * fix[INNOVATION]
        corrections[auv, 0] += gain * ahead
        corrections[auv, 1] += gain * aside
        fix[CORRECTION], fix[CORRECTION + 1] = corrections[auv, 0], corrections[auv, 1]


def corrections_of(fixes: Floats, auv: int) -> tuple[Array, Array]:
    """Return the instants (s) of all corrections of an AUV, (k,), and their sums, (k, 2), in m.

    `fixes` are all fixes on record.  Before the first one, from 0 s on, the sum is 0.
    """
    own = fixes[(fixes[:, AUV_OF_FIX] == auv) & (fixes[:, OUTCOME_OF_FIX] == DELIVERED)]
    own = own[np.argsort(own[:, DELIVERED_AT], kind="stable")]
    at, sums = np.zeros(len(own) + 1), np.zeros((len(own) + 1, 2))
    at[1:], sums[1:] = own[:, DELIVERED_AT], own[:, CORRECTION : CORRECTION + 2]
    return at, sums
