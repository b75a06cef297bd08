"""`-q`, `--json` and `--set` mean the same on every command, before and after its name."""

import json
from pathlib import Path
from typing import Any

import pytest
from commands_for_tests import COMMANDS, call

TINY = "name: tiny\nduration_s: 5\nrecord: {detail: summary}\n"

# Commands whose product is a file to be edited print no data.
WITHOUT_JSON = {"init", "workbench"}
WITH_SET = {"run", "live", "sweep", "validate", "timing", "coverage", "plan", "verify"}


@pytest.fixture(autouse=True)
def _in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each test runs in a folder of its own with one small scenario."""
    monkeypatch.chdir(tmp_path)
    Path("f.yaml").write_text(TINY)


def options_of(name: str) -> dict[str, Any]:
    return {word: it for it in COMMANDS[name].params for word in it.opts}


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_what_it_can_have(name: str) -> None:
    """-q is everywhere, --json where data are printed, --set where a scenario is read."""
    options = options_of(name)
    assert {"-q", "--quiet"} <= set(options)
    assert ("--json" in options) == (name not in WITHOUT_JSON)
    assert ("--set" in options) == (name in WITH_SET)
    if name in WITH_SET:
        assert options["--set"].help == options_of("run")["--set"].help
        assert options["--set"].multiple


@pytest.mark.parametrize(
    "words",
    [
        ("validate", "f.yaml"),
        ("schema",),
        ("params", "heading"),
        ("presets", "modem"),
        ("timing", "f.yaml"),
        ("coverage", "f.yaml"),
        ("run", "f.yaml", "--no-advice", "--out", "o", "--force"),
        ("live", "f.yaml", "--to", "json:tcp:0", "--speed", "max", "--out", "o", "--force"),
        ("live", "f.yaml", "--to", "json:pty", "--dry", "--start", "2026-06-01T08:00:00Z"),
        ("sweep", "f.yaml", "--seeds", "2", "--dry-run"),
    ],
)
def test_json_is_one_document_wherever_it_is_asked_for(words: tuple[str, ...]) -> None:
    """stdout is one JSON document, the same before and after the command's name."""
    before, after = (call(*it) for it in (("--json", *words), (*words, "--json")))
    assert before.exit_code == after.exit_code == 0
    first, second = (json.loads(it.stdout) for it in (before, after))
    if words[0] != "sweep":  # which tells times
        assert first == second


@pytest.mark.parametrize("name", ["timing", "coverage", "validate"])
def test_set_is_the_same_on_both_sides(name: str) -> None:
    """What stands before the name of a command is as if it stood behind, and adds to it."""
    plain = call(name, "f.yaml", "--json").stdout
    words = ("--set", "asvs.count=2", "--set", "protocol.tick_rate_hz=30")
    after = call(name, "f.yaml", *words, "--json").stdout
    assert call(*words, "--json", name, "f.yaml").stdout == after
    assert call(*words[:2], "--json", name, "f.yaml", *words[2:]).stdout == after
    assert (plain == after) == (name == "validate")
    wrong = call("--set", "asvs.cuont=2", name, "f.yaml")
    assert wrong.exit_code == 2
    assert "--set asvs.cuont=2: asvs.cuont: unknown key; did you mean 'count'?" in wrong.output


@pytest.mark.parametrize("words", [("-q", "init"), ("init", "-q"), ("init", "--quiet")])
def test_quiet_is_the_same_on_both_sides(words: tuple[str, ...]) -> None:
    """Nothing but what is wrong is on stderr."""
    assert call("init", "--out", "a.yaml").stderr == "Now try: bindusbl-des run a.yaml\n"
    assert call(*words, "--out", "g.yaml").stderr == ""
    assert call(*words, "--out", "g.yaml").stderr.startswith("g.yaml: exists; use --force")


def test_an_option_that_a_command_cannot_have_is_refused() -> None:
    """It is not silently dropped."""
    for words, told in {
        ("--set", "a=1", "doctor"): "doctor has no option --set",
        ("--json", "init"): "init has no option --json",
        ("init", "--json"): "No such option",
    }.items():
        result = call(*words)
        assert (result.exit_code, result.stdout) == (2, "")
        assert told in result.stderr


def test_files_made_are_told_as_json() -> None:
    """`report`, `plot` and `export` name what they wrote in one document."""
    assert call("-q", "run", "f.yaml", "--out", "o", "--set=record.detail=full", "--no-advice")
    assert json.loads(call("report", "o", "--json").stdout) == {"report": "o/report.html"}
    drawn = json.loads(call("plot", "o", "coverage", "--json").stdout)
    assert drawn == {"figures": {"coverage": "o/figures/coverage.png"}}
    told = json.loads(call("export", "o", "--to", "csv", "--json").stdout)
    assert (told["export"], told["to"]) == ("o/csv", "csv")
    assert told["counts"]["auvs"] == 3
    for path in ("o/report.html", "o/figures/coverage.png", "o/csv/auvs.csv"):
        assert Path(path).is_file()


