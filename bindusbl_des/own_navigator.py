"""A navigator that somebody has written: what it answers is checked, and autopilots steer by it."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .columns import AUV_OF_FIX, CORRECTION, DELIVERED_AT
from .dead_reckoning import DeadReckoning, Odometry
from .motion import Floats, Ints
from .navigation import Navigator

Array = NDArray[np.float64]


class OwnNavigator:
    """A navigator of somebody's own, named ``module:object`` in the scenario.

    The object is called with the fleet's dead reckoning and the number of AUVs, and returns a
    :class:`.navigation.Navigator`.
    """

    def __init__(self, name: str, make: Any, reckoning: DeadReckoning, corrections: Array) -> None:
        """Make the navigator; `corrections` (n, 2), m, is where autopilots read what it adds."""
        self._name, self._reckoning, self._corrections = name, reckoning, corrections
        self._navigator: Navigator = self._asked(make, reckoning, len(corrections))
        missing = [
            verb
            for verb in ("correct", "estimate", "covariance")
            if not callable(getattr(self._navigator, verb, None))
        ]
        if missing:
            raise ValueError(f"navigation.filter: {name!r} lacks {', '.join(missing)}")

    def correct(self, fixes: Floats, due: Ints) -> None:
        """Hand the fixes whose rows are due on; note how far each moved its AUV's estimate (m)."""
        for row in due:
            auv, now = int(fixes[row, AUV_OF_FIX]), fixes[row, DELIVERED_AT : DELIVERED_AT + 1]
            odometry = self._reckoning.sample(auv, now)[1]
            was = self.estimate(auv, odometry)
            self._asked(self._navigator.correct, fixes, np.array([row]))
            moved = self.estimate(auv, odometry)
            fixes[row, CORRECTION] = np.hypot(*(moved - was)[0])
            self._corrections[auv] = (moved - odometry.position)[0]

    def estimate(self, auv: int, odometry: Odometry) -> Array:
        """Return where an AUV believed to be (n, 2), m, at the instants of its odometry."""
        return self._checked("estimate", auv, odometry, 2)

    def covariance(self, auv: int, odometry: Odometry) -> Array:
        """Return how sure it was of that: variances and covariance xx, yy, xy (n, 3), m2."""
        return self._checked("covariance", auv, odometry, 3)

    def _checked(self, verb: str, auv: int, odometry: Odometry, width: int) -> Array:
        found = np.asarray(self._asked(getattr(self._navigator, verb), auv, odometry), np.float64)
        if found.shape != (len(odometry.times), width) or not np.isfinite(found).all():
            raise ValueError(
                f"navigation.filter: {self._name!r} answered {verb} with an array of shape "
                f"{found.shape}; it must be ({len(odometry.times)}, {width}) of finite numbers"
            )
        return found

    def _asked(self, verb: Any, *arguments: Any) -> Any:
        try:
            return verb(*arguments)
        except Exception as error:
            raise ValueError(
                f"navigation.filter: {self._name!r} raised {type(error).__name__}: {error}"
            ) from error
