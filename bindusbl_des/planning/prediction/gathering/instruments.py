"""The errors of a scenario's instruments as a prediction takes them: of AUVs' own and of fixes."""

from math import cos, hypot, radians, sin, sqrt

from ....core.plugins import is_plugin
from ....mission.told import told_to
from ....scenario.instruments.lasting_kinds import kinds, told_of
from ....scenario.instruments.own_sensors import OwnSensors, own_sensors
from ....scenario.scenario import Scenario
from ..parts import Lasting, Navigator, Source


def lasting_of(scenario: Scenario) -> Lasting:
    """Return the errors that fixes have in common; a clock that drifts as it is half through."""
    found = {kind.name: kind.sds for kind in kinds(scenario)}
    offset, drift = found.get("clock", (0.0, 0.0))
    return Lasting(
        found.get("misalignment", (0.0,))[0],
        found.get("gnss", (0.0,))[0],
        scenario.usbl.gnss_time_constant_s,
        found.get("sound_speed", (0.0,))[0],
        hypot(offset, drift * float(scenario.duration_s) / 2),
        len(told_of(scenario)) == len(found),
    )


def navigator_of(scenario: Scenario) -> Navigator:
    """Return how the AUVs of a scenario navigate; a filter of one's own is taken for Kalman's."""
    navigation, sensors = scenario.navigation, own_sensors(scenario)
    own = is_plugin(navigation.filter)
    first, growth = told_to(scenario)
    told = [sqrt(first.covariance[k, k]) for k in range(len(first.state))]
    sources = [
        *_bias(scenario, sensors, (told[2], told[3])),
        *_current(scenario, told[4], growth.wander),
        *_wandering(scenario, sensors, growth.wandering > 0),
        *_skew(sensors, (told[6], told[7]) if growth.stretched > 0 else (0.0, 0.0)),
    ]
    return Navigator(
        "kalman" if own else str(navigation.filter),
        navigation.fixed_gain.gain,
        navigation.weighs or own or navigation.fixed_gain.delay_compensation == "shift",
        navigation.initial_position_sd_m,
        told[0],
        sensors.random_walk_m_per_sqrt_s**2,
        growth.walk,
        tuple(sources),
    )


def _bias(scenario: Scenario, sensors: OwnSensors, told: tuple[float, float]) -> list[Source]:
    drawn = 0.0 if sensors.bias_time_constant_s is not None else sensors.bias_sd_m_per_s
    mean = sensors.bias_m_per_s
    if not any((*mean, drawn, *told)):
        return []
    return [Source(scenario.navigation.bias_frame, mean, (drawn, drawn), told)]


def _current(scenario: Scenario, told: float, wander: float) -> list[Source]:
    """Return the current as one more velocity that dead reckoning through the water misses."""
    water = scenario.environment
    if scenario.navigation.velocity == "over_ground" or not told:
        return []
    heading, speed = radians(water.current_direction_deg), water.current_m_per_s
    mean, varies = (-speed * cos(heading), -speed * sin(heading)), water.current_variation_m_per_s
    lasts = None if wander else water.current_variation_time_s if varies else None
    return [Source("world", mean, (varies, varies), (told, told), lasts, wander)]


def _wandering(scenario: Scenario, sensors: OwnSensors, is_told: bool) -> list[Source]:
    sd, lasts = sensors.bias_sd_m_per_s, sensors.bias_time_constant_s
    if not sd or lasts is None:
        return []
    told = sd if is_told else 0.0
    return [Source(scenario.navigation.bias_frame, (0.0, 0.0), (sd, sd), (told, told), lasts)]


def _skew(sensors: OwnSensors, told: tuple[float, float]) -> list[Source]:
    turned = radians(sensors.heading_sd_deg)
    if not sensors.scale_factor_sd and not turned:
        return []
    return [Source("way", (0.0, 0.0), (sensors.scale_factor_sd, turned), told)]
