"""A USBL as its data sheet states it: bearing and elevation, or the accuracy of a position.

A sheet's figures are the whole system's: they stand in the place of what an array makes of arrival
times, and of the noise of travel times.  Angles are those of the array frame (:mod:`.array`).
"""

from math import atan2, cos, hypot, isnan, nan, sin
from typing import Any, NamedTuple

from ..core.compiled import compiled
from ..records.rows import Row
from ..vehicles.motion import Floats
from .vectors import Vector

# The noise of bearing and elevation (rad), the share of a path that is noise of its length, the
# noise of the place along each axis (m) and its share of the range, the SNR (dB) at which angles
# are as noisy as that (nan: at any), and what they never fall below (rad).
SHEET = [
    (name, "f8")
    for name in (
        *("bearing_sd_rad", "elevation_sd_rad", "path_share", "spread_sd_m", "spread_share"),
        *("reference_snr_db", "angle_floor_rad"),
    )
]
NO_SHEET = (0.0, 0.0, 0.0, 0.0, 0.0, nan, 0.0)

# Of a row of noise the first two numbers are bearing and elevation, the next three the spread:
# elements of an array, of which they are else, there are none.
SPREAD_NOISE = 2


class Sheet(NamedTuple):
    """What a sheet states, as standard deviations.

    Of bearing and elevation (rad); of the length of a path (m) and as a share of it, added in
    squares; of a place along each axis (m) and as a share of its range, added in squares.  Angles
    are those at a signal-to-noise ratio (dB; nan: at any), and never below `angle_floor` (rad).
    """

    bearing_sd: float = 0.0
    elevation_sd: float = 0.0
    path_sd: float = 0.0
    path_share: float = 0.0
    spread_sd: float = 0.0
    spread_share: float = 0.0
    reference_snr_db: float = nan
    angle_floor: float = 0.0

    @property
    def levels(self) -> tuple[Any, ...]:
        """The fields SHEET of this sheet."""
        return (
            *(self.bearing_sd, self.elevation_sd, self.path_share),
            *(self.spread_sd, self.spread_share, self.reference_snr_db, self.angle_floor),
        )


@compiled
def angle_sds(snr_db: float, levels: Row) -> tuple[float, float]:
    """Return the noise (rad) of bearing and elevation at an SNR (dB, nan if nobody knows of one).

    It falls as 10^(-SNR / 20), as the Cramer-Rao bound of an arrival's time does, to a floor.
    """
    bearing, elevation = levels.bearing_sd_rad, levels.elevation_sd_rad
    less = levels.reference_snr_db - snr_db
    if isnan(less):
        return bearing, elevation
    factor, floor = 10.0 ** (less / 20.0), levels.angle_floor_rad
    return max(factor * bearing, floor), max(factor * elevation, floor)


@compiled
def stated_direction(seen: Vector, sds: tuple[float, float], noise: Floats) -> Vector:
    """Return the unit vector (3,) that is made out of a source at `seen` (3,), m, both in the array
    frame; `sds` (rad) as of :func:`angle_sds`.
    """
    bearing = atan2(seen[1], seen[0]) + sds[0] * noise[0]
    elevation = atan2(seen[2], hypot(seen[0], seen[1])) + sds[1] * noise[1]
    level = cos(elevation)
    return level * cos(bearing), level * sin(bearing), sin(elevation)


@compiled
def path_sd(path: float, levels: Row) -> float:
    """Return the noise (m) of the length of a path (m): one way, or a call's and its answer's."""
    return hypot(levels.range_sd_m, levels.path_share * path)


@compiled
def spread_sd(reach: float, levels: Row) -> float:
    """Return the noise (m) of a place at a range (m) along each axis, but for range and angles."""
    return hypot(levels.spread_sd_m, levels.spread_share * reach)
