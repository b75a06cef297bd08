"""Seeds run until a point is known well enough: the same ones, whoever runs them."""

from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from campaigns_for_tests import WORKERS, auv, fly_with, hand_made
from commands_for_tests import call
from scipy import stats

from bindusbl_des import Scenario, load_campaign, resume, sweep

METRIC = "position_error_m"
VARY = {"asvs.formation.angle_deg": [0, 60]}


@pytest.fixture(autouse=True)
def _in_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each test runs in a folder with a scenario alone; missions run in this process."""
    monkeypatch.chdir(tmp_path)
    fly_with(monkeypatch)
    Path("short.yaml").write_text("name: short\nduration_s: 10\nsurvey: {side_m: 140}\n")


def test_points_stop_at_fixed_numbers_of_seeds(monkeypatch: pytest.MonkeyPatch) -> None:
    """A point wants seeds up to the next checkpoint (8, 12, 16, ...) until it is narrow there, or
    all are used; one whose missions all fail wants no more.
    """

    def fleet(asked: Scenario, seed: int) -> list[dict[str, float | None]]:
        if asked.asvs.count == 3:
            raise RuntimeError("no water")
        return [auv([1.0, 1.1][seed % 2] if asked.asvs.count == 1 else [1.0, 9.0][seed % 2])]

    # Half width of the first: t(7) 2.365 x 0.0535 / sqrt(8) = 0.0447, 4.3 % of 1.05.
    hand_made(monkeypatch, fleet)
    for width, seeds, wanted in (
        ("5%", 20, [8, 20, 8]), (0.045, 20, [8, 20, 8]), (0.044, 20, [12, 20, 8]),
        ("5%", 5, [5, 5, 5]),
    ):  # fmt: skip
        asked = {"vary": {"asvs.count": [1, 2, 3]}, "until_ci": {METRIC: width}}
        campaign = sweep("short.yaml", seeds=seeds, **asked)
        assert campaign.missions.groupby("point").size().tolist() == wanted
        told = "reached at 1 of 3 points" if seeds == 20 else "reached at 0 of 3 points"
        assert told in campaign.summary()


def test_seeds_are_run_until_the_interval_is_narrow() -> None:
    """The missions are those of the rule; more precision takes more seeds."""
    loose = sweep("short.yaml", "loose", vary=VARY, until_ci={METRIC: "40%"})
    fine = sweep("short.yaml", "fine", vary=VARY, until_ci={METRIC: "7%"})
    counts = [campaign.missions.groupby("point").size().tolist() for campaign in (loose, fine)]
    assert counts[0] == [8, 8]
    assert 16 < sum(counts[1]) < 2 * 64
    for _, rows in fine.missions.groupby("point"):
        half = stats.t.ppf(0.975, len(rows) - 1) * rows[METRIC].std() / len(rows) ** 0.5
        assert half <= 0.0701 * rows[METRIC].mean()
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
    fly_with(monkeypatch, WORKERS)
    sweep("short.yaml", "two", workers=2, **ASKED)
    pd.testing.assert_frame_equal(table("two"), table("whole"))


def test_a_campaign_that_lost_rows_runs_them_again() -> None:
    """What is wanted follows from the rows that are there."""
    sweep("short.yaml", "lost", **ASKED)
    whole = table("lost")
    Path("lost/missions/part-all-0001.parquet").unlink()
    assert "lost the rows of 16 of 16 missions" in call("status", "lost").stderr
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
