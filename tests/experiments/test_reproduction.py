"""The paper's numbers, each with a verdict that a rule gives, and the page that shows them."""

import json
import re
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import yaml
from campaigns_for_tests import fly_with, read_record, write_record
from commands_for_tests import call
from paper_for_tests import Measured, Prediction, Published, Reason, campaigns, published

from bindusbl_des import Setup, load_scenario
from bindusbl_des.experiments.reproduction import measuring, sentences
from bindusbl_des.experiments.reproduction.numbers import Limit, Other, predicted, verdict

REPRODUCED, DIFFERS, CANNOT_BE = "reproduced", "differs", "cannot be"
ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "reproduction.md"
EXPERIMENTS = sorted((ROOT / "experiments").glob("*.yaml"))


def number(text: str, quantity: str = "fixes") -> Published:
    return Published("tab:case_study", "140", "3", "1", "0", "AUV0", quantity, text, "1")


# Rules


def test_a_number_within_the_interval_of_further_runs_is_reproduced() -> None:
    """Runs of 90, 92 and 94 fixes foretell 92 +- 4.303 x 2 x sqrt(4/3) = 92 +- 9.94 of the next."""
    found = predicted([90.0, 92.0, 94.0], further_runs=1)
    assert (found.low, found.high) == pytest.approx((82.06, 101.94), abs=0.01)
    assert verdict(number("102"), found) == REPRODUCED  # 101.5 rounds to 102
    assert verdict(number("103"), found) == DIFFERS
    assert verdict(number("82"), found) == REPRODUCED
    assert verdict(number("81"), found) == DIFFERS


def test_a_mean_of_many_runs_is_held_to_a_narrower_interval() -> None:
    """The mean of 20 further runs spreads less than one run: 92 +- 5.33."""
    found = predicted([90.0, 92.0, 94.0], further_runs=20)
    assert found.high - found.mean == pytest.approx(4.303 * 2 * (1 / 3 + 1 / 20) ** 0.5)


def test_rounding_is_allowed_for_and_nothing_more() -> None:
    """What never varies must agree to the printed digits: 0.70 stands for 0.695 to 0.705."""
    for measured, expected in ((0.6951, REPRODUCED), (0.7049, REPRODUCED), (0.6949, DIFFERS)):
        exact = Prediction(measured, measured, measured, 24)
        assert verdict(number("0.70", "coverage"), exact) == expected
    assert verdict(number("0"), Prediction(0.0, 0.0, 0.0, 24)) == REPRODUCED


def test_bounds_are_held_by_the_mean() -> None:
    """Below 0.8 m is borne out by 0.4 m, not by 0.9 m whose interval reaches down to 0.7 m."""
    bound = number("0.8", "cte_max")
    assert verdict(bound, Prediction(0.4, 0.3, 0.5, 20), "at most") == REPRODUCED
    assert verdict(bound, Prediction(0.9, 0.7, 1.1, 20), "at most") == DIFFERS
    assert verdict(bound, Prediction(0.9, 0.7, 1.1, 20), "at least") == REPRODUCED
    assert verdict(bound, Prediction(0.4, 0.3, 0.9, 20), "at least") == DIFFERS


def test_what_contradicts_the_paper_itself_cannot_be() -> None:
    """A number beyond a limit cannot be, whatever was measured; one at the limit's edge may."""
    limit = Limit(0.0, 9.5, "the drift is no more")
    agreeing = Prediction(10.0, 9.0, 11.0, 24)
    assert verdict(number("10.02", "cte"), agreeing, limit=limit) == CANNOT_BE
    assert verdict(number("9.50", "cte"), agreeing, limit=limit) == REPRODUCED
    airtime = Limit(0.576, 99.0, "airtime")
    assert verdict(number("0.57"), agreeing, limit=airtime) == CANNOT_BE
    assert verdict(number("0.6"), agreeing, limit=airtime) == DIFFERS  # 0.64 rounds to 0.6


