"""Missions of programs of access: AUVs that hold their places around one ASV."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from worlds import merged, scenario

from bindusbl_des import Result, Scenario, simulate

SPEED, PING_S = 1500.0, 0.010
Program = Callable[[Any], Iterator[Any]]


def held(places: list[list[float]], access: Any, **changes: Any) -> Scenario:
    """AUVs that hold their places at 10 m around one ASV at the origin, without loss."""
    base = {
        "duration_s": 20.0,
        "survey": {"side_m": 200.0, "depth_m": 10.0},
        "auvs": {
            "count": len(places),
            "route": {"kind": "hold", "positions_m": places},
        },
        "asvs": {"count": 1, "formation": {"positions_m": [[0.0, 0.0]]}},
        "acoustics": {
            "loss": {"law": "none"},
            "hf": {"range_m": 100.0, "range_metric": "slant", "bit_rate_bps": 1000.0},
        },
        "protocol": {"access": access, "frame_s": 2.0, "tick_rate_hz": None},
    }
    return scenario(**merged(base, changes))


def way_s(here: list[float], there: list[float], depth: float = 0.0) -> float:
    """Return how long (s) sound travels between two places (m), of which one is so much deeper."""
    return float(np.hypot(np.hypot(here[0] - there[0], here[1] - there[1]), depth)) / SPEED


def flown(places: list[list[float]], program: Program, **changes: Any) -> Result:
    """Return a mission of a program, no more than so many vehicles at their places."""
    return simulate(held(places, program, **changes), 1)
