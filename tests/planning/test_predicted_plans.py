"""Predictions of plans drawn at random beside their simulations: ./scripts/test --all."""

import numpy as np
import pytest
from plans_for_tests import STATED_ERROR
from predicted_for_tests import compared, drawn_plan, off, rank_correlation, ratios

PLANS, SEEDS = 520, 4


@pytest.mark.slow
def test_predictions_are_as_far_off_as_is_stated() -> None:
    """What is stated was measured so; a better prediction is to be stated anew."""
    plans = [compared(drawn_plan(number), SEEDS) for number in range(PLANS)]
    for metric, stated in STATED_ERROR.items():
        shares = off(ratios(plans, metric))
        found = np.quantile(shares, (0.5, 0.9, 0.99))
        assert found == pytest.approx((stated.median, stated.p90, stated.p99), rel=0.1, abs=2e-3)
    kalman = [it for it in plans if it.keys["navigation"]["filter"] == "kalman"]
    assert np.median(off(ratios(kalman, "position_error_m"))) < 0.15


@pytest.mark.slow
def test_placements_are_ranked_as_missions_rank_them() -> None:
    found = [rank_correlation(number, seeds=4) for number in range(10)]
    assert np.nanmedian(found) > 0.8


@pytest.mark.parametrize("number", [0, 100])
def test_drawn_plans_are_predicted_about_right(number: int) -> None:
    """Two of those plans, so that they go on being plans."""
    plan = compared(drawn_plan(number), seeds=1)
    assert 0.2 < ratios([plan], "position_error_m")[0] < 5.0
