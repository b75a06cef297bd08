"""ASVs that keep near one AUV at a time, and go on to the one whose estimate is expected worst.

The hybrid controller that the paper names as future work: a vessel keeps within a bounded region of
one AUV, and switches among several.
"""

import numpy as np

from ....support.arrays import Floats
from .assign import VesselGroups, at_rest
from .view import AnchorView


class VisitPlacement:
    """Each ASV rests while the AUV that it visits is within `within_m` (m), and follows it else.

    It has been near for `dwell_s` (s) at least before it goes on to another of its AUVs, one whose
    expected error is larger by a share, `hysteresis`.  Groups of AUVs are those of `assign`.
    """

    def __init__(
        self, *, within_m: float, dwell_s: float, hysteresis: float, replan_s: float
    ) -> None:
        self._within, self._dwell, self._replan = within_m, dwell_s, replan_s
        self._hysteresis, self._groups = hysteresis, VesselGroups(hysteresis)
        self._visited: dict[int, int] = {}  # by ASV
        self._near_since: dict[int, float] = {}  # by ASV: when (s) it first was near

    def targets(self, view: AnchorView) -> Floats:
        """Return where ASVs are to go (m, 2), m; an ASV without AUVs keeps its target."""
        fleet = view.auvs(view.begins)[:, :2]
        ahead = view.auvs(view.begins + self._replan)[:, :2]
        targets, errors = at_rest(view, fleet), view.expected_error_m
        for vessel, group in self._groups.of(view, fleet).items():
            auv = self._chosen(vessel, group.tolist(), errors, view.begins)
            if self._is_near(view.vessels[vessel], fleet[auv]):
                self._near_since.setdefault(vessel, view.begins)
            if not self._is_near(targets[vessel], fleet[auv]) or view.is_first:
                targets[vessel] = ahead[auv]
        return targets

    def _chosen(self, vessel: int, group: list[int], errors: Floats, time: float) -> int:
        """Return the AUV of its group that an ASV visits from `time` (s) on, by expected `errors`
        (n,), m.
        """
        visited = self._visited.get(vessel)
        worst = max(group, key=lambda auv: errors[auv])
        if visited in group:
            stays = time - self._near_since.get(vessel, time) < self._dwell
            if stays or errors[worst] <= (1.0 + self._hysteresis) * errors[visited]:
                return visited
        if worst != visited:
            self._visited[vessel] = worst
            self._near_since.pop(vessel, None)
        return worst

    def _is_near(self, place: Floats, auv: Floats) -> bool:
        return bool(np.hypot(*(place - auv)) <= self._within)
