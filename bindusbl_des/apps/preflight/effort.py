"""The time and memory that a mission takes, from the number of its events.

Events are rounds, pings, paths of sound, samples, lanes.  Constants were measured on one core of
2.5 GHz; `tests/preflight/test_effort.py` keeps the memory within 0 to 28 % above what `run` took,
files included.
"""

import math
import os
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...core.navigation.belief import STATES
from ...core.navigation.correcting import REMEMBERED
from ...core.scenario.sections.routes import Lawnmower
from ...core.setup import Setup
from ...core.usbl.measuring import NOISE_WIDTH
from ...core.vehicles.currents import CONTROL_S
from ...support.streams import FEWEST_ROWS, MOST_ROWS, ROWS
from ...support.wording import spoken
from .round_lengths import Rounds, offered, rounds_of

# Up to so many pairs, AUVs in range are counted one by one; beyond, estimated from areas.
MOST_PAIRS = 4_000_000

# AUVs move: in the course of a mission an ASV hears more of them than at its start.
NEW_PAIRS = 1.5

# Rounds of more ping groups than this are not added up slot by slot.
FEW_GROUPS = 100


def counts_of(setup: Setup) -> dict[str, float]:
    """Return the expected number of each kind of event that costs (:data:`.effort.COSTS`)."""
    scenario = setup.scenario
    auvs, asvs, duration = scenario.auvs, scenario.asvs, scenario.duration_s
    record, full = scenario.record, scenario.record.detail == "full"
    steered = sum(auv.group.vehicle.has_dynamics for auv in setup.auvs)
    moving = steered + sum(
        len(group.members) * group.vehicle.has_dynamics for group in setup.vessels
    )
    lanes, legs = _planned(setup)
    return {
        **_protocol(setup),
        "samples": duration * record.metrics_hz * auvs.count,
        "imu_samples": duration * scenario.navigation.imu_rate_hz * auvs.count,
        "track_rows": duration * record.tracks_hz * (auvs.count + asvs.count) if full else 0.0,
        "intervals": moving * duration / CONTROL_S,
        "lanes": lanes,
        "legs": legs,
    }


# What depends on rounds
OF_ROUNDS = (
    *("rounds", "pings", "ways", "receptions", "frame_receptions", "fixes", "edges", "choices"),
    *("pairs", "noises"),
)


def _protocol(setup: Setup) -> dict[str, float]:
    """Return the expected number of rounds, pings, receptions, fixes, and edges of conflict
    graphs.
    """
    scenario, rounds = setup.scenario, rounds_of(setup)
    protocol, full, duration = (
        scenario.protocol,
        scenario.record.detail == "full",
        scenario.duration_s,
    )
    auvs, asvs, heard = scenario.auvs.count, scenario.asvs.count, _heard(setup)
    if not asvs:  # no round begins
        return dict.fromkeys(OF_ROUNDS, 0.0)
    listeners, share, met = asvs, heard_share(setup), float(heard.sum())
    frames = edges = choices = 0.0
    if protocol.asvs_ping:
        listeners, share = auvs, float(heard.mean())
        met = share * asvs
        periods = duration / rounds.period(asvs, 0)
        number, pings = math.ceil(periods), periods * asvs
        fixes = pings * share
    elif protocol.random_access:
        load = offered(setup)
        pings = duration * load.pings_per_s
        fixes = duration * load.fixes_per_s * min(share, 1.0)
        cycles = 0.0 if protocol.replies else min(fixes, duration / rounds.period(0, 1))
        number = math.ceil(cycles) + 1
    else:
        crowd = max(1.0, min(heard.max(), auvs))  # AUVs that one ASV hears must ping one by one
        groups = min(max(round(crowd), rounds.fewest), rounds.most)
        pinging = 1 if rounds.frame else rounds.auvs
        periods = duration / _period(rounds, groups, round(min(met, pinging)))
        number = math.ceil(periods)
        pings = pinging * (periods if groups > FEW_GROUPS else number)  # of a long round a part
        fixes = pings * min(share, 1.0)
        frames = float(number * (groups if setup.downlink.by_group else 1))
        if protocol.replies:
            frames = fixes if protocol.sends_frames else 0.0
        if ":" in protocol.schedule:
            edges = min(auvs * (auvs - 1) / 2, float((heard**2).sum()) / 2) * number
        if setup.schedule.groups == "saturation":
            choices = float(auvs) ** 2 * number
    noises = min(auvs * asvs, NEW_PAIRS * met)
    return {
        "rounds": number,
        "pings": pings,
        "ways": pings * listeners,
        "receptions": pings * (listeners if full else share),
        "frame_receptions": frames * auvs if full else 0.0,
        "fixes": fixes,
        "edges": edges,
        "choices": choices,
        "pairs": float(auvs * asvs),
        "noises": noises if protocol.asvs_ping else min(noises, pings * asvs),
    }


