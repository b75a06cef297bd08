"""What the fleet knows when it places its vessels anew, and what somebody makes of it."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..predicted_positions import Prediction

Array = NDArray[np.float64]


@dataclass(frozen=True)
class AnchorView:
    """What the fleet knows when it says where its m vessels are to go (survey frame, m, s).

    It is asked at `time`; vessels set out for what is answered at `begins`, a little later, and are
    at `vessels` (m, 2) by then, on their way to `bound_for` (m, 2).  At first nobody has placed
    them: both are NaN, and they are launched where they are told to go.  `working` (m,) tells who
    has not failed.  They go at `speed` (m/s) and hear AUVs within `reach` (m), seen from above.
    """

    time: float
    begins: float
    vessels: Array
    bound_for: Array
    working: NDArray[np.bool_]
    speed: float
    reach: float
    _prediction: Prediction

    @property
    def is_first(self) -> bool:
        """Whether vessels are yet to be placed."""
        return bool(np.isnan(self.vessels).any())

    def auvs(self, time: float) -> Array:
        """Return where the fleet believes AUVs to be at an instant (s) from `time` on, (n, 3), m.

        That is the last fix of each carried forward by what is planned for it; before the first,
        what is planned from where it was launched.
        """
        return self._prediction.at(time)


class Mover(Protocol):
    """Says where vessels are to go; one for each mission, so that it may remember."""

    def targets(self, view: AnchorView) -> Array:
        """Return where vessels are to go (m, 2), m; those that do not work are not asked for."""
