"""A column of water: how fast sound travels at each depth, and how fast it gets through."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..core.wording import refuse

Floats = NDArray[np.float64]


class Profile(NamedTuple):
    """Depths (n,), m, that increase, and the speed of sound there (n,), m/s.

    Speeds are linear between depths, and stay what they are above the first and below the last.
    """

    depths_m: Floats
    speeds_m_per_s: Floats

    def at(self, depth_m: ArrayLike) -> Floats:
        """Return the speed of sound (m/s) at depths (m)."""
        depths = np.asarray(depth_m, dtype=float)
        return np.asarray(np.interp(depths, self.depths_m, self.speeds_m_per_s))


def mean_speed(profile: Profile, depth_m: float) -> float:
    """Return the speed (m/s) at which sound gets from the surface to a depth (m) on a straight way.

    That is the harmonic mean: depth over the time taken, with any slope of the way, as time is the
    integral of 1 / c.  At no depth it is the speed at the surface.  What bending does to ways is
    not in it.

    >>> warm_above = Profile(np.array([0.0, 10.0, 20.0]), np.array([1510.0, 1500.0, 1480.0]))
    >>> round(mean_speed(warm_above, 20.0), 3)
    1497.448
    """
    if not 0.0 <= depth_m < np.inf:
        refuse("depth (m)", depth_m, "be finite and not below 0", "count metres downwards")
    if depth_m == 0.0:
        return float(profile.at(0.0))
    return float(depth_m / cumulated_slowness(profile, depth_m))


def cumulated_slowness(profile: Profile, depth_m: ArrayLike) -> Floats:
    """Return how long (s) sound takes straight down from the surface to depths (m): 1 / c, summed.

    Exact for speeds that are linear between the profile's depths.
    """
    depths = np.asarray(depth_m, dtype=float)
    tops = np.unique(np.concatenate(([0.0], profile.depths_m)))
    speeds = profile.at(tops)
    whole = np.cumsum(np.concatenate(([0.0], _layer_s(np.diff(tops), speeds[:-1], speeds[1:]))))
    layer = np.clip(np.searchsorted(tops, depths, side="right") - 1, 0, None)
    return whole[layer] + _layer_s(depths - tops[layer], speeds[layer], profile.at(depths))


def _layer_s(thickness_m: Floats, above: Floats, below: Floats) -> Floats:
    """Return how long (s) sound takes through layers (m) of linear speed (m/s)."""
    rise = (below - above) / above
    # log1p(x) / x, which is 1 for x = 0
    shorter = np.divide(np.log1p(rise), rise, out=np.ones_like(rise), where=rise != 0.0)
    return np.asarray(thickness_m / above * shorter)


def mean_over(depths_m: Floats, values: Floats, depth_m: float) -> float:
    """Return the mean down to a depth (m) of what is linear between depths (n,), m."""
    depths, found = _down_to(depths_m, values, depth_m)
    return float(np.trapezoid(found, depths) / depth_m) if depths.size > 1 else float(found[0])


def uniform_profile(speed_m_per_s: float) -> Profile:
    """Return water in which sound is as fast at all depths."""
    return Profile(np.zeros(1), np.full(1, speed_m_per_s))


def _down_to(depths_m: Floats, values: Floats, depth_m: float) -> tuple[Floats, Floats]:
    """Return depths from the surface to one (m), with values there; the surface alone if it is."""
    if not 0.0 <= depth_m < np.inf:
        refuse("depth (m)", depth_m, "be finite and not below 0", "count metres downwards")
    inner = depths_m[(depths_m > 0.0) & (depths_m < depth_m)]
    depths = np.unique(np.concatenate(([0.0], inner, [depth_m])))
    return depths, np.interp(depths, depths_m, values)
