"""Plan files and logs of recorded missions that are damaged, and commands that read them."""

import io
import json
from pathlib import Path
from random import Random
from typing import Any

from .files import CELLS, SCENARIO, TINY, Lines
from .texts import bytes_mutated, encoded, lines_mutated
from .trees import as_yaml, mutated
from .values import LIKELY, NUMBERS

PLAN = "plan.yaml"
GOALS = (
    *(("position_error_m", "below"), ("fix_rate_hz", "above"), ("latency_p95_s", "below")) * 3,
    *(("position_error_m", "above"), ("x", "below"), ("", "above"), ("fix_rate_hz", "")),
)


def plan(seed: int, draw: Random) -> Lines:
    """Write a damaged plan file here; return the command line that reads it, in half a second."""
    Path(SCENARIO).write_text(as_yaml(TINY), encoding="utf-8")
    lines = [f"plan {PLAN} --out planned --budget-missions 4 --workers 1".split()]
    if seed % 8 == 0:  # else hardly any would ever be made
        goal = {"metric": draw.choice(("position_error_m", "latency_p95_s")), "below": 1.0}
        sound = {"scenario": SCENARIO, "goal": goal, "candidates": {"asvs.count": [1, 2]}}
        Path(PLAN).write_text(as_yaml(sound), encoding="utf-8")
        return lines
    metric, side = draw.choice(GOALS)
    limit = draw.choice((0.1, 1.0, 10.0, draw.choice(NUMBERS)))
    data: Any = {
        "scenario": SCENARIO,
        "goal": {"metric": metric, side: limit},
        "candidates": draw.choice(
            (
                [{"asvs.count": 1}, {"asvs.count": 2, "asvs.formation.radius_m": 31}],
                {"asvs.count": [1, 2], "asvs.formation.radius_m": [30, draw.choice(LIKELY)]},
                *[{"asvs.count": "1:3"}] * 3,
                {"asvs.count": "1:10000"},
                {"asvs.count": draw.choice(NUMBERS)},
            )
        ),
    }
    if draw.random() < 0.2:
        data |= {draw.choice(("confidence", "budget_missions", "budget_s", "cost", "seed", "name")):
                 draw.choice((0.5, 1, 2, *NUMBERS))}  # fmt: skip
    for _ in range(draw.choice((0, 0, 0, 0, 1, 3))):
        data = mutated(data, draw, raw=True)
    raw = encoded(as_yaml(data), draw)
    Path(PLAN).write_bytes(bytes_mutated(raw, draw) if draw.random() < 0.1 else raw)
    return lines


PYFG = """VERTEX_XY L0 50 0
VERTEX_XY L1 0 40
VERTEX_SE2 0 A0 0 0 0
EDGE_SE2 1 A0 A1 2 0 0 0.0004 0 0 0.0004 0 0.000004
EDGE_SE2 2 A1 A2 2 0 1.57 0.0004 0 0 0.0004 0 0.000004
EDGE_SE2 4 A2 A3 3 0 0 0.0004 0 0 0.0004 0 0.000004
EDGE_RANGE 1 A1 L0 48 0.5625
EDGE_RANGE 2 A2 L1 40.2 0.5625
EDGE_RANGE 4 A3 L0 46.1 0.5625
"""

# The tables of a log, row by row
TABLES: dict[str, list[dict[str, Any]]] = {
    "odometry": [
        {"time_s": float(n), "x_m": 2.0 * n, "y_m": 0.5 * n, "yaw_rad": 0.1, "z_m": 3.0}
        for n in range(8)
    ],
    "beacons": [
        {"beacon": "L0", "x_m": 50.0, "y_m": 0.0},
        {"beacon": "L1", "x_m": 0.0, "y_m": 40.0},
    ],
    "ranges": [
        {"time_s": float(n), "beacon": f"L{n % 2}", "range_m": 48.0 - n} for n in range(1, 8)
    ],
    "fixes": [
        {"valid_at_s": float(n), "x_m": 2.0 * n, "y_m": 0.5, "sd_x_m": 0.5, "sd_y_m": 0.5}
        for n in range(8)
    ],
    "receptions": [
        {"time_s": float(n), "outcome": outcome, "range_m": 48.0}
        for n, outcome in enumerate(("heard", "lost", "heard", "heard", "lost"))
    ],
}
ODD = ("1e308", "-1e308", "9" * 400, "NaN", "-Infinity", "1e400", "[" * 9000, "null", "{}", "true")


