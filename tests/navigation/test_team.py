"""AUVs that range each other: what is measured when, and what each makes of it."""

import json
from typing import Any

import numpy as np
import pandas as pd
import pytest
from commands_for_tests import explained
from worlds import merged, scenario

from bindusbl_des import Mission, Result, Scenario, load_result, simulate

SPEED, FUSIONS = 1500.0, ("intersection", "centralised", "naive")


def held(places: list[list[float]], peers: dict[str, Any], **changes: Any) -> Scenario:
    """AUVs that hold their places at 10 m, far from the one vessel, and lose nothing."""
    base = {
        "duration_s": 40.0,
        "survey": {"side_m": 400.0, "depth_m": 10.0},
        "auvs": {"count": len(places), "route": {"kind": "hold", "positions_m": places}},
        "asvs": {"count": 1, "formation": {"positions_m": [[3000.0, 0.0]]}},
        "acoustics": {
            "loss": {"law": "none"},
            "hf": {"range_m": 500.0, "range_metric": "slant", "bit_rate_bps": 2000.0},
        },
        "protocol": {"schedule": "round_robin", "frame_s": 1000.0},  # no pings in between
        "navigation": {
            "filter": "kalman",
            "velocity_bias_m_per_s": [0.0, 0.0],
            "random_walk_m_per_sqrt_s": 0.0,
            "peers": peers,
        },
    }
    return scenario(**merged(base, changes))


def swimming(**changes: Any) -> Scenario:
    """Three AUVs on lawnmower tours above which one vessel hears some of their pings."""
    base = {
        "duration_s": 120.0,
        "survey": {"side_m": 140.0, "depth_m": 10.0},
        "auvs": {"count": 3, "speed_m_per_s": 0.627, "route": {"kind": "lawnmower"}},
        "asvs": {"count": 1},
        "acoustics": {"hf": {"range_m": 60.0}, "mf": {"range_m": 100.0}},
        "navigation": {
            "filter": "kalman",
            "velocity_bias_m_per_s": [0.0, 0.0],
            "velocity_bias_sd_m_per_s": 0.06,
        },
    }
    return scenario(**merged(base, changes))


def ranges(result: Result) -> pd.DataFrame:
    """Return what AUVs measured of each other."""
    return result.tables["peer_ranges"]


def covariances(result: Result) -> Any:
    """Return the covariance (n, 2, 2), m2, that each AUV believes in at the last instant."""
    tracks = result.tables["tracks"]
    last = tracks[(tracks.time_s == tracks.time_s.max()) & tracks.vehicle.str.startswith("AUV")]
    xx, yy, xy = last.estimate_sd_x_m**2, last.estimate_sd_y_m**2, last.estimate_cov_xy_m2
    return np.array([[xx, xy], [xy, yy]]).transpose(2, 0, 1)


def places(result: Result) -> Any:
    """Return where each AUV believes to be (n, 2), m, at the last instant."""
    tracks = result.tables["tracks"]
    last = tracks[(tracks.time_s == tracks.time_s.max()) & tracks.vehicle.str.startswith("AUV")]
    return last[["estimate_x_m", "estimate_y_m"]].to_numpy()


# What happens when


def test_each_speaks_in_its_turn_and_is_heard_when_the_light_time_equation_says() -> None:
    """owtt: a message of 50 bytes at 2000 bit/s lasts 0.2 s; ranges are those of its front."""
    asked = held([[0, 0], [150, 0], [0, 300]], {"every_s": 9.0, "message_bytes": 50})
    told = ranges(simulate(asked, 1))
    first = told[told.sent_at_s < 10.0]
    assert first.sender.tolist() == ["AUV0"] * 2 + ["AUV1"] * 2 + ["AUV2"] * 2
    assert first.auv.tolist() == ["AUV1", "AUV2", "AUV0", "AUV2", "AUV0", "AUV1"]
    assert first.sent_at_s.tolist() == [3.0, 3.0, 6.0, 6.0, 9.0, 9.0]
    away = np.array([150, 300, 150, np.hypot(150, 300), 300, np.hypot(150, 300)])
    assert np.allclose(first.valid_at_s, first.sent_at_s + away / SPEED, atol=1e-9)
    assert np.allclose(first.heard_at_s, first.valid_at_s + 0.2, atol=1e-9)
    assert np.allclose(first.range_m - first.range_error_m, away, atol=1e-6)


