"""Scenarios drawn from the JSON Schema itself: ends of ranges, choices, nested routes, nulls."""

import faulthandler
import json
import math
import random
import signal
import sys
import traceback
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from bindusbl_des import Scenario, Setup, simulate, warnings_of
from bindusbl_des.apps.preflight.effort import effort
from bindusbl_des.apps.preflight.round_lengths import rounds_of
from bindusbl_des.core.scenario.agreement.instruments import REPLACED_BY_DRIFT
from bindusbl_des.core.scenario.keys import json_schema
from bindusbl_des.core.scenario.sections.acoustics import Downlink, modem_values
from bindusbl_des.core.scenario.sections.survey import SHAPES
from bindusbl_des.core.scenario.shipped_settings import OF_ACCURACY, OF_ANGLES
from bindusbl_des.dynamics import parameters
from bindusbl_des.models.presets.modems import table_file

SCHEMA = json_schema()
# Modems are given apart: they leave all else as it was drawn before there were any.
DRAWN = {name: part for name, part in SCHEMA["properties"].items() if name != "modems"}
TINIEST = 5e-324

# Keys whose values are drawn apart: a short mission of a small fleet is most of what is drawn.
DURATIONS_S = (0.001, 0.01, 0.3, 1.0, 3.0, 10.0, 30.0, 60.0)
MOST_VEHICLES, LARGER_FLEET = 6, 60

# What groups of AUVs may say of themselves; half of it fits most that is drawn.
OF_GROUPS: tuple[tuple[str, tuple[Any, ...]], ...] = (
    ("vehicle", ("remus100", "bluerov2", {"model": "kinematic", "turning_radius_m": 0.5})),
    ("speed_m_per_s", (0.3, 1.5)),
    ("depth_m", (0.0, 3.0, 25.0)),
    ("route", ({"kind": "lawnmower", "lane_spacing_m": 7.0},)),
    ("drift", ({"percent_of_distance": 1.0}, {"m_per_hour": 50.0})),
    ("velocity_bias_sd_m_per_s", (0.0, 0.1)),
    ("velocity_bias_time_constant_s", (10.0,)),
    ("heading_sd_deg", (0.0, 3.0)),
    ("feedback", ("truth", "estimate")),
)

# How often a key is written at all, and how often its value is an end of its range.
WRITTEN, AT_AN_END, NULL = 0.35, 0.4, 0.3

# Of how many the plainest contradictions are taken out, so that they are run and not just refused.
SETTLED = 0.9


CURVE = str(Path(__file__).parents[1] / "bindusbl_des/models/presets/ahoi_delivery.csv")

# Six elements in places that lean on no axis (m)
OWN_ARRAY = [
    *([0.05, 0.0, -0.02], [-0.03, 0.04, -0.03], [-0.03, -0.04, 0.0]),
    *([0.0, 0.01, 0.06], [0.02, 0.0, 0.03], [0.0, 0.04, 0.01]),
]

# Lists with an item per AUV (and an item, where none is drawn).
LISTED: dict[tuple[str, str], list[Any]] = {
    ("survey", "depths_m"): [10.0],
    ("auvs", "speeds_m_per_s"): [0.6],
    ("auvs", "ping_late_s"): [0.01],
    ("auvs", "launch_m"): [[0.0, 0.0]],
    ("auvs", "recovery_m"): [[5.0, 0.0]],
}


def drawn(seed: int, folder: Path) -> dict[str, Any]:
    """Return the plain data of a scenario; its track files, if any, are written to a folder."""
    draw = random.Random(seed)
    data: dict[str, Any] = _object({**SCHEMA, "properties": DRAWN}, draw, ())
    data["name"] = f"drawn {seed}"
    if "duration_s" not in data or draw.random() < 0.95:
        data["duration_s"] = draw.choice(DURATIONS_S)
    if seed % 4 == 0 and "array" in data.get("usbl", {}):
        data["usbl"]["array"] = OWN_ARRAY
    _matched(data, draw, folder)
    if draw.random() < SETTLED:
        _settled(data, draw)
    _quieter(data, random.Random(f"quieter {seed}"))
    _wired(data, random.Random(f"wired {seed}"))
    _grouped(data, random.Random(f"grouped {seed}"))
    _islands(data, random.Random(f"islands {seed}"))
    return data


