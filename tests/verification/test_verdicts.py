"""What is accepted keeps every adversary out; what is refused goes wrong in a mission."""

import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from adversary import overlaps
from cases_for_tests import case_of, most_fixes
from commands_for_tests import call
from verification_cases import drawn_case
from worlds import merged, parse_scenario

from bindusbl_des import Result, Scenario, Setup, Verdict, load_scenario, simulate, verify
from bindusbl_des.apps.preflight.effort import effort
from bindusbl_des.apps.verification import playing
from bindusbl_des.apps.verification.playing import played
from bindusbl_des.apps.verification.witnesses import staged

# As many as it takes for every rule to accept and to refuse
DRAWN = 60
SLOW_DRAWN, SLOW_ROUNDS = 400, 1_000_000


def judged(data: dict[str, Any], **bounds: float) -> Verdict:
    return verify(Scenario.model_validate({"name": "test", "duration_s": 60.0, **data}), **bounds)


def test_fleets_are_verified_as_far_as_their_pairs_go() -> None:
    for fleet, who in (("auvs", "AUVs"), ("asvs", "ASVs")):
        with pytest.raises(ValueError, match=f"{fleet}.count: all pairs of up to 1,000 {who}"):
            judged({fleet: {"count": 1001}})


def mended(data: dict[str, Any], verdict: Verdict) -> Scenario:
    """Return a scenario with what was proposed."""
    assert verdict.remedy is not None
    changes = [f"{key}={json.dumps(value)}" for key, value in verdict.remedy.changes]
    return parse_scenario(json.dumps(data), overrides=changes)


def accepted_and_refused(seeds: range, rounds: int) -> tuple[int, int, dict[str, set[str]]]:
    """Judge drawn scenarios: witnesses of what is refused, adversaries of what is accepted, as it
    is or once mended.

    Return how many rounds were played, how many witnesses seen, and the verdicts of each kind.
    """
    played_rounds, witnesses, kinds = 0, 0, dict[str, set[str]]()
    for seed in seeds:
        data, bounds = drawn_case(seed)
        scenario = Scenario.model_validate(data)
        verdict = verify(scenario, **bounds)
        for pair in verdict.pairs:
            kinds.setdefault(pair.kind, set()).add(pair.verdict)
        if not verdict.accepted:
            if any(pair.verdict == "refused" for pair in verdict.pairs):
                assert verdict.witness is not None, seed
                kind, plan, at = (getattr(verdict.witness, k) for k in ("kind", "plan", "seed"))
                band = next(pair.band for pair in verdict.pairs if pair.kind == kind)
                again = played(kind, plan, at, band)
                assert again == verdict.witness, seed
                assert again.overlap_s > 0.0
                witnesses += 1
            scenario = mended(data, verdict)
            verdict = verify(scenario, **bounds)
            assert verdict.accepted, seed
        assert overlaps(scenario, verdict.bounds, rounds, seed) == 0, seed
        played_rounds += rounds
    return played_rounds, witnesses, kinds


def test_what_is_accepted_keeps_adversaries_out_and_what_is_refused_collides() -> None:
    """Scenarios under every protocol: 24,000 rounds without an overlap, and witnesses that have."""
    rounds, witnesses, kinds = accepted_and_refused(range(DRAWN), 400)
    assert rounds == 24_000
    assert witnesses >= 10
    assert {"accepted", "refused"} <= kinds["same slot"] & kinds["consecutive slots"]


