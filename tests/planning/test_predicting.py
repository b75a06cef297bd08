"""The error of each AUV predicted: against what the program says elsewhere, and simulations."""

from typing import Any

import numpy as np
import pytest
from plans_for_tests import error_map, inputs_of, predict
from predicted_for_tests import compared

from bindusbl_des import Scenario, Setup
from bindusbl_des.apps.planning.prediction.rounds import planned_rounds, turns_of
from bindusbl_des.apps.planning.prediction.sights import located, seen
from bindusbl_des.apps.planning.relief import IMPROVED, improved
from bindusbl_des.apps.preflight.fix_chance import fix_chance
from bindusbl_des.apps.preflight.round_lengths import rounds_of

SMALL: dict[str, Any] = {"name": "m", "survey": {"side_m": 60.0}, "auvs": {"count": 4}}


def scenario(**keys: Any) -> Scenario:
    return Scenario.model_validate({"name": "m", **keys})


@pytest.mark.parametrize(
    "keys",
    [
        {},
        {"acoustics": {"hf": {"channel": "sonar"}}},
        {"acoustics": {"loss": {"law": "head"}, "hf": {"range_metric": "slant"}}},
        {"protocol": {"broadcaster": "nearest"}},
        {"protocol": {"downlink": "direct_reply"}},
        {"protocol": {"ranging": "twtt"}, "acoustics": {"loss": {"law": "head"}}},
    ],
)
def test_chances_of_a_fix_are_those_of_the_map_of_a_survey(keys: dict[str, Any]) -> None:
    own = scenario(auvs={"count": 2}, **keys)
    stations = np.array(Setup(own).stations_m)
    inputs = inputs_of(Setup(own))
    ways, sights = inputs.ways, seen(inputs, stations)
    found = located(inputs, sights)[:, :, 0]
    if own.protocol.downlink != "direct_reply":
        told = sights.delivered.mean(axis=2)
        if own.protocol.broadcaster == "nearest":
            nearest = sights.level_m.argmin(axis=2)[:, :, None]
            told = np.take_along_axis(sights.delivered, nearest, axis=2)[:, :, 0]
        found = found * told
    places = np.concatenate((ways.places_m[0], np.full((len(ways.times_s), 1), 10.0)), axis=1)
    exact = fix_chance(Setup(own), stations, places)
    assert exact is not None
    assert found[0] == pytest.approx(exact, abs=2e-3)


@pytest.mark.parametrize(
    "keys",
    [
        {},
        {"downlink": "pipelined_round"},
        {"downlink": "pipelined_group"},
        {"downlink": "direct_reply"},
        {"ranging": {"model": "twtt", "turnaround_s": 0.2}},
        {"ranging": "passive"},
        {"tick_rate_hz": 30.0},
    ],
)
def test_rounds_are_as_long_as_preflight_says(keys: dict[str, Any]) -> None:
    """One ASV that hears all four AUVs: as many groups as AUVs, and fixes as pings."""
    own = scenario(survey={"side_m": 60.0}, auvs={"count": 4}, asvs={"count": 1}, protocol=keys)
    inputs = inputs_of(Setup(own))
    plan = planned_rounds(inputs, seen(inputs, np.zeros((1, 2))))
    passive = keys.get("ranging") == "passive"
    length = rounds_of(Setup(own)).period(1 if passive else 4, 4)
    assert plan.period_s == pytest.approx(np.full(len(plan.period_s), length))


def test_a_broadcaster_that_rotates_reaches_an_auv_in_its_turn() -> None:
    own = scenario(**{**SMALL, "name": "m"}, acoustics={"mf": {"range_m": 60.0}})
    inputs, stations = inputs_of(Setup(own)), np.array([[0.0, 0.0], [200.0, 0.0]])
    sights = seen(inputs, stations)
    turns = turns_of(inputs, sights, planned_rounds(inputs, sights))
    assert not turns.chance[:, 1::2].any()
    assert turns.chance[:, ::2].mean() > 0.9


@pytest.mark.parametrize(
    ("keys", "within"),
    [
        ({"asvs": {"count": 1}}, 0.2),
        ({"survey": {"side_m": 140.0}, "asvs": {"count": 2}}, 0.2),
        ({"navigation": {"filter": "fixed_gain"}}, 0.1),
        ({"navigation": {"filter": "dead_reckoning"}}, 0.05),
        ({"protocol": {"ranging": "passive"}}, 0.25),
    ],
)
def test_errors_are_about_those_of_missions(keys: dict[str, Any], within: float) -> None:
    """Three seeds each scatter by a tenth themselves."""
    found = compared({**SMALL, "asvs": {"count": 2}, **keys}, seeds=3)
    predicted, simulated = found.worst("position_error_m")
    assert predicted == pytest.approx(simulated, rel=within)
    for metric, own in (("fix_rate_hz", 0.02), ("fix_age_mean_s", 0.15), ("hf_coverage", 0.02)):
        exact = found.simulated[metric].mean(axis=0)
        assert getattr(found.predicted, metric) == pytest.approx(exact, rel=own, abs=0.01)


