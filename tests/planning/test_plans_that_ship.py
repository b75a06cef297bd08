"""The plans in experiments/plans, of which docs/planning.md tells the answers."""

from pathlib import Path

import pytest

from bindusbl_des.planning.questions.asking import Asking
from bindusbl_des.planning.questions.plan_file import read_plan

PLANS = Path(__file__).parents[2] / "experiments" / "plans"
SIDES = {"survey_60m": 60, "survey_100m": 100, "survey_140m": 140, "rectangle": 500}


@pytest.mark.parametrize(("name", "side_m"), SIDES.items())
def test_they_ask_how_many_asvs_for_1_m(name: str, side_m: float) -> None:
    question = read_plan(PLANS / f"{name}.yaml", Asking())
    assert [str(it) for it in question.goals] == ["position_error_m of the worst AUV at most 1"]
    survey = question.experiment.scenario(0).survey
    assert (survey.size_m or [survey.side_m])[0] == side_m
    assert question.budget_s == 120
