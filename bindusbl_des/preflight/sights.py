"""Where AUVs and ASVs are going to be if they keep to their plans, who is then within range of
whom, and into how many ping groups that makes a round.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..acoustics.fix_chance import LOOKED_UP, frame_chance, made_and_delivered, ping_chance
from ..core.arrays import Flags, Floats, Ints
from ..protocol.bounds import EXACT_UP_TO, clique_number, fewest_groups, most_heard, reuse_bound
from ..protocol.conflicts import dsatur_groups, greedy_groups
from ..protocol.predicted_positions import planned_vehicles
from ..scenario.declared import ScheduleTraits, channel_named
from ..scenario.planned import known_stations
from ..scenario.scenario import Scenario


def planned_places(scenario: Scenario, times: Floats) -> Floats:
    """Return where the n AUVs are to be at k instants (s), shape (k, n, 3), m.

    Raises:
        ValueError, PluginError: as of :func:`planned_vehicles`.
    """
    ways = [
        vehicle.sample(times)[:, :2] for vehicle in planned_vehicles(scenario, scenario.duration_s)
    ]
    places = np.empty((len(times), len(ways), 3))
    for auv, way in enumerate(ways):
        places[:, auv, :2], places[:, auv, 2] = way, scenario.survey.depth(auv)
    return places


def planned_stations(scenario: Scenario, instants: int) -> Floats:
    """Return where the m ASVs lie at so many instants, shape (instants, m, 3), m; a ring stands in
    for those that move.
    """
    stations = np.array(known_stations(scenario), dtype=np.float64)
    flat = np.column_stack((stations, np.zeros(len(stations))))
    return np.broadcast_to(flat, (instants, *flat.shape))


# A mission is looked at so often, less often where there are more pairs of AUV and ASV than this.
INSTANTS, MOST_PAIRS = 121, 4_000_000


class SurveySights(NamedTuple):
    """What n AUVs and m ASVs are to each other at k instants (s), evenly spread.

    Which ASVs hear the pings of which AUVs, and which AUVs the frames of which ASVs, as the
    protocol counts its ranges, (k, n, m); how far (m) each AUV is from the ASV nearest to it that
    works, (k, n).  How likely a ping makes a fix, and one that is delivered, (k, n), if no other
    sound overlaps, and by the ASV that reaches the AUV best; as often as in range where a channel
    of somebody's own decides.
    """

    times_s: Floats
    heard: Flags
    reached: Flags
    nearest_m: Floats
    made: Floats
    delivered: Floats
    at_best: Floats


def planned_sights(scenario: Scenario) -> SurveySights:
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


def sights(scenario: Scenario, times: Floats, auvs: Floats, asvs: Floats) -> SurveySights:
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
    reached = (level <= mf.range_m) & ~broken
    pings = _chances(scenario, slant, heard, ~broken, hf.channel, ping_chance)
    frames = _chances(scenario, slant, reached, ~broken, mf.channel, frame_chance)
    made, delivered = made_and_delivered(scenario, pings, frames, np.where(broken, np.inf, slant))
    at_best = made if scenario.protocol.asvs_ping else made * frames.max(axis=2)
    return SurveySights(times, heard, reached, nearest, made, delivered, at_best)


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


# How many ping groups there are of what is heard, by how they come about.
COLOURINGS: Mapping[str, Callable[[Flags], int]] = {
    "first_fit": lambda heard: len(greedy_groups(heard)),
    "saturation": lambda heard: len(dsatur_groups(heard)),
    "each": len,
}


@dataclass(frozen=True)
class Groups:
    """Ping groups of a round, means over instants.

    Those that the schedule makes (None: only it knows); between what the fewest lie that are free
    of conflicts, equal where the chromatic number is known; the clique number (None: not worked
    out); the most AUVs that one ASV hears; how many AUVs that are heard share a slot, at most.
    """

    made: float | None
    fewest: tuple[float, float]
    clique: float | None
    most_heard: float
    reuse: float

    @property
    def is_exact(self) -> bool:
        """Whether the fewest groups are known at every instant."""
        return self.fewest[0] == self.fewest[1]


def groups_of(schedule: ScheduleTraits, heard: Flags) -> Groups:
    """Return the ping groups of rounds that begin with so much in HF range, (k, n, m)."""
    made = groups_made(schedule, heard)
    small = heard.shape[1] <= EXACT_UP_TO
    return Groups(
        None if made is None else float(made.mean()),
        (
            float(each(heard, lambda now: fewest_groups(now)[0]).mean()),
            float(each(heard, lambda now: fewest_groups(now)[1]).mean()),
        ),
        float(each(heard, lambda now: clique_number(now) or 0).mean()) if small else None,
        float(each(heard, most_heard).mean()),
        float(each(heard, reuse_bound).mean()),
    )


def groups_made(schedule: ScheduleTraits, heard: Flags) -> Ints | None:
    """Return how many ping groups a schedule makes of what is in range (k, n, m), at each instant
    (k,); None where only the schedule knows.
    """
    if schedule.framed:
        return np.ones(len(heard), dtype=np.int64)
    if not schedule.has_exact_groups:
        return None
    return each(heard, COLOURINGS[schedule.groups]).astype(np.int64)


def each(heard: Flags, of: Callable[[Flags], float]) -> Floats:
    """Return a number of what is in range (k, n, m) at each instant, (k,): of equal ones once."""
    kept: dict[bytes, float] = {}
    found = np.empty(len(heard))
    for instant, now in enumerate(heard):
        key = now.tobytes()
        if key not in kept:
            kept[key] = of(now)
        found[instant] = kept[key]
    return found
