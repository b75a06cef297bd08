"""A placement of somebody's own that moves vessels: what it answers is checked."""

from typing import Any, NoReturn

import numpy as np

from ...core.plugins import PluginError, asked, shown
from ...scenario.families import PLACEMENT
from .view import AnchorView, Array


class OwnMover:
    """Vessels that somebody's own placement, named ``module:object``, tells where to go."""

    def __init__(self, name: str, mover: Any, farthest_m: float) -> None:
        """Take what the placement was when it was made; targets lie within `farthest_m` (m)."""
        self._name, self._mover, self._farthest = name, mover, farthest_m

    def targets(self, view: AnchorView) -> Array:
        """Return where vessels are to go (m, 2), m.

        Raises:
            PluginError: when it raises anything, or answers no places.
        """
        count, when = len(view.vessels), f" at {view.time:g} s"
        answer = asked(PLACEMENT.key, self._name, self._mover.targets, view, when=when)
        found: Array | None = asked(PLACEMENT.key, self._name, _numbers, answer, when=when)
        if found is None or found.shape != (count, 2):
            self._refuse(answer, when, f"({count}, 2), x and y in m, one for each ASV")
        if not (np.hypot(*found.T) <= self._farthest).all():
            told = f"finite numbers within {self._farthest:.0f} m of the origin, where AUVs are"
            self._refuse(answer, when, told)
        return found

    def _refuse(self, answer: Any, when: str, needed: str) -> NoReturn:
        said = shown(PLACEMENT.key, self._name, answer, when)
        raise PluginError(
            PLACEMENT.key, f"{self._name!r} returned {said}{when}; targets must be {needed}"
        )


def _numbers(answer: Any) -> Array | None:
    """Return an answer as an array; None for what is no array of real numbers."""
    try:
        found = np.asarray(answer)
        return found.astype(np.float64) if found.dtype.kind in "fiu" else None
    except (TypeError, ValueError):
        return None