def _grouped(data: dict[str, Any], draw: random.Random) -> None:
    """Split the AUVs in groups now and then, which say something of their own."""
    auvs = data.get("auvs") or {}
    count = auvs.get("count", 3)
    if draw.random() > 0.15 or not 1 < count <= LARGER_FLEET:
        return
    first = draw.randint(1, count - 1)
    said = {name: draw.choice(values) for name, values in OF_GROUPS if draw.random() < 0.4}
    groups = [{"count": first, **said}, {"count": count - first}]
    data.setdefault("auvs", {})["groups"] = groups[:: draw.choice((1, -1))]


def _islands(data: dict[str, Any], draw: random.Random) -> None:
    """Lay land, and water where nobody goes, into the sea now and then."""
    for name in ("land", "keep_out"):
        if draw.random() < 0.1:
            (x, y), size = _point(draw), draw.choice((1.0, 8.0, 50.0))
            corners = [[x, y], [x + size, y], [x + size / 2, y + size]]
            data.setdefault("survey", {})[name] = [corners]


def _wired(data: dict[str, Any], draw: random.Random) -> None:
    """Give vehicles modems now and then, where nothing else is to listen."""
    protocol, navigation = data.get("protocol") or {}, data.get("navigation") or {}
    listens = "passive" in str(protocol.get("ranging")) or {"access"} & protocol.keys()
    if draw.random() < 0.1 and not listens and "peers" not in navigation:
        data["modems"] = {"make": draw.choice(("seatrac", "evologics"))}


def _quieter(data: dict[str, Any], draw: random.Random) -> None:
    """Take out most of what AUVs say beside pings: little goes with it, and less is proved."""
    protocol, navigation = data.get("protocol") or {}, data.get("navigation") or {}
    for section, name, kept in (
        (navigation, "peers", 0.3), (data, "traffic", 0.3), (protocol, "relay", 0.4),
        (protocol, "acknowledge", 0.4), (protocol, "repeat", 0.4),
    ):  # fmt: skip
        if draw.random() > kept:
            section.pop(name, None)
    if "who" in (relay := protocol.get("relay") or {}):  # or a list of AUVs, each once
        relay["who"] = "all"


# Keys that are drawn apart
APART = (
    ("auvs", "groups"), ("asvs", "groups"), ("survey", "land"), ("survey", "keep_out"),
    ("environment", "wind"), ("environment", "bathymetry"), ("auvs", "depth"),
    ("navigation", "dvl_range_m"),
)  # fmt: skip


def _object(schema: dict[str, Any], draw: random.Random, path: tuple[str, ...]) -> dict[str, Any]:
    out = {}
    for name, part in schema["properties"].items():
        if (*path, name) in APART:
            continue
        is_section = "$ref" in part or any("$ref" in arm for arm in part.get("anyOf", ()))
        if name in schema.get("required", ()) or draw.random() < (0.7 if is_section else WRITTEN):
            out[name] = _value(part, draw, (*path, name))
    return out


def _value(schema: dict[str, Any], draw: random.Random, path: tuple[str, ...]) -> Any:
    if "$ref" in schema:
        return _value(SCHEMA["$defs"][schema["$ref"].rpartition("/")[2]], draw, path)
    if path == ("usbl", "array"):
        return draw.choice(schema["anyOf"][0]["enum"])
    if "anyOf" in schema:
        arms = [arm for arm in schema["anyOf"] if not _is_own(arm)]
        arms = [arm for arm in arms if arm.get("const") != "bathymetry"]  # which is drawn apart
        if any(arm.get("type") == "number" for arm in arms):  # angles, which may be texts as well
            arms = [arm for arm in arms if arm.get("type") != "string"]
        nulls = [arm for arm in arms if arm.get("type") == "null"]
        if nulls and draw.random() < NULL:
            return None
        return _value(draw.choice([arm for arm in arms if arm not in nulls]), draw, path)
    if "const" in schema:
        return schema["const"]
    if "enum" in schema:
        return draw.choice(schema["enum"])
    kind = schema["type"]
    if kind == "object" and "properties" in schema and "additionalProperties" not in schema:
        return _object(schema, draw, path)
    if kind == "object" and schema.get("additionalProperties") is False:
        out = _object(schema, draw, path)
        named = [
            name for name in ("kind", "model") if "const" in schema["properties"].get(name, {})
        ]
        return out | {name: schema["properties"][name]["const"] for name in named}
    if path[-1] == "assumes":  # keys of other sections, which a filter takes for something else
        return {"navigation": {"scale_factor_sd": draw.choice((0.0, 0.01, 0.6))}}
    if kind == "object":  # a vehicle with coefficients
        return _vehicle(schema, draw)
    if kind == "boolean":
        return draw.random() < 0.5
    if kind in ("number", "integer"):
        return _number(schema, draw)
    if kind == "array":
        return _array(schema, draw, path)
    if kind == "boolean":
        return draw.random() < 0.5
    assert kind == "string", schema
    return "text"


