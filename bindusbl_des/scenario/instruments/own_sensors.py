"""What is wrong with AUVs' own sensors: as keys say it, or as the sheet of an inertial system does.

A sheet says how far off a system is after a straight way without fixes, in percent of that way or
in m per hour, with the circle that it means.  Both are read as a circular Gaussian of s along each
axis (:mod:`...core.spreads`):

* a percentage that holds at any distance is an error in proportion to the way: a scale factor along
  it and a heading error across, each drawn for the mission with s / way;
* m per hour that hold at any time are a velocity bias, drawn for the mission with s / time;
* either, met at the end of one way, is a velocity bias that wanders, a Gauss-Markov process of the
  body (or of `navigation.bias_frame`).  Its time constant is, unless given, the time that the way
  takes: until then the error grows nearly in proportion, later as the square root.

What a sheet says stands in the place of velocity biases and random walk; a scale factor and a
heading error that are given are further errors, independent of it.
"""

import math
from typing import NamedTuple

from ...core.spreads import drift_rms, per_axis_sd, wandering_rms
from ..scenario_keys import ScenarioKeys


class OwnSensors(NamedTuple):
    """How wrong an AUV's log, compass and inertial sensors are.

    A velocity bias that all share (m/s) and the standard deviation per axis of a further one, with
    its time constant (s; None: it never changes); the random walk (m/sqrt(s)) per axis; the
    standard deviations of the scale factor less one and of the heading (deg).
    """

    bias_m_per_s: tuple[float, float]
    bias_sd_m_per_s: float
    bias_time_constant_s: float | None
    random_walk_m_per_sqrt_s: float
    scale_factor_sd: float
    heading_sd_deg: float


def own_sensors(scenario: ScenarioKeys) -> OwnSensors:
    """Return what is wrong with the sensors of the AUVs of a scenario."""
    navigation, drift = scenario.navigation, scenario.navigation.drift
    given = OwnSensors(
        navigation.velocity_bias_m_per_s,
        navigation.velocity_bias_sd_m_per_s,
        navigation.velocity_bias_time_constant_s,
        navigation.random_walk_m_per_sqrt_s,
        navigation.scale_factor_sd,
        navigation.heading_sd_deg,
    )
    if not drift.is_stated:
        return given
    speed = scenario.auvs.speeds[0]  # that of all where a line is given
    if drift.line_m is not None:
        time = drift.line_m / speed
        lasts = time if drift.time_constant_s is None else drift.time_constant_s
        sd = _stated(drift.off_m(drift.line_m, time), scenario) / wandering_rms(time, 1.0, lasts)
        return given._replace(bias_sd_m_per_s=sd, bias_time_constant_s=lasts)
    if drift.m_per_hour is not None:
        return given._replace(bias_sd_m_per_s=_stated(drift.off_m(0.0, 1.0), scenario))
    share = _stated(drift.off_m(1.0, 0.0), scenario)
    return given._replace(
        scale_factor_sd=math.hypot(share, given.scale_factor_sd),
        heading_sd_deg=math.hypot(math.degrees(share), given.heading_sd_deg),
    )


def _stated(off: float, scenario: ScenarioKeys) -> float:
    return per_axis_sd(off, scenario.navigation.drift.statistic)


def straight_drift_rms(scenario: ScenarioKeys, time: float, speed: float | None = None) -> float:
    """Return the RMS (m) of what a straight way of some `time` (s) without fixes adds to the error.

    Beside the known bias (|b| t)^2 and the random walk's 2 sigma^2 t, a drawn velocity bias adds
    2 sd^2 t^2 (less if it wanders), a scale factor and a heading their variances times the square
    of the way, at a `speed` (m/s): the highest of all AUVs' unless given.
    """
    if speed is None:
        speed = max(scenario.auvs.speeds)
    sensors = own_sensors(scenario)
    lasts = sensors.bias_time_constant_s or math.inf
    skew = math.hypot(sensors.scale_factor_sd, math.radians(sensors.heading_sd_deg))
    return math.hypot(
        drift_rms(time, sensors.bias_m_per_s, sensors.random_walk_m_per_sqrt_s),
        math.sqrt(2) * wandering_rms(time, sensors.bias_sd_m_per_s, lasts),
        skew * speed * time,
    )


def drift_told(scenario: ScenarioKeys) -> str:
    """Return in a sentence how good dead reckoning is, in percent of the way and as it is drawn.

    Of AUVs that follow no plan of the scenario, whose speed is another, nothing can be said.
    """
    if scenario.auvs.route.kind in ("hold", "track"):
        return ""
    time, speed = scenario.duration_s, max(scenario.auvs.speeds)
    off, way = straight_drift_rms(scenario, time), speed * time
    said = (
        f"On a straight way of {way:.4g} m ({time:g} s at {speed:g} m/s) dead reckoning alone goes "
        f"{off:.3g} m (RMS) astray, {100.0 * off / way:.3g} % of the distance travelled"
    )
    drift, sensors = scenario.navigation.drift, own_sensors(scenario)
    if not drift.is_stated:
        return f"{said}."
    if sensors.bias_sd_m_per_s == 0.0:
        drawn = (
            f"a scale factor of {100 * sensors.scale_factor_sd:.3g} % and a heading error of "
            f"{sensors.heading_sd_deg:.3g} deg"
        )
    else:
        lasts = sensors.bias_time_constant_s
        wanders = "" if lasts is None else f" that wanders in {lasts:.4g} s"
        drawn = f"a velocity bias of {sensors.bias_sd_m_per_s:.3g} m/s per axis{wanders}"
    return (
        f"{said}: its sheet's {drift.told} is {drawn} (standard deviations), drawn for each AUV "
        "and seed."
    )