def test_a_question_is_answered_in_turn_and_half_of_both_ways_is_the_range() -> None:
    """twtt: AUV1 asks at 6 s (4 bytes, 16 ms); AUV0 answers 20 ms after it has decoded that, AUV2
    a slot later: a message of 0.2 s, and the longest way.
    """
    peers = {"every_s": 9.0, "message_bytes": 50, "kind": "twtt"}
    result = simulate(held([[0, 0], [150, 0], [0, 300]], peers), 1)
    asked = ranges(result).query("auv == 'AUV1'").head(2)
    signals = result.tables["signals"]
    question = signals[(signals.sender == "AUV1") & (signals.kind == "peer_query")].iloc[0]
    assert question.sent_at_s == 6.0
    assert question.lasts_s == pytest.approx(0.016)
    far = float(np.hypot(150, 300))
    slot = asked.sent_at_s.iloc[1] - (6.0 + far / SPEED + 0.016 + 0.02)
    assert slot == pytest.approx(0.2 + 500.0 / SPEED, rel=0.05)  # as long as a message and its way
    assert asked.sent_at_s.iloc[0] == pytest.approx(6.0 + 150 / SPEED + 0.016 + 0.02, abs=1e-9)
    assert asked.sender.tolist() == ["AUV0", "AUV2"]
    assert np.allclose(asked.range_m - asked.range_error_m, [150.0, far], atol=1e-6)
    assert (asked.range_error_m.abs() < 6 * asked.range_sd_m).all()


def test_clocks_are_in_ranges_of_one_way_and_not_of_two() -> None:
    """What AUV0 measures of AUV1 is as much too long as AUV1's is too short."""
    late = {"clock_offset_sd_s": 0.01, "clock_drift_sd": 1e-5}
    quiet = {"travel_time_sd_s": 0.0, "quantum_s": 0.0}
    for kind in ("owtt", "twtt"):
        peers = {"every_s": 5.0, "kind": kind}
        asked = held([[0, 0], [150, 0]], peers, navigation=late, usbl=quiet)
        told = ranges(simulate(asked, 1))
        one, other = (
            told[told.auv == auv].range_error_m.to_numpy()[:7] for auv in ("AUV0", "AUV1")
        )
        if kind == "twtt":
            assert np.abs(np.concatenate((one, other))).max() < 1e-6
        else:
            assert np.abs(one).min() > 0.5
            # AUV0 speaks half a turn before AUV1: each clock has gone on meanwhile
            assert np.abs(one + other).max() < 5.0 * 1500.0 * 5e-5


def test_who_pings_hears_no_message_and_who_speaks_drowns_pings() -> None:
    """Messages are sounds of the one sea: half duplex, collisions at AUVs and vessels."""
    result = simulate(swimming(navigation={"peers": {"every_s": 2.0}}), 1)
    why = result.tables["signal_receptions"].groupby("why").size()
    assert {"own_ping", "own_signal", "ping"} <= set(why.index)
    assert (result.tables["receptions"].why == "signal").any()
    quiet = simulate(swimming(), 1)
    loud, calm = (run.mission.iloc[0] for run in (result, quiet))
    assert loud.pings_heard < calm.pings_heard
    assert loud.hf_utilisation > 5 * calm.hf_utilisation


