"""The edges of scenario keys: whatever is accepted can be run, written, and read again."""

import json
import math
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from commands_for_tests import call
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds import parse_scenario

from bindusbl_des import (
    Result,
    Scenario,
    ScenarioError,
    Setup,
    load_result,
    load_scenario,
    simulate,
    sweep,
)
from bindusbl_des.apps.preflight.effort import effort
from bindusbl_des.core.results.result import scenario_sha256
from bindusbl_des.core.scenario.keys import json_schema

pytestmark = pytest.mark.usefixtures("in_this_process")

MISSION: dict[str, Any] = {
    "name": "edge",
    "duration_s": 1.0,
    "auvs": {"count": 2},
    "asvs": {"count": 2},
    "survey": {"side_m": 40.0},
}
STRANGE = (-0.0, 5e-324, 1e-300, 1e-12, 1e-9, 1e300)
SCHEMA = json_schema()

# Missions beyond this are worth an estimate, and no test.
LONG_S = 5.0
BRIEF = {"detail": "summary"}


def numbers(
    part: dict[str, Any] = SCHEMA, prefix: str = ""
) -> Iterator[tuple[str, list[float | int]]]:
    """Yield every key of a number, the ends of its range and numbers beyond them."""
    for name, field in part["properties"].items():
        kinds = [field, *field.get("anyOf", [])]
        for kind in kinds:
            if "$ref" in kind and "discriminator" not in field:
                inner = SCHEMA["$defs"][kind["$ref"].rpartition("/")[2]]
                if "properties" in inner:
                    yield from numbers(inner, f"{prefix}{name}.")
            elif kind.get("type") in ("number", "integer"):
                words = ("minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum")
                ends = [kind[word] for word in words if word in kind]
                is_real = kind["type"] == "number"
                yield f"{prefix}{name}", [*map(float, ends), *STRANGE] if is_real else ends


NUMBERS = [(key, value) for key, values in numbers() for value in values]


def with_key(key: str, value: Any) -> dict[str, Any]:
    data: dict[str, Any] = json.loads(json.dumps(MISSION))
    *sections, name = key.split(".")
    section = data
    for word in sections:
        section = section.setdefault(word, {})
    section[name] = value
    return data


def written_and_read(result: Result, folder: Path) -> Scenario:
    """Write a result; return the scenario in its `scenario.yaml`, which `run.json` has as well."""
    result.write(folder, force=True)
    assert load_result(folder).scenario == result.scenario
    return load_scenario(folder / "scenario.yaml")


def test_the_keys_at_their_edges_are_all_of_them() -> None:
    """Sections, numbers and numbers that may be null."""
    keys = {key for key, _ in NUMBERS}
    assert len(keys) > 45
    assert {"duration_s", "acoustics.hf.ping_s", "protocol.tick_rate_hz", "auvs.count"} <= keys


@settings(max_examples=12, deadline=None)
@given(st.sampled_from(NUMBERS))
def test_a_number_that_is_accepted_is_run_written_and_read(
    tmp_path_factory: pytest.TempPathFactory, edge: tuple[str, float]
) -> None:
    """Each key alone at the ends of its range and beyond: told as a mistake, or a whole mission."""
    text = json.dumps(with_key(*edge))
    try:
        scenario = parse_scenario(text)
    except ScenarioError:
        return
    cost = effort(Setup(scenario))
    if cost.seconds < LONG_S and not cost.excess():
        folder = tmp_path_factory.mktemp("edge") / "r"
        assert written_and_read(simulate(scenario), folder) == scenario


@settings(max_examples=30, deadline=None)
@given(name=st.text(st.characters(exclude_categories=()), max_size=101), angle=st.floats(-360, 360))
def test_a_name_that_is_accepted_is_written_and_read(
    tmp_path_factory: pytest.TempPathFactory, name: str, angle: float
) -> None:
    """Any letters of the world; numbers keep all their bits."""
    try:
        scenario = Scenario(name=name, environment={"current_direction_deg": angle}, record=BRIEF)
    except ValueError:
        bad = [sign for sign in name if not is_good(sign)]
        assert bad or not 1 <= len(name) <= 100
        return
    folder = tmp_path_factory.mktemp("name") / "r"
    assert written_and_read(Result(scenario, 0, flown().arrow, 1.0), folder) == scenario


@cache
def flown() -> Result:
    """Return a short mission, once it is needed."""
    return simulate(Scenario(name="x", duration_s=1.0, record=BRIEF))


