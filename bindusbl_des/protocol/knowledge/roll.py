"""Which AUVs the surface fleet counts on: those it has heard lately."""

import math

import numpy as np
from numpy.typing import NDArray

from ...records.recorder import EventBuffer


class Roll:
    """When each AUV was heard last, as far as the fleet knows: by the fixes that it has made.

    One that has not been heard for `forget_after` (s) is lost, from its launch on.  Lost ones are
    called back in turn.
    """

    def __init__(self, auvs: int, fixes: EventBuffer, forget_after: float | None) -> None:
        self._heard_at, self._fixes, self._noted = np.zeros(auvs), fixes, 0
        self._forget_after = math.inf if forget_after is None else forget_after
        self._recalled_in = np.full(auvs, -1)

    def lost(self, time: float) -> NDArray[np.bool_]:
        """Return which AUVs are lost at an instant (s), (n,)."""
        new = self._fixes.rows[self._noted :]
        np.maximum.at(self._heard_at, new["auv"], new["pinged_at_s"])
        self._noted = self._fixes.count
        return np.asarray(time - self._heard_at > self._forget_after)

    def recall(self, lost: NDArray[np.bool_], number: int) -> int:
        """Return which of the lost AUVs a round (its number) calls back: that of longest ago."""
        auv = int(np.argmin(np.where(lost, self._recalled_in, number)))
        self._recalled_in[auv] = number
        return auv
