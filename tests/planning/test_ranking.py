"""Teams are ranked by cost where they meet the goals, else by how near they come."""

from plans_for_tests import Estimate, Goal, Selection, team_in

from bindusbl_des import Scenario
from bindusbl_des.apps.planning.answer_text import ranked

MEANS = (0.9, 0.2, 0.4, 0.3)


def order(below: float) -> list[int]:
    """Return the order of teams of ever more vessels, of which the last was not flown."""
    estimates = tuple((Estimate(mean, mean, mean),) for mean in MEANS)
    found = Selection(None, ("not met",) * 4, estimates, (8, 8, 8, 0))
    teams = [team_in(Scenario(name="bay"), cost) for cost in (1.0, 2.0, 3.0, 4.0)]
    return ranked([Goal("position_error_m", below=below)], teams, found)


def test_what_meets_the_goal_stands_before_what_does_not() -> None:
    assert order(below=0.5) == [1, 2, 0]


def test_the_nearest_stands_first_where_none_meets_it() -> None:
    """Also of a goal that nothing comes near in proportion."""
    assert order(below=0.1) == [1, 2, 0]
    assert order(below=0.0) == [1, 2, 0]
