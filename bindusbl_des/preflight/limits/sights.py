"""Who is within range of whom at instants of a mission: what its limits follow from."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...acoustics.fix_chance import LOOKED_UP, frame_chance, made_and_delivered, ping_chance
from ...scenario.declared import channel_named
from ...scenario.scenario import Scenario
from .planned_ways import planned_places, planned_stations

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

# A mission is looked at so often, less often where there are more pairs of AUV and ASV than this.
INSTANTS, MOST_PAIRS = 121, 4_000_000


class Sights(NamedTuple):
    """What n AUVs and m ASVs are to each other at k instants (s), evenly spread.

    Which ASVs hear the pings of which AUVs, and which AUVs the frames of which ASVs, as the
    protocol counts its ranges, (k, n, m); how far (m) each AUV is from the ASV nearest to it that
    works, (k, n).  How likely a ping makes a fix, and one that is delivered, (k, n), if no other
    sound overlaps, and by the ASV that reaches the AUV best; as often as in range where a channel
    of somebody's own decides.
    """

    times_s: Floats
    heard: Flags
    told: Flags
    nearest_m: Floats
    made: Floats
    delivered: Floats
    at_best: Floats


def planned_sights(scenario: Scenario) -> Sights:
    """Return who is to be within range of whom, by the plans of a scenario.

    Raises:
        ValueError: when the route cannot be flown.
        PluginError: when one's own is not allowed, or makes none.
    """
    times = instants(scenario)
    places = planned_places(scenario, times)
    return sights(scenario, times, places, planned_stations(scenario, len(times)))


def instants(scenario: Scenario, most: int = INSTANTS) -> Floats:
    """Return the instants (s) at which a mission is looked at: midway through equal parts of it,
    `most` of them unless there are many vehicles.
    """
    pairs = scenario.auvs.count * scenario.asvs.count
    count = max(min(most, MOST_PAIRS // pairs), 1)
    return np.asarray((np.arange(count) + 0.5) * scenario.duration_s / count)


def sights(scenario: Scenario, times: Floats, auvs: Floats, asvs: Floats) -> Sights:
    """Return who is within range of whom, of AUVs (k, n, 3) and ASVs (k, m, 3), m, at instants
    (k,), s.  An ASV that has failed neither hears nor is heard.
    """
    hf, mf = scenario.acoustics.hf, scenario.acoustics.mf
    apart = auvs[:, :, np.newaxis, :] - asvs[:, np.newaxis, :, :]
    level = np.hypot(apart[..., 0], apart[..., 1])
    slant = np.hypot(level, apart[..., 2])
    broken = np.zeros((len(times), 1, asvs.shape[1]), dtype=np.bool_)
    for failure in scenario.asvs.failures:
        broken[[failure.lasts(time) for time in times.tolist()], 0, failure.asv] = True
    heard = ((slant if hf.range_metric == "slant" else level) <= hf.range_m) & ~broken
    nearest = np.where(broken, np.inf, slant).min(axis=2)
    told = (level <= mf.range_m) & ~broken
    pings = _chances(scenario, slant, heard, ~broken, hf.channel, ping_chance)
    frames = _chances(scenario, slant, told, ~broken, mf.channel, frame_chance)
    made, delivered = made_and_delivered(scenario, pings, frames, np.where(broken, np.inf, slant))
    at_best = made if scenario.protocol.is_passive else made * frames.max(axis=2)
    return Sights(times, heard, told, nearest, made, delivered, at_best)


def _chances(
    scenario: Scenario, slant: Floats, in_range: Flags, works: Flags, channel: str,
    chance: Callable[[Scenario, Floats, float], Floats | None],
) -> Floats:  # fmt: skip
    """Return how likely signals are decoded over slant ranges (k, n, m), m, looked up by these."""
    ranges = np.linspace(0.0, max(float(slant.max()), 1.0), LOOKED_UP)
    table = chance(scenario, ranges, scenario.survey.deepest)
    if table is None:
        return in_range.astype(np.float64)
    within = in_range if channel_named(channel).ends_at_range else works
    return np.where(within, np.interp(slant, ranges, table), 0.0)
