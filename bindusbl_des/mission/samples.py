"""The mission sampled at regular instants: truth, estimate, dead reckoning and their errors."""

from dataclasses import dataclass
from functools import lru_cache
from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from ..core.compiled import entry
from ..navigation.dead_reckoning import Odometry
from .world import World

Array = NDArray[np.float64]

# Guards floor(duration * rate) against rounding, as for ticks.
COUNT_TOLERANCE = 1e-9


@lru_cache(maxsize=8)
def instants(duration: float, rate: float) -> Array:
    """Return the instants k / rate in [0, duration) (s); read-only, since missions share them.

    The first is always the start, however low the rate.

    >>> instants(3.0, 1e-12).tolist()
    [0.0]
    """
    count = max(1, int(np.ceil(duration * rate - COUNT_TOLERANCE)))
    times: Array = np.arange(count) / rate
    times.setflags(write=False)
    return times


@dataclass(frozen=True)
class Samples:
    """One AUV at n instants (s): truth x, y, z (m), yaw (rad), (n, 4), and what it made of it.

    `odometry` is what its own sensors told it, `estimate` where it believed to be (n, 2), m.
    """

    times: Array
    truth: Array
    odometry: Odometry
    estimate: Array

    @property
    def error(self) -> Array:
        """Estimate - truth, horizontal, shape (n, 2), m."""
        return self.estimate - self.truth[:, :2]

    @property
    def drift(self) -> Array:
        """Dead reckoning - truth, horizontal, shape (n, 2), m."""
        return self.odometry.position - self.truth[:, :2]

    @property
    def position_error(self) -> Array:
        """Horizontal |estimate - truth|, shape (n,), m."""
        return np.asarray(np.hypot(*self.error.T))

    @property
    def cross_track_error(self) -> Array:
        """Estimate - truth perpendicular to the heading, positive to starboard, shape (n,), m."""
        return across(self.truth[:, 3], self.error)


@entry
def across(yaw: Array, error: Array) -> Array:
    """Return the part of errors (n, 2) across headings (n,) in rad, positive to starboard.

    >>> across(np.array([0.0, np.pi]), np.array([[1.0, 2.0], [1.0, 2.0]])).round(9).tolist()
    [2.0, -2.0]
    """
    out = np.empty(yaw.size)
    cosine, sine = cos(0.0), sin(0.0)
    for k in range(yaw.size):
        if k == 0 or yaw[k] != yaw[k - 1]:  # lanes keep their heading
            cosine, sine = cos(yaw[k]), sin(yaw[k])
        out[k] = cosine * error[k, 1] - sine * error[k, 0]
    return out


def turned(yaw: Array) -> Array:
    """Return headings (rad) in (-pi, pi].

    >>> turned(np.array([0.0, np.pi, -np.pi])).round(9).tolist()
    [0.0, 3.141592654, 3.141592654]
    """
    return np.asarray(np.pi - np.mod(np.pi - yaw, 2 * np.pi))


def sample(world: World, auv: int, times: Array) -> Samples:
    """Sample one AUV; its estimate at an instant includes a fix delivered at that instant."""
    truth, odometry = world.reckoning.sample(auv, times)
    return Samples(times, truth, odometry, world.navigator.estimate(auv, odometry))
