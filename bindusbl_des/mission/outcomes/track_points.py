"""The tracks of a mission: where vehicles were at regular instants, and what AUVs made of it."""

from collections.abc import Iterator
from math import hypot, nan, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import compiled, inlined
from ...records.rows import Row, Rows, row_type
from ...records.tracks import TrackPoint
from ..samples import instants
from ..voyage import beside
from ..world import World

Floats = NDArray[np.float64]

TRACK_POINT = row_type(TrackPoint)


def track_points(world: World) -> Iterator[Rows]:
    """Yield the tracks of all vehicles at record.tracks_hz, AUVs first, (n,) :data:`TRACK_POINT`.

    Each is written over by the next.
    """
    times = instants(world.scenario.duration_s, world.scenario.record.tracks_hz)
    auvs, asvs, voyage = world.auv_fleet, world.asv_fleet, world.voyage
    points = np.empty(len(times), dtype=TRACK_POINT)
    for auv in range(len(auvs)):
        points["vehicle"], points["path_error_m"] = auv, voyage.beside_m[auv]
        points["swept_m2"] = voyage.swept_m2[auv]
        found = world.sample(auv, times)
        sure = world.navigator.covariance(auv, found.odometry)
        depth_error = world.depth_noise(auv, times)
        _note(points, *found.way, found.odometry.position, found.estimate, sure, depth_error)
        yield points
    off_station = beside(asvs.vehicles, times)
    for asv in range(len(asvs)):
        points["vehicle"], points["path_error_m"] = len(auvs) + asv, off_station[asv]
        points["swept_m2"] = nan
        _note_truth(points, *asvs.ways.of(asv, times))
        yield points


@compiled
def _note(
    points: Rows, times: Floats, lines: Floats, reckoned: Floats, estimate: Floats, sure: Floats,
    depth_error: Floats,
) -> None:  # fmt: skip
    """Write where an AUV was on its way (:class:`.ways.Way`), and what it made of it.

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
