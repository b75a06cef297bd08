"""What AUVs carry: dead reckoning with its errors, and the navigator that corrects it."""

import numpy as np

from ..acoustics.channel import PLAIN
from ..navigation.assumptions import columns_of, common_to_all, peer_errors
from ..navigation.dead_reckoning import DeadReckoning
from ..navigation.fix_update import WEIGHED, Rule
from ..navigation.navigators import LinearNavigator, Navigator, OwnNavigator
from ..navigation.range_rates import Rates
from ..navigation.smoother import Smoother
from ..navigation.team import Team
from ..records.rows import LEARNT, Recorder
from ..scenario.families import NAVIGATOR
from ..scenario.part_choice import own_part
from ..scenario.sections.navigation import Navigation
from ..setup import Setup
from ..vehicles.fleet import VehicleFleet
from ..vehicles.reckoning import Wrong


def equip_auvs(
    setup: Setup, fleet: VehicleFleet, wrong: Wrong, record: Recorder
) -> tuple[DeadReckoning, Navigator]:
    """Return what the AUVs carry: dead reckoning, and navigators by which some of them steer.

    The record has what fixes are made of, and how they depend on errors that last.
    """
    navigation = setup.scenario.navigation
    reckoning = DeadReckoning(fleet.motion, wrong)
    if fleet.poses is not None:
        fleet.poses.on_known = reckoning.follow
    elif fleet.foreseen:
        reckoning.follow(setup.scenario.duration_s)
    if fleet.guided is None:
        steering = np.zeros((len(fleet), 2)), np.zeros(len(fleet), dtype=LEARNT)
    else:
        fleet.guided.has_learnt = navigation.weighs
        steering = fleet.guided.corrections, fleet.guided.learnt
    if navigation.filter.is_own:
        make = own_part(NAVIGATOR, navigation.filter)
        made = navigation.filter, make, reckoning, steering[0]
        receiver = PLAIN if setup.ping_channel is None else setup.ping_channel.receiver
        fixes = record.receptions, record.gnss_fixes
        return reckoning, OwnNavigator(*made, *fixes, receiver.levels)
    first, growth = setup.beliefs
    made_of = (
        reckoning,
        _rule(navigation, setup.navigator.has_gain),
        growth,
        first,
        *steering,
        record.jacobians,
        record.receptions,
        record.gnss_fixes,
    )
    if navigation.peers is not None and len(fleet) > 1:
        return reckoning, Team(
            *made_of,
            fusion=navigation.peers.fusion,
            raw=navigation.peers.share == "raw",
            fleet=common_to_all(setup.taken),
            errors=peer_errors(setup),
            every_s=float(navigation.peers.every_s),
            sound_speed=setup.assumed_sound_speed_m_per_s,
            columns=columns_of(setup),
        )
    rates = _rates(setup) if navigation.filter.settings.get("range_rate") else None
    navigator = LinearNavigator(*made_of, rates)
    if not setup.navigator.is_smoother:
        return reckoning, navigator
    lag = navigation.filter.settings.get("lag_s")
    return reckoning, Smoother(navigator, reckoning, growth, first, lag)


def _rates(setup: Setup) -> Rates:
    """Return how range rates err that the filter takes in."""
    sd = setup.scenario.usbl.range_rate_sd_m_per_s or 0.0
    is_told = any(kind.name == "sound_speed" for kind in setup.estimated_errors)
    return Rates(sd**2, abs(setup.taken.sound_speed_error) if is_told else 0.0)


def _rule(navigation: Navigation, has_gain: bool) -> Rule:
    """Return how fixes are weighed."""
    if navigation.weighs:
        return Rule(WEIGHED, at_ping=True, gate=navigation.nis_gate or 0.0)
    gain = navigation.fixed_gain.gain if has_gain else 0.0
    return Rule(gain, at_ping=navigation.fixed_gain.delay_compensation == "shift", gate=0.0)
