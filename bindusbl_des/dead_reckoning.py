"""How dead reckoning drifts: a velocity bias and the random walk of the IMU's noise."""

import math

import numpy as np
from numpy.typing import NDArray

from .compiled import compiled
from .motion import Ints, Motion, line_at

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


class DeadReckoning:
    """What one AUV knows of its way by itself: its motion, with a bias and a random walk."""

    def __init__(
        self,
        motion: Motion,
        vehicle: int,
        walk: Array,
        rate: float,
        bias: tuple[float, float],
        frame: str,
    ) -> None:
        """Take the true motion of a vehicle of a fleet, and what makes its dead reckoning wrong.

        `walk` (n + 1, 2), m, holds at the samples k / `rate` of the IMU, which keeps its velocity
        between them; n >= 1.  `bias` (m/s) is constant in the `frame` "body" or "world".
        """
        self._known = (*motion, vehicle, walk, rate, *bias, frame == "body")

    def at(self, time: float) -> tuple[float, float]:
        """Return where the AUV believes to be (m) at an instant (s) if it has had no fix."""
        x, y, _, _, ahead, aside = _reckoned(*self._known, time)
        return x + ahead, y + aside

    def sample(
        self, times: Array, corrected_at: Array, corrections: Array
    ) -> tuple[Array, Array, Array]:
        """Return truth x, y, z (m), yaw (rad), (n, 4); drift and error (m), (n, 2), at instants.

        `times` (s) rise.  The error is drift plus the last of the `corrections` (k, 2), m, that was
        applied by then; they begin at the instants `corrected_at` (k,), s, the first at or before
        all `times`.
        """
        n = len(times)
        truth, drift, error = np.empty((n, 4)), np.empty((n, 2)), np.empty((n, 2))
        instants = np.ascontiguousarray(times, dtype=np.float64)
        _reckoned_all(*self._known, instants, corrected_at, corrections, truth, drift, error)
        return truth, drift, error


@compiled
def _reckoned(
    table: Array, first: Ints, step: float, vehicle: int, walk: Array, rate: float,
    forward: float, starboard: float, in_body: bool, time: float,
) -> tuple[float, float, float, float, float, float]:  # fmt: skip
    """Return true x, y, z (m) and yaw (rad), and the drift (m) along x and y, at an instant (s)."""
    x, y, z, yaw, cosine, sine, _ = line_at(table, first, step, vehicle, time)
    whole = min(int(time * rate), len(walk) - 2)
    share = time * rate - whole
    ahead = walk[whole, 0] + share * (walk[whole + 1, 0] - walk[whole, 0])
    aside = walk[whole, 1] + share * (walk[whole + 1, 1] - walk[whole, 1])
    if in_body:
        ahead += cosine * forward - sine * starboard
        aside += sine * forward + cosine * starboard
    else:
        ahead += time * forward
        aside += time * starboard
    return x, y, z, yaw, ahead, aside


@compiled
def _reckoned_all(
    table: Array, first: Ints, step: float, vehicle: int, walk: Array, rate: float,
    forward: float, starboard: float, in_body: bool, times: Array, corrected_at: Array,
    corrections: Array, truth: Array, drift: Array, error: Array,
) -> None:  # fmt: skip
    """Write truth (n, 4), drift (n, 2) and error (n, 2) at instants (s) in rising order."""
    last = 0
    for k in range(times.size):
        x, y, z, yaw, ahead, aside = _reckoned(
            table, first, step, vehicle, walk, rate, forward, starboard, in_body, times[k]
        )
        while last + 1 < corrected_at.size and corrected_at[last + 1] <= times[k]:
            last += 1
        truth[k, 0], truth[k, 1], truth[k, 2], truth[k, 3] = x, y, z, yaw
        drift[k, 0], drift[k, 1] = ahead, aside
        error[k, 0], error[k, 1] = ahead + corrections[last, 0], aside + corrections[last, 1]
