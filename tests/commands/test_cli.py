"""The command line: results to stdout, talk to stderr, mistakes told with exit code 2."""

import errno
import io
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from commands_for_tests import COMMANDS as FOUND
from commands_for_tests import call, params
from worlds import parse_scenario

from bindusbl_des import Scenario, load_result, load_scenario, simulate
from bindusbl_des.apps.commands.console import ended_in_order

TEMPLATES = ("starter", "paper", "still", "large")

SCENARIOS = Path(__file__).parents[2] / "scenarios"
COMMANDS = (
    "init", "params", "presets", "validate", "schema", "run", "sweep", "resume", "status", "merge",
    "explain", "plot", "compare", "export", "coverage", "timing", "doctor",
)  # fmt: skip
HEAVY = {
    "matplotlib", "networkx", "numba", "numpy", "pandas", "pyarrow", "pydantic", "simpy", "yaml",
}  # fmt: skip
TINY = "name: tiny\nduration_s: 5\nrecord: {detail: summary}\n"

pytestmark = pytest.mark.usefixtures("in_empty_folder")


def imported_by(*words: str) -> set[str]:
    """Return which modules a command line imports, as seen by a fresh interpreter."""
    program = (
        "import sys\nfrom bindusbl_des.cli import main\n"
        f"try: main({list(words)!r})\nexcept SystemExit: pass\n"
        "print(*sys.modules, sep='\\n', file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 0
    return {name.partition(".")[0] for name in done.stderr.splitlines()}


@pytest.mark.parametrize("words", [("--help",), ("run", "--help"), ("--version",)])
def test_help_waits_for_no_heavy_package(words: tuple[str, ...]) -> None:
    """Help and version import neither numpy nor anything that takes as long."""
    assert imported_by(*words) & HEAVY == set()


def test_validate_waits_for_no_tables() -> None:
    """Reading a scenario needs neither pandas, pyarrow nor networkx."""
    Path("f.yaml").write_text("name: m\n")
    imported = imported_by("validate", "f.yaml")
    assert "pydantic" in imported
    assert imported & (HEAVY - {"pydantic", "yaml"}) == set()


def test_what_was_loaded_is_not_looked_through_at_the_end() -> None:
    """Python, ending, leaves garbage where it lies: to look for it takes a sixth of a `run`."""
    program = (
        "from bindusbl_des.cli import main\n"
        "class Garbage:\n    def __del__(self): print('found')\n"
        "it = Garbage(); it.itself = it; del it\n"
    )
    words = [sys.executable, "-c"]
    assert subprocess.check_output([*words, program], text=True) == "found\n"
    said = subprocess.check_output([*words, f"{program}main(['--version'])"], text=True)
    assert [line.split()[0] for line in said.splitlines()] == ["bindusbl-des"]


def test_help_lists_the_commands_in_the_order_of_use() -> None:
    """The help names every command once, in groups by what one wants, each in a whole line."""
    text = call("--help").stdout
    places = [text.index(f"\n  {command} ") for command in COMMANDS]
    assert places == sorted(places)
    for command in FOUND:
        assert text.count(f"\n  {command} ") == 1
    assert not [line for line in text.splitlines()[1:] if line.endswith("...")]
    for said in (text, *(call(command, "--help").stdout for command in FOUND)):
        assert max(map(len, said.splitlines())) <= 80, said.splitlines()[0]


def test_version() -> None:
    """`--version` prints name and version on one line."""
    assert call("--version").stdout.startswith("bindusbl-des 0.")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("rn",), "No such command 'rn'; did you mean 'run'?"),
        (("simulate", "f.yaml"), "No such command 'simulate'; did you mean 'run'?"),
        (("init", "mine.yaml"), "`init --out mine.yaml` writes one to it"),
        (("run",), "Missing argument 'SCENARIO'"),
        (("run", "f.yaml", "--seed", "-1"), "-1 is not in the range x>=0"),
        (("run", "f.yaml", "--sed", "1"), "No such option"),
        (("run", "none.yaml"), "none.yaml: no such file; `bindusbl-des init` writes a starter"),
        (("run", "f.yaml", "--set", "a.b"), "--set a.b: needs the form dotted.key=value"),
        (("run", "f.yaml", "--out", "f.yaml"), "f.yaml: exists; use --force"),
        (("run", "f.yaml", "--out", "f.yaml", "--force"), "f.yaml: holds no results of a run"),
        (("run", "f.yaml", "--out", "full", "--force"), "full: holds no results of a run"),
        (("run", "f.yaml", "--out", "f.yaml/out"), "f.yaml is a file; name another folder"),
        (
            ("run", "f.yaml", "--allow-plugins", "--set", "protocol.schedule=none.such:thing"),
            "protocol.schedule: cannot load 'none.such:thing'",
        ),
        (("validate",), "Missing argument 'FILE...'"),
        (("schema", "x"), "'x' is not one of 'scenario', 'experiment'"),
        (("init", "stil"), "no template 'stil'; did you mean 'still'?"),
        (("init", "--out", "f.yaml"), "f.yaml: exists; use --force to replace it"),
        (("init", "--out", "none/f.yaml"), "none/f.yaml: the folder none does not exist"),
        (("params", "sped"), "no key matches 'sped'; did you mean 'speed_m_per_s'?"),
        (("timing", "none.yaml"), "none.yaml: no such file"),
        (("coverage", "f.yaml", "--figure", "map.doc"), "ends in one of .png, .svg, .pdf"),
        (("coverage", "f.yaml", "--figure", "no/map.png"), "the folder no does not exist"),
        (("explain", "full"), "give either --ping ID or --fix ID"),
        (("explain", "full", "--ping", "1", "--fix", "1"), "give either --ping ID or --fix ID"),
        (("explain", "full", "--ping", "1"), "full is no result folder"),
        (("explain", "none", "--fix", "1"), "none is no result folder"),
    ],
)
def test_bad_input_ends_with_2_and_leaves_nothing(words: tuple[str, ...], told: str) -> None:
    """What the user got wrong is told on stderr, before anything is computed or written."""
    Path("f.yaml").write_text(TINY)
    Path("full").mkdir()
    Path("full/letter.txt").write_text("dear")
    before = sorted(Path().rglob("*"))
    result = call(*words)
    assert result.exit_code == 2
    assert told in result.stderr
    assert result.stdout == ""
    assert sorted(Path().rglob("*")) == before
    assert Path("f.yaml").read_text() == TINY


