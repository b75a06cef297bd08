"""What the fleet knows when it places its vessels anew, and what somebody makes of it, checked."""

from dataclasses import dataclass
from typing import Any, NoReturn, Protocol

import numpy as np
from numpy.typing import NDArray

from ....support.arrays import Floats, real_numbers
from ....support.plugins import PluginError, asked, shown
from ...scenario.families import PLACEMENT
from ..predicted_positions import Prediction
from ..view import KnownFixes


@dataclass(frozen=True)
class AnchorView:
    """What the fleet knows when it says where its m vessels are to go (survey frame, m, s).

    It is asked at `time`; vessels set out for what is answered at `begins`, a little later, and are
    at `vessels` (m, 2) by then, on their way to `bound_for` (m, 2).  At first nobody has placed
    them: both are NaN, and they are launched where they are told to go.  `working` (m,) tells who
    has not failed.  They go at `speed` (m/s) and hear AUVs within `reach` (m), seen from above.
    How old and how wrong AUVs' estimates are is worked out when it is asked for.
    """

    time: float
    begins: float
    vessels: Floats
    bound_for: Floats
    working: NDArray[np.bool_]
    speed: float
    reach: float
    _prediction: Prediction
    _known: KnownFixes

    @property
    def is_first(self) -> bool:
        """Whether vessels are yet to be placed."""
        return bool(np.isnan(self.vessels).any())

    @property
    def since_s(self) -> Floats:
        """How long (s) before `time` each AUV sent the ping of the last fix that was broadcast for
        it; since the start of the mission where there was none, shape (n,).
        """
        return self._known.since_s(self.time)

    @property
    def expected_error_m(self) -> Floats:
        """How wrong (m, RMS) each AUV's estimate is expected to be at `time`: as its last fix was,
        and what dead reckoning has drifted by on a straight way since, shape (n,).
        """
        return self._known.expected_error_m(self.time)

    def auvs(self, time: float) -> Floats:
        """Return where the fleet believes AUVs to be at an instant (s) from `time` on, (n, 3), m.

        That is the last fix of each carried forward by what is planned for it; before the first,
        what is planned from where it was launched.
        """
        return self._prediction.at(time)


class Mover(Protocol):
    """Says where vessels are to go; one for each mission, so that it may remember."""

    def targets(self, view: AnchorView) -> Floats:
        """Return where vessels are to go (m, 2), m; those that do not work are not asked for."""


class OwnMover:
    """Vessels that somebody's own placement, named ``module:object``, tells where to go."""

    def __init__(self, name: str, mover: Any, farthest_m: float) -> None:
        """Take what the placement was when it was made; targets lie within `farthest_m` (m)."""
        self._name, self._mover, self._farthest = name, mover, farthest_m

    def targets(self, view: AnchorView) -> Floats:
        """Return where vessels are to go (m, 2), m.

        Raises:
            PluginError: when it raises anything, or answers no places.
        """
        count, when = len(view.vessels), f" at {view.time:g} s"
        answer = asked(PLACEMENT.key, self._name, self._mover.targets, view, when=when)
        found: Floats | None = asked(PLACEMENT.key, self._name, real_numbers, answer, when=when)
        if found is None or found.shape != (count, 2):
            self._refuse(answer, when, f"({count}, 2), x and y in m, one for each ASV")
        if not (np.hypot(*found.T) <= self._farthest).all():
            words = f"finite numbers within {self._farthest:.0f} m of the origin, where AUVs are"
            self._refuse(answer, when, words)
        return found

    def _refuse(self, answer: Any, when: str, needed: str) -> NoReturn:
        said = shown(PLACEMENT.key, self._name, answer, when)
        raise PluginError(
            PLACEMENT.key, f"{self._name!r} returned {said}{when}; targets must be {needed}"
        )
