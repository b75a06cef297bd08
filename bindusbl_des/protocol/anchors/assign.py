"""Vessels that have AUVs of their own, and stay above the middle of those."""

import numpy as np

from .groups import Groups, circle
from .view import AnchorView, Array


class Assign:
    """Each vessel above the middle of the smallest circle around its own AUVs, a horizon ahead.

    AUVs are split into groups of neighbours, as those on neighbouring strips are.
    """

    def __init__(self, *, horizon_s: float, hysteresis: float) -> None:
        self._horizon, self._groups = horizon_s, Groups(hysteresis)

    def targets(self, view: AnchorView) -> Array:
        """Return where vessels are to go (m, 2), m; who has no AUV stays where it is."""
        fleet = view.auvs(view.begins + self._horizon)[:, :2]
        targets = at_rest(view, fleet)
        for vessel, group in self._groups.of(view, fleet).items():
            targets[vessel] = circle(fleet, group)[:2]
        return targets


def at_rest(view: AnchorView, fleet: Array) -> Array:
    """Return where vessels go anyway (m, 2), m; at first to the middle of AUVs (n, 2)."""
    if view.is_first:
        middle = circle(fleet, np.arange(len(fleet)))[:2]
        return np.tile(middle, (len(view.vessels), 1))
    return view.bound_for.copy()
