"""Missions in which every key can be toggled, to see by experiment which of them do nothing."""

import json
from copy import deepcopy
from functools import lru_cache
from pathlib import Path
from typing import Any

import pyarrow as pa

from bindusbl_des import Scenario, simulate
from bindusbl_des.core.scenario.families import FAMILIES
from bindusbl_des.core.scenario.keys import OWN_PART, Key, keys, settable, settings
from bindusbl_des.models.presets.modems import table_file

Data = dict[str, Any]
TRACKS = Path(__file__).parent / "reference" / "tracks"

# Three missions in which, between them, everything happens: lanes with turns under ticks; vehicles
# that steer by their estimates in a current; far hearing, loss and two-way ranging.
BASES: dict[str, Data] = {
    "lanes": {
        "duration_s": 30.0,
        "survey": {"side_m": 80.0},
        "auvs": {
            "speed_m_per_s": 6.0,
            "vehicle": {"model": "kinematic", "turning_radius_m": 4.0},
            "route": {"kind": "lawnmower", "lane_spacing_m": 5.0},
        },
        "asvs": {"count": 2, "formation": {"angle_deg": 10.0}},
        "acoustics": {
            "hf": {"range_m": 60.0},
            "mf": {"range_m": 70.0},
            "loss": {"combine": "clamp_first"},
        },
    },
    "steered": {
        "duration_s": 60.0,
        "survey": {"side_m": 26.0},
        "auvs": {"vehicle": "bluerov2", "feedback": "estimate", "speed_m_per_s": 0.6},
        "asvs": {"count": 2, "vehicle": "otter", "formation": {"radius_m": 10.0}},
        "environment": {"current_m_per_s": 0.1, "current_variation_m_per_s": 0.03},
        "acoustics": {"hf": {"range_m": 18.0}, "mf": {"range_m": 25.0}, "loss": {"law": "head"}},
        "navigation": {"velocity": "through_water"},
    },
    "called": {
        "duration_s": 30.0,
        "survey": {"side_m": 200.0, "depth_m": 40.0},
        "auvs": {"speed_m_per_s": 4.0},
        "asvs": {"count": 2, "formation": {"angle_deg": 20.0, "clearance_m": 5.0}},
        "environment": {"current_m_per_s": 0.1, "current_variation_m_per_s": 0.03},
        "acoustics": {
            "hf": {"range_m": 150.0, "range_metric": "slant"},
            "loss": {"law": "thesis", "combine": "paper_raw"},
        },
        "protocol": {"ranging": {"model": "twtt", "turnaround_s": 0.02}, "tick_rate_hz": 30.0},
        "navigation": {"velocity": "through_water"},
    },
}

ROUTES: dict[str, Data] = {
    "lawnmower": {"kind": "lawnmower", "lane_spacing_m": 5.0},
    "hold": {"kind": "hold", "positions_m": [[10.0, 12.0], [0.0, 0.0], [12.0, -5.0]]},
    "waypoints": {
        "kind": "waypoints",
        "points_m": [
            [[0.0, 0.0], [12.0, 10.0], [0.0, 12.0]],
            [[-12.0, -12.0], [10.0, -11.0]],
            [[5.0, -5.0], [-10.0, 12.0]],
        ],
    },
    "track": {"kind": "track", "files": [str(TRACKS / f"auv{auv}.csv") for auv in range(3)]},
}

# Placements that need other keys than those of a ring
FORMATIONS: dict[str, Data] = {
    "positions": {"model": "positions", "positions_m": [[9.0, 0.0], [-9.0, 3.0]]},
    **{name: {"model": name} for name in ("follow", "assign", "zigzag", "visit", "information")},
    "track": {"model": "track", "files": [str(TRACKS / f"asv{asv}.csv") for asv in range(2)]},
}

# What a curve is of, where one is chosen
CURVE = str(Path(__file__).parents[1] / "bindusbl_des/models/presets/ahoi_delivery.csv")
# Parts that need settings, with some
EXAMPLES: dict[str, Data] = {
    "curve": {"model": "curve", "file": CURVE},
    "datasheet": {"model": "datasheet", "bearing_sd_deg": 2.0},
}

