"""What changes the answers without being asked for is told, with its numbers; defaults are not."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands_for_tests import call
from toggles import BASES, alternatives, columns_that_differ, modes, owners, put, toggled, value_of
from worlds import merged, scenario

import bindusbl_des
from bindusbl_des import (
    Navigator,
    Odometry,
    Scenario,
    ScenarioError,
    Setup,
    Signals,
    Sounding,
    load_result,
    load_scenario,
    simulate,
    warnings_of,
)
from bindusbl_des.apps.preflight.idle_keys import RULES, idle_keys
from bindusbl_des.apps.preflight.warnings import read_scenario

SCENARIOS = Path(__file__).parents[2] / "scenarios"

# What one of a rule's modes may change all the same.
SLIGHT = {"rounds.conflicts"}


# What does something in a mode, but not in these missions: a hull's second lane comes after their
# end, a single ASV in their midst hears every AUV, without contention hardly a ping is lost, groups
# whose fixes are broadcast apart are of one AUV, a few metres of depth part no two AUVs, and
# neighbours on strips stay neighbours.
UNSEEN = (
    ("navigation.gnss_fix.depth_m", "record.detail", "summary"),
    ("navigation.gnss_fix.sd_m", "record.detail", "summary"),
    ("auvs.route.turns", "auvs.vehicle", "bluerov2"),
    ("auvs.route.turns", "auvs.feedback", "estimate"),
    ("protocol.positions", "asvs.count", 1),
    ("protocol.positions", "auvs.vehicle", "bluerov2"),
    ("protocol.positions", "auvs.feedback", "estimate"),
    ("acoustics.loss.cap", "protocol.ranging", "passive"),
    ("acoustics.mf.payload_bytes", "protocol.downlink", "pipelined_group"),
    ("acoustics.hf.range_metric", "asvs.count", 1),
    ("acoustics.hf.range_metric", "acoustics.hf.channel", "table"),
    ("asvs.formation.hysteresis", "asvs.formation.model", "assign"),
    ("asvs.formation.hysteresis", "asvs.formation.model", "zigzag"),
    ("protocol.conflict_margin_m", "auvs.feedback", "estimate"),
    ("protocol.conflict_margin_m", "auvs.vehicle", "bluerov2"),
    ("protocol.conflict_margin_m", "asvs.formation.model", "positions"),
    ("protocol.conflict_margin_m", "protocol.schedule", "polling"),  # side_by_side heeds it
    ("protocol.conflict_margin_m", "asvs.count", 1),
    ("protocol.recall_rounds", "protocol.knowledge", "broadcast"),
    ("navigation.gnss_fix.every_s", "record.detail", "summary"),  # its table; nobody surfaces
    # All that these presets say is said beside them
    ("navigation.drift.preset", "navigation.drift", {"percent_of_distance": 2.0}),
    ("navigation.drift.preset", "navigation.drift", {"percent_of_distance": 2.0, "line_m": 50.0}),
)


def told(**changes: Any) -> dict[str, str]:
    """Return the warnings of the default scenario with changes, by their keys."""
    scenario = Scenario.model_validate({"name": "m", **changes})
    return {found.key: found.message for found in warnings_of(scenario)}


def fading(signals: Signals) -> np.ndarray:
    """A channel without an edge."""
    return 0.9 / (1.0 + (signals.ranges / 100.0) ** 4)


def compass(sounding: Sounding) -> tuple[np.ndarray, np.ndarray]:
    """An instrument with the same error along all axes."""
    off = 0.3 * sounding.random.standard_normal((len(sounding.asvs), 3))
    return sounding.source + off, np.tile(0.09 * np.eye(3), (len(off), 1, 1))


class Adrift(Navigator):
    """A filter that has heard of no fix."""

    weighs = True

    def __init__(self, reckoning: Any, auvs: int) -> None:
        pass

    def correct(self, fixes: Any, due: Any) -> None:
        pass

    def estimate(self, auv: int, odometry: Odometry) -> np.ndarray:
        return odometry.position

    def covariance(self, auv: int, odometry: Odometry) -> np.ndarray:
        return np.zeros((len(odometry.times), 3))


# Rules that hold for any part of somebody's own, or whatever is given, are tried with these.
OWN: dict[str, Any] = {
    "survey.depths_m": [4.0, 6.0, 9.0],
    "auvs.speeds_m_per_s": [0.5, 0.7, 0.6],
    "auvs.launch_m": [[3.0, -4.0]],
    "acoustics.hf.channel": "test_warnings:fading",
    "usbl.model": "test_warnings:compass",
    "navigation.filter": "test_warnings:Adrift",
    "acoustics.mf.airtimes": str(
        Path(bindusbl_des.__file__).parent / "models/presets/s2c_airtimes.csv"
    ),
}


def in_mode(data: dict[str, Any], rule: Any) -> "dict[str, Any]":
    """Return a mission in the mode of a rule."""
    for key, values in rule.mode.items():
        if value_of(data, key) not in values:
            for part in owners(key)[:1]:  # a setting asks for the part that has it
                data = put(data, key.rpartition(".")[0], part)
            data = put(data, key, values[0] if values else OWN[key])
    return data


def is_idle(data: dict[str, Any], key: str) -> bool | None:
    """Tell by experiment whether a key does nothing in a mission; None where none can be flown."""
    found = [
        columns_that_differ(data, put(data, key, value))
        for value in alternatives(key, value_of(data, key))
    ]
    known = [columns for columns in found if columns is not None]
    return all(columns <= SLIGHT for columns in known) if known else None


@pytest.mark.parametrize("share", [0.25, pytest.param(1.0, marks=pytest.mark.slow)])
@pytest.mark.parametrize("rule", RULES, ids=lambda rule: ", ".join(map(str, rule.mode.items())))
def test_idle_keys_do_nothing(rule: Any, share: float) -> None:
    """A key that a rule calls idle changes no number of a mission in that mode: of each, or, every
    day, of the first that can be flown.
    """
    bases = [{**base, "duration_s": share * base["duration_s"]} for base in BASES.values()]
    for key in rule.keys:
        tried = []
        for base in bases:
            if share == 1.0 or True not in tried:
                tried.append(is_idle(in_mode(base, rule), key))
        assert True in tried, key
        assert False not in tried, key


# What a mission may need besides, so that another rule does not warn of a key before.
BESIDES = (
    ("", None),
    ("navigation.drift.percent_of_distance", 0.5),
    ("protocol.knowledge", "broadcast"),
)


def says_so(rule: Any, key: str) -> bool:
    """Tell whether a rule warns of a key in some mission that can be flown."""
    for base in BASES.values():
        for beside, its in BESIDES:
            data = in_mode(put(base, beside, its) if beside else base, rule)
            for value in alternatives(key, value_of(data, key)):
                try:
                    scenario = Scenario.model_validate({"name": "m", **put(data, key, value)})
                except ValueError:
                    continue
                if any(
                    it.key == key and rule.why in it.message for it in idle_keys(Setup(scenario))
                ):
                    return True
    return False


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: ", ".join(map(str, rule.mode.items())))
def test_every_rule_is_told(rule: Any) -> None:
    """No rule is about keys that cannot be given, or that another rule has told of already."""
    assert any(says_so(rule, key) for key in rule.keys)


@pytest.mark.slow
@pytest.mark.parametrize(("mode", "value"), modes())
def test_every_key_that_does_nothing_is_known(mode: str, value: Any) -> None:
    """Each key is toggled in each mode: where no mission notices, a rule says so."""
    bases = [put(base, mode, value) for base in BASES.values()]
    unseen = {key for key, at, its in UNSEEN if (at, its) == (mode, value)}
    for key in set(toggled()) - {mode} - unseen:
        tried = {
            n: idle for n, base in enumerate(bases) if (idle := is_idle(base, key)) is not None
        }
        if not tried or not all(tried.values()):
            continue
        for number in tried:
            given = put(bases[number], key, alternatives(key, value_of(bases[number], key))[0])
            scenario = Scenario.model_validate({"name": "m", **given})
            assert key in {found.key for found in idle_keys(Setup(scenario))}, (
                f"{key} with {mode}={value}"
            )


@pytest.mark.parametrize(("reply", "idle"), [("instant", 6), ("frame", 1)])
def test_direct_replies_leave_keys_without_effect(reply: str, idle: int) -> None:
    """The keys of frames do nothing where answers are none; each is told if it was set."""
    asked = {
        "asvs": {"count": 1},
        "protocol": {"downlink": {"model": "direct_reply", "reply": reply}, "broadcaster": "fixed"},
        "acoustics": {
            "mf": {
                "range_m": 9.0,
                "bit_rate_bps": 9.0,
                "overhead": 9.0,
                "header_bytes": 9,
                "fix_bytes": 9,
            }
        },
    }
    found = {
        key: text
        for key, text in told(**asked).items()
        if f"no effect with protocol.downlink: direct_reply, protocol.downlink.reply: {reply}"
        in text
    }
    assert "protocol.broadcaster" in found
    assert len(found) == idle


def test_a_downlink_that_cannot_carry_all_fixes_is_warned_of() -> None:
    """Six AUVs of ALOHA: 13.9 fixes a second, the downlink carries 7.8, so that the last come
    300 s (1 - 7.8 / 13.9) = 131 s late; a simulated one's latest is 122 s late.
    """

    def crowded(*keys: str) -> Scenario:
        crowd = ["auvs.count=6", "auvs.vehicle.turning_radius_m=3", "protocol.schedule=aloha"]
        return load_scenario("recovery_140m", overrides=[*crowd, "protocol.frame_s=0.3", *keys])

    def warned(scenario: Scenario) -> str:
        return {found.key: found.message for found in warnings_of(scenario)}.get(
            "protocol.frame_s", ""
        )

    told = warned(crowded())
    assert "carries 7.8 fixes a second at most, and about 13.9 are made" in told
    assert "by 300 s come about 131 s late" in told
    mission = simulate(crowded("record.detail=summary"), 1).mission.iloc[0]
    assert mission.latency_max_s == pytest.approx(131.0, rel=0.15)
    assert mission.fix_age_max_s > mission.latency_max_s
    for few in ("protocol.frame_s=1", "protocol.downlink=direct_reply"):
        assert warned(crowded(few)) == ""


def test_answers_to_auvs_that_share_a_slot_are_warned_of() -> None:
    """Three ASVs 86.6 m apart, MF range 100 m: between two of them both are heard."""
    shared = {"downlink": "direct_reply"}
    found = told(protocol=shared)
    assert "between ASVs 86.6 m apart an AUV hears both" in found["protocol.downlink"]
    assert "protocol.downlink" not in told(protocol=shared, acoustics={"mf": {"range_m": 43.0}})
    instant = {"downlink": {"model": "direct_reply", "reply": "instant"}}
    for alone in ({"schedule": "one_per_slot"}, instant, {"schedule": "polling"}):
        assert "protocol.downlink" not in told(protocol={**shared, **alone})


def test_held_auvs_leave_three_keys_without_effect() -> None:
    """How fast and tightly AUVs go that lie still is told to be of no effect."""
    route = {"kind": "hold", "positions_m": [[0, 0]]}
    auvs = {
        "count": 1,
        "route": route,
        "speed_m_per_s": 1.0,
        "vehicle": {"model": "kinematic", "turning_radius_m": 1.0},
    }
    found = told(auvs={**auvs, "join_angle_deg": 10.0})
    assert set(found) == {
        f"auvs.{k}" for k in ("speed_m_per_s", "vehicle.turning_radius_m", "join_angle_deg")
    }


def test_nobody_is_nagged_for_defaults() -> None:
    """Keys that are not in the file are not told, nor defaults that the program wrote out."""
    assert told() == {}
    written = Scenario(name="m", protocol={"frame_s": 1.0})
    assert [found.key for found in warnings_of(written)] == ["protocol.frame_s"]
    assert warnings_of(Scenario.model_validate(written.model_dump(mode="json"))) == []


def test_the_default_formation_may_lie_outside_the_survey() -> None:
    """R_f = 50 m around a survey of 60 m: three ASVs outside, 20 m beyond the edge."""
    found = told(survey={"side_m": 60.0})["asvs.formation.radius_m"]
    assert "= 50 m, which puts 3 of 3 ASVs outside the survey, up to 20 m beyond its edge" in found
    short = {"survey": {"side_m": 60.0}, "duration_s": 240.0}
    assert told(**short, asvs={"formation": {"radius_m": 50.0}}) == {}
    assert told(**short, asvs={"count": 1}) == {}
    turned = {"count": 2, "formation": {"angle_deg": 60.0, "clearance_m": 10.0}}
    found = told(survey={"side_m": 60.0}, asvs=turned)["asvs.formation.radius_m"]
    assert "= 60 m, which puts 2 of 2 ASVs outside the survey, up to 22 m beyond its edge" in found


@pytest.mark.parametrize("vehicle", ["kinematic", "bluerov2"])
def test_a_mission_that_is_longer_than_its_survey_says_so(vehicle: str) -> None:
    """By how much, and what ends with it; not where lanes fill it, or it ends with them."""
    keys: dict[str, Any] = {"survey": {"side_m": 60.0}, "auvs": {"vehicle": vehicle}}
    ends = merged(keys, {"duration_s": "survey"})
    ended = scenario(**ends).duration_s

    def said(duration: Any, **more: Any) -> str:
        return told(**merged(merged(keys, {"duration_s": duration}), more)).get("duration_s", "")

    found = said(5000.0)
    assert found.startswith(f"is 1:23 h, and the survey is flown after {ended:.0f} s: in the other")
    minutes = round((5000.0 - ended) / 60.0)
    assert f"other {minutes // 60}:{minutes % 60:02} h AUVs go there and back once more" in found
    assert found.endswith("write `duration_s: survey` to end with it")
    assert "wait where they are recovered" in said(5000.0, auvs={"recovery_m": [[0.0, 0.0]] * 3})
    assert said(1.07 * ended)
    assert not said(1.04 * ended)
    assert not said("survey")
    assert not said(0.5 * ended)
    there = [[[0.0, -20.0], [0.0, 20.0]]] * 3
    assert not said(5000.0, auvs={"route": {"kind": "waypoints", "points_m": there}})


def test_auvs_that_run_empty_before_their_survey_is_flown_are_told() -> None:
    """With what they can, what they need, and what to do; one that suffices is not mentioned."""
    base: dict[str, Any] = {"duration_s": "survey", "auvs": {"speed_m_per_s": 0.2}}
    lanes = Setup(Scenario.model_validate({"name": "m", **base})).flown_s
    assert max(lanes) > 3000.0
    short, enough = 1800.0, max(lanes) + 1.0

    def said(can: float, **changes: Any) -> str | None:
        auvs = {**base["auvs"], "endurance_s": can}
        return told(**{**base, "auvs": auvs, **changes}).get("auvs.endurance_s")

    found = said(short)
    assert found is not None
    assert "is 0:30 h, and AUV0, AUV1, AUV2 are through with the lanes after 0:5" in found
    assert said(enough) is None
    longer = said(enough, duration_s=20_000.0)
    assert longer is not None
    assert "the mission takes 5:33 h; all lanes are flown after 0:5" in longer
    assert "write `duration_s: survey`" in longer


def test_vessels_too_far_away_to_hear_anybody_are_told() -> None:
    """A square of 200 m, HF reaches 50 m: who is 150 m from its middle is heard at the edge."""
    square = {"side_m": 200.0}

    def formation(**how: Any) -> dict[str, str]:
        return told(survey=square, asvs={"count": 2, "formation": how})

    found = formation(positions_m=[[0.0, 0.0], [0.0, 5000.0]])["asvs.formation.positions_m"]
    assert found.startswith("ASV1 is up to 4900 m beyond the edge of the survey, HF reaches 50 m")
    assert "ASV0, ASV1 are up to 50.1 m" in formation(radius_m=150.1)["asvs.formation.radius_m"]
    assert formation(radius_m=150.0) == {}


def test_vessels_that_cannot_be_where_auvs_are_are_told() -> None:
    """Slower than AUVs, or without any fix that the fleet knows of."""
    slow = {"count": 1, "formation": {"model": "follow", "speed_m_per_s": 0.5}}
    found = told(asvs=slow, protocol={"ranging": "passive"})
    assert "is 0.5 m/s and AUVs go at 0.627 m/s" in found["asvs.formation.speed_m_per_s"]
    assert "goes by what is planned alone" in found["asvs.formation.model"]
    assert told(asvs={"count": 1, "formation": {"model": "follow"}}) == {}


def test_auvs_that_no_asv_in_reach_sends_for_are_told() -> None:
    """Turns of ASVs that keep in step with those of AUVs; what is said to help does."""

    def told(count: int, **protocol: str) -> list[str]:
        places = [[0, 60], [0, 0], [0, -60], [60, 0]][:count]
        small = Scenario.model_validate(
            {
                "name": "m",
                "survey": {"side_m": 140},
                "auvs": {"count": 3},
                "asvs": {"count": count, "formation": {"positions_m": places}},
                "acoustics": {"hf": {"range_m": 100}, "mf": {"range_m": 70}},
                "protocol": {"schedule": "round_robin", "frame_s": 2.0, **protocol},
            }
        )
        fixes = simulate(small, 0).auvs.fixes_delivered
        found = [str(it) for it in warnings_of(small) if it.key == "protocol.broadcaster"]
        assert bool(found) == (0 in set(fixes))
        return found

    (warning,) = told(3)
    assert "AUV0, AUV2 are" in warning
    assert "use random, nearest or parallel, or 4 ASVs" in warning
    assert told(3, schedule="one_per_slot", downlink="pipelined_group")
    assert told(4) == told(3, broadcaster="nearest") == told(3, downlink="direct_reply") == []
    assert told(3, schedule="random") == told(3, schedule="one_per_slot") == []


def test_frames_that_tell_slots_and_fixes_by_turns_are_told_as_the_cause() -> None:
    """Whoever pings by itself in a frame: another number of ASVs would not help."""
    held = {"kind": "hold", "positions_m": [[-60, 0], [60, 0]]}
    found = told(
        survey={"side_m": 140.0},
        auvs={"count": 2, "route": held},
        asvs={"count": 2, "formation": {"positions_m": [[-60, 10], [60, 10]]}},
        acoustics={"hf": {"range_m": 100}, "mf": {"range_m": 60}},
        protocol={"schedule": "round_robin", "knowledge": "broadcast", "frame_s": 2.0},
    )["protocol.broadcaster"]
    assert "one ASV tell AUVs their slots and another their fixes: AUV0, AUV1 are" in found
    assert "ASVs" not in found.partition("use random")[2]


@pytest.mark.parametrize("downlink", ["sequential", "pipelined_round"])
def test_slots_that_are_told_too_late_are_told(downlink: str) -> None:
    """A modem hands frames over when the first slot has begun; as long a guard as is said helps."""

    def flown(auvs: int = 3, **further: Any) -> tuple[dict[str, str], list[int]]:
        bands = {"hf": {"range_m": 150.0}, "mf": {"modem": "s2c_instant", "range_m": 150.0}}
        protocol = {"schedule": "one_per_slot", "downlink": downlink, "knowledge": "broadcast"}
        given = {
            "auvs": {"count": auvs}, "asvs": {"count": 1}, "acoustics": bands,
            "protocol": {**protocol, **further},
        }  # fmt: skip
        asked = Scenario.model_validate({"name": "m", **given})
        return told(**given), simulate(asked, 0).auvs.slots_missed.tolist()

    found, missed = flown()
    assert "AUV0 is told of a first slot too late" in found["protocol.knowledge"]
    assert missed[0] > 20 > max(missed[1:])
    guard = float(found["protocol.knowledge"].partition("downlink_guard_s ")[2].split()[0])
    packed = {"schedule": "super_tdma", "shortest_uplink_slot_s": 5.0}  # which has no such slots
    several = {"auvs": 6}  # the first frame of each broadcast tells of the first slot
    for enough in ({"downlink_guard_s": guard}, {**packed, "downlink_guard_s": guard}, several):
        found, missed = flown(**enough)
        assert "protocol.knowledge" not in found
        assert max(missed) < 5


@pytest.mark.parametrize(("range_m", "idle"), [(170.0, True), (180.0, False)])
def test_duplex_matters_where_frames_outlast_their_slot(range_m: float, idle: bool) -> None:
    """The guard of a survey of 140 m is the way of sound over 175 m."""
    found = told(acoustics={"mf": {"range_m": range_m}}, protocol={"duplex": "per_node"})
    assert ("has no effect" in found.get("protocol.duplex", "")) == idle


FAR_APART: dict[str, Any] = {
    "survey": {"side_m": 60.0},
    "auvs": {"count": 2},
    "asvs": {"count": 2, "formation": {"positions_m": [[0, 0], [150, 0]]}},
    "acoustics": {"hf": {"range_m": 160.0}, "mf": {"range_m": 300.0}},
}


def test_frames_that_meet_are_told() -> None:
    """ASVs far apart broadcast behind one another; as long a guard as is said parts them."""

    def met(**protocol: Any) -> tuple[str, int]:
        given = {**FAR_APART, "protocol": {"downlink": "pipelined_round", **protocol}}
        lost = simulate(Scenario.model_validate({"name": "m", "duration_s": 60.0, **given}))
        return told(**given).get("protocol.downlink", ""), lost.auvs.frame_collisions.sum()

    found, collisions = met()
    assert "AUV0, AUV1 are where both overlap" in found
    assert collisions > 10
    guard = float(found.partition("downlink_guard_s ")[2].split()[0])
    assert met(downlink_guard_s=guard) == ("", 0)
    assert met(broadcaster="fixed") == ("", 0)


@pytest.mark.parametrize(
    ("key", "given", "words"),
    [
        ("protocol.duplex", {"protocol": {"downlink": "pipelined_round", "duplex": "per_node"}},
         "uplink and downlink overlap"),
        ("protocol.positions", {"protocol": {"ranging": "twtt", "positions": "last_fix"}},
         "called in vain until it returns"),
        ("survey.depth_m", {"survey": {"side_m": 60.0, "depth_m": 200.0},
                            "acoustics": {"hf": {"range_m": 160.0, "range_metric": "slant"}}},
         "AUV0, AUV1 are deeper than the HF range, 160 m slant"),
        ("acoustics.hf.channel.bottom_m", {
            "acoustics": {"hf": {"range_m": 160.0, "channel": {"model": "sonar", "bottom_m": 30}}},
            "navigation": {"filter": "kalman"}}, "give surface_sd_m"),
        ("protocol.frame_s", {"protocol": {
            "schedule": "aloha", "frame_s": 0.015, "downlink": "direct_reply"}}, "meet no other"),
    ],
)  # fmt: skip
def test_what_would_serve_nobody_is_told(key: str, given: dict[str, Any], words: str) -> None:
    assert words in told(**{**FAR_APART, **given})[key]
    assert key not in told(**FAR_APART, protocol={"downlink": "sequential", "broadcaster": "fixed"})


@pytest.mark.parametrize("frame", [0.5, 1.0, 1.1])
def test_a_frame_shorter_than_its_round_is_told(frame: float) -> None:
    """0.5, 1.0 and 1.1 s give the same mission, and each is told what its AUVs do instead."""
    protocol = {"schedule": "round_robin", "tick_rate_hz": 30.0, "frame_s": frame}
    found = told(protocol=protocol)["protocol.frame_s"]
    assert f"takes 1.167 s, longer than the frame of {frame:g} s" in found
    assert f"every 3.5 s, not every {3 * frame:.4g} s" in found
    pings = simulate(Scenario.model_validate({"name": "m", "protocol": protocol})).tables["pings"]
    assert pings[pings.auv == "AUV0"].sent_at_s.diff().dropna().round(6).eq(3.5).all()
    assert "protocol.frame_s" not in told(protocol={**protocol, "frame_s": 1.2})


def test_a_frame_that_only_empty_rounds_fit_is_told() -> None:
    """Where fixes make a round longer than its frame, the frames after them are late."""
    slow = {"mf": {"bit_rate_bps": 400.0}}
    found = told(acoustics=slow, protocol={"schedule": "round_robin", "frame_s": 1.2})
    assert (
        "a round with a fix takes 1.31 s, longer than the frame of 1.2 s"
        in found["protocol.frame_s"]
    )


def test_few_samples_and_long_ticks_are_told() -> None:
    """A mean over one instant, and a tick longer than the slot that it rounds."""
    found = told(record={"metrics_hz": 1e-6})["record.metrics_hz"]
    assert "time means are of 1 instant (300 s x 1e-06 Hz)" in found
    found = told(protocol={"tick_rate_hz": 0.1})["protocol.tick_rate_hz"]
    assert found == "ticks of 10 s make the uplink slot of 0.233 s as long as a tick"


def test_places_outside_the_survey_are_told() -> None:
    """AUVs that hold or go to places beyond the survey's edge, by how much."""
    held = {"count": 2, "route": {"kind": "hold", "positions_m": [[0, 0], [0, -80]]}}
    assert told(auvs=held)["auvs.route.positions_m"].startswith(
        "AUV1 is outside the survey of 140 m, up to 10 m beyond its edge"
    )
    corner = [45.98076211353316, -19.641016151377542]  # beyond the edge by rounding
    turned = {"side_m": None, "size_m": [60.0, 80.0], "rotation_deg": 30.0}
    on_it = {"count": 1, "route": {"kind": "hold", "positions_m": [corner]}}
    assert "auvs.route.positions_m" not in told(survey=turned, auvs=on_it)
    many = [[[0, 0], [100, 0]]] * 7
    found = told(auvs={"count": 7, "route": {"kind": "waypoints", "points_m": many}})
    assert "AUV4 and 2 more are outside" in found["auvs.route.points_m"]


