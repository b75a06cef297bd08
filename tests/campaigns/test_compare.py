"""Comparisons: differences paired by seed, how sure they are, and what is said of them."""

import json
import re
from collections.abc import Callable
from math import nan
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from campaigns_for_tests import auv, fly_with, hand_made
from commands_for_tests import call

from bindusbl_des import compare, load_campaign, sweep

SCENARIO = "name: short\nduration_s: 15\nsurvey: {side_m: 140}\n"
ANGLE = "asvs.formation.angle_deg"


@pytest.fixture(autouse=True)
def _in_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each test runs in a folder with a scenario alone; missions run in this process."""
    monkeypatch.chdir(tmp_path)
    fly_with(monkeypatch)
    Path("short.yaml").write_text(SCENARIO)


@pytest.fixture
def paired(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """Return what compares two campaigns of one AUV, by a metric of theirs: its values at the
    seeds 0, 1, ... of one, and 1, 2, ... of the other; -1 stands for a failed mission.
    """

    def compared(metric: str, one: list[float], other: list[float]) -> Any:
        for first, name, values in ((0, "A", one), (1, "B", other)):

            def fleet(_: object, seed: int, values: Any = values, first: int = first) -> Any:
                if (value := values[seed - first]) == -1:
                    raise RuntimeError("no water")
                return [auv(1.0) | {metric.removeprefix("worst_"): value}]

            hand_made(monkeypatch, fleet)
            sweep("short.yaml", name, seeds=range(first, first + len(values)))
        (row,) = compare("A", "B", metrics=[metric]).itertuples()
        return row

    Path("short.yaml").write_text(f"{SCENARIO}auvs: {{count: 1}}\n")
    return compared


def test_differences_are_paired_by_seed(paired: Callable[..., Any]) -> None:
    """Seeds of one point alone, failed missions and missions without a value are left out."""
    found = paired("position_error_m", [9, 1, 2, 3, nan, 5], [2, 4, 6, 1, -1, 7])
    # Pairs: seeds 1, 2, 3 with differences 1, 2, 3; t(2) = 4.303.
    assert found.pairs == 3
    assert (found.baseline_mean, found.other_mean, found.difference) == (2.0, 4.0, 2.0)
    assert (found.missions, found.baseline_whole) == (4, 3)
    assert (found.high - found.low) / 2 == pytest.approx(4.303 / 3**0.5)
    assert found.relative == 1.0
    assert found.verdict == "no difference shown"


def test_intervals_are_those_of_scipy(paired: Callable[..., Any]) -> None:
    """Student's t of the paired differences, by another hand."""
    stats = pytest.importorskip("scipy.stats")
    draws = 9.0 + np.random.default_rng(1).normal(size=(2, 31))
    found = paired("position_error_m", draws[0].tolist(), draws[1].tolist())
    theirs = stats.ttest_rel(draws[1][:30], draws[0][1:]).confidence_interval(0.95)
    assert (found.low, found.high) == pytest.approx((theirs.low, theirs.high), abs=2e-4)


