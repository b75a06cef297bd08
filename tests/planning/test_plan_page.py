"""The page of a plan as text: the answer, what was simulated and what if, whatever is missing."""

import copy
from typing import Any

import pytest
from plans_for_tests import (
    GOAL,
    attacked,
    base,
    chart_of,
    drawn,
    inputs_of,
    moored,
    plan_page,
    predict,
    record,
)
from policy_for_tests import Parsed, assert_allows_its_own_alone

from bindusbl_des import Setup
from bindusbl_des.apps.planning.folder import shown_first
from bindusbl_des.apps.planning.plan_page import setting
from bindusbl_des.support.wording import significant

Record = dict[str, Any]


@pytest.fixture(scope="module")
def chart() -> Record:
    """What is drawn of a small plan."""
    return drawn()


def test_the_answer_is_told_first(chart: Record) -> None:
    """In a sentence, in numbers with units, with what binds, how to fly it, and if it is not so."""
    told = ["Two ASVs 55 m out keep every AUV below 1 m.", "Simulated in 18 missions."]
    page = plan_page({**record(), "told": told}, chart)
    answer = page[page.index('id="answer"') : page.index('id="chart"')]
    for words in (
        *told,
        "confidence",
        "95 <small>%",
        "missions simulated",
        "What binds",
    ):
        assert words in answer
    assert "out of range of every vessel" in answer
    assert "bindusbl-des run best.yaml" in answer
    assert page.index(told[0]) < page.index("HF and MF range -20 %") < page.index("What made")
    assert "✗ not met" in page[page.index('id="sensitivity"') :]
    assert answer.index("If it is not as planned") < answer.index("✗ not met")
    assert answer.count("<dt>") <= 4
    for key, value in record()["answer"].items():
        assert setting(key, value) in page
    assert "with the filter as planned" not in page  # of older plans nobody knows
    cases = [{**case, "known": False} for case in record()["sensitivity"]]
    untold = plan_page({**record(), "told": told, "sensitivity": cases}, chart)
    assert untold.count("imulated with the filter as planned, since the crew does not know") == 2


def test_predicted_and_simulated_are_told_apart(chart: Record) -> None:
    """The chart says that its numbers are predicted, and how far predictions are off."""
    page = plan_page(record(), chart)
    section = page[page.index('id="chart"') : page.index('id="candidates"')]
    assert "<b>predicted</b>" in section
    assert "of half of the teams by less than 10 %, of nine in ten by less than 40 %" in section
    table = page[page.index("The answer and its runners-up") :]
    assert "position error, 95 % of the time, predicted" in table
    assert "simulated" in table


def test_no_answer_says_what_would_do(chart: Record) -> None:
    """A null answer is no mistake: what came nearest is shown, and what would meet the goal."""
    without = {**record(), "answer": None, "chosen": None, "would": "A range of 80 m would."}
    page = plan_page(without, chart)
    assert "No candidate is known to meet the goal." in page
    assert "A range of 80 m would." in page
    assert "What came nearest" in page
    assert "To fly it" not in page


@pytest.mark.parametrize("lost", ["all", "simulated"])
def test_what_is_missing_is_left_out(chart: Record, lost: str) -> None:
    """Of an empty record, and one in which nothing was simulated, there is a page as well."""
    given = copy.deepcopy(record())
    if lost == "all":
        given = {}
    for it in given.get("candidates", ()) if lost == "simulated" else ():
        it["simulated"] = None
    for inputs in (chart, None):
        assert "</html>" in plan_page(given, inputs)


def test_each_key_may_be_missing(chart: Record) -> None:
    """No key of the record is needed by another's section."""
    for key in record():
        page = plan_page({name: it for name, it in record().items() if name != key}, chart)
        assert 'id="answer"' in page, key


def test_without_teams_nothing_is_drawn() -> None:
    """The page says so, and holds all that was simulated."""
    page = plan_page(record())
    assert "No team is drawn here" in page
    assert 'id="pareto"' in page
    assert 'id="map"' not in page


def test_texts_of_a_record_stay_texts(chart: Record) -> None:
    """Nothing of it becomes an element, and the page allows its own scripts alone."""
    page = plan_page(attacked(record()), chart)
    assert_allows_its_own_alone(Parsed(page))
    assert "&lt;img src=x" in page