def track(folder: Path, *rows: str) -> Path:
    """Write a track and a scenario of 100 s that repeats it; return the scenario's file."""
    (folder / "dive.csv").write_text("\n".join(["time_s,x_m,y_m,depth_m", *rows]))
    file = folder / "f.yaml"
    file.write_text(
        "name: m\nduration_s: 100\nauvs: {count: 1, route: {kind: track, files: [dive.csv]}}\n"
    )
    return file


def test_a_track_in_unix_time_is_refused_with_its_offset(tmp_path: Path) -> None:
    """A track that would stand still for ever is an error that says what to subtract."""
    file = track(tmp_path, "1700000000,0,0,5", "1700000100,50,0,5")
    with pytest.raises(ScenarioError) as caught:
        load_scenario(file)
    (mistake,) = caught.value.mistakes
    assert (mistake.line, mistake.key) == (3, "auvs.route.files.0")
    assert "1700000000 to 1700000100 s" in mistake.message
    assert "set auvs.route.time_offset_s: 1700000000 " in mistake.message
    mended = read_scenario(file, overrides=["auvs.route.time_offset_s=1700000000"])
    assert mended.warnings == ()
    assert simulate(mended.scenario).auvs.distance_m[0] == pytest.approx(50.0)


def test_python_is_refused_such_a_track_too(tmp_path: Path) -> None:
    """Who builds scenarios in Python learns of it when the mission is to begin."""
    track(tmp_path, "-200,0,0,5", "-100,50,0,5")
    route = {"kind": "track", "files": [str(tmp_path / "dive.csv")]}
    late = Scenario.model_validate({"name": "m", "auvs": {"count": 1, "route": route}})
    with pytest.raises(ValueError, match=r"lie outside it \(0 to 300 s\).*time_offset_s: -200 "):
        simulate(late)


