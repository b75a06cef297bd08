"""What depends on a distance alone, looked up at even steps: chances, and the noise of a fix."""

import math

import numpy as np
from numpy.typing import NDArray

from ....acoustics.channel import AskedChannel, between
from ....acoustics.loss import LossTerms, loss_probability
from ....acoustics.modem import messages_of
from ....acoustics.named_channels import hf_channel, loss_of, mf_channel
from ....core.compiled import entry
from ....core.plugins import is_plugin
from ....mission.build import usbl_of
from ....records.rows import Rows
from ....scenario.scenario import Scenario
from ....scenario.survey_area import area_of
from ....usbl.instrument import NOISE_WIDTH, Instrument, placed
from ....usbl.sheet import path_sd
from ....usbl.vectors import NOTHING
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
    channel = None if is_plugin(hf.channel) else hf_channel(scenario)
    if channel is None:
        terms = loss_of(scenario)
        lost = _lost(ranges, terms.coefficients, *terms[1:])
        is_cut, chances = True, 1.0 - lost
    else:
        is_cut = False
        chances = _decoded(channel, ranges, scenario.survey.deepest, hf.range_m, False)["chance"]
    return Chances(hf.range_m, is_cut, hf.range_metric == "slant", ranges[1], chances)


def mf_chances(scenario: Scenario) -> Chances:
    """Return how likely an AUV decodes a frame with the fixes of all."""
    mf, farthest = scenario.acoustics.mf, farthest_of(scenario)
    channel = None if is_plugin(mf.channel) else mf_channel(scenario)
    ranges = np.linspace(0.0, farthest, STEPS + 1)
    if channel is None:
        return Chances(mf.range_m, True, False, ranges[1], np.ones(len(ranges)))
    messages = messages_of(scenario)
    fixes = messages.of(scenario.auvs.count)[0]
    asked = channel(messages.payload_bytes(fixes), messages.airtime(fixes))
    chances = _decoded(asked, ranges, scenario.survey.deepest, mf.range_m, True)["chance"]
    return Chances(mf.range_m, False, True, ranges[1], chances)


def _decoded(
    channel: AskedChannel, slants: Floats, depth: float, reach: float, calling: bool
) -> dict[str, Floats]:
    """Return the chance and the SNR (dB) of a signal over slant ranges (m) to a depth (m)."""
    level = np.sqrt(np.maximum(slants**2 - depth**2, 0.0))
    auvs = np.column_stack((level, np.zeros(len(level)), np.full(len(level), depth)))
    told = channel.prospects(between(0.0, auvs, np.zeros((1, 3)), reach, calling))[:, 0]
    return {"chance": 1.0 - told["loss"], "snr": np.ascontiguousarray(told["snr_db"])}


@entry
def _lost(ranges: Floats, coefficients: Floats, combine: int, more: float, cap: float) -> Floats:
    out = np.empty(ranges.size)
    for k in range(ranges.size):
        out[k] = loss_probability(ranges[k], LossTerms(coefficients, combine, more, cap))
    return out


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
            snr = _decoded(channel, np.hypot(away, depth), depth, hf.range_m, False)["snr"]
        moved = _moved_m2(scenario)
        rows[depth] = _variances(away, depth, snr, moved, array, metric, levels, has_sheet)
    own = np.stack([rows[survey.depth(auv)] for auv in range(count)])
    step = farthest / STEPS
    return FixNoise(step, *(np.ascontiguousarray(own[:, :, k]) for k in range(4)))


def _moved_m2(scenario: Scenario) -> float:
    """Return the variance (m2) of the way between a call and its answer; below 0: none calls."""
    protocol = scenario.protocol
    if protocol.ranging != "twtt":
        return -1.0
    lasts = scenario.acoustics.hf.ping_s + protocol.turnaround_s
    speed = 0.0 if scenario.auvs.route.kind == "hold" else max(scenario.auvs.speeds)
    return (speed * lasts) ** 2 / 2


@entry
def _variances(
    away: Floats, depth: float, snr_db: Floats, moved: float,
    array: Floats, metric: Floats, levels: Rows, has_sheet: bool | None,
) -> Floats:  # fmt: skip
    """Return the variances along, across and down, and the covariance of along and down (g, 4), m2,
    of fixes at horizontal distances (g,), m, and a depth (m).

    Of the path of a call and its answer, which an AUV has `moved` on (m2) meanwhile, half is the
    range.
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
        out[k, 0], out[k, 1] = spread[0, 0], spread[1, 1]
        out[k, 2], out[k, 3] = spread[2, 2], spread[0, 2]
    return out
