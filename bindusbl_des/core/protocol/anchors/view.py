"""What the fleet knows when it places its ASVs anew, and the check of a user-defined placement."""

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
    """What the fleet knows when it decides where its m ASVs are to go (survey frame, m, s).

    A placement is asked at `time`; ASVs set out for its targets at `begins`, a little later.  By
    then they are at `vessels` (m, 2), under way to `bound_for` (m, 2); before the first placement
    both are NaN, and ASVs are launched at the targets.  `working` (m,) tells which have not failed.
    They go at `speeds` (m,), m/s, and hear AUVs within the horizontal `reach` (m).  The age and
    error of AUVs' estimates are worked out when they are asked for.
    """

    time: float
    begins: float
    vessels: Floats
    bound_for: Floats
    working: NDArray[np.bool_]
    speeds: Floats
    reach: float
    _prediction: Prediction
    _known: KnownFixes

    @property
    def speed(self) -> float:
        """The speed (m/s) of the slowest ASV."""
        return float(self.speeds.min())

    @property
    def is_first(self) -> bool:
        """Whether ASVs are yet to be launched."""
        return bool(np.isnan(self.vessels).any())

    @property
    def since_s(self) -> Floats:
        """Age (s) at `time` of each AUV's last broadcast fix, since its ping was sent; since the
        start of the mission before the first fix; shape (n,).
        """
        return self._known.since_s(self.time)

    @property
    def expected_error_m(self) -> Floats:
        """Expected error (m, RMS) of each AUV's estimate at `time`: the error of its last fix, and
        the drift of dead reckoning on a straight path since, shape (n,).
        """
        return self._known.expected_error_m(self.time)

    @property
    def left_m2(self) -> Floats:
        """The variance (m2) of each AUV's estimate, both axes together, that its last broadcast fix
        left, shape (n,).
        """
        return self._known.left_m2

    def drifted_m2(self, ages: Floats) -> Floats:
        """Return the expected squared drift (m2) of AUVs in times (n, k), s, without fixes."""
        return self._known.drifted_m2(ages)

    def auvs(self, time: float) -> Floats:
        """Return the believed positions of AUVs at an instant (s) from `time` on, (n, 3), m.

        That is the last fix of each, or at first its launch, carried forward by its plan.
        """
        return self._prediction.at(time)


class Mover(Protocol):
    """A placement of ASVs; one for each mission, so that it may have state."""

    def targets(self, view: AnchorView) -> Floats:
        """Return where ASVs are to go (m, 2), m; rows of failed ASVs are not used."""


class OwnMover:
    """A user-defined placement, named ``module:object``, whose targets are checked."""

    def __init__(self, name: str, mover: Any, farthest_m: float) -> None:
        """Take the user's placement, already made; targets must lie within `farthest_m` (m)."""
        self._name, self._mover, self._farthest = name, mover, farthest_m

    def targets(self, view: AnchorView) -> Floats:
        """Return where ASVs are to go (m, 2), m.

        Raises:
            PluginError: when the placement raises anything, or returns no positions.
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