def test_one_run_judges_nothing() -> None:
    """A single run has no interval."""
    with pytest.raises(ValueError, match="at least 2 runs; met 1"):
        predicted([1.0], further_runs=1)


def test_what_differs_says_why_and_which_reading_agrees() -> None:
    """A verdict of differs comes with its reason, and names the readings that agree."""
    row = number("19")
    it = Measured(
        row,
        "mean of runs",
        Prediction(9.0, 8.0, 10.0, 24),
        Reason("E28", "the start is not stated"),
        (Other("start abeam", Prediction(19.2, 18.0, 20.4, 12)), Other("corner", row_of(0.0))),
    )
    assert it.verdict == DIFFERS
    assert it.why() == "the start is not stated (E28)"
    assert it.agreeing == ["start abeam"]
    assert it.deviation() == pytest.approx(9 / 19 - 1)
    assert replace(it, prediction=row_of(19.0)).why() == ""


def row_of(value: float) -> Prediction:
    return Prediction(value, value, value, 12)


def test_the_limit_of_the_cross_track_error_is_that_of_the_errata() -> None:
    """0.06 m/s over 300 s is 9 m on average; two sigma of the walk add 0.54 m."""
    assert measuring.across_track_limit().highest == pytest.approx(9.0 + 2 * 0.27)


def test_downlinks_in_closed_form() -> None:
    """Three AUVs at L = 60 m: 24 ticks a round, 15 when pipelined; the airtime alone 0.448 s."""
    three = ["survey.side_m=60", "auvs.count=3"]
    slots = Setup(load_scenario("baseline_60m_tdma", overrides=three)).slots
    assert sentences.rate(slots, "sequential", 3) == pytest.approx(30 / 24)
    assert sentences.rate(slots, "pipelined_round", 3) == pytest.approx(30 / 15)
    assert sentences.rate(slots, "pipelined_group", 3) == pytest.approx(30 / (3 * 12))
    assert sentences.fastest(slots, 3) == pytest.approx(1 / 0.448)
    assert sentences.shortest_latency(slots, "sequential", 4) == pytest.approx(0.1 + 0.576)


# Experiments


@pytest.mark.parametrize("path", EXPERIMENTS, ids=lambda path: path.stem)
def test_experiment_files_say_what_they_make(path: Path) -> None:
    """Each file opens with a comment that says how to look at it."""
    text = path.read_text()
    assert text.startswith("# ")
    assert "# Look at: " in text


def test_every_experiment_file_is_run() -> None:
    """The catalogue and the folder hold the same experiments, but for what is not the paper's."""
    ours = {
        "navigators",
        "moving_anchors",
        "placements",
        "knowledge",
        "peers",
        "protocols",
        "protocols_large",
        "wind",
    }
    assert {entry.name for entry in campaigns.CATALOGUE} | ours == {it.stem for it in EXPERIMENTS}


def test_the_sweep_has_5760_missions() -> None:
    """3 sides x 3 ASV counts x 4 angles x 8 team sizes x 20 seeds, both ways of stopping."""
    for name in ("sweep", "sweep_distance"):
        told = call("sweep", ROOT / "experiments" / f"{name}.yaml", "--dry-run", "--json")
        plan = json.loads(told.stdout)
        assert plan["missions"] == 3 * 3 * 4 * 8 * 20 == 5760
        assert (plan["points"], plan["seeds"]) == (288, 20)


def test_equal_distance_means_equal_distance() -> None:
    """Every team of the distance-normalised sweep flies what three AUVs fly in 300 s."""
    experiment = yaml.safe_load((ROOT / "experiments" / "sweep_distance.yaml").read_text())
    for point in experiment["points"]:
        assert point["auvs.count"] * point["duration_s"] == pytest.approx(900, rel=1e-5)