def test_how_a_mission_is_advanced_changes_nothing() -> None:
    """Who looks at the AUVs in between has the same tables in the end."""
    asked = swimming(duration_s=40.0, navigation={"peers": {"every_s": 3.0}})
    whole, mission = simulate(asked, 3), Mission(asked, 3)
    for time in (7.0, 7.5, 20.0):
        mission.advance(time)
        mission.auvs()
    for table in ("tracks", "peer_ranges", "signals"):
        pd.testing.assert_frame_equal(mission.result().tables[table], whole.tables[table])


# What is made of it


SETTINGS = [
    {},
    {"navigation": {"scale_factor_sd": 0.02, "heading_sd_deg": 2.0}},
    {"navigation": {"velocity_bias_time_constant_s": 60.0}},
    {"usbl": {"misalignment_sd_deg": 2.0, "gnss_correlated_sd_m": 1.0}},
    {
        "navigation": {"velocity": "through_water"},
        "environment": {"current_m_per_s": 0.1, "current_variation_m_per_s": 0.05},
    },
    {"protocol": {"ranging": "twtt"}, "usbl": {"outlier_share": 0.1}},
    {"navigation": {"gnss_fix": {"every_s": 7.0}}, "survey": {"depth_m": 0.2}},
]


@pytest.mark.parametrize("setting", SETTINGS, ids=json.dumps)
@pytest.mark.parametrize("fusion", ["intersection", "naive"])
def test_who_hears_no_peer_is_the_kalman_filter(setting: dict[str, Any], fusion: str) -> None:
    """Late fixes, the gate and all errors that last are taken in as ever, to rounding."""
    alone = simulate(swimming(**setting), 1)
    peers = {"navigation": {"peers": {"every_s": 1e6, "fusion": fusion}}}
    among = simulate(swimming(**merged(setting, peers)), 1)
    columns = ["estimate_x_m", "estimate_y_m", "estimate_sd_x_m", "estimate_cov_xy_m2"]
    one, other = (run.tables["tracks"][columns].to_numpy(float) for run in (alone, among))
    assert np.nanmax(np.abs(one - other)) < 1e-9
    fixes = [run.tables["fixes"][["nis", "correction_m"]].to_numpy(float) for run in (alone, among)]
    assert np.nanmax(np.abs(fixes[0] - fixes[1])) < 1e-9


def least_squares(told: pd.DataFrame, truth: Any, sd: float) -> tuple[Any, Any]:
    """Return the places (n, 2), m, and their covariances (n, 2, 2), m2, that all ranges say
    together, of AUVs that know their places to `sd` per axis at first: least squares about the
    truth, independent of any filter.
    """
    count = len(truth)
    information = np.eye(2 * count) / sd**2
    right = np.zeros(2 * count)
    for row in told.itertuples():
        a, b = int(row.auv[3:]), int(row.sender[3:])
        unit = (truth[a] - truth[b]) / np.linalg.norm(truth[a] - truth[b])
        slopes = np.zeros(2 * count)
        slopes[2 * a : 2 * a + 2], slopes[2 * b : 2 * b + 2] = unit, -unit
        information += np.outer(slopes, slopes) / row.range_sd_m**2
        right += slopes * row.range_error_m / row.range_sd_m**2
    spread = np.linalg.inv(information)
    return spread @ right, [spread[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] for k in range(count)]


SPOTS = [[0.0, 0.0], [150.0, 20.0], [-30.0, 180.0], [120.0, 150.0]]


