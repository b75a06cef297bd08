"""The selection beside others: an exhaustive search, and KN and OCBA of sim-tools."""

import csv
import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "reference" / "selection"))

import numpy as np
import pytest
from plans_for_tests import Choice, Goal, Selection, interval, select
from sim_tools_runs import PROBLEMS, REPETITIONS, ZONE, noise
from toy_selections import Floats

REFERENCE = Path(__file__).parents[1] / "reference" / "selection"
KN_AND_OCBA = json.loads((REFERENCE / "sim_tools.json").read_text())

# The paper's sweep: how many ASVs, and at which angle, for a side of the survey and a team of AUVs?
MISSIONS, SEEDS, SHARE = 5760, 20, 0.2
Question = tuple[float, int]


@pytest.fixture(scope="module")
def questions() -> dict[str, dict[Question, dict[tuple[int, float], Floats]]]:
    """Return by metric, side and AUVs the values at all seeds for each number of ASVs and angle.

    The angle of a single ASV changes nothing, so that it has one point.
    """
    found: dict[str, dict[Question, dict[tuple[int, float], Floats]]] = {}
    with (REFERENCE / "sweep_errors.csv").open() as file:
        for row in csv.DictReader(file):
            values = np.array([float(row[f"seed_{seed}"]) for seed in range(SEEDS)])
            team = int(row["asvs"]), float(row["angle_deg"])
            question = float(row["side_m"]), int(row["auvs"])
            if team[0] > 1 or not team[1]:
                teams = found.setdefault(row["metric"], {}).setdefault(question, {})
                teams[team] = values
    return found


def exhaustive(teams: dict[tuple[int, float], Floats], limit: float) -> tuple[int, float] | None:
    """Return the least team that meets a goal if all is flown, and of its size the best."""
    met = [team for team, values in teams.items() if interval(values.tolist()).high <= limit]
    return min(met, key=lambda team: (team[0], teams[team].mean()), default=None)


def selected(teams: dict[tuple[int, float], Floats], goal: Goal) -> Selection:
    values = np.stack(list(teams.values()))[:, :, None]
    return select(
        [Choice(asvs) for asvs, _ in teams],
        lambda pairs: values[tuple(np.array(pairs).T)],
        [goal],
        most_seeds=SEEDS,
    )


@pytest.mark.parametrize(
    ("metric", "limit", "same"),
    [
        ("position_error_m", 0.5, 24),  # nobody meets it
        ("position_error_m", 1.0, 23),
        ("position_error_m", 2.0, 23),
        ("position_error_m", 3.0, 24),
        ("position_error_p95_m", 1.0, 24),
        ("position_error_p95_m", 4.0, 21),
        ("position_error_p95_m", 6.0, 24),
        ("position_error_p95_m", 10.0, 24),
    ],
)
def test_a_fifth_of_the_papers_sweep_finds_what_all_of_it_does(
    questions: dict[str, dict[Question, dict[tuple[int, float], Floats]]],
    metric: str,
    limit: float,
    same: int,
) -> None:
    """The same number of ASVs, wherever 20 seeds are enough to tell; where not, that is said."""
    goal = Goal(metric, below=limit)
    flown, agreed = 0, 0
    for teams in questions[f"worst_{metric}"].values():
        names, found, truth = list(teams), selected(teams, goal), exhaustive(teams, limit)
        flown += sum(found.missions)
        team = None if found.answer is None else names[found.answer]
        agrees = (team and team[0]) == (truth and truth[0])
        agreed += agrees
        if not agrees:
            assert truth is not None
            number = names.index(truth)
            assert found.verdicts[number] == "needs more missions"
        elif team is not None and truth is not None and found.is_settled:
            assert teams[team].mean() <= teams[truth].mean() + 0.05 * limit
    assert flown <= SHARE * MISSIONS
    assert agreed >= same


@pytest.mark.parametrize(
    "name",
    [pytest.param(it, marks=[pytest.mark.slow] if n > 2 else []) for n, it in enumerate(PROBLEMS)],
)
def test_it_is_as_right_as_kn_at_no_more_missions(name: str) -> None:
    """Choosing the best of equal cost, all of which meet the goal, at the same zone and risk."""
    goal = Goal("position_error_m", below=1000 * ZONE)
    known, means = KN_AND_OCBA[name], PROBLEMS[name][0]
    right, flown = 0, 0
    for repetition in range(REPETITIONS):
        values = noise(name, repetition)[:, :, None]
        found = select(
            [Choice(1)] * len(means),
            lambda pairs, values=values: values[tuple(np.array(pairs).T)],
            [goal],
            zone=0.001,
            most_seeds=1024,
        )
        assert found.answer is not None
        right += means[found.answer] < ZONE
        flown += sum(found.missions)
    assert right / REPETITIONS >= min(known["kn_right"], 1 - 0.05 / 3) - 0.01
    assert right / REPETITIONS >= known["ocba_right"] - 0.02
    assert flown / REPETITIONS <= known["kn_missions"]