def _is_own(schema: dict[str, Any]) -> bool:
    """Tell whether a value would be a part of somebody's own, which nobody has."""
    if "$ref" in schema:
        return schema["$ref"].rpartition("/")[2].startswith("Own")
    model = schema.get("properties", {}).get("model", schema)
    return model.get("pattern", "").startswith("^[^:]+:")


def _number(schema: dict[str, Any], draw: random.Random) -> float | int:
    whole = schema["type"] == "integer"
    low = schema.get("minimum", schema.get("exclusiveMinimum", -1e9))
    high = schema.get("maximum", schema.get("exclusiveMaximum", 1e9))
    is_open = "exclusiveMinimum" in schema
    if whole:
        return draw.choice((low, high, draw.randint(low, min(high, low + 9))))
    if draw.random() < AT_AN_END:
        lowest = draw.choice((TINIEST, 1e-300, 1e-12, 1e-3)) if is_open else low
        return draw.choice((lowest, float(high)))
    if low >= 0:  # any order of magnitude
        return float(min(high, max(low, 10 ** draw.uniform(-6, math.log10(high)))))
    return draw.choice((0.0, draw.uniform(low, high), draw.uniform(-1, 1) * min(high, 100.0)))


def _array(schema: dict[str, Any], draw: random.Random, path: tuple[str, ...]) -> list[Any]:
    if "prefixItems" in schema:
        return [_value(item, draw, path) for item in schema["prefixItems"]]
    return [_value(schema["items"], draw, path) for _ in range(draw.randint(0, 4))]


def _vehicle(schema: dict[str, Any], draw: random.Random) -> Any:
    models = [it for it in schema["properties"]["model"]["enum"] if it != "sailboat"]  # needs wind
    model = draw.choice(models)
    if model in ("kinematic", "moored") or draw.random() < 0.6:
        return model
    numbers = {
        name: value
        for name, value in asdict(parameters(model, {})).items()
        if isinstance(value, float)
    }
    name = draw.choice(sorted(numbers))
    return {"model": model, name: numbers[name] * draw.choice((0.0, 0.5, 0.9, 1.1, 2.0, -1.0, 1e6))}