@pytest.mark.parametrize(
    ("metric", "one", "other", "said"),
    [
        (
            "position_error_m",
            [0, 1.0, 1.2],
            [1.5, 1.71],
            "B is worse than A: position_error_m +0.505 m [+0.441, +0.569] over 2 paired seeds.",
        ),
        (
            "fix_rate_hz",
            [0, 1.0, 1.0],
            [1.5, 1.5],
            "B is better than A: fix_rate_hz +0.500 Hz [+0.500, +0.500] over 2 paired seeds.",
        ),
        (
            "pings",
            [0, 9, 9],
            [8, 8],
            "B has lower pings than A: -1.00 [-1.00, -1.00] over 2 paired seeds.",
        ),
        (
            "latency_mean_s",
            [0, 1, 1],
            [0, 2.5],
            "No difference shown between B and A: latency_mean_s +0 s [-16, +16] over 2 paired "
            "seeds.",
        ),
        (
            "worst_fix_age_p95_s",
            [0, 9.0, 9.2],
            [7.0, 7.2],
            "B is better than A: the worst AUV's fix_age_p95_s -2.00 s [-2.00, -2.00] over 2 "
            "paired seeds.",
        ),
        ("pings", [0, 9, 7], [9, 7], "B and A are equal in pings, in all 2 paired seeds."),
        (
            "pings",
            [0, 9],
            [8],
            "pings: -1.00 in one paired seed, which shows nothing; run more seeds.",
        ),
        ("nis", [9, nan], [8], "No value of nis in any of 1 seed that both have."),
    ],
)
def test_findings_are_said_in_words(
    metric: str, one: list[float], other: list[float], said: str, paired: Callable[..., Any]
) -> None:
    """Better or worse where one knows; never more sure than the interval is."""
    assert paired(metric, one, other).said == said
    assert said in " ".join(call("compare", "A", "B", "--metric", metric).stdout.split())


def test_two_commands_answer_a_question() -> None:
    """From a scenario alone: sweep an angle, compare; the numbers are those of the missions."""
    swept = call("sweep", "short.yaml", "--vary", f"{ANGLE}=0,60", "--seeds", 8, "--out", "angle")
    assert swept.exit_code == 0, swept.stderr
    told = call("compare", "angle", "--by", ANGLE)
    assert told.exit_code == 0, told.stderr
    lines = told.stdout.splitlines()
    assert lines[:2] == [f"A: {ANGLE}=0 (baseline)", f"B: {ANGLE}=60"]
    assert lines[3] == "B compared with A; 8 paired seeds"
    assert "B is worse than A: the worst AUV's position_error_m +" in told.stdout
    assert max(map(len, told.stdout.splitlines())) <= 80
    data = json.loads(call("compare", "angle", "--json").stdout)
    assert data["labels"] == {"A": f"{ANGLE}=0", "B": f"{ANGLE}=60"}
    rows = data["differences"]
    missions = load_campaign("angle").missions.set_index(["seed", ANGLE])
    missions = missions.worst_position_error_m.unstack()
    gaps = missions[60] - missions[0]
    assert rows[0]["difference"] == pytest.approx(gaps.mean())
    half = 2.365 * gaps.std() / 8**0.5  # t(7)
    assert (rows[0]["low"], rows[0]["high"]) == pytest.approx(
        (gaps.mean() - half, gaps.mean() + half)
    )
    assert rows[0]["pairs"] == 8


def test_points_of_a_grid_are_compared_where_all_else_is_equal() -> None:
    """Each value of the other keys is a pair of its own; the baseline may be chosen."""
    vary = ("--vary", f"{ANGLE}=0,30,60", "--vary", "asvs.count=2,3")
    assert call("sweep", "short.yaml", *vary, "--seeds", 2, "--out", "grid").exit_code == 0
    frame = compare("grid", by="angle_deg", baseline="60", metrics=["rounds"])
    assert list(frame["asvs.count"]) == [2, 2, 3, 3]
    assert list(frame["baseline"]) == ["60"] * 4
    assert list(frame["other"]) == ["0", "30", "0", "30"]
    told = call("compare", "grid")
    assert (told.exit_code, told.stdout) == (2, "")
    assert told.stderr == f"grid: say with --by which key to compare: {ANGLE}, asvs.count\n"
    assert call("compare", "grid", "--by", "count", "--out", "g.csv").exit_code == 0
    table = pd.read_csv("g.csv", dtype={"baseline": str, "other": str})
    assert len(table) == 3 * 5
    assert call("compare", "grid", "--by", "count", "--out", "g.parquet").exit_code == 0
    pd.testing.assert_frame_equal(pd.read_parquet("g.parquet"), table, check_dtype=False)
    Path(".g.csv.tmp").symlink_to("g.parquet")
    assert call("compare", "grid", "--by", "count", "--out", "g.csv", "--force").exit_code == 0
    assert len(pd.read_parquet("g.parquet")) == len(table)
    assert "g.csv: exists" in call("compare", "grid", "--by", "count", "--out", "g.csv").stderr


