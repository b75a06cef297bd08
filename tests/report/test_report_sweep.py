"""Reports of campaigns and of several runs: their numbers are those of the tables."""

import json
import math
import re
from pathlib import Path
from typing import Any

import pytest
from campaigns_for_tests import auv, hand_made
from commands_for_tests import call
from pages_for_tests import beside, unpacked
from scipy import stats
from test_report import SCENARIOS, Cells

from bindusbl_des import Campaign, load_scenario, simulate, sweep

pytestmark = pytest.mark.usefixtures("in_this_process")

BASE = "name: tiny\nduration_s: 20\nsurvey: {side_m: 100}\n"
EXPERIMENT = (
    "scenario: base.yaml\n"
    "vary:\n"
    "  asvs.count: [1, 2, 3]\n"
    "  acoustics.hf.range_m: [40.0, 80.0]\n"
    "  protocol.schedule: [spatial_reuse, 'test_report_sweep:raising']\n"
    "seeds: 3\n"
)


def raising(view: object) -> list[list[int]]:
    """A schedule of one's own that fails."""
    raise RuntimeError("no <schedule> today")


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    """Twelve points with three seeds each; half of the points fail."""
    folder = tmp_path_factory.mktemp("sweep")
    (folder / "base.yaml").write_text(BASE)
    (folder / "experiment.yaml").write_text(EXPERIMENT)
    return sweep(folder / "experiment.yaml", folder / "out", workers=1)


def interval(values: Any) -> tuple[float, float]:
    """Return mean and half the width of the 95 % interval of values; NaN where there are none."""
    if not len(values):
        return math.nan, math.nan
    return values.mean(), stats.t.ppf(0.975, len(values) - 1) * values.std() / len(values) ** 0.5


def test_points_have_the_intervals_of_the_missions(campaign: Campaign) -> None:
    """Mean and half width in the page are those of the missions."""
    page = campaign.report()
    data = json.loads(re.findall(r'id="data">(.*?)</script>', page)[0])
    packed = re.findall(r'id="packed">(.*?)</script>', page)[0]
    missions = campaign.missions
    for metric in ("position_error_m", "hf_coverage", "fix_rate_hz", "mf_utilisation"):
        columns = data["statistics"][metric]
        mean, half = (unpacked(columns[name], packed) for name in ("mean", "half"))
        for point in range(12):
            values = missions[(missions.point == point) & (missions.status == "ok")][metric]
            expected, wide = interval(values)
            assert mean[point] == pytest.approx(expected, rel=1e-4, abs=1e-5, nan_ok=True)
            assert half[point] == pytest.approx(wide, rel=1e-3, abs=1e-5, nan_ok=True)
    assert [key["key"] for key in data["keys"]] == list(campaign.plan.columns)
    for key, column in zip(data["keys"], data["points"], strict=True):
        numbers = unpacked(column, packed).astype(int)
        for point, number in zip(campaign.plan.points, numbers, strict=True):
            value = point.varied[key["key"]]
            assert key["labels"][number] == (f"{value:g}" if key["values"] else value)


def test_the_table_of_points_needs_no_script(campaign: Campaign) -> None:
    """It has each point's mean of the missions that went well, and how many of them did."""
    cells = Cells()
    cells.feed(campaign.report())
    rows = [row for row in cells.rows if len(row) == 11 and row[0].isdigit()]
    missions = campaign.missions
    assert len(rows) == 12
    for row in rows:
        went = missions[(missions.point == int(row[0])) & (missions.status == "ok")]
        if went.empty:
            assert (row[4], row[5], row[10]) == ("0 of 3", "-", "-")
            continue
        assert row[4] == "3"
        mean, half = map(float, row[10].split(" ± "))
        expected, wide = interval(went.position_error_m)
        assert mean == pytest.approx(expected, abs=0.01)
        assert half == pytest.approx(wide, rel=0.1, abs=0.005)


