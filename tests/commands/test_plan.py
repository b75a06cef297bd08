"""The command `plan`: what it says, writes, refuses, and goes on with."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from campaigns_for_tests import auv, hand_made
from commands_for_tests import call

from bindusbl_des import Scenario

BAY = "name: bay\nduration_s: 60\nsurvey: {side_m: 100}\nauvs: {count: 1}\n"
FEW = ("--vary", "asvs.count=1:3", "--vary", "protocol.downlink=sequential",
       "--vary", "asvs.formation.radius_m=40")  # fmt: skip
GOAL = ("--below", "position_error_p95_m=1")


def fleet(scenario: Scenario, seed: int) -> list[dict[str, float | None]]:
    """Return errors of 2, 1 and 2/3 m for one, two and three ASVs; the p95 is 1.2 times those."""
    error = 2.0 / scenario.asvs.count + 0.01 * (seed % 7 - 3)
    return [auv(error, position_error_p95_m=1.2 * error)]


@pytest.fixture(autouse=True)
def _in_this_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each test runs in a folder with a scenario; missions come to what `fleet` says."""
    monkeypatch.chdir(tmp_path)
    hand_made(monkeypatch, fleet)
    Path("bay.yaml").write_text(BAY)


def test_a_plan_is_told_in_a_few_lines() -> None:
    """Answer, runners-up, what binds and what if, then the files and the command to fly it."""
    outcome = call("plan", "bay.yaml", *GOAL, *FEW, "--out", "out")
    assert outcome.exit_code == 0
    lines = outcome.stdout.splitlines()
    assert lines[0].startswith("3 ASVs on a ring of 40 m")
    assert [it.split("  ")[0] for it in lines if it.startswith(("runners-up", "and if"))] == [
        "runners-up", "and if",
    ]  # fmt: skip
    assert lines[-2:] == ["Results: out", "bindusbl-des run out/best.yaml"]
    assert max(map(len, lines)) <= 80
    files = sorted(it.name for it in Path("out").iterdir())
    assert files == [
        "best.yaml",
        "missions",
        "plan.html",
        "plan.json",
        "question.json",
        "sensitivity",
    ]
    assert call("run", "out/best.yaml", "--set", "duration_s=5", "--no-advice").exit_code == 0


def test_other_commands_know_the_folder_of_a_plan() -> None:
    """`status` says what was flown; what reads results names the plan's page."""
    call("plan", "bay.yaml", *GOAL, *FEW, "--out", "out")
    flown = json.loads(call("status", "out", "--json").stdout)["done"]
    told = dict(line.split(maxsplit=1) for line in call("status", "out").stdout.splitlines())
    assert (told["plan"], told["flown"], told["failed"]) == ("bay", str(flown), "0")
    for command in ("report", "plot"):
        outcome = call(command, "out")
        assert outcome.exit_code == 2
        assert outcome.stderr.startswith("out holds a plan: open its plan.html")


def test_the_answers_of_plans_are_compared() -> None:
    """`compare` takes plans for their answers, paired by seed; one alone has nothing beside it."""
    call("plan", "bay.yaml", *GOAL, *FEW, "--out", "out")
    call("plan", "bay.yaml", *GOAL, *FEW, "--set", "auvs.speed_m_per_s=1", "--out", "other")
    outcome = call("compare", "out", "other", "--metric", "worst_position_error_p95_m")
    assert outcome.exit_code == 0, outcome.stderr
    text = " ".join(outcome.stdout.split())
    answer = json.loads(Path("out/plan.json").read_text())
    team = answer["candidates"][answer["chosen"]]
    assert f"A: out, the answer, {team['team']} (baseline)" in text
    assert "B: other, the answer, " in text
    assert "auvs.speed_m_per_s=1 instead of" in text
    assert "not finished" not in text
    rows = json.loads(call("compare", "out", "other", "--json").stdout)["differences"]
    [error] = [it for it in rows if it["metric"] == "worst_position_error_p95_m"]
    assert error["baseline_mean"] == pytest.approx(team["simulated"]["mean"][0], rel=0.1)
    assert error["pairs"] >= 4
    alone = call("compare", "out")
    assert alone.exit_code == 2
    assert "is a plan; compare the campaign of its missions, out/missions" in alone.stderr
    mixed = call("compare", "out/missions", "other")
    assert mixed.exit_code == 0, mixed.stderr


