"""The mission sampled at regular instants: truth, dead reckoning and estimate of an AUV."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..navigation.dead_reckoning import Odometry
from ..vehicles.ways import Way

Array = NDArray[np.float64]

# Guards floor(duration * rate) against rounding, as for ticks.
COUNT_TOLERANCE = 1e-9


@lru_cache(maxsize=8)
def instants(duration: float, rate: float, begin: float = 0.0) -> Array:
    """Return the instants k / rate in [begin, duration) (s); read-only, since missions share them.

    Of those from the start on the first is always the start, however low the rate.

    >>> instants(3.0, 1e-12).tolist()
    [0.0]
    """
    count = max(1, int(np.ceil(duration * rate - COUNT_TOLERANCE)))
    times: Array = np.arange(count) / rate
    times = times[times.searchsorted(begin) :]
    times.setflags(write=False)
    return times


class Samples(NamedTuple):
    """One AUV at n instants: its true way, and what it made of it.

    `odometry` is what its own sensors told it, `estimate` where it believed to be (n, 2), m, with
    every fix delivered by then.
    """

    way: Way
    odometry: Odometry
    estimate: Array


def turned(yaw: Array) -> Array:
    """Return headings (rad) in (-pi, pi].

    >>> turned(np.array([0.0, np.pi, -np.pi])).round(9).tolist()
    [0.0, 3.141592654, 3.141592654]
    """
    return np.asarray(np.pi - np.mod(np.pi - yaw, 2 * np.pi))
