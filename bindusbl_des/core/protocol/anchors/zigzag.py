"""ASVs that sweep to and fro over the fleet, so that each AUV has one near it in turn.

A beacon whose bearing from an AUV keeps changing makes the AUV's position observable along all
axes, a beacon at constant bearing does not (Fallon, Papadopoulos, Leonard and Patrikalakis,
"Cooperative AUV navigation using a single maneuvering surface craft", IJRR 29(12), 2010, for ranges
alone).  USBL measures the bearing as well, but its cross-range error grows with range: there the
sweep helps by bringing an ASV near to each AUV of a fleet that it cannot hear at once.
"""

import math

from ....support.arrays import Floats
from .assign import VesselGroups, across, at_rest, lengthwise
from .view import AnchorView

# Share of its speed at which an ASV no faster than its AUVs sweeps; it falls behind.
LEAST_SHARE = 0.5

# AUVs within this distance (m) to both sides of their middle are swept over as one.
LEAST_M = 1.0


class ZigzagPlacement:
    """Each ASV sweeps over its own AUVs along the line on which the fleet was launched.

    The sweep moves with the middle of the AUVs, `amplitude_m` (m) to both sides: by default to the
    first and last of them, for a single AUV half the range.  A period `period_s` (s) is there and
    back: by default as long as needed by an ASV that keeps up with AUVs that go at `auv_speed`
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
        self._phases: dict[int, float] = {}  # by ASV, in periods
        self._since = 0.0

    def targets(self, view: AnchorView) -> Floats:
        """Return where ASVs are to go (m, 2), m: where the sweep is at the next placement."""
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
        """Return the speed (m/s) that an ASV has left for the sweep."""
        return math.sqrt(max(speed**2 - self._auv_speed**2, (LEAST_SHARE * speed) ** 2))


def _half_width(along: Floats, reach: float) -> float:
    """Return the amplitude (m) of a sweep over AUVs at positions along it (n,), m."""
    half = float(along.max() - along.min()) / 2.0
    return half if half >= LEAST_M else max(reach / 2.0, LEAST_M)


def sweep(phase: float) -> float:
    """Return where a sweep from -1 to 1 and back is at a phase (periods), starting in its middle.

    >>> [sweep(phase) for phase in (0.0, 0.125, 0.25, 0.5, 0.75, 1.0)]
    [0.0, 0.5, 1.0, 0.0, -1.0, 0.0]
    """
    return 1.0 - 4.0 * abs((phase + 0.25) % 1.0 - 0.5)