def test_json_is_the_record_and_nothing_else() -> None:
    """With --json, before or after the name, stdout is `plan.json`."""
    outcome = call("--json", "plan", "bay.yaml", *GOAL, *FEW, "--out", "out")
    assert json.loads(outcome.stdout) == json.loads(Path("out/plan.json").read_text())


def test_nothing_that_keeps_the_goal_is_no_failure() -> None:
    """The exit code is 0, the answer null, and what would is told."""
    goal = ("--below", "position_error_p95_m=0.1")
    outcome = call("plan", "bay.yaml", *goal, *FEW, "--out", "out")
    assert outcome.exit_code == 0
    assert "No team" in outcome.stdout
    assert "The nearest is 3 ASVs" in outcome.stdout
    assert json.loads(Path("out/plan.json").read_text())["answer"] is None


def test_a_plan_file_says_it_all() -> None:
    """Scenario, goals, candidates, confidence, cost; options are laid over it."""
    Path("bay_plan.yaml").write_text(
        "name: in the bay\nscenario: bay.yaml\n"
        "goal:\n- {metric: position_error_p95_m, below: 1}\n"
        "- {metric: fix_rate_hz, above: 0.1, of: mean}\n"
        "candidates: {asvs.count: 1:3, asvs.formation.radius_m: [40],\n"
        "  protocol.schedule: [spatial_reuse], protocol.downlink: [sequential]}\n"
        "confidence: 0.9\ncost: {asv: 20}\n"
    )
    words = ("bay_plan.yaml", "--seed", 3, "--out", "out")
    assert call("plan", *words).exit_code == 0
    record = json.loads(Path("out/plan.json").read_text())
    assert [goal.get("of") for goal in record["goal"]] == ["worst", "mean"]
    assert (record["name"], record["confidence"], record["seed"]) == ("in the bay", 0.9, 3)
    assert record["candidates"][record["chosen"]]["cost"] == 60.0
    assert call("validate", "bay_plan.yaml").exit_code == 0


WRONG = """\
scenario: bay.yaml
goal: {metric: positon_error_p95_m, below: 1}
candidates: {asvs.cuont: [1, 2]}
confidence: 95
budget: 30
cost: {asvs: 3}
"""


def test_mistakes_are_told_all_at_once_where_they_stand() -> None:
    """Each has file, line, column, key and remedy; nothing is written."""
    Path("wrong.yaml").write_text(WRONG)
    outcome = call("plan", "wrong.yaml", "--out", "out")
    assert outcome.exit_code == 2
    assert outcome.stderr.splitlines() == [
        "wrong.yaml:2:7: goal: no metric 'positon_error_p95_m'; did you mean "
        "'position_error_p95_m'?",
        "wrong.yaml:3:14: asvs.cuont: unknown key; did you mean 'count'?",
        "wrong.yaml:4:13: confidence: needs a number >= 0.5 and <= 0.9999; got 95",
        "wrong.yaml:5:1: budget: unknown key; did you mean 'budget_s'?",
        "wrong.yaml:6:8: cost.asvs: no such cost; write asv, or KEY=VALUE such as "
        "acoustics.mf.range_m=200",
    ]
    assert call("validate", "wrong.yaml").exit_code == 2
    assert not Path("out").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("bay.yaml",), "goal: missing; add it, such as `goal: {metric:"),
        (("bay.yaml", "--below", "position_error_p95_m"), "needs METRIC=VALUE"),
        (("bay.yaml", *GOAL, "--mean", "--share", "0.5"), "give either --mean or --share"),
        (("bay.yaml", *GOAL, "--vary", "asvs.count=3:1"), "counts up; write 1:3"),
        (
            ("bay.yaml", *GOAL, "--budget-s", "0"),
            "--budget-s 0.0: budget_s: needs a number >= 1",
        ),
        (
            ("bay.yaml", *GOAL, "--budget-missions", "0"),
            "--budget-missions 0: budget_missions: needs a whole number >= 1",
        ),
        (("nothing.yaml", *GOAL), "no such file"),
        (("bay.yaml", *GOAL, "--set", "protocol.schedule=mine:first"), "--allow-plugins"),
    ],
)
def test_wrong_words_are_refused(words: tuple[str, ...], said: str) -> None:
    """Exit code 2, one remedy, no folder."""
    outcome = call("plan", *words, "--out", "out")
    assert outcome.exit_code == 2
    assert said in outcome.stderr
    assert "Traceback" not in outcome.stderr
    assert not Path("out").exists()


