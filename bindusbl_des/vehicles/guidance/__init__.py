"""How vehicles are steered: AUVs along their paths, ASVs at their stations, in currents and errors.

`Voyage` moves a fleet of one model under its controllers, lazily; `smallest_turn` and `top_speed`
tell what may be asked of one. SI units and radians; x North, y East, z down.
"""

from .belief import SteeringDrift
from .limits import VoyageError, smallest_turn, top_speed
from .member import Member
from .voyage import Voyage

__all__ = ["Member", "SteeringDrift", "Voyage", "VoyageError", "smallest_turn", "top_speed"]
