"""How dead reckoning drifts: a velocity bias and the random walk of the IMU's noise."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..core.compiled import compiled, entry, inlined
from ..vehicles.motion import Ints, Motion, headed

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


@entry
def _sum_up(walks: Array, step: float) -> None:
    for walk in range(walks.shape[0]):
        x, y = walks[walk, 0, 0], walks[walk, 0, 1]
        for k in range(1, walks.shape[1]):
            x += step * walks[walk, k, 0]
            y += step * walks[walk, k, 1]
            walks[walk, k, 0], walks[walk, k, 1] = x, y


class Reckoned(NamedTuple):
    """What a fleet's dead reckoning is made of: its motion, random walks (n, samples, 2), m, at a
    rate (Hz), and biases (n, 2), m/s, in the body or not.
    """

    motion: Motion
    walks: Array
    rate: float
    biases: Array
    in_body: bool


class Told(NamedTuple):
    """What an AUV's own sensors have told it by an instant (s): its dead reckoning (m), and the
    integrals of the cosine and sine of its heading from the start of the mission (s).
    """

    time: float
    x: float
    y: float
    cosine: float
    sine: float


class Odometry(NamedTuple):
    """What an AUV's own sensors have told it by n instants (n,), s.

    Its dead reckoning (n, 2), m, and the integrals of the cosine and sine of its heading from the
    start of the mission (n, 2), s.
    """

    times: Array
    position: Array
    headings: Array


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
        self.known = Reckoned(motion, walks, rate, own, frame == "body")
        # as compiled equations take them
        self.flat: tuple[Any, ...] = (*motion, walks, rate, own, frame == "body")

    def at(self, auv: int, time: float) -> tuple[float, float]:
        """Return where an AUV believes to be (m) at an instant (s) if it has had no fix."""
        x, y = self.sample(auv, np.array((time,)))[1].position[0]
        return float(x), float(y)

    def sample(self, auv: int, times: Array) -> tuple[Array, Odometry]:
        """Return truth x, y, z (m), yaw (rad), (n, 4), and what the AUV knew, at instants (s)."""
        n = len(times)
        truth, position, headings = np.empty((n, 4)), np.empty((n, 2)), np.empty((n, 2))
        instants = np.array(times, dtype=np.float64)
        _reckoned_all(auv, instants, truth, position, headings, *self.flat)
        return truth, Odometry(instants, position, headings)


@inlined
def _reckon(
    auv: int, time: float, known: Reckoned
) -> tuple[float, float, float, float, float, float, float, float]:
    """Return true x, y, z (m) and yaw (rad), dead-reckoned x and y (m), and the integrals of the
    cosine and sine of the heading (s), at an instant (s).
    """
    x, y, z, yaw, cosine, sine = headed(known.motion, auv, time)
    walks = known.walks
    whole = min(int(time * known.rate), walks.shape[1] - 2)
    share = time * known.rate - whole
    ahead = walks[auv, whole, 0] + share * (walks[auv, whole + 1, 0] - walks[auv, whole, 0])
    aside = walks[auv, whole, 1] + share * (walks[auv, whole + 1, 1] - walks[auv, whole, 1])
    forward, starboard = known.biases[auv, 0], known.biases[auv, 1]
    if known.in_body:
        ahead += cosine * forward - sine * starboard
        aside += sine * forward + cosine * starboard
    else:
        ahead += time * forward
        aside += time * starboard
    return x, y, z, yaw, x + ahead, y + aside, cosine, sine


@compiled
def reckoned(auv: int, time: float, known: Reckoned) -> Told:
    """Return what an AUV's own sensors have told it by an instant (s)."""
    _, _, _, _, x, y, cosine, sine = _reckon(auv, time, known)
    return Told(time, x, y, cosine, sine)


@entry
def _reckoned_all(
    auv: int, times: Array, truth: Array, position: Array, headings: Array,
    table: Array, first: Ints, step: float, walks: Array, rate: float, biases: Array, in_body: bool,
) -> None:  # fmt: skip
    """Write truth (n, 4), dead reckoning (n, 2) and headings (n, 2) at instants (n,), s."""
    known = Reckoned(Motion(table, first, step), walks, rate, biases, in_body)
    for k in range(times.size):
        x, y, z, yaw, reckoned_x, reckoned_y, cosine, sine = _reckon(auv, times[k], known)
        truth[k, 0], truth[k, 1], truth[k, 2], truth[k, 3] = x, y, z, yaw
        position[k, 0], position[k, 1] = reckoned_x, reckoned_y
        headings[k, 0], headings[k, 1] = cosine, sine
