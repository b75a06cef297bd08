"""What navigators assume of the AUVs' own sensors, and of errors that fixes have in common.

They know the standard deviations of a scenario's errors, not the values drawn.  Settings of filters
that weigh fixes override them.
"""

import math
from typing import NamedTuple

import numpy as np

from ..scenario.families import NAVIGATOR
from ..scenario.own_sensors import OwnSensors, Sensors
from ..scenario.part_choice import settings_of as read
from ..scenario.sections.navigation import Navigation
from ..scenario.shipped_settings import Kalman
from .belief import STATES, Belief, Beliefs, Growth, Growths, first_belief
from .team import Common, PeerErrors

# Errors in fixes that each AUV has alone
OF_ONE_AUV = ("clock", "slow")

# Longest step in which a bias that rotates with the body is carried, per its time constant
SHARE_AT_A_TIME = 1.0 / 16.0


class Further(NamedTuple):
    """States of a belief after the first six: their standard deviations and time constants (s)."""

    sds: tuple[float, ...]
    time_constants: tuple[float, ...]


NO_STATES = Further((), ())


def assumed(setup: Sensors) -> tuple[Beliefs, Growths]:
    """Return the first belief of each AUV's navigator, and its growth.

    All have the same states: an error that only other AUVs have is a state that is exactly 0.
    """
    navigation = setup.scenario.navigation
    settings, asvs_ping = settings_of(navigation), setup.scenario.protocol.asvs_ping
    walk, common = settings.random_walk_m_per_sqrt_s, _common(setup)
    kinds = dict.fromkeys(setup.sensors)
    skews = {own: _skew(setup, own) for own in kinds}
    wanderings = {own: _wandering(setup, own) for own in kinds}
    # an AUV without such an error has its states, too, with standard deviations of 0
    some_skew, some_wandering = (
        next((part for part in parts.values() if part.sds), NO_STATES)
        for parts in (skews, wanderings)
    )
    found = {}
    for own in kinds:
        skew, wandering = skews[own], wanderings[own]
        first, growth = beginning(
            _start(navigation),
            _bias(setup, own),
            (own.random_walk_m_per_sqrt_s if walk is None else walk) ** 2,
            *_current(setup),
            in_body=navigation.bias_frame == "body",
            skew=skew if skew.sds else Further((0.0,) * len(some_skew.sds), some_skew[1]),
            wandering=wandering
            if wandering.sds
            else Further((0.0,) * len(some_wandering.sds), some_wandering[1]),
            common=common,
        )
        if not wandering.sds:
            growth = growth._replace(step=math.inf)
        # arrays, which are the first in common, may be turned by what is estimated
        if any(kind.name == "misalignment" for kind in setup.estimated_errors):
            arrays = len(first.state) - len(common.sds)
            growth = growth._replace(
                aligned=arrays if asvs_ping else 0, misaligned=0 if asvs_ping else arrays
            )
        if growth.aligned and growth.stretched:  # the compass that turns the way turns the array
            turn = growth.stretched + 1
            both = first.covariance[turn, turn]
            first.covariance[turn, growth.aligned] = first.covariance[growth.aligned, turn] = both
        found[own] = first, growth
    each = [found[own] for own in setup.sensors]
    beliefs = Beliefs(
        np.concatenate([first.moment for first, _ in each]),
        np.stack([first.state for first, _ in each]),
        np.stack([first.covariance for first, _ in each]),
    )
    alike = each[0][1]
    return beliefs, Growths(
        np.array([growth.walk for _, growth in each], dtype=np.float64),
        float(alike.wander),
        alike.in_body,
        alike.stretched,
        alike.wandering,
        np.stack([growth.sds for _, growth in each]),
        np.stack([growth.time_constants for _, growth in each]),
        np.array([growth.step for _, growth in each]),
        alike.aligned,
        alike.misaligned,
    )


def beginning(
    start_sd: float,
    bias_sd: tuple[float, float],
    walk: float,
    current_sd: float = 0.0,
    wander: float = 0.0,
    *,
    in_body: bool,
    skew: Further = NO_STATES,
    wandering: Further = NO_STATES,
    common: Further = NO_STATES,
) -> tuple[Belief, Growth]:
    """Return a first belief, by standard deviations of position (m), both biases and current (m/s),
    and its growth, by variances per second of the walk (m2/s) and of the current (m2/s3); with
    further states: scale and rotation (`skew`), a wandering bias, and errors that fixes have in
    common.
    """
    parts = skew, wandering, common
    sds = [sd for part in parts for sd in part.sds]
    lasts = [time for part in parts for time in part.time_constants]
    longest = SHARE_AT_A_TIME * min((*wandering.time_constants, math.inf))
    growth = Growth(
        walk,
        wander,
        in_body,
        stretched=STATES if skew.sds else 0,
        wandering=STATES + len(skew.sds) if wandering.sds else 0,
        sds=np.array(sds, dtype=np.float64),
        time_constants=np.array(lasts, dtype=np.float64),
        step=longest if in_body else math.inf,
    )
    return first_belief(start_sd, bias_sd, current_sd, sds), growth


