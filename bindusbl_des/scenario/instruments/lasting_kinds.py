"""Which errors of instruments and clocks last through a mission, and who is told of them."""

import math
from typing import NamedTuple

from ...core.plugins import is_plugin
from ..scenario import Scenario, kept
from ..water import assumed_sound_speed_of, sound_speed_of
from .own_sensors import own_sensors

# Vessels whose own errors a filter is told of: each has up to three states in every AUV
MOST_TOLD = 16


class Kind(NamedTuple):
    """Errors of one kind that last: the standard deviations (rad, m, 1, s and s/s) of those of one
    vessel, how many times these are there, and their time constant (s).
    """

    name: str
    sds: tuple[float, ...]
    times: int
    time_constant_s: float = math.inf


def kinds(scenario: Scenario) -> list[Kind]:
    """Return the kinds of lasting errors that fixes of a scenario have, in the order of J."""
    usbl, asvs = scenario.usbl, scenario.asvs.count
    arrays = 1 if scenario.protocol.is_passive else asvs  # that a fix may be of: else one's own
    clock = scenario.navigation.clock_offset_sd_s, scenario.navigation.clock_drift_sd
    found = [
        Kind("misalignment", (misalignment_sd(scenario),), arrays),
        Kind("gnss", (usbl.gnss_correlated_sd_m,) * 2, asvs, usbl.gnss_time_constant_s),
        Kind("sound_speed", (abs(sound_speed_error(scenario)),), 1),
        Kind("clock", (0.0, 0.0) if scenario.protocol.ranging == "twtt" else clock, 1),
    ]
    return [kind for kind in found if any(kind.sds)]


def misalignment_sd(scenario: Scenario) -> float:
    """Return the standard deviation (rad) of the constant error by which directions are turned:
    that of the array, with passive ranging also of the AUV's compass.
    """
    compass = own_sensors(scenario).heading_sd_deg if scenario.protocol.is_passive else 0.0
    return math.radians(math.hypot(scenario.usbl.misalignment_sd_deg, compass))


@kept
def told_of(scenario: Scenario) -> list[Kind]:
    """Return the kinds of lasting errors that navigators are told of, to estimate them.

    They are none of filters that do not weigh, nor of those that somebody leaves `untold`; and
    with more than MOST_TOLD ASVs none of each of these, which would be too many states.
    """
    chosen = scenario.navigation.filter
    if not scenario.navigation.weighs or is_plugin(scenario.usbl.model):
        return []
    untold = chosen.settings.get("untold", ())
    return [it for it in kinds(scenario) if it.name not in untold and it.times <= MOST_TOLD]


def sound_speed_error(scenario: Scenario) -> float:
    """Return the share of a range by which it is measured too long, by the sound speed assumed."""
    return 1.0 - sound_speed_of(scenario) / assumed_sound_speed_of(scenario)