def test_points_that_have_no_pair_are_told() -> None:
    """Those that differ in another key too, from the baseline or from all, and in campaigns those
    that the other has not; on the terminal, as JSON and in Python.
    """
    reach = "acoustics.hf.range_m"
    points = [(2, 50), (3, 50), (4, 60), (3, 70), (4, 70)]
    listed = "".join(f"  - {{asvs.count: {n}, {reach}: {r}}}\n" for n, r in points)
    Path("e.yaml").write_text(f"scenario: short.yaml\nseeds: 2\npoints:\n{listed}")
    assert call("sweep", "e.yaml", "--out", "some").exit_code == 0
    said = (
        "points 2, 3 and 4 are left out: no other point differs in asvs.count alone, with "
        "asvs.count=2 as the baseline"
    )
    told = call("compare", "some", "--by", "count")
    assert said in " ".join(told.stdout.split())
    assert said in json.loads(call("compare", "some", "--by", "count", "--json").stdout)["notes"]
    assert said in compare("some", by="asvs.count").attrs["notes"]
    other = compare("some", by="count", baseline="3")
    assert (
        "point 2 (asvs.count=4, range_m=60) is left out: no other point differs in asvs.count "
        "alone, with asvs.count=3 as the baseline"
    ) in other.attrs["notes"]
    assert other.missions.unique().tolist() == [2]
    vary = ("--vary", "asvs.count=2,3,4", "--vary", f"{reach}=50,70")
    assert call("sweep", "short.yaml", *vary, "--seeds", 2, "--out", "all").exit_code == 0
    notes = compare("some", "all", metrics=["rounds"]).attrs["notes"]
    assert "some: point 2 (asvs.count=4, range_m=60) is left out: all has no equal point" in notes
    assert "all: points 1 and 4 are left out: some has no equal point" in notes
    assert not [note for note in compare("all", by="count").attrs["notes"] if "left out" in note]


def test_campaigns_are_compared_point_by_point(monkeypatch: pytest.MonkeyPatch) -> None:
    """Equal points pair; failures and seeds of one campaign alone are left out, and told."""
    Path("mishaps.py").write_text(
        "def raising(view):\n"
        "    if view.random.bit_generator.seed_seq.entropy == 1:\n"
        "        raise RuntimeError\n"
        "    return [[auv] for auv in range(len(view.auvs))]\n"
    )
    monkeypatch.syspath_prepend(".")
    vary = ("--vary", "asvs.count=2,3")
    assert call("sweep", "short.yaml", *vary, "--seeds", 3, "--out", "one").exit_code == 0
    Path("other.yaml").write_text(f"{SCENARIO}protocol: {{schedule: 'mishaps:raising'}}\n")
    assert (
        call(
            "sweep", "other.yaml", *vary, "--seeds", 4, "--out", "other", "--allow-plugins"
        ).exit_code
        == 3
    )
    told = call("compare", "one", "other", "--metric", "rounds")
    assert told.exit_code == 0, told.stderr
    assert "B compared with A: rounds; 2 paired seeds" in told.stdout
    lines = told.stdout.splitlines()
    notes = " ".join(lines)
    assert (
        "2 failed missions and those they would be paired with are left out: PluginError: "
        "protocol.schedule: 'mishaps:raising' raised RuntimeError in round 0, at mishaps.py:3 "
        "the points of 2 of 2 pairs have different seeds; those that both have count"
    ) in notes
    assert " ".join(lines[:3]) == (
        "A: one (baseline) B: other, protocol.schedule=mishaps:raising instead of spatial_reuse "
    )
    rows = compare("one", "other", metrics=["rounds"])
    assert list(rows["pairs"]) == [2, 2]
    assert call("sweep", "short.yaml", "--seeds", 2, "--out", "alone").exit_code == 0
    assert len(compare("alone", "one", "other", metrics=["rounds"])) == 4


