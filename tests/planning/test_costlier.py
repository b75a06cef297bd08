"""What more vessels would bring is shown by few missions, and by more where few scatter."""

from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray
from plans_for_tests import Estimate, Goal, Selection, team_in

from bindusbl_des import Scenario
from bindusbl_des.apps.planning.doubting import with_costlier

Floats = NDArray[np.float64]
GOALS = (Goal("position_error_m", below=1.0),)
COSTS = (1.0, 2.0, 2.0, 3.0)  # the first is the answer, the third the second best of its cost


def shown(values: Floats, most: int = 100) -> Selection:
    """Return a selection with what missions add: values (4, seeds), of `most` missions at most."""
    nothing = tuple((Estimate(*3 * [float("nan")]),) for _ in COSTS)
    verdicts = ("met", "not needed", "not needed", "not needed")
    before = Selection(0, verdicts, nothing, (8, 0, 0, 0))
    teams = [team_in(Scenario(name="bay"), cost) for cost in COSTS]
    left = most

    def sample(pairs: Sequence[tuple[int, int]]) -> Floats:
        nonlocal left
        found = [values[pair] for pair in pairs][:left]
        left -= len(found)
        return np.array(found).reshape(-1, 1)

    return with_costlier(before, teams, GOALS, sample)


def test_the_best_of_each_higher_cost_is_flown_until_its_mean_is_known_about() -> None:
    """Four missions where these agree, eight where they scatter; of each cost one candidate."""
    sure, wide = 0.5 + 0.01 * np.arange(8), np.resize([0.2, 0.8], 8)
    found = shown(np.stack([sure, sure, sure, wide]))
    assert found.missions == (8, 4, 0, 8)
    assert found.estimates[1][0].mean == pytest.approx(sure[:4].mean())
    assert found.estimates[3][0].mean == pytest.approx(0.5)
    assert found.estimates[3][0].low < 0.5 < found.estimates[3][0].high
    assert found.verdicts == ("met", "not needed", "not needed", "not needed")


def test_a_mission_without_a_value_leaves_the_mean_unknown() -> None:
    """It is no number, whatever the others are."""
    values = np.full((4, 8), 0.5)
    values[1, 2] = np.nan
    assert np.isnan(shown(values).estimates[1][0].mean)


def test_time_that_is_up_leaves_what_is_known() -> None:
    """Missions of a round that is not whole do not count."""
    wide = np.tile(np.resize([0.2, 0.8], 8), (4, 1))
    assert shown(wide, most=3).missions == (8, 0, 0, 0)
    assert shown(wide, most=10).missions == (8, 4, 0, 4)