def test_the_wheel_holds_what_commands_run() -> None:
    """Installed without the repository, `reproduce` and `bench` find what they run."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())
    included = settings["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"]
    assert included == {it: f"bindusbl_des/{it}" for it in included}
    modules = {f"benchmarks/{it}.py" for it in ("bench", "command_lines", "missions", "timing")}
    assert set(included) == {"experiments", "scenarios"} | modules


# The whole


def auvs_of(point: Any) -> int:
    """Return how many AUVs a point has; three where it does not say."""
    return int(point["auvs"]["count"] if "auvs" in point else point.get("auvs.count", 3))


@cache
def tiny(*, quick: bool) -> list[Any]:
    """Return the quick experiments with two seeds, 15 s long, with the smallest teams only."""
    return [
        replace(
            experiment,
            points=tuple(
                {**point, "duration_s": 15.0} for point in experiment.points if auvs_of(point) <= 3
            ),
            seeds=(0, 1),
        )
        for experiment in campaigns.experiments(quick=quick)
    ]


@pytest.fixture(scope="module", autouse=True)
def tiny_plans() -> Iterator[None]:
    """Let `reproduce` run tiny experiments in this process, and draw with few dots."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("bindusbl_des.experiments.reproduction.drawings.DOTS_PER_INCH", 60)
        patch.setattr("bindusbl_des.experiments.reproduction.reproduce.experiments", tiny)
        fly_with(patch)
        yield