def test_the_fewest_asvs_are_there_without_scripts(campaign: Campaign) -> None:
    """They are the smallest number whose interval ends below a metre, for each of the other keys,
    by any kind of error; only where none does more than the largest number is named.
    """
    page, points = campaign.report(), campaign.plan.points
    missions = campaign.missions[campaign.missions.status == "ok"]
    answers = set()
    metrics = re.findall('<div id="lookup-(\\w+)"', page)
    assert {"position_error_m", "worst_position_error_m"} <= set(metrics)
    for metric in metrics:
        cells = Cells()
        cells.feed(page.partition(f'<div id="lookup-{metric}"')[2].partition("</table>")[0])
        rows = {row[0]: row[1:] for row in cells.rows[1:]}
        expected: dict[str, list[str]] = {}
        for number, point in enumerate(points):
            varied = point.varied
            key = f"{varied['acoustics.hf.range_m']:g}, {varied['protocol.schedule']}"
            mean, half = interval(missions[missions.point == number][metric])
            count = varied["asvs.count"]
            expected.setdefault(key, []).extend([str(count)] * int(mean + half < 1.0))
            assert rows[key][count - 1].startswith("-" if math.isnan(mean) else f"{mean:.2f}"[:3])
        for key, counts in expected.items():
            assert rows[key][-1] == (min(counts) if counts else "more than 3")
            answers.add(rows[key][-1])
    assert len(answers) > 1


def test_failures_tell_how_to_see_them_again(campaign: Campaign) -> None:
    """Each failed mission has its error and the command that does it again."""
    cells = Cells()
    cells.feed(campaign.report())
    failed = [row for row in cells.rows if len(row) == 5 and row[0].isdigit()]
    assert len(failed) == 18
    told = r"RuntimeError in round 0: no <schedule> today, at test_report_sweep\.py:\d+$"
    assert all(re.search(told, row[3]) for row in failed)
    assert all("--set" in row[4] and "--seed" in row[4] for row in failed)


def test_sweep_leaves_its_report_and_report_makes_it_again(tmp_path: Path) -> None:
    """A campaign's folder has a report when it ends; the command writes the same."""
    (tmp_path / "base.yaml").write_text(BASE)
    (tmp_path / "one.yaml").write_text(
        "scenario: base.yaml\nvary: {asvs.count: [1, 2]}\nseeds: 1\n"
    )
    out = tmp_path / "out"
    words = ["-q", "sweep", str(tmp_path / "one.yaml"), "--out", str(out), "--workers", "1"]
    outcome = call(*words)
    assert outcome.exit_code == 0, outcome.output
    first = (out / "report.html").read_text()
    assert "2 points with 1 seed each: 2 missions done, 0 failed" in first
    outcome = call("report", str(out))
    assert (outcome.exit_code, outcome.stdout.strip()) == (0, str(out / "report.html"))
    assert (out / "report.html").read_text() == first
    run = simulate(load_scenario(SCENARIOS / "quickstart.yaml", overrides=["duration_s=5"]))
    run.write(tmp_path / "run")
    outcome = call("report", str(out), str(tmp_path / "run"), "--out", str(tmp_path / "no.html"))
    assert outcome.exit_code == 2
    assert "is a campaign" in outcome.stderr


