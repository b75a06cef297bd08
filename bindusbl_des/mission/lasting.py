"""Errors of instruments and clocks that last through a mission, and what is told of them."""

import math
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

from ..core.plugins import is_plugin
from ..core.streams import Purpose, Streams
from ..records.rows import NONE
from ..scenario.scenario import Scenario
from ..scenario.usbl_keys import MOST_TOLD
from ..usbl.systematic import SYSTEMATIC, Systematic
from .closed_loop import Array, slow_gnss


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
        Kind("misalignment", (math.radians(usbl.misalignment_sd_deg),), arrays),
        Kind("gnss", (usbl.gnss_correlated_sd_m,) * 2, asvs, usbl.gnss_time_constant_s),
        Kind("sound_speed", (abs(sound_speed_error(scenario)),), 1),
        Kind("clock", (0.0, 0.0) if scenario.protocol.ranging == "twtt" else clock, 1),
    ]
    return [kind for kind in found if any(kind.sds)]


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
    water = scenario.environment
    return 1.0 - water.sound_speed_m_per_s / water.fleets_sound_speed


def misalignments(scenario: Scenario, streams: Streams) -> Array:
    """Return the constant error of the heading of each ASV (rad), (m,); with passive ranging of
    each AUV (n,), which carries the array.
    """
    carriers = scenario.auvs if scenario.protocol.is_passive else scenario.asvs
    sd, count = math.radians(scenario.usbl.misalignment_sd_deg), carriers.count
    if sd == 0.0:
        return np.zeros(count)
    drawn = [streams.of(Purpose.MISALIGNMENT, it).standard_normal() for it in range(count)]
    return np.asarray(sd * np.array(drawn))


def clocks(scenario: Scenario, streams: Streams) -> Array:
    """Return how late (s) each AUV's clock is at first, and how much later each second, (n, 2)."""
    navigation, count = scenario.navigation, scenario.auvs.count
    sds = np.array((navigation.clock_offset_sd_s, navigation.clock_drift_sd))
    if not sds.any():
        return np.zeros((count, 2))
    drawn = [streams.of(Purpose.CLOCK, auv).standard_normal(2) for auv in range(count)]
    return np.asarray(sds * np.array(drawn))


def lasting_errors(scenario: Scenario, streams: Streams) -> Systematic | None:
    """Return the errors that last, None if there are none of them.

    Fixes say how they depend on those that navigators are told of.
    """
    usbl, found = scenario.usbl, {kind.name: kind for kind in kinds(scenario)}
    has_outliers = usbl.outlier_share > 0.0
    if is_plugin(usbl.model) or not (found or has_outliers):
        return None
    levels, variances = np.zeros(1, dtype=SYSTEMATIC), list[float]()
    known = levels[0]
    for name in ("misalignment", "gnss", "sound_speed", "clock"):
        known[f"{name}_at"] = NONE
    for kind in told_of(scenario):
        known[f"{kind.name}_at"] = len(variances)
        variances += [sd**2 for sd in kind.sds] * kind.times
    one, two = {name: kind.sds for name, kind in found.items()}, (0.0, 0.0)
    gnss = one.get("gnss", two)
    known["sd"] = (*one.get("misalignment", (0.0,)), *gnss, *gnss, *one.get("sound_speed", (0.0,)))
    known["clock_offset_sd_s"], known["clock_drift_sd"] = one.get("clock", two)
    if has_outliers:
        known["outliers_below"] = NormalDist().inv_cdf(usbl.outlier_share)
        known["outlier_sd_m"] = usbl.outlier_sd_m
    return Systematic(
        levels,
        np.array(variances),
        misalignments(scenario, streams),
        slow_gnss(scenario, streams),
        clocks(scenario, streams),
    )
