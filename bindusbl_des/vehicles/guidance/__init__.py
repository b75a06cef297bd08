"""How vehicles are steered: AUVs along their paths, ASVs at their stations, in currents and errors.

`GuidedFleet` moves a fleet of one model under its controllers, lazily; `smallest_turn` and
`top_speed` tell what may be asked of one. SI units and radians; x North, y East, z down.
"""

from .departure import (
    DeparturePlan,
    GuidanceError,
    SteeringIntervals,
    smallest_turn,
    too_strong,
    top_speed,
)
from .guided_fleet import GuidedFleet, GuidedVehicle
from .sensing import SteeringDrift

__all__ = [
    "DeparturePlan",
    "GuidanceError",
    "GuidedFleet",
    "GuidedVehicle",
    "SteeringDrift",
    "SteeringIntervals",
    "smallest_turn",
    "too_strong",
    "top_speed",
]
