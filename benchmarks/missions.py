"""The missions whose speed is measured: fleets of 3 to 10,000 AUVs under 1 to 200 ASVs.

Up to ten AUVs survey the paper's square of 140 m in strips.  Larger fleets keep the density of
those ten: the square grows with the root of their number, each AUV sweeps a patch of its own, the
ASVs are moored in staggered rows, and the HF range grows with the water per ASV as in the paper's
square with three, so that the sea is covered alike and the colouring has conflicts to resolve.

Up to a thousand AUVs are answered by one ASV at a time, as in the paper.  Beyond that slots guarded
against echoes from all of the survey would outlast the mission, and no modem reaches across it: the
ASVs answer in parallel, each those nearest to it, and MF range and guards grow with the HF range.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from bindusbl_des.core.protocol.slots import (
    DOWNLINK_GUARD,
    SHORTEST_DOWNLINK,
    SHORTEST_UPLINK,
    UPLINK_GUARD,
    crossing_time,
)
from bindusbl_des.core.scenario.scenario import Scenario

DURATION_S = 300.0

# The paper's recovery mission: its square, ranges, ASVs and bit rate.
SIDE_M = 140.0
HF_RANGE_M = 50.0
MF_RANGE_M = 100.0
ASVS = 3
BIT_RATE_BPS = 2000.0

# Fleets no denser than this many AUVs in the paper's square.
DENSEST = 10

# Fleets that one rotating ASV can answer.
MOST_ANSWERED = 1000

# Speed (m/s) at which each vehicle flies: the paper's, and what the models cruise at.
SPEEDS = {"kinematic": 0.627, "bluerov2": 0.6, "remus100": 1.5}

# Lanes of a patch: half their length and their distances from the patch's centre (m).
HALF_LANE = 15.0
LANES = (-15.0, -5.0, 5.0, 15.0)

FLEETS = ((3, 1), (3, 3), (10, 3), (100, 10), (1000, 50), (10_000, 200))

# Fleets that fly with dynamics: REMUS 100, which turn in 27 m, in the paper's square only; the logs
# of ten thousand BlueROV2 would fill the memory.
FLOWN = {"bluerov2": FLEETS[:-1], "remus100": ((3, 3), (10, 3))}

# Missions of larger fleets are measured only where somebody names them.
USUAL = 1000

Point = tuple[float, float]


def standard_missions() -> dict[str, Scenario]:
    """Return the standard missions by name, such as ``(10,3) kinematic``, smallest first.

    (N,M) has N AUVs and M ASVs.  Vehicles with six degrees of freedom are BlueROV2 or REMUS 100,
    which fly the same lanes.
    """
    missions = (
        standard_mission(*fleet, vehicle)
        for fleet in FLEETS
        for vehicle in SPEEDS
        if fleet in FLOWN.get(vehicle, FLEETS)
    )
    return {mission.name: mission for mission in missions}


def standard_mission(auvs: int, asvs: int, vehicle: str = "kinematic") -> Scenario:
    """Return the standard mission of a fleet: the package's defaults but for what follows.

    Pings are lost by overlap alone, so that a simulator with the same ranges hears the same.
    """
    return Scenario.model_validate(
        {
            "name": f"({auvs},{asvs}) {vehicle}",
            "duration_s": DURATION_S,
            "auvs": {"count": auvs, "vehicle": vehicle, "speed_m_per_s": SPEEDS[vehicle]},
            "asvs": {"count": asvs},
            "acoustics": {"loss": {"law": "none", "combine": "off"}},
        }
        if auvs <= DENSEST
        else _large(auvs, asvs, vehicle)
    )


def _large(auvs: int, asvs: int, vehicle: str) -> Mapping[str, Any]:
    growth = math.sqrt(auvs / DENSEST)
    patches, side = tuple(patch_lanes(auvs, growth * SIDE_M)), growth * SIDE_M
    around = growth * math.sqrt(ASVS / asvs)  # an ASV, over that of the paper's square
    is_shared = auvs > MOST_ANSWERED
    return {
        "name": f"({auvs},{asvs}) {vehicle}",
        "duration_s": DURATION_S,
        "survey": {"side_m": side},
        "auvs": {
            "count": auvs,
            "vehicle": vehicle,
            "speed_m_per_s": SPEEDS[vehicle],
            "route": {"kind": "waypoints", "points_m": patches},
        },
        "asvs": {"count": asvs, "formation": {"positions_m": tuple(spread(asvs, side))}},
        "acoustics": {
            "hf": {"range_m": HF_RANGE_M * around},
            "mf": _shared_band(auvs / asvs, around) if is_shared else _rotating_band(growth),
            "loss": {"law": "none", "combine": "off"},
        },
        "protocol": _shared_protocol(around) if is_shared else {},
        # Every ping's way to every ASV, and every frame's to every AUV, would fill the memory.
        "record": {"detail": "summary" if is_shared else "full"},
    }


def _rotating_band(growth: float) -> Mapping[str, float]:
    """Return the MF band of one ASV that answers all: it grows lest rounds be but waiting."""
    return {"range_m": MF_RANGE_M * growth, "bit_rate_bps": BIT_RATE_BPS * growth**2}


def _shared_band(answered: float, around: float) -> Mapping[str, float]:
    """Return the MF band of ASVs that answer so many AUVs each: the paper's ten take as long."""
    return {"range_m": MF_RANGE_M * around, "bit_rate_bps": BIT_RATE_BPS * answered / DENSEST}


def _shared_protocol(around: float) -> Mapping[str, Any]:
    """Return the protocol of ASVs that answer in parallel: the paper's guards for what is around
    one of them.
    """
    crossing = crossing_time(SIDE_M * around)
    return {
        "broadcaster": "parallel",
        "uplink_guard_s": UPLINK_GUARD * crossing,
        "shortest_uplink_slot_s": SHORTEST_UPLINK * crossing,
        "downlink_guard_s": DOWNLINK_GUARD * crossing,
        "shortest_downlink_slot_s": SHORTEST_DOWNLINK * crossing,
    }


def spread(count: int, side: float) -> Iterator[Point]:
    """Yield `count` points [x, y] (m) spread evenly over a square, in rows from the lowest y.

    >>> list(spread(3, 8.0))
    [(0.0, -2.0), (-2.0, 2.0), (2.0, 2.0)]
    """
    rows = round(math.sqrt(count))
    for row in range(rows):
        first, beyond = row * count // rows, (row + 1) * count // rows
        for column in range(beyond - first):
            x = side * ((column + 0.5) / (beyond - first) - 0.5)
            yield x, side * ((row + 0.5) / rows - 0.5)


def patch_lanes(auvs: int, side: float) -> Iterator[tuple[Point, ...]]:
    """Yield the waypoints (m) of each AUV: lanes over a patch of its own.

    Neighbours begin at different corners, so that they do not move as one.
    """
    for number, (x, y) in enumerate(spread(auvs, side)):
        along = HALF_LANE if number % 2 else -HALF_LANE
        across = 1.0 if number // 2 % 2 else -1.0
        ends = [(sign * along, across * lane) for lane in LANES for sign in (1.0, -1.0)]
        for lane in range(1, len(LANES), 2):  # there and back
            ends[2 * lane : 2 * lane + 2] = reversed(ends[2 * lane : 2 * lane + 2])
        yield tuple((x + ahead, y + aside) for ahead, aside in ends)