def test_centralised_is_least_squares_over_all_ranges() -> None:
    """Where ranges are linear: AUVs that lie still, and know their places to 1 cm at first.  The
    prior is at the places that they took themselves for.
    """
    sd = 0.01
    asked = held(
        SPOTS, {"every_s": 4.0, "fusion": "centralised"},
        navigation={"initial_position_sd_m": sd, "depth_sd_m": 0.0, "nis_gate": None},
    )  # fmt: skip
    result = simulate(asked, 2)
    truth = np.array(SPOTS)
    tracks = result.tables["tracks"]
    first = tracks[(tracks.time_s == 0.0) & tracks.vehicle.str.startswith("AUV")]
    began = first[["estimate_x_m", "estimate_y_m"]].to_numpy() - truth
    told = ranges(result)
    assert len(told) > 80
    # least squares of what is off from where they took themselves for
    off = told.copy()
    for index, row in told.iterrows():
        a, b = int(row.auv[3:]), int(row.sender[3:])
        unit = (truth[a] - truth[b]) / np.linalg.norm(truth[a] - truth[b])
        off.loc[index, "range_error_m"] -= unit @ (began[a] - began[b])
    moved, spreads = least_squares(off, truth, sd)
    assert np.abs(places(result) - truth - began - moved.reshape(-1, 2)).max() < 1e-5
    assert np.allclose(covariances(result), spreads, atol=1e-8)


def test_who_is_told_all_measurements_knows_what_centralised_does() -> None:
    """At each message that it decodes, losses or not: what was lost before comes with the next
    (Webster et al. 2013; Walls and Eustice).
    """
    missions = []
    for share, fusion in (("raw", "intersection"), ("estimate", "centralised")):
        asked = held(
            [[0.0, 0.0], [250.0, 30.0]],
            {"every_s": 2.0, "share": share, "fusion": fusion, "bearing": "array"},
            navigation={"initial_position_sd_m": 2.0},
            acoustics={"loss": {"law": "paper"}},
        )
        missions.append(Mission(asked, 3))
    told = ranges(simulate(missions[0].scenario, 3))
    assert 10 < len(told) < 36  # of 40
    for row in told.itertuples():
        auv = int(row.auv[3:])
        for mission in missions:
            mission.advance(row.heard_at_s + 1e-6)
        one, other = (mission.auvs() for mission in missions)
        assert np.abs(one.estimate[auv] - other.estimate[auv]).max() < 1e-9
        assert np.abs(one.covariance[auv] - other.covariance[auv]).max() < 1e-9


def test_intersection_never_knows_more_than_all_together_and_naive_does() -> None:
    """AUVs that tell each other the same again and again learn nothing new by that."""
    found = {}
    for fusion in FUSIONS:
        asked = held(
            SPOTS, {"every_s": 4.0, "fusion": fusion}, duration_s=120.0,
            navigation={"initial_position_sd_m": 2.0, "depth_sd_m": 0.0},
        )  # fmt: skip
        found[fusion] = covariances(simulate(asked, 2))
    for intersection, bound in zip(found["intersection"], found["centralised"], strict=True):
        assert np.linalg.eigvalsh(intersection - bound).min() > -1e-9
        assert np.trace(intersection) < 2 * 2.0**2  # yet it has learnt something
    surest = [np.trace(spread) for spread in found["naive"]]
    assert max(surest) < 0.5 * min(np.trace(spread) for spread in found["centralised"])


SLOW = pytest.mark.slow


ALIKE = {"velocity_bias_m_per_s": [0.06, 0.06], "velocity_bias_sd_m_per_s": 0.0}
FLOWN = [{}, {"peers": {"bearing": "array"}}, {"peers": {"kind": "twtt"}}, ALIKE]


@pytest.mark.parametrize("navigation", FLOWN, ids=["owtt", "array", "twtt", "one bias of all"])
@pytest.mark.parametrize("seeds", [4, pytest.param(80, marks=SLOW)])
def test_covariances_are_right_or_careful(navigation: dict[str, Any], seeds: int) -> None:
    """NEES, 2 where they are right: centralised is, intersection is no surer, naive is far off.

    What all AUVs have in common, such as a bias that is the same for all, is known to be so.
    """
    nees = {fusion: list[float]() for fusion in FUSIONS}
    for fusion in FUSIONS if seeds > 10 else ("intersection", "centralised"):
        asked = swimming(
            navigation=merged(navigation, {"peers": {"every_s": 5.0, "fusion": fusion}})
        )
        nees[fusion] = [simulate(asked, seed).mission.nees.item() for seed in range(seeds)]
    half = 3.5 * np.std(nees["centralised"]) / np.sqrt(seeds)
    assert abs(np.mean(nees["centralised"]) - 2.0) < half
    assert np.mean(nees["intersection"]) < 2.0 + half
    if seeds > 10:
        assert np.mean(nees["naive"]) > 3.0


