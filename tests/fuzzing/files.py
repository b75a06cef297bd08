"""Scenario files, experiment files and tracks that are damaged, and commands that read them."""

import copy
from pathlib import Path
from random import Random
from typing import Any

import yaml
from drawn_scenarios import drawn

from .texts import bytes_mutated, encoded, lines_mutated
from .trees import Raw, as_yaml, mutated, odd, put
from .values import KEYS, LIKELY, NUMBERS, YAML

HOME = Path(__file__).parents[2]
Lines = list[list[str]]

TINY = {"name": "tiny", "duration_s": 2.0, "record": {"detail": "summary"}}

# Scenarios of these numbers and above lend their parts to others.
OTHERS = 10**9

# Where the folder of an input holds what it is about
SCENARIO, EXPERIMENT, TRACK = "scenario.yaml", "experiment.yaml", "track.csv"
RUN = ["run", SCENARIO, "--no-advice", "--out", "out"]
SHORT = ["--set", "duration_s=2", "--set", "record.detail=summary"]


def scenario(seed: int, draw: Random) -> Lines:
    """Write a damaged scenario file here; return the command lines that read it."""
    Path(SCENARIO).write_bytes(_damaged(_scenario(seed, draw), draw, seed))
    lines = (["validate", SCENARIO], ["validate", "--json", "--strict", SCENARIO],
             ["timing", SCENARIO], ["coverage", SCENARIO], ["sweep", SCENARIO, "--dry-run"],
             RUN, [*RUN, *SHORT])  # fmt: skip
    return [draw.choices(lines, (40, 5, 10, 10, 5, 10, 20))[0]]


def _scenario(seed: int, draw: Random) -> Any:
    """Return the data of a scenario: tiny, drawn from the schema, or one that comes with it."""
    how = draw.random()
    if how < 0.25:
        return copy.deepcopy(TINY)
    if how < 0.65:
        return drawn(seed, Path())
    file = draw.choice(sorted((HOME / "scenarios").glob("*.yaml")))
    return yaml.safe_load(file.read_text(encoding="utf-8"))


def _damaged(data: Any, draw: Random, seed: int) -> bytes:
    """Return nested data as the bytes of a YAML file, after some accidents.

    Each key of the model has its turn; a few sections come from another scenario, which seldom
    agrees with this one.
    """
    how = draw.random()
    if how < 0.35:
        other = drawn(seed + OTHERS, Path())
        data |= {name: other[name] for name in other if draw.random() < 0.5}
    elif how < 0.7:
        put(data, KEYS[seed % len(KEYS)], _value(draw))
    for _ in range(draw.choice((0, 0, 0, 0, 1) if how < 0.7 else (1, 1, 1, 2, 10))):
        data = mutated(data, draw, raw=True)
    return _written(as_yaml(data), draw)


def _written(text: str, draw: Random) -> bytes:
    """Return a text as bytes, a few times with a line or some bytes gone wrong."""
    how = draw.random()
    raw = encoded(lines_mutated(text, draw) if how < 0.15 else text, draw)
    return bytes_mutated(raw, draw) if 0.1 < how < 0.25 else raw


def _value(draw: Random) -> Any:
    how = draw.random()
    if how < 0.6:
        return draw.choice(LIKELY if how < 0.3 else NUMBERS)
    return Raw(draw.choice(YAML)) if how < 0.7 else odd(draw)


def experiment(seed: int, draw: Random) -> Lines:
    """Write a damaged experiment file here, or one of a damaged scenario; return what reads it."""
    data = _experiment(draw)
    Path(SCENARIO).write_text(as_yaml(TINY), encoding="utf-8")
    if draw.random() < 0.2:
        Path(SCENARIO).write_bytes(_damaged(copy.deepcopy(TINY), draw, seed))
    if draw.random() < 0.3:
        varied = {KEYS[seed % len(KEYS)]: [_value(draw) for _ in range(draw.randrange(3))]}
        data["vary"] = varied if draw.random() < 0.5 else data.get("vary", {}) | varied
    for _ in range(draw.choice((0, 0, 1, 1, 4))):
        data = mutated(data, draw, raw=True)
    Path(EXPERIMENT).write_bytes(_written(as_yaml(data), draw))
    dry = ["sweep", EXPERIMENT, "--dry-run"]
    return [draw.choice((["validate", EXPERIMENT], dry, [*dry, "--json"]))]


