"""A log through our navigators, and what came out, in numbers; where it began, and the robust
optimum by GTSAM to lay ours beside.

Where a log began is found from its ranges: odometry as a whole is laid over the beacons.  The sum
of squares has many minima (a way and its mirror image about two beacons fit nearly alike), so many
starts descend at once, and those ranges count little that fit badly: Cauchy's weights
1 / (1 + (r / c)^2), with a scale c that falls, which is graduated non-convexity.  Sources: P. W.
Holland, R. E. Welsch, Robust regression using iteratively reweighted least squares, 1977; H. Yang
and others, Graduated non-convexity for robust spatial perception, 2020.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from inspect import signature
from math import pi
from typing import Any, NamedTuple

import numpy as np

from ...core.geometry.geodesy import ned_at_depth
from ...core.navigation.dead_reckoning import Odometry
from ...core.navigation.navigators import Navigator, OwnNavigator
from ...core.records.events import DELIVERED
from ...core.records.rows import FIX, NONE
from ...core.scenario.scenario import Scenario
from ...core.setup import Setup
from ...support.arrays import Floats
from .fitting import fit
from .log import BadLog, Log, LoggedPose
from .navigating import (
    NavigatedTrack,
    Noise,
    blank_seen,
    filter_log,
    noise_of,
    prepared,
    smooth_log,
)

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

    pose: LoggedPose
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
            f"{log.name}: {len(log.ranges.times)} ranges to {len(heard)} beacons give no start; "
            "three or more to two beacons are needed, or a log in the frame of its beacons"
        )
    local = log.begun_at(LoggedPose(0.0, 0.0, 0.0))
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
    return Start(
        LoggedPose(x, y, float(np.mod(heading + pi, 2 * pi) - pi)), float(losses[best]), rival
    )


def _guesses(log: Log) -> Floats:
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

    def losses(self, poses: Floats, scale: float) -> Floats:
        """Return the loss of each range with each pose (k, ranges)."""
        return np.asarray(0.5 * np.log1p((self._residuals(poses)[0] / scale) ** 2))

    def descended(self, poses: Floats, scale: float) -> Floats:
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

    def _residuals(self, poses: Floats) -> tuple[Floats, Floats]:
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


# At this many standard deviations Cauchy's loss has 95 % of the efficiency of least squares where
# there is no outlier.  Source: Holland and Welsch, 1977.
CAUCHY = 2.3849
MOST_ITERATIONS = 200


@dataclass(frozen=True)
class Reference:
    """Places (n, 2), m, at the instants of a log, and how sure GTSAM is of them (m).

    `sds` (n,) are the roots of the traces of their covariances, by the noise that the log states.
    """

    places: Floats
    sds: Floats


def robust_optimum(log: Log) -> Reference | None:
    """Return the poses that fit steps and ranges best, sought from where the log is placed.

    Noise is what the log states, with Cauchy's loss of ranges; a start is not held.  None where the
    package gtsam is not installed, the log states no noise, or its ranges do not determine a pose.

    Raises:
        BadLog: when the log is not placed yet.
    """
    if not log.placed:
        raise BadLog(f"{log.name}: its start must be found before it is optimised")
    try:
        import gtsam
    except ModuleNotFoundError:
        return None
    if log.stated is None or not log.has_ranges:
        return None
    graph, guess = gtsam.NonlinearFactorGraph(), gtsam.Values()
    poses = [gtsam.Pose2(*pose) for pose in np.column_stack((log.places, log.yaws))]
    for number, pose in enumerate(poses):
        guess.insert(number, pose)
    for number, (along, turn) in enumerate(
        zip(log.stated.step_m, log.stated.step_rad, strict=True)
    ):
        step = poses[number].between(poses[number + 1])
        noise = gtsam.noiseModel.Diagonal.Sigmas(np.array((along, along, turn)))
        graph.add(gtsam.BetweenFactorPose2(number, number + 1, step, noise))
    for number, place in enumerate(log.beacons.places):
        key = gtsam.symbol("b", number)
        guess.insert(key, place[:2])
        graph.add(gtsam.NonlinearEqualityPoint2(key, place[:2]))
    loss = gtsam.noiseModel.mEstimator.Cauchy.Create(CAUCHY)
    plain = gtsam.noiseModel.Isotropic.Sigma(1, log.stated.range_m)
    robust = gtsam.noiseModel.Robust.Create(loss, plain)
    rows = np.searchsorted(log.times, log.ranges.times)
    for row, beacon, metres in zip(rows.tolist(), *log.ranges[1:], strict=True):
        graph.add(gtsam.RangeFactor2D(row, gtsam.symbol("b", beacon), metres, robust))
    options = gtsam.LevenbergMarquardtParams()
    options.setMaxIterations(MOST_ITERATIONS)
    try:
        found = gtsam.LevenbergMarquardtOptimizer(graph, guess, options).optimize()
        marginals = gtsam.Marginals(graph, found)
        spreads = [marginals.marginalCovariance(n)[:2, :2].trace() for n in range(len(poses))]
    except RuntimeError:  # an ill-posed system
        return None
    places = [found.atPose2(n).translation() for n in range(len(poses))]
    return Reference(np.array(places), np.sqrt(spreads))


@dataclass(frozen=True)
class Replay:
    """A log, placed, with the noise by which it was navigated, and where that has put the vehicle.

    `start` is None where the log says itself where it begins, `reference` where there is none;
    `setup` is of the scenario that gave the noise.
    """

    log: Log
    start: Start | None
    noise: Noise
    filter: NavigatedTrack
    smoother: NavigatedTrack
    reference: Reference | None
    setup: Setup | None = None

    @property
    def offset_m(self) -> tuple[float, float] | None:
        """Where x = y = 0 of the log is in the survey of the setup (m); None where that is not
        known.  A log in metres is taken to have the frame of the survey.
        """
        if self.setup is None or self.log.start_found:
            return None
        if self.log.origin_deg is None:
            return 0.0, 0.0
        if self.setup.ground is None:
            return None
        lat, lon = self.log.origin_deg
        north, east, _ = ned_at_depth([lat], [lon], [0.0], self.setup.ground)[0].tolist()
        return north, east

    @property
    def over_land(self) -> tuple[int, int]:
        """How many ranges have land of the setup in their way, and how many fixes lie on it."""
        offset, log = self.offset_m, self.log
        if self.setup is None or offset is None or (land := self.setup.land) is None:
            return 0, 0
        here, beacons = (
            self.smoother.at(log.ranges.times) + offset,
            log.beacons.places[:, :2] + offset,
        )
        across = land.crossed(here, beacons)[np.arange(len(here)), log.ranges.beacons]
        return int(across.sum()), int(land.holds(log.fixes.places + offset).sum())


def replay(
    log: Log,
    *,
    navigator: Callable[..., Navigator] | None = None,
    noise: Noise | Scenario | None = None,
) -> Replay:
    """Return what navigators make of a log, with noise that is given or fitted to the log.

    A `navigator` of one's own is called as in a mission, with the dead reckoning and the number of
    vehicles, 1, and with the noise if it has a parameter `noise`; it stands in the filter's place.

    Raises:
        BadLog: when no start can be found; when a navigator of one's own is to go by ranges, or by
            noise that is given but has no parameter for it.
        PluginError: when it cannot be made, or answers no numbers.
    """
    placed, start = placed_log(log)
    setup = Setup.of(noise) if isinstance(noise, Scenario) else None
    if setup is not None:
        noise = noise_of(setup)
    chosen = noise if isinstance(noise, Noise) else fit(placed).noise
    if placed.start_found:
        chosen = chosen.with_start_found()
    if placed.has_ranges and chosen.range_sd <= 0.0:
        raise BadLog(f"{log.name}: usbl.travel_time_sd_s must be above 0 to weigh ranges")
    known = prepared(placed)
    track = filter_log(known, chosen)
    later, _ = smooth_log(known, chosen, track)
    if navigator is not None:
        track = _navigated(placed, navigator, chosen, known.odometry.times, given=noise is not None)
    return Replay(placed, start, chosen, track, later, robust_optimum(placed), setup)


def placed_log(log: Log) -> tuple[Log, Start | None]:
    """Return a log in the frame of its beacons, and where it begins if that had to be found."""
    if log.placed:
        return log, None
    start = find_start(log)
    return log.begun_at(start.pose), start


class _Reckoning:
    """The odometry of a log as the dead reckoning of a fleet of one."""

    def __init__(self, log: Log) -> None:
        self._log = log

    def at(self, auv: int, time: float) -> tuple[float, float]:
        x, y = self.sample(auv, np.array((time,)))[1].position[0].tolist()
        return x, y

    def sample(self, auv: int, times: Floats) -> tuple[None, Odometry]:
        return None, self._log.odometry(times)


def _navigated(
    log: Log, make: Callable[..., Navigator], noise: Noise, times: Floats, *, given: bool
) -> NavigatedTrack:
    """Return where a navigator of one's own takes the vehicle for at instants (n,), s."""
    part = make.func if isinstance(make, partial) else make
    name = f"{part.__module__}:{getattr(part, '__qualname__', type(part).__qualname__)}"
    if log.has_ranges:
        raise BadLog(
            f"{log.name}: {name} cannot be replayed, since a navigator of one's own takes fixes, "
            "and the log has ranges; leave it out, or turn the ranges into fixes"
        )
    if "noise" in signature(make).parameters:
        make = partial(make, noise=noise)
    elif given:
        raise BadLog(
            f"{name} would not know the noise that is given: give it a parameter `noise`, as in "
            "def __init__(self, reckoning, auvs, *, noise=None), or leave the noise out"
        )
    reckoning: Any = _Reckoning(log)  # what navigators ask of a DeadReckoning, of a log
    own: Any = OwnNavigator(name, make, reckoning, np.zeros((1, 2)))
    fixes = _fixes(log)
    seen = blank_seen(len(fixes))
    seen["inlier"], seen["density"], seen["taken"] = 1.0, np.nan, True
    own.correct(fixes, np.arange(len(fixes)))
    seen["off_m"], seen["nis"] = fixes["innovation_m"], fixes["nis"]
    odometry = log.odometry(times)
    return NavigatedTrack(times, own.estimate(0, odometry), own.covariance(0, odometry), seen)


