"""The points of a campaign as a table, its missions one by one, and how far it is as it goes on."""

import io
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from campaigns_for_tests import auv, hand_made
from commands_for_tests import call
from scipy import stats
from worlds import scenario

from bindusbl_des import (
    Campaign,
    CampaignState,
    Scenario,
    load_campaign,
    load_result,
    resume,
    simulate,
    sweep,
)
from bindusbl_des.support import process

pytestmark = pytest.mark.usefixtures("in_this_process")

COUNT, REACH, ANGLE = "asvs.count", "acoustics.hf.range_m", "asvs.formation.angle_deg"


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Campaign:
    """A campaign of three points, of which one has no mission that went well, and one seed none."""

    def fleet(mission: Scenario, seed: int) -> list[dict[str, float | None]]:
        if mission.asvs.count == 4 or seed == 3:
            raise RuntimeError("no water")
        lacks = {"latency_mean_s": None} if seed == 2 else {}
        return [auv(mission.asvs.count + seed / 8, **lacks)]

    hand_made(monkeypatch, fleet)
    base = scenario(name="50 % of_all", duration_s=2.0)
    points = [
        {COUNT: 2, "asvs.formation": {"positions_m": [[0, 1], [2, 3]]}},
        {COUNT: 3},
        {COUNT: 4},
    ]
    return sweep(base, tmp_path / "c", points=points, seeds=4)


def test_points_are_a_frame_of_means_and_intervals(made: Campaign) -> None:
    """Each metric at each point, by Student's t over the missions that have a value."""
    frame = made.points
    assert list(frame.columns) == [
        "point", COUNT, "asvs.formation", "metric", "unit", "mean", "low", "high", "n", "missions",
    ]  # fmt: skip
    assert set(frame.metric) == set(made.missions.select_dtypes("number")) & set(frame.metric)
    assert {"position_error_m", "worst_latency_mean_s", "rounds", "fairness"} <= set(frame.metric)
    error = frame[frame.metric == "worst_position_error_m"].reset_index(drop=True)
    assert error.unit.tolist() == ["m"] * 3
    assert error[COUNT].tolist() == [2, 3, 4]
    assert json.loads(error["asvs.formation"][0])["positions_m"] == [[0, 1], [2, 3]]
    assert (error.n.tolist(), error.missions.tolist()) == ([3, 3, 0], [3, 3, 0])
    for point, count in enumerate((2, 3)):
        values = count + np.arange(3) / 8
        expected = stats.t.interval(0.95, 2, values.mean(), stats.sem(values))
        assert error["mean"][point] == pytest.approx(values.mean())
        assert (error.low[point], error.high[point]) == pytest.approx(expected, rel=1e-4)
    assert error[["mean", "low", "high"]].iloc[2].isna().all()
    late = frame[frame.metric == "worst_latency_mean_s"]
    assert (late.n.tolist(), late.missions.tolist()) == ([2, 2, 0], [3, 3, 0])


def test_points_go_to_latex_and_csv(made: Campaign, tmp_path: Path) -> None:
    """Without jinja2; signs that mean something to LaTeX are escaped, what is not known is none."""
    text = made.to_latex(tmp_path / "t.tex", metrics=["worst_position_error_m", "latency_mean_s"])
    assert (tmp_path / "t.tex").read_text() == text
    lines = text.splitlines()
    assert lines[0].startswith("% 50 % of_all: means over n missions")
    assert lines[2] == r"\begin{tabular}{rlrrr}"
    assert [line for line in lines if line.startswith(r"\hline")] == [r"\hline"] * 3
    rows = [line.removesuffix(r" \\").split(" & ") for line in lines if " & " in line]
    assert [len(row) for row in rows] == [5] * 4
    assert rows[0][:3] == ["asvs.count", "asvs.formation", "$n$"]
    assert rows[1][2:] == ["3", r"$2.12 \pm 0.31$", r"$1.00 \pm 0$ (2)"]
    assert rows[2][2:4] == ["3", r"$3.12 \pm 0.31$"]
    assert rows[3][2:] == ["0", "--", "--"]
    assert r"\{" in rows[1][1]
    assert r"positions\_m" in rows[1][1]
    with pytest.raises(ValueError, match="did you mean 'position_error_m'"):
        made.to_latex(metrics=["position_eror_m"])
    assert call("export", made.folder, "--to", "csv", "--out", tmp_path / "csv").exit_code == 0
    back = pd.read_csv(tmp_path / "csv" / "points.csv")
    pd.testing.assert_frame_equal(back, made.points, check_dtype=False)
    meanings = pd.read_csv(tmp_path / "csv" / "columns.csv").query("table == 'points'")
    assert "missions that have a value" in meanings.meaning.tolist()


