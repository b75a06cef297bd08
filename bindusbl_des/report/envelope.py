"""How far off an AUV may be: what its drift and the fixes it had allow, at three sigma."""

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .recording import Recording

Floats = NDArray[np.float64]

SIGMAS = 3.0


def error_envelope(mission: "Recording", auv: int) -> Floats:
    """Return the bound (m) on an AUV's position error at each instant of its track.

    The mean error is the drift of the known bias (and of a steady current that dead reckoning does
    not see) less what fixes took away of it; its covariance grows by the random walk and shrinks
    with each fix by the gain: P+ = (1 - g)^2 P + g^2 Sigma (eq. update).  The bound is |mean| +
    3 sqrt(largest eigenvalue of P).  Unsteady currents and late corrections of the heading are left
    out.
    """
    sd = mission.scenario.navigation.random_walk_m_per_sqrt_s
    walk = np.array([sd**2, sd**2, 0.0])  # growth of xx, yy, xy (m2/s)
    drift = _mean_drift(mission, auv)
    delivered, corrections, covariances = _fixed(mission, auv, drift, walk)
    index = np.searchsorted(delivered, mission.times, side="right") - 1
    since = mission.times - delivered[index]
    covariance = covariances[index] + np.outer(since, walk)
    return np.asarray(np.hypot(*(drift + corrections[index]).T) + SIGMAS * _largest_sd(covariance))


def _fixed(
    mission: "Recording", auv: int, drift: Floats, walk: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return the start and each delivery (s), the mean corrections (m) and covariances after it."""
    navigation, fixes, rows = mission.scenario.navigation, mission.fixes, mission.delivered_to(auv)
    delivered, pinged = fixes["delivered_at_s"][rows], fixes["pinged_at_s"][rows]
    reference, gain = delivered, navigation.gain
    if navigation.delay_compensation == "shift":
        reference, charged = pinged, _at(mission, drift, pinged)
    else:  # the innovation also holds the way that the AUV has gone meanwhile
        truth = np.column_stack([mission.truth[name][auv] for name in ("x_m", "y_m")])
        gone = _at(mission, truth, delivered) - _at(mission, truth, pinged)
        charged = _at(mission, drift, delivered) + gone
    noise = np.column_stack(
        (fixes["sd_x_m"][rows] ** 2, fixes["sd_y_m"][rows] ** 2, fixes["cov_xy_m2"][rows])
    )
    corrections, covariances, last = [np.zeros(2)], [np.zeros(3)], 0.0
    for number, time in enumerate(delivered):
        corrections.append(corrections[-1] - gain * (charged[number] + corrections[-1]))
        late = time - reference[number]  # drift since the reference stays as it is
        known = covariances[-1] + walk * max(time - last - late, 0.0)
        covariances.append((1 - gain) ** 2 * known + gain**2 * noise[number] + walk * late)
        last = time
    return np.concatenate(([0.0], delivered)), np.array(corrections), np.array(covariances)


def _mean_drift(mission: "Recording", auv: int) -> Floats:
    """Return the drift (m) at each instant that the bias and a steady current cause."""
    scenario, yaw = mission.scenario, mission.truth["yaw_rad"][auv]
    forward, starboard = scenario.navigation.velocity_bias_m_per_s
    rate = np.tile([forward, starboard], (len(yaw), 1)).astype(np.float64)
    if scenario.navigation.bias_frame == "body":
        cosine, sine = np.cos(yaw), np.sin(yaw)
        rate = np.column_stack(
            (cosine * forward - sine * starboard, sine * forward + cosine * starboard)
        )
    if scenario.navigation.velocity == "through_water":
        water = scenario.environment
        towards = math.radians(water.current_direction_deg)
        rate = rate - water.current_m_per_s * np.array([math.cos(towards), math.sin(towards)])
    middles = (rate[1:] + rate[:-1]) / 2 * np.diff(mission.times)[:, None]
    return np.concatenate((np.zeros((1, 2)), np.cumsum(middles, axis=0)))


def _at(mission: "Recording", values: Floats, instants: Floats) -> Floats:
    return np.column_stack([np.interp(instants, mission.times, column) for column in values.T])


def _largest_sd(covariances: Floats) -> Floats:
    """Return the sd (m) along the longer axis of each error ellipse (xx, yy, xy)."""
    xx, yy, xy = covariances.T
    largest: Floats = (xx + yy) / 2 + np.hypot((xx - yy) / 2, xy)
    return np.asarray(np.sqrt(largest))