def test_teams_share_what_they_have_in_common(chart: Record) -> None:
    """Of a team only the parts that are not the first one's are in the page."""
    places = [[0.0, 40.0], [10.0, -40.0]]
    faster = base(changes=["auvs.speed_m_per_s=1.2", "survey.side_m=150"])
    found = chart_of({2: Setup(base()), 5: Setup(moored(places)), 9: Setup(faster)})
    assert found["first"] == chart["first"] | {"asvs": found["first"]["asvs"]}
    assert {n: set(own) for n, own in found["teams"].items()} == {
        "2": set(), "5": {"asvs"}, "9": {"auvs", "outline"},
    }  # fmt: skip
    assert [[it["x"], it["y"]] for it in found["teams"]["5"]["asvs"]] == [
        [[0], [40]],
        [[10], [-40]],
    ]


def test_each_team_has_its_numbers(chart: Record) -> None:
    """What is predicted of each AUV, as Python predicts it, and what missions came to."""
    page = plan_page(record(), chart)
    for number, forecast in chart["forecasts"].items():
        candidate = record()["candidates"][int(number)]
        stations = candidate["stations"]
        found = predict(inputs_of(Setup(base())), stations)
        assert [auv["position_error_p95_m"] for auv in forecast["auvs"]] == pytest.approx(
            found.position_error_p95_m.tolist(), rel=1e-9
        )
        part = page[page.index(f'data-team="{number}"') :]
        part = part[: part.index("</div></div>")]
        own = found.worst("position_error_p95_m")
        assert f"<td>{significant(own)}</td>" in part
        assert significant(candidate["simulated"]["mean"][0]) in part
        assert f"in {candidate['simulated']['missions']} missions" in part


def test_what_is_not_predicted_is_drawn_all_the_same() -> None:
    """Vessels that move as they went in a mission; of others that move nothing is known."""
    ways = {"seed": 4, "asvs": [{"asv": "ASV0", "places_m": [[0.0, 0.0], [30.0, 10.0]]}]}
    moving = Setup(base(changes=["asvs.formation={model: follow}"]))
    found = chart_of({0: moving, 1: moving}, {0: ways})
    assert found["first"]["asvs"] == [{"name": "ASV0", "x": [0.0, 30.0], "y": [0.0, 10.0]}]
    assert found["teams"]["1"] == {"asvs": [], "seed": None}
    assert found["forecasts"] == {"0": None, "1": None}
    page = plan_page(record(), found)
    assert page.count("Nothing is predicted of this team") == 2
    assert page.count("in the mission of seed 4") == 1


@pytest.mark.parametrize(
    ("goal", "words"),
    [
        (GOAL, "Goal for the worst AUV: position error, 95 % of the time below 1.00 m"),
        (
            {"metric": "hf_coverage", "above": 0.9, "of": "mean"},
            "Goal for the mean of the AUVs: pings in HF range above 90.0 %",
        ),
        (
            {"metric": "fix_age_p95_s", "below": 20, "of": 0.9},
            "Goal for 90 % of the AUVs: age of the last fix, 95 % of the time below 20.0 s",
        ),
    ],
)
def test_goals_are_told_with_their_units(goal: Record, words: str) -> None:
    """What is asked for, of whom, and below or above what."""
    assert words in plan_page({**record(), "goal": [goal]})


def test_missions_that_miss_the_goal_are_counted(chart: Record) -> None:
    """Beside the mean: how many missions miss the goal; older records do not say."""
    told = copy.deepcopy(record())
    assert "missions that miss the goal" not in plan_page(told, chart)
    simulated = told["candidates"][told["chosen"]]["simulated"]
    simulated |= {"missions": 8, "missed": [0.25]}
    assert "<dt>missions that miss the goal</dt><dd>2 <small>of 8</small>" in plan_page(told, chart)


def test_without_an_answer_the_nearest_is_drawn() -> None:
    """What binds is told of the first of those that came nearest, and the chart begins with it."""
    without = {**record(), "answer": None, "chosen": None}
    page = plan_page(without)
    first = without["runners_up"][0]
    assert shown_first(without) == first
    assert f"<h3>What binds candidate {first + 1}</h3>" in page
    assert f'"first":{first}' in plan_page(without, drawn())
