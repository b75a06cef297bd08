"""What navigators are told of AUVs' own sensors, and of what fixes have in common.

Of a scenario's errors they know how large these may be, and nothing of what was drawn.  Settings of
filters that weigh tell them something else.
"""

import math
from typing import NamedTuple

import numpy as np

from ..core.plugins import is_plugin
from ..navigation.belief import STATES, Belief, Growth, first_belief
from ..navigation.dead_reckoning import DeadReckoning
from ..navigation.fix_update import WEIGHED, Rule
from ..navigation.navigators import LinearNavigator, Navigator, OwnNavigator
from ..navigation.smoother import Smoother
from ..records.rows import LEARNT, Recorder
from ..scenario.agreement.instruments import taken_for
from ..scenario.families import NAVIGATOR, navigator_of
from ..scenario.own_sensors import estimated_kinds, own_sensors
from ..scenario.part_choice import own_part, shipped_part
from ..scenario.scenario import Scenario, kept
from ..scenario.shipped_settings import Kalman
from ..vehicles.fleet import VehicleFleet
from ..vehicles.reckoning import Wrong

# By this share of its time constant, at most, a bias that turns with the body is carried at a time.
SHARE_AT_A_TIME = 1.0 / 16.0


class Further(NamedTuple):
    """States of a belief after the first six: their standard deviations and time constants (s)."""

    sds: tuple[float, ...]
    time_constants: tuple[float, ...]


NONE = Further((), ())


@kept
def assumed_by(scenario: Scenario) -> tuple[Belief, Growth]:
    """Return what the navigators of a scenario believe at first, and how they become less sure."""
    scenario = taken_for(scenario)
    navigation, settings = scenario.navigation, settings_of(scenario)
    skew, wandering, common = _skew(scenario), _wandering(scenario), _common(scenario)
    parts = skew, wandering, common
    sds = [sd for part in parts for sd in part.sds]
    lasts = [time for part in parts for time in part.time_constants]
    in_body, walk = navigation.bias_frame == "body", settings.random_walk_m_per_sqrt_s
    arrays = STATES + len(skew.sds) + len(wandering.sds) if _has_arrays(scenario) else 0
    longest = SHARE_AT_A_TIME * min((*wandering.time_constants, math.inf))
    growth = Growth(
        (own_sensors(scenario).random_walk_m_per_sqrt_s if walk is None else walk) ** 2,
        _wander(scenario),
        in_body,
        stretched=STATES if skew.sds else 0,
        wandering=STATES + len(skew.sds) if wandering.sds else 0,
        sds=np.array(sds, dtype=np.float64),
        time_constants=np.array(lasts, dtype=np.float64),
        step=longest if in_body else math.inf,
        aligned=arrays if scenario.protocol.asvs_ping else 0,
        misaligned=0 if scenario.protocol.asvs_ping else arrays,
    )
    first = first_belief(_start(scenario), _bias(scenario), _current(scenario), sds)
    if growth.aligned and growth.stretched:  # the compass that turns the way turns the array too
        turn = growth.stretched + 1
        both = first.covariance[turn, turn]
        first.covariance[turn, growth.aligned] = first.covariance[growth.aligned, turn] = both
    return first, growth


def settings_of(scenario: Scenario) -> Kalman:
    """Return what somebody has told a filter that weighs; nothing for any other."""
    chosen = scenario.navigation.filter
    model = NAVIGATOR.settings[str(chosen)] if scenario.navigation.weighs else None
    settings: Kalman = shipped_part(NAVIGATOR, chosen, model)() if model else Kalman()
    return settings


def _start(scenario: Scenario) -> float:
    """Return the standard deviation (m) per axis of where AUVs start."""
    settings = settings_of(scenario)
    if settings.initial_position_sd_m is not None:
        return settings.initial_position_sd_m
    is_known = "initial_position" not in settings.untold
    return scenario.navigation.initial_position_sd_m if is_known else 0.0


def _bias(scenario: Scenario) -> tuple[float, float]:
    """Return the standard deviations (m/s) of the constant velocity bias along both axes."""
    sensors, settings = own_sensors(scenario), settings_of(scenario)
    if (sd := settings.velocity_bias_sd_m_per_s) is not None:
        return sd, sd
    if "velocity_bias" in settings.untold:
        return 0.0, 0.0
    x, y = sensors.bias_m_per_s
    drawn = sensors.bias_sd_m_per_s if sensors.bias_time_constant_s is None else 0.0
    return math.hypot(x, drawn), math.hypot(y, drawn)