def is_good(sign: str) -> bool:
    code = ord(sign)
    controls = code < 0x20 or 0x7F <= code < 0xA0 or code in (0x2028, 0x2029, 0xFFFE, 0xFFFF)
    return not controls and not 0xD800 <= code < 0xE000


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("''", "name: must have 1 to 100 characters"),
        ("n" * 101, "name: must have 1 to 100 characters"),
        ("n" * 5000, "name: must have 1 to 100 characters"),
        (r'"a\0b"', "name: must hold no control characters"),
        (r'"a\x1b[31m"', "name: must hold no control characters"),
        (r'"a\uffff"', "name: must hold no control characters"),
        (r'"\ud83d\udc1f"', "YAML syntax: an escape of half a character"),
    ],
)
def test_a_name_that_cannot_be_is_told(name: str, said: str) -> None:
    """In one line; a scenario and an experiment alike."""
    with pytest.raises(ScenarioError) as raised:
        parse_scenario(f"name: {name}\n")
    assert said in str(raised.value)
    assert len(str(raised.value).splitlines()) == 1


@pytest.mark.parametrize(
    "name", ["🐟", "a/b", "..", "null", "1", "#", "x" * 100, "日" * 100], ids=range(8)
)
def test_names_of_all_kinds_are_run(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The folder is one that can be, in the folder of results; what lies there runs again."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "m.yaml").write_text(json.dumps({**MISSION, "name": name}, ensure_ascii=False))
    options = ("--no-advice", "--set", "duration_s=2")
    assert call("run", "m.yaml", *options).exit_code == 0
    (folder,) = (tmp_path / "results").iterdir()
    again = ["run", str(folder / "scenario.yaml"), "--no-advice", "--out", "again"]
    outcome = call(*again)
    assert outcome.exit_code == 0, outcome.output
    assert load_scenario("again/scenario.yaml").name == name


def test_names_that_differ_have_folders_that_differ(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By signs that no file has, or beyond what one can have; of ASCII alone as one would guess."""
    monkeypatch.chdir(tmp_path)
    names = ["⚓", "⛵", "⛵⛵", "bay ⚓", "bay ⛵", *(("日" * 99 + end) for end in "ab")]
    for name in (*names, "bay 1", "лодка"):
        (tmp_path / "m.yaml").write_text(json.dumps({**MISSION, "name": name}, ensure_ascii=False))
        ran = call("run", "m.yaml", "--set", "duration_s=1")
        assert ran.exit_code == 0, ran.output
    folders = {path.name for path in (tmp_path / "results").iterdir()}
    assert len(folders) == len(names) + 2
    assert {"bay_1-seed0", "лодка-seed0"} <= folders


def test_the_name_of_a_campaign_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The scenario in its folder reads as that which was swept."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "m.yaml").write_text("name: 🐟\nduration_s: 1\n")
    campaign = sweep("m.yaml", "campaign", workers=1)
    assert load_scenario(campaign.folder / "scenario.yaml") == load_scenario("m.yaml")


def test_the_scenario_kept_beside_results_finds_its_tracks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Wherever they lay, the folder has a copy of them and names it."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "t.csv").write_text("time_s,x_m,y_m,depth_m\n0,0,0,5\n9,9,0,5\n")
    text = "# mine\nname: t\nduration_s: 2\nauvs: {count: 1, route: {kind: track, files: ['%s']}}\n"
    for file in ("t.csv", tmp_path / "t.csv"):
        (tmp_path / "m.yaml").write_text(text % file)
        words = ["run", "m.yaml", "--no-advice", "--out", "out/r", "--force"]
        assert call(*words).exit_code == 0
        kept, first = load_scenario("out/r/scenario.yaml"), load_scenario("m.yaml")
        assert scenario_sha256(kept) == scenario_sha256(first)
        assert simulate(kept).tables["tracks"].equals(simulate(first).tables["tracks"])


def test_ways_too_short_to_have_a_direction_are_told() -> None:
    """Way points in one place are no way; a millimetre apart they are."""
    for apart, is_good_way in ((0.0, False), (1e-9, False), (0.001, True)):
        route = {"kind": "waypoints", "points_m": [[[0.0, 0.0], [apart, 0.0]]] * 2}
        data = with_key("auvs.route", route)
        if is_good_way:
            assert math.isfinite(simulate(parse_scenario(json.dumps(data))).mission.rounds[0])
        else:
            with pytest.raises(ScenarioError, match="needs at least two points"):
                parse_scenario(json.dumps(data))
