"""The mission sampled at regular instants: truth, estimate, dead reckoning and their errors."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .fleet import Auv

Array = NDArray[np.float64]

# Guards floor(duration * rate) against rounding, as for ticks.
COUNT_TOLERANCE = 1e-9


def instants(duration: float, rate: float) -> Array:
    """Return the instants k / rate in [0, duration) (s)."""
    return np.arange(int(np.ceil(duration * rate - COUNT_TOLERANCE))) / rate


@dataclass(frozen=True)
class Samples:
    """One AUV at n instants: truth x, y, z, yaw (n, 4); the rest is horizontal (n, 2)."""

    times: Array
    truth: Array
    imu: Array
    estimate: Array

    @property
    def error(self) -> Array:
        return self.estimate - self.truth[:, :2]

    @property
    def position_error(self) -> Array:
        """Horizontal |estimate - truth|, shape (n,), m."""
        return np.asarray(np.hypot(*self.error.T))

    @property
    def imu_error(self) -> Array:
        """Horizontal |dead reckoning - truth|, shape (n,), m."""
        return np.asarray(np.hypot(*(self.imu - self.truth[:, :2]).T))

    @property
    def cross_track_error(self) -> Array:
        """Estimate - truth perpendicular to the heading, positive to starboard, shape (n,), m."""
        yaw, (along, across) = self.truth[:, 3], self.error.T
        return np.asarray(np.cos(yaw) * across - np.sin(yaw) * along)


def sample(auv: Auv, times: Array) -> Samples:
    """Sample one AUV; its estimate at an instant includes a fix delivered at that instant."""
    truth = auv.vehicle.sample(times)
    imu = truth[:, :2] + auv.drift.sample(times)
    return Samples(times, truth, imu, imu + auv.navigator.corrections(times))
