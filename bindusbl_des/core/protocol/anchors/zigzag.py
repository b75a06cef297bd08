"""Vessels that sweep to and fro over the fleet, so that each AUV has one near it in turn.

A beacon that keeps changing its bearing from AUVs makes their position observable along all axes,
which one that keeps its bearing does not (Fallon, Papadopoulos, Leonard and Patrikalakis,
"Cooperative AUV navigation using a single maneuvering surface craft", IJRR 29(12), 2010, for ranges
alone).  USBL tells the bearing as well, but its error across grows with range: there the sweep is
worth what it brings a vessel near to each AUV of a fleet that it cannot hear at once.
"""

import math

from ....support.arrays import Floats
from .assign import VesselGroups, across, at_rest, lengthwise
from .view import AnchorView

# Vessels no faster than their AUVs sweep at this share of their speed, and fall behind.
LEAST_SHARE = 0.5

# AUVs that are spread out less (m) to both sides are swept over as one.
LEAST_M = 1.0


class ZigzagPlacement:
    """Each vessel sweeps over its own AUVs along the line on which the fleet was launched.

    The sweep goes with the middle of the AUVs, `amplitude_m` (m) to both sides of it: by default
    from the first of them to the last, and for a single one half the range.  It takes `period_s`
    (s) there and back: by default as long as a vessel needs that keeps up with AUVs at `auv_speed`
    (m/s) across the sweep.
    """

    def __init__(
        self,
        *,
        amplitude_m: float | None,
        period_s: float | None,
        hysteresis: float,
        replan_s: float,
        auv_speed: float,
    ) -> None:
        self._amplitude, self._period, self._replan = amplitude_m, period_s, replan_s
        self._auv_speed, self._groups = auv_speed, VesselGroups(hysteresis)
        self._line: Floats | None = None
        self._phases: dict[int, float] = {}  # of vessels, in turns
        self._since = 0.0

    def targets(self, view: AnchorView) -> Floats:
        """Return where vessels are to go (m, 2), m: where the sweep is when they set out again."""
        until = view.begins + self._replan
        fleet = view.auvs(until)[:, :2]
        if self._line is None:
            self._line = lengthwise(view.auvs(view.time)[:, :2])
        targets = at_rest(view, fleet)
        for vessel, group in self._groups.of(view, fleet).items():
            along, beside = fleet[group] @ self._line, fleet[group] @ across(self._line)
            reaches = self._amplitude or _half_width(along, view.reach)
            lasts = self._period or 4.0 * reaches / self._pace(view.speed)
            phase = self._phases.get(vessel, 0.0) + (until - self._since) / lasts
            self._phases[vessel] = phase
            there = (along.max() + along.min()) / 2.0 + reaches * sweep(phase)
            targets[vessel] = there * self._line + beside.mean() * across(self._line)
        self._since = until
        return targets

    def _pace(self, speed: float) -> float:
        """Return the speed (m/s) that a vessel has left for the sweep."""
        return math.sqrt(max(speed**2 - self._auv_speed**2, (LEAST_SHARE * speed) ** 2))


def _half_width(along: Floats, reach: float) -> float:
    """Return how far (m) to both sides a sweep goes over AUVs at places along it (n,), m."""
    half = float(along.max() - along.min()) / 2.0
    return half if half >= LEAST_M else max(reach / 2.0, LEAST_M)


def sweep(phase: float) -> float:
    """Return where a sweep from -1 to 1 and back is after so many turns, in its middle at first.

    >>> [sweep(phase) for phase in (0.0, 0.125, 0.25, 0.5, 0.75, 1.0)]
    [0.0, 0.5, 1.0, 0.0, -1.0, 0.0]
    """
    return 1.0 - 4.0 * abs((phase + 0.25) % 1.0 - 0.5)
