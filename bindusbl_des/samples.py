"""The mission sampled at regular instants: truth, estimate, dead reckoning and their errors."""

from dataclasses import dataclass
from functools import lru_cache
from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from .compiled import compiled
from .navigation import corrections_of
from .world import World

Array = NDArray[np.float64]

# Guards floor(duration * rate) against rounding, as for ticks.
COUNT_TOLERANCE = 1e-9


@lru_cache(maxsize=8)
def instants(duration: float, rate: float) -> Array:
    """Return the instants k / rate in [0, duration) (s); read-only, since missions share them."""
    times: Array = np.arange(int(np.ceil(duration * rate - COUNT_TOLERANCE))) / rate
    times.setflags(write=False)
    return times


@dataclass(frozen=True)
class Samples:
    """One AUV at n instants (s): truth x, y, z (m), yaw (rad), (n, 4), and its errors.

    `drift` is dead reckoning - truth, `error` estimate - truth; both horizontal, (n, 2), m.
    """

    times: Array
    truth: Array
    drift: Array
    error: Array

    @property
    def position_error(self) -> Array:
        """Horizontal |estimate - truth|, shape (n,), m."""
        return np.asarray(np.hypot(self.error[:, 0], self.error[:, 1]))

    @property
    def cross_track_error(self) -> Array:
        """Estimate - truth perpendicular to the heading, positive to starboard, shape (n,), m."""
        return across(self.truth[:, 3], self.error)


@compiled
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


def sample(world: World, auv: int, times: Array) -> Samples:
    """Sample one AUV; its estimate at an instant includes a fix delivered at that instant."""
    corrections = corrections_of(world.record.fixes.rows, auv)
    return Samples(times, *world.reckoning.sample(auv, times, *corrections))
