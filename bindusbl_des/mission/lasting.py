"""Errors of instruments and clocks that last through a mission, drawn once for each vehicle."""

import math
from statistics import NormalDist

import numpy as np

from ..core.plugins import is_plugin
from ..core.streams import Purpose, Streams
from ..records.rows import NONE
from ..scenario.instruments.lasting_kinds import kinds, told_of
from ..scenario.scenario import Scenario
from ..usbl.systematic.errors import SYSTEMATIC, Systematic
from .closed_loop import Array, slow_gnss
from .own_errors import headings


def misalignments(scenario: Scenario, streams: Streams) -> Array:
    """Return the constant error of the heading of each ASV (rad), (m,); with passive ranging of
    each AUV (n,), which carries the array and turns what it measures by its own compass.
    """
    passive = scenario.protocol.is_passive
    turned = headings(scenario, streams) if passive else np.zeros(scenario.asvs.count)
    sd = math.radians(scenario.usbl.misalignment_sd_deg)
    if sd == 0.0:
        return turned
    drawn = [streams.of(Purpose.MISALIGNMENT, it).standard_normal() for it in range(len(turned))]
    return np.asarray(turned + sd * np.array(drawn))


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
        np.ascontiguousarray(misalignments(scenario, streams)),
        slow_gnss(scenario, streams),
        clocks(scenario, streams),
    )
