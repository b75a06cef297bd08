"""What AUVs carry: dead reckoning with its errors, and the navigator that corrects it."""

import numpy as np

from ..core.plugins import is_plugin
from ..navigation.dead_reckoning import DeadReckoning
from ..navigation.navigators import LinearNavigator, Navigator, OwnNavigator
from ..navigation.smoother import Smoother
from ..navigation.weighing import WEIGHED, Rule
from ..records.rows import LEARNT, Recorder
from ..scenario.families import NAVIGATOR, navigator_of
from ..scenario.part_settings import own_part
from ..scenario.scenario import Scenario
from ..vehicles.fleet import Fleet
from ..vehicles.reckoning import Wrong
from .told import told_to


def equip_auvs(
    scenario: Scenario, fleet: Fleet, wrong: Wrong, record: Recorder
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
        gnss = record.gnss_fixes
        return reckoning, OwnNavigator(navigation.filter, make, reckoning, steering[0], gnss)
    first, growth = told_to(scenario)
    navigator = LinearNavigator(
        reckoning,
        _rule(scenario),
        growth,
        first,
        *steering,
        record.levers,
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
