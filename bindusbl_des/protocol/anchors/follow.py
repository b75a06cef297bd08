"""Vessels that keep to where the fleet is: all of its AUVs as near to one of them as possible."""

from typing import NamedTuple

import numpy as np

from ...geometry.placement.assignment import assignment
from ...geometry.placement.k_centre import k_centre
from ...geometry.placement.max_cover import max_cover
from .view import AnchorView, Array


class Service(NamedTuple):
    """How places serve AUVs: the share of them that is heard, and how far (m) the farthest of
    those is from its nearest place.
    """

    heard: float
    farthest: float


class Follow:
    """The k-centre of where AUVs are believed to be a horizon ahead.

    Where that is beyond the range of vessels, as many AUVs as they can hear instead: what is best
    for the farthest AUV would be of no use to any.  Vessels are told to go elsewhere only if that
    serves better by more than a share, so that they do not follow the noise of fixes.
    """

    def __init__(self, *, horizon_s: float, hysteresis: float) -> None:
        self._horizon, self._hysteresis = horizon_s, hysteresis

    def targets(self, view: AnchorView) -> Array:
        """Return where vessels are to go (m, 2), m."""
        fleet, working = view.auvs(view.begins + self._horizon)[:, :2], view.working
        there = best_places(fleet, int(working.sum()), view.reach)
        if view.is_first:
            return np.resize(there, view.vessels.shape)
        targets = view.bound_for.copy()
        now = service(fleet, targets[working], view.reach)
        if gains(now, service(fleet, there, view.reach), self._hysteresis):
            targets[working] = there[assignment(view.vessels[working], there)]
        return targets


def best_places(fleet: Array, count: int, reach: float) -> Array:
    """Return the places (count, 2), m, that serve AUVs (n, 2) best at a reach (m)."""
    centres = k_centre(fleet, count)
    if centres.radius <= reach or reach == 0.0:
        return centres.places
    return max_cover(fleet, count, reach).places


def service(fleet: Array, places: Array, reach: float) -> Service:
    """Return how places (m, 2) serve AUVs (n, 2) that are heard within a reach (m)."""
    apart = fleet[:, None, :] - places
    away = np.hypot(apart[..., 0], apart[..., 1]).min(axis=1)
    heard = away <= reach * (1.0 + 1e-9)
    return Service(float(heard.mean()), float(away[heard].max(initial=0.0)))


def gains(now: Service, then: Service, share: float) -> bool:
    """Tell whether another service is better by more than a share: it hears so many AUVs more, or
    no fewer and the farthest of them so much nearer.
    """
    if then.heard - now.heard > share:
        return True
    return then.heard >= now.heard and then.farthest < (1.0 - share) * now.farthest