def test_who_is_worst_counts_in_paired_seeds_alone() -> None:
    """Equal missions, two seeds of them in one campaign and six in the other: the same AUVs."""
    for seeds in (2, 6):
        assert call("sweep", "short.yaml", "--seeds", seeds, "--out", f"c{seeds}").exit_code == 0
    rows = compare("c2", "c6", metrics=["worst_position_error_m"])
    assert rows["verdict"].tolist() == ["equal"]
    assert rows["other_worst_auv"].tolist() == rows["baseline_worst_auv"].tolist()
    found = " ".join(call("compare", "c2", "c6").stdout.split())
    assert re.search(r"is the worst at both|At A (.+ of 2 seeds.*); at B \1\.", found)


def test_many_points_make_one_table() -> None:
    """Of a grid a row a point for the first metric, and how often each metric differs: what a
    table for each of 40 points hides.
    """
    vary = ("--vary", f"{ANGLE}=0,10,20,30,40", "--vary", "asvs.count=1,2")
    for name, reach in (("near", 50), ("far", 60)):
        words = ("sweep", "short.yaml", "--set", f"acoustics.hf.range_m={reach}", *vary)
        assert call(*words, "--seeds", 2, "--out", name).exit_code == 0
    told = call("compare", "near", "far").stdout
    lines = told.splitlines()
    assert lines[:4] == [
        "A: near (baseline)",
        "B: far, acoustics.hf.range_m=60 instead of 50",
        "",
        "B compared with A: the worst AUV's position_error_m (m); 2 paired seeds",
    ]
    assert lines[4].split()[:4] == ["angle_deg,", "count", "A", "B"]
    rows = lines[6:16]
    assert [row[:6].strip() for row in rows] == [
        f"{a}, {n}" for a in range(0, 50, 10) for n in (1, 2)
    ]
    assert told.count("difference [95 % CI]") == 1
    frame = compare("near", "far")
    verdicts = frame.groupby("metric").verdict.value_counts()
    assert set(frame.verdict) <= {
        "better", "worse", "equal", "no difference shown", "not comparable"
    }  # fmt: skip
    heading = lines.index("B compared with A, at how many of 10 points:") + 1
    columns = [it for it in lines[heading].split("  ") if it][1:]
    counted = {row.split()[0]: row.split()[1:] for row in lines[heading + 1 : heading + 6]}
    for metric, counts in counted.items():
        own = verdicts[f"worst_{metric}"].to_dict()
        shown = {
            column.strip(): int(it) for column, it in zip(columns, counts, strict=True) if it != "-"
        }
        assert shown == own
    assert max(map(len, lines)) <= 80
    by_count = call("compare", "near", "--by", "count").stdout
    assert by_count.count("difference [95 % CI]") == 1
    assert by_count.startswith("A: asvs.count=1 (baseline)\nB: asvs.count=2\n\n")


def test_what_cannot_be_compared_is_refused() -> None:
    """One line says why and what to do; the exit code is 2."""
    assert call("run", "short.yaml", "--out", "run", "--no-advice").exit_code == 0
    for name, key in (("one", "asvs.count=2,3"), ("other", "auvs.count=1,2")):
        assert call("sweep", "short.yaml", "--vary", key, "--out", name).exit_code == 0
    assert call("sweep", "short.yaml", "--seeds", 2, "--out", "alone").exit_code == 0
    for words, message in {
        ("run", "run"): "run: the same campaign is named twice",
        ("run", "one"): "run: is one mission, and chance alone makes two missions differ; sweep",
        ("none", "one"): "none is no campaign folder (it has no campaign.json)",
        ("alone",): "alone: varies nothing, so there is nothing to compare in it; name a second",
        ("one", "other"): "one varies asvs.count and other auvs.count; campaigns are compared",
        ("one", "alone", "--by", "asvs.count"): "--by and --baseline compare points within one",
        (
            "one",
            "--by",
            "asvs.cuont",
        ): "one: --by asvs.cuont: not a varied key; did you mean 'asvs.",
        ("one", "--baseline", "4"): "one: --baseline 4: not a value of asvs.count; it has 2, 3",
        ("one", "--metric", "positon_error_m"): "no metric 'positon_error_m'; did you mean 'positi",
        ("one", "--metric", "rounds", "--mean"): "--metric says what to compare; leave out --mean",
        ("one", "--out", "x.txt"): "x.txt: a table's name ends in one of .csv, .parquet",
        ("one", "--out", "no/x.csv"): "no/x.csv: the folder no does not exist",
    }.items():
        told = call("compare", *words)
        assert (told.exit_code, told.stdout) == (2, ""), words
        assert told.stderr.startswith(message)
        assert told.stderr.count("\n") == 1


