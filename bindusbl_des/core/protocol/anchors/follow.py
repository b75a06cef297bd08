"""ASVs that keep all AUVs as near to one of them as possible."""

from typing import NamedTuple

import numpy as np

from ....support.arrays import Floats
from ...geometry.covering import enclosing_circle, k_centre, max_cover
from ...geometry.placement import assignment
from .view import AnchorView


class AnchorService(NamedTuple):
    """How well positions serve AUVs: the share of AUVs that is heard, and the distance (m) of the
    farthest of these from its nearest position.
    """

    heard: float
    farthest: float


class FollowPlacement:
    """Puts ASVs at the k-centre of the AUVs' believed positions a horizon (s) ahead.

    Where that is beyond range, ASVs hear as many AUVs as possible instead: the optimum for the
    farthest AUV would serve none.  ASVs get new targets only if these serve better by more than a
    share, so that they do not follow the noise of fixes; and each keeps its AUVs, unless other AUVs
    are better by that share.  With `within_m` (m) they rest while each AUV is that near to one.
    """

    def __init__(self, *, horizon_s: float, hysteresis: float, within_m: float | None) -> None:
        self._horizon, self._hysteresis, self._within = horizon_s, hysteresis, within_m

    def targets(self, view: AnchorView) -> Floats:
        """Return where ASVs are to go (m, 2), m."""
        fleet, working = view.auvs(view.begins + self._horizon)[:, :2], view.working
        there = best_places(fleet, int(working.sum()), view.reach)
        if view.is_first:
            return there
        targets = view.bound_for.copy()
        now = targets[working]
        if self._within is not None and _apart(view.auvs(view.begins)[:, :2], now) <= self._within:
            return targets
        kept = moved_along(fleet, now, view.reach)
        if self._is_better(there, kept, fleet, view.reach):
            targets[working] = there[assignment(view.vessels[working], there)]
        elif self._is_better(kept, now, fleet, view.reach):
            targets[working] = kept
        return targets

    def _is_better(self, places: Floats, others: Floats, fleet: Floats, reach: float) -> bool:
        then, now = (service(fleet, spots, reach) for spots in (places, others))
        return gains(now, then, self._hysteresis)


def best_places(fleet: Floats, count: int, reach: float) -> Floats:
    """Return the positions (count, 2), m, that serve AUVs (n, 2) best at a reach (m)."""
    centres = k_centre(fleet, count)
    if centres.radius <= reach or reach == 0.0:
        return centres.places
    return max_cover(fleet, count, reach).places


def moved_along(fleet: Floats, places: Floats, reach: float) -> Floats:
    """Return `places` (m, 2), m, each moved to the middle of those AUVs, `fleet` (n, 2), within
    reach (m) that have it as their nearest; without any it stays.
    """
    apart = fleet[:, None, :] - places
    away = np.hypot(apart[..., 0], apart[..., 1])
    nearest, heard = away.argmin(axis=1), away.min(axis=1) <= reach
    out = places.copy()
    for number in range(len(places)):
        own = fleet[heard & (nearest == number)]
        if len(own):
            out[number] = enclosing_circle(own)[:2]
    return out


def service(fleet: Floats, places: Floats, reach: float) -> AnchorService:
    """Return how `places` (m, 2), m, serve AUVs, `fleet` (n, 2), heard within a reach (m)."""
    apart = fleet[:, None, :] - places
    away = np.hypot(apart[..., 0], apart[..., 1]).min(axis=1)
    heard = away <= reach * (1.0 + 1e-9)
    return AnchorService(float(heard.mean()), float(away[heard].max(initial=0.0)))


def _apart(fleet: Floats, places: Floats) -> float:
    """Return the distance (m) of the AUV (n, 2) that is farthest from its nearest place (m, 2)."""
    apart = fleet[:, None, :] - places
    return float(np.hypot(apart[..., 0], apart[..., 1]).min(axis=1).max())


def gains(now: AnchorService, then: AnchorService, share: float) -> bool:
    """Return whether the service `then` is better than `now` by more than a share: it hears that
    many more AUVs, or no fewer and the farthest of them is nearer by that share.
    """
    if then.heard - now.heard > share:
        return True
    return then.heard >= now.heard and then.farthest < (1.0 - share) * now.farthest
