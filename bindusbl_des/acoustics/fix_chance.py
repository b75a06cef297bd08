"""How likely a ping from a place makes a fix that its AUV gets: what a survey's coverage means."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..core.plugins import is_plugin
from ..scenario.scenario import Scenario
from ..scenario.survey_area import area_of
from .channel import AskedChannel, between
from .loss import LossTerms, loss_probability
from .modem import messages_of
from .named_channels import hf_channel, loss_of, mf_channel

Floats = NDArray[np.float64]

# The law of the disc's loss is looked up between so many ranges.
LOOKED_UP = 1001


class Grid(NamedTuple):
    """Square cells that cover a survey: their west, south, east and north (m), how many lie side by
    side, the middles (n, 3), m, of all at the survey's depth, row by row from south to north, and
    which of these lie inside (n,).
    """

    box: tuple[float, float, float, float]
    across: int
    middles: Floats
    inside: NDArray[np.bool_]


def survey_grid(scenario: Scenario, cells: int) -> Grid:
    """Return so many cells over the longer side of a survey, and those that the other takes."""
    area = area_of(scenario)
    box = area.box
    size = max(box.x_max - box.x_min, box.y_max - box.y_min) / cells
    across = max(round((box.x_max - box.x_min) / size), 1)
    along = max(round((box.y_max - box.y_min) / size), 1)
    east, north = box.x_min + across * size, box.y_min + along * size
    x, y = np.meshgrid(
        box.x_min + size * (np.arange(across) + 0.5), box.y_min + size * (np.arange(along) + 0.5)
    )
    depth = np.full(x.size, scenario.survey.deepest)
    middles = np.column_stack((x.ravel(), y.ravel(), depth))
    inside = area.contains(middles[:, :2])
    return Grid((box.x_min, box.y_min, east, north), across, middles, inside)


def fix_chance(scenario: Scenario, stations: ArrayLike, places: ArrayLike) -> Floats | None:
    """Return the probability (n,) that a ping from a place makes a fix which is delivered there.

    `places` (n, 3) are those of AUVs, `stations` (m, 2) those of ASVs at the surface, in m.  No
    other sound overlaps the ping, nor the call, the answer or the frame that belong to it; an AUV
    is called by its nearest ASV, and ASVs broadcast equally often where nothing fixes who does.
    None where a channel of somebody's own decides: it is not asked.
    """
    auvs = np.asarray(places, dtype=float)
    asvs = np.pad(np.asarray(stations, dtype=float), ((0, 0), (0, 1)))
    acoustics, protocol = scenario.acoustics, scenario.protocol
    replies = protocol.is_passive or protocol.downlink == "direct_reply"
    if is_plugin(acoustics.hf.channel) or (not replies and is_plugin(acoustics.mf.channel)):
        return None
    heard = _heard(scenario, auvs, asvs)
    if protocol.is_passive:
        return np.asarray(heard.mean(axis=1))
    located = 1.0 - (1.0 - heard).prod(axis=1)
    if protocol.calls:
        located *= heard[np.arange(len(auvs)), _apart(auvs, asvs).argmin(axis=1)]
    return np.asarray(located if replies else located * _told(scenario, auvs, asvs))


def _heard(scenario: Scenario, auvs: Floats, asvs: Floats) -> Floats:
    """Return how likely the ping of each AUV is decoded by each ASV (n, m)."""
    channel, hf = hf_channel(scenario), scenario.acoustics.hf
    if channel is not None:
        return _decoded(channel, auvs, asvs, hf.range_m)
    away = _apart(auvs, asvs)
    counted = away if hf.range_metric == "slant" else _apart(auvs, asvs, axes=2)
    lost = _lost(loss_of(scenario), away)
    return np.where(counted <= hf.range_m, 1.0 - lost, 0.0)


def _told(scenario: Scenario, auvs: Floats, asvs: Floats) -> Floats:
    """Return how likely each AUV decodes the frame with its fix (n,), whoever broadcasts it."""
    mf, rule = scenario.acoustics.mf, scenario.protocol.broadcaster
    channel, away = mf_channel(scenario), _apart(auvs, asvs, axes=2)
    if channel is None:
        decoded = (away <= mf.range_m).astype(float)
    else:
        messages = messages_of(scenario)
        fixes = messages.of(scenario.auvs.count)[0]
        asked = channel(messages.payload_bytes(fixes), messages.airtime(fixes))
        decoded = _decoded(asked, auvs, asvs, mf.range_m)
    if rule == "fixed":
        return np.asarray(decoded[:, rule.settings.get("asv", 0)])
    if rule in ("nearest", "parallel"):
        return np.asarray(decoded[np.arange(len(auvs)), away.argmin(axis=1)])
    return np.asarray(decoded.mean(axis=1))


def _decoded(channel: AskedChannel, auvs: Floats, asvs: Floats, reach: float) -> Floats:
    return 1.0 - channel.prospects(between(0.0, auvs, asvs, reach, calling=False))["loss"]


def _lost(terms: LossTerms, away: Floats) -> Floats:
    ranges = np.linspace(0.0, max(float(away.max()), 1.0), LOOKED_UP)
    losses = [loss_probability(it, terms) for it in ranges.tolist()]
    return np.interp(away, ranges, losses)


def _apart(auvs: Floats, asvs: Floats, axes: int = 3) -> Floats:
    """Return how far AUVs are from ASVs (n, m), m, seen from above with two axes."""
    return np.asarray(np.linalg.norm(auvs[:, None, :axes] - asvs[:, :axes], axis=2))
