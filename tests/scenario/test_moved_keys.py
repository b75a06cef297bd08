"""Keys that have become settings of one part: the former spelling is read, with the new line."""

import json
from pathlib import Path

import pytest
from commands_for_tests import call
from worlds import merged

from bindusbl_des import Scenario, ScenarioError, load_campaign, load_scenario
from bindusbl_des.apps.preflight.warnings import Reading, read_scenario

# section, key, value, where it belongs, the part that has it
MOVED = [
    ("navigation", "gain", 0.5, "filter", "fixed_gain"),
    ("navigation", "delay_compensation", "none", "filter", "fixed_gain"),
    ("protocol", "reply", "instant", "downlink", "direct_reply"),
    ("protocol", "reply_at", "ping_front", "downlink", "direct_reply"),
    ("protocol", "turnaround_s", 0.2, "ranging", "twtt"),
    ("protocol", "missed", "last_slot", "knowledge", "broadcast"),
    ("protocol", "assignment_bytes", 4, "knowledge", "broadcast"),
    ("auvs", "turning_radius_m", 3.0, "vehicle", "kinematic"),
]
EACH = pytest.mark.parametrize(("section", "name", "value", "key", "part"), MOVED)


def written(folder: Path, section: str, **keys: object) -> Path:
    """Return a file with some keys of one section, on line 3."""
    file = folder / "f.yaml"
    file.write_text(f"name: m\nduration_s: 5\n{section}: {json.dumps(keys)}\n")
    return file


def told(read: Reading) -> list[str]:
    """Return what is said of the spelling of keys."""
    return [str(it) for it in read.warnings if "is read in this version only" in str(it)]


@EACH
def test_the_former_spelling_is_read_and_the_new_line_told(
    tmp_path: Path, section: str, name: str, value: object, key: str, part: str
) -> None:
    """One warning, at the line of the key, which has the new spelling of that scenario."""
    chosen = {} if part == "kinematic" else {key: part}
    read = read_scenario(written(tmp_path, section, **chosen, **{name: value}))
    (warning,) = told(read)
    assert warning.startswith(f"{tmp_path / 'f.yaml'}:3:")
    assert f"{section}.{name}: is a setting of {part} now: write `{key}: " in warning
    new = warning.partition("`")[2].partition("`")[0]
    (tmp_path / "new.yaml").write_text(f"name: m\nduration_s: 5\n{section}: {{{new}}}\n")
    again = read_scenario(tmp_path / "new.yaml")
    assert (again.scenario, told(again)) == (read.scenario, [])
    assert again.scenario == load_scenario(
        written(tmp_path, section, **chosen), overrides=[f"{section}.{key}.{name}={value}"]
    )


@EACH
def test_an_option_may_have_the_former_spelling(
    tmp_path: Path, section: str, name: str, value: object, key: str, part: str
) -> None:
    """`--set` moves the key and names the new option."""
    file = written(tmp_path, section, **{key: part})
    option = f"{section}.{name}={value}"
    read = read_scenario(file, overrides=[option])
    (warning,) = told(read)
    assert f"is a setting now: write --set {section}.{key}.{name}={value}" in warning
    assert read.scenario == load_scenario(file, overrides=[f"{section}.{key}.{name}={value}"])


@EACH
def test_python_reads_the_former_spelling_with_a_warning(
    section: str, name: str, value: object, key: str, part: str
) -> None:
    data = {"name": "m", section: {key: part}}
    with pytest.warns(FutureWarning, match=f"{name} is a setting of the {key} {part} now"):
        former = Scenario.model_validate(merged(data, {section: {name: value}}))
    own = {section: {key: {"model": part, name: value}}}
    assert former == Scenario.model_validate({**data, **own})


OTHERS = {
    "filter": "kalman", "downlink": "sequential", "ranging": "owtt_sync", "knowledge": "shared",
    "vehicle": "bluerov2",
}  # fmt: skip


@EACH
def test_with_another_part_it_is_a_mistake_that_names_the_one_that_has_it(
    tmp_path: Path, section: str, name: str, value: object, key: str, part: str
) -> None:
    other = OTHERS[key]
    file = written(tmp_path, section, **{key: other, name: value})
    refused = call("validate", str(file))
    assert refused.exit_code == 2
    why = f"is a setting of the {key} {part}, and {key} is {other}"
    remedy = f"remove it, or write `{key}: {{model: {part}, {name}: "
    assert f"{section}.{name}: {why}; {remedy}" in refused.stdout
    with pytest.raises(ScenarioError, match=f"choose {part}, {other} has no such setting"):
        load_scenario(
            written(tmp_path, section, **{key: other}),
            overrides=[f"{section}.{key}.{name}={value}"],
        )


def test_a_key_given_twice_is_a_mistake(tmp_path: Path) -> None:
    own = {"model": "fixed_gain", "gain": 0.5}
    file = written(tmp_path, "navigation", filter=own, gain=0.7)
    with pytest.raises(ScenarioError, match=r"is given twice, as filter\.gain as well"):
        load_scenario(file)


@pytest.mark.usefixtures("in_this_process")
def test_a_sweep_over_the_former_spelling_varies_the_setting(tmp_path: Path) -> None:
    """Its points have the key of today, and say so."""
    file = written(tmp_path, "navigation", filter="fixed_gain")
    words = ["sweep", str(file), "--vary", "navigation.gain=0.3,0.6", "--seeds", "1"]
    ran = call(*words, "--out", str(tmp_path / "c"), "--json")
    assert ran.exit_code == 0, ran.output
    missions = load_campaign(tmp_path / "c").missions
    assert missions["navigation.filter.gain"].tolist() == [0.3, 0.6]
    assert "navigation.gain" not in missions
