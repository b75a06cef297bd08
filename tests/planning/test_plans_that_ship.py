"""The plans in experiments/plans, of which docs/planning.md tells the answers; plans on machines
that have other work, too (benchmarks/plans.py asks the same of those that ship).
"""

import subprocess
import sys
from pathlib import Path

import pytest
from plans_for_tests import Asking, read_plan

from bindusbl_des import load_scenario, plan

PLANS = Path(__file__).parents[2] / "experiments" / "plans"
SIDES = {"survey_60m": 60, "survey_100m": 100, "survey_140m": 140, "rectangle": 500}


@pytest.mark.parametrize(("name", "side_m"), SIDES.items())
def test_they_ask_how_many_asvs_for_1_m(name: str, side_m: float) -> None:
    question = read_plan(PLANS / f"{name}.yaml", Asking())
    assert [str(it) for it in question.goals] == ["position_error_m of the worst AUV at most 1"]
    survey = question.experiment.scenario(0).survey
    assert (survey.size_m or [survey.side_m])[0] == side_m
    assert question.budget_s is question.budget_missions is None


@pytest.mark.slow
def test_a_plan_is_the_same_beside_a_competing_load(tmp_path: Path) -> None:
    """With one worker and with two, on a machine with nothing else to do and on a busy one."""
    scenario = load_scenario("quickstart", overrides=["duration_s=40"])
    keys = {"protocol.schedule": ["spatial_reuse"], "protocol.downlink": ["sequential"]}
    vary = {"asvs.count": [1, 2], "asvs.formation.radius_m": [30, 45], **keys}
    asked = {"below": {"position_error_m": 1.0}, "vary": vary}
    idle = plan(scenario, tmp_path / "idle", workers=1, **asked).record
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(2)]
    try:
        again = plan(scenario, tmp_path / "busy", workers=2, **asked).record
    finally:
        for process in busy:
            process.kill()
            process.wait()
    assert idle["settled"] is True
    folders = dict.fromkeys(("run", "scenario"))
    assert again | folders == idle | folders