def test_what_is_set_may_hold_with_what_is_varied_alone() -> None:
    """A failure of an ASV that only varied numbers have: of a plan and of a sweep; where some of
    them lack it, these are told.
    """
    failure = ("--set", "asvs.failures=[{asv: 2, at_s: 30}]")
    few = [words for word, words in zip(FEW[::2], FEW[1::2], strict=True) if word == "--vary"]
    vary = [word for words in few if "asvs.count" not in words for word in ("--vary", words)]
    outcome = call("plan", "bay.yaml", *GOAL, *vary, "--vary", "asvs.count=3:4", *failure)
    assert outcome.exit_code == 0, outcome.stderr
    dry = ("sweep", "bay.yaml", "--dry-run", *failure)
    assert "4 missions" in call(*dry, "--vary", "asvs.count=3:4", "--seeds", "2").stdout.replace(
        "missions  4", "4 missions"
    )
    outcome = call(*dry, "--vary", "asvs.count=2:4")
    assert outcome.exit_code == 2
    assert outcome.stderr.startswith("--vary asvs.count=2:4: asvs.failures.0.asv: there is no ASV2")
    outcome = call(*dry, "--vary", "asvs.count=1:2")
    assert "there is no ASV2" in outcome.stderr
    assert "is varied" not in outcome.stderr


def test_resume_goes_on_with_a_plan() -> None:
    """A folder that holds a question alone is a plan that was cut short."""
    call("plan", "bay.yaml", *GOAL, *FEW, "--out", "out")
    whole = json.loads(Path("out/plan.json").read_text())
    for name in ("plan.json", "best.yaml", "plan.html"):
        (Path("out") / name).unlink()
    outcome = call("resume", "out")
    assert outcome.exit_code == 0
    assert json.loads(Path("out/plan.json").read_text()) == whole


@pytest.mark.slow
def test_a_plan_that_is_killed_goes_on_with_any_number_of_workers(tmp_path: Path) -> None:
    """Ctrl-C keeps what was flown and says how to go on; two workers find what one would."""
    words = [sys.executable, "-m", "bindusbl_des.cli", "plan", "bay.yaml", *FEW,
             "--below", "position_error_p95_m=2"]  # fmt: skip
    killed = subprocess.Popen([*words, "--out", "out"], stderr=subprocess.PIPE, text=True)
    while not list(tmp_path.glob("out/missions/missions/*.parquet")):
        assert killed.poll() is None, killed.stderr.read() if killed.stderr else ""
        time.sleep(0.05)
    killed.send_signal(signal.SIGINT)
    _, said = killed.communicate(timeout=120)
    if killed.returncode == 130:  # it was not done already
        assert "`bindusbl-des resume out` goes on from there" in said
        assert not Path("out/plan.json").exists()
        subprocess.run([*words, "--out", "out", "--workers", "1"], check=True)
    subprocess.run([*words, "--out", "two", "--workers", "2"], check=True)
    records = [json.loads((Path(it) / "plan.json").read_text()) for it in ("out", "two")]
    for record in records:
        del record["scenario"], record["run"]
    assert records[0] == records[1]


def test_a_plan_is_no_mission_to_export(tmp_path: Path) -> None:
    """What can be exported of it is said."""
    (tmp_path / "question.json").touch()
    told = call("export", tmp_path, "--to", "csv")
    assert told.exit_code == 2
    assert "is a plan, of many missions; export its team to" in told.stderr