def _matched(data: dict[str, Any], draw: random.Random, folder: Path) -> None:
    """Make most fleets small, give lists an item per vehicle, and write the tracks."""
    counts = {}
    for fleet in ("auvs", "asvs"):
        part = data.get(fleet)
        if part is None:
            counts[fleet] = 3
            continue
        if draw.random() < 0.97 and part.get("count", 3) > MOST_VEHICLES:
            most = LARGER_FLEET if draw.random() < 0.05 else MOST_VEHICLES
            part["count"] = draw.randint(1, most)
        counts[fleet] = part.get("count", 3)
    route = data.get("auvs", {}).get("route", {})
    few = min(counts["auvs"], 200)
    if route.get("kind") == "hold":
        route["positions_m"] = [_point(draw) for _ in range(few)]
    if route.get("kind") == "waypoints":
        route["points_m"] = [[_point(draw) for _ in range(draw.randint(2, 5))] for _ in range(few)]
        route.pop("files", None)
    if route.get("kind") == "track":
        file = folder / f"track{draw.randrange(10**9)}.csv"
        speed = draw.choice((0.0, 0.1, 2.0, 900.0, 2e4))
        first = route.get("time_offset_s", 0.0) if draw.random() < 0.8 else 0.0
        ways = [speed * t * draw.uniform(-0.5, 0.5) for t in (0, 1, 7.5, 40)]
        rows = [f"{first + t!r},{x},{-x / 2},5" for t, x in zip((0, 1, 7.5, 40), ways, strict=True)]
        file.write_text("\n".join(["time_s,x_m,y_m,depth_m", *rows]))
        route["files"] = [str(file)] * few
    if data.get("environment", {}).get("ctd") is not None:
        file = folder / "cast.csv"
        deepest = draw.choice((40.0, 300.0, 12e3))
        file.write_text(f"depth_m,sound_speed_m_per_s\n0,1510\n9,1490\n{deepest},1480\n")
        data["environment"]["ctd"] = str(file)
    if data.get("survey", {}).get("area") is not None:
        file = folder / "area.geojson"
        lat, size = draw.choice((-60.0, 0.0, 54.3)), draw.choice((1e-4, 1e-3, 0.05))
        ring = [[10.0 + size * x, lat + size * y] for x, y in ((0, 0), (2, 0), (2, 1), (0, 0))]
        file.write_text(json.dumps({"type": "Polygon", "coordinates": [ring]}))
        data["survey"]["area"] = str(file)
    for owner in (data.get("survey", {}), route):  # names and grids are of files that have some
        for name in ("crs", "area_name", "routes"):
            owner.pop(name, None)
    for section, name in LISTED:
        given = data.get(section, {})
        if given.get(name) is not None:
            given[name] = [(given[name] or LISTED[section, name])[0]] * few
    for number, failure in enumerate(data.get("asvs", {}).get("failures", ())):
        failure["asv"] = number % max(counts["asvs"], 1)
        if failure.get("until_s") is not None and draw.random() < 0.9:
            failure["until_s"] = failure["at_s"] + draw.choice((1e-6, 1.0, 20.0))
    formation = data.get("asvs", {}).get("formation", {})
    _moving(formation, data, counts["asvs"], draw, folder)
    if draw.random() < 0.9:  # these need a place on Earth
        formation.pop("positions_deg", None)
        route.pop("positions_deg", None)
        route.pop("points_deg", None)
    if formation.get("positions_m") is not None:
        count = min(counts["asvs"], 200)
        formation["positions_m"] = [_point(draw) for _ in range(count)]
        for name in ("radius_m", "clearance_m", "angle_deg"):
            if draw.random() < 0.9:
                formation.pop(name, None)
    elif draw.random() < 0.9 and formation.get("radius_m") is not None:
        formation.pop("clearance_m", None)


def _moving(
    formation: dict[str, Any], data: dict[str, Any], asvs: int, draw: random.Random, folder: Path
) -> None:
    """Let ASVs that move have a start or a track each, and no hull."""
    few = min(asvs, 200)
    if formation.get("model") in ("follow", "assign", "zigzag", "visit", "information", "track"):
        data["asvs"].pop("vehicle", None)
    if formation.get("start_m") is not None:
        formation["start_m"] = [_point(draw) for _ in range(few)]
    if formation.get("model") == "track":
        file = folder / f"vessel{draw.randrange(10**9)}.csv"
        first = formation.get("time_offset_s", 0.0)
        rows = [f"{first + t!r},{2 * t},{-t},0" for t in (0, 1, 7.5, 40)]
        file.write_text("\n".join(["time_s,x_m,y_m,depth_m", *rows]))
        formation["files"] = [str(file)] * few
        formation.pop("tracks", None)


# Of a polygon, before it is as large as is drawn: 0.1 deg east and it is beyond 180 deg
CORNERS_DEG = ((0, 0), (4, 0), (4, 1), (1, 2))


def _shaped(survey: dict[str, Any], draw: random.Random) -> None:
    """Leave one shape of the survey, of a polygon mostly corners that go round."""
    given = [name for name in SHAPES if survey.get(name) is not None]
    kept = draw.choice(given) if given else "side_m"
    for name in SHAPES:
        if name != kept:
            survey.pop(name, None)
    if kept == "side_m" and survey.get("side_m", 1.0) is None:
        del survey["side_m"]
    if kept not in ("side_m", "size_m"):
        survey.pop("rotation_deg", None)
    if kept == "polygon_deg":
        lat, size = draw.choice((-60.0, 0.0, 54.3)), draw.choice((1e-4, 1e-3, 0.05))
        survey["polygon_deg"] = [
            [lat + size * y, math.remainder(179.9 + size * x, 360.0)] for x, y in CORNERS_DEG
        ]
    if kept == "polygon_m":
        bearings = [2 * math.pi * k / 7 for k in range(7)]
        (x, y), scale = _point(draw), draw.choice((3.0, 100.0, 1e4))
        survey["polygon_m"] = [
            [min(max(at + scale * draw.uniform(0.3, 1.0) * turn(b), -1e6), 1e6)
             for at, turn in ((x, math.cos), (y, math.sin))]
            for b in bearings
        ]  # fmt: skip