def test_a_track_that_does_not_fill_its_mission_is_told(tmp_path: Path) -> None:
    """When it begins, when it ends, and how far it leaves the survey: warnings, exit code 0."""
    file = track(tmp_path, "10,0,0,5", "60,90,0,5")
    found = [(it.line, it.key, it.message) for it in read_scenario(file).warnings]
    assert [(line, key) for line, key, _ in found] == [(3, "auvs.route.files.0")] * 3
    late, early, beyond = (message for *_, message in found)
    assert "begins late: it lies still for the first 10 s of 100 s (10 %)" in late
    assert "ends early: it lies still for the last 40 s of 100 s (40 %)" in early
    assert "leaves the survey of 140 m, by up to 20 m and for 51 % of the mission" in beyond


def test_tracks_over_land_are_told(tmp_path: Path) -> None:
    """Whoever recorded them, with the metres on land and how far before."""
    track(tmp_path, "0,-40,0,5", "100,40,0,5")
    file = str(tmp_path / "dive.csv")
    isle = [[-10.0, -9.0], [10.0, -9.0], [10.0, 9.0], [-10.0, 9.0]]
    tracks = {"kind": "track", "files": [file]}
    asked = Scenario.model_validate({
        "name": "m", "duration_s": 100.0, "auvs": {"count": 1, "route": tracks},
        "asvs": {"count": 1, "formation": {"model": "track", "files": [file]}},
        "survey": {"keep_out": [isle]},
    })  # fmt: skip
    found = {
        str(it).split(": ")[0]: str(it) for it in warnings_of(asked) if "leads over" in str(it)
    }
    assert sorted(found) == ["asvs.formation.files.0", "auvs.route.files.0"]
    assert (
        "the track of AUV0 leads over land, or where nobody goes, for 20 m"
        in found["auvs.route.files.0"]
    )
    assert "at first 30 m after its start" in found["asvs.formation.files.0"]
    beside = asked.model_copy(update={"survey": Scenario(name="m").survey})
    assert not any("leads over" in str(it) for it in warnings_of(beside))


