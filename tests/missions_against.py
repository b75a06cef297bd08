"""Missions against a verdict: AUVs put where they disturb most, errors drawn anew, all counted."""

import json
import os
import random
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
from drawn_scenarios import drawn

from bindusbl_des import Result, Scenario, Setup, simulate

Data = dict[str, Any]

# Of what `verify` never accepts, or what is no protocol, few are drawn: of so many one is left.
RARE = 0.15

# No coordinate is farther than 1,000 km; nobody swims as far as the rest in a mission.
FARTHEST_M = 999_000.0

CHOICES = {
    "schedule": (
        *("spatial_reuse", "dsatur", "worst_first", "one_per_slot", "one_per_slot", "round_robin"),
        *("random", "polling", "super_tdma", "aloha"),
    ),
    "downlink": ("sequential", "pipelined_round", "pipelined_group", "direct_reply"),
    "broadcaster": ("rotate", "random", "most_fixes", "nearest", "fixed", "parallel"),
    "ranging": ("owtt_sync", "owtt_sync", "twtt", "passive"),
    "positions": ("truth", "last_fix", "carried_forward"),
    "knowledge": ("shared", "broadcast"),
    "missed": ("silent", "silent", "last_slot", "contention"),
    "reply": ("frame", "instant"),
}

# What parts of their own have to set
SETTINGS = {
    "reply": ("downlink", "direct_reply"),
    "turnaround_s": ("ranging", "twtt"),
    "assignment_bytes": ("knowledge", "broadcast"),
    "missed": ("knowledge", "broadcast"),
}


def drawn_protocol(seed: int, folder: Path) -> Data:
    """Return a scenario of which every key may be drawn, in which vehicles can meet.

    Durations, ranges, speeds and guards are such that missions are short and their signals near
    each other; parts of which nothing is proved are rare.
    """
    draw = random.Random(seed)
    data = drawn(seed, folder)
    data["duration_s"] = draw.choice((10.0, 20.0, 40.0))
    for section in ("auvs", "asvs", "survey", "acoustics", "protocol", "environment"):
        data.setdefault(section, {})
    acoustics, protocol, auvs = data["acoustics"], data["protocol"], data["auvs"]
    for band, ranges in (("hf", (20.0, 50.0, 80.0)), ("mf", (60.0, 100.0, 300.0))):
        part = acoustics.setdefault(band, {})
        part["range_m"] = draw.choice(ranges)
        if draw.random() > RARE or "'text'" in str(part.get("channel")):  # a file that nobody has
            part.pop("channel", None)
    acoustics["hf"]["ping_s"] = draw.choice((0.002, 0.01, 0.03))
    acoustics["loss"] = {"law": "none"}
    if draw.random() > RARE:
        protocol.pop("duplex", None)
    if draw.random() > RARE:
        data["asvs"].pop("failures", None)
    for name in ("acknowledge", "repeat", "relay"):
        if draw.random() > RARE:
            protocol.pop(name, None)
    if draw.random() > RARE:
        data.pop("traffic", None)
    for name, values in (
        ("uplink_guard_s", (None, None, 0.0, 0.001, 0.02)),
        ("shortest_uplink_slot_s", (None, 0.0)),
        ("downlink_guard_s", (None, None, 0.0, 0.01)),
        ("shortest_downlink_slot_s", (None, 0.0)),
        ("conflict_margin_m", (0.0, 0.5, 2.0, 20.0)),
        ("tick_rate_hz", (None, None, 30.0, 7.0)),
        ("frame_s", (0.3, 1.0, 2.5)),
        ("turnaround_s", (0.0, 0.02, 0.3)),
        ("assignment_bytes", (0, 2, 64)),
    ):
        protocol[name] = draw.choice(values)
    for name, choices in CHOICES.items():
        if draw.random() < 0.7:
            protocol[name] = draw.choice(choices)
    own: dict[str, Data] = {}
    for name, (key, part) in SETTINGS.items():
        value = protocol.pop(name, None)
        if value is not None and protocol.get(key) == part:
            own.setdefault(key, {"model": part})[name] = value
    protocol |= own
    auvs["count"] = draw.randint(1, 6)
    auvs.pop("vehicle", None)
    for name in ("launch_m", "recovery_m", "feedback", "turning_radius_m"):
        auvs.pop(name, None)
    if "depths_m" in data["survey"]:
        data["survey"]["depths_m"] = [draw.choice((0.0, 5.0, 20.0)) for _ in range(auvs["count"])]
    data["survey"]["depth_m"] = draw.choice((0.0, 5.0, 20.0))
    speed = draw.choice((0.0, 0.0, 0.3, 1.0, 3.0))
    auvs["speed_m_per_s"] = speed or 1.0
    auvs.pop("speeds_m_per_s", None)
    if "ping_late_s" in auvs:
        late = [draw.choice((0.0, draw.uniform(0.0, 0.02))) for _ in range(auvs["count"])]
        auvs["ping_late_s"] = late
    reach, asvs = acoustics["hf"]["range_m"], data["asvs"]
    asvs["count"] = draw.randint(1, 4)
    apart = draw.choice((0.3, 0.8, 1.2, 2.5)) * reach
    model = asvs.get("formation", {}).get("model")
    if draw.random() > RARE or model is None:
        asvs.pop("vehicle", None)
        asvs["formation"] = {
            "positions_m": [
                [apart * k + draw.uniform(-3, 3), draw.uniform(-5.0, 5.0)]
                for k in range(asvs["count"])
            ]
        }
    data["record"] = {"detail": "full"}
    navigation = data.setdefault("navigation", {})
    for name in ("gain", "delay_compensation"):
        navigation.pop(name, None)
    navigation["filter"] = "dead_reckoning"  # no navigator changes what is sent
    auvs["route"] = _places(data, np.array([[0.0, 0.0]]), speed, np.random.default_rng(seed))
    return data


