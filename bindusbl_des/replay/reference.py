"""The robust optimum of a log, by GTSAM: another's estimate to lay ours beside, and no truth."""

from dataclasses import dataclass

import numpy as np

from .log import Array, BadLog, Log

# At this many standard deviations Cauchy's loss has 95 % of the efficiency of least squares where
# there is no outlier.  Source: Holland and Welsch, 1977.
CAUCHY = 2.3849
MOST_ITERATIONS = 200


@dataclass(frozen=True)
class Reference:
    """Places (n, 2), m, at the instants of a log, and how sure GTSAM is of them (m).

    `sds` (n,) are the roots of the traces of their covariances, by the noise that the log states.
    """

    places: Array
    sds: Array


def robust_optimum(log: Log) -> Reference | None:
    """Return the poses that fit steps and ranges best, sought from where the log is placed.

    Noise is what the log states, with Cauchy's loss of ranges; a start is not held.  None where the
    package gtsam is not installed, or the log states no noise.

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
    found = gtsam.LevenbergMarquardtOptimizer(graph, guess, options).optimize()
    marginals = gtsam.Marginals(graph, found)
    spreads = [marginals.marginalCovariance(n)[:2, :2].trace() for n in range(len(poses))]
    places = [found.atPose2(n).translation() for n in range(len(poses))]
    return Reference(np.array(places), np.sqrt(spreads))