def test_a_jump_faster_than_sound_is_no_track(tmp_path: Path) -> None:
    """Metres for kilometres or seconds for milliseconds: told with the sample and its speed."""
    file = track(tmp_path, "0,0,0,5", "1,3000,0,5")
    with pytest.raises(ScenarioError, match=r"sample 2 is reached at 3e\+03 m/s"):
        load_scenario(file)


def test_estimate_is_another_name_of_last_fix(tmp_path: Path) -> None:
    """Files of before keep working, with equal hash and tables, and are told the new name."""
    old, new = (
        Scenario(name="m", duration_s=20.0, protocol={"positions": word})
        for word in ("estimate", "last_fix")
    )
    assert old == new
    one, two = simulate(old), simulate(new)
    assert all(one.arrow[name].equals(two.arrow[name]) for name in one.arrow)
    assert warnings_of(new) == []
    (found,) = warnings_of(old)
    assert str(found).startswith("protocol.positions: 'estimate' is the former name of 'last_fix'")
    file = tmp_path / "f.yaml"
    file.write_text("name: m\nprotocol: {positions: estimate}\n")
    assert str(read_scenario(file).warnings[0]).startswith(f"{file}:2:23: protocol.positions: ")


FILE = (
    "name: m\nduration_s: 5\n"
    "protocol: {downlink: {model: direct_reply, reply: instant}, broadcaster: fixed}\n"
)
LINE = "f.yaml:3:74: protocol.broadcaster: has no effect with protocol.downlink: direct_reply"