# Values for keys whose default cannot just be made a little larger.
OTHERS: dict[str, list[Any]] = {
    "auvs.route.end_margin_m": [2.0, 11.0],
    "auvs.route.surface_every_s": [9.0],
    "survey.rotation_deg": [25.0],
    "environment.surface_m": [372.0],
    "survey.crs": ["EPSG:32760"],
    "survey.area_name": ["north"],
    "auvs.route.crs": ["EPSG:32760"],
    "auvs.route.routes": [["north", "middle", "south"]],
    "survey.depths_m": [[4.0, 6.0, 9.0]],
    "auvs.speeds_m_per_s": [[0.5, 0.7, 0.6]],
    "auvs.ping_late_s": [[0.0, 0.004, 0.09]],
    "auvs.launch_m": [[[3.0, -4.0]]],
    "auvs.recovery_m": [[[3.0, -4.0]]],
    "asvs.formation.clearance_m": [3.0],
    "asvs.formation.radius_m": [8.0],
    "asvs.failures": [[{"asv": 0, "at_s": 9.0}]],
    "asvs.formation.hysteresis": [1.0],
    "asvs.formation.amplitude_m": [7.0],
    "asvs.formation.period_s": [13.0],
    "asvs.formation.replan_s": [4.0],
    "environment.current_m_per_s": [0.15],
    "environment.current_variation_m_per_s": [0.02],
    "environment.current_direction_deg": [70.0],
    "environment.sound_speed_m_per_s": [1480.0],
    "environment.assumed_sound_speed_m_per_s": [1490.0],
    "environment.temperature_c": [8.0],
    "environment.salinity_psu": [20.0],
    "acoustics.hf.range_m": [14.0, 45.0],
    "acoustics.mf.range_m": [9.0, 30.0],
    "acoustics.loss.cap": [0.02],
    "acoustics.loss.contention_per_auv": [0.3],
    "acoustics.hf.modem": ["sonardyne_wideband2"],
    "acoustics.mf.modem": ["s2cr_48_78"],
    "acoustics.mf.airtimes": [table_file("s2c_airtimes.csv")],
    "acoustics.mf.payload_bytes": [24],
    "protocol.tick_rate_hz": [7.0],
    "protocol.frame_s": [2.5],
    "protocol.conflict_margin_m": [20.0, 100.0],
    "protocol.ranging.turnaround_s": [0.2],
    "protocol.forget_after_s": [5.0],
    "usbl.gnss_sd_m": [0.4],
    "navigation.velocity_bias_m_per_s": [[0.1, -0.02]],
    "navigation.clock_drift_sd": [1e-5],
    "navigation.scale_factor_sd": [0.02],
    "navigation.heading_sd_deg": [2.0],
    "navigation.velocity_bias_time_constant_s": [20.0],
    "navigation.filter.gain": [0.4],
    "navigation.nis_gate": [0.1],
    "usbl.preset": ["tracklink_1500", "cerulean_rovl"],
    "navigation.drift.preset": ["rlg_dvl_sea", "rlg_dvl_river"],
    **{family.key: list(family.siblings) for family in FAMILIES},
}

# What tables do not show: names, places for exports, lists that belong to a number of vehicles.
UNSEEN = (
    "environment.surface_m", "auvs.endurance_s",
    "name", "environment.origin.lat_deg", "environment.origin.lon_deg", "auvs.route.positions_m",
    "auvs.route.points_m", "auvs.route.files", "auvs.route.time_offset_s",
    "asvs.formation.positions_m", "asvs.formation.model", "environment.ctd",
    "auvs.route.positions_deg", "auvs.route.points_deg", "auvs.route.tracks",
    "asvs.formation.start_m", "asvs.formation.files", "asvs.formation.tracks",
    "asvs.formation.time_offset_s",
    "asvs.formation.positions_m", "asvs.formation.positions_deg", "asvs.formation.model",
    "survey.size_m", "survey.polygon_m", "survey.polygon_deg", "survey.area", "survey.area_name",
    "survey.crs", "auvs.route.crs", "auvs.route.routes",
    "survey.depths_m", "auvs.speeds_m_per_s", "auvs.launch_m", "auvs.recovery_m",
)  # fmt: skip

