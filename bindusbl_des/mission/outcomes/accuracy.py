"""How far off an AUV was, and whether it knew."""

from math import sqrt
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import compiled
from ...navigation.weighing import SURE
from ...records.rows import Rows
from ..world import World
from .means import mean, quantile_of
from .service import MOST

Floats = NDArray[np.float64]


def note_accuracy(metrics: Rows, world: World, auv: int, times: Floats, errors: Floats) -> None:
    """Write to the metrics of the fleet (n,) how far off an AUV was at instants (k,), s.

    Its horizontal errors (k,), m, are written.

    Raises:
        ArithmeticError: naming the first instant at which its estimate is no number.
    """
    found, metric = world.sample(auv, times), metrics[auv : auv + 1]
    sure = world.navigator.covariance(auv, found.odometry)
    _note(metric, errors, found.way.lines, found.odometry.position, found.estimate, sure)
    if not np.isfinite(metric["position_error_m"][0]):
        lost_at = times[np.flatnonzero(~np.isfinite(errors))[0]]
        refuse(auv, f"estimate is no number from {lost_at:g} s on")
    metric["position_error_p95_m"] = quantile_of(errors, MOST)


def refuse(auv: int, trouble: str) -> NoReturn:
    """End the run: a NaN in a table would pass for a missing value, and be left out of means."""
    raise ArithmeticError(
        f"AUV{auv}'s {trouble}; this is a mistake of the program, not of the scenario: please "
        "report it with scenario and seed"
    )


@compiled
def _note(
    metrics: Rows, errors: Floats, lines: Floats, reckoned: Floats, estimate: Floats, sure: Floats
) -> None:
    """Write to the one row of metrics the errors of an estimate (n, 2), m, along a way
    (:class:`.ways.Way`), and of dead reckoning (n, 2), m; `sure` (n, 3), m2, is xx, yy, xy of the
    estimate.
    """
    metric, n = metrics[0], len(lines)
    total = square = largest = sideways = alone = 0.0
    for k in range(n):
        x, y = estimate[k, 0] - lines[k, 0], estimate[k, 1] - lines[k, 1]
        drift_x, drift_y = reckoned[k, 0] - lines[k, 0], reckoned[k, 1] - lines[k, 1]
        errors[k] = sqrt(x * x + y * y)
        total += errors[k]
        square += x * x + y * y
        largest = max(largest, errors[k])
        sideways += abs(lines[k, 6] * y - lines[k, 7] * x)
        alone += sqrt(drift_x * drift_x + drift_y * drift_y)
    metric.position_error_m, metric.position_error_rms_m = total / n, sqrt(square / n)
    metric.position_error_max_m, metric.cross_track_error_m = largest, sideways / n
    metric.imu_error_m, metric.fix_benefit_m = alone / n, alone / n - total / n
    # the time mean of e' P^-1 e; while an AUV is sure in some direction, as at first, there is none
    normalised, known = np.empty(len(sure)), 0
    for k in range(len(sure)):
        xx, yy, xy = sure[k, 0], sure[k, 1], sure[k, 2]
        x, y = estimate[k, 0] - lines[k, 0], estimate[k, 1] - lines[k, 1]
        determinant = xx * yy - xy * xy
        if determinant > SURE * ((xx + yy) * (xx + yy)):
            weighed = yy * (x * x) - 2 * xy * x * y + xx * (y * y)
            normalised[known] = weighed / determinant
            known += 1
    metric.nees = mean(normalised[:known])