@pytest.mark.parametrize("broadcaster", ["nearest", "most_fixes"])
@pytest.mark.parametrize("schedule", ["one_per_slot", "spatial_reuse"])
def test_groups_with_a_frame_of_their_own_have_a_sender_of_their_own(
    schedule: str, broadcaster: str
) -> None:
    """Over 200 m one ASV that sends for all would leave AUVs without any fix, 4 m off."""
    found = compared(
        {
            "name": "wide",
            "duration_s": 600.0,
            "survey": {"side_m": 200.0},
            "auvs": {"count": 6},
            "asvs": {"count": 3},
            "acoustics": {
                "hf": {"range_m": 90.0},
                "mf": {"range_m": 110.0},
                "loss": {"law": "none"},
            },
            "protocol": {
                "schedule": schedule,
                "downlink": "pipelined_group",
                "broadcaster": broadcaster,
            },
        },
        seeds=2,
    )
    rates = found.simulated["fix_rate_hz"].mean(axis=0)
    assert found.predicted.fix_rate_hz == pytest.approx(rates, rel=0.1, abs=0.02)


def test_an_asv_more_makes_nobody_worse_served() -> None:
    inputs = inputs_of(Setup(scenario(survey={"side_m": 140.0}, auvs={"count": 6})))
    one, two = (predict(inputs, places) for places in ([[-40.0, 0.0]], [[-40.0, 0.0], [40.0, 0.0]]))
    assert (two.hf_coverage >= one.hf_coverage).all()
    assert two.position_error_m.mean() < one.position_error_m.mean()


def test_what_is_missing_is_said() -> None:
    told = inputs_of(Setup(scenario(usbl={"outlier_share": 0.1}))).approximations
    assert [it for it in told if "Outliers" in it]
    assert inputs_of(Setup(scenario())).approximations == ()
    (deaf,) = inputs_of(Setup(scenario(protocol={"duplex": "per_node"}))).approximations
    assert "AUVs and ASVs are taken to hear while they send" in deaf
    lagging = {"filter": {"model": "smoother", "lag_s": 5.0}}
    (late,) = inputs_of(Setup(scenario(navigation=lagging))).approximations
    assert late == "A smoother that waits for 5 s is taken to know all later fixes."
    nearest = {"protocol": {"broadcaster": "nearest"}, "acoustics": {"loss": {"law": "head"}}}
    (chosen,) = inputs_of(Setup(scenario(**nearest))).approximations
    assert chosen.startswith("nearest is taken to choose the ASV that it chooses most often")
    channel = {"model": "disc", "burst_s": 4.0}
    told = inputs_of(Setup(scenario(acoustics={"hf": {"channel": channel}}))).approximations
    assert [it for it in told if it.startswith("Losses that last 4 s are taken to come one by one")]


def test_fixes_that_wait_for_rounds_are_not_predicted() -> None:
    """Of three fixes a round a message holds one: errors grow many times as large."""
    mf = {"payload_bytes": 24, "overfull": "oldest_first"}
    with pytest.raises(ValueError, match=r"^acoustics.mf.overfull: fixes that wait ever longer"):
        inputs_of(Setup(scenario(acoustics={"mf": mf})))
    assert (
        inputs_of(Setup(scenario(acoustics={"mf": {**mf, "payload_bytes": 80}}))).duration_s > 0.0
    )


def test_what_would_help_leaves_clocks_as_wrong_as_they_are() -> None:
    """In metres, where ranges are doubled or slots halved by twice the speed of sound."""
    inputs = inputs_of(Setup(scenario(navigation={"clock_offset_sd_s": 0.002})))
    off = {
        what: it.systematic.clock_s * it.slots.sound_speed_m_per_s
        for what, _, divisors in IMPROVED
        for it in (improved(inputs, divisors),)
    }
    now = inputs.systematic.clock_s * inputs.slots.sound_speed_m_per_s
    assert now > 2.0
    assert off == pytest.approx({**dict.fromkeys(off, now), "fix_noise": now / 2})


def test_a_map_says_what_an_auv_settles_at_that_stays() -> None:
    """Beside the same prediction for AUVs that hold there: they begin with a bias to learn."""
    spots = [[0.0, 0.0], [30.0, 10.0], [40.0, 40.0], [0.0, -60.0]]
    own = scenario(
        duration_s=900.0, auvs={"count": 4, "route": {"kind": "hold", "positions_m": spots}}
    )
    inputs, stations = inputs_of(Setup(own)), Setup(own).stations_m
    found = error_map(inputs, stations, spots)
    assert found.error_m == pytest.approx(predict(inputs, stations).position_error_m, rel=0.12)
    assert found.chance == pytest.approx([1.0, 1.0, 2 / 3, 2 / 3])


def test_where_no_fix_comes_a_map_says_how_far_dead_reckoning_drifts() -> None:
    inputs = inputs_of(Setup(scenario()))
    found = error_map(inputs, [[0.0, 0.0]], [[500.0, 0.0]])
    assert found.chance[0] == 0.0
    assert found.error_m[0] == pytest.approx(0.06 * np.sqrt(2) * 150.0, rel=0.02)
