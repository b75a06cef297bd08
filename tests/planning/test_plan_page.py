"""The page of a plan as text: the answer, what was simulated and what if, whatever is missing."""

import copy
import json
from typing import Any

import pytest
from plans_for_tests import GOAL, attacked, base, chart_of, inputs_of, plan_page, record
from policy_for_tests import Parsed, assert_allows_its_own_alone

from bindusbl_des import Setup
from bindusbl_des.apps.planning.plan_page import setting, shown_first

Record = dict[str, Any]


@pytest.fixture(scope="module")
def chart() -> Record:
    """What the chart of a small plan needs."""
    return chart_of(Setup(base()), inputs_of(Setup(base())))


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


def test_nothing_can_be_moved_without_inputs() -> None:
    """The page says so, and holds all that was simulated."""
    page = plan_page(record())
    assert "No vessels can be moved here" in page
    assert 'id="pareto"' in page
    assert 'id="map"' not in page


def test_texts_of_a_record_stay_texts(chart: Record) -> None:
    """Nothing of it becomes an element, and the page allows its own scripts alone."""
    page = plan_page(attacked(record()), chart)
    assert_allows_its_own_alone(Parsed(page))
    assert "&lt;img src=x" in page


def test_candidates_share_what_they_have_in_common(chart: Record) -> None:
    """Of a candidate only the parts that are not the scenario's are in the page, once each."""
    scenario = base()
    other = scenario.model_copy(
        update={"protocol": scenario.protocol.model_copy(update={"frame_s": 2.0})}
    )
    slower = base(duration=90.0)
    own, inputs = (
        inputs_of(Setup(scenario)),
        [inputs_of(Setup(it)) for it in (scenario, other, slower, slower)],
    )
    found = chart_of(Setup(scenario), own, [*inputs, None])
    assert found["variant_of"] == [-1, -1, 0, 0, -1]
    assert "hf" not in found["variants"][0]
    assert found["variants"][0]["duration_s"] == 90.0
    assert json.loads(json.dumps(found)) == json.loads(json.dumps(chart)) | {
        "variants": json.loads(json.dumps(found["variants"])),
        "variant_of": found["variant_of"],
    }


def test_a_chart_offers_each_filter(chart: Record) -> None:
    """Those that the scenario may have, each with what it changes of the inputs."""
    assert set(chart["filters"]) == {"kalman", "fixed_gain", "smoother", "dead_reckoning"}
    assert chart["filters"]["kalman"] == {"navigator": chart["inputs"]["navigator"]}
    changed = inputs_of(Setup(base(changes=["navigation.filter=fixed_gain"]))).plain()
    for part, value in chart["filters"]["fixed_gain"].items():
        assert value == changed[part]


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
    assert f'"first":{first}' in page
