"""How dead reckoning drifts: a velocity bias and the random walk of the IMU's noise."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .compiled import compiled, inlined
from .motion import Ints, Motion, headed

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
    """Return random walks (m) of `sd` (m/sqrt(s)) at the samples k / rate, in the place of `noise`.

    `noise` (n, k + 1, 2) are standard normal numbers but for the first row of each walk, which is
    where it begins (m).  The variance is sd^2 t per axis whatever the path, so walks are drawn in
    the survey frame, and do not depend on what else happens.
    """
    _sum_up(noise, sd / math.sqrt(rate))
    return noise


@compiled
def _sum_up(walks: Array, step: float) -> None:
    for walk in range(walks.shape[0]):
        x, y = walks[walk, 0, 0], walks[walk, 0, 1]
        for k in range(1, walks.shape[1]):
            x += step * walks[walk, k, 0]
            y += step * walks[walk, k, 1]
            walks[walk, k, 0], walks[walk, k, 1] = x, y


# Motion of the fleet, walks (n, samples, 2), their rate, biases (n, 2), whether in the body
Known = tuple[Array, Ints, float, Array, float, Array, bool]


class DeadReckoning:
    """What AUVs know of their way by themselves: their motion, with a bias and a random walk."""

    def __init__(
        self, motion: Motion, walks: Array, rate: float, biases: ArrayLike, frame: str
    ) -> None:
        """Take the true motion of n AUVs, and what makes their dead reckoning wrong.

        `walks` (n, samples, 2), m, hold at the samples k / `rate` of the IMUs, which keep their
        velocity between them; two samples or more.  `biases` (n, 2) or (2,), m/s, are constant in
        the `frame` "body" (ahead, to starboard) or "world" (along x and y).
        """
        own = np.array(np.broadcast_to(biases, (len(walks), 2)), dtype=np.float64, order="C")
        self.known: Known = (*motion, walks, rate, own, frame == "body")

    def at(self, auv: int, time: float) -> tuple[float, float]:
        """Return where an AUV believes to be (m) at an instant (s) if it has had no fix."""
        x, y, _, _, ahead, aside = reckoned(auv, time, *self.known)
        return x + ahead, y + aside

    def sample(
        self, auv: int, times: Array, corrected_at: Array, corrections: Array
    ) -> tuple[Array, Array, Array]:
        """Return truth x, y, z (m), yaw (rad), (n, 4); drift and error (m), (n, 2), at instants.

        `times` (s) rise.  The error is drift plus the last of the `corrections` (k, 2), m, that was
        applied by then; they begin at the instants `corrected_at` (k,), s, the first at or before
        all `times`.
        """
        n = len(times)
        truth, drift, error = np.empty((n, 4)), np.empty((n, 2)), np.empty((n, 2))
        instants = np.ascontiguousarray(times, dtype=np.float64)
        _reckoned_all(
            auv, instants, *self.known, corrected_at, corrections, truth, drift, error,
        )  # fmt: skip
        return truth, drift, error


@inlined
def reckon(
    auv: int, time: float, table: Array, first: Ints, step: float, walks: Array, rate: float,
    biases: Array, in_body: bool,
) -> tuple[float, float, float, float, float, float]:  # fmt: skip
    """Return true x, y, z (m) and yaw (rad), and the drift (m) along x and y, at an instant (s).

    This is for loops over very many instants, as a part of them; others ask :func:`reckoned`.
    """
    x, y, z, yaw, cosine, sine = headed(table, first, step, auv, time)
    whole = min(int(time * rate), walks.shape[1] - 2)
    share = time * rate - whole
    ahead = walks[auv, whole, 0] + share * (walks[auv, whole + 1, 0] - walks[auv, whole, 0])
    aside = walks[auv, whole, 1] + share * (walks[auv, whole + 1, 1] - walks[auv, whole, 1])
    forward, starboard = biases[auv, 0], biases[auv, 1]
    if in_body:
        ahead += cosine * forward - sine * starboard
        aside += sine * forward + cosine * starboard
    else:
        ahead += time * forward
        aside += time * starboard
    return x, y, z, yaw, ahead, aside


@compiled
def reckoned(
    auv: int, time: float, table: Array, first: Ints, step: float, walks: Array, rate: float,
    biases: Array, in_body: bool,
) -> tuple[float, float, float, float, float, float]:  # fmt: skip
    """Return true x, y, z (m) and yaw (rad), and the drift (m) along x and y, at an instant (s)."""
    return reckon(auv, time, table, first, step, walks, rate, biases, in_body)


@compiled
def _reckoned_all(
    auv: int, times: Array, table: Array, first: Ints, step: float, walks: Array, rate: float,
    biases: Array, in_body: bool, corrected_at: Array, corrections: Array,
    truth: Array, drift: Array, error: Array,
) -> None:  # fmt: skip
    """Write truth (n, 4), drift (n, 2) and error (n, 2) at instants (s) in rising order."""
    last = 0
    for k in range(times.size):
        x, y, z, yaw, ahead, aside = reckoned(
            auv, times[k], table, first, step, walks, rate, biases, in_body
        )
        while last + 1 < corrected_at.size and corrected_at[last + 1] <= times[k]:
            last += 1
        truth[k, 0], truth[k, 1], truth[k, 2], truth[k, 3] = x, y, z, yaw
        drift[k, 0], drift[k, 1] = ahead, aside
        error[k, 0], error[k, 1] = ahead + corrections[last, 0], aside + corrections[last, 1]
