"""How many of each thing a mission has: rounds, pings, ways of sound, samples, lanes."""

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..scenario.families import downlink_of, schedule_of
from ..scenario.planned import horizontal_reach, known_route, known_stations
from ..scenario.scenario import Scenario
from ..scenario.survey_area import area_of, lanes_heading
from ..vehicles.currents import CONTROL_S
from .round_lengths import Rounds, offered, rounds_of

# Hearing is worked out vehicle by vehicle up to so many pairs, beyond from areas.
MOST_PAIRS = 4_000_000

# AUVs move: in the course of a mission an ASV hears more of them than at its start.
NEW_PAIRS = 1.5

# Rounds of more ping groups than this are not added up slot by slot.
FEW_GROUPS = 100


def counts_of(scenario: Scenario) -> dict[str, float]:
    """Return about how many there will be of each thing that costs (:data:`.effort.COSTS`)."""
    return {**_protocol(scenario), **_sampling(scenario), **_ways(scenario)}


def _passive(scenario: Scenario) -> dict[str, float]:
    """Return what :func:`_protocol` does where ASVs ping, and AUVs fix themselves."""
    auvs, asvs, rounds = scenario.auvs.count, scenario.asvs.count, rounds_of(scenario)
    heard, number = float(_heard(scenario).mean()), scenario.duration_s / rounds.period(asvs, 0)
    pings = number * asvs
    return {
        "rounds": math.ceil(number),
        "pings": pings,
        "ways": pings * auvs,
        "receptions": pings * (auvs if scenario.record.detail == "full" else heard),
        "frame_receptions": 0.0,
        "fixes": pings * heard,
        "edges": 0.0,
        "choices": 0.0,
        "pairs": float(auvs * asvs),
        "noises": min(auvs * asvs, NEW_PAIRS * heard * asvs),
    }


def _random(scenario: Scenario) -> dict[str, float]:
    """Return what :func:`_protocol` does where AUVs ping as they like."""
    auvs, asvs, load = scenario.auvs.count, scenario.asvs.count, offered(scenario)
    heard, duration = _heard(scenario), scenario.duration_s
    share = heard_share(scenario)
    pings = duration * load.pings_per_s
    fixes = duration * load.fixes_per_s * min(share, 1.0)
    rounds = rounds_of(scenario)
    replies = scenario.protocol.replies
    cycles = 0.0 if replies else min(fixes, duration / rounds.period(0, 1))
    met = min(auvs * asvs, NEW_PAIRS * float(heard.sum()), pings * asvs)
    return {
        "rounds": math.ceil(cycles) + 1,
        "pings": pings,
        "ways": pings * asvs,
        "receptions": pings * (asvs if scenario.record.detail == "full" else share),
        "fixes": fixes,
        "edges": 0.0,
        "choices": 0.0,
        "pairs": float(auvs * asvs),
        "noises": met,
    }


def _protocol(scenario: Scenario) -> dict[str, float]:
    """Return how many rounds, pings, receptions and fixes there will be, and edges of graphs."""
    if scenario.protocol.asvs_ping:
        return _passive(scenario)
    if scenario.protocol.random_access:
        return _random(scenario)
    auvs, asvs, rounds = scenario.auvs.count, scenario.asvs.count, rounds_of(scenario)
    heard = _heard(scenario)
    crowd = max(1.0, min(heard.max(), auvs))  # those that one ASV hears must ping one by one
    groups = min(max(round(crowd), rounds.fewest), rounds.most)
    pinging = 1 if rounds.frame else rounds.auvs
    fixed = min(float(heard.sum()), pinging)
    periods = scenario.duration_s / _period(rounds, groups, round(fixed))
    number = math.ceil(periods)
    pings = pinging * (periods if groups > FEW_GROUPS else number)  # of a long round only a part
    share = min(float(heard.sum()) / auvs, asvs)
    edges = min(auvs * (auvs - 1) / 2, float((heard**2).sum()) / 2)
    whole, schedule = scenario.record.detail == "full", scenario.protocol.schedule
    chosen = schedule_of(scenario).groups == "saturation"
    fixes = pings * min(share, 1.0)
    frames = float(number * (groups if downlink_of(scenario).by_group else 1))
    if scenario.protocol.replies:
        frames = fixes if scenario.protocol.sends_frames else 0.0
    met = min(auvs * asvs, NEW_PAIRS * float(heard.sum()), pings * asvs)
    return {
        "rounds": number,
        "pings": pings,
        "ways": pings * asvs,
        "receptions": pings * (asvs if whole else share),
        "frame_receptions": frames * auvs if whole else 0.0,
        "fixes": fixes,
        "edges": edges * number if ":" in schedule else 0.0,
        "choices": float(auvs) ** 2 * number if chosen else 0.0,
        "pairs": float(auvs * asvs),
        "noises": met,
    }