def test_validate_names_the_files_that_are_right() -> None:
    """Several files are checked in one go; one that is wrong decides the exit code."""
    Path("good.yaml").write_text("name: m\n")
    Path("bad.yaml").write_text("name: m\nduration: 5\n")
    result = call("validate", "good.yaml", "bad.yaml")
    assert result.exit_code == 2
    assert result.stdout == (
        "good.yaml: ok\nbad.yaml:2:1: duration: unknown key; did you mean 'duration_s'?\n"
    )
    assert result.stderr == "1 mistake\n"
    assert call("validate", "good.yaml").exit_code == 0


def test_quiet_keeps_stderr_for_what_is_wrong() -> None:
    """With -q nothing but mistakes is told."""
    assert call("-q", "init", "--out", "f.yaml").stderr == ""
    assert call("init", "--out", "g.yaml").stderr == "Now try: bindusbl-des run g.yaml\n"
    assert "none.yaml: no such file" in call("-q", "run", "none.yaml").stderr


@pytest.mark.parametrize("path", sorted(SCENARIOS.glob("*.yaml")), ids=lambda path: path.stem)
def test_shipped_scenarios_are_right(path: Path) -> None:
    """Every scenario that comes with the package is valid and named as its file."""
    assert load_scenario(path).name == path.stem


def test_the_schema_that_editors_use_is_up_to_date() -> None:
    """`scenarios/scenario.schema.json` is what `bindusbl-des schema` prints; else print it anew."""
    printed = call("schema").stdout
    assert (SCENARIOS / "scenario.schema.json").read_text(encoding="utf-8") == printed


