"""Small worlds that tests put together."""

from collections.abc import Iterator, Sequence
from itertools import islice
from typing import Any

import numpy as np

from bindusbl_des import Mission, Scenario, Setup
from bindusbl_des.core.scenario.files.scenario_file import Source


def parse_scenario(text: str, name: str = "scenario", *, overrides: Sequence[str] = ()) -> Scenario:
    """Return the scenario of a text; `name` stands for the file in messages."""
    return Source(text, name, overrides=tuple(overrides)).read()[1]


def blank(kind: np.dtype, count: int) -> np.ndarray:
    """Return records in which nothing has happened yet."""
    rows = np.zeros(count, dtype=kind)
    for name in rows.dtype.names:
        rows[name] = np.nan if rows[name].dtype.kind == "f" else -1
    return rows


QUIET_USBL = {
    "tdoa_sd_s": 0.0, "travel_time_sd_s": 0.0, "quantum_s": 0.0,
    "roll_sd_deg": 0.0, "pitch_sd_deg": 0.0, "heading_sd_deg": 0.0,
}  # fmt: skip
QUIET_NAVIGATION = {
    "velocity_bias_m_per_s": [0.0, 0.0], "random_walk_m_per_sqrt_s": 0.0, "depth_sd_m": 0.0,
}  # fmt: skip

# A good inertial system: fixes at the paper's gain do harm.
GOOD = {
    "survey": {"side_m": 500.0},
    "acoustics": {"hf": {"range_m": 300.0}, "mf": {"range_m": 600.0}},
    "navigation": {"filter": "fixed_gain", "velocity_bias_m_per_s": [0.0032, 0.0032]},
    "record": {"detail": "summary"},
}


def lanes_over_square(
    side: float,
    total: int,
    number: int,
    *,
    spacing: float,
    margin: float,
    radius: float,
    start: str = "strip_centre",
    turns: str = "shortest",
) -> Any:
    """Return the path of one AUV of a team over its strip of a square (m)."""
    route = {"lane_spacing_m": spacing, "end_margin_m": margin, "start": start, "turns": turns}
    vehicle = {"model": "kinematic", "turning_radius_m": radius}
    auvs = {"count": total, "vehicle": vehicle, "route": {"kind": "lawnmower", **route}}
    return Setup(scenario(survey={"side_m": side}, auvs=auvs)).plans[number].path


def merged(base: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """Return nested plain data with changes laid over it; another part is that part alone."""
    out = dict(base)
    for name, value in changes.items():
        now = out.get(name)
        both = isinstance(value, dict) and isinstance(now, dict)
        both = both and value.get("model", now.get("model")) == now.get("model")
        out[name] = merged(out[name], value) if both else value
    return out


def scenario(**changes: Any) -> Scenario:
    """Return the default scenario with changes."""
    return Scenario.model_validate(merged({"name": "test"}, changes))


def still(count: int = 3, *, side: float = 60.0, at: float = 20.0, **changes: Any) -> Scenario:
    """Return AUVs that hold still `at` metres from one ASV, without loss, on the paper's clock."""
    base = {
        "survey": {"side_m": side},
        "auvs": {
            "count": count,
            "route": {"kind": "hold", "positions_m": [[at, 0.0]] * count},
        },
        "asvs": {"count": 1},
        "acoustics": {"loss": {"law": "none"}},
        "protocol": {"tick_rate_hz": 30.0},
    }
    return scenario(**merged(base, changes))


def packets_of(plan: Scenario, seed: int, many: int) -> list[list[float]]:
    """Return the first instants (s) at which each AUV has something to send."""
    found: dict[str, list[float]] = {}

    def spy(node: Any) -> Iterator[Any]:
        found[node.name] = list(islice(node.packets, many))
        yield node.wait(0.0)

    Mission(Scenario.model_validate(merged(plan.model_dump(), {"protocol": {"access": spy}})), seed)
    return [found[f"AUV{auv}"] for auv in range(plan.auvs.count)]


LOUD: dict[str, Any] = {"model": "sonar", "shadowing_sd_db": 0.0, "snr_threshold_db": 10.0}


def holding(*places: tuple[float, float], channel: dict[str, Any], **changes: Any) -> Scenario:
    """Return AUVs that hold still 10 m deep, heard by a sonar of an ASV at the origin, without
    noise.
    """
    base = {
        "duration_s": 20.0,
        "survey": {"side_m": 60.0, "depth_m": 10.0},
        "auvs": {"count": len(places), "route": {"kind": "hold", "positions_m": list(places)}},
        "asvs": {"count": 1},
        "acoustics": {"hf": {"range_m": 50.0, "channel": {**LOUD, **channel}}},
        "usbl": {**QUIET_USBL, "gnss_sd_m": 0.0},
        "navigation": QUIET_NAVIGATION,
        "record": {"detail": "full"},
    }
    return scenario(**merged(base, changes))


def paper_case(asvs: int, angle_deg: float = 0.0, **changes: Any) -> Scenario:
    """Return the paper's case study: L = 140 m, three AUVs."""
    base = {
        "asvs": {"count": asvs, "formation": {"angle_deg": angle_deg}},
        "auvs": {"route": {"kind": "lawnmower", "end_margin_m": 5.0}},
        "acoustics": {"loss": {"combine": "clamp_first"}},
        "protocol": {"tick_rate_hz": 30.0},
        "navigation": {"filter": {"model": "fixed_gain", "delay_compensation": "none"}},
        "record": {"detail": "summary"},
    }
    return scenario(**merged(base, changes))
