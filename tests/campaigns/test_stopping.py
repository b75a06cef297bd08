"""Seeds run until a point is known well enough: the same ones, whoever runs them."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from campaigns_for_tests import OneThread
from commands_for_tests import call

from bindusbl_des import load_campaign, resume, sweep
from bindusbl_des.campaigns import running
from bindusbl_des.campaigns.campaign import unfinished_campaign
from bindusbl_des.campaigns.experiments.experiment import Target, checkpoints
from bindusbl_des.campaigns.statistics.intervals import interval
from bindusbl_des.campaigns.statistics.outcomes import MissionOutcomes
from bindusbl_des.campaigns.statistics.points_table import seeds_wanted, wide_points
from bindusbl_des.campaigns.storage.part_rows import done
from bindusbl_des.campaigns.storage.parts import part_path
from bindusbl_des.campaigns.workers.pools import pool_for

METRIC = "position_error_m"
VARY = {"asvs.formation.angle_deg": [0, 60]}


@pytest.fixture(autouse=True)
def _in_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each test runs in a folder with a scenario alone; missions run in this process."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(running, "pool_for", OneThread)
    Path("short.yaml").write_text("name: short\nduration_s: 10\nsurvey: {side_m: 140}\n")


def found(*points: list[float], seeds: int = 20) -> MissionOutcomes:
    """Return the outcomes of the first seeds of each point; -1 stands for a failed mission."""
    values = np.array([value for point in points for value in point])
    point = np.repeat(np.arange(len(points)), [len(it) for it in points])
    seed = np.concatenate([np.arange(len(it)) for it in points])
    return MissionOutcomes(point * seeds + seed, point, seed, values != -1, {METRIC: values})


def plan(*targets: Target, points: int = 1, seeds: int = 20) -> Any:
    """Return what the rule needs to know of a plan."""
    experiment = SimpleNamespace(seeds=range(seeds), until_ci=targets)
    return SimpleNamespace(points=[None] * points, experiment=experiment)


def test_points_stop_at_fixed_numbers_of_seeds() -> None:
    """A point wants seeds up to the next checkpoint until it is narrow there, or all are used."""
    assert list(checkpoints(20)) == [8, 12, 16, 20]
    assert list(checkpoints(5)) == [5]
    even, wild = [1.0, 1.1] * 4, [1.0, 9.0] * 4
    # Half width of `even`: t(7) 2.365 x 0.0535 / sqrt(8) = 0.0447, 4.3 % of 1.05.
    rule = plan(Target(METRIC, "5%"), points=5)
    points = (even, wild, even[:7], [*wild, *wild, *[5.0] * 4], [-1.0] * 8)
    assert seeds_wanted(rule, found(*points)) == [8, 12, 8, 20, 8]
    assert wide_points(rule, found(*points)) == [1, 3, 4]
    assert seeds_wanted(plan(Target(METRIC, 0.045)), found(even)) == [8]
    assert seeds_wanted(plan(Target(METRIC, 0.044)), found(even)) == [12]
    # Rows beyond a checkpoint that another worker has written already change no decision.
    assert seeds_wanted(rule, found([*even, 50.0, 60.0], *points[1:])) == [8, 12, 8, 20, 8]


def test_seeds_are_run_until_the_interval_is_narrow() -> None:
    """The missions are those of the rule; more precision takes more seeds."""
    loose = sweep("short.yaml", "loose", vary=VARY, until_ci={METRIC: "40%"})
    fine = sweep("short.yaml", "fine", vary=VARY, until_ci={METRIC: "7%"})
    counts = [campaign.missions.groupby("point").size().tolist() for campaign in (loose, fine)]
    assert counts[0] == [8, 8]
    assert 16 < sum(counts[1]) < 2 * 64
    for _, rows in fine.missions.groupby("point"):
        known = interval(rows[METRIC].tolist())
        assert known.half_width <= 0.07 * known.mean
        assert rows["seed"].tolist() == list(range(len(rows)))
    assert fine.state().status == "complete"
    assert fine.state().missions == sum(counts[1])


def table(name: str) -> pd.DataFrame:
    return load_campaign(name).missions.drop(columns="wall_time_s")


ASKED: Any = {"vary": VARY, "until_ci": {METRIC: "8%"}, "seeds": 40}


def test_shards_run_the_same_missions() -> None:
    """Joined they are the table of the whole."""
    sweep("short.yaml", "whole", **ASKED)
    assert len(table("whole")) > 16
    for shard in (1, 2):
        sweep("short.yaml", f"shard{shard}", shard=(shard, 2), **ASKED)
    assert call("merge", "shard1", "shard2", "--out", "merged").exit_code == 0
    pd.testing.assert_frame_equal(table("merged"), table("whole"))
    assert load_campaign("merged").state().status == "complete"


@pytest.mark.slow
def test_two_workers_run_the_same_missions(monkeypatch: pytest.MonkeyPatch) -> None:
    sweep("short.yaml", "whole", **ASKED)
    monkeypatch.setattr(running, "pool_for", pool_for)
    sweep("short.yaml", "two", workers=2, **ASKED)
    pd.testing.assert_frame_equal(table("two"), table("whole"))


def test_a_campaign_that_lost_rows_runs_them_again() -> None:
    """What is wanted follows from the rows that are there."""
    sweep("short.yaml", "lost", **ASKED)
    whole = table("lost")
    part_path(Path("lost"), "missions", "all-0001").unlink()
    assert len(done(Path("lost"))) == 0
    assert unfinished_campaign("lost").state().missing == 16
    with pytest.raises(ValueError, match=r"lost the rows of 16 of 16 missions; .*resume lost"):
        load_campaign("lost")
    resume("lost")
    pd.testing.assert_frame_equal(table("lost"), whole)


def test_a_table_says_whether_it_was_reached() -> None:
    """Points that used up their seeds are counted."""
    words = ("--until-ci", f"{METRIC}=0.001", "--until-ci", "rounds=0.1", "--seeds", 8)
    told = call("sweep", "short.yaml", *words, "--out", "wide")
    assert f"{METRIC} +- 0.001, rounds +- 0.1: reached at 0 of 1 points" in told.stdout
    dry = call("sweep", "short.yaml", "--until-ci", f"{METRIC}=1%", "--dry-run")
    assert dry.stdout.startswith("missions  at most 256 (1 points x 256 seeds)")


FORM = (
    "needs half the width of the 95 % confidence interval: a share of the mean such as 5%, or a "
    "number > 0; got"
)

WRONG = {
    "until_ci: 5": [
        "2:11: until_ci: needs metrics with widths, such as {position_error_m: 5%}; got 5"
    ],
    "until_ci: {}": [
        "2:11: until_ci: needs metrics with widths, such as {position_error_m: 5%}; got an empty "
        "section"
    ],
    "until_ci: {position_error: 5%, rounds: -1, fixes: 0%, pings: x}": [
        "2:12: until_ci.position_error: no such metric; did you mean 'position_error_m'?",
        f"2:40: until_ci.rounds: {FORM} -1",
        f"2:51: until_ci.fixes: {FORM} the text '0%'",
        f"2:62: until_ci.pings: {FORM} the text 'x'",
    ],
}


@pytest.mark.parametrize("text", WRONG)
def test_wrong_widths_get_their_messages(text: str) -> None:
    """Every mistake is told with its place."""
    Path("e.yaml").write_text(f"scenario: short.yaml\n{text}\n")
    told = call("sweep", "e.yaml")
    assert told.stderr.splitlines() == [f"e.yaml:{message}" for message in WRONG[text]]
    option = call("sweep", "short.yaml", "--until-ci", "rounds=x")
    assert option.stderr == f"--until-ci rounds=x: until_ci.rounds: {FORM} the text 'x'\n"