def test_the_schema_says_what_it_is() -> None:
    """Editors need title, dialect and closed sections."""
    schema = json.loads(call("schema").stdout)
    assert schema["title"] == "bindusbl-des scenario"
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert schema["required"] == ["name"]
    own = {"OwnPlacement", "OwnRoute"}  # whose settings are their author's
    open_ones = {
        name for name, it in schema["$defs"].items() if it.get("additionalProperties", True)
    }
    assert open_ones == own


def test_every_field_of_the_schema_is_listed() -> None:
    """`params` has each key that is no section of further ones, as the schema that editors use."""
    schema = json.loads(call("schema").stdout)
    fields = {
        (name, field["description"])
        for part in (schema, *schema["$defs"].values())
        for name, field in part.get("properties", {}).items()
        if "description" in field
        and "$ref" not in json.dumps(field)
        and not field["description"].endswith("null = as for all")  # of a group, as its section
    }
    rows = params()
    assert len(fields) > 120
    assert fields <= {(row["key"].rpartition(".")[2], row["meaning"]) for row in rows}


def test_keys_tell_what_the_models_hold() -> None:
    """Type, choices, unit, default, range and source of a few keys, in words."""
    rows = {row["key"]: row for row in reversed(params())}  # keys come before parts' settings
    speed = rows["auvs.speed_m_per_s"]
    assert [speed[it] for it in ("kind", "unit", "default", "range")] == [
        "number", "m/s", "0.627", ">= 0.001 and <= 20",
    ]  # fmt: skip
    kinds = rows["auvs.route.kind"]["choices"]
    assert list(kinds[:4]) == ["lawnmower", "hold", "waypoints", "track"]
    points = rows["auvs.route.points_m"]
    assert (points["kind"], points["only"]) == ("list of list of [x, y]", "waypoints")
    told = rows["navigation.filter.untold"]
    assert told["kind"].startswith("list of misalignment | gnss | ")
    assert told["only"] == "kalman, smoother"
    assert rows["protocol.tick_rate_hz"]["kind"] == "number, or null"
    assert rows["usbl.array"]["source"].startswith("Nitsch 2024")
    name = rows["name"]
    assert (name["default"], name["range"]) == ("(required)", "1 to 100 characters")


def test_defaults_in_the_list_are_those_of_the_scenario() -> None:
    """A scenario that gives a key its default is the one that does not give it."""
    text = "name: m\nnavigation: {gnss_fix: {}, peers: {}}\nprotocol: {relay: {}}\n"
    compared = 0
    plain = parse_scenario(text)
    sections = plain.model_dump()
    for row in params():
        section, _, rest = row["key"].partition(".")
        if section in ("traffic", "modems") or any(
            part in row["key"] for part in (".wind.", ".bathymetry.", "dvl_range_m")
        ):  # not beside peers; calm; no bottom
            continue
        if not rest or section not in sections or row["only"] not in ("", "lawnmower"):
            continue
        if row["default"] and row["kind"] != "metric" and "failures." not in row["key"]:
            if row["key"].startswith(("auvs.groups.", "asvs.groups.")):  # numbered
                continue
            given = parse_scenario(text, overrides=[f"{row['key']}={row['default']}"])
            assert given == plain, row["key"]
            compared += 1
    assert compared > 90


def test_params_knows_metrics() -> None:
    """What `--below` asks for is found where keys are."""
    assert call("params", "fix_age_p95").stdout == (
        "fix_age_p95_s: metric, s\n    95 % of the time that age is below this\n"
    )
    assert call("params", "worst_fix_age_p95").stdout == call("params", "fix_age_p95").stdout
    (found,) = json.loads(call("params", "fix_age_p95", "--json").stdout)
    assert (found["key"], found["kind"], found["unit"]) == ("fix_age_p95_s", "metric", "s")


def test_params_lists_and_selects() -> None:
    """`params` prints all keys, those that contain a word, or those that match a pattern."""
    assert call("params").stdout.count("\n") == 2 * len(params())
    assert call("params", "AHRS heading").stdout == (
        "usbl.heading_sd_deg: 1 deg  (number >= 0 and <= 45)\n"
        "    AHRS heading noise; with model: datasheet none unless given, and then added to the "
        "data sheet's figures [Nitsch 2024, USBL-Simulator]\n"
    )
    rows = json.loads(call("params", "acoustics.*.range_m", "--json").stdout)
    assert [row["key"] for row in rows] == ["acoustics.hf.range_m", "acoustics.mf.range_m"]