@pytest.fixture(scope="module")
def small(tiny_plans: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A whole, tiny reproduction made by the command; its answer is in answer.json."""
    folder = tmp_path_factory.mktemp("reproduction") / "out"
    result = call("-q", "reproduce", "--quick", "--json", "--out", folder)
    assert result.exit_code == 0, result.output
    (folder / "answer.json").write_text(result.stdout)
    return folder


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave the figures as they are."""
    monkeypatch.setattr("bindusbl_des.experiments.reproduction.reproduce.draw", lambda *_: None)


def test_every_published_number_has_one_verdict(small: Path) -> None:
    """The answer has a line for each of the paper's 49 numbers, with a verdict and, if not
    reproduced, why."""
    answer = json.loads((small / "answer.json").read_text())
    rows = answer["numbers"]
    assert [(row["source"], row["auv"], row["quantity"], row["paper"]) for row in rows] == [
        (row.source, row.auv, row.quantity, row.value) for row in published()
    ]
    for row in rows:
        assert row["verdict"] in (REPRODUCED, DIFFERS, CANNOT_BE)
        assert bool(row["why"]) == (row["verdict"] != REPRODUCED)
        assert row["low"] <= row["measured"] <= row["high"]
    counts = answer["counts"]
    assert counts["reproduced"] + counts["differs"] + counts["cannot be"] == len(rows) == 49


def test_the_folder_holds_page_tables_and_figures(small: Path) -> None:
    """The page shows every figure, and the tables hold every number."""
    import pandas as pd

    page = (small / "reproduction.md").read_text()
    shown = re.findall(r"\]\(figures/reproduction/(\w+)\.png\)\n\n\*[^*]{30,}\*\n", page)
    assert len(shown) > 8
    drawn = {it.stem: it for it in (small / "figures" / "reproduction").iterdir()}
    assert set(shown) == set(drawn)  # each is explained, and none is missing
    assert min(it.stat().st_size for it in drawn.values()) > 5000
    csv = pd.read_csv(small / "paper_vs_measured.csv")
    parquet = pd.read_parquet(small / "paper_vs_measured.parquet")
    assert len(csv) == len(parquet) == 49
    assert (csv.verdict == parquet.verdict).all()
    for rows, begun in ((csv, "Furthest off: "), (csv[csv.quantity.str[:3] == "cte"], "errors ")):
        worst = rows.loc[(rows.measured / rows.paper - 1).abs().idxmax()]
        assert f"{begun}{worst.auv} {worst.quantity} ({worst.case})" in page


@pytest.mark.usefixtures("undrawn")
def test_a_second_call_runs_nothing_again(small: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Campaigns that are complete are read, not run; each published number has its line on the
    terminal, and no line is wider than that.
    """
    monkeypatch.setattr(campaigns, "sweep", None)
    monkeypatch.setattr(campaigns, "resume", None)
    result = call("-q", "reproduce", "--quick", "--out", small)
    assert result.exit_code == 0, result.output
    lines = result.stdout.splitlines()
    assert max(map(len, lines[:-1])) <= 80
    for row in published():
        assert any(f"{row.auv} {row.quantity}" in line and row.text in line for line in lines)


@pytest.mark.usefixtures("undrawn")
def test_a_killed_reproduction_continues(small: Path) -> None:
    """A campaign that lost its rows is run to the end; the others are left alone."""
    before = {path: path.stat().st_mtime_ns for path in small.glob("*/missions/*.parquet")}
    for lost in (small / "trajectories" / "missions").glob("*.parquet"):
        lost.unlink()
    assert call("-q", "reproduce", "--quick", "--out", small).exit_code == 0
    after = {path: path.stat().st_mtime_ns for path in small.glob("*/missions/*.parquet")}
    changed = {
        path.parts[-3] for path in set(before.items()) ^ set(after.items()) for path in path[:1]
    }
    assert changed == {"trajectories"}


def test_a_folder_of_other_missions_is_refused(small: Path) -> None:
    """With and without --quick other missions are planned; neither may continue the other."""
    text = (small / "sweep" / "campaign.json").read_text()
    write_record(small / "sweep", {**read_record(small / "sweep"), "plan_sha256": "0" * 64})
    result = call("reproduce", "--quick", "--out", small)
    (small / "sweep" / "campaign.json").write_text(text)
    assert result.exit_code == 2
    assert "holds other missions" in result.output
    assert "name another folder" in result.output


@pytest.mark.parametrize("words", [(), ("--quick", "--readings"), ("--reading", "default")])
def test_a_folder_of_other_things_is_left_alone(words: tuple[str, ...], tmp_path: Path) -> None:
    """Nothing is added to what is no reproduction."""
    (tmp_path / "notes.txt").write_text("mine")
    result = call("reproduce", *words, "--out", tmp_path)
    assert result.exit_code == 2
    assert "is not empty and no reproduction; name another folder" in result.stderr
    assert [it.name for it in tmp_path.iterdir()] == ["notes.txt"]


def test_a_failed_mission_ends_with_3(small: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A mission that failed has no number to compare; the folder with its reason is named."""

    def failed(*_: object, **__: object) -> None:
        raise campaigns.SomeFailed("sweep: 1 missions failed; see sweep/failures")

    monkeypatch.setattr("bindusbl_des.experiments.reproduction.reproduce.run_all", failed)
    result = call("reproduce", "--quick", "--out", small)
    assert result.exit_code == 3
    assert "see sweep/failures" in result.output


def test_an_interrupted_reproduction_ends_with_130(
    small: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ctrl-C ends it as it ends every command."""

    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("bindusbl_des.experiments.reproduction.reproduce.run_all", interrupted)
    assert call("reproduce", "--quick", "--out", small).exit_code == 130


def test_the_page_in_the_manual_lists_every_number() -> None:
    """docs/reproduction.md is of a full run: every number, every figure, 5,760 missions a sweep."""
    page = PAGE.read_text()
    for row in published():
        assert any(
            row.case in line and f"{row.auv} {row.quantity}" in line and row.text in line
            for line in page.splitlines()
        ), row
    shown = re.findall(r"\]\(figures/reproduction/(\w+)\.png\)", page)
    assert len(shown) > 8
    assert all((PAGE.parent / "figures/reproduction" / f"{it}.png").is_file() for it in shown)
    assert "| `sweep` | 288 | 20 | 5760 |" in page
    assert "quick look" not in page
