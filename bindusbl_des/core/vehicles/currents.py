"""The current: uniform, with a slow variation."""

import math

import numpy as np

from ...support.arrays import Floats
from ...support.compiled import compiled

# The control interval (s): autopilots act, and the current changes, ten times a second.
CONTROL_S = 0.1


def current_series(
    speed: float,
    direction: float,
    variation: float,
    time_constant: float,
    interval: float,
    noise: Floats,
) -> Floats:
    """Return the current (m/s) along x and y in each of n intervals, shape (n, 2).

    A uniform current of `speed` (m/s) flows towards `direction` (rad, from +x to +y).  Each axis
    varies around it as a stationary first-order Gauss-Markov process of standard deviation
    `variation` (m/s) and `time_constant` (s), exact at intervals of `interval` (s); `noise` are n
    rows of two standard normal numbers.

    >>> current_series(0.3, 0.0, 0.0, 600.0, 0.1, np.zeros((2, 2))).tolist()
    [[0.3, 0.0], [0.3, 0.0]]
    """
    mean = speed * np.array((math.cos(direction), math.sin(direction)))
    return np.asarray(mean + gauss_markov(variation, time_constant, interval, noise))


def gauss_markov(sd: float, time_constant: float, interval: float, noise: Floats) -> Floats:
    """Return stationary first-order Gauss-Markov processes (n, 2) along two axes.

    Exact at intervals of `interval` (s), with a `time_constant` (s); `noise` (n, 2) are standard
    normal numbers.
    """
    varied = np.empty_like(noise)
    _vary(noise, math.exp(-interval / time_constant), varied)
    return np.asarray(sd * varied)


@compiled
def _vary(noise: Floats, kept: float, varied: Floats) -> None:
    """Write a process (n, 2) of unit variance; each row keeps the share `kept` of the one
    before.
    """
    fresh = math.sqrt(1.0 - kept**2)
    for axis in range(2):  # a row at once would take two seconds more to compile
        varied[0, axis] = noise[0, axis]
        for k in range(1, len(noise)):
            varied[k, axis] = kept * varied[k - 1, axis] + fresh * noise[k, axis]


def carried(series: Floats, interval: float, times: Floats) -> Floats:
    """Return the displacement (m) of the water by each instant (s), (n, 2).

    >>> carried(np.array([[1.0, 0.0], [0.0, 1.0]]), 10.0, np.array([5.0, 15.0])).tolist()
    [[5.0, 0.0], [10.0, 5.0]]
    """
    moved = np.concatenate((np.zeros((1, 2)), np.cumsum(series * interval, axis=0)))
    instants = np.arange(len(moved)) * interval
    return np.column_stack([np.interp(times, instants, column) for column in moved.T])
