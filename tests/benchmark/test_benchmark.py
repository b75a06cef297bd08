"""The benchmark: what its tasks are, how methods score, and how others enter."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from commands_for_tests import call

from bindusbl_des import load_scenario, simulate

ROOT = Path(__file__).parents[2]
SHIPPED = ROOT / "experiments" / "benchmark" / "scores.csv"
TASKS = sorted(path.stem for path in (ROOT / "scenarios" / "benchmark").glob("*.yaml"))


def scored(folder: Path, *words: object) -> pd.DataFrame:
    """Return what a command has written to a folder."""
    ended = call("benchmark", *words, "--out", folder, "--force")
    assert ended.exit_code == 0, ended.output
    return pd.read_csv(folder / "scores.csv")


def value(table: pd.DataFrame, task: str, method: str, metric: str) -> pd.Series:
    [row] = table[
        (table.task == task) & (table.method == method) & (table.metric == metric)
    ].itertuples()
    return row


def test_every_task_is_a_scenario_that_the_manual_names() -> None:
    page = (ROOT / "docs" / "benchmark.md").read_text()
    assert len(TASKS) == 13
    for task in TASKS:
        assert load_scenario(ROOT / "scenarios" / "benchmark" / f"{task}.yaml").name == task
        assert f"| `{task}` |" in page


def test_a_score_is_what_the_missions_had(tmp_path: Path) -> None:
    """The worst AUV's mean error over seeds 1 and 2, and its difference on the same seeds."""
    table = scored(tmp_path, "smoother", "kalman", "--task", "near", "--seeds", 2)
    path = ROOT / "scenarios" / "benchmark" / "near.yaml"
    means = {
        name: [
            simulate(
                load_scenario(path, overrides=[f"navigation.filter={name}"]), seed
            ).mission.worst_position_error_m.item()
            for seed in (1, 2)
        ]
        for name in ("smoother", "kalman")
    }
    smoother = value(table, "near", "smoother", "worst_error_m")
    assert smoother.mean == pytest.approx(np.mean(means["smoother"]), rel=1e-5)
    more = np.subtract(means["smoother"], means["kalman"])
    assert smoother.difference == pytest.approx(more.mean(), rel=1e-4)
    half = 12.706 * more.std(ddof=1) / np.sqrt(2)
    assert smoother.difference_high == pytest.approx(more.mean() + half, rel=1e-4)
    assert value(table, "near", "kalman", "worst_error_m").difference == 0.0
    assert (tmp_path / "index.html").read_text().count("<h2>") == 1


def test_buffering_late_fixes_is_worth_what_kalman_makes_of_it(tmp_path: Path) -> None:
    """A filter written on its own agrees; one that drops what is late has next to nothing there."""
    table = scored(
        tmp_path, "replay_late", "drop_late", "dead_reckoning", "--task", "clock", "--seeds", 3
    )
    error = {
        method: value(table, "clock", method, "worst_error_m")
        for method in ("replay_late", "drop_late", "dead_reckoning")
    }
    assert abs(error["replay_late"].difference) < 0.1
    assert error["drop_late"].mean > 5 * error["replay_late"].mean
    assert error["dead_reckoning"].mean > error["drop_late"].mean


def test_estimates_of_another_program_score_as_the_method_that_made_them(tmp_path: Path) -> None:
    """Dead reckoning taken from the inputs, which hold no truth, given back as a file."""
    asked = ("--task", "one_anchor", "--seeds", 2)
    assert call("benchmark", *asked, "--inputs", tmp_path / "in").exit_code == 0
    parts = []
    for seed in (1, 2):
        place = tmp_path / "in" / "one_anchor" / str(seed)
        odometry = pd.read_parquet(place / "odometry.parquet")
        fixes = pd.read_parquet(place / "fixes.parquet")
        assert not [name for name in (*odometry, *fixes) if "error" in name or "estimate" in name]
        assert (fixes.delivered_at_s > fixes.valid_at_s).all()
        own = odometry[["auv", "time_s", "x_m", "y_m"]]
        parts.append(own.assign(task="one_anchor", seed=seed, xx_m2=1.0, yy_m2=1.0, xy_m2=0.0))
    pd.concat(parts).to_parquet(tmp_path / "mine.parquet")
    table = scored(tmp_path / "out", tmp_path / "mine.parquet", *asked)
    path = ROOT / "scenarios" / "benchmark" / "one_anchor.yaml"
    worst = [simulate(load_scenario(path), seed).auvs.imu_error_m.max() for seed in (1, 2)]
    method = str(tmp_path / "mine.parquet")
    found = value(table, "one_anchor", method, "worst_error_m")
    assert found.mean == pytest.approx(np.mean(worst), rel=0.01)
    assert value(table, "one_anchor", method, "nees").mean > 10  # it was not as sure as it said
    parts[1].iloc[:-1].to_parquet(tmp_path / "short.parquet")
    ended = call("benchmark", tmp_path / "short.parquet", *asked)
    assert ended.exit_code == 2
    assert "seed 1: AUV0 has 0 estimates" in ended.output