def _period(rounds: Rounds, groups: int, fixes: int) -> float:
    """Return the time (s) between rounds; many groups add as much each as the last of a few."""
    if groups <= FEW_GROUPS:
        return rounds.usual(groups, fixes)
    last, before = (rounds.usual(FEW_GROUPS - n, fixes) for n in (0, 1))
    return last + (groups - FEW_GROUPS) * (last - before)


def _heard(scenario: Scenario) -> NDArray[np.float64]:
    """Return about how many AUVs each ASV hears when the mission begins."""
    route, reach = known_route(scenario), horizontal_reach(scenario)
    count, asvs = scenario.auvs.count, scenario.asvs.count
    if route.kind in ("hold", "waypoints") and count * asvs <= MOST_PAIRS:
        starts = (
            route.positions_m if route.kind == "hold" else [points[0] for points in route.points_m]
        )
        apart = np.array(starts)[None] - np.array(known_stations(scenario))[:, None]
        near: NDArray[np.float64] = np.sum(np.hypot(*apart.T) <= reach, axis=0).astype(float)
        return near
    share = min(1.0, math.pi * reach**2 / area_of(scenario).square_m)
    return np.full(asvs, share * count)


def heard_share(scenario: Scenario) -> float:
    """Return by about how many ASVs an AUV is heard when the mission begins."""
    return min(float(_heard(scenario).sum()) / scenario.auvs.count, scenario.asvs.count)


def _sampling(scenario: Scenario) -> dict[str, float]:
    """Return how many samples of metrics, IMUs and tracks there will be."""
    auvs, asvs, duration = scenario.auvs.count, scenario.asvs.count, scenario.duration_s
    rows = duration * scenario.record.tracks_hz * (auvs + asvs)
    return {
        "samples": duration * scenario.record.metrics_hz * auvs,
        "imu_samples": duration * scenario.navigation.imu_rate_hz * auvs,
        "track_rows": rows if scenario.record.detail == "full" else 0.0,
    }


def _ways(scenario: Scenario) -> dict[str, float]:
    """Return how much is planned and steered: lanes, legs, control intervals."""
    auvs, asvs, duration = scenario.auvs, scenario.asvs, scenario.duration_s
    moving = auvs.count * auvs.vehicle.has_dynamics + asvs.count * asvs.vehicle.has_dynamics
    found = {"intervals": moving * duration / CONTROL_S, "lanes": 0.0, "legs": 0.0}
    route = known_route(scenario)
    if route.is_held or route.is_recorded:
        return found
    lanes, tour = _tour(scenario)
    found["lanes"] = auvs.count * lanes
    if not auvs.vehicle.has_dynamics:
        laps = 1.0 + max(auvs.speeds) * duration / tour
        found["legs"] = auvs.count * laps * (6 * lanes + 10)
    return found


def _tour(scenario: Scenario) -> tuple[float, float]:
    """Return how many lanes an AUV has, and at least how long (m) its tour is."""
    auvs, route = scenario.auvs, known_route(scenario)
    turns = 2 * math.pi * (0.0 if auvs.vehicle.has_dynamics else auvs.turning_radius_m)
    if route.kind == "waypoints":
        lengths = [sum(math.dist(a, b) for a, b in pairwise(points)) for points in route.points_m]
        return max(map(len, route.points_m)), 2 * min(lengths) + turns
    assert route.kind == "lawnmower"
    spacing, margin = route.lane_spacing_m, route.end_margin_m
    box = area_of(scenario).along(lanes_heading(scenario)).box
    lanes = max(1.0, (box.y_max - box.y_min) / auvs.count / spacing)
    lane = box.x_max - box.x_min - 2 * (spacing / 2 if margin is None else margin)
    return lanes, 2 * lanes * lane + turns
