"""How far off each AUV's estimate was, and the points of the track that show it."""

from math import hypot, nan, pi, sqrt
from typing import NoReturn

import numpy as np

from ..core.arrays import Floats
from ..core.compiled import compiled, inlined
from ..navigation.fix_update import SURE
from ..records.events import TrackPoint
from ..records.rows import Row, Rows, row_type
from .sensor_errors import pressure_errors
from .service import MOST, mean, quantile_of
from .trajectories import beside, instants
from .world import World


def note_accuracy(metrics: Rows, world: World, auv: int, times: Floats, errors: Floats) -> None:
    """Write to the metrics of the fleet (n,) how far off an AUV was at instants (k,), s.

    Its horizontal errors (k,), m, are written.

    Raises:
        ArithmeticError: naming the first instant at which its estimate is no number.
    """
    found, metric = world.sample(auv, times), metrics[auv : auv + 1]
    sure = world.navigator.covariance(auv, found.odometry)
    _note_errors(metric, errors, found.way.lines, found.odometry.position, found.estimate, sure)
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
def _note_errors(
    metrics: Rows, errors: Floats, lines: Floats, reckoned: Floats, estimate: Floats, sure: Floats
) -> None:
    """Write to the one row of metrics the errors of an estimate (n, 2), m, along a way
    (:class:`..vehicles.fleet.VehicleTrack`), and of dead reckoning (n, 2), m; `sure` (n, 3), m2, is
    xx, yy, xy of the estimate.
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


TRACK_POINT = row_type(TrackPoint)


def track_points(world: World) -> Rows:
    """Return the tracks of all vehicles at record.tracks_hz, AUVs first, (n,) :data:`TRACK_POINT`,
    vehicle by vehicle.
    """
    times = instants(world.setup.scenario.duration_s, world.setup.scenario.record.tracks_hz)
    auvs, asvs, ways = world.auv_fleet, world.asv_fleet, world.trajectories
    tracks = np.empty((len(auvs) + len(asvs), len(times)), dtype=TRACK_POINT)
    tracks["vehicle"] = np.arange(len(tracks))[:, np.newaxis]
    for auv in range(len(auvs)):
        points = tracks[auv]
        points["path_error_m"], points["swept_m2"] = ways.beside_m[auv], ways.swept_m2[auv]
        found = world.sample(auv, times)
        sure = world.navigator.covariance(auv, found.odometry)
        depth_error = pressure_errors(world.setup, world.streams, auv, times)
        _note_points(points, *found.way, found.odometry.position, found.estimate, sure, depth_error)
    off_station = beside(asvs.vehicles, times)
    for asv in range(len(asvs)):
        points = tracks[len(auvs) + asv]
        points["path_error_m"], points["swept_m2"] = off_station[asv], nan
        _note_truth(points, *asvs.ways.of(asv, times))
    return tracks.reshape(-1)


@compiled
def _note_points(
    points: Rows, times: Floats, lines: Floats, reckoned: Floats, estimate: Floats, sure: Floats,
    depth_error: Floats,
) -> None:  # fmt: skip
    """Write where an AUV was on its way (:class:`..vehicles.fleet.VehicleTrack`), and what it made
    of it.

    `reckoned` and `estimate` (n, 2), m; how `sure` it was: xx, yy, xy (n, 3), m2.
    """
    for k in range(times.size):
        point = points[k]
        _place(point, times[k], lines, k)
        point.estimate_x_m, point.estimate_y_m = estimate[k, 0], estimate[k, 1]
        point.estimate_z_m = lines[k, 2] + depth_error[k]
        point.imu_x_m, point.imu_y_m = reckoned[k, 0], reckoned[k, 1]
        x, y = estimate[k, 0] - lines[k, 0], estimate[k, 1] - lines[k, 1]
        point.position_error_m = hypot(x, y)
        point.cross_track_error_m = lines[k, 6] * y - lines[k, 7] * x
        point.estimate_sd_x_m = sqrt(max(sure[k, 0], 0.0))
        point.estimate_sd_y_m = sqrt(max(sure[k, 1], 0.0))
        point.estimate_cov_xy_m2 = sure[k, 2]


@compiled
def _note_truth(points: Rows, times: Floats, lines: Floats) -> None:
    """Write where a vessel was on its way, which nobody asks about anything."""
    for k in range(times.size):
        point = points[k]
        _place(point, times[k], lines, k)
        point.estimate_x_m = point.estimate_y_m = point.estimate_z_m = nan
        point.imu_x_m = point.imu_y_m = nan
        point.position_error_m = point.cross_track_error_m = nan
        point.estimate_sd_x_m = point.estimate_sd_y_m = point.estimate_cov_xy_m2 = nan


@inlined
def _place(point: Row, time: float, lines: Floats, k: int) -> None:
    """Write the instant and the true place of line k of a way, its heading in (-pi, pi]."""
    point.time_s = time
    point.x_m, point.y_m, point.z_m = lines[k, 0], lines[k, 1], lines[k, 2]
    turned = pi - lines[k, 3]
    if not 0.0 <= turned < 2 * pi:
        turned %= 2 * pi
    point.yaw_rad = pi - turned