def _period(rounds: Rounds, groups: int, fixes: int) -> float:
    """Return the time (s) between rounds; beyond FEW_GROUPS it is extrapolated linearly."""
    if groups <= FEW_GROUPS:
        return rounds.usual(groups, fixes)
    last, before = (rounds.usual(FEW_GROUPS - n, fixes) for n in (0, 1))
    return last + (groups - FEW_GROUPS) * (last - before)


def _heard(setup: Setup) -> NDArray[np.float64]:
    """Return the expected number of AUVs that each ASV hears at the start, (m,)."""
    scenario, reach = setup.scenario, setup.horizontal_reach_m
    asvs, found = scenario.asvs.count, np.zeros(scenario.asvs.count)
    share = min(1.0, math.pi * reach**2 / setup.area.square_m)
    for wing, route in zip(setup.wings, setup.nominal_routes, strict=True):
        if route.places and len(wing) * asvs <= MOST_PAIRS:
            starts = [places[0] for places in route.places]
            apart = np.array(starts)[None] - np.array(setup.nominal_stations_m)[:, None]
            found += np.sum(np.hypot(*apart.T) <= reach, axis=0)
        else:
            found += share * len(wing)
    return found


def heard_share(setup: Setup) -> float:
    """Return the expected number of ASVs that hear an AUV at the start."""
    scenario = setup.scenario
    return min(float(_heard(setup).sum()) / scenario.auvs.count, scenario.asvs.count)


def _planned(setup: Setup) -> tuple[float, float]:
    """Return the number of lanes planned and of legs flown."""
    found = legs = 0.0
    for number, (wing, route) in enumerate(zip(setup.wings, setup.nominal_routes, strict=True)):
        if route.is_held or route.is_recorded:
            continue
        auvs = [setup.auvs[auv] for auv in wing.members]
        flown = sum(not auv.group.vehicle.has_dynamics for auv in auvs)
        lanes, tour = _tour(setup, number)
        laps = 1.0 + max(auv.speed_m_per_s for auv in auvs) * setup.scenario.duration_s / tour
        found, legs = found + len(wing) * lanes, legs + flown * laps * (6 * lanes + 10)
    return found, legs


def _tour(setup: Setup, number: int) -> tuple[float, float]:
    """Return the number of lanes of an AUV of a wing, and the least length (m) of its tour."""
    wing, route = setup.wings[number], setup.nominal_routes[number]
    ruled = route.lanes or Lawnmower()
    group = setup.auvs[wing.members[0]].group
    turns = 2 * math.pi * (0.0 if group.vehicle.has_dynamics else group.turning_radius_m)
    if route.places:
        lengths = [sum(math.dist(a, b) for a, b in pairwise(places)) for places in route.places]
        return max(map(len, route.places)), 2 * min(lengths) + turns
    spacing, margin = ruled.lane_spacing_m, ruled.end_margin_m
    box = setup.area.along(setup.lanes_heading_rad(wing)).box
    lanes = max(1.0, (box.y_max - box.y_min) / len(wing) / spacing)
    lane = box.x_max - box.x_min - 2 * (spacing / 2 if margin is None else margin)
    return lanes, 2 * lanes * lane + turns


# Where Linux says how much memory a container may take (bytes).
CONTAINER_LIMITS = (
    "/sys/fs/cgroup/memory.max",
    "/sys/fs/cgroup/memory/memory.limit_in_bytes",
)