FORM = "needs the form dotted.key=value,value,..., such as asvs.count=2,3"

WRONG_OPTIONS = {
    ("asvs.count",): [f"--vary asvs.count: {FORM}"],
    ("=2",): [f"--vary =2: {FORM}"],
    ("asvs.count=",): [
        "--vary asvs.count=: vary.asvs.count: is an empty list; give at least one value"
    ],
    ("asvs.count=2", "asvs.count=3"): [
        "--vary asvs.count=3: vary.asvs.count: given twice; keep one option with all of it"
    ],
    ("asvs.cuont=2", "asvs.count=x"): [
        "--vary asvs.cuont=2: asvs.cuont: unknown key; did you mean 'count'?",
        "--vary asvs.count=x: asvs.count: needs a whole number (>= 0 and <= 10000); got the "
        "text 'x'",
    ],
    ("asvs.count=[2",): [
        "--vary asvs.count=[2: vary.asvs.count: YAML syntax: [ or { is not closed, or a comma is "
        "missing"
    ],
    ("record.detail=full",): [
        "--vary record.detail=full: record.detail: belongs to the experiment: write `detail: full` "
        "at the top level"
    ],
}


@pytest.mark.parametrize("options", WRONG_OPTIONS)
def test_wrong_values_to_vary_get_their_messages(options: tuple[str, ...]) -> None:
    """What is wrong on the command line is told as in a file, and nothing is left."""
    words = [word for option in options for word in ("--vary", option)]
    told = call("sweep", "short.yaml", *words)
    assert told.stderr.splitlines() == WRONG_OPTIONS[options]
    assert told.exit_code == 2
    assert sorted(path.name for path in Path().iterdir()) == ["short.yaml"]


def test_options_are_laid_over_an_experiment() -> None:
    """A further key to vary makes a grid with the file's; seeds replace the file's."""
    Path("e.yaml").write_text("scenario: short.yaml\nvary: {asvs.count: [2, 3]}\nseeds: 9\n")
    words = ("--vary", "auvs.count=1,2", "--seeds", 2, "--detail", "full", "--out", "over")
    assert call("sweep", "e.yaml", *words).exit_code == 0
    missions = load_campaign("over").missions
    assert list(missions["asvs.count"]) == [2] * 4 + [3] * 4
    assert list(missions["auvs.count"]) == [1, 1, 2, 2] * 2
    assert list(missions["seed"]) == [0, 1] * 4
    assert Path("over/pings").is_dir()
    python = sweep("e.yaml", "python", vary={"auvs.count": [1, 2]}, seeds=2)
    told = compare(python, by="asvs.count")  # as object or by its folder
    assert told.equals(compare("python", by="asvs.count"))
    assert python.plan.experiment.points == load_campaign("over").plan.experiment.points
    Path("p.yaml").write_text("scenario: short.yaml\npoints: [{asvs.count: 2}]\n")
    told = call("sweep", "p.yaml", "--vary", "auvs.count=1")
    assert told.stderr == "p.yaml:2:1: points: cannot be combined with vary; keep one of them\n"