@pytest.mark.parametrize("name", TEMPLATES)
def test_templates_are_right_and_show_every_key(name: str) -> None:
    """Each starter is valid and names every key once, the less important ones in comments."""
    text = call("init", name).stdout
    parse_scenario(text)
    shown = [line.strip().lstrip("# ").partition(":")[0] for line in text.splitlines()]
    rows = {row["key"]: row for row in params() if row["kind"] != "metric"}
    for key, row in rows.items():
        parent, _, name = key.rpartition(".")
        if not row["only"] and not rows.get(parent, {"kind": ""})["kind"].startswith("list"):
            assert name in shown, key


def test_the_starter_stays_right_with_every_comment_removed() -> None:
    """The values in the starter's comments are the defaults, so uncommenting changes nothing."""
    lines = [
        line.replace("# ", "", 1) if line.lstrip().startswith("# ") and "; only " not in line
        else line
        for line in call("init").stdout.partition("\n\n")[2].splitlines()
    ]  # fmt: skip
    assert "  depth_sd_m: 0.05" in "\n".join(lines)
    assert parse_scenario("\n".join(lines)) == parse_scenario(call("init").stdout)


def test_init_prints_or_writes_the_same() -> None:
    """`init` goes to stdout or to a file; `--force` replaces it."""
    printed = call("init").stdout
    assert call("init", "--out", "f.yaml").stdout == ""
    assert Path("f.yaml").read_text() == printed
    assert call("init", "paper", "--out", "f.yaml", "--force").exit_code == 0
    assert Path("f.yaml").read_text() == call("init", "paper").stdout
    Path("link.yaml").symlink_to("f.yaml")
    assert call("init", "--out", "link.yaml", "--force").exit_code == 0
    assert Path("f.yaml").read_text() == call("init", "paper").stdout
    assert Path("link.yaml").read_text() == printed
    os.mkfifo("pipe")
    assert "pipe: is no file" in call("init", "--out", "pipe", "--force").stderr


def test_run_writes_a_folder_and_prints_metrics() -> None:
    """`run --json` prints the mission's metrics, tells the models and writes one folder only."""
    Path("f.yaml").write_text(TINY)
    result = call("run", "f.yaml", "--seed", "3", "--json", "--set", "auvs.count=1", "--no-advice")
    metrics = json.loads(result.stdout)
    assert metrics["rounds"] == 5
    assert isinstance(metrics["rounds"], int)
    told = [  # while equations are compiled, it says how far the mission is
        line
        for line in result.stderr.splitlines()
        if not line.startswith("Compiling") and " s simulated" not in line
    ]
    assert told == [
        "tiny: 1 AUV (kinematic), 3 ASVs (moored), 5 s, spatial_reuse / sequential / rotate, "
        "owtt_sync, kalman, exact clock",
        "Results: results/tiny-seed3",
    ]
    assert sorted(path.name for path in Path().iterdir()) == ["f.yaml", "results"]
    assert [path.name for path in Path("results").iterdir()] == ["tiny-seed3"]
    assert Scenario.model_validate(
        json.loads(Path("results/tiny-seed3/run.json").read_text())["scenario"]
    ) == parse_scenario(TINY, overrides=["auvs.count=1"])


def test_run_prints_a_summary_and_keeps_the_file() -> None:
    """Without `--json` the summary comes; the scenario's text goes to the folder as it was."""
    Path("f.yaml").write_text(TINY)
    result = call("-q", "run", "f.yaml", "--out", "o")
    assert (result.exit_code, result.stderr) == (0, "")
    assert result.stdout.splitlines()[-1] == "Results: o"
    assert len(result.stdout.splitlines()) > 3
    assert max(map(len, result.stdout.splitlines())) <= 80
    assert Path("o/scenario.yaml").read_text() == TINY


