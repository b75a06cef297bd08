"""What AUVs carry: dead reckoning with its errors, and the navigator that corrects it."""

import math

import numpy as np
from numpy.typing import NDArray

from ..core.plugins import is_plugin
from ..navigation.belief import Belief, Growth, first_belief
from ..navigation.dead_reckoning import DeadReckoning
from ..navigation.navigators import LinearNavigator, Navigator, Rule
from ..navigation.own_navigator import OwnNavigator
from ..navigation.smoother import Smoother
from ..navigation.weighing import WEIGHED
from ..records.recorder import Levers
from ..records.rows import LEARNT
from ..scenario.families import NAVIGATOR
from ..scenario.lasting_kinds import told_of
from ..scenario.part_settings import own_part
from ..scenario.scenario import Scenario
from ..vehicles.fleet import Fleet
from ..vehicles.reckoning import Wrong

Array = NDArray[np.float64]


def equip_auvs(
    scenario: Scenario, fleet: Fleet, wrong: Wrong, levers: Levers
) -> tuple[DeadReckoning, Navigator]:
    """Return what the AUVs carry: dead reckoning, and navigators by which some of them steer.

    `levers` tell how fixes depend on errors that last.
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
        return reckoning, OwnNavigator(navigation.filter, make, reckoning, steering[0])
    growth, first = _growth(scenario), _first_belief(scenario)
    navigator = LinearNavigator(reckoning, _rule(scenario), growth, first, *steering)
    navigator.common = levers
    if navigation.filter != "smoother":
        return reckoning, navigator
    lag = navigation.filter.settings.get("lag_s")
    return reckoning, Smoother(navigator, reckoning, growth, first, lag)


def _rule(scenario: Scenario) -> Rule:
    """Return how fixes are weighed."""
    navigation = scenario.navigation
    if navigation.weighs:
        return Rule(WEIGHED, at_ping=True, gate=navigation.nis_gate or 0.0)
    gain = navigation.gain if navigation.filter == "fixed_gain" else 0.0
    return Rule(gain, at_ping=navigation.delay_compensation == "shift", gate=0.0)


def _growth(scenario: Scenario) -> Growth:
    """Return how dead reckoning becomes unsure, as its own sensors' sheets say."""
    navigation, water = scenario.navigation, scenario.environment
    wander = 0.0
    if navigation.velocity == "through_water":  # a Gauss-Markov current, as far as it is short-term
        wander = 2 * water.current_variation_m_per_s**2 / water.current_variation_time_s
    sds, time_constants = _common_states(scenario)
    return Growth(
        navigation.random_walk_m_per_sqrt_s**2, wander, navigation.bias_frame == "body",
        sds=sds, time_constants=time_constants,
    )  # fmt: skip


def _common_states(scenario: Scenario) -> tuple[Array, Array]:
    """Return the standard deviations and time constants (s) of errors that fixes have in common."""
    kinds = told_of(scenario)
    sds = [sd for kind in kinds for sd in kind.sds * kind.times]
    lasts = [kind.time_constant_s for kind in kinds for _ in range(len(kind.sds) * kind.times)]
    return np.array(sds, dtype=np.float64), np.array(lasts, dtype=np.float64)


def _first_belief(scenario: Scenario) -> Belief:
    """Return what AUVs believe at the start: that nothing is wrong, as surely as it may be so."""
    navigation, water = scenario.navigation, scenario.environment
    x, y = navigation.velocity_bias_m_per_s
    sd = navigation.velocity_bias_sd_m_per_s
    current = 0.0
    if navigation.velocity == "through_water":
        current = math.hypot(water.current_m_per_s, water.current_variation_m_per_s)
    return first_belief(
        navigation.initial_position_sd_m, (math.hypot(x, sd), math.hypot(y, sd)), current,
        _common_states(scenario)[0].tolist(),
    )  # fmt: skip
