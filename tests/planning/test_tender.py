"""Plans side by side, as tenders: team, places, price, hours, error, and what a loss leaves."""

import json
from pathlib import Path

import pytest
from campaigns_for_tests import auv, hand_made
from commands_for_tests import call

from bindusbl_des import Plan, Scenario, plan

BASE = {"name": "bay", "duration_s": 1200, "survey": {"side_m": 100}, "auvs": {"count": 2},
        "environment": {"origin": {"lat_deg": 54.5, "lon_deg": 10.25}}}  # fmt: skip
TEAMS = {"asvs.count": [1, 2, 3], "protocol.schedule": ["spatial_reuse"],
         "protocol.downlink": ["sequential"], "asvs.formation.angle_deg": [0]}  # fmt: skip


def fleet(scenario: Scenario, seed: int) -> list[dict[str, float | None]]:
    """Return errors of 1.5 m over the number of ASVs that are left, twice those of a poor USBL."""
    gone = {failure.asv for failure in scenario.asvs.failures}
    sheet = 2.0 if scenario.usbl.heading_sd_deg == 3.0 else 1.0
    error = sheet * 1.5 / max(scenario.asvs.count - len(gone), 0.5) + 0.001 * (seed % 5)
    return [auv(error), auv(0.1)]


@pytest.fixture(autouse=True)
def _by_hand(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Fly missions in an empty folder, each as `fleet` has it."""
    monkeypatch.chdir(tmp_path)
    hand_made(monkeypatch, fleet)


def made(name: str, heading: float, price: float, below: float = 1.0, survive: int = 0) -> Plan:
    """Return a plan with vessels of a price and a compass."""
    data = {**BASE, "usbl": {"heading_sd_deg": heading}}
    Path(f"{name}_bay.yaml").write_text(json.dumps(data))
    text = {"scenario": f"{name}_bay.yaml", "candidates": TEAMS, "cost": {"asv": price},
            "goal": {"metric": "position_error_m", "below": below},
            "survive": survive}  # fmt: skip
    Path(f"{name}.yaml").write_text(json.dumps(text))
    return plan(f"{name}.yaml", name)


def test_tenders_have_team_price_hours_error_and_what_a_loss_leaves() -> None:
    """Two dear vessels, or three cheap ones with a poor compass: rows are what the plans say."""
    plans = {"good": made("good", 1.0, 40_000.0), "poor": made("poor", 3.0, 10_000.0, 1.0)}
    said = call("compare", *plans)
    assert said.exit_code == 0, said.output
    rows = json.loads(call("compare", *plans, "--json").output)["tender"]
    assert [(it["asvs"], it["price"], it["duration_s"]) for it in rows] == [
        (2, 80_000.0, 1200.0), (3, 30_000.0, 1200.0),
    ]  # fmt: skip
    for row, found in zip(rows, plans.values(), strict=True):
        record = found.record
        chosen = record["candidates"][record["runners_up"][0] if record["chosen"] is None
                                      else record["chosen"]]  # fmt: skip
        assert row["places"] == chosen["places"]
        assert row["met"] == (record["answer"] is not None)
        for end in ("mean", "low", "high"):
            assert row[end] == chosen["simulated"][end]
    case = next(it for it in plans["good"].record["sensitivity"] if it["what"] == "lost")
    assert rows[0]["after_loss"]["mean"] == [pytest.approx(case["mean"][0], abs=0.01)]
    assert rows[0]["after_loss"]["met"] is False
    table = [line.split() for line in said.output.splitlines() if line[:5] in ("A    ", "B    ")]
    assert table[0][:6] == ["A", "2", "80,000", "0:20", "h", "0.752"]
    assert "A, ASV0: 54." in said.output
    assert "A, after a loss: ASV" in said.output
    assert "B compared with A; " in said.output


def test_a_plan_that_survives_says_what_any_loss_leaves() -> None:
    plans = [made("one", 1.0, 2.0), made("two", 1.0, 2.0, survive=1)]
    rows = json.loads(call("compare", "one", "two", "--json").output)["tender"]
    chosen = plans[1].record["candidates"][plans[1].record["chosen"]]["simulated"]
    assert rows[1]["after_loss"] == {
        "told": "any ASV lost", "met": True,
        **{end: chosen[end][1:] for end in ("mean", "low", "high")},
    }  # fmt: skip
    assert [row["asvs"] for row in rows] == [2, 3]
    assert [len(row["mean"]) for row in rows] == [1, 1]


def test_tenders_of_different_goals_and_what_is_no_plan_are_refused() -> None:
    made("one", 1.0, 2.0)
    made("other", 1.0, 2.0, below=2.0)
    said = call("compare", "one", "other")
    assert said.exit_code == 2
    assert "other: its goal is position_error_m of the worst AUV at most 2 m" in said.output
    assert "one/missions other/missions" in said.output
    assert call("compare", "one/missions", "other/missions").exit_code == 0
    Path("empty").mkdir()
    said = call("compare", "one", "empty")
    assert said.exit_code == 2
    assert "empty is no campaign folder" in said.output
    Path("one/plan.json").write_text("{}")
    said = call("compare", "other", "one")
    assert said.exit_code == 2
    assert "Traceback" not in said.output
