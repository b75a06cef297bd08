"""How dead reckoning drifts: a velocity bias and the random walk of the IMU's noise."""

import math

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


class Drift:
    """The drift of one AUV's dead reckoning over a mission, sampled like its IMU.

    At the samples it is exact; between them the IMU holds its velocity, so drift grows linearly.
    The random walk has variance sigma^2 t per axis whatever the path, so it is drawn in the survey
    frame, and does not depend on what else happens in the mission.
    """

    def __init__(self, rate: float, bias: Array, random_walk: float, noise: Array) -> None:
        """Take the bias drift at the samples k / rate, (n + 1, 2), and n rows of normal numbers."""
        self._rate = rate
        self._samples = bias.copy()
        self._samples[1:] += np.cumsum(noise, axis=0) * (random_walk / math.sqrt(rate))

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