def log(seed: int, draw: Random) -> Lines:
    """Write a damaged log of a recorded mission here; return what replays it or fits its noise."""
    name = ("log.pyfg", "log", "log.mcap")[seed % 3]
    if name == "log.pyfg":
        Path(name).write_bytes(_bytes(encoded(_cells(PYFG, draw), draw), draw))
    else:
        tables = {it: rows for it, rows in _tables(draw).items() if draw.random() < 0.95}
        (_recorded if name == "log.mcap" else _in_a_folder)(Path(name), tables, draw)
    return [draw.choice((["replay", name], ["replay", name, "--json"], ["fit", name]))]


def _tables(draw: Random) -> dict[str, list[dict[str, Any]]]:
    """Return the tables of a log, a few times with positions on Earth, or as we export them."""
    how = draw.random()
    if how < 0.2:
        return {table: [_on_earth(row) for row in rows] for table, rows in TABLES.items()}
    if how < 0.4:
        names = {"x_m": "imu_x_m", "y_m": "imu_y_m"}
        rows = [{names.get(it, it): row[it] for it in row} for row in TABLES["odometry"]]
        others = {table: TABLES[table] for table in TABLES if table != "odometry"}
        return {"tracks": [{"vehicle": "AUV0", **row} for row in rows], **others}
    return TABLES


def _on_earth(row: dict[str, Any]) -> dict[str, Any]:
    if "x_m" not in row:
        return row
    others = {it: row[it] for it in row if it not in ("x_m", "y_m")}
    return {**others, "lat_deg": 54.33 + 1e-5 * row["x_m"], "lon_deg": 10.18 + 1e-5 * row["y_m"]}


def _bytes(raw: bytes, draw: Random) -> bytes:
    return bytes_mutated(raw, draw) if draw.random() < 0.25 else raw


def _in_a_folder(folder: Path, tables: dict[str, list[dict[str, Any]]], draw: Random) -> None:
    """Write tables as CSV, one of them damaged most times, seldom all."""
    folder.mkdir()
    worst, all_of_them = draw.choice(list(TABLES)), draw.random() < 0.1
    for table, rows in tables.items():
        text = "\n".join([",".join(rows[0]), *(",".join(map(str, it.values())) for it in rows)])
        if table == worst or all_of_them:
            (folder / f"{table}.csv").write_bytes(_bytes(encoded(_cells(text, draw), draw), draw))
        else:
            (folder / f"{table}.csv").write_text(text, encoding="utf-8")


def _recorded(file: Path, tables: dict[str, list[dict[str, Any]]], draw: Random) -> None:
    """Write tables as a recording of JSON messages."""
    from mcap.writer import Writer

    into = io.BytesIO()
    writer = Writer(into)
    writer.start()
    schema = writer.register_schema("row", "jsonschema", b"{}")
    for table, rows in tables.items():
        channel = writer.register_channel(f"/log/{table}", "json", schema)
        for number, row in enumerate(rows):
            data: Any = mutated(dict(row), draw) if draw.random() < 0.02 else row
            text = json.dumps(data)
            if draw.random() < 0.01:
                text = text.replace(".0", draw.choice(("e308", "e400")), 1)
            if draw.random() < 0.01:
                text = text.replace("2.0", draw.choice(ODD), 1)
            writer.add_message(channel, number * 10**9, text.encode(), number * 10**9)
    writer.finish()
    file.write_bytes(_bytes(into.getvalue(), draw))


def _cells(text: str, draw: Random) -> str:
    """Return a text with a few of its words changed, or its lines."""
    if draw.random() < 0.3:
        return lines_mutated(text, draw)
    comma = "," if "," in text else " "
    rows = [line.split(comma) for line in text.splitlines()]
    for _ in range(draw.choice((0, 0, 1, 1, 2, 5))):
        row = draw.choice(rows)
        row[draw.randrange(len(row))] = draw.choice((*CELLS, "L0", "1e308", "-0.25"))
    return "\n".join(comma.join(row) for row in rows) + "\n"
