"""How steeply hulls climb, measured by flying one."""

from functools import cache

import numpy as np

from ...geometry.paths import Path, Pose, Segment
from ..bottom import Bottom, Keeping
from .departure import DeparturePlan
from .guided_fleet import GuidedFleet

# A climb is measured between these instants (s), above a bottom that rises at 45 deg.
CLIMBING_S = 40.0, 60.0


@cache
def steepest_climb(
    model: str, speed: float, overrides: tuple[tuple[str, float], ...] = ()
) -> float:
    """Return how steeply (m/m) an AUV climbs by its autopilot at a speed (m/s), in still water.

    Raises GuidanceError for a speed that it does not reach.
    """
    xs, ys = np.array((-10.0, 1000.0)), np.array((-100.0, 100.0))
    wall = Bottom(xs, ys, np.repeat(1005.0 - xs, 2).reshape(2, 2))
    straight = Path(Pose(0.0, 0.0, 0.0), (Segment(0.0, 1000.0),))
    plan = DeparturePlan(
        paths=[straight], speed_m_per_s=speed, keeping=Keeping(5.0, 0.0, 2000.0), bottom=wall
    )
    fleet = GuidedFleet(model, plan, dict(overrides), duration_s=CLIMBING_S[1])
    begin, end = (fleet.vehicle(0).at(time) for time in CLIMBING_S)
    return (begin.z - end.z) / (end.x - begin.x)