def test_angles_and_depths_alone_hold_a_team_together() -> None:
    """No AUV hears a vessel or needs a clock: those at several depths see each other by arrays."""
    errors = {}
    for fusion in (None, "centralised"):
        peers = {"kind": "angles", "bearing": "array", "every_s": 5.0, "fusion": fusion}
        asked = held(
            SPOTS, peers if fusion else {}, duration_s=100.0,
            survey={"depths_m": [5.0, 40.0, 80.0, 20.0]},
            navigation={"initial_position_sd_m": 3.0},
        )  # fmt: skip
        if fusion is None:
            asked = asked.model_copy(
                update={"navigation": asked.navigation.model_copy(update={"peers": None})}
            )
        runs = [simulate(asked, seed) for seed in range(4)]
        errors[fusion] = np.mean([run.mission.position_error_m.item() for run in runs])
        if fusion:
            told = ranges(runs[0])
            assert told.range_m.isna().all()
            assert told.azimuth_error_deg.abs().max() < 6 * told.azimuth_sd_deg.max()
    # four that err alike and know how they lie to each other err by half together
    assert errors["centralised"] < 0.75 * errors[None]


# What else knows of it


def test_folders_keep_it_and_explain_words_it(tmp_path: Any) -> None:
    """A fix is told with what the AUV had from its peers; the tables come back from the folder."""
    result = simulate(swimming(navigation={"peers": {"every_s": 5.0}}), 1)
    result.write(tmp_path / "out")
    pd.testing.assert_frame_equal(ranges(load_result(tmp_path / "out")), ranges(result))
    taken = ranges(result).dropna(subset="correction_m")
    fixes = result.tables["fixes"].query("outcome == 'delivered'")
    first = taken.iloc[0]
    late = fixes[(fixes.auv == first.auv) & (fixes.delivered_at_s > first.heard_at_s)]
    said = explained(result, fix=int(late.fix.iloc[0]))
    assert f"measurement of a peer that was taken, of {first.sender}" in said


WRONG = [
    ({"filter": "smoother"}, {}, "navigation.filter", "use kalman"),
    ({}, {"protocol": {"ranging": "passive"}}, "navigation.peers", "needs AUVs that ping in slots"),
    ({}, {"protocol": {"access": "aloha"}}, "navigation.peers", "needs AUVs that ping in slots"),
    ({"peers": {"kind": "angles"}}, {}, "navigation.peers.bearing", "use array"),
    ({"peers": {"every_s": 0.5}}, {}, "navigation.peers.every_s", "3 AUVs need"),
    ({"peers": {"kind": "twtt", "every_s": 1.5}}, {}, "navigation.peers.every_s", "use at least"),
    ({"peers": {"message_bytes": 0}}, {}, "navigation.peers.message_bytes", "must be >= 1"),
    ({"peers": {"fusion": "best"}}, {}, "navigation.peers.fusion", "must be one of intersection"),
]  # fmt: skip


@pytest.mark.parametrize(("navigation", "others", "key", "words"), WRONG, ids=lambda it: str(it))
def test_what_cannot_be_is_refused(
    navigation: dict[str, Any], others: dict[str, Any], key: str, words: str
) -> None:
    """With the key, and what to do."""
    asked = merged({"peers": {}}, navigation)
    with pytest.raises(ValueError, match=words) as caught:
        swimming(navigation=asked, **others)
    assert key.split(".")[-1] in str(caught.value)
