"""How far off an AUV may be: what its drift and the fixes it had allow, at three sigma."""

import math
from typing import TYPE_CHECKING

import numpy as np

from ...core.setup import Setup
from ...support.arrays import Floats

if TYPE_CHECKING:
    from .recording import Recording


SIGMAS = 3.0


def envelope_made_of(setup: Setup) -> str:
    """Return in words what the bound is made of."""
    if setup.navigator.has_gain:
        return "the known bias, the random walk and the covariances of the fixes delivered"
    name = setup.scenario.navigation.filter
    return f"what the filter {name} believes of its own error (its covariance)"


def error_envelope(mission: "Recording", auv: int) -> Floats:
    """Return the bound (m) on an AUV's position error at each instant of its track.

    The mean error is the drift of the known bias (and of a steady current that dead reckoning does
    not see) less what fixes took away of it.  Its covariance grows by the random walk and shrinks
    with each fix by the gain: P+ = (1 - g)^2 P + g^2 Sigma (eq. update).  A velocity bias and an
    initial position that are drawn for the mission (`velocity_bias_sd_m_per_s`,
    `initial_position_sd_m`) do not grow and shrink like that: each is one unknown number per axis,
    and moves the estimate by its own drift, less what fixes took away of that; sd^2 times the
    square of that way is its variance, sd^2 t^2 and sd^2 before the first fix.  So do a scale
    factor and a heading, of which the drift is the way travelled, and that turned by a quarter; a
    bias that wanders is taken for a constant one, which carries an AUV farther.  The bound is
    |mean| + 3 sqrt(largest eigenvalue).  Unsteady currents and late corrections of the heading are
    left out.  A filter without a fixed gain says itself how sure it is: there the bound is three
    sigma of that.
    """
    if not mission.setup.navigator.has_gain:
        return SIGMAS * _largest_sd(mission.covariance(auv))
    sd = mission.setup.sensors[auv].random_walk_m_per_sqrt_s
    walk = np.array([sd**2, sd**2, 0.0])  # growth of xx, yy, xy (m2/s)
    delivered, covariances = _walked(mission, auv, walk)
    index = np.searchsorted(delivered, mission.times, side="right") - 1
    covariance = covariances[index] + np.outer(mission.times - delivered[index], walk)
    for sd, drift in _unknown(mission, auv):
        covariance += sd**2 * _products(drift + _corrections(mission, auv, drift)[index])
    drift = _mean_drift(mission, auv)
    mean = drift + _corrections(mission, auv, drift, _gone(mission, auv))[index]
    return np.asarray(np.hypot(*mean.T) + SIGMAS * _largest_sd(covariance))


def _deliveries(mission: "Recording", auv: int) -> tuple[Floats, Floats]:
    """Return when fixes arrived (s), and to which instants (s) their innovations belong."""
    rows = mission.delivered_to(auv)
    delivered, valid = (mission.fixes[name][rows] for name in ("delivered_at_s", "valid_at_s"))
    shifted = mission.scenario.navigation.fixed_gain.delay_compensation == "shift"
    return delivered, valid if shifted else delivered


def _walked(mission: "Recording", auv: int, walk: Floats) -> tuple[Floats, Floats]:
    """Return the start and each delivery (s), and the walk's and fixes' covariance (m2) from then.

    Covariances are rows of xx, yy, xy.
    """
    rows, gain = mission.delivered_to(auv), mission.scenario.navigation.fixed_gain.gain
    delivered, reference = _deliveries(mission, auv)
    fixes = mission.fixes
    noise = np.column_stack(
        (fixes["sd_x_m"][rows] ** 2, fixes["sd_y_m"][rows] ** 2, fixes["cov_xy_m2"][rows])
    )
    covariances, last = [np.zeros(3)], 0.0
    for number, time in enumerate(delivered):
        late = time - reference[number]  # drift since the reference stays as it is
        known = covariances[-1] + walk * max(time - last - late, 0.0)
        covariances.append((1 - gain) ** 2 * known + gain**2 * noise[number] + walk * late)
        last = time
    return np.concatenate(([0.0], delivered)), np.array(covariances)


def _corrections(
    mission: "Recording", auv: int, drift: Floats, gone: Floats | None = None
) -> Floats:
    """Return the sums of corrections (m) from the start and from each delivery on, (k + 1, 2).

    Each fix takes its share of a `drift` (n, 2), m, along the track and of what is left of it;
    `gone` (k, 2), m, is what innovations hold beside it.
    """
    gain, (_, reference) = mission.scenario.navigation.fixed_gain.gain, _deliveries(mission, auv)
    charged = _at(mission, drift, reference)
    if gone is not None:
        charged = charged + gone
    corrections = [np.zeros(2)]
    for error in charged:
        corrections.append(corrections[-1] - gain * (error + corrections[-1]))
    return np.array(corrections)


