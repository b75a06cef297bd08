"""A log as the filter of logs takes it, and the noise that a scenario says.

All that replays need of that filter comes from here.
"""

from math import inf, radians
from typing import Any

import numpy as np

from ...core.navigation.log_filter import (
    SIGHT,
    NavigatedTrack,
    Noise,
    Prepared,
    blank_seen,
    filter_log,
    smooth_log,
)
from ...core.setup import Setup
from .log import Log

__all__ = [
    "NavigatedTrack",
    "Noise",
    "Prepared",
    "blank_seen",
    "filter_log",
    "noise_of",
    "prepared",
    "smooth_log",
]


def noise_of(setup: Setup) -> Noise:
    """Return the noise that a scenario tells AUVs of, as far as a log has any use for it."""
    setup = setup.taken
    scenario = setup.scenario
    navigation, usbl, sensors = scenario.navigation, scenario.usbl, setup.own_sensors
    return Noise(
        setup.usbl.range_sd(2 if setup.usbl.sheet is not None and setup.ranging.calls else 1),
        usbl.outlier_share,
        usbl.outlier_sd_m if usbl.outlier_share > 0.0 else 0.0,
        sensors.random_walk_m_per_sqrt_s,
        sensors.bias_m_per_s,
        sensors.bias_sd_m_per_s,
        navigation.nis_gate or 0.0,
        navigation.initial_position_sd_m,
        navigation.bias_frame == "body",
        sensors.scale_factor_sd,
        radians(sensors.heading_sd_deg),
        inf if sensors.bias_time_constant_s is None else sensors.bias_time_constant_s,
    )


def prepared(log: Log) -> Prepared:
    """Return a log that is placed, its sights in the order in which they hold."""
    times = np.unique(np.concatenate((log.times, log.ranges.times, log.fixes.times)))
    ranges = _blank(len(log.ranges.times))
    beacons = log.beacons.places[log.ranges.beacons]
    ranges["node"] = np.searchsorted(times, log.ranges.times)
    ranges["x_m"], ranges["y_m"] = beacons[:, 0], beacons[:, 1]
    ranges["z_m"] = beacons[:, 2] - log.at(log.depths, log.ranges.times)
    ranges["range_m"] = log.ranges.metres
    fixes = _blank(len(log.fixes.times))
    fixes["node"] = np.searchsorted(times, log.fixes.times)
    fixes["x_m"], fixes["y_m"] = log.fixes.places.T
    xx, yy, xy = log.fixes.covariances.T
    spreads, axes = np.linalg.eigh(np.stack((xx, xy, xy, yy), axis=-1).reshape(-1, 2, 2))
    fixes["along_m2"], fixes["across_m2"] = spreads.T
    fixes["axis_x"], fixes["axis_y"] = axes[:, 0, 0], axes[:, 1, 0]
    sights = np.concatenate((ranges, fixes))
    order = np.argsort(sights["node"], kind="stable")
    return Prepared(log.odometry(times), sights[order].view(np.recarray))


def _blank(count: int) -> Any:
    rows = np.zeros(count, dtype=SIGHT)
    rows["range_m"] = np.nan
    return rows