@pytest.mark.parametrize("name", ["pings", "chosen"])
def test_a_program_of_access_of_ones_own_enters(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """A copy of what `aloha` is scores as that does: a generator function, or one that returns a
    generator for each vehicle.
    """
    (tmp_path / "copied_aloha.py").write_text(
        "def pings(node):\n"
        "    for packet in node.packets if not node.is_asv else ():\n"
        "        if packet >= node.clock:\n"
        "            yield node.until(packet)\n"
        "            yield node.send('ping')\n\n\n"
        "def chosen(node):\n"
        "    return nothing() if node.is_asv else pings(node)\n\n\n"
        "def nothing():\n"
        "    yield from ()\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    own, words = f"copied_aloha:{name}", ("--task", "sparse", "--seeds", 2, "--allow-plugins")
    table = scored(tmp_path / "out", own, "aloha", *words)
    error, theirs = (value(table, "sparse", one, "worst_error_m") for one in (own, "aloha"))
    assert (error.mean, error.difference) == (theirs.mean, theirs.difference)
    assert error.difference != 0.0


def test_the_table_in_the_repository_is_what_comes_out(tmp_path: Path) -> None:
    """Some rows are flown again: all but processor time."""
    kept = pd.read_csv(SHIPPED)
    assert set(kept.task) == set(TASKS)
    table = scored(tmp_path, "ring", "zigzag", "--task", "placement")
    both = table.merge(kept, on=["version", "task", "method", "metric"], suffixes=("", "_kept"))
    both = both[both.metric != "cpu_s"]
    assert len(both) == 14
    for column in ("mean", "low", "high", "difference", "difference_low", "difference_high"):
        assert np.allclose(both[column], both[f"{column}_kept"], rtol=1e-4, equal_nan=True)


ENTRIES = sorted(set((ROOT / "experiments" / "benchmark").glob("*.csv")) - {SHIPPED})


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda path: path.stem)
def test_an_entry_is_what_its_file_reaches(
    entry: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its first task is flown again, by the file beside it: in the form of the table."""
    kept = pd.read_csv(entry)
    assert list(kept) == list(pd.read_csv(SHIPPED))
    assert set(kept.task) <= set(TASKS)
    [method], first = kept.method.unique(), kept[kept.task == kept.task[0]]
    monkeypatch.syspath_prepend(entry.parent)
    words = (method, "--task", kept.task[0], "--seeds", first.seeds[0], "--allow-plugins")
    found = scored(tmp_path, *words).query("metric != 'cpu_s' and method == @method")
    own = first[first.metric != "cpu_s"]
    assert list(found.metric) == list(own.metric)
    numbers = ["version", "seeds", "mean", "low", "high", *found.filter(like="difference")]
    assert np.allclose(found[numbers], own[numbers], rtol=1e-4, equal_nan=True)


@pytest.mark.slow
def test_two_disjoint_sets_of_seeds_rank_alike(tmp_path: Path) -> None:
    """Kendall's tau of the methods' errors, the mean over tasks, is 0.9 or more."""
    both = []
    for name in ("1-6", "7-12"):
        table = scored(tmp_path / name, "--seeds", name)
        both.append(table[table.metric == "worst_error_m"].set_index(["task", "method"])["mean"])
    taus = []
    for task in TASKS:
        one, other = (means[task] for means in both)
        order = np.array([np.sign(one[a] - one[b]) for a in one.index for b in one.index if a < b])
        again = [np.sign(other[a] - other[b]) for a in one.index for b in one.index if a < b]
        taus.append(float(np.mean(order * again)))
    assert np.mean(taus) >= 0.9, dict(zip(TASKS, taus, strict=True))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["kalmann"], "did you mean 'kalman'"),
        (["--task", "neer"], "did you mean 'near'"),
        (["ring", "--task", "near"], "none of ring enters near"),
        (["mine:own"], "allow-plugins"),
        (["--seeds", "3-3"], "fewer than two seeds"),
        (["--seeds", "some"], "neither a number nor A-B"),
        (["gone.parquet", "--task", "near", "--seeds", "2"], "gone.parquet: cannot be read"),
    ],
)
def test_what_cannot_enter_is_told(words: list[str], said: str) -> None:
    ended = call("benchmark", *words)
    assert ended.exit_code == 2
    assert said in ended.output
    assert "Traceback" not in ended.output