def common_to_all(setup: Sensors) -> Common:
    """Return the part of the first belief that all AUVs have in common: a velocity bias that is the
    same for all, a current, and the errors of ASVs and sound speed.
    """
    sensors, *others = dict.fromkeys(setup.sensors)
    drawn = sensors.bias_sd_m_per_s if sensors.bias_time_constant_s is None else 0.0
    share = [
        (given * sd) ** 2 / (given**2 + drawn**2) if given else 0.0
        for given, sd in zip(sensors.bias_m_per_s, _bias(setup, sensors), strict=True)
    ]
    if others:  # what AUVs with different sensors have in common is unknown
        share = [0.0, 0.0]
    current = _current(setup)[0] ** 2
    if setup.scenario.navigation.velocity == "over_ground":
        current = 0.0  # who misses it depends on the place
    own = 2 * any(_skew(setup, each).sds for each in (sensors, *others))
    own += 2 * any(_wandering(setup, each).sds for each in (sensors, *others))
    variances, driven = [0.0, 0.0, *share, current, current], [0.0] * STATES
    driven[4] = driven[5] = float(current > 0.0)
    variances, driven = [*variances, *[0.0] * own], [*driven, *[0.0] * own]
    for kind in setup.estimated_errors:
        is_common = kind.name not in OF_ONE_AUV
        variances += [sd**2 * is_common for sd in kind.sds * kind.times]
        driven += [float(is_common)] * len(kind.sds) * kind.times
    return Common(np.array(variances), np.array(driven))


def peer_errors(setup: Sensors) -> PeerErrors:
    """Return the errors in AUVs' measurements of each other that the filter knows of."""
    scenario, taken = setup.scenario, setup.taken.scenario
    peers, untold = scenario.navigation.peers, settings_of(scenario.navigation).untold
    assert peers is not None
    has_clock = peers.traits.ranges and not peers.traits.asks and "clock" not in untold
    navigation = taken.navigation
    turned = peers.bearing == "array" and "misalignment" not in untold
    return PeerErrors(
        navigation.clock_offset_sd_s if has_clock else 0.0,
        navigation.clock_drift_sd if has_clock else 0.0,
        math.radians(taken.usbl.misalignment_sd_deg) if turned else 0.0,
    )


def columns_of(setup: Sensors) -> dict[str, int]:
    """Return the index at which each kind of error that fixes have in common begins among these."""
    found, column = dict[str, int](), 0
    for kind in setup.estimated_errors:
        found[kind.name] = column
        column += len(kind.sds) * kind.times
    return found


def settings_of(navigation: Navigation) -> Kalman:
    """Return the settings of a filter that weighs fixes; the defaults for any other."""
    chosen = navigation.filter
    settings: Kalman = read(NAVIGATOR, chosen) if navigation.weighs else Kalman()
    return settings


def _start(navigation: Navigation) -> float:
    """Return the standard deviation (m) per axis of the AUVs' start."""
    settings = settings_of(navigation)
    if settings.initial_position_sd_m is not None:
        return settings.initial_position_sd_m
    is_known = "initial_position" not in settings.untold
    return navigation.initial_position_sd_m if is_known else 0.0


def _bias(setup: Sensors, sensors: OwnSensors) -> tuple[float, float]:
    """Return the standard deviations (m/s) of the constant velocity bias along both axes."""
    settings = settings_of(setup.scenario.navigation)
    if (sd := settings.velocity_bias_sd_m_per_s) is not None:
        return sd, sd
    if "velocity_bias" in settings.untold:
        return 0.0, 0.0
    x, y = sensors.bias_m_per_s
    drawn = sensors.bias_sd_m_per_s if sensors.bias_time_constant_s is None else 0.0
    return math.hypot(x, drawn), math.hypot(y, drawn)


def _wandering(setup: Sensors, sensors: OwnSensors) -> Further:
    """Return the states of a velocity bias (m/s) that wanders, if it does."""
    settings = settings_of(setup.scenario.navigation)
    sd, lasts = sensors.bias_sd_m_per_s, sensors.bias_time_constant_s
    if sd == 0.0 or lasts is None or "velocity_bias" in settings.untold:
        return NO_STATES
    return Further((sd, sd), (lasts, lasts))


def _skew(setup: Sensors, sensors: OwnSensors) -> Further:
    """Return the states that scale and rotate the path: a scale factor and a heading error psi.

    The heading error alone scales it by psi^2 / 2, whose RMS is sqrt(3) / 2 sd^2.
    """
    untold = settings_of(setup.scenario.navigation).untold
    scale = 0.0 if "scale_factor" in untold else sensors.scale_factor_sd
    turned = 0.0 if "heading" in untold else math.radians(sensors.heading_sd_deg)
    if scale == turned == 0.0:
        return NO_STATES
    return Further((math.hypot(scale, math.sqrt(0.75) * turned**2), turned), (math.inf, math.inf))


def _common(setup: Sensors) -> Further:
    """Return the states of errors that fixes have in common."""
    kinds = setup.estimated_errors
    sds = [sd for kind in kinds for sd in kind.sds * kind.times]
    lasts = [kind.time_constant_s for kind in kinds for _ in range(len(kind.sds) * kind.times)]
    return Further(tuple(sds), tuple(lasts))


def _current(setup: Sensors) -> tuple[float, float]:
    """Return the standard deviation (m/s) per axis of the current that dead reckoning misses, and
    its short-term variance per second (m2/s3): of a Gauss-Markov process, and of the field of the
    current along AUVs' paths.
    """
    navigation = setup.scenario.navigation
    if navigation.velocity == "over_ground" and navigation.dvl_range_m is None:
        return 0.0, 0.0
    missed = setup.missed
    if missed is None or "current" in settings_of(navigation).untold:
        return 0.0, 0.0
    varies, lasts = missed.varies_m_per_s, missed.lasts_s
    steady = math.hypot(missed.speed_m_per_s, varies)
    sd, wander = math.hypot(steady, missed.flow.rms_m_per_s), 2 * varies**2 / lasts
    return sd, wander + missed.flow.wander