def test_run_never_overwrites_before_it_is_told_to(monkeypatch: pytest.MonkeyPatch) -> None:
    """An existing folder ends the command before the mission is simulated."""
    Path("f.yaml").write_text(TINY)
    words = ("-q", "run", "f.yaml", "--out", "o", "--json", "--no-advice")
    assert call(*words).exit_code == 0
    assert call(*words, "--force").exit_code == 0
    monkeypatch.setattr("bindusbl_des.core.mission.simulation.simulate", _must_not_run)
    result = call("run", "f.yaml", "--out", "o")
    assert result.exit_code == 2
    assert result.stderr == (
        "o: exists; use --force (in Python force=True) to replace it, or name another folder\n"
    )


def test_of_two_runs_with_one_folder_none_is_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    """The folder of the run that ends first stays; the other's lies beside it, and says so."""
    Path("f.yaml").write_text(TINY)

    def overtaken(*words: Any, **options: Any) -> Any:
        monkeypatch.setattr("bindusbl_des.core.mission.simulation.simulate", simulate)
        first = call("-q", "run", "f.yaml", "--seed", "1", "--out", "o", "--no-advice")
        assert first.exit_code == 0
        return simulate(*words, **options)

    monkeypatch.setattr("bindusbl_des.core.mission.simulation.simulate", overtaken)
    second = call("-q", "run", "f.yaml", "--seed", "2", "--out", "o", "--no-advice")
    assert (second.exit_code, second.stdout) == (2, "")
    assert second.stderr == ("o: came to exist meanwhile; what was to be written there is in o-2\n")
    assert [load_result(folder).seed for folder in ("o", "o-2")] == [1, 2]
    assert sorted(os.listdir()) == ["f.yaml", "o", "o-2"]