def _gone(mission: "Recording", auv: int) -> Floats:
    """Return the way (m) that the AUV went from where a fix holds to its innovation's instant."""
    valid = mission.fixes["valid_at_s"][mission.delivered_to(auv)]
    truth = np.column_stack([mission.truth[name][auv] for name in ("x_m", "y_m")])
    return _at(mission, truth, _deliveries(mission, auv)[1]) - _at(mission, truth, valid)


def _unknown(mission: "Recording", auv: int) -> list[tuple[float, Floats]]:
    """Return the sd of each number drawn for the mission, and the drift (n, 2) that 1 of it makes.

    The initial position (m) along x and y, the velocity bias (m/s) along its two axes, the scale
    factor and the heading (rad).
    """
    sensors, still = mission.setup.sensors[auv], np.zeros((len(mission.times), 2))
    bias, start = sensors.bias_sd_m_per_s, mission.scenario.navigation.initial_position_sd_m
    axes = ((1.0, 0.0), (0.0, 1.0))
    unknown = [(start, still + np.array(axis)) for axis in axes if start]
    unknown += [(bias, _summed(mission, _bias_rate(mission, auv, axis))) for axis in axes if bias]
    scale, turned = sensors.scale_factor_sd, math.radians(sensors.heading_sd_deg)
    if scale or turned:
        way = _way(mission, auv)
        unknown += [(scale, way), (turned, np.column_stack((-way[:, 1], way[:, 0])))]
    return unknown


def _way(mission: "Recording", auv: int) -> Floats:
    """Return the way (m) from the start (n, 2) of which log and compass tell, as it is."""
    truth = np.column_stack([mission.truth[name][auv] for name in ("x_m", "y_m")])
    way = truth - truth[0]
    if mission.setup.missed is not None:
        way -= _summed(mission, _current(mission, auv))
    return np.asarray(way)


def _current(mission: "Recording", auv: int) -> Floats:
    """Return the current (m/s) along x and y that a log misses, less its variation, (n, 2)."""
    water = mission.scenario.environment
    towards = math.radians(water.current_direction_deg)
    steady = water.current_m_per_s * np.array([math.cos(towards), math.sin(towards)])
    places = np.column_stack([mission.truth[name][auv] for name in ("x_m", "y_m", "z_m")])
    current = steady + mission.setup.flow.at(mission.times, places)
    return np.asarray(current * mission.setup.blind(places)[:, np.newaxis])


def _mean_drift(mission: "Recording", auv: int) -> Floats:
    """Return the drift (m) at each instant that bias and current cause, less the variation."""
    setup = mission.setup
    rate = _bias_rate(mission, auv, setup.sensors[auv].bias_m_per_s)
    if setup.missed is not None:
        rate = rate - _current(mission, auv)
    return _summed(mission, rate)


def _bias_rate(mission: "Recording", auv: int, bias: tuple[float, float]) -> Floats:
    """Return a velocity bias (m/s), ahead and to starboard or along x and y, along x and y."""
    forward, starboard = bias
    yaw = mission.truth["yaw_rad"][auv]
    if mission.scenario.navigation.bias_frame == "world":
        return np.tile([forward, starboard], (len(yaw), 1)).astype(np.float64)
    cosine, sine = np.cos(yaw), np.sin(yaw)
    return np.column_stack(
        (cosine * forward - sine * starboard, sine * forward + cosine * starboard)
    )


def _summed(mission: "Recording", rate: Floats) -> Floats:
    """Return the way (m) that a velocity (n, 2), m/s, along the track has gone at each instant."""
    middles = (rate[1:] + rate[:-1]) / 2 * np.diff(mission.times)[:, None]
    return np.concatenate((np.zeros((1, 2)), np.cumsum(middles, axis=0)))


def _products(ways: Floats) -> Floats:
    """Return the products xx, yy, xy of ways (n, 2)."""
    x, y = ways.T
    return np.column_stack((x * x, y * y, x * y))


def _at(mission: "Recording", values: Floats, instants: Floats) -> Floats:
    return np.column_stack([np.interp(instants, mission.times, column) for column in values.T])


def _largest_sd(covariances: Floats) -> Floats:
    """Return the sd (m) along the longer axis of each error ellipse (xx, yy, xy)."""
    xx, yy, xy = covariances.T
    largest: Floats = (xx + yy) / 2 + np.hypot((xx - yy) / 2, xy)
    return np.asarray(np.sqrt(largest))
