"""How dead reckoning drifts: a velocity bias and the random walk of the IMU's noise."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def bias_drift(bias: tuple[float, float], frame: str, times: Array, headings: Array) -> Array:
    """Return the drift (m), shape (n, 2), that a constant velocity bias (m/s) has caused.

    `times` (s) and `headings`, the integrals of cos(yaw) and sin(yaw) (n, 2), come from the path
    actually travelled.  In the body frame the bias turns with the vehicle, so that legs there and
    back cancel; in the world frame it does not (eq. dead_reckoning).

    >>> bias_drift((0.06, 0.06), "world", np.array([10.0]), np.zeros((1, 2))).tolist()
    [[0.6, 0.6]]
    """
    forward, starboard = bias
    if frame == "world":
        return np.outer(times, bias)
    cosine, sine = headings.T
    return np.column_stack(
        (cosine * forward - sine * starboard, sine * forward + cosine * starboard)
    )


def drift_rms(time: float, bias: tuple[float, float], random_walk: float) -> float:
    """Return the RMS of the horizontal drift (m) on a straight leg after `time` (s).

    sqrt(|b|^2 t^2 + 2 sigma^2 t); the paper's eq. error_envelope has a quarter of the first term
    and half of the second (docs/errata.md).

    >>> round(drift_rms(300, (0.06, 0.06), 0.027), 6)
    25.464434
    """
    return math.sqrt((math.hypot(*bias) * time) ** 2 + 2 * random_walk**2 * time)


def drift_envelope(time: float, bias: tuple[float, float], random_walk: float) -> float:
    """Return the error envelope (m) as the paper prints it (eq. error_envelope).

    >>> round(drift_envelope(300, (0.06, 0.06), 0.027), 6)
    12.736511
    """
    return math.sqrt(0.25 * (math.hypot(*bias) * time) ** 2 + random_walk**2 * time)


def random_walk(rate: float, sd: float, noise: Array) -> Array:
    """Return a random walk (m) of `sd` (m/sqrt(s)) at the samples k / rate, shape (n + 1, 2).

    `noise` are n rows of standard normal numbers.  Its variance is sd^2 t per axis whatever the
    path, so it is drawn in the survey frame, and does not depend on what else happens.
    """
    steps = np.concatenate((np.zeros((1, 2)), noise * (sd / math.sqrt(rate))))
    return np.cumsum(steps, axis=0)


class Drift:
    """How wrong the dead reckoning of an AUV is, known at the samples k / rate of its IMU.

    Between samples the IMU holds its velocity, so drift grows linearly.
    """

    def __init__(self, rate: float, samples: Array) -> None:
        """Take the drift (m) along x and y at each sample, shape (n, 2), n >= 2."""
        self._rate, self._samples = rate, samples

    def at(self, time: float) -> tuple[float, float]:
        """Return the drift (m) along x and y at an instant (s)."""
        whole = min(int(time * self._rate), len(self._samples) - 2)
        share = time * self._rate - whole
        (x, y), (next_x, next_y) = self._samples[whole : whole + 2].tolist()
        return x + share * (next_x - x), y + share * (next_y - y)

    def sample(self, times: Array) -> Array:
        """Return the drift (m) at each instant (s), shape (n, 2)."""
        whole = np.minimum((times * self._rate).astype(np.intp), len(self._samples) - 2)
        share = (times * self._rate - whole)[:, None]
        return np.asarray(
            self._samples[whole] + share * (self._samples[whole + 1] - self._samples[whole])
        )


class SteeredDrift:
    """The drift of an AUV that steers by its estimate: where its bias leads depends on its path.

    `walk` is the drift but for the bias; `headings(times)` gives the integrals of cos(yaw) and
    sin(yaw) along the path travelled so far, shape (n, 2).
    """

    def __init__(
        self,
        walk: Drift,
        bias: tuple[float, float],
        frame: str,
        headings: Callable[[Array], Array],
    ) -> None:
        self._walk, self._bias, self._frame = walk, bias, frame
        self._headings = headings

    def at(self, time: float) -> tuple[float, float]:
        """Return the drift (m) along x and y at an instant (s)."""
        x, y = self.sample(np.array([time]))[0].tolist()
        return x, y

    def sample(self, times: Array) -> Array:
        """Return the drift (m) at each instant (s), shape (n, 2)."""
        biased = bias_drift(self._bias, self._frame, times, self._headings(times))
        return np.asarray(self._walk.sample(times) + biased)