def test_planning_as_json_has_the_numbers_of_its_text() -> None:
    """`timing` and `coverage` say the same in both forms."""
    slots = json.loads(call("timing", "f.yaml", "--json").stdout)
    assert f"{1e3 * slots['uplink_slot_s']:.3f} ms" in call("timing", "f.yaml").stdout
    assert [row["fixes"] for row in slots["rounds"]] == [0, 0, 1, 1, 2, 2, 3, 3]
    assert {row["groups"] for row in slots["rounds"]} == {1, 3}
    reply = call("timing", "f.yaml", "--json", "--set", "protocol.downlink=direct_reply")
    assert [row["groups"] for row in json.loads(reply.stdout)["rounds"]] == [1, 2, 3]
    found = json.loads(call("coverage", "f.yaml", "--json").stdout)
    text = call("coverage", "f.yaml").stdout
    assert f"{100 * found['covered_area']:.2f} %" in text
    assert f"{found['covering_radius_m']:.2f} m, beyond the HF range" in text
    assert len(found["asvs"]) == 3


def test_what_coverage_says_of_a_survey_agrees() -> None:
    """Radius, area and chances: where the last corner is out of range, where the survey is long,
    and where a corner is at the range but for rounding.
    """

    def found(*settings: str) -> dict[str, Any]:
        words = [word for setting in settings for word in ("--set", setting)]
        answer: dict[str, Any] = json.loads(call("coverage", "f.yaml", "--json", *words).stdout)
        return answer

    quiet = ("acoustics.loss.law=none", "acoustics.mf.range_m=500", "auvs.count=1")
    corners = found(
        *quiet, "survey.side_m=100", "asvs.count=4", "asvs.formation.angle_deg=0",
        "asvs.formation.radius_m=50", "acoustics.hf.range_metric=slant",
    )  # fmt: skip
    assert corners["covering_radius_m"] > corners["reach_m"]
    assert (corners["fix_chance_least"], corners["covered_area"] < 1.0) == (0.0, True)
    long = found(*quiet, "survey={size_m: [400, 4], depth_m: 10}", "asvs.count=1")
    assert long["fix_chance_mean"] == pytest.approx(long["covered_area"], abs=0.005)
    for side, asvs in ((140, 1), (100, 2), (400, 4)):  # off by up to 0.6 % on the grid alone
        disc = found(
            *quiet, f"survey.side_m={side}", f"asvs.count={asvs}", "acoustics.mf.range_m=1e3"
        )
        assert disc["fix_chance_mean"] == pytest.approx(disc["covered_area"], rel=5e-4)
    deep = found(*quiet, "survey.side_m=900", "survey.depth_m=120", "acoustics.hf.range_m=150")
    assert deep["slant_reach_m"] == pytest.approx(90.0)
    assert deep["slant_covered_area"] < 0.5 * deep["covered_area"]
    words = ("--set", "survey.depth_m=120", "--set", "acoustics.hf.range_m=150")
    assert "90.00 m seen from above" in call("coverage", "f.yaml", *words).stdout
    assert "192.1 m of slant range" in " ".join(call("timing", "f.yaml", *words).stdout.split())
    for turned in range(0, 90, 10):
        survey = f"survey={{size_m: [60, 80], rotation_deg: {turned}, depth_m: 10}}"
        words = ("coverage", "f.yaml", "--set", survey, "--set", "asvs.count=1")
        text = call(*words, *[w for key in quiet for w in ("--set", key)]).stdout
        assert "50.00 m, within the HF range" in text


def test_params_finds_words_in_meanings() -> None:
    """A word of the meaning or a choice finds a key whose name does not have it; a * does not."""
    assert call("params", "schedules use").stdout.startswith("protocol.positions: truth")
    found = json.loads(call("params", "pipelined_group", "--json").stdout)
    assert [row["key"] for row in found] == ["protocol.downlink"]
    assert call("params", "*colouring*").exit_code == 2


@pytest.mark.parametrize("number", ["nan", "inf"])
def test_a_number_that_no_bound_holds_is_refused(number: str, tmp_path: Path) -> None:
    for words in (
        ("replay", "goats_15", "--speed", number),
        ("plan", "quickstart", "--below", "error=1", "--share", number),
        ("run", "quickstart", "--advice-s", number),
    ):
        found = call(*words, "--out", str(tmp_path / "out"))
        assert found.exit_code == 2
        assert "Error: Invalid value for" in found.stderr
        assert not (tmp_path / "out").exists()
