"""Where a log began, found from its ranges: odometry as a whole is laid over the beacons.

The sum of squares has many minima (a way and its mirror image about two beacons fit nearly alike),
so many starts descend at once, and those ranges count little that fit badly: Cauchy's weights
1 / (1 + (r / c)^2), with a scale c that falls, which is graduated non-convexity.  Sources: P. W.
Holland, R. E. Welsch, Robust regression using iteratively reweighted least squares, 1977; H. Yang
and others, Graduated non-convexity for robust spatial perception, 2020.
"""

from math import pi
from typing import NamedTuple

import numpy as np

from .log import Array, BadLog, Log, Pose

# Directions and places from which a descent begins, and the scales c (m) that it goes through.
HEADINGS, PLACES_ALONG = 12, 3
SCALES = (100.0, 30.0, 10.0, 3.0)
STEPS = 25

# Two starts are different when they are so far apart (m), or turned by so much (rad).
APART, TURNED = 10.0, 0.2


class Start(NamedTuple):
    """A start, the mean loss of a range with it, and that of the best start elsewhere.

    The loss is ln(1 + (r / c)^2) / 2 with the last of the scales; `rival_loss` is infinite where
    all descents ended in one place.
    """

    pose: Pose
    loss: float
    rival_loss: float


def find_start(log: Log) -> Start:
    """Return where the odometry of a log begins in the frame of its beacons.

    It is taken for a rigid way: what it drifted by shows as misfit, and is left to the navigator.

    Raises:
        BadLog: when ranges are too few to tell, or go to one beacon only.
    """
    heard = np.unique(log.ranges.beacons)
    if len(heard) < 2 or len(log.ranges.times) < 3:
        raise BadLog(
            f"{log.name}: {len(log.ranges.times)} ranges to {len(heard)} beacons tell of no start; "
            "three or more to two beacons are needed, or a log in the frame of its beacons"
        )
    local = log.begun_at(Pose(0.0, 0.0, 0.0))
    fit = _Fit(local)
    poses = _guesses(local)
    for scale in SCALES:
        poses = fit.descended(poses, scale)
    losses = fit.losses(poses, SCALES[-1]).mean(axis=1)
    best = int(np.argmin(losses))
    gap = np.hypot(*(poses[:, :2] - poses[best, :2]).T)
    turn = np.abs(np.mod(poses[:, 2] - poses[best, 2] + pi, 2 * pi) - pi)
    elsewhere = (gap > APART) | (turn > TURNED)
    rival = float(np.min(losses[elsewhere], initial=np.inf))
    x, y, heading = poses[best].tolist()
    return Start(Pose(x, y, float(np.mod(heading + pi, 2 * pi) - pi)), float(losses[best]), rival)


def _guesses(log: Log) -> Array:
    """Return poses (n, 3) all around the beacons, in all directions."""
    places = log.beacons.places[np.unique(log.ranges.beacons), :2]
    reach = float(np.median(log.ranges.metres))
    middle = places.mean(axis=0)
    offsets = np.linspace(-reach, reach, PLACES_ALONG)
    headings = np.arange(HEADINGS) * 2 * pi / HEADINGS
    grid = np.meshgrid(middle[0] + offsets, middle[1] + offsets, headings, indexing="ij")
    return np.stack(grid, axis=-1).reshape(-1, 3)


class _Fit:
    """How well the ranges of a log fit with its odometry beginning at k poses (k, 3) at once."""

    def __init__(self, log: Log) -> None:
        times, beacons, self._metres = log.ranges
        self._way = log.at(log.places, times)
        self._beacons = log.beacons.places[beacons, :2]
        self._depths = log.beacons.places[beacons, 2] - log.at(log.depths, times)

    def losses(self, poses: Array, scale: float) -> Array:
        """Return the loss of each range with each pose (k, ranges)."""
        return np.asarray(0.5 * np.log1p((self._residuals(poses)[0] / scale) ** 2))

    def descended(self, poses: Array, scale: float) -> Array:
        """Return the poses that damped, reweighted least squares come to from others."""
        damping = np.full(len(poses), 1e-3)
        losses = self.losses(poses, scale).sum(axis=1)
        for _ in range(STEPS):
            off, slopes = self._residuals(poses)
            weights = 1.0 / (1.0 + (off / scale) ** 2)
            normal = np.einsum("kn,kni,knj->kij", weights, slopes, slopes)
            pull = np.einsum("kn,kni,kn->ki", weights, slopes, off)
            diagonal = np.einsum("kii->ki", normal)  # a view
            diagonal += damping[:, None] * diagonal + 1e-12
            tried = poses - np.linalg.solve(normal, pull[:, :, None])[:, :, 0]
            after = self.losses(tried, scale).sum(axis=1)
            better = after < losses
            poses = np.where(better[:, None], tried, poses)
            losses = np.where(better, after, losses)
            damping = np.where(better, damping / 10.0, damping * 10.0)
        return poses

    def _residuals(self, poses: Array) -> tuple[Array, Array]:
        """Return predicted less measured ranges (k, n), m, and their slopes (k, n, 3)."""
        c, s = np.cos(poses[:, 2:]), np.sin(poses[:, 2:])
        x, y = self._way.T
        moved_x, moved_y = c * x - s * y, s * x + c * y
        ahead = poses[:, :1] + moved_x - self._beacons[:, 0]
        aside = poses[:, 1:2] + moved_y - self._beacons[:, 1]
        predicted = np.sqrt(ahead**2 + aside**2 + self._depths**2)
        away = np.maximum(predicted, 1e-9)
        along, across = ahead / away, aside / away
        slopes = np.stack((along, across, across * moved_x - along * moved_y), axis=-1)
        return predicted - self._metres, slopes
