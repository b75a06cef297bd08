"""Ranges of values to vary, and what is ``--set`` in the scenario of a sweep."""

import json
from pathlib import Path

import pytest
from campaigns_for_tests import auv, hand_made
from commands_for_tests import call
from hypothesis import given
from hypothesis import strategies as st

from bindusbl_des import Scenario, load_campaign, sweep
from bindusbl_des.apps.campaigns.experiments.experiment_points import spread


@pytest.fixture(autouse=True)
def _in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    hand_made(monkeypatch, lambda asked, _: [auv(1.0)] * asked.auvs.count)
    Path("short.yaml").write_text(
        "name: short\nduration_s: 5\nasvs: {count: 3}\nnavigation: {filter: fixed_gain}\n"
    )


def varied(key: str, *texts: str) -> list[object]:
    """Return the values of a key at the points that options make."""
    words = [word for text in texts for word in ("--vary", text)]
    told = call("sweep", "short.yaml", *words, "--out", "c", "--allow-plugins")
    assert told.exit_code == 0, told.stderr
    return [point[key] for point in load_campaign("c").experiment.points]


@pytest.mark.parametrize(
    ("key", "text", "values"),
    [
        ("asvs.count", "2:5", [2, 3, 4, 5]),
        ("asvs.count", "4:4", [4]),
        ("asvs.count", "1,3:5,8", [1, 3, 4, 5, 8]),
        ("asvs.count", "9:1:-4", [9, 5, 1]),
        ("asvs.formation.angle_deg", "0:90:15", [0, 15, 30, 45, 60, 75, 90]),
        ("asvs.formation.angle_deg", "0:100:45", [0, 45, 90]),
        ("asvs.formation.angle_deg", "-30:30:30", [-30, 0, 30]),
        ("navigation.filter.gain", "0.1:0.4:0.1", [0.1, 0.2, 0.3, 0.4]),
        ("navigation.filter.gain", "0.5:.9:2e-1, 1", [0.5, 0.7, 0.9, 1]),
        (
            "protocol.schedule",
            "dsatur,schedules_for_tests:twice",
            ["dsatur", "schedules_for_tests:twice"],
        ),
    ],
)
def test_ranges_count_as_they_are_written(key: str, text: str, values: list[object]) -> None:
    """Both ends are in where the steps meet them; plug-ins are names still."""
    found = varied(key, f"{key}={text}")
    assert found == values
    assert [type(it) for it in found] == [type(it) for it in values]


@given(
    st.integers(-1000, 1000), st.integers(0, 60), st.integers(-500, 500).filter(bool),
    st.integers(0, 4),
)  # fmt: skip
def test_a_range_is_the_decimals_between_its_ends(
    first: int, steps: int, step: int, digits: int
) -> None:
    """Whatever the step, the n-th value is the number that one would write there."""
    scale = 10**digits
    ends = [f"{it / scale:.{digits}f}" for it in (first, first + steps * step, step)]
    values = spread(":".join(ends))
    assert values == [float(f"{(first + n * step) / scale:.{digits}f}") for n in range(steps + 1)]


WRONG = {
    "asvs.count=5:2": "5:2 counts up; write 2:5, or 5:2:-1",
    "asvs.count=0.5:2": "0.5:2 counts in whole numbers without a step; write first:last:step, such",
    "asvs.count=2:5:0": "2:5:0 has a step of 0; write one that leads from 2 to 5",
    "asvs.count=2:5:-1": "2:5:-1 leads away from 5; write 2:5:1",
    "asvs.count=5:2:0.5": "5:2:0.5 leads away from 2; write 5:2:-0.5",
    "asvs.count=2:5:1:1": "2:5:1:1 is no range; write first:last or first:last:step, as in 2:5 or",
    "asvs.count=1:9999999": "1:9999999 has 9,999,999 values, and at most 10,000 may be",
    "auvs.speed_m_per_s=0:1:1e-99": "values, and at most 10,000 may be; step wider",
    "asvs.count=2:999999999999999999": "values, and at most 10,000 may be",
}


@pytest.mark.parametrize("option", WRONG)
def test_a_wrong_range_is_told_with_its_remedy(option: str) -> None:
    """Option, key, value and remedy on one line; nothing is begun."""
    told = call("sweep", "short.yaml", "--vary", option)
    assert (told.exit_code, told.stdout) == (2, "")
    assert told.stderr.startswith(f"--vary {option}: vary.{option.partition('=')[0]}.0: ")
    assert WRONG[option] in told.stderr
    assert told.stderr.count("\n") == 1
    assert [path.name for path in Path().iterdir()] == ["short.yaml"]