def test_runs_beside_each_other(tmp_path: Path) -> None:
    """The page of several runs names what differs in their scenarios, and by how much they do."""
    runs = []
    for name in ("failure_140m", "recovery_140m"):
        changes = ["duration_s=40", "record.detail=full"]
        result = simulate(load_scenario(SCENARIOS / f"{name}.yaml", overrides=changes), seed=0)
        runs.append((str(result.write(tmp_path / name)), result))
    page = beside(*runs)
    cells = Cells()
    cells.feed(page)
    rows = {row[0]: row[1:] for row in cells.rows}
    assert rows["asvs.count"] == ["1", "3"]
    first, second = (float(run.mission.position_error_m[0]) for _, run in runs)
    assert rows["mean position error (m)"] == [
        f"{first:.2f}", f"{second:.2f} ({second - first:+.2f})"
    ]  # fmt: skip
    worst, other = (run.mission.iloc[0] for _, run in runs)
    difference = other.worst_position_error_m - worst.worst_position_error_m
    assert rows["position error, mean over time (m)"] == [
        f"{worst.worst_position_error_m:.2f}, {worst.worst_position_error_m_auv}",
        f"{other.worst_position_error_m:.2f} ({difference:+.2f}), "
        f"{other.worst_position_error_m_auv}",
    ]
    out = tmp_path / "both.html"
    outcome = call("report", *(folder for folder, _ in runs), "--out", str(out))
    assert outcome.exit_code == 0
    assert out.read_text() == page
    assert call("report", *(folder for folder, _ in runs), "--out", str(out)).exit_code == 2


def test_runs_beside_each_other_say_who_got_no_fix() -> None:
    """A latency that leaves an AUV out says so, and is not set against one that does not."""
    runs = []
    for asvs, where in (("one", "[[0, 0]]"), ("more", "[[0, 0], [0, 47], [0, -47]]")):
        changes = [
            "duration_s=40",
            f"name={asvs}",
            "record.detail=summary",
            "acoustics.hf.range_m=20",
        ]
        changes += [
            f"asvs.formation.positions_m={where}",
            f"asvs.count={where.count(',') // 2 + 1}",
        ]
        runs.append(
            (asvs, simulate(load_scenario(SCENARIOS / "recovery_140m.yaml", overrides=changes)))
        )
    assert runs[0][1].mission.worst_latency_mean_s.isna()[0]
    cells = Cells()
    cells.feed(beside(*runs))
    told = [row[1:] for row in cells.rows if row[0] == "latency (s)"]
    assert told[0][0] == "none, AUV0"
    assert told[1][0].endswith(", without AUV0")
    assert "(" not in "".join(told[0] + told[1])


def test_the_same_run_twice_differs_in_nothing() -> None:
    """Runs are called A and B, with their folders; runs without events have no map."""
    result = simulate(
        load_scenario(
            SCENARIOS / "quickstart.yaml", overrides=["duration_s=5", "record.detail=summary"]
        )
    )
    page = beside(("a", result), ("b", result))
    assert "they are the same scenario with the same seed" in page
    assert "<b>A</b>: quickstart (a)</p>" in page
    assert "2 AUVs" in page.partition('id="origin"')[2]
    assert page.index('id="differences"') < page.index('id="story"')
    assert 'id="slider"' not in page


def test_points_without_a_mission_yet_are_not_judged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One point of two was flown, in the first of two shards, and is not below a metre."""
    hand_made(monkeypatch, lambda *_: [auv(3.0)])
    plan = {"asvs.count": [1, 2]}
    limits = {"worst_position_error_m": 0.001}  # so that a shard has whole points
    given = load_scenario(SCENARIOS / "quickstart.yaml", overrides=["duration_s=5"])
    out = tmp_path / "half"
    half = sweep(given, vary=plan, seeds=2, until_ci=limits, shard=(1, 2), workers=1, out=out)
    assert set(half.missions["point"]) == {0}
    assert "1 has no mission yet." in " ".join(half.summary().split())
    page = half.report()
    assert "no mission yet" in page
    assert "not known yet" in page
    assert "more than 2" not in page


def test_where_nothing_varies_there_is_nothing_to_choose(tmp_path: Path) -> None:
    """One point has neither a curve nor a map: it shows its missions."""
    given = load_scenario(SCENARIOS / "quickstart.yaml", overrides=["duration_s=5"])
    page = sweep(given, seeds=2, workers=1, out=tmp_path / "one").report()
    assert "1 point with 2 seeds each" in page
    assert "over the varied keys" not in page
    for control in ("<label hidden>along", "<label hidden>one line", 'id="heat-figure" hidden'):
        assert control in page
