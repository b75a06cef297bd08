"""One sample of a recorded track."""

import math
from typing import NamedTuple

from .shapes import BadChart, Degrees


class Sample(NamedTuple):
    """A sample: its line, time (s), x and y (m) or latitude and longitude (deg), and depth (m).

    The depth is nan where the file says none.  It is below the sea, or, if `below_ellipsoid`, below
    the ellipsoid of WGS-84, which falls away from the survey's plane with the distance.
    """

    told: str
    time: float
    place: Degrees
    depth: float
    in_degrees: bool
    below_ellipsoid: bool = False


def above_sea(told: str, height: float) -> float:
    """Return the depth (m) of a height above the sea, which may be a little above it, as waves are.

    Raises:
        BadChart: when it is far above: heights by GNSS are above the ellipsoid, not above the sea.
    """
    if not math.isfinite(height):
        raise BadChart(f"{told}: its height is {height:g}; leave it out if it is unknown")
    if height > HIGHEST:
        raise BadChart(
            f"{told}: is {height:.4g} m above the sea; heights must be negative below it. Remove "
            "them from the file to have the AUV at survey.depth_m"
        )
    return -height


def in_sea(told: str, depth: float) -> float:
    """Return a depth (m), which may be a little above the sea, as waves are.

    Raises:
        BadChart: when it is far above: a column of heights, or one that counts upwards.
    """
    if depth < -HIGHEST:
        raise BadChart(
            f"{told}: a depth of {depth:.4g} m is above the sea; depths must be positive below it. "
            "Turn the sign of the column if it holds heights"
        )
    return depth


# Higher (m) is no wave: the height of a receiver that is not on the sea, or above an ellipsoid.
HIGHEST = 5.0