def _experiment(draw: Random) -> dict[str, Any]:
    """Return the data of an experiment with some of what there is to say in one."""
    parts: dict[str, Any] = {
        "name": "e",
        "seeds": draw.choice((2, [0, 5], [3])),
        "detail": draw.choice(("summary", "full")),
        "until_ci": {"position_error_m": "5%"},
        "vary": {"asvs.count": [2, 3], "survey.side_m": [100, 140.0]},
    }
    if draw.random() < 0.3:
        parts["points"] = [{"asvs.count": 2, "auvs.count": 1}, {"asvs.count": 3}]
        del parts["vary"]
    if draw.random() < 0.2:
        parts["sample"] = {"points": 4, "method": "sobol", "ranges": {"survey.side_m": [90, 150]}}
        parts.pop("vary", None)
        parts.pop("points", None)
    kept = {name: part for name, part in parts.items() if draw.random() < 0.7}
    return {"scenario": SCENARIO, **kept}


TRACKED = """name: tracked
duration_s: {duration}
auvs: {{count: 1, route: {{kind: track, files: [{file}], time_offset_s: {offset}}}}}
record: {{detail: summary}}
"""
CELLS = (
    "0", "1", "2.5", "1e-9", "-7", " 3 ", "+4", "1e3", "1e5", "-1e5", "1e300", "-0", "00", "2.",
    "", " ", "nan", "inf", "-inf", "1e300", "-1e300", "1e-300", "1e400", "x", "0x10", "1_0", "1,5",
    "9" * 400, '"', '"1', "'1'", "\0", "\x1b", "😀", "x" * 200_000, ";", "1;2", "NULL", "5 m",
)  # fmt: skip


def track(seed: int, draw: Random) -> Lines:
    """Write a damaged track here and a scenario that follows it; return what reads it."""
    name = f"track{seed}.csv"
    Path(name).write_bytes(_track(draw))
    offset = draw.choice((0, 0, 0, 0, 1e9, -1e12, 1e12))
    values = {"duration": draw.choice((1, 5, 20)), "file": name, "offset": offset}
    Path(SCENARIO).write_text(TRACKED.format(**values), encoding="utf-8")
    lines = (["validate", SCENARIO], ["timing", SCENARIO], ["coverage", SCENARIO], RUN, RUN)
    return [draw.choice(lines)]


def _track(draw: Random) -> bytes:
    count = draw.choice((0, 1, 2, 3, 5, 5, 5, 50))
    first = draw.choice((0.0, 0.0, -3.0, 1e9))
    rows: list[list[Any]] = [["time_s", "x_m", "y_m", "depth_m"]]
    rows += [[first + n, 0.5 * n, -0.3 * n, 5.0] for n in range(count)]
    for _ in range(draw.choice((0, 1, 1, 1, 2))):
        row, how = draw.choice(rows), draw.random()
        if how < 0.6 and row:
            row[draw.randrange(len(row))] = draw.choice(CELLS)
        elif how < 0.7:
            row.append(draw.choice(CELLS))
        elif how < 0.8 and row:
            row.pop()
        else:
            rows.insert(draw.randrange(len(rows) + 1), list(draw.choice(rows)))
    comma = draw.choice((*",,,,,,,,,,,,,,,,", ", ", ";", "\t"))
    text = draw.choice((*"\n\n\n", "\r\n", "\r")).join(comma.join(map(str, row)) for row in rows)
    raw = encoded(text, draw)
    return bytes_mutated(raw, draw) if draw.random() < 0.2 else raw