@pytest.fixture
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Work in a folder with a file that has one warning."""
    monkeypatch.chdir(tmp_path)
    Path("f.yaml").write_text(FILE)


@pytest.mark.usefixtures("in_folder")
def test_validate_tells_warnings_and_strict_refuses_them() -> None:
    """Warnings leave the exit code at 0, but for `--strict`; JSON has them apart from mistakes."""
    plain, strict, as_json = (
        call("validate", "f.yaml", *options) for options in ((), ("--strict",), ("--json",))
    )
    assert (plain.exit_code, strict.exit_code, as_json.exit_code) == (0, 2, 0)
    assert plain.stdout.startswith(LINE)
    assert (plain.stdout, plain.stderr) == (strict.stdout, "1 warning\n")
    report = json.loads(as_json.stdout)
    assert (report["valid"], report["files"]) == (True, {"f.yaml": []})
    (warning,) = report["warnings"]["f.yaml"]
    assert (warning["line"], warning["key"]) == (3, "protocol.broadcaster")


@pytest.mark.usefixtures("in_folder")
def test_a_run_tells_and_keeps_its_warnings() -> None:
    """On stderr with their places, in run.json, in the report, and in the result read back."""
    ran = call("run", "f.yaml", "--out", "o", "--no-advice")
    assert ran.exit_code == 0
    assert "\nWarnings:\n" + LINE in ran.stderr
    assert LINE not in ran.stdout
    (kept,) = json.loads(Path("o/run.json").read_text())["warnings"]
    assert (kept["key"], load_result("o").warnings[0].message) == (
        "protocol.broadcaster", kept["message"],
    )  # fmt: skip
    page = Path("o/report.html").read_text()
    assert "<h2>Warnings</h2>" in page
    assert "<code>protocol.broadcaster</code>: has no effect" in page
    words = ["-q", "run", "f.yaml", "--out", "q", "--no-advice"]
    assert call(*words).stderr == ""


@pytest.mark.usefixtures("in_folder")
def test_a_report_without_warnings_has_no_such_section() -> None:
    """Where there is nothing to warn of, nothing is said."""
    Path("f.yaml").write_text("name: m\nduration_s: 5\n")
    words = ["-q", "run", "f.yaml", "--out", "o", "--no-advice"]
    assert call(*words).exit_code == 0
    assert "Warnings" not in Path("o/report.html").read_text()


@pytest.mark.usefixtures("in_folder")
def test_a_sweep_tells_the_warnings_of_its_base_once() -> None:
    """Those that hold at every point; not those of a key that the points vary."""
    words = ["sweep", "f.yaml", "--dry-run", "--vary"]
    held = call(*words, "asvs.count=2,3")
    assert held.stderr.count(LINE) == 1
    varied = call(*words, "protocol.downlink=sequential,direct_reply")
    assert (varied.exit_code, "Warnings" in varied.stderr) == (0, False)


def test_a_sweep_over_a_key_that_does_nothing_is_told(tmp_path: Path) -> None:
    """Equal missions of other broadcasters are no finding, unless some point has use for them."""
    file = tmp_path / "f.yaml"
    file.write_text("name: m\nduration_s: 5\nprotocol: {downlink: direct_reply}\n")
    vary = "--vary protocol.broadcaster=rotate,fixed"
    words = ["sweep", str(file), "--dry-run", *vary.split()]
    line = f"{vary}: protocol.broadcaster: has no effect with protocol.downlink"
    assert call(*words).stderr.count(line) == 1
    downlinks = ["--vary", "protocol.downlink=sequential,direct_reply"]
    assert "no effect" not in call(*words, *downlinks).stderr
    idle = ["--vary", "asvs.count=2,3"]
    assert call(*words, *idle).stderr.count(line) == 1


@pytest.mark.parametrize("name", ["starter", "paper", "still", "large"])
def test_starters_have_nothing_to_warn_of(name: str, tmp_path: Path) -> None:
    """A starter shows no key at work that does nothing."""
    (tmp_path / "f.yaml").write_text(call("init", name).stdout)
    assert read_scenario(tmp_path / "f.yaml").warnings == ()


@pytest.mark.parametrize(
    ("settings", "key"),
    [
        ({"absorption": "thorp", "ph": 7.9}, "ph"),
        ({"false_alarm": 1e-3}, "false_alarm"),
        ({"ph": 7.9}, None),
        ({"decoding": "coherent", "false_alarm": 1e-3}, None),
        ({"source_level_db": 150.0}, "source_level_db"),
        ({"wind_m_per_s": 20.0}, "wind_m_per_s"),
        ({"wind_m_per_s": 20.0, "snr_threshold_db": 10.0}, None),
        ({"wind_m_per_s": 20.0, "capture_db": 3.0}, None),
        ({"wind_m_per_s": 20.0, "decoding": "coherent"}, None),
    ],
)
@pytest.mark.parametrize("band", ["hf", "mf"])
def test_settings_that_others_leave_out_are_told(
    band: str, settings: dict[str, Any], key: str | None
) -> None:
    found = told(acoustics={band: {"channel": {"model": "sonar", **settings}}})
    names = [name for name in found if name.startswith(f"acoustics.{band}.channel")]
    assert names == ([] if key is None else [f"acoustics.{band}.channel.{key}"])


@pytest.mark.parametrize("timing", ["constant", "envelope", "carrier"])
def test_levels_that_time_arrivals_do_something(timing: str) -> None:
    channel = {"model": "sonar", "source_level_db": 150.0, "timing": timing}
    found = told(acoustics={"hf": {"channel": channel}})
    assert ("acoustics.hf.channel.source_level_db" in found) == (timing == "constant")


@pytest.mark.parametrize(
    "settings",
    [
        {"source_level_db": 150.0},
        {"directivity_index_db": 9.0},
        {"wind_m_per_s": 20.0},
        {"shipping": 1.0},
        {"own_noise_db": 90.0},
    ],
)
def test_levels_do_nothing_to_a_threshold_at_the_range(settings: dict[str, Any]) -> None:
    """The SNR that is told apart, missions are the same."""
    flown = []
    for each in ({}, settings):
        channel = {"channel": {"model": "sonar", **each}}
        data = {"name": "m", "duration_s": 20.0, "acoustics": {"hf": channel, "mf": channel}}
        flown.append(simulate(Scenario.model_validate(data), 1).tables)
    for name, table in flown[0].items():
        kept = table.columns.difference(["snr_db", "level_db", "margin_db", "loss_probability"])
        if "loss_probability" in table:  # 0 or 1 but for rounding
            likely = flown[1][name].loss_probability
            np.testing.assert_allclose(table.loss_probability, likely, atol=1e-12)
        assert table[kept].equals(flown[1][name][kept]), name


@pytest.mark.parametrize(
    ("hf", "loss", "is_idle"),
    [
        ({}, {}, True),  # within 50 m the paper's law takes nothing
        ({"range_m": 300.0}, {"law": "paper"}, False),
        ({}, {"combine": "clamp_first"}, False),
        ({"range_m": 300.0}, {"law": "none"}, True),
    ],
)
def test_losses_that_never_come_cannot_last(
    hf: dict[str, Any], loss: dict[str, Any], *, is_idle: bool
) -> None:
    channel = {"model": "disc", "burst_s": 4.0}
    found = told(acoustics={"hf": {"channel": channel, **hf}, "loss": loss})
    assert ("acoustics.hf.channel.burst_s" in found) == is_idle


def test_a_law_is_not_for_a_cast_of_speeds(tmp_path: Path) -> None:
    speeds, water = tmp_path / "speeds.csv", tmp_path / "water.csv"
    speeds.write_text("depth_m,sound_speed_m_per_s\n0,1500\n30,1490\n")
    water.write_text("depth_m,temperature_c,salinity_psu\n0,15,35\n30,10,35\n")
    for file, is_named in ((speeds, True), (water, False)):
        found = told(environment={"ctd": str(file), "sound_speed_law": "medwin"})
        assert ("environment.sound_speed_law" in found) == is_named


FAR = {"hf": {"range_m": 1200.0}, "mf": {"range_m": 2400.0}}


@pytest.mark.parametrize(
    ("acoustics", "key", "words"),
    [
        (
            {"loss": {"law": "paper"}},
            "hf",
            "over 1200 m 0.1 % of pings are decoded, at least half ",
        ),
        ({"loss": {"law": "head"}}, "hf", "of them up to 282 m: .* acoustics.loss.law scaled"),
        ({"hf": {"channel": {"model": "sonar", "snr_threshold_db": 35.0}}}, "hf", "of pings"),
        ({"hf": {"modem": "ahoi"}}, "hf", "over 1200 m 0 % .* up to 153.4 m.* make it less$"),
        (
            {"mf": {"channel": {"model": "sonar", "snr_threshold_db": 35.0}}},
            "mf",
            "over 2400 m .* % of frames are decoded, at least half of them up to [0-9]+",
        ),
    ],
)
def test_a_range_over_which_most_is_lost_is_told_with_numbers(
    acoustics: dict[str, Any], key: str, words: str
) -> None:
    found = told(acoustics={band: {**FAR.get(band, {}), **acoustics.get(band, {})}
                            for band in ("hf", "mf", "loss")})  # fmt: skip
    assert [name for name in found if name.endswith("range_m")] == [f"acoustics.{key}.range_m"]
    assert re.search(words, found[f"acoustics.{key}.range_m"])


@pytest.mark.parametrize("channel", ["disc", "sonar"])
def test_what_carries_over_its_range_is_not_warned_of(channel: str) -> None:
    """By default a loss law is made for the range, and so is a sonar's threshold."""
    found = told(acoustics={band: {**keys, "channel": channel} for band, keys in FAR.items()})
    assert not [name for name in found if name.startswith("acoustics")]


