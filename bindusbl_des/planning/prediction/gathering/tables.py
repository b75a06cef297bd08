"""What depends on a distance alone, looked up at even steps: chances, and the noise of a fix."""

import math

import numpy as np
from numpy.typing import NDArray

from ....acoustics.channel import between
from ....acoustics.fix_chance import below, frame_chance, ping_chance
from ....acoustics.loss import losses
from ....acoustics.named_channels import hf_channel, loss_of
from ....core.compiled import compiled
from ....core.plugins import is_plugin
from ....mission.build import usbl_of
from ....records.rows import Rows
from ....scenario.declared import channel_named, ranging_of
from ....scenario.instruments.own_sensors import own_sensors
from ....scenario.scenario import Scenario
from ....scenario.survey_area import area_of
from ....usbl.array import NOTHING, dot, turned
from ....usbl.instrument import NOISE_WIDTH, Instrument, path_sd, placed, spread_sd
from ..parts import Chances, FixNoise

Floats = NDArray[np.float64]

# Steps of a table, and how far it reaches: so many times the farthest that matters.
STEPS, FARTHER = 400, 1.25


def farthest_of(scenario: Scenario) -> float:
    """Return how far (m) tables reach: across the survey and the formation, or twice the range."""
    hf, mf, area = scenario.acoustics.hf, scenario.acoustics.mf, area_of(scenario)
    return FARTHER * max(2.0 * hf.range_m, mf.range_m, 1.5 * area.across)


def hf_chances(scenario: Scenario) -> Chances:
    """Return how likely a ping is decoded by one array."""
    hf, farthest = scenario.acoustics.hf, farthest_of(scenario)
    ranges = np.linspace(0.0, farthest, STEPS + 1)
    is_cut = channel_named(hf.channel).ends_at_range or is_plugin(hf.channel)
    chances = ping_chance(scenario, ranges, scenario.survey.deepest)
    if chances is None:
        chances = 1.0 - losses(ranges, *loss_of(scenario))
    return Chances(hf.range_m, is_cut, hf.range_metric == "slant", ranges[1], chances)


def mf_chances(scenario: Scenario) -> Chances:
    """Return how likely an AUV decodes a frame with the fixes of all."""
    mf, farthest = scenario.acoustics.mf, farthest_of(scenario)
    is_cut = channel_named(mf.channel).ends_at_range or is_plugin(mf.channel)
    ranges = np.linspace(0.0, farthest, STEPS + 1)
    chances = frame_chance(scenario, ranges, scenario.survey.deepest)
    if chances is None:
        chances = np.ones(len(ranges))
    return Chances(mf.range_m, is_cut, not is_cut, ranges[1], chances)


def fix_noise(scenario: Scenario) -> FixNoise:
    """Return what a fix of each AUV by one array errs by, at its depth.

    The arrays that ship resolve all azimuths alike; of an instrument of one's own nobody knows, so
    that the default array stands in for it.
    """
    farthest, away = farthest_of(scenario), np.linspace(0.0, farthest_of(scenario), STEPS + 1)
    survey, count = scenario.survey, scenario.auvs.count
    hf = scenario.acoustics.hf
    channel = None if is_plugin(hf.channel) else hf_channel(scenario)
    rows: dict[float, Floats] = {}
    usbl = usbl_of(scenario)
    (array, metric, levels), has_sheet = usbl.handed, usbl.has_sheet
    for depth in {survey.depth(auv) for auv in range(count)}:
        snr = np.full(len(away), math.nan)
        if channel is not None:
            asked = between(0.0, *below(np.hypot(away, depth), depth), hf.range_m, calling=False)
            snr = np.ascontiguousarray(channel.prospects(asked)["snr_db"][:, 0])
        moved = _moved_m2(scenario)
        rows[depth] = _variances(
            away, depth, snr, moved, scenario.navigation.weighs, array, metric, levels, has_sheet
        )
    own = np.stack([rows[survey.depth(auv)] for auv in range(count)])
    step = farthest / STEPS
    return FixNoise(step, *(np.ascontiguousarray(own[:, :, k]) for k in range(4)))


def _moved_m2(scenario: Scenario) -> float:
    """Return the variance (m2) of the way between a call and its answer; below 0: none calls.

    A filter that weighs fixes knows that way by dead reckoning, but for the walk meanwhile.
    """
    protocol = scenario.protocol
    if not ranging_of(scenario).calls:
        return -1.0
    lasts = scenario.acoustics.hf.ping_s + protocol.turnaround_s
    if scenario.navigation.weighs:
        return own_sensors(scenario).random_walk_m_per_sqrt_s ** 2 * lasts
    speed = 0.0 if scenario.auvs.route.kind == "hold" else max(scenario.auvs.speeds)
    return (speed * lasts) ** 2 / 2


@compiled
def _variances(
    away: Floats, depth: float, snr_db: Floats, moved: float, weighs: bool,
    array: Floats, metric: Floats, levels: Rows, has_sheet: bool | None,
) -> Floats:  # fmt: skip
    """Return the variances along, across and down, and the covariance of along and down (g, 4), m2,
    of fixes at horizontal distances (g,), m, and a depth (m).

    Of the path of a call and its answer, which an AUV has `moved` on (m2) meanwhile, half is the
    range.  A filter that `weighs` them knows the direction better than one fix, and so how far away
    an AUV is as well as the range itself is known (:mod:`....navigation.turning`).
    """
    instrument = Instrument(array, metric, levels[0], has_sheet)
    out, none, believed = np.empty((away.size, 4)), np.zeros(NOISE_WIDTH), np.eye(3)
    for k in range(away.size):
        reach = max(math.hypot(away[k], depth), 1e-3)
        unit = away[k] / reach, 0.0, depth / reach
        ranging_sd = path_sd(reach, instrument.levels)
        if moved >= 0.0:
            ranging_sd = 0.5 * math.sqrt(path_sd(2.0 * reach, instrument.levels) ** 2 + moved)
        _, spread = placed(NOTHING, unit, believed, reach, ranging_sd, snr_db[k], none, instrument)
        if weighs:
            own = instrument.levels.gnss_sd_m**2 + spread_sd(reach, instrument.levels) ** 2
            bent = dot(turned(spread, unit), unit) - ranging_sd**2 - own
            for i in range(3):
                for j in range(3):
                    spread[i, j] -= bent * unit[i] * unit[j]
        out[k, 0], out[k, 1] = spread[0, 0], spread[1, 1]
        out[k, 2], out[k, 3] = spread[2, 2], spread[0, 2]
    return out
