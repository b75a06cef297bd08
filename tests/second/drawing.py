"""Scenarios drawn at random over the keys that the second implementation knows."""

import math
import random
from pathlib import Path

import numpy as np
import shapely
from medium import tracks

SCHEDULES = ["spatial_reuse", "dsatur", "one_per_slot", "worst_first", "super_tdma"]
SCHEDULES += ["round_robin", "random", "polling", "aloha", "slotted_aloha", "csma"]
TOLD = ["spatial_reuse", "dsatur", "one_per_slot", "worst_first", "worst_first", "round_robin"]
DOWNLINKS = ["sequential", "pipelined_round", "pipelined_group", "direct_reply"]
OVERFULL = ["split", "split", "oldest_first"]
BROADCASTERS = ["rotate", "random", "most_fixes", "nearest", "fixed", "parallel"]


def named(part: object) -> str:
    """Return the name of a part."""
    return part["model"] if isinstance(part, dict) else str(part)


def scenario(seed: int, folder: Path, **wanted: object) -> dict:
    """Return a scenario drawn with a seed; `wanted` fixes keys of `protocol`.

    Tracks of AUVs on several legs become files of a folder.
    """
    draw = random.Random(seed)
    count, ships = draw.randint(1, 8), draw.randint(1, 4)
    side = draw.choice([60.0, 100.0, 140.0, round(draw.uniform(40.0, 300.0), 2)])
    half = side / 2

    def place(reach: float = 1.0) -> list[float]:
        return [round(draw.uniform(-reach, reach) * half, 3) for _ in range(2)]

    duration = draw.choice([24.0, 30.0, round(draw.uniform(20.0, 40.0), 3)])
    speed, depth = round(draw.uniform(0.1, 2.0), 3), draw.choice([0.0, 5.0, 10.0, 40.0])
    moves = draw.choice(["hold", "one leg", "one leg", "legs", "legs"])
    if moves == "hold":
        route = {"kind": "hold", "positions_m": [place() for _ in range(count)]}
    elif moves == "one leg":
        legs = []
        for _ in range(count):
            (x, y), (to_x, to_y) = place(), place()
            way = max(((to_x - x) ** 2 + (to_y - y) ** 2) ** 0.5, 1e-6)
            far = 1.5 * speed * duration / way
            legs.append([[x, y], [round(x + far * (to_x - x), 3), round(y + far * (to_y - y), 3)]])
        route = {"kind": "waypoints", "points_m": legs}
    else:
        files = [folder / f"track_{seed}_{i}.csv" for i in range(count)]
        for path in files:
            time, (x, y), lines = 0.0, place(), ["time_s,x_m,y_m,depth_m"]
            while time < duration + 10.0:
                lines.append(f"{time:.3f},{x:.3f},{y:.3f},{draw.choice([0.5, 1.0]) * depth}")
                lasts = draw.uniform(0.5, 15.0)
                time, x, y = (
                    time + lasts,
                    x + draw.uniform(-1.4, 1.4) * lasts,
                    y + draw.uniform(-1.4, 1.4) * lasts,
                )
            path.write_text("\n".join(lines) + "\n")
        route = {"kind": "track", "files": [str(path) for path in files]}
    hf = round(draw.choice([0.3, 0.5, 0.7, 1.0, 1.5]) * side * draw.uniform(0.8, 1.2), 2)
    protocol = {
        "schedule": draw.choice(SCHEDULES),
        "downlink": draw.choice(DOWNLINKS),
        "broadcaster": draw.choice(BROADCASTERS),
        "ranging": draw.choice(["owtt_sync", "owtt_sync", "owtt_sync", "twtt", "twtt", "passive"]),
        "positions": draw.choice(["truth", "truth", "last_fix", "carried_forward"]),
        "tick_rate_hz": draw.choice([None, None, 30.0, 100.0]),
        "duplex": draw.choice(["per_band", "per_band", "per_node"]),
        "conflict_margin_m": draw.choice([0.0, 0.0, 5.0]),
        "frame_s": round(draw.uniform(0.5, 3.0), 3),
        "uplink_guard_s": draw.choice([None, None, round(draw.uniform(0.001, 0.1), 4)]),
        "shortest_uplink_slot_s": draw.choice([None, None, 0.0, round(draw.uniform(0.0, 0.3), 4)]),
        "downlink_guard_s": draw.choice([None, None, round(draw.uniform(0.001, 0.2), 4)]),
        "shortest_downlink_slot_s": draw.choice(
            [None, None, 0.0, round(draw.uniform(0.0, 1.0), 4)]
        ),
    }
    told = seed % 3 == 1  # frames carry slots, and often do not reach who needs them
    if told:
        protocol |= {"ranging": "owtt_sync", "schedule": draw.choice(TOLD)}
        protocol["downlink"] = draw.choice(["sequential", "pipelined_round"])
    protocol.update(wanted)
    if protocol["downlink"] == "direct_reply" and protocol["broadcaster"] == "parallel":
        protocol["broadcaster"] = "rotate"
    if protocol["ranging"] == "passive":
        protocol |= {"schedule": "spatial_reuse", "downlink": "sequential", "broadcaster": "rotate"}
    if protocol["schedule"] == "super_tdma":  # AUVs at rest, known: predicted ways are right
        protocol |= {"ranging": "owtt_sync", "positions": "truth"}
        protocol["schedule"] = {"model": "super_tdma", "clear_s": draw.choice([0.005, 0.02, 0.05])}
        protocol["downlink"] = draw.choice(["sequential", "pipelined_round", "direct_reply"])
        route = {"kind": "hold", "positions_m": [place() for _ in range(count)]}
    if protocol["schedule"] in ("aloha", "slotted_aloha", "csma"):
        protocol["ranging"] = "owtt_sync"
        protocol["frame_s"] = draw.choice([0.05, 0.2, 0.5, 1.0, 3.0])
        duration = min(duration, 100 * protocol["frame_s"])
    if protocol["schedule"] == "csma":
        slot_s = draw.choice([None, None, 0.01, 0.04])
        protocol["schedule"] = {
            "model": "csma",
            "window": draw.choice([1, 4, 10]),
            "slot_s": slot_s,
        }
    if protocol["schedule"] == "worst_first":
        protocol["schedule"] = {"model": "worst_first", "slots": draw.randint(1, 5)}
    if protocol["broadcaster"] == "fixed":
        protocol["broadcaster"] = {"model": "fixed", "asv": draw.randrange(ships)}
    if protocol["ranging"] == "twtt":
        protocol["ranging"] = {"model": "twtt", "turnaround_s": draw.choice([0.0, 0.05, 0.2])}
    if protocol["downlink"] == "direct_reply" and draw.random() < 0.5:
        reply = draw.choice(["frame", "instant", "instant"])
        protocol["downlink"] = {"model": "direct_reply", "reply": reply}
        if reply == "instant" and protocol["tick_rate_hz"] is None:
            protocol["downlink"]["reply_at"] = draw.choice(["ping_end", "ping_front"])
    if told:
        missed = draw.choice(["silent", "silent", "last_slot", "contention"])
        if named(protocol["schedule"]) in (
            "worst_first",
            "round_robin",
        ):  # who cannot tell the rest
            missed = draw.choice(["silent", "last_slot"])
        knowledge = {"assignment_bytes": draw.choice([1, 2]), "missed": missed}
        protocol["knowledge"] = {"model": "broadcast"} | knowledge
        protocol["forget_after_s"] = draw.choice([None, 3.0, 10.0, 60.0])
        protocol["recall_rounds"] = draw.choice([1, 3, 5])
        protocol["contention_chance"] = draw.choice([0.5, 1.0])
    failures: list[dict] = []
    if draw.random() < 0.3:
        at = round(draw.uniform(0.0, duration), 3)
        until = draw.choice([None, round(at + draw.uniform(0.5, 10.0), 3)])
        fail = draw.choice([[draw.randrange(ships)], range(ships)])
        failures = [{"asv": j, "at_s": at, "until_s": until} for j in fail]
    if protocol["ranging"] == "passive":
        protocol["positions"] = "truth"
    noise = draw.choice([0.0, 1.0])
    overfull = "split" if told or protocol["broadcaster"] == "parallel" else draw.choice(OVERFULL)
    keys: dict = {
        "name": f"second_{seed}",
        "duration_s": duration,
        "survey": {"side_m": side, "depth_m": depth},
        "auvs": {"count": count, "speed_m_per_s": speed, "route": route},
        "asvs": {
            "count": ships,
            "formation": {"positions_m": [place(1.2) for _ in range(ships)]},
            "failures": failures,
        },
        "environment": {
            "sound_speed_m_per_s": draw.choice([1500.0, 1450.0, 1540.0]),
            "assumed_sound_speed_m_per_s": draw.choice([None, None, 1500.0]),
        },
        "acoustics": {
            "hf": {
                "range_m": hf,
                "range_metric": draw.choice(["horizontal", "slant"]),
                "ping_s": draw.choice([0.01, 0.01, 0.005, 0.03]),
            },
            "mf": {
                "range_m": round(
                    (draw.uniform(0.2, 1.0) if told else draw.uniform(0.5, 3.0)) * side, 2
                ),
                "bit_rate_bps": draw.choice([2000.0, 5000.0]),
                "overhead": draw.choice([1.0, 2.0]),
                "header_bytes": draw.choice([0, 8]),
                "fix_bytes": draw.choice([8, 16]),
                "payload_bytes": draw.choice([None, None, 24, 40, 64]),
                "overfull": overfull,
                "processing_s": draw.choice([None, None, 0.05]),
            },
            "loss": {"law": "none"},
        },
        "protocol": protocol,
        "usbl": {
            "tdoa_sd_s": noise * 2.6e-7,
            "travel_time_sd_s": noise * 6.7e-6,
            "quantum_s": 0.0,
            "roll_sd_deg": 0.0,
            "pitch_sd_deg": 0.0,
            "heading_sd_deg": 0.0,
        },
        "navigation": {
            "imu_rate_hz": 1.0,
            "velocity_bias_m_per_s": [round(draw.uniform(0.0, 0.1), 3), 0.0],
            "random_walk_m_per_sqrt_s": round(draw.uniform(0.0, 0.1), 3),
        },
        "record": {"tracks_hz": 0.1, "metrics_hz": 0.1},
    }
    keys["acoustics"]["mf"]["range_metric"] = draw.choice(["horizontal", "slant"])
    return keys