def test_a_folder_that_cannot_be_written_is_told_before_the_mission(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The draft is made first, so that nobody waits for results that have no place."""
    Path("f.yaml").write_text(TINY)

    def refused(*_: object, **__: object) -> None:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), ".o-abc.draft")

    monkeypatch.setattr("bindusbl_des.core.mission.simulation.simulate", _must_not_run)
    monkeypatch.setattr("bindusbl_des.support.files.tempfile.mkdtemp", refused)
    told = call("-q", "run", "f.yaml", "--out", "new/o")
    assert (told.exit_code, told.stderr) == (2, "new/o: cannot be written (Permission denied)\n")
    assert os.listdir() == ["f.yaml"]


def test_a_disk_that_fills_up_is_told_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing stays of results that have no room."""
    Path("f.yaml").write_text(TINY)

    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("bindusbl_des.core.results.result.write_parquet", full)
    told = call("-q", "run", "f.yaml", "--out", "new/o", "--no-advice")
    assert told.exit_code == 2
    assert told.stderr == "new/o: cannot be written (No space left on device)\n"
    assert os.listdir() == ["f.yaml"]


@pytest.mark.parametrize(("request_", "code"), [("SIGTERM", 143), ("SIGHUP", 129)])
def test_a_run_that_is_asked_to_end_leaves_nothing(request_: str, code: int) -> None:
    """Neither its draft nor the folders that were made for it."""
    Path("f.yaml").write_text("name: long\nduration_s: 100000\n")
    words = ["-q", "run", "f.yaml", "--out", "new/o", "--no-advice"]
    run = subprocess.Popen([sys.executable, "-m", "bindusbl_des.cli", *words])
    while not list(Path().glob("new/.o-*.draft/host")):
        assert run.poll() is None
        time.sleep(0.01)
    run.send_signal(signal.Signals[request_])
    assert run.wait(60) == code
    assert os.listdir() == ["f.yaml"]


def test_requests_to_end_that_nobody_hears_stay_unheard() -> None:
    """What `nohup` ignores is ignored; afterwards all is as it was; one sent twice counts once."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with ended_in_order():
            assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
            with pytest.raises(SystemExit, match="143"):
                signal.raise_signal(signal.SIGTERM)
            signal.raise_signal(signal.SIGTERM)
        assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
    finally:
        signal.signal(signal.SIGHUP, before)


def test_a_request_to_end_that_python_drops_is_made_again() -> None:
    """As while C code imports a module, or here while an object is cleared up."""

    class Dropping:
        def __del__(self) -> None:
            signal.raise_signal(signal.SIGTERM)

    def dropping() -> None:
        Dropping()
        time.sleep(10)

    with ended_in_order(), pytest.raises(SystemExit, match="143"):
        dropping()


PATHS = ("x" * 300, "y" * 5000, "nul\0byte", os.fsdecode(b"bytes\xff\xfe"))
PLACES = (
    "run {}", "run f.yaml --no-advice --out {}", "run f.yaml --no-advice --force --out {}/o",
    "validate {}", "timing {}", "coverage f.yaml --figure {}.png", "init --out {}",
    "report {}", "report o --out {}", "report o {} --out r.html", "plot {}",
    "plot o coverage --out {}.svg", "export {} --to csv", "export o --to csv --out {}",
    "explain {} --ping 1", "status {}", "resume {}", "compare {} {}", "merge {} --out m",
)  # fmt: skip


@pytest.mark.parametrize("place", PLACES)
def test_a_name_that_no_file_has_is_told_in_one_line(place: str) -> None:
    """Too long, with a NUL, or of bytes that are not UTF-8: exit code 2, or as any other name."""
    Path("f.yaml").write_text(TINY)
    simulate(load_scenario("f.yaml")).write("o")
    for path in PATHS:
        told = call("-q", *(word.replace("{}", path) for word in place.split()))
        if told.exit_code == 0:  # files may have the last one
            assert path == PATHS[-1]
            continue
        lines = told.stderr or told.stdout  # `validate` prints what it finds
        assert (told.exit_code, lines.count("\n")) == (2, 1), told.output
        assert "\0" not in told.output


def _must_not_run(*_: object, **__: object) -> None:
    raise AssertionError("simulated")


def test_a_run_that_fails_ends_with_1(monkeypatch: pytest.MonkeyPatch) -> None:
    """A mission that cannot go on is told in one line; no folder is left."""

    def fail(*_: object, **__: object) -> None:
        raise FloatingPointError("the AUV left the sea")

    Path("f.yaml").write_text(TINY)
    monkeypatch.setattr("bindusbl_des.core.mission.simulation.simulate", fail)
    result = call("-q", "run", "f.yaml")
    assert (result.exit_code, result.stdout) == (1, "")
    assert result.stderr == "tiny: the run failed: the AUV left the sea\n"
    assert not Path("results").exists()


def test_an_interrupted_run_ends_with_130(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C is no traceback."""

    def interrupt(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    Path("f.yaml").write_text(TINY)
    monkeypatch.setattr("bindusbl_des.core.mission.simulation.simulate", interrupt)
    result = call("-q", "run", "f.yaml")
    assert (result.exit_code, result.stderr) == (130, "interrupted\n")


def test_default_folder_stays_under_results() -> None:
    """A name is no path."""
    Path("f.yaml").write_text(TINY.replace("tiny", "../a b/c"))
    told = call("-q", "run", "f.yaml", "--seed", 7, "--no-advice").stdout
    assert told.endswith("Results: results/.._a_b_c-seed7\n")
    assert Path("results/.._a_b_c-seed7/run.json").exists()


def test_models_are_told_in_one_line() -> None:
    """The line that `run` begins with names what takes part."""
    told = call("run", "recovery_140m", "--set", "duration_s=5", "--no-advice", "--out", "o")
    assert told.stderr.splitlines()[0] == (
        "recovery_140m: 3 AUVs (kinematic), 3 ASVs (moored), 5 s, "
        "spatial_reuse / sequential / rotate, owtt_sync, fixed_gain, 30 Hz ticks"
    )


def test_explain_tells_the_way_of_a_ping() -> None:
    """`explain` names the ping; a number that is none is bad input."""
    Path("f.yaml").write_text("name: m\nduration_s: 5\n")
    assert call("-q", "run", "f.yaml", "--out", "o", "--json", "--no-advice").exit_code == 0
    assert call("explain", "o", "--ping", "0").stdout.startswith("Ping 0 of AUV0")
    assert call("explain", "o", "--fix", "0").stdout.startswith("Ping ")
    beyond = call("explain", "o", "--ping", "999")
    assert (beyond.exit_code, beyond.stdout) == (2, "")
    assert beyond.stderr.startswith("the run has no ping 999;")


def test_limits_of_asvs_that_move_are_said_to_be_those_of_a_ring() -> None:
    """They may go where AUVs are, and serve them better than a ring does."""
    asked = ("timing", str(SCENARIOS / "recovery_140m.yaml"))
    moves = ("--set", "asvs.formation={model: follow}")
    at_rest, moving = (call(*asked, *keys).stdout for keys in ((), moves))
    told = "These ASVs move. Limits of moored ones on a ring, which missions may exceed:"
    assert (told in at_rest, told in moving) == (False, True)


def test_timing_has_the_papers_slots() -> None:
    """L = 140 m: t_C 93.3 ms, T_UL 233.3 ms = 7 ticks, T_DL(3) 933.3 ms, round 1.167 s."""
    text = call("timing", str(SCENARIOS / "recovery_140m.yaml")).stdout
    assert "crossing time t_C         93.333 ms" in text
    assert "233.333 ms = 7 ticks" in text
    assert "     3      56     448.0     933.3    1.167 .. 1.633" in text


def test_coverage_has_the_area_worked_out_elsewhere() -> None:
    """L = 140 m, R = 50 m, three ASVs at 0 deg: 87.49 % covered, worst corner 72.8 m away."""
    path = str(SCENARIOS / "recovery_140m.yaml")
    result = call("coverage", path, "--figure", "map.svg")
    assert "87.49 %" in result.stdout
    assert "72.80 m, beyond the HF range" in result.stdout
    assert Path("map.svg").read_text(encoding="utf-8").startswith("<?xml")
    assert call("coverage", path, "--figure", "map.svg").exit_code == 2
    assert call("coverage", path, "--figure", "map.svg", "--force").exit_code == 0


def test_coverage_of_a_slant_range_is_smaller() -> None:
    """R = 50 m slant at 30 m depth reaches 40 m seen from above."""
    Path("f.yaml").write_text(
        "name: m\nsurvey: {depth_m: 30}\nacoustics: {hf: {range_metric: slant}}\n"
    )
    assert "50.00 m slant, 40.00 m seen from above" in call("coverage", "f.yaml").stdout


def test_coverage_says_that_it_leaves_failures_out() -> None:
    """It is of all ASVs, also of one that fails: who is lost for good is told to hear."""
    given = "name: m\nasvs: {count: 3}\n"
    Path("all.yaml").write_text(given)
    Path("lost.yaml").write_text(given.replace("3", "3, failures: [{asv: 1, at_s: 0}]"))
    whole, lost = (call("coverage", path).stdout for path in ("all.yaml", "lost.yaml"))
    said = f"{'asvs.failures':<26}left out: ASVs that fail are taken to hear all the time\n"
    assert said in lost
    assert lost.replace(said, "") == whole
    left_out = [
        json.loads(call("coverage", path, "--json").stdout)["left_out"]
        for path in ("all.yaml", "lost.yaml")
    ]
    assert left_out == [[], ["asvs.failures"]]


def test_doctor_finds_this_environment_sound() -> None:
    """Where the tests run, everything that a mission needs is there."""
    result = call("doctor", "--json")
    report = json.loads(result.stdout)
    assert (report["ok"], result.exit_code) == (True, 0)
    names = [finding["name"] for finding in report["findings"]]
    assert {"python", "numpy", "simpy", "compiled code", "tiny mission"} <= set(names)


def test_doctor_prints_the_remedy_for_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    """A package that is absent or too old is told with the pip line, and the exit code is 1."""
    wanted = [("numpy", "999"), ("no-such-package", "1.2")]
    monkeypatch.setattr("bindusbl_des.apps.commands.doctor._requirements", lambda: wanted)
    result = call("doctor")
    assert result.exit_code == 1
    assert 'missing no-such-package python -m pip install "no-such-package>=1.2"' in result.stdout
    assert 'is older than 999; python -m pip install "numpy>=999"' in result.stdout


def test_doctor_survives_a_broken_mission(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever breaks in the tiny mission is a finding, no traceback."""
    monkeypatch.setattr("bindusbl_des.core.mission.simulation.simulate", _must_not_run)
    result = call("doctor")
    assert result.exit_code == 1
    assert "broken  tiny mission    AssertionError: simulated" in result.stdout


def test_a_closed_pipe_is_no_traceback() -> None:
    """`bindusbl-des schema | head -1` ends quietly."""
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "bindusbl_des.cli", "schema"]
    done = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, text=True)
    os.close(writer)
    assert "Traceback" not in done.stderr


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no device that is always full")
@pytest.mark.parametrize(
    "command", ["schema", "--help", "params", "-q run f.yaml --no-advice", "validate f.yaml"]
)
def test_an_output_on_a_full_disk_is_told_in_one_line(command: str) -> None:
    """What cannot be written ends with 1 and the reason, not with a traceback."""
    Path("f.yaml").write_text(TINY)
    words = [sys.executable, "-m", "bindusbl_des.cli", *command.split()]
    with open("/dev/full", "w") as full:
        done = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 1
    assert done.stderr == "Error: the output cannot be written: No space left on device\n"


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no device that is always full")
def test_a_mission_is_not_lost_for_want_of_talk() -> None:
    """Where stderr cannot be written the results are; so too where the progress line cannot."""
    Path("f.yaml").write_text(TINY)
    words = [sys.executable, "-m", "bindusbl_des.cli", "run", "f.yaml", "--out", "o", "--no-advice"]
    with open("/dev/full", "w") as full:
        done = subprocess.run(words, stdout=subprocess.PIPE, stderr=full, text=True)
    assert (done.returncode, done.stdout.splitlines()[-1]) == (0, "Results: o")
    assert load_result("o").seed == 0


def test_who_waits_for_compiling_hears_how_far_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each function that is compiled is told, with the time that those before it took."""
    from bindusbl_des.support import compiled as watched
    from bindusbl_des.support.compiled import compiled

    clock = iter(range(100))
    monkeypatch.setattr(watched, "monotonic", lambda: float(next(clock)))
    told: list[tuple[int, float]] = []
    before = watched.compiling_s()
    watched.watch_compiling(lambda made, spent: told.append((made, spent)))
    for number in (2, 4):
        names: dict[str, Any] = {}
        exec(f"def share(x): return x / {number}", names)  # without a file there is no cache
        assert compiled(names["share"])(1.0) == 1.0 / number
    watched.watch_compiling(None)
    assert [made for made, _ in told] == [1, 2]
    assert told[0][1] > 0.0
    assert told[1][1] > told[0][1]
    assert watched.compiling_s() > before


class Terminal(io.StringIO):
    """What a terminal would get."""

    def isatty(self) -> bool:
        return True


def test_a_terminal_counts_the_equations_down(monkeypatch: pytest.MonkeyPatch) -> None:
    """How many are compiled and how long the rest takes, in a line that is gone in the end."""
    from bindusbl_des.apps.commands.console import compiling_shown
    from bindusbl_des.support import compiled
    from bindusbl_des.support import process as progress

    screen, clock = Terminal(), iter(range(0, 1000, 5))
    monkeypatch.setattr(sys, "stderr", screen)
    monkeypatch.setattr(progress, "monotonic", lambda: float(next(clock)))
    with compiling_shown():
        tell = compiled._WATCH.tell
        assert tell is not None
        made, spent = compiled._WATCH.functions, compiled.compiling_s()
        tell(made + 1, spent)
        tell(made + 50, spent + 10.0)
    said = screen.getvalue()
    assert said.startswith("Compiling the equations, once; this takes up to a minute ")
    assert "\r50 of about 200 equations compiled, 30 s left\x1b[K" in said
    assert said.endswith("\r\x1b[K")


def test_leave_for_plug_ins_holds_for_validate_as_well(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the variable as by the option: what cannot be loaded is a mistake."""
    file = tmp_path / "own.yaml"
    file.write_text("name: own\nprotocol: {schedule: 'nowhere_at_all:part'}\n")
    asked = call("validate", file, "--allow-plugins")
    monkeypatch.setenv("BINDUSBL_ALLOW_PLUGINS", "1")
    given = call("validate", file)
    assert (asked.exit_code, given.exit_code) == (2, 2)
    assert given.output == asked.output
