"""The scenario of a witness: the one that is verified, but for where its vehicles are."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...scenario.planned import known_stations
from ...scenario.survey_area import area_of
from ...scenario.water import assumed_sound_speed_of
from ..case import Array, Case

# What lies at a range is put so much nearer, or farther: roundings of its place are smaller.
SLIVER = 1e-9

# Who moves by no metre a minute counts as still: a route needs a speed.
STILL_M_PER_S = 0.001

# The other AUVs are so many reaches away from all ASVs.
OUT_OF_THE_WAY = 20.0

LATEST_S = 10.0

# Of a witness that lasts longer (s), so many instants are sampled: what matters is when it sounds.
LONG_S, SAMPLES = 5000.0, 10_000


@dataclass(frozen=True)
class Actor:
    """An AUV of a witness: where it begins (m), how deep (m), where it heads for, how late (s).

    It heads for a place (m) at the largest relative speed, or lies still.
    """

    x: float
    y: float
    depth: float
    towards: tuple[float, float] | None = None
    late_s: float = 0.0


def stations_of(case: Case) -> Array:
    """Return where the ASVs of a witness lie (m), (m, 2): those that move on a ring."""
    found = case.stations
    return np.array(known_stations(case.scenario)) if found is None else found


def staged(
    case: Case,
    actors: Mapping[int, Actor],
    duration_s: float,
    sound_speed: float,
    **changes: Mapping[str, Any],
) -> dict[str, Any]:
    """Return the plain data of a witness: some AUVs act, all others are out of the way.

    `changes` are laid over the sections of the scenario.
    """
    scenario = case.scenario
    data = scenario.model_dump(mode="json", exclude_defaults=True)
    data = {name: data[name] for name in ("acoustics", "protocol", "usbl") if name in data}
    auvs = [actors.get(n) or _aside(case, n) for n in range(scenario.auvs.count)]
    stations = stations_of(case)
    data |= {
        "name": f"{scenario.name}: witness",
        "duration_s": duration_s,
        "survey": {**_survey(case), "depths_m": [auv.depth for auv in auvs]},
        "auvs": {"count": len(auvs), **_routes(case, auvs, duration_s)},
        "asvs": {"count": len(stations), "formation": {"positions_m": stations.tolist()}},
        "navigation": {"filter": "dead_reckoning"},  # which changes nothing that is sent
        "environment": {
            "sound_speed_m_per_s": sound_speed,
            "assumed_sound_speed_m_per_s": assumed_sound_speed_of(scenario),
        },
    }
    if duration_s > LONG_S:
        rate = SAMPLES / duration_s
        data["record"] = {"metrics_hz": rate, "tracks_hz": rate}
        data["navigation"]["imu_rate_hz"] = max(rate, 0.001)
    if any(auv.late_s for auv in auvs):
        data["auvs"]["ping_late_s"] = [auv.late_s for auv in auvs]
    data["acoustics"] = {**data.get("acoustics", {}), "loss": {"law": "none"}}
    mf = data["acoustics"].get("mf", {})
    if "modem" in mf:
        mf.pop("airtimes", None)  # which the modem brings
    for section, change in changes.items():
        data[section] = {**data.get(section, {}), **change}
    return data


def _survey(case: Case) -> dict[str, Any]:
    survey = case.scenario.survey.model_dump(mode="json", exclude_defaults=True)
    if "area" in survey:
        return {"polygon_m": [list(corner) for corner in area_of(case.scenario).outline]}
    kept = ("side_m", "size_m", "polygon_m", "rotation_deg")
    return {name: survey[name] for name in kept if name in survey}


def _aside(case: Case, number: int) -> Actor:
    """Return an AUV that no ASV hears, apart from all others."""
    stations, protocol = stations_of(case), case.scenario.protocol
    reach = case.scenario.acoustics.hf.range_m + protocol.conflict_margin_m
    x, y = stations.max(axis=0) + OUT_OF_THE_WAY * reach
    return Actor(float(x) + number, float(y), case.depths[number][1])


def _routes(case: Case, auvs: list[Actor], duration_s: float) -> dict[str, Any]:
    """Return the routes of AUVs, with their speeds: way points if any of them moves."""
    if all(auv.towards is None for auv in auvs):
        return {"route": {"kind": "hold", "positions_m": [[auv.x, auv.y] for auv in auvs]}}
    speed = min(case.closing_m_per_s, 20.0)
    ways, speeds = [], []
    for auv in auvs:
        x, y = auv.towards or (auv.x + 1.0, auv.y)
        away = math.hypot(x - auv.x, y - auv.y)
        far = max(1.0, 2 * speed * duration_s) / away
        ways.append([[auv.x, auv.y], [auv.x + far * (x - auv.x), auv.y + far * (y - auv.y)]])
        speeds.append(max(speed, STILL_M_PER_S) if auv.towards else STILL_M_PER_S)
    return {"route": {"kind": "waypoints", "points_m": ways}, "speeds_m_per_s": speeds}