def against(scenario: Scenario, data: Data, seed: int) -> Scenario:
    """Return the same mission with other places and ways of its AUVs, within what it plans."""
    draw = np.random.default_rng([seed, 1])
    stations = Setup(scenario).nominal_stations_m
    where = np.array(stations if stations is not None else [[0.0, 0.0]], dtype=float)
    moves = data["auvs"]["route"]["kind"] == "waypoints"
    speed = data["auvs"]["speed_m_per_s"] if moves else 0.0
    route = _places(data, where.reshape(-1, 2), speed, draw)
    auvs = {**data["auvs"], "route": route}
    return Scenario.model_validate({**data, "auvs": auvs})


def _places(data: Data, stations: Any, speed: float, draw: np.random.Generator) -> Data:
    """Return a route: AUVs held, or on their way, at and about the edges of ranges of ASVs."""
    count, reach = data["auvs"]["count"], data["acoustics"]["hf"]["range_m"]
    margin = data["protocol"]["conflict_margin_m"]
    places, ways = [], []
    for _ in range(count):
        asv = stations[draw.integers(len(stations))]
        other = stations[draw.integers(len(stations))]
        along = np.arctan2(*(other - asv)[::-1]) if draw.random() < 0.5 else 0.0
        bearing = along + draw.choice((0.0, np.pi, draw.uniform(0, 2 * np.pi)))
        away = draw.choice(
            (reach * (1 - 1e-9), reach + margin + 1e-6, reach + margin + draw.uniform(0, 1), 0.0,
             draw.uniform(0.0, 1.3) * reach, reach - draw.uniform(0.0, 3.0))
        )  # fmt: skip
        at = asv + away * np.array([np.cos(bearing), np.sin(bearing)])
        at = np.clip(at, -FARTHEST_M, FARTHEST_M)
        aim = stations[draw.integers(len(stations))] - at if draw.random() < 0.7 else at - asv
        aim = aim if np.linalg.norm(aim) > 1e-3 else np.array([1.0, 0.0])
        aim = aim / np.linalg.norm(aim) * max(1.0, 2 * speed * data["duration_s"])
        places.append(at.tolist())
        ways.append([at.tolist(), (at + aim).tolist()])
    if speed:
        return {"kind": "waypoints", "points_m": ways}
    return {"kind": "hold", "positions_m": places}


def collided(result: Result) -> int:
    """Return how many signals of a mission were destroyed by another."""
    tables = result.arrow
    found = 0
    for table, column in (
        ("receptions", "outcome"), ("frame_receptions", "outcome"), ("pings", "call"),
    ):  # fmt: skip
        if table in tables and column in tables[table].column_names:
            found += tables[table][column].to_pylist().count("collided")
    return found


def collisions(scenario: Scenario, data: Data, seed: int, missions: int) -> int:
    """Return how many signals collide in so many missions: the scenario's own, and others."""
    played = [scenario] + [against(scenario, data, seed + k) for k in range(missions - 1)]
    return sum(collided(simulate(it, seed + k)) for k, it in enumerate(played))


def uncompiled(module: str, *words: object) -> Any:
    """Return the JSON that a module of the tests prints where no equation is compiled.

    Drawn missions are of many kinds: to compile them all takes a minute, to fly them seconds.
    """
    paths = os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])
    ran = subprocess.run(
        [sys.executable, "-W", "error", "-m", module, *map(str, words)],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": paths},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr[-4000:]
    return json.loads(ran.stdout)