@pytest.mark.slow
def test_a_million_adversarial_rounds_do_not_overlap() -> None:
    """Motion, sound speed and clocks at worst corners and at random; every kind is also refused,
    but for answers, which are undecided then, and beacons of ASVs that are not just R apart.
    """
    began = time.monotonic()
    each = -(-SLOW_ROUNDS // SLOW_DRAWN)
    rounds, witnesses, kinds = accepted_and_refused(range(1000, 1000 + SLOW_DRAWN), each)
    print(f"{rounds} rounds, {witnesses} witnesses, {time.monotonic() - began:.0f} s")
    assert rounds >= SLOW_ROUNDS
    assert witnesses >= 40
    assert all("accepted" in verdicts for verdicts in kinds.values()), kinds
    unrefused = {kind for kind, verdicts in kinds.items() if "refused" not in verdicts}
    assert unrefused == {"consecutive answers", "consecutive beacons"}


@pytest.mark.parametrize(
    ("data", "bounds"),
    [
        ({}, {}),
        (
            {"protocol": {"uplink_guard_s": 0.0, "shortest_uplink_slot_s": 0.0,
                          "schedule": "one_per_slot"}},
            {"clock_error": 0.005},
        ),
        (
            {"protocol": {"uplink_guard_s": 0.0, "shortest_uplink_slot_s": 0.0, "ranging": "twtt",
                          "schedule": "one_per_slot"}},
            {"sound_speed_error": 30.0},
        ),
        ({"protocol": {"ranging": "twtt"}}, {}),
        (
            {"survey": {"depth_m": 0.0}, "asvs": {"formation": {"radius_m": 28.9}},
             "protocol": {"uplink_guard_s": 0.0, "shortest_uplink_slot_s": 0.0,
                          "ranging": "passive"}},
            {"sound_speed_error": 30.0},
        ),
        (
            {"acoustics": {"mf": {"range_m": 300.0}},
             "protocol": {"downlink": "pipelined_round", "downlink_guard_s": 0.0,
                          "shortest_downlink_slot_s": 0.0}},
            {},
        ),
    ],
)  # fmt: skip
def test_the_adversary_finds_what_there_is(data: dict[str, Any], bounds: dict[str, float]) -> None:
    """Nobody is convinced by an adversary who never finds anything."""
    verdict = judged(data, **bounds)
    assert not verdict.accepted
    assert overlaps(verdict.scenario, verdict.bounds, 40_000, 0) > 0


def pair(verdict: Verdict, kind: str) -> Any:
    return next(it for it in verdict.pairs if it.kind == kind)


def test_the_conflict_margin_is_the_way_to_the_last_slot_that_is_shared() -> None:
    """N AUVs share slot N - 2 at most: 4 of 7/30 s at 0.627 m/s; one ASV alone shares none."""
    six = {"auvs": {"count": 6}, "protocol": {"tick_rate_hz": 30.0}}
    needed = 4 * 7 / 30 * 0.627
    assert pair(judged(six), "same slot").margin_m == pytest.approx(-needed)
    just = {**six, "protocol": {"tick_rate_hz": 30.0, "conflict_margin_m": needed}}
    assert pair(judged(just), "same slot").margin_m == pytest.approx(0.0, abs=1e-12)
    assert judged(six, max_speed=2.0).conflict_margin == {
        "set_m": 0.0, "needed_m": pytest.approx(4 * 7 / 30 * 2.0),
    }  # fmt: skip
    assert judged({**six, "asvs": {"count": 1}}).accepted
    far = {"count": 2, "formation": {"positions_m": [[0.0, 0.0], [101.0, 0.0]]}}
    assert judged({**six, "asvs": far}, max_speed=1.0).accepted


def test_aslant_an_auv_comes_nearer_by_less_than_it_moves() -> None:
    """From 40 m across and 30 m deep, 3 m farther out is hypot(43, 30) - 50 m more."""
    data = {"survey": {"depth_m": 30.0}, "acoustics": {"hf": {"range_metric": "slant"}}}
    found = judged(data, max_speed=3.0).conflict_margin
    slot = 2.5 * 140 / 1500
    assert found is not None
    assert found["needed_m"] == pytest.approx(((40 + 3 * slot) ** 2 + 900) ** 0.5 - 50)


def test_consecutive_slots_need_the_difference_of_ways_and_two_clock_errors() -> None:
    """T - T_P - (sqrt(50^2 + 10^2) - 10) / 1480 - 2 * 3 ms at the slowest speed of sound."""
    data = {"protocol": {"schedule": "one_per_slot"}}
    margin = pair(
        judged(data, clock_error=0.003, sound_speed_error=20.0), "consecutive slots"
    ).margin_s
    slot = 2.5 * 140 / 1500
    assert margin == pytest.approx(slot - 0.01 - (2600**0.5 - 10) / 1480 - 0.006)


def test_an_answer_needs_two_ways_and_two_pings() -> None:
    """T - 2 T_P - T_ta - 2 * 50 / 1500, and what an AUV goes away meanwhile."""
    data = {
        "survey": {"depth_m": 0.0},
        "protocol": {
            "ranging": {"model": "twtt", "turnaround_s": 0.1},
            "schedule": "one_per_slot",
        },
    }
    found = pair(judged(data), "answer and next call").margin_s
    slot = max(0.12 + 100 / 1500 + 0.5 * 140 / 1500, 2.5 * 140 / 1500)
    assert found == pytest.approx(slot - 0.12 - 50 / 1500 - 50 / (1500 - 0.627))


def test_fixes_of_last_rounds_age_as_long_as_the_mission() -> None:
    """Who is not heard is not fixed: 60 s at 0.627 m/s, and what fixes are off by."""
    verdict = judged({"asvs": {"count": 1}, "protocol": {"positions": "last_fix"}})
    assert verdict.position_age_s == 60.0
    assert verdict.conflict_margin is not None
    off = verdict.position_error_m
    assert off is not None
    assert verdict.conflict_margin["needed_m"] == pytest.approx(60 * 0.627 + off)


ERRORS: dict[str, dict[str, Any]] = {
    "a sheet": {"usbl": {"preset": "cerulean_rovl"}},
    "slow GNSS": {"usbl": {"gnss_correlated_sd_m": 1.0}},
    "white GNSS": {"usbl": {"gnss_sd_m": 1.0}},
    "outliers": {"usbl": {"outlier_share": 0.1, "outlier_sd_m": 5.0}},
    "the array": {"usbl": {"tdoa_sd_s": 2e-5}},
    "steps of its clock": {"usbl": {"quantum_s": 2e-3}},
    "misalignment": {"usbl": {"misalignment_sd_deg": 5.0}},
    "the AHRS": {"usbl": {"heading_sd_deg": 5.0}},
    "travel times": {"usbl": {"travel_time_sd_s": 2e-3}},
    "sound speed": {"environment": {"assumed_sound_speed_m_per_s": 1480.0}},
    "clocks": {"navigation": {"clock_offset_sd_s": 1e-3}},
    "two ways": {"usbl": {"travel_time_sd_s": 2e-3}, "protocol": {"ranging": "twtt"}},
}
PERFECT = {
    **dict.fromkeys(("tdoa_sd_s", "travel_time_sd_s", "quantum_s"), 0.0),
    **dict.fromkeys(("roll_sd_deg", "pitch_sd_deg", "heading_sd_deg"), 0.0),
}


@pytest.mark.parametrize("error", ERRORS.values(), ids=ERRORS)
def test_every_error_of_a_fix_is_in_the_margin(error: dict[str, Any]) -> None:
    """AUVs at the edge of range, held: by how much fixes are off in missions, the margin covers."""
    edge = [[49.0, 0.0], [-49.0, 0.0], [0.0, 45.0]]
    perfect = {
        "auvs": {"count": 3, "route": {"kind": "hold", "positions_m": edge}},
        "asvs": {"count": 1, "formation": {"positions_m": [[0.0, 0.0]]}},
        "usbl": PERFECT,
        "protocol": {"positions": "last_fix", "schedule": "spatial_reuse"},
    }
    without = judged(perfect).conflict_margin
    data = merged(perfect, error)
    verdict = judged(data)
    assert verdict.conflict_margin is not None
    assert without is not None
    needed, most = verdict.conflict_margin["needed_m"], without["needed_m"]
    assert needed is not None
    assert most is not None
    assert most < 0.5 < needed  # the wave is not plane, and no more
    off = [simulate(verdict.scenario, seed).tables["fixes"]["error_m"].max() for seed in range(3)]
    assert 0.0 < max(off) < needed


def test_fixes_that_lock_in_are_refused() -> None:
    """A fix that has an AUV out of range lets it share a slot with whom its ASV hears for ever."""
    held = {"kind": "hold", "positions_m": [[49.0, 0.0], [-45.0, 0.0], [0.0, 45.0]]}
    data = {
        "auvs": {"count": 3, "route": held},
        "asvs": {"count": 2, "formation": {"positions_m": [[0.0, 0.0], [70.0, 0.0]]}},
        "usbl": {"preset": "cerulean_rovl"},
        "protocol": {"positions": "last_fix", "conflict_margin_m": 0.5},
    }
    verdict = judged(data)
    assert verdict.verdict == "refused"
    assert verdict.conflict_margin == {"set_m": 0.5, "needed_m": None}


def test_a_round_longer_than_its_frame_is_told_and_no_overlap() -> None:
    """An uplink and a downlink slot of 2.5 and 10 crossing times take 1.1667 s: no overlap."""
    verdict = judged({"protocol": {"schedule": "round_robin", "frame_s": 1.0}})
    assert verdict.frame == {
        "frame_s": 1.0, "round_s": pytest.approx(12.5 * 140 / 1500), "fits": False,
    }  # fmt: skip
    assert verdict.accepted
    words = ("--set", "protocol={schedule: round_robin, frame_s: 1.0}", "--set", "duration_s=60")
    told = call("verify", "recovery_140m", *words, "--set", "protocol.tick_rate_hz=null").stdout
    assert "A round may last 1.167 s, its frame 1 s: rounds begin late." in told


@pytest.mark.parametrize(
    ("auvs", "apart", "assigned", "margin"),
    [(3, 95.0, 64, -0.0599778), (20, 20.0, 2, -0.0132542), (20, 95.0, 64, -0.0613883)],
)
def test_frames_that_tell_slots_are_as_long_as_they_are(
    auvs: int, apart: float, assigned: int, margin: float
) -> None:
    """Records of slots are on the air too: without a guard frames collide, and are refused; an AUV
    goes on while they last, which the margin counts.
    """
    data = {
        "auvs": {"count": auvs},
        "survey": {"side_m": 20.0},
        "asvs": {"formation": {"positions_m": [[-apart / 2, 0.0], [apart / 2, 0.0]]}, "count": 2},
        "protocol": {
            "knowledge": {"model": "broadcast", "assignment_bytes": assigned},
            "schedule": "one_per_slot", "downlink": "pipelined_round",
            "downlink_guard_s": 0.0, "shortest_downlink_slot_s": 0.0,
        },
    }  # fmt: skip
    verdict = judged(data)
    frames = pair(verdict, "consecutive frames")
    assert (frames.verdict, frames.margin_s) == ("refused", pytest.approx(margin, abs=1e-7))
    collided = simulate(verdict.scenario, 0).tables["frame_receptions"]["outcome"] == "collided"
    assert collided.mean() > 0.2


@pytest.mark.parametrize(
    "changes",
    [
        {
            "acoustics": {"mf": {"channel": {"model": "sonar"}}},
            "protocol": {"conflict_margin_m": 20.0},
        },
        {"asvs": {"failures": [{"asv": 1, "at_s": 5.0, "until_s": 9.0}]}},
        {"protocol": {"knowledge": "broadcast", "conflict_margin_m": 20.0}},
        {
            "protocol": {
                "knowledge": {"model": "broadcast", "missed": "last_slot"},
                "schedule": "one_per_slot",
            }
        },
    ],
    ids=[
        "sonar on MF",
        "an ASV that comes back",
        "slots told a round ahead",
        "slots reckoned",
    ],
)  # fmt: skip
def test_what_is_not_proved_is_undecided(changes: dict[str, Any]) -> None:
    """Neither accepted nor said to collide."""
    verdict = judged(changes)
    assert verdict.verdict == "undecided"
    assert "refused" not in {it.verdict for it in verdict.pairs}
    assert verdict.witness is None


CROWDED: dict[str, Any] = {
    "survey": {"side_m": 200.0}, "auvs": {"count": 6}, "asvs": {"count": 3},
    "acoustics": {"hf": {"range_m": 90.0}, "mf": {"range_m": 110.0}},
    "protocol": {"conflict_margin_m": 10.0},
}  # fmt: skip
ZIGZAG = {"asvs": {"formation": {"model": "zigzag"}}}


@pytest.mark.parametrize(
    "changes",
    [
        {"protocol": {"downlink": "direct_reply"}},
        {"protocol": {"broadcaster": "parallel", "downlink_guard_s": 0.0}},
        {"protocol": {"schedule": "polling"}, **ZIGZAG},
        {"protocol": {"ranging": "twtt"}, "acoustics": {"hf": {"channel": "sonar"}}, **ZIGZAG},
        {"protocol": {"downlink": "direct_reply"}, "record": {"detail": "summary"}},
    ],
    ids=["answers", "parallel", "polling by vessels", "calls by vessels", "nothing recorded"],
)
def test_whatever_is_undecided_its_own_mission_is_played(changes: dict[str, Any]) -> None:
    """One in which signals overlap refuses it."""
    verdict = judged(merged(CROWDED, changes))
    assert verdict.verdict == "refused"
    assert {it.verdict for it in verdict.pairs} <= {"accepted", "refused"}
    assert verdict.witness is not None
    assert verdict.witness.overlap_s > 0.0
    witness = Scenario.model_validate(verdict.witness.plan)
    broken = simulate(witness, verdict.witness.seed).violations
    assert broken is not None
    assert broken.first is not None


def test_who_is_silent_without_a_slot_of_its_own_collides_with_nobody() -> None:
    """A slot for each AUV, known or not, is accepted where it is for all that know it."""
    protocol = {"knowledge": "broadcast", "schedule": "one_per_slot"}
    assert judged({"protocol": protocol}).accepted


def test_pings_that_meet_refuse_no_frames() -> None:
    """One ASV sends frames at a time: where sound ends at no range none was seen to meet others."""
    bands = {"hf": {"channel": {"model": "sonar", "snr_threshold_db": 20.0}}}
    verdict = judged({"acoustics": {**bands, "mf": {"channel": "sonar"}}})
    assert {pair.what: pair.verdict for pair in verdict.pairs} == {
        "pings": "refused", "frames": "undecided",
    }  # fmt: skip
    assert verdict.witness is not None
    assert all(signal.what.startswith("ping") for signal in verdict.witness.signals)
    proved = judged({"acoustics": {"mf": bands["hf"]}, "protocol": {"conflict_margin_m": 20.0}})
    assert {pair.kind: pair.verdict for pair in proved.pairs} == {
        "sound beyond the range": "undecided", "same slot": "accepted",
        "consecutive slots": "accepted",
    }  # fmt: skip


def test_witnesses_of_large_fleets_are_short(monkeypatch: pytest.MonkeyPatch) -> None:
    """So many seconds are played of all pairs of an AUV and an ASV together."""
    flown: list[float] = []

    def noting(scenario: Scenario, seed: int) -> Result:
        flown.append(scenario.duration_s * scenario.auvs.count * scenario.asvs.count)
        return simulate(scenario, seed)

    monkeypatch.setattr(playing, "LONGEST_PLAYED_S", 60.0)
    monkeypatch.setattr(playing, "simulate", noting)
    judged({})
    assert flown
    assert max(flown) <= 60.0 * (1.0 + 1e-9)


def test_a_witness_is_a_scenario_of_its_own(tmp_path: Path) -> None:
    """Written, read again and run, the two signals named collide at the ASV named."""
    verdict = verify("recovery_140m")
    call("verify", "recovery_140m", "--out", tmp_path / "out")
    assert sorted(it.name for it in (tmp_path / "out").iterdir()) == ["verify.json", "witness.yaml"]
    scenario = load_scenario(tmp_path / "out" / "witness.yaml")
    again = played("same slot", scenario.model_dump(mode="json"))
    assert verdict.witness is not None
    assert again is not None
    assert (again.receiver, again.signals) == (verdict.witness.receiver, verdict.witness.signals)
    assert {it.sender for it in again.signals} == {"AUV1", "AUV2"}
    assert again.overlap_s == pytest.approx(0.01, rel=1e-6)


@pytest.mark.parametrize(
    ("protocol", "most"),
    [
        ({"schedule": "one_per_slot", "downlink": "pipelined_group"}, 1),
        ({"schedule": "one_per_slot", "downlink": "sequential"}, 4),
        ({"schedule": "round_robin", "downlink": "sequential"}, 1),
    ],
)
def test_a_frame_is_as_long_as_the_most_fixes_that_a_mission_sends(
    protocol: dict[str, str], most: int
) -> None:
    scenario = Scenario.model_validate(
        {"name": "most", "duration_s": 20.0, "auvs": {"count": 4}, "protocol": protocol}
    )
    sent = simulate(scenario, seed=0).tables["broadcasts"]["fixes"].max()
    assert most_fixes(case_of(scenario)) == most == sent


def test_a_witness_that_lasts_weeks_needs_no_more_memory_than_others() -> None:
    """Frames of 1 bit/s: sampled as often as a short one, it took 31 GB."""
    scenario = Scenario.model_validate({"name": "slow", "acoustics": {"mf": {"bit_rate_bps": 1}}})
    witness = Scenario.model_validate(staged(case_of(scenario), {}, 2.3e6, 1500.0))
    assert effort(Setup(witness)).bytes < 1e9


def test_a_schedule_of_one_s_own_is_judged_by_the_groups_it_makes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """On planned ways and at the edge of range: who has all ping at once is refused, who gives each
    AUV a slot is undecided, since nobody knows what it will do.
    """
    monkeypatch.setenv("BINDUSBL_ALLOW_PLUGINS", "1")
    both = {"protocol": {"schedule": "schedules_for_tests:all_at_once"}}
    refused = judged(both)
    assert refused.verdict == "refused"
    assert refused.witness is not None
    assert refused.witness.overlap_s > 0.0
    alone = judged({"protocol": {"schedule": "schedules_for_tests:each_alone"}})
    assert alone.verdict == "undecided"
    assert "beyond what was played" in alone.pairs[0].why


SHIPPED = sorted(Path(__file__).parents[2].glob("scenarios/*.yaml"))


@pytest.mark.parametrize("file", SHIPPED, ids=[it.stem for it in SHIPPED])
def test_what_ships_is_accepted_or_says_why_not(file: Path) -> None:
    """Each shipped scenario that is not accepted says so in the comment at its top."""
    comment = " ".join(
        line.lstrip("# ") for line in file.read_text().splitlines() if line.startswith("#")
    )
    verdict = verify(file)
    words = {"accepted": None, "refused": "refuses it by", "undecided": "leaves it undecided"}
    said = words[verdict.verdict]
    assert (said is None) == ("`verify`" not in comment)
    assert said is None or f"`verify` {said}" in comment
    margins = [it.margin_m for it in verdict.pairs if it.verdict == "refused"]
    assert all(f"{abs(it or 0.0):.3g} m" in comment for it in margins) or "reason told" in comment


@pytest.mark.parametrize("vehicle", ["bluerov2", "remus100"])
def test_no_vehicle_is_faster_than_its_bound(vehicle: str) -> None:
    """Autopilots overshoot the speed that is planned; a vehicle goes as fast as it can, no more."""
    world = judged({
        "auvs": {"vehicle": vehicle, "count": 1, "speed_m_per_s": 0.6 if vehicle[0] == "b" else 1.5,
                 "route": {"kind": "lawnmower", "lane_spacing_m": 60.0}},
        "survey": {"side_m": 400.0}, "record": {"tracks_hz": 10.0},
        "acoustics": {"hf": {"range_m": 300.0}},
    })  # fmt: skip
    track = simulate(world.scenario, 0).tables["tracks"].query("vehicle == 'AUV0'")
    moved = np.diff(track[["x_m", "y_m", "z_m"]].to_numpy(), axis=0)
    fastest = (np.linalg.norm(moved, axis=1) / np.diff(track["time_s"])).max()
    assert Setup(world.scenario).fastest_m_per_s < fastest <= world.bounds.max_speed_m_per_s