def _point(draw: random.Random) -> list[float]:
    scale = draw.choice((1.0, 10.0, 100.0, 1e3, 1e6))
    return [draw.choice((-scale, 0.0, scale, draw.uniform(-scale, scale))) for _ in range(2)]


def _settled(data: dict[str, Any], draw: random.Random) -> None:
    """Take out what is refused at sight, as somebody would who has read the message."""
    auvs, water = data.get("auvs", {}), data.get("environment", {})
    if "survey" in data and draw.random() < 0.97:
        _shaped(data["survey"], draw)
    _sized(data.get("acoustics", {}).get("mf", {}))
    for band in ("hf", "mf"):
        channel = data.get("acoustics", {}).get(band, {}).get("channel")
        if channel is not None and draw.random() < 0.9:
            data["acoustics"][band]["channel"] = _sounding(channel)
    origin = water.get("origin") or {}
    if len(origin) != 2 or None in origin.values():
        water.pop("origin", None)
    if water.get("ctd") is not None:
        water.pop("temperature_c", None)
    if water.get("ctd") is not None or water.get("temperature_c") is not None:
        water.pop("sound_speed_m_per_s", None)
    if "origin" not in water:
        water.pop("sound_speed_law", None)
    usbl = data.get("usbl", {})
    for name in ("tdoa_sd_s", "quantum_s"):
        if name in usbl and draw.random() < 0.7:
            usbl[name] = min(usbl[name], 1e-5)
    _one_drift(data.get("navigation", {}), draw)
    _one_sheet(data.get("usbl", {}), draw)
    dynamic = auvs.get("vehicle", "kinematic") != "kinematic"
    if dynamic and auvs.get("route", {}).get("kind") in ("hold", "track"):
        del auvs["vehicle"]
        dynamic = False
    if not dynamic and auvs.get("feedback") == "estimate":
        del auvs["feedback"]
    flows = [name for name in ("current_m_per_s", "current_variation_m_per_s") if name in water]
    if flows and not dynamic:
        data.setdefault("navigation", {})["velocity"] = "through_water"
    elif dynamic and draw.random() < 0.7:
        for name in flows:
            water[name] = draw.choice((0.0, 1e-3, 0.2))
    if dynamic and draw.random() < 0.7:
        auvs["speed_m_per_s"] = draw.choice((0.3, 0.6, 1.0))
    if auvs.get("route", {}).get("kind", "lawnmower") == "lawnmower" and draw.random() < 0.9:
        _fitted(data)


def _sized(mf: dict[str, Any]) -> None:
    """Let a table of airtimes be the one that ships, and a message hold a fix."""
    if mf.get("airtimes") is not None:
        mf["airtimes"] = table_file("s2c_airtimes.csv")
    sheet = modem_values(mf["modem"], Downlink) if mf.get("modem") else {}
    size = {"header_bytes": 8, "fix_bytes": 16, **sheet, **mf}
    most = 64 if size.get("airtimes") else 65_535
    if size["header_bytes"] + size["fix_bytes"] > most:
        mf["header_bytes"], mf["fix_bytes"] = 8, 16
    needed = mf.get("header_bytes", 8) + mf.get("fix_bytes", 16)
    if not needed <= (size.get("payload_bytes") or most) <= most:
        mf["payload_bytes"] = needed


def _sounding(channel: Any) -> Any:
    """Let a curve be one that ships, and sound fit its band."""
    given = channel if isinstance(channel, dict) else {"model": channel}
    if given["model"] == "curve":
        return {**given, "file": CURVE}
    if given["model"] not in ("sonar", "table"):
        return channel
    width = min(given.get("bandwidth_khz", 10.0), 2 * given.get("frequency_khz", 25.0))
    fitting = {**given, "bandwidth_khz": width}
    for name in ("snr_threshold_db", "rays", "bottom_m", "surface_sd_m", "transducer_m"):
        fitting.pop(name, None)
    return fitting


