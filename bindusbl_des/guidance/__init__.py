"""How vehicles are steered: AUVs along their paths, ASVs at their stations, in currents and errors.

`Voyage` moves a fleet of one model under its controllers, lazily; `smallest_turn` and `top_speed`
tell what may be asked of one. SI units and radians; x North, y East, z down.
"""

from bindusbl_des.guidance.belief import SteeringDrift
from bindusbl_des.guidance.limits import VoyageError, smallest_turn, top_speed
from bindusbl_des.guidance.member import Member
from bindusbl_des.guidance.voyage import Voyage

__all__ = ["Member", "SteeringDrift", "Voyage", "VoyageError", "smallest_turn", "top_speed"]