BAY = [[0, 0], [300, 0], [300, 200], [200, 200], [200, 50], [100, 50], [100, 200], [0, 200]]


def test_auvs_that_leave_an_area_are_told_with_how_far() -> None:
    """Of ten lanes 20 m apart the seven beyond y = 50 m cross 100 m of open water each, unless they
    are to stay inside, as they are where nobody says so.
    """
    keys = {"survey": {"polygon_m": BAY}, "asvs": {"count": 1}}
    across = {"count": 2, "route": {"lane_spacing_m": 20, "inside": False}}
    found = told(**keys, auvs=across)["survey.polygon_m"]
    assert found.startswith("AUV0, AUV1 are outside the area for 7")
    assert "up to 50 m beyond its edge, as planned; set auvs.route.inside to have" in found
    kept = {"count": 2, "route": {"lane_spacing_m": 20}}
    assert "survey.polygon_m" not in told(**keys, auvs=kept)
    along = {"count": 2, "route": {"lane_spacing_m": 20, "lane_heading_deg": 90}}
    assert "survey.polygon_m" not in told(**keys, auvs=along)
    convex = {**keys, "survey": {"polygon_m": [*BAY[:3], BAY[-1]]}}
    assert "survey.polygon_m" not in told(**convex, auvs=across)


def test_a_current_and_a_dvl() -> None:
    """Which remedy is for whom: a DVL that sees the bottom, and a log through the water."""
    with pytest.raises(ValueError, match="a DVL that sees the bottom; for these set it to 0") as it:
        told(environment={"current_m_per_s": 0.2})
    assert "whose log measures through the water set navigation.velocity to" in str(it.value)