def machine_cores() -> int:
    """Return the number of cores on which this process may run."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def machine_memory() -> float:
    """Return the memory (bytes) of this machine or container; infinite where it is unknown."""
    try:
        memory = float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, ValueError, OSError):
        memory = math.inf
    for limit in CONTAINER_LIMITS:
        with suppress(OSError, ValueError):  # no container, or "max"
            memory = min(memory, float(Path(limit).read_text()))
    return memory


# A mission estimated to take longer than this (s) is not begun unless the user insists.
LONGEST_S = 86_400.0

# From here on a mission's time and memory are told before it is begun.
WORTH_TELLING_S, WORTH_TELLING_BYTES = 30.0, 2e9

# Seconds and bytes of one event each: a round, a ping, its path to one ASV, a recorded reception, a
# frame at an AUV, a fix, a pair of AUVs in a conflict graph (user-defined schedules) or in DSATUR,
# a sample of metrics, of the IMU and of tracks (recorded), a control interval of a vehicle, a
# planned lane, a flown leg, a pair of AUV and ASV, such a pair with noise.
COSTS: dict[str, tuple[float, float]] = {
    "rounds": (40e-6, 600),
    "pings": (8e-6, 350),
    "ways": (0.9e-6, 0),
    "receptions": (4.5e-6, 360),
    "frame_receptions": (2.2e-6, 150),
    "fixes": (15e-6, 500),
    "edges": (6e-6, 0),
    "choices": (70e-9, 0),
    "samples": (0.15e-6, 0),
    "imu_samples": (0.06e-6, 16),
    "track_rows": (1.5e-6, 520),
    "intervals": (4e-6, 500),
    "lanes": (250e-6, 2000),
    "legs": (15e-6, 400),
    "pairs": (0.0, 24),
    "noises": (25e-6, 1200),
}
WORDS = {
    "ways": "ways from AUV to ASV",
    "edges": "conflicts to colour",
    "choices": "choices of the next AUV to colour",
    "pairs": "pairs of AUV and ASV",
    "noises": "pairs of AUV and ASV in range",
    "imu_samples": "IMU samples",
    "track_rows": "rows of tracks",
    "intervals": "control intervals",
}
REMEDY = "Lower auvs.count, asvs.count or duration_s, or set record.detail to summary"
REMEDIES = {
    "samples": "Lower record.metrics_hz or duration_s",
    "imu_samples": "Lower navigation.imu_rate_hz, auvs.count or duration_s",
    "track_rows": "Lower record.tracks_hz or duration_s, or set record.detail to summary",
    "edges": "Lower auvs.count, or name a schedule that ships, which needs no graph",
    "pairs": "Lower auvs.count or asvs.count",
    "noises": "Lower auvs.count or asvs.count",
}
PROCESS_BYTES = 240e6  # Python, its libraries, compiled code
AUV_S, AUV_BYTES = 1e-3, 10_000
GRAPH_EDGE_BYTES = 600  # of one graph at a time
SAMPLE_BYTES, IMU_SAMPLE_BYTES = 130, 48  # of one AUV at a time
ROW_BYTES = 8 * (NOISE_WIDTH + 1)
STATES_S, STATES_BYTES = 18e-9, 24  # of a pair of states of a belief, whose arrays grow by doubling
CALL_S, CALLED_S = 60e-6, 2e-6  # of each ping, of each ASV that may call it (twtt, polling)


@dataclass(frozen=True)
class Effort:
    """The expected effort of a mission: number of events, time (s), and memory (bytes) by
    holder.
    """

    counts: dict[str, float]
    seconds: float
    held: dict[str, float]

    @property
    def bytes(self) -> float:
        """The memory (bytes) of the mission's process."""
        return sum(self.held.values())

    @property
    def remedy(self) -> str:
        """The keys to change in a scenario that takes too much."""
        largest = max(self.held, key=lambda name: self.held[name])
        is_memory = self.bytes > WORTH_TELLING_BYTES
        return REMEDIES.get(largest if is_memory else "", REMEDY)

    def __str__(self) -> str:
        if self.bytes > WORTH_TELLING_BYTES:
            weights = {name: self.held.get(name, 0.0) for name in self.counts}
        else:
            weights = {name: number * COSTS[name][0] for name, number in self.counts.items()}
        largest = sorted(weights, key=lambda name: -weights[name])[:2]
        things = ", ".join(
            f"{float(f'{self.counts[name]:.2g}'):,.0f} {WORDS.get(name, name)}" for name in largest
        )
        return (
            f"about {spoken(self.seconds)} and {float(f'{self.bytes / 1e9:.2g}'):g} GB ({things})"
        )

    @property
    def is_worth_telling(self) -> bool:
        """Whether the estimate is large enough to be reported before the mission."""
        return self.seconds > WORTH_TELLING_S or self.bytes > WORTH_TELLING_BYTES

    def excess(self, at_once: int = 1) -> str:
        """Return why this machine should not begin `at_once` such missions, or ""."""
        memory = machine_memory()
        if self.bytes * at_once > memory:
            several = f"{at_once} at once need " if at_once > 1 else ""
            return f"{several}more memory than the {memory / 1e9:.2g} GB of this machine"
        return "more than a day" if self.seconds > LONGEST_S else ""


def effort(setup: Setup) -> Effort:
    """Return the expected effort of a mission; for long ones within a factor of three."""
    scenario = setup.scenario
    counts = counts_of(setup)
    auvs, duration, record = scenario.auvs.count, scenario.duration_s, scenario.record
    seconds = 0.05 + auvs * AUV_S + sum(n * COSTS[name][0] for name, n in counts.items())
    if scenario.protocol.calls:
        seconds += counts["pings"] * (CALL_S + scenario.asvs.count * CALLED_S)
    held = {name: n * COSTS[name][1] for name, n in counts.items()}
    states = sum(len(kind.sds) * kind.times for kind in setup.estimated_errors)
    pairs = states * (states + 2 * STATES)  # of states, beyond those of any belief
    seconds += counts["fixes"] * pairs * STATES_S
    held["fixes"] += counts["fixes"] * pairs * STATES_BYTES
    rows = max(FEWEST_ROWS, min(ROWS, MOST_ROWS // max(auvs * scenario.asvs.count, 1)))
    held["process"] = PROCESS_BYTES
    held["auvs"] = auvs * (AUV_BYTES + REMEMBERED * pairs * STATES_BYTES)
    held["edges"] += counts["edges"] / max(counts["rounds"], 1.0) * GRAPH_EDGE_BYTES
    held["noises"] += counts["noises"] * rows * ROW_BYTES
    held["samples"] += duration * record.metrics_hz * SAMPLE_BYTES
    held["imu_samples"] += duration * scenario.navigation.imu_rate_hz * IMU_SAMPLE_BYTES
    return Effort(counts, seconds, held)
