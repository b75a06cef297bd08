"""Selection: what it promises holds on problems whose answers are known."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from plans_for_tests import Choice, Goal, Selection, select
from toy_selections import ZONE, Floats, toy

METRE = (Goal("position_error_p95_m", below=1.0),)
Pairs = Sequence[tuple[int, int]]


def sampler(means: Sequence[float], sd: float = 0.1, seed: int = 0) -> Callable[[Pairs], Floats]:
    """Return a sampler of normal values of one goal."""
    noise = np.random.default_rng(seed).standard_normal((len(means), 256))
    return lambda pairs: np.array([[means[it] + sd * noise[it, n]] for it, n in pairs])


def limited(sample: Callable[[Pairs], Floats], missions: int) -> Callable[[Pairs], Floats]:
    """Return a sampler that flies so many missions and no more."""
    left = missions

    def some(pairs: Pairs) -> Floats:
        nonlocal left
        flown, left = pairs[:left], left - len(pairs[:left])
        return sample(flown) if flown else np.empty((0, 1))

    return some


def chosen(means: Sequence[float], costs: Sequence[float], **settings: Any) -> Selection:
    """Select among candidates of such means, the goal being at most 1."""
    return select([Choice(cost) for cost in costs], sampler(means), METRE, **settings)


@pytest.mark.parametrize("skewness", [pytest.param(0.0, marks=pytest.mark.slow), 1.0])
def test_at_least_95_of_100_toy_problems_are_answered_right(skewness: float) -> None:
    """Half of 200: spreads unlike, seeds paired, ties, none that meets, missions without value."""
    rng = np.random.default_rng(15)
    right, flown, all_missions = 0, 0, 0
    for _ in range(100):
        problem = toy(rng, skewness)
        found = select(problem.candidates, problem.sample, problem.goals, zone=ZONE)
        right += problem.is_right(found.answer)
        flown += problem.flown
        all_missions += problem.values.shape[0] * problem.values.shape[1]
        assert problem.flown == sum(found.missions)
    assert right >= 95
    assert flown < 0.2 * all_missions


def test_the_cheapest_that_meets_the_goal_is_chosen_and_of_its_cost_the_best() -> None:
    found = chosen([2.0, 0.9, 0.6, 0.3], [1, 2, 2, 3])
    assert found.answer == 2
    assert found.is_settled
    assert found.verdicts == ("not met", "outdone", "met", "not needed")
    assert found.missions[0] == 4  # what is clear needs few missions, what is costlier none
    assert found.missions[3] == 0
    estimate = found.estimates[2][0]
    assert estimate.low < estimate.mean < estimate.high < 1
    assert np.isnan(found.estimates[3][0].mean)


def test_a_mission_at_the_limit_keeps_it() -> None:
    found = select([Choice(1)], lambda pairs: np.ones((len(pairs), 1)), METRE)
    assert found.estimates[0][0].missed == 0.0


def test_where_none_meets_the_goal_there_is_no_answer() -> None:
    found = chosen([1.2, 1.5], [1, 2])
    assert found.answer is None
    assert found.is_settled


def test_a_candidate_at_its_limit_needs_more_missions_and_not_chosen() -> None:
    found = chosen([1.0, 0.5], [1, 2], most_seeds=32, zone=0.0)
    assert found.verdicts == ("needs more missions", "met")
    assert found.answer == 1
    assert not found.is_settled
    assert found.doubts == "1 cheaper candidate may meet the goals: not settled with 32 seeds."


def test_within_the_zone_of_the_limit_no_more_missions_are_flown() -> None:
    found = chosen([0.99, 0.5], [1, 2], zone=0.2)
    assert found.verdicts == ("needs more missions", "met")
    assert found.is_settled  # it could be better by less than would matter
    assert found.missions[0] <= 16


def test_a_mission_without_a_value_does_not_meet_a_goal() -> None:
    def sample(pairs: Pairs) -> Floats:
        return np.array([[np.nan if it == 0 and n == 7 else 0.5 + 0.01 * n] for it, n in pairs])

    found = select([Choice(1), Choice(2)], sample, METRE)
    assert found.verdicts == ("not met", "met")
    assert found.answer == 1


def test_all_goals_must_be_met() -> None:
    goals = (*METRE, Goal("hf_coverage", above=0.9))
    noise = np.random.default_rng(1).standard_normal((3, 256, 2))
    values = np.array([[0.3, 0.5], [0.7, 0.97], [0.5, 0.8]])[:, None, :] + 0.02 * noise
    found = select([Choice(1)] * 3, lambda pairs: values[tuple(np.array(pairs).T)], goals)
    assert found.verdicts == ("not met", "met", "not met")
    assert found.answer == 1
    coverage = found.estimates[1][1]
    assert 0.9 < coverage.low < coverage.mean


def test_values_without_any_spread_are_believed_when_there_are_enough() -> None:
    def sample(pairs: Pairs) -> Floats:
        return np.array([[(1.0, 0.9, 1.0)[it]] for it, _ in pairs])

    found = select([Choice(it) for it in (1, 2, 3)], sample, [Goal("hf_coverage", above=1.0)])
    assert found.verdicts == ("met", "not needed", "not needed")
    assert found.missions == (8, 0, 0)
    assert select([Choice(1)], sample, METRE).answer == 0  # at the limit is within it


def test_seeds_are_paired_and_each_mission_is_asked_for_once() -> None:
    asked: list[tuple[int, int]] = []
    values = sampler([0.8, 0.85, 1.5])

    def sample(pairs: Pairs) -> Floats:
        asked.extend(pairs)
        return values(pairs)

    found = select([Choice(1)] * 3, sample, METRE)
    assert len(set(asked)) == len(asked) == sum(found.missions)
    for candidate, missions in enumerate(found.missions):
        assert sorted(n for it, n in asked if it == candidate) == list(range(missions))


def test_a_prediction_decides_the_order_and_not_the_answer() -> None:
    means, costs = [2.0, 1.5, 0.7, 0.5], [1, 2, 3, 4]
    for priors in ([0.5] * 4, [9.0] * 4, [9.0, 9.0, 9.0, 0.5], [np.nan] * 4):
        first: list[int] = []

        def sample(pairs: Pairs, first: list[int] = first) -> Floats:
            first.append(pairs[0][0])
            return sampler(means)(pairs)

        candidates = [Choice(c, [p]) for c, p in zip(costs, priors, strict=True)]
        found = select(candidates, sample, METRE)
        assert found.answer == 2
        assert first[0] == next((n for n, prior in enumerate(priors) if prior <= 1), 0)


def test_what_is_cut_off_gives_the_best_answer_so_far_and_says_what_is_missing() -> None:
    candidates = [Choice(1, [5.0]), Choice(2, [5.0]), Choice(3, [0.5])]
    found = select(candidates, limited(sampler([1.5, 1.01, 0.5]), 17), METRE)
    assert found.answer == 2
    assert found.verdicts == ("not flown", "needs more missions", "met")
    assert found.missions == (0, 9, 8)  # those of a look that is not whole count
    assert not found.is_settled
    assert found.doubts == "2 cheaper candidates may meet the goals."


def test_a_candidate_close_to_its_limit_does_not_take_all_the_missions() -> None:
    """A costlier one is found to meet the goal before many seeds are flown of who may not."""
    values, candidates = sampler([0.99, 0.5]), [Choice(1, [0.9]), Choice(2, [0.5])]
    found = select(candidates, limited(values, 40), METRE, zone=0.0)
    assert found.answer == 1
    assert found.verdicts == ("needs more missions", "met")
    assert select(candidates, values, METRE, zone=0.0).missions[0] == 128


def test_rivals_that_a_budget_or_seeds_leave_open_are_told() -> None:
    found = chosen([0.5, 0.5], [1, 1], most_seeds=12, zone=0.01)
    assert found.verdicts == ("met", "met")
    assert not found.is_settled
    assert found.doubts == "1 rival of equal cost may be better: not settled with 12 seeds."
    some = limited(sampler([0.5, 0.5]), 20)
    found = select([Choice(1)] * 2, some, METRE, zone=0.01)
    assert found.answer is not None
    assert found.doubts == "1 rival of equal cost may be better."


def test_a_sampler_that_ends_early_ends_the_selection() -> None:
    found = select([Choice(1), Choice(2)], limited(sampler([0.5, 0.6]), 3), METRE)
    assert found.answer is None
    assert found.verdicts == ("needs more missions", "not flown")
    assert found.doubts == "2 candidates may meet the goals."
    assert found.missions == (3, 0)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"confidence": 1.0}, "confidence must lie in"),
        ({"zone": -0.1}, "zone must be a share of the goal"),
        ({"most_seeds": 4}, "most_seeds must be at least 8"),
    ],
)
def test_settings_that_make_no_sense_are_refused(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        chosen([1.0], [1.0], **settings)


def test_candidates_that_cannot_be_compared_are_refused() -> None:
    with pytest.raises(ValueError, match="needs one candidate"):
        select([], sampler([]), METRE)
    with pytest.raises(ValueError, match="candidate 1: needs a cost"):
        select([Choice(1), Choice(float("inf"))], sampler([1, 1]), METRE)
    with pytest.raises(ValueError, match="candidate 0: needs one prediction for each goal"):
        select([Choice(1, [1.0, 2.0])], sampler([1]), METRE)


MEANS = st.lists(st.sampled_from([0.4, 0.7, 0.9, 0.98, 1.05, 1.3, 2.0]), min_size=1, max_size=5)


@given(MEANS, st.randoms(use_true_random=False))
def test_the_order_of_candidates_of_unlike_cost_does_not_matter(
    means: list[float], rng: Any
) -> None:
    order = list(range(len(means)))
    rng.shuffle(order)
    values = sampler(means)
    straight = select([Choice(n) for n in range(len(means))], values, METRE, most_seeds=32)

    def sample(pairs: Pairs) -> Floats:
        return values([(order[it], n) for it, n in pairs])

    shuffled = select([Choice(n) for n in order], sample, METRE, most_seeds=32)
    assert straight.answer == (None if shuffled.answer is None else order[shuffled.answer])
    assert [straight.verdicts[n] for n in order] == list(shuffled.verdicts)


@given(MEANS, st.floats(0.5, 0.9), st.floats(0.91, 0.999))
def test_more_confidence_takes_more_missions_and_tells_nothing_else(
    means: list[float], less: float, more: float
) -> None:
    for mean in means:
        bold = chosen([mean], [1], confidence=less, most_seeds=32)
        sure = chosen([mean], [1], confidence=more, most_seeds=32)
        assert bold.missions[0] <= sure.missions[0]
        if bold.missions == sure.missions and sure.answer is not None:
            assert bold.answer is not None


@given(MEANS, st.floats(0.1, 10.0))
def test_the_unit_of_a_goal_does_not_matter(means: list[float], unit: float) -> None:
    candidates = [Choice(n // 2) for n in range(len(means))]
    values = sampler(means)
    plain = select(candidates, values, METRE, most_seeds=32)
    goal = Goal("position_error_p95_m", below=unit)
    scaled = select(candidates, lambda pairs: unit * values(pairs), [goal], most_seeds=32)
    assert (plain.answer, plain.missions) == (scaled.answer, scaled.missions)


@given(st.floats(0.3, 1.5), st.floats(0.01, 0.5))
def test_an_easier_goal_is_met_by_whoever_meets_a_harder_one(limit: float, easier: float) -> None:
    """With the same missions; how many are flown depends on the goal, so all are at one look."""

    def verdict(below: float) -> str:
        goal = Goal("position_error_p95_m", below=below)
        return select([Choice(1)], sampler([0.8]), [goal], most_seeds=8).verdicts[0]

    if verdict(limit) == "met":
        assert verdict(limit + easier) == "met"