def mixed(seed: int, folder: Path) -> dict:
    """Return a scenario of two groups of AUVs, whose depths, speeds and routes differ."""
    keys, other = scenario(seed, folder), scenario(seed + 100_000, folder)
    if named(keys["protocol"]["schedule"]) == "super_tdma":  # AUVs at rest, known
        still = [[4.0 * i - 20.0, 7.0] for i in range(other["auvs"]["count"])]
        other["auvs"]["route"] = {"kind": "hold", "positions_m": still}
    groups = [{**own["auvs"], "depth_m": own["survey"]["depth_m"]} for own in (keys, other)]
    groups[1]["depth_m"] += 3.0
    keys["auvs"] = {"count": sum(group["count"] for group in groups), "groups": groups}
    return keys


def with_land(seed: int, folder: Path) -> dict:
    """Return a scenario with islands beside the ways of all AUVs, in which some exchange frames."""
    keys, draw = (exchanging if seed % 3 == 0 else scenario)(seed, folder), random.Random(seed)
    if named(keys["protocol"]["schedule"]) == "super_tdma":
        keys["protocol"]["conflict_margin_m"] = 0.0
    side, ways = keys["survey"]["side_m"], keys["asvs"]["formation"]["positions_m"]
    taken = [shapely.Point(place) for place in ways]
    taken += [shapely.LineString(np.array(way)[:, 1:3].repeat(2, axis=0)) for way in tracks(keys)]
    land: list[list[list[float]]] = []
    for _ in range(400):
        x, y = (draw.uniform(-0.5, 0.5) * side for _ in range(2))
        turn, size = draw.uniform(0.0, 6.3), draw.uniform(0.05, 0.2) * side
        corners = [
            [round(x + size * math.cos(turn + at), 3), round(y + size * math.sin(turn + at), 3)]
            for at in (0.0, 0.3, 3.0, 3.5)  # long and narrow
        ]
        island = shapely.Polygon(corners)
        if island.is_valid and not any(island.distance(way) < 0.01 * side for way in taken):
            land.append(corners)
    keys["survey"]["land"] = land[:6]
    return keys