def _fixes(log: Log) -> Any:
    """Return the fixes of a log as a mission delivers them, each as it holds."""
    fixes = np.zeros(len(log.fixes.times), dtype=FIX)
    for name, kind in FIX.fields.items():  # type: ignore[union-attr]  # a record has fields
        fixes[name] = np.nan if kind[0].kind == "f" else NONE
    fixes["fix"], fixes["auv"], fixes["outcome"] = np.arange(len(fixes)), 0, DELIVERED
    for name in ("pinged_at_s", "valid_at_s", "broadcast_at_s", "delivered_at_s"):
        fixes[name] = log.fixes.times
    fixes["latency_s"] = 0.0
    fixes["x_m"], fixes["y_m"] = log.fixes.places.T
    fixes["z_m"], fixes["sd_z_m"] = log.at(log.depths, log.fixes.times), 0.0
    xx, yy, fixes["cov_xy_m2"] = log.fixes.covariances.T
    fixes["sd_x_m"], fixes["sd_y_m"] = np.sqrt(xx), np.sqrt(yy)
    return fixes.view(np.recarray)


def rms_between(places: Floats, others: Floats) -> float:
    """Return the root mean square distance (m) of places (n, 2) from others.

    >>> rms_between(np.zeros((2, 2)), np.array([[3.0, 4.0], [0.0, 0.0]])).__round__(6)
    3.535534
    """
    return float(np.sqrt(np.mean(np.sum((places - others) ** 2, axis=1))))


def mean_nis(track: NavigatedTrack) -> float:
    """Return the mean normalised innovation squared of what is no outlier, about 1 for ranges (2
    for fixes) where the noise is as told: each sight counts by how likely it is to be none.
    """
    inlier = track.seen["inlier"]
    total = float(inlier.sum())
    return float((inlier * track.seen["nis"]).sum()) / total if total else float("nan")


def outlier_share(track: NavigatedTrack) -> float:
    """Return the share of sights that are likelier outliers than not, or were refused."""
    seen = track.seen
    return float(np.mean((seen["inlier"] < 0.5) | ~seen["taken"]))