def _one_drift(navigation: dict[str, Any], draw: random.Random) -> None:
    """Keep one statement of what makes dead reckoning drift."""
    drift = navigation.get("drift") or {}
    figures = [
        name for name in ("percent_of_distance", "m_per_hour") if drift.get(name) is not None
    ]
    if len(figures) > 1:
        del drift[draw.choice(figures)]
    if figures:
        for name in REPLACED_BY_DRIFT:
            navigation.pop(name, None)


def _one_sheet(usbl: dict[str, Any], draw: random.Random) -> None:
    """Keep one statement of what an arrival measures."""
    if usbl.get("preset") is not None:
        usbl.pop("model", None)
    model = usbl.get("model")
    if model == "datasheet" or (isinstance(model, dict) and model.get("model") == "datasheet"):
        given = model if isinstance(model, dict) else {}
        figure, rest = draw.choice(
            [("bearing_sd_deg", OF_ANGLES), ("accuracy_percent", OF_ACCURACY)]
        )
        kept = {name: given[name] for name in rest if name in given}
        if kept.get("reference_snr_db") is None:
            kept.pop("angle_floor_deg", None)
        usbl["model"] = {"model": "datasheet", figure: draw.choice((1e-3, 1.0, 45.0)), **kept}


def _fitted(data: dict[str, Any]) -> None:
    """Make room for a lane and a turn in the survey."""
    survey, auvs = data.get("survey", {}), data.setdefault("auvs", {})
    side = min(survey.get("size_m") or [survey.get("side_m") or 140.0])
    if survey.get("polygon_m"):
        side = 1.0
    route = auvs.setdefault("route", {})
    vehicle = auvs.get("vehicle") or "kinematic"
    own = vehicle if isinstance(vehicle, dict) else {"model": vehicle}
    if own.get("model") == "kinematic":
        auvs["vehicle"] = {
            **own,
            "turning_radius_m": min(own.get("turning_radius_m", 5.0), side / 2),
        }
    spacing, margin = route.get("lane_spacing_m", 10.0), route.get("end_margin_m")
    if margin is not None and 2 * margin >= side:
        route["end_margin_m"] = side / 4
    elif margin is None and spacing >= side:
        route["end_margin_m"] = 0.0


# What is estimated to take longer (s) or more memory (bytes) is told and not run here; what is run
# is ended after a limit of processor time: other work may slow a machine.
WORTH_RUNNING_S, WORTH_RUNNING_BYTES, LIMIT_S = 4.0, 1e9, 120.0


def outcome(seed: int, folder: Path) -> tuple[str, str]:
    """Return how a drawn scenario ends: ok, refused (and why), large, or broken (and how)."""
    try:
        scenario = Scenario.model_validate(drawn(seed, folder))
        cost = effort(Setup(scenario))
        if cost.seconds > WORTH_RUNNING_S or cost.bytes > WORTH_RUNNING_BYTES:
            return "large", str(cost)
        list(map(str, warnings_of(scenario)))
        rounds_of(Setup(scenario)).period(1, 1)
        result = simulate(scenario, seed)
        result.summary()
        if seed % 8 == 0:
            result.write(folder / f"run{seed}")
    except ValidationError as error:
        return "refused", str(error)
    except (ValueError, RuntimeError, FloatingPointError) as error:
        is_telling = any(sign.isdigit() for sign in str(error))
        return ("refused", str(error)) if is_telling else ("broken", traceback.format_exc())
    except Exception:
        return "broken", traceback.format_exc()
    wild = [
        f"{name}.{column}"
        for name, table in result.arrow.items()
        for column in table.column_names
        if str(table[column].type) == "double"
        and not all(x is None or math.isfinite(x) for x in table[column].to_pylist())
    ]
    return ("broken", f"not finite: {wild}") if wild else ("ok", "")


def main(first: int, end: int, folder: Path) -> None:
    """Draw and run scenarios; print a line for each, and end the process where one hangs."""
    faulthandler.register(signal.SIGVTALRM, chain=True)
    for seed in range(first, end):
        signal.setitimer(signal.ITIMER_VIRTUAL, LIMIT_S)
        print(json.dumps([seed, *outcome(seed, folder)]), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3]))