@pytest.fixture(scope="module")
def full(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    """A campaign that keeps all tables; `duration_s`, a column of missions as well, is varied."""
    vary = {"duration_s": [4, 6], COUNT: [1, 2]}
    base = scenario(name="kept", record={"tracks_hz": 1.0})
    return sweep(base, tmp_path_factory.mktemp("k") / "c", vary=vary, seeds=[3, 1], detail="full")


def test_a_mission_of_a_campaign_is_a_result(full: Campaign, tmp_path: Path) -> None:
    """The same tables as `simulate` makes of its scenario and seed, which can be written."""
    for campaign in (full, load_campaign(full.folder)):
        result = campaign.result(3, 1)
        assert (result.scenario.duration_s, result.scenario.asvs.count, result.seed) == (6.0, 2, 1)
        again = simulate(result.scenario, seed=1)
        assert set(result.tables) == set(again.tables)
        for name, table in again.arrow.items():
            assert result.arrow[name].schema.equals(table.schema, check_metadata=True), name
            assert result.arrow[name].combine_chunks().equals(table.combine_chunks()), name
    result.write(tmp_path / "r")
    assert load_result(tmp_path / "r").summary() == again.summary()


def test_tables_of_events_are_those_of_all_missions(full: Campaign) -> None:
    """Each row says of which mission, seed and point it is, and with which values."""
    fixes = full.table("fixes")
    assert list(fixes.columns[:7]) == [
        "mission", "mission_id", "seed", "point", "duration_s", COUNT, "fix",
    ]  # fmt: skip
    assert set(fixes.seed) == {1, 3}
    for point in range(4):
        rows = fixes[(fixes.point == point) & (fixes.seed == 1)].reset_index(drop=True)
        own = full.result(point, 1).tables["fixes"]
        pd.testing.assert_frame_equal(rows[own.columns], own)
        assert (rows[[COUNT, "duration_s"]] == [1 + point % 2, 4 + 2 * (point // 2)]).all(axis=None)
    assert full.table("missions") is full.missions
    assert full.table("auvs") is full.auvs
    assert len(full.table("assignments")) == 0


def test_what_a_campaign_has_not_kept_is_told(full: Campaign, made: Campaign) -> None:
    for wrong, said in (
        (lambda: full.table("fixs"), "no table 'fixs'; did you mean 'fixes'"),
        (lambda: made.table("fixes"), "has no table 'fixes', since it keeps metrics alone; sweep"),
        (lambda: full.result(4, 1), "no point 4; there are 0 to 3"),
        (lambda: full.result(0, 0), r"no seed 0; there are \[3, 1\]"),
        (lambda: made.result(2, 0), "point 2 with seed 0 failed: RuntimeError: no water"),
    ):
        with pytest.raises(ValueError, match=said):
            wrong()
    assert made.result(1, 2).mission.position_error_m[0] == 3.25  # of metrics alone
    assert set(made.result(1, 2).tables) == {"auvs", "mission"}


def test_points_given_one_by_one_are_those_of_a_file(tmp_path: Path) -> None:
    """A list, a generator or a frame; keys that a point leaves out are as in the scenario."""
    points = [{COUNT: 1, ANGLE: 10.0}, {COUNT: 2, ANGLE: 20.0}]
    base = scenario(name="m", duration_s=2.0)
    made = [sweep(base, points=it) for it in (points, iter(points), pd.DataFrame(points))]
    (tmp_path / "m.yaml").write_text("name: m\nduration_s: 2\n")
    (tmp_path / "e.yaml").write_text(
        f"scenario: m.yaml\npoints:\n- {{{COUNT}: 1, {ANGLE}: 10.0}}\n"
        f"- {{{COUNT}: 2, {ANGLE}: 20.0}}\n"
    )
    read = sweep(tmp_path / "e.yaml").experiment.points
    assert all(campaign.experiment.points == read for campaign in made)
    assert sweep(base, points=[{}, {COUNT: 1}]).missions[COUNT].tolist() == [3, 1]


def test_progress_is_told_to_a_function(tmp_path: Path) -> None:
    """After each batch, and what was there before counts; what it raises ends the sweep."""
    told: list[CampaignState] = []
    base = scenario(name="m", duration_s=2.0)

    def impatient(state: CampaignState) -> None:
        told.append(state)
        raise TimeoutError("enough")

    with pytest.raises(TimeoutError, match="enough"):
        sweep(base, tmp_path / "c", vary={COUNT: [1, 2]}, seeds=200, progress=impatient)
    before = load_campaign(tmp_path / "c").state()
    assert (told[0].missions, told[0].done) == (400, before.done)
    assert 0 < before.done < 400
    assert before.status == "killed"
    told.clear()
    done = resume(tmp_path / "c", progress=told.append)
    assert [state.done for state in told] == sorted({state.done for state in told})
    assert (told[-1].done, told[-1].missing, told[-1].failed) == (400, 0, 0)
    assert all(state.missions_per_s > 0 for state in told)
    assert len(done.missions) == 400


class Cell(io.StringIO):
    """What stands for `stdout` in a notebook."""


Cell.__module__ = "ipykernel.iostream"


@pytest.mark.parametrize("quiet", [None, False, True])
def test_notebooks_show_progress_unless_it_is_not_wanted(
    quiet: bool | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One line that is redrawn, and ends with all missions; elsewhere nothing is said unasked."""
    monkeypatch.setattr(process, "PATIENCE_S", 0.0)
    cell, trouble = Cell(), io.StringIO()
    monkeypatch.setattr(sys, "stdout", cell)
    monkeypatch.setattr(sys, "stderr", trouble)
    settings: dict[str, Any] = {} if quiet is None else {"quiet": quiet}
    sweep(scenario(name="m", duration_s=2.0), seeds=3, **settings)
    assert trouble.getvalue() == ""
    lines = cell.getvalue().split("\r")
    assert (lines == [""]) == (quiet is True)
    assert quiet or lines[-1].startswith("3/3 missions, ")
    assert quiet or lines[-1].endswith("\n")
    monkeypatch.setattr(sys, "stdout", io.StringIO())
    sweep(scenario(name="m", duration_s=2.0), seeds=3)
    assert sys.stdout.getvalue() == trouble.getvalue() == ""  # type: ignore[attr-defined]