def _wandering(scenario: Scenario) -> Further:
    """Return the states of a velocity bias (m/s) that wanders, if it does."""
    sensors, settings = own_sensors(scenario), settings_of(scenario)
    sd, lasts = sensors.bias_sd_m_per_s, sensors.bias_time_constant_s
    if sd == 0.0 or lasts is None or "velocity_bias" in settings.untold:
        return NONE
    return Further((sd, sd), (lasts, lasts))


def _skew(scenario: Scenario) -> Further:
    """Return the states that stretch and turn the way, by a scale factor and a heading error psi.

    The heading alone stretches it by psi^2 / 2, of which the root mean square is sqrt(3) / 2 sd^2.
    """
    sensors, untold = own_sensors(scenario), settings_of(scenario).untold
    scale = 0.0 if "scale_factor" in untold else sensors.scale_factor_sd
    turned = 0.0 if "heading" in untold else math.radians(sensors.heading_sd_deg)
    if scale == turned == 0.0:
        return NONE
    return Further((math.hypot(scale, math.sqrt(0.75) * turned**2), turned), (math.inf, math.inf))


def _common(scenario: Scenario) -> Further:
    """Return the states of errors that fixes have in common."""
    kinds = estimated_kinds(scenario)
    sds = [sd for kind in kinds for sd in kind.sds * kind.times]
    lasts = [kind.time_constant_s for kind in kinds for _ in range(len(kind.sds) * kind.times)]
    return Further(tuple(sds), tuple(lasts))


def _has_arrays(scenario: Scenario) -> bool:
    """Tell whether arrays, which are the first in common, may be turned by what is estimated."""
    return any(kind.name == "misalignment" for kind in estimated_kinds(scenario))


def _current(scenario: Scenario) -> float:
    """Return the standard deviation (m/s) per axis of a current that dead reckoning misses."""
    water = scenario.environment
    if scenario.navigation.velocity == "over_ground":
        return 0.0
    return math.hypot(water.current_m_per_s, water.current_variation_m_per_s)


def _wander(scenario: Scenario) -> float:
    """Return the variance per second (m2/s3) of that current, Gauss-Markov, in the short term."""
    water = scenario.environment
    if scenario.navigation.velocity == "over_ground":
        return 0.0
    return 2 * water.current_variation_m_per_s**2 / water.current_variation_time_s


# What AUVs carry: dead reckoning with its errors, and the navigator that corrects it.


def equip_auvs(
    scenario: Scenario, fleet: VehicleFleet, wrong: Wrong, record: Recorder
) -> tuple[DeadReckoning, Navigator]:
    """Return what the AUVs carry: dead reckoning, and navigators by which some of them steer.

    The record has what fixes are made of, and how they depend on errors that last.
    """
    navigation = scenario.navigation
    reckoning = DeadReckoning(fleet.motion, wrong)
    if fleet.poses is not None:
        fleet.poses.on_known = reckoning.follow
    elif fleet.foreseen:
        reckoning.follow(scenario.duration_s)
    if fleet.guided is None:
        steering = np.zeros((len(fleet), 2)), np.zeros(len(fleet), dtype=LEARNT)
    else:
        fleet.guided.has_learnt = navigation.weighs
        steering = fleet.guided.corrections, fleet.guided.learnt
    if is_plugin(navigation.filter):
        make = own_part(NAVIGATOR, navigation.filter)
        made = navigation.filter, make, reckoning, steering[0]
        return reckoning, OwnNavigator(*made, record.receptions, record.gnss_fixes)
    first, growth = assumed_by(scenario)
    navigator = LinearNavigator(
        reckoning,
        _rule(scenario),
        growth,
        first,
        *steering,
        record.jacobians,
        record.receptions,
        record.gnss_fixes,
    )
    if not navigator_of(scenario).is_smoother:
        return reckoning, navigator
    lag = navigation.filter.settings.get("lag_s")
    return reckoning, Smoother(navigator, reckoning, growth, first, lag)


def _rule(scenario: Scenario) -> Rule:
    """Return how fixes are weighed."""
    navigation = scenario.navigation
    if navigation.weighs:
        return Rule(WEIGHED, at_ping=True, gate=navigation.nis_gate or 0.0)
    gain = navigation.fixed_gain.gain if navigator_of(scenario).has_gain else 0.0
    return Rule(gain, at_ping=navigation.fixed_gain.delay_compensation == "shift", gate=0.0)
