"""The keys of the survey: where the AUVs work."""

from ..key_types import PAPER, Part, Real, key


class Survey(Part):
    """The square of sea to be surveyed, centred on the origin, and the depth to fly at."""

    side_m: Real = key(140.0, "m", "side L of the square survey area", PAPER, ge=0.1, le=1e5)
    depth_m: Real = key(10.0, "m", "depth at which the AUVs fly", PAPER, ge=0, le=11e3)
