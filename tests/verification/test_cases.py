"""What a verdict is worked out from: distances, speeds, guards."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cases_for_tests import case, most_fixes, scenario
from commands_for_tests import call

from bindusbl_des import Scenario, Setup, verify
from bindusbl_des.apps.verification.rules import (
    call_and_answer,
    frame_spread,
    round_gap,
    sizes,
    spread_s,
    widest,
)
from bindusbl_des.apps.verification.witnesses import (
    answer_late,
    answer_passing,
    groups_shown,
    rounds_shown,
    two_calls,
)

PLACES = [(10.0, 0.0), (0.0, 20.0), (-30.0, 5.0)]
PLACED = {"count": 3, "formation": {"positions_m": PLACES}}


def test_distances_are_those_of_pairs_and_of_neighbours_in_turn() -> None:
    it = case(asvs=PLACED)
    first, second, third = math.hypot(10, 20), math.hypot(40, 5), math.hypot(30, 15)
    assert it.apart_m == pytest.approx(sorted([first, second, third]))
    assert it.in_turn_m == pytest.approx(sorted([first, second, third]))
    two = case(asvs={"count": 2, "formation": {"positions_m": PLACES[:2]}})
    assert two.apart_m == pytest.approx([first])
    same = {"count": 2, "formation": {"positions_m": [(0, 0), (0.1, 0)]}}
    assert case(asvs=same).apart_m == pytest.approx([0.1])


def test_vessels_and_auvs_come_nearer_by_both_speeds() -> None:
    it = case(asvs={"count": 2, "formation": {"model": "follow"}})
    bounds = it.bounds
    assert min(bounds.max_speed_m_per_s, bounds.asv_speed_m_per_s) > 0.1
    assert it.closing_m_per_s == bounds.max_speed_m_per_s + bounds.asv_speed_m_per_s
    held = {"count": 1, "route": {"kind": "hold", "positions_m": [[0.0, 0.0]]}}
    assert case(auvs=held).closing_m_per_s == 0.0


def test_the_shortest_way_of_a_ping_is_that_from_the_least_depth() -> None:
    """AUVs with equations of motion may be anywhere down to their depth."""
    assert case().shortest_m(0) == 10.0
    assert case(auvs={"vehicle": "bluerov2"}).shortest_m(0) == 0.0


def test_hulls_go_with_the_current_at_most() -> None:
    """An AUV that is steered through water is as fast over ground as both together."""
    still, flowing = (
        case(auvs={"vehicle": "bluerov2"}, environment={"current_m_per_s": mean})
        for mean in (0.0, 0.5)
    )
    speeds = [it.bounds.max_speed_m_per_s for it in (still, flowing)]
    assert speeds[1] == pytest.approx(speeds[0] + 0.5)


def test_frames_may_name_nobody_unless_each_has_a_slot_of_its_own() -> None:
    told = {"knowledge": "broadcast"}
    each, shared = (
        case(auvs={"count": 3}, protocol={**told, "schedule": it, "forget_after_s": None})
        for it in ("one_per_slot", "spatial_reuse")
    )
    assert {named for _, named in sizes(each)} == {3}
    assert {named for _, named in sizes(shared)} == {0, 1, 2, 3}
    assert {fixes for fixes, _ in sizes(shared)} == set(range(most_fixes(shared) + 1))


def test_where_lots_are_drawn_a_witness_lasts_until_each_has_had_its_turn() -> None:
    """By rotation each of three has one in three frames; two more are shown."""
    by_rotation, by_lot = (
        rounds_shown(case(protocol={"schedule": it, "frame_s": 9.0}, auvs={"count": 3}))
        for it in ("round_robin", "random")
    )
    assert by_rotation == pytest.approx(9.0 * 5)
    assert by_lot == pytest.approx(9.0 * (3 * 20 + 2))


def test_two_pings_of_one_auv_come_apart_by_what_it_moves_in_a_round() -> None:
    it = case(auvs={"count": 1})
    moved = it.closing_m_per_s * round_gap(it)
    assert 0.0 < spread_s(it, 0, 0) == pytest.approx(moved / it.sound_speeds[0])


def test_an_auv_half_way_between_two_asvs_is_as_far_from_either() -> None:
    assert widest(case(asvs=PLACED), np.array([100.0]), 50.0, False, 0.0) == (0.0, 100.0)


@pytest.mark.parametrize(
    "protocol", [{}, {"ranging": "twtt"}, {"downlink": {"model": "direct_reply"}}]
)
def test_the_guard_of_a_slot_is_the_one_set_and_what_its_length_is_rounded_up_by(
    protocol: dict[str, Any],
) -> None:
    guards = {"uplink_guard_s": 0.05, "shortest_uplink_slot_s": 0.0, "schedule": "one_per_slot",
              "downlink_guard_s": 0.07, "shortest_downlink_slot_s": 0.0, **protocol}  # fmt: skip
    verdict = verify(scenario(protocol=guards))
    assert verdict.uplink is not None
    assert 0.05 - 1e-9 <= verdict.uplink.set_s < 0.05 + 1.0 / 30.0 + 1e-9
    verdict = verify(scenario(protocol={**guards, "tick_rate_hz": None}))
    assert verdict.uplink is not None
    assert verdict.uplink.set_s == pytest.approx(0.05)
    if verdict.downlink is not None:
        assert verdict.downlink.set_s == pytest.approx(0.07)


@pytest.mark.parametrize(
    ("protocol", "frames"),
    [
        ({}, True),
        ({"ranging": "passive"}, False),
        ({"downlink": {"model": "direct_reply"}}, False),
    ],
)
def test_only_frames_that_follow_each_other_need_a_guard(
    protocol: dict[str, Any], frames: bool
) -> None:
    assert (verify(scenario(protocol=protocol)).downlink is not None) == frames


def test_a_call_is_compared_with_its_answer_where_asvs_hear_each_other() -> None:
    """The detour by an AUV 10 m below is longest, compared with its way, between the nearest."""
    protocol = {"ranging": "twtt", "schedule": "one_per_slot"}
    water = {"acoustics": {"hf": {"range_m": 35.0}}, "protocol": protocol}
    [pair] = call_and_answer(case(asvs=PLACED, **water))
    apart = math.hypot(30, 15)  # of 22.4, 33.5 and 40.3 m
    detour = math.hypot(apart, 20) - apart
    assert f"an AUV is {detour:.3g} m longer than that of the call, over {apart:.4g} m" in pair.why
    far = {"count": 2, "formation": {"positions_m": [(-50, 0), (50, 0)]}}
    assert not list(call_and_answer(case(asvs=far, **water)))


def test_witnesses_have_auvs_where_calls_and_answers_would_meet() -> None:
    """Half-way between ASVs that call, the other AUV far beyond the second; on the way from the
    caller to the other ASV; far from its caller, the next that is called below the same ASV.
    """
    placed = {"count": 2, "formation": {"positions_m": [(-20.0, 0.0), (20.0, 5.0)]}}
    auvs = {"count": 2, "vehicle": "bluerov2"}
    it = case(asvs=placed, auvs=auvs, protocol={"ranging": "twtt"})
    called = next(two_calls(it))
    assert called["survey"]["depths_m"] == [10.0, 10.0]
    middle, far = called["auvs"]["route"]["positions_m"]
    assert middle == pytest.approx([0.0, 2.5], abs=1e-6)
    assert far[0] > 20.0 + 3 * (50.0 + 40.0)
    assert far[1] == pytest.approx(5.0)
    (begin, end), _ = next(answer_passing(it, 50.0))["auvs"]["route"]["points_m"]
    assert (end[1] - begin[1]) / (end[0] - begin[0]) == pytest.approx(5.0 / 40.0)
    assert next(answer_late(it, 0, 0.05))["auvs"]["route"]["positions_m"][1] == [-20.0, 0.0]
    assert len(list(groups_shown(it))) == 3  # as planned, at the edge, coming into range


def test_asvs_that_broadcast_in_turn_are_as_far_apart_as_neighbours() -> None:
    """At the corners of a square: a side, and not the diagonal, for AUVs at rest."""
    corners = [(0.0, 0.0), (60.0, 0.0), (60.0, 60.0), (0.0, 60.0)]
    held = {"count": 1, "route": {"kind": "hold", "positions_m": [[30.0, 30.0]]}}
    placed = {"count": 4, "formation": {"positions_m": corners}}
    it = case(asvs=placed, auvs=held, protocol={"broadcaster": "rotate"})
    slowest = it.sound_speeds[0]
    assert frame_spread(it) == pytest.approx(60.0 / slowest, rel=0.05)
    drawn = case(asvs=placed, auvs=held, protocol={"broadcaster": "random"})
    assert frame_spread(drawn) == pytest.approx(math.hypot(60.0, 60.0) / slowest, rel=0.05)


def test_a_witness_has_the_outline_of_an_area_in_a_file(tmp_path: Path) -> None:
    """And needs no file; of sizes it has what the scenario has."""
    area = tmp_path / "bay.geojson"
    corners = [[10.0, 54.0], [10.002, 54.0], [10.002, 54.001], [10.0, 54.001], [10.0, 54.0]]
    area.write_text(json.dumps({"type": "Polygon", "coordinates": [corners]}))
    it = case(survey={"area": str(area)}, auvs={"count": 2}, asvs=PLACED)
    survey = list(groups_shown(it))[1]["survey"]
    assert set(survey) == {"polygon_m", "depths_m"}
    assert np.ptp(survey["polygon_m"], axis=0) == pytest.approx([111.3, 131.2], abs=0.3)
    sized = case(survey={"side_m": 77.0, "swath_m": 9.0}, auvs={"count": 2}, asvs=PLACED)
    assert list(groups_shown(sized))[1]["survey"] == {"side_m": 77.0, "depths_m": [10.0, 10.0]}


def test_a_witness_has_the_land_of_its_scenario() -> None:
    """And water where nobody goes, beside whatever its area is given by."""
    isle = [[100.0, -5.0], [110.0, -5.0], [110.0, 5.0]]
    wreck = [[-60.0, 50.0], [-55.0, 50.0], [-55.0, 60.0]]
    it = case(survey={"land": [isle], "keep_out": [wreck]}, auvs={"count": 2}, asvs=PLACED)
    witness = Setup(Scenario.model_validate(list(groups_shown(it))[1]))
    for name in ("land", "keep_out", "area"):
        own, again = (getattr(setup, name).shape for setup in (it.setup, witness))
        assert own.symmetric_difference(again).area < 1e-9
    assert "land" not in list(groups_shown(case(auvs={"count": 2}, asvs=PLACED)))[1]["survey"]


def test_a_witness_has_the_vessels_of_each_kind() -> None:
    """Each at its place with its own USBL, and moored."""
    unsure = {"gnss_sd_m": 3.0}
    groups = [{"count": 1}, {"count": 2, "usbl": unsure, "vehicle": "otter"}]
    it = case(auvs={"count": 2}, asvs={"groups": groups, "formation": PLACED["formation"]})
    witness = Setup(Scenario.model_validate(list(groups_shown(it))[1]))
    assert [usbl.gnss_sd for usbl in witness.usbls] == [usbl.gnss_sd for usbl in it.setup.usbls]
    assert witness.usbls[2].gnss_sd == 3.0
    assert witness.keeps_still
    assert witness.stations_m == it.setup.nominal_stations_m


def test_a_verdict_in_words_has_a_line_for_each_pair_of_signals() -> None:
    verdict = verify("quickstart")
    lines = call("verify", "quickstart").stdout.splitlines()
    for pair in verdict.pairs:
        assert any(line.startswith(pair.kind) and pair.what in line for line in lines)