# Besides each choice: values that turn something off, or sheets that say something else.
SWITCHED_OFF: tuple[tuple[str, Any], ...] = (
    ("auvs.count", 1),
    ("asvs.count", 1),
    ("environment.current_m_per_s", 0.0),
    ("environment.current_variation_m_per_s", 0.0),
    ("navigation.velocity_bias_m_per_s", [0.0, 0.0]),
    ("survey.depth_m", 0.0),
    ("navigation.drift", {"percent_of_distance": 2.0}),
    ("navigation.drift", {"m_per_hour": 40.0}),
    ("navigation.drift", {"percent_of_distance": 2.0, "line_m": 50.0}),
)


def modes() -> list[tuple[str, Any]]:
    """Return every choice of every key, and what can be switched off."""
    choices = [(row.key, choice) for row in keys() for choice in row.choices]
    return [*(it for it in choices if it[1] != OWN_PART), *SWITCHED_OFF]


def toggled() -> list[str]:
    """Return the keys that can be toggled."""
    return [row.key for row in keys() if row.key not in UNSEEN]


def owners(key: str) -> list[str]:
    """Return the parts that have a setting; none for a key of the scenario itself."""
    row = next((row for row in settings() if row.key == key), None)
    return row.only.split(", ") if row and row.only else []


def alternatives(key: str, now: Any) -> list[Any]:
    """Return other values for a key than the one it has now."""
    row = next(row for row in settable() if row.key == key)
    values = OTHERS.get(key) or list(row.choices) or [_larger(row, now)]
    return [value for value in values if value not in (now, OWN_PART)]


def _larger(row: Key, now: Any) -> Any:
    value = float(now if now is not None else 1.0)
    if row.kind.startswith("whole"):
        return int(value) + 1
    return value * 1.37 if value else 0.5


def put(data: Data, key: str, value: Any) -> Data:
    """Return plain data with another value of a key; a kind of route brings its places."""
    out = deepcopy(data)
    if key == "auvs.route.kind":
        out.setdefault("auvs", {})["route"] = deepcopy(ROUTES.get(value, {"kind": value}))
        return out
    if key == "asvs.formation.model" and value in FORMATIONS:
        out.setdefault("asvs", {})["formation"] = deepcopy(FORMATIONS[value])
        return out
    *sections, last = key.split(".")
    part = out
    for name in sections:
        if isinstance(part.get(name), str):  # a part without settings, by its name
            part[name] = {"model": part[name]}
        part = part.setdefault(name, {})
    part[last] = EXAMPLES.get(value, value) if isinstance(value, str) else value
    return out


def value_of(data: Data, key: str) -> Any:
    """Return the value that a key has in the scenario of plain data, None where it has none."""
    try:
        value: Any = Scenario.model_validate({"name": "m", **data}).model_dump(mode="json")
    except ValueError:
        return None
    for name in key.split("."):
        value = value.get(name) if isinstance(value, dict) else None
    return value["model"] if isinstance(value, dict) and "model" in value else value


def columns_that_differ(one: Data, other: Data) -> set[str] | None:
    """Return the columns in which two missions differ; None where one of them is refused."""
    columns = _columns(json.dumps(one)), _columns(json.dumps(other))
    if columns[0] is None or columns[1] is None:
        return None
    names = {**columns[0], **columns[1]}
    return {name for name in names if not _same(*(it.get(name) for it in columns))}


def _same(one: pa.ChunkedArray | None, other: pa.ChunkedArray | None) -> bool:
    """Tell whether columns hold the same; to Arrow no two are that hold what is no number."""
    if one is None or other is None:
        return False
    return one.equals(other) or repr(one.to_pylist()) == repr(other.to_pylist())


@lru_cache(maxsize=256)
def _columns(text: str) -> dict[str, pa.ChunkedArray] | None:
    try:
        scenario = Scenario.model_validate({"name": "m", **json.loads(text)})
        result = simulate(scenario, 3)
    except ValueError:
        return None
    return {
        f"{table}.{column}": rows[column]
        for table, rows in result.arrow.items()
        for column in rows.column_names
    }