def test_what_does_not_count_is_told_as_any_value() -> None:
    """A text that is no number is no range, and neither is a plug-in."""
    told = call("sweep", "short.yaml", "--vary", "asvs.count=2:x")
    assert "asvs.count: needs a whole number" in told.stderr
    assert "got the text '2:x'" in told.stderr
    told = call("sweep", "short.yaml", "--vary", "protocol.schedule=e1:e2")
    assert "`e1:e2` is code" in told.stderr or "--allow-plugins" in told.stderr


def test_two_ranges_of_many_values_are_too_many_points() -> None:
    """The grid is counted before it is made."""
    texts = ("asvs.formation.angle_deg=0:5000:1", "auvs.count=1:5000")
    told = call("sweep", "short.yaml", *(word for text in texts for word in ("--vary", text)))
    assert f"makes {5001 * 5000:,} points; at most 1,000,000 can run" in told.stderr


def test_experiment_files_have_ranges_as_well() -> None:
    """In a list or by itself; a wrong one is told at its place."""
    Path("e.yaml").write_text(
        "scenario: short.yaml\n"
        "vary:\n  asvs.count: 2:4\n  asvs.formation.angle_deg: [0:30:15, 45]\n"
    )
    points = sweep("e.yaml").experiment.points
    assert len(points) == 3 * 4
    assert points[-1] == {"asvs.count": 4, "asvs.formation.angle_deg": 45}
    Path("e.yaml").write_text("scenario: short.yaml\nvary:\n  asvs.count: [1, 4:2]\n")
    told = call("validate", "e.yaml")
    assert told.stdout == ("e.yaml:3:19: vary.asvs.count.1: 4:2 counts up; write 2:4, or 4:2:-1\n")


def test_what_is_set_holds_at_every_point() -> None:
    """`--set` is laid over the scenario of a sweep, and kept with the campaign."""
    words = ("--set", "auvs.count=1", "--vary", "asvs.count=1:2", "--seeds", 1, "--out", "c")
    assert call("sweep", "short.yaml", *words).exit_code == 0
    campaign = load_campaign("c")
    assert list(campaign.missions["asvs.count"]) == [1, 2]
    assert len(campaign.auvs) == 2
    base = Scenario.model_validate(json.loads(Path("c/campaign.json").read_text())["scenario"])
    assert (base.auvs.count, base.duration_s) == (1, 5)
    Path("e.yaml").write_text("scenario: short.yaml\nvary: {auvs.speed_m_per_s: [1, 2]}\n")
    assert call("sweep", "e.yaml", "--set", "auvs.count=2", "--out", "d").exit_code == 0
    assert len(load_campaign("d").auvs) == 4


def test_a_point_is_judged_with_what_is_set() -> None:
    """What only the setting makes wrong is told, and what it mends is not."""
    pair = ("--set", "asvs.formation.positions_m=[[0, 0], [1, 1]]", "--set", "asvs.count=2")
    told = call("sweep", "short.yaml", *pair, "--vary", "asvs.formation.radius_m=10", "--dry-run")
    assert told.exit_code == 2
    assert "asvs.formation.radius_m" in told.stderr
    told = call("validate", "short.yaml", "--set", "asvs.count=2", "--json")
    assert json.loads(told.stdout)["valid"]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--set", "asvs.count=2"), "--set asvs.count=2: asvs.count: is varied, so that setting"),
        (("--set", "record.detail=full"), "record.detail: belongs to the experiment; write --det"),
        (("--set", "asvs.cuont=2"), "--set asvs.cuont=2: asvs.cuont: unknown key; did you mean"),
        (("--set", "asvs"), "--set asvs: needs the form dotted.key=value"),
    ],
)
def test_a_wrong_setting_is_told(words: tuple[str, ...], told: str) -> None:
    result = call("sweep", "short.yaml", "--vary", "asvs.count=1:2", *words)
    assert (result.exit_code, result.stdout) == (2, "")
    assert told in result.stderr
    assert not Path("results").exists()


def test_a_sweep_names_its_report_at_the_end() -> None:
    """As `run` does, on stderr, so that stdout is what it was."""
    told = call("sweep", "short.yaml", "--out", "c")
    assert told.stdout.endswith("Results: c\n")
    assert told.stderr.endswith("Open c/report.html in a browser.\n")
    assert Path("c/report.html").is_file()
    as_json = call("resume", "c", "--json", "-q")
    assert (json.loads(as_json.stdout)["done"], as_json.stderr) == (1, "")
