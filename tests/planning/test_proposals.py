"""Which schedules and downlinks are proposed for a team."""

from pathlib import Path
from typing import Any

import pytest
from plans_for_tests import Asking, Goal, read_plan

from bindusbl_des import ScenarioError, load_scenario
from bindusbl_des.apps.campaigns.experiments.options import PythonArguments
from bindusbl_des.apps.planning.teams import proposed

SCHEDULE, DOWNLINK = "protocol.schedule", "protocol.downlink"
GOALS = (Goal("position_error_m", below=1.0),)
# Two ASVs side by side in the midst
TEAM = {"asvs.count": [2], "asvs.formation.radius_m": [5]}


def pairs(side_m: float, schedules: list[str] | None = None) -> list[tuple[str, str]]:
    """Return the schedules and downlinks proposed for a team over a square (m)."""
    scenario = load_scenario("recovery_140m", overrides=[f"survey.side_m={side_m}"])
    vary = TEAM if schedules is None else {**TEAM, SCHEDULE: schedules}
    question = read_plan(scenario, Asking(GOALS, options=PythonArguments(vary)))
    found = proposed(question, print)
    return [
        (it.keys.get(SCHEDULE, "spatial_reuse"), it.keys.get(DOWNLINK, "sequential"))
        for it in found
    ]


def test_what_a_schedule_does_not_change_is_flown_once() -> None:
    """Over 60 m the ASVs hear all AUVs always, so nobody ever pings together with another; over
    140 m some do.
    """
    near, far = pairs(60.0), pairs(140.0)
    assert {schedule for schedule, _ in near} == {"spatial_reuse"}
    assert len({downlink for _, downlink in near}) == len(near)
    assert "one_per_slot" in {schedule for schedule, _ in far}
    assert len(far) == 4


def test_schedules_that_are_asked_for_are_all_flown() -> None:
    both = ["spatial_reuse", "one_per_slot"]
    found = pairs(60.0, both)
    assert [found.count((it, "sequential")) for it in both] == [1, 1]
    assert {schedule for schedule, _ in found} == set(both)


def slots(side_m: float, *overrides: str, **vary: list[Any]) -> list[tuple[str, float | None]]:
    """Return downlinks proposed for a team over a square (m), and their shortest slots (s)."""
    scenario = load_scenario("recovery_140m", overrides=[f"survey.side_m={side_m}", *overrides])
    named = {f"protocol.{key}": values for key, values in vary.items()}
    question = read_plan(scenario, Asking(GOALS, options=PythonArguments({**TEAM, **named})))
    found = proposed(question, print)
    return [
        (it.keys.get(DOWNLINK, "sequential"), it.keys.get("protocol.shortest_downlink_slot_s"))
        for it in found
    ]


def test_downlink_slots_that_wait_for_nothing_are_shortened() -> None:
    """Ten times what sound takes across 1,000 m are 6.7 s, for a frame of half a second and a
    guard: that is proposed with downlinks that have such slots, unless the user says how long they
    are, or names the protocol; over 60 m frames and guards are longer.
    """
    far = slots(1000.0, downlink=["sequential"])
    assert ("sequential", 0.0) in far
    assert far[0] == ("sequential", None)
    every = slots(1000.0)
    assert any(shortest == 0.0 for _, shortest in every)
    assert all(shortest is None for downlink, shortest in every if downlink == "direct_reply")
    for found in (
        slots(60.0),
        slots(1000.0, "protocol.shortest_downlink_slot_s=5"),
        slots(1000.0, downlink=["sequential"], schedule=["spatial_reuse"]),
    ):
        assert {shortest for _, shortest in found} == {None}


def test_answers_without_airtime_are_never_proposed() -> None:
    """Whatever the scenario says, direct replies of a plan are frames."""
    for downlink in ("sequential", "direct_reply"):
        keys = [f"protocol.downlink={downlink}"]
        if downlink == "direct_reply":
            keys += ["protocol.downlink.reply=instant"]
        scenario = load_scenario("recovery_140m", overrides=keys)
        question = read_plan(scenario, Asking(GOALS, options=PythonArguments(TEAM)))
        found = proposed(question, print)
        assert any(it.scenario.protocol.replies for it in found) or downlink == "sequential"
        assert {it.scenario.protocol.answer.reply for it in found} == {"frame"}
        assert {it.keys.get("protocol.downlink.reply") for it in found} <= {"frame", None}


@pytest.mark.parametrize(
    ("counts", "told"),
    [
        pytest.param("1:10000", "10,000 teams", marks=pytest.mark.slow),
        ("1:500", "500 teams with 125,250 ASVs"),
    ],
)
def test_candidates_that_nobody_could_predict_are_refused(
    counts: str, told: str, tmp_path: Path
) -> None:
    """Ten thousand took minutes before the first mission, whatever the budget."""
    (tmp_path / "plan.yaml").write_text(
        "scenario: quickstart\ngoal: {metric: position_error_p95_m, below: 1}\n"
        f"candidates: {{asvs.count: '{counts}'}}\n"
    )
    with pytest.raises(ScenarioError, match=rf"plan.yaml:3:.*candidates: make {told}"):
        read_plan(tmp_path / "plan.yaml", Asking())


def test_how_far_proposing_is_is_told() -> None:
    options = PythonArguments({"asvs.count": [1, 2]})
    question = read_plan(load_scenario("quickstart"), Asking(GOALS, options=options))
    said = list[str]()
    proposed(question, said.append)
    assert said == ["proposing teams, 1 of 2 choices", "proposing teams, 2 of 2 choices"]
