"""An AUV's own idea of where it is: dead reckoning, corrected by the fixes it receives."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Position = tuple[float, float]


def present_estimate(now: Position, then: Position) -> Position:
    """Compare a fix with the present estimate, as the paper does (delay_compensation: none)."""
    return now


def estimate_at_ping(now: Position, then: Position) -> Position:
    """Compare a fix with the estimate at the ping it belongs to (delay_compensation: shift)."""
    return then


INNOVATIONS = {"none": present_estimate, "shift": estimate_at_ping}


class FixedGain:
    """A navigator that moves its estimate by a fixed share of each innovation (eq. update).

    Its estimate is dead reckoning plus the sum of its corrections, so that the position at any
    instant needs no stepping from one instant to the next.  It never sees the true position.
    """

    def __init__(
        self,
        dead_reckoning: Callable[[float], Position],
        gain: float,
        reference: Callable[[Position, Position], Position],
        steer: Callable[[Position], None] = lambda _: None,
    ) -> None:
        """Take dead reckoning at any instant (s), the gain, what fixes are compared with, and whom
        to tell the sum of all corrections (m) after each.
        """
        self._dead_reckoning = dead_reckoning
        self._gain = gain
        self._reference = reference
        self._steer = steer
        self._corrected_at = [0.0]
        self._corrections = [(0.0, 0.0)]

    def estimate(self, time: float) -> Position:
        """Return the horizontal estimate (m) at an instant (s) not before the last correction."""
        return self._shifted(self._dead_reckoning(time))

    def _shifted(self, dead_reckoned: Position) -> Position:
        x, y = self._corrections[-1]
        return dead_reckoned[0] + x, dead_reckoned[1] + y

    def correct(self, fix: Position, pinged_at: float, time: float) -> Position:
        """Apply a fix (m) of the instant `pinged_at`, delivered at `time`; return the innovation.

        What dead reckoning said at the ping is shifted by every correction since, so that a fix is
        not charged with an error which an earlier fix has already removed meanwhile.
        """
        now = self.estimate(time)
        then = self._shifted(self._dead_reckoning(pinged_at))
        x, y = self._reference(now, then)
        innovation = fix[0] - x, fix[1] - y
        last_x, last_y = self._corrections[-1]
        self._corrected_at.append(time)
        self._corrections.append(
            (last_x + self._gain * innovation[0], last_y + self._gain * innovation[1])
        )
        self._steer(self._corrections[-1])
        return innovation

    def corrections(self) -> tuple[Array, Array]:
        """Return the instants (s) of all corrections, (k,), and the sums of them, (k, 2), in m.

        Before the first fix, from 0 s on, the sum is 0.
        """
        return np.array(self._corrected_at), np.array(self._corrections)