def test_a_horizontal_range_far_above_its_auvs_is_told_with_the_slant_one() -> None:
    """Of either band, where AUVs are deeper than a fifth of it; silent where sound has no edge, or
    the band is not used.
    """
    deep = {"survey": {"side_m": 900.0, "depth_m": 200.0}}
    both = {**deep, "acoustics": {"hf": {"range_m": 150.0}, "mf": {"range_m": 900.0}}}
    hf, mf = (told(**both)[f"acoustics.{band}.range_metric"] for band in ("hf", "mf"))
    assert "250 m of slant range to AUVs 200 m deep" in hf
    assert "150 m of slant range would reach none of them" in hf
    assert "922 m of slant range" in mf
    assert "would reach 877.5 m, seen from above" in mf

    def keys(**changes: Any) -> set[str]:
        return {key.split(".")[1] for key in told(**changes) if key.endswith("range_metric")}

    at_a_fifth = {"survey": {"side_m": 900.0, "depth_m": 30.0}}
    assert keys(**{**both, **at_a_fifth}) == set()
    passive = {"protocol": {"ranging": "passive"}}
    assert keys(**both, **passive) == {"hf"}
    sonar = {"hf": {"range_m": 150.0, "channel": "sonar"}, "mf": {"range_m": 900.0}}
    assert keys(**deep, acoustics=sonar) == {"mf"}
    slant = {band: {"range_m": reach, "range_metric": "slant"}
             for band, reach in (("hf", 150.0), ("mf", 199.0))}  # fmt: skip
    found = told(**deep, acoustics=slant)
    assert "deeper than the MF range, 199 m slant: no ASV at the surface reaches them" in found.get(
        "survey.depth_m", ""
    )


