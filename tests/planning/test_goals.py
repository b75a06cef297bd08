"""Goals: which are refused and why, and what a mission's value is."""

import numpy as np
import pytest
from plans_for_tests import Goal

from bindusbl_des.apps.planning.goals import goal_of, goals_in

NAN = float("nan")


@pytest.mark.parametrize(
    ("written", "message"),
    [
        ("position_error_p95=1", r"no metric 'position_error_p95'; did you mean '.*p95_m'\?"),
        ("worst_latency_mean=1", r"did you mean 'latency_mean_s'\?"),
        ("error=2", r"^no metric 'error'; did you mean 'position_error_m'\?"),
        ("crew=1", r"^no metric 'crew'; metrics are columns of the tables auvs and mission"),
        (
            "position_error_m",
            r"^'position_error_m': needs METRIC=VALUE, such as position_error_p95_m=1",
        ),
        ("position_error_m=deep", r"needs METRIC=VALUE"),
        ("position_error_m=nan", r"^position_error_m must be a number; met nan"),
        ("position_error_m=-1", r"^position_error_m must be 0 or more .*; met -1"),
        ("hf_coverage=0.9", r"hf_coverage: more of it is better; ask for above 0\.9"),
    ],
)
def test_what_is_no_goal_is_refused_with_a_remedy(written: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        goal_of(written)


def test_a_metric_that_is_better_when_small_has_no_lower_limit() -> None:
    with pytest.raises(ValueError, match=r"fix_age_p95_s: less of it is better; ask for below 3$"):
        goal_of("fix_age_p95_s=3", is_below=False)
    assert goal_of("distance_m=3", is_below=False).above == 3  # neither good nor bad
    assert goal_of("area_covered_share=0.9", is_below=False).above == 0.9


@pytest.mark.parametrize(
    ("metric", "less"),
    [
        *(("energy_j", True), ("energy_per_fix_j", True), ("survey_finished_at_s", True)),
        *(("fix_latency_p50_s", True), ("fix_latency_p95_s", True), ("position_error_m", True)),
        *(("area_covered_m2", False), ("fairness", False), ("throughput_bps", False)),
    ],
)
def test_a_limit_is_on_the_side_where_a_metric_is_good(metric: str, less: bool) -> None:
    assert goal_of(f"{metric}=0.5", is_below=less).metric == metric
    with pytest.raises(ValueError, match=f"{metric}: {'less' if less else 'more'} of it is better"):
        goal_of(f"{metric}=0.5", is_below=not less)


@pytest.mark.parametrize(
    ("written", "message"),
    [
        ("position_error_m", r"^goal: needs keys and values, such as .*; got the text"),
        ([], r"^goal: needs keys and values, .*; got a list"),
        ([{"metric": "hf_coverage", "over": 1}], r"^goal\[0\]: no key 'over'"),
        ({"metric": "hf_coverage", "abov": 1}, r"did you mean 'above'\?"),
        ({"below": 1}, r"^goal.metric: needs the name of a metric"),
        ({"metric": "position_error_m"}, r"^goal: .* needs either below or above; got neither"),
        ({"metric": "pings", "below": 1, "above": 0}, r"needs either below or above; got both"),
        (
            {"metric": "position_error_m", "below": "1 m"},
            r"^goal.below: needs a number; got the te",
        ),
        ({"metric": "position_error_m", "below": True}, r"^goal.below: needs a number; got true"),
        ({"metric": "position_error_m", "below": 1, "of": "best"}, r"of must be worst, mean, or a"),
        ({"metric": "position_error_m", "below": 1, "of": 1.5}, r"of must be .*; met 1\.5; leave"),
        ({"metric": "position_error_m", "below": 1, "of": []}, r"^goal.of: needs worst, mean or"),
    ],
)
def test_goals_of_a_file_name_the_key_that_is_wrong(written: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        goals_in(written)


def test_goals_are_read_as_they_were_written() -> None:
    goals = (
        Goal("position_error_p95_m", below=1.0),
        Goal("hf_coverage", above=0.9, of="mean"),
        Goal("fix_age_p95_s", below=30.0, of=0.9),
    )
    assert goals_in([goal.record() for goal in goals]) == goals
    assert goals_in({"metric": "rounds", "above": 3}) == (Goal("rounds", above=3.0),)
    assert str(goals[2]) == "fix_age_p95_s of 90 % of the AUVs at most 30"
    assert str(Goal("rounds", above=3.0)) == "rounds at least 3"


def test_a_mission_is_as_good_as_the_auv_that_is_judged() -> None:
    errors = np.array([[1.0, 5.0, 2.0], [3.0, 3.0, 3.0], [1.0, NAN, 2.0]])
    worst = Goal("position_error_m", below=1)
    assert worst.of_fleets(errors).tolist()[:2] == [5, 3]
    assert np.isnan(worst.of_fleets(errors)[2])
    least = Goal("hf_coverage", above=1)
    assert least.of_fleets(errors).tolist()[:2] == [1, 3]
    assert np.isnan(least.of_fleets(errors)[2])
    mean = Goal("position_error_m", below=1, of="mean").of_fleets(errors)
    assert mean[0] == pytest.approx(8 / 3)
    assert np.isnan(mean[2])


@pytest.mark.parametrize(("share", "last"), [(0.1, 1), (0.5, 5), (0.51, 6), (0.9, 9), (1.0, 10)])
def test_a_share_of_the_auvs_is_judged_by_the_last_of_them(share: float, last: int) -> None:
    auvs = np.arange(1.0, 11.0)[None, :]
    assert Goal("position_error_m", below=1, of=share).of_fleets(auvs) == [last]
    assert Goal("hf_coverage", above=1, of=share).of_fleets(auvs) == [11 - last]


def test_auvs_beyond_the_share_may_be_without_a_value() -> None:
    fleet = np.array([[1.0, 2.0, NAN]])
    assert Goal("latency_mean_s", below=1, of=0.6).of_fleets(fleet) == [2]
    assert np.isnan(Goal("latency_mean_s", below=1, of=0.9).of_fleets(fleet)[0])
