"""An AUV's own idea of where it is: dead reckoning, corrected by the fixes it receives."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Position = tuple[float, float]


def at_delivery(pinged_at: float, delivered_at: float) -> float:
    """Compare a fix with the present estimate, as the paper does (delay_compensation: none)."""
    return delivered_at


def at_ping(pinged_at: float, delivered_at: float) -> float:
    """Compare a fix with the estimate at the ping it belongs to (delay_compensation: shift)."""
    return pinged_at


# The instant (s) whose dead reckoning a fix is compared with
REFERENCES = {"none": at_delivery, "shift": at_ping}


class FixedGain:
    """A navigator that moves its estimate by a fixed share of each innovation (eq. update).

    Its estimate is dead reckoning plus the sum of its corrections, so that the position at any
    instant needs no stepping from one instant to the next.  It never sees the true position.
    """

    def __init__(
        self,
        dead_reckoning: Callable[[float], Position],
        gain: float,
        reference: Callable[[float, float], float],
        steer: Callable[[Position], None] = lambda _: None,
    ) -> None:
        """Take dead reckoning at any instant (s), the gain, the instant whose dead reckoning a fix
        is compared with, and whom to tell the sum of all corrections (m) after each.
        """
        self._dead_reckoning = dead_reckoning
        self._gain = gain
        self._reference = reference
        self._steer = steer
        self._corrected_at = [0.0]
        self._corrections = [(0.0, 0.0)]

    def estimate(self, time: float) -> Position:
        """Return dead reckoning at an instant (s), moved by all corrections so far (m)."""
        x, y = self._dead_reckoning(time)
        moved_x, moved_y = self._corrections[-1]
        return x + moved_x, y + moved_y

    def correct(self, fix: Position, pinged_at: float, time: float) -> Position:
        """Apply a fix (m) of the instant `pinged_at`, delivered at `time`; return the innovation.

        What dead reckoning said at the ping is shifted by every correction since, so that a fix is
        not charged with an error which an earlier fix has already removed meanwhile.
        """
        x, y = self.estimate(self._reference(pinged_at, time))
        ahead, aside = fix[0] - x, fix[1] - y
        moved_x, moved_y = self._corrections[-1]
        corrections = moved_x + self._gain * ahead, moved_y + self._gain * aside
        self._corrected_at.append(time)
        self._corrections.append(corrections)
        self._steer(corrections)
        return ahead, aside

    def corrections(self) -> tuple[Array, Array]:
        """Return the instants (s) of all corrections, (k,), and the sums of them, (k, 2), in m.

        Before the first fix, from 0 s on, the sum is 0.
        """
        return np.array(self._corrected_at), np.array(self._corrections)