def test_each_kind_of_vessel_is_warned_of_by_its_own_keys() -> None:
    """What is thin, apart, taken for perfect or idle of the USBL of one group, and of all."""
    wide = [[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.5, 0.5, 0.19]]
    sheet = {"model": "datasheet", "bearing_sd_deg": 1.0, "reference_snr_db": 20.0}
    groups = [
        {"count": 1, "usbl": {"model": sheet, "tdoa_sd_s": 1e-6}},
        {"count": 1, "usbl": {"array": wide, "tdoa_sd_s": 2e-5}},
        {"count": 1, "usbl": {"preset": "seatrac_x150"}},
    ]
    found = told(asvs={"groups": groups}, usbl={"tdoa_sd_s": 1e-6})
    keys = {key: words for key, words in found.items() if "usbl" in key}
    assert set(keys) == {
        "asvs.groups.0.usbl.model.reference_snr_db", "asvs.groups.0.usbl.tdoa_sd_s",
        "asvs.groups.1.usbl.array", "asvs.groups.2.usbl.preset", "usbl.tdoa_sd_s",
    }  # fmt: skip
    assert (
        "too little for asvs.groups.1.usbl.tdoa_sd_s of 2e-05 s"
        in found["asvs.groups.1.usbl.array"]
    )
    assert "no effect with usbl.model: datasheet" in found["usbl.tdoa_sd_s"]
    groups[1]["usbl"] = {"array": wide, "tdoa_sd_s": 1e-6}
    sonar = told(asvs={"groups": groups}, acoustics={"hf": {"channel": "sonar"}})
    assert "grating lobes" in sonar["asvs.groups.1.usbl.array"]
    timed = {"acoustics": {"hf": {"channel": {"model": "sonar", "timing": "envelope"}}}}
    assert "acoustics.hf.channel.timing" not in told(asvs={"groups": groups}, **timed)
    assert "acoustics.hf.channel.timing" in told(asvs={"groups": groups[:1]}, **timed)


def test_what_every_kind_of_vessel_says_itself_has_no_effect_for_all() -> None:
    own = {"gnss_sd_m": 0.2}
    each = [{"count": 1, "usbl": own, "vehicle": "otter"}, {"count": 2, "usbl": own}]
    found = told(asvs={"groups": each, "vehicle": "moored"}, usbl={"gnss_sd_m": 1.0})
    assert "each group of ASVs says its own" in found["usbl.gnss_sd_m"]
    assert "asvs.vehicle" not in found
    each[1]["vehicle"] = "moored"
    found = told(asvs={"groups": each, "vehicle": "otter"})
    assert "each group of ASVs says its own" in found["asvs.vehicle"]