def exchanging(seed: int, folder: Path) -> dict:
    """Return a scenario in which fixes are acknowledged, repeated or relayed."""
    keys, draw = scenario(seed, folder), random.Random(f"exchange {seed}")
    protocol, count = keys["protocol"], keys["auvs"]["count"]
    if protocol["ranging"] == "passive":
        protocol["ranging"] = "owtt_sync"
    if named(protocol["downlink"]) == "direct_reply":
        protocol["downlink"] = "sequential"
    protocol["acknowledge"] = draw.choice(["none", "ping", "frame", "frame"])
    protocol["acknowledgement_bytes"] = draw.choice([0, 2, 5])
    repeats = ["none", 1, 2, 5] + ["until_acknowledged"] * (protocol["acknowledge"] != "none")
    protocol["repeat"] = draw.choice(repeats)
    if "knowledge" not in protocol and draw.random() < 0.6:
        some = sorted(draw.sample(range(count), draw.randint(1, count)))
        protocol["relay"] = {"hops": draw.randint(1, 3), "who": draw.choice(["all", some])}
        keys["acoustics"]["mf"]["range_m"] = round(draw.uniform(0.2, 0.8) * 1.4 * 60.0, 2)
    sends = protocol["acknowledge"] == "frame" or "relay" in protocol
    if sends and protocol["broadcaster"] == "parallel":
        protocol["broadcaster"] = "rotate"
    return keys


def contending(seed: int, folder: Path) -> dict:
    """Return a scenario of ALOHA whose pings are acknowledged, and repeated."""
    wanted = {"schedule": "aloha", "downlink": "sequential", "ranging": "owtt_sync"}
    keys, draw = scenario(3 * seed, folder, **wanted), random.Random(f"contention {seed}")
    protocol, size = keys["protocol"], draw.choice([1, 2, 5])
    access = {"acknowledgement_bytes": size, "repeat": draw.randint(0, 4)}
    protocol["access"] = {"model": protocol["schedule"]} | access
    protocol["acknowledge"] = draw.choice(["none", "none", "ping"])  # fixes
    protocol["repeat"] = draw.choice(["none", 1])
    protocol["frame_s"] = draw.choice([0.5, 1.0, 3.0])
    keys["acoustics"]["hf"]["bit_rate_bps"] = draw.choice([500.0, 1000.0, 5000.0])
    keys["asvs"]["failures"] = []
    return keys
