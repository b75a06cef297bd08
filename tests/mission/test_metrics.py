"""Figures of merit, in worlds where they can be worked out by hand."""

import math
import re

import numpy as np
import pandas as pd
import pytest
from worlds import scenario, still

from bindusbl_des import Odometry, ScenarioError, load_scenario, simulate
from bindusbl_des.core.navigation.navigators import LinearNavigator


def test_a_ping_under_way_at_the_end_counts_for_nothing() -> None:
    """Coverage leaves out the ping that the end of the mission overtakes."""
    first = simulate(still(1, duration_s=0.02))
    assert first.auvs.pings[0] == 1
    assert first.arrow["auvs"]["hf_coverage"].null_count == 1
    assert first.tables["receptions"].outcome.tolist() == ["in_flight"]
    # the second ping starts at 0.5 s, and is heard 24.9 ms later
    both = simulate(still(1, duration_s=0.51))
    assert both.auvs.pings[0] == 2
    assert both.auvs.hf_coverage[0] == 1.0
    assert (both.auvs.pings_heard[0], both.auvs.pings_in_range[0]) == (1, 2)
    # the second frame starts with 10 ms to go, and occupies no more of the mission
    assert simulate(still(1, duration_s=0.61)).mission.mf_utilisation[0] == pytest.approx(
        (0.192 + 0.01) / 0.61
    )
    out_of_range = simulate(still(1, at=60.0, duration_s=0.51))
    assert out_of_range.auvs.hf_coverage[0] == 0.0


def test_overlapping_pings_use_the_channel_once() -> None:
    """Two AUVs that answer one call 1 m apart occupy HF for call, ping and 1 m of sound."""
    world = still(
        2,
        survey={"depth_m": 0.0},
        auvs={"route": {"kind": "hold", "positions_m": [[20.0, 0.0], [-21.0, 0.0]]}},
        protocol={"schedule": "schedules_for_tests:all_at_once", "ranging": "twtt"},
    )
    result = simulate(world)
    once = 0.010 + 0.010 + 1.0 / 1500
    assert result.mission.hf_utilisation[0] == pytest.approx(
        result.mission.rounds[0] * once / 300, rel=2e-3
    )


@pytest.mark.parametrize(("law", "slant", "probability"), [("head", 300.0, 0.684256481)])
def test_pings_are_lost_as_often_as_the_law_says(
    law: str, slant: float, probability: float
) -> None:
    """At 300 m the OEM head loses 68 % of the pings."""
    world = still(
        1,
        at=math.sqrt(slant**2 - 10**2),
        duration_s=1000.0,
        acoustics={"hf": {"range_m": 400.0}, "loss": {"law": law}},
        record={"detail": "summary"},
    )
    auv = simulate(world).auvs.iloc[0]
    spread = math.sqrt(probability * (1 - probability) / auv.pings)
    assert auv.receptions_lost / auv.pings == pytest.approx(probability, abs=4 * spread)


def test_intervals_and_rates_of_clockwork() -> None:
    """A still AUV alone gets a fix each round of 15 ticks: rate, interval and latency follow."""
    auv = simulate(still(1)).auvs.iloc[0]
    assert (auv.interval_mean_s, auv.interval_max_s) == pytest.approx((0.5, 0.5))
    assert auv.fix_rate_hz == pytest.approx(2.0)
    assert auv.latency_max_s == pytest.approx(10 / 30)  # slot 3 ticks, airtime and way 7
    assert auv.latency_from_broadcast_s == pytest.approx(7 / 30)
    assert auv.latency_from_slot_s == pytest.approx(7 / 30)


@pytest.mark.parametrize("gnss", [None, {"every_s": 3.7}])
def test_the_age_of_a_fix_is_that_of_a_fine_clock(gnss: dict[str, float] | None) -> None:
    """Mean, quantile and maximum of the sawtooth are those of a hundred thousand samples of it.

    An age begins at the ping of the newest fix, however late that or others came.
    """
    world = scenario(
        duration_s=100.0, survey={"side_m": 80.0, "depth_m": 0.3},
        acoustics={"mf": {"bit_rate_bps": 150.0}}, navigation={"gnss_fix": gnss, "nis_gate": None},
    )  # fmt: skip
    result = simulate(world, 3)
    for auv in result.auvs.itertuples():
        fixes = result.tables["fixes"].query("auv == @auv.auv and outcome == 'delivered'")
        taken = fixes[["delivered_at_s", "pinged_at_s"]].to_numpy(float)
        if gnss:
            own = result.tables["gnss_fixes"].query("auv == @auv.auv").fixed_at_s.to_numpy()
            taken = np.vstack([taken, np.column_stack([own, own])])
        taken = taken[np.argsort(taken[:, 0])]
        assert len(taken) > 8
        times = (np.arange(100_000) + 0.5) / 1000
        newest = np.append(0.0, np.maximum.accumulate(taken[:, 1]))
        since = times - newest[np.searchsorted(taken[:, 0], times, side="right")]
        assert auv.fix_age_mean_s == pytest.approx(since.mean(), abs=2e-3)
        assert auv.fix_age_p95_s == pytest.approx(np.quantile(since, 0.95), abs=2e-2)
        assert auv.fix_age_max_s == pytest.approx(since.max(), abs=1e-2)


def test_what_all_fixes_say_of_a_network() -> None:
    """Jain's index, bits a second and latencies are those of the table of fixes."""
    for keys in ([], ["protocol.ranging=passive"]):
        result = simulate(load_scenario("recovery_140m", overrides=["duration_s=60", *keys]), 1)
        fixes, mission = result.tables["fixes"], result.mission.iloc[0]
        done = fixes[fixes.outcome == "delivered"]
        each = np.array([(done.auv == f"AUV{n}").sum() for n in range(3)])
        assert mission.fairness == pytest.approx(each.sum() ** 2 / (3 * (each**2).sum()))
        if keys:
            assert math.isnan(mission.throughput_bps)
        else:
            assert mission.throughput_bps == pytest.approx(8 * 16 * len(done) / 60.0)
        assert mission.fix_latency_p50_s == pytest.approx(np.median(done.latency_s))
        assert mission.fix_latency_p95_s == pytest.approx(np.quantile(done.latency_s, 0.95))
    lost = simulate(load_scenario("recovery_140m", overrides=["acoustics.mf.range_m=0.1"]), 1)
    row = lost.mission.iloc[0]
    assert row.throughput_bps == 0.0
    assert row[["fairness", "fix_latency_p50_s", "fix_latency_p95_s"]].isna().all()


def test_who_lost_his_fixes_early_is_the_worst() -> None:
    """Two AUVs, one out of everybody's range: it has no interval, and the oldest fix."""
    mission = simulate(
        scenario(
            duration_s=60.0,
            auvs={"count": 2, "route": {"kind": "hold", "positions_m": [[5, 0], [500, 0]]}},
            asvs={"count": 1},
        )
    ).mission.iloc[0]
    assert mission.fix_age_max_s > 30.0
    assert (mission.worst_fix_age_max_s, mission.worst_fix_age_max_s_auv) == (60.0, "AUV1")
    assert mission.worst_fix_age_mean_s == pytest.approx(30.0)
    assert math.isnan(mission.worst_interval_mean_s)
    assert mission.worst_interval_mean_s_auv == "AUV1"
    assert (mission.worst_fixes_delivered, mission.worst_hf_coverage) == (0.0, 0.0)
    assert pd.isna(mission.worst_saturated_share_auv)  # nobody has actuators
    assert "worst_distance_m" not in mission
    assert "worst_pings" not in mission


def test_nobody_is_worse_than_the_worst() -> None:
    """Of errors, ages and losses who has most, of fixes and shares who has least; the first of
    equals, and who lacks what others have before all.
    """
    least = {"pings_in_range", "pings_heard", "hf_coverage", "fixes", "fixes_delivered",
             "fix_rate_hz", "fix_benefit_m"}  # fmt: skip
    result = simulate(scenario(duration_s=60.0, auvs={"count": 6}, survey={"side_m": 200.0}), 2)
    auvs, mission = result.auvs, result.mission.iloc[0]
    names = [it[6:-4] for it in result.mission if it[:6] == "worst_" and it[-4:] == "_auv"]
    assert len(names) > 25
    assert least < set(names)
    for name in names:
        found, whose = mission[f"worst_{name}"], mission[f"worst_{name}_auv"]
        values = auvs[name].astype(float)
        if values.isna().all():
            assert pd.isna(found), name
        elif values.isna().any():
            assert auvs.auv[values.isna()].iloc[0] == whose, name
        else:
            assert found == (values.min() if name in least else values.max()), name
            assert whose == auvs.auv[values == found].iloc[0], name


def test_an_estimate_that_is_no_number_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rather than to pass for a missing value in every mean, it ends the run: whose, and when."""

    def lost(self: LinearNavigator, auv: int, odometry: Odometry) -> np.ndarray:
        past = odometry.times[:, None] >= 12.5
        return np.where(past & (auv == 1), math.nan, odometry.position)

    monkeypatch.setattr(LinearNavigator, "estimate", lost)
    with pytest.raises(ArithmeticError, match=r"AUV1's estimate is no number from 12\.5 s on"):
        simulate(still(2, duration_s=20.0, record={"detail": "summary"}))


@pytest.mark.parametrize("ranging", ["owtt_sync", "passive"])
def test_metrics_from_an_instant_on_leave_out_what_was_before(ranging: str) -> None:
    """Of two halves of a mission one is that of a mission half as long: pings, fixes and errors add
    up; one that nothing happened in is refused.
    """
    keys = ["record.detail=summary", f"protocol.ranging={ranging}"]
    halves = ([], ["duration_s=150"], ["record.metrics_from_s=150"])
    whole, first, second = (
        simulate(load_scenario("recovery_140m", overrides=[*keys, *half]), 3).auvs
        for half in halves
    )
    for name in ("pings", "pings_in_range", "pings_heard", "collisions"):
        assert (whole[name] - first[name] - second[name]).abs().max() <= 1  # one was under way
    for name in ("position_error_m", "imu_error_m", "cross_track_error_m"):
        assert np.allclose(2 * whole[name], first[name] + second[name], rtol=1e-12)
    assert np.allclose(2 * whole.fix_rate_hz, first.fix_rate_hz + second.fix_rate_hz)
    assert (second.fix_age_max_s <= whole.fix_age_max_s + 1e-9).all()
    with pytest.raises(ScenarioError, match=r"nothing is left to judge of 300 s from 300 s on"):
        load_scenario("recovery_140m", overrides=["record.metrics_from_s=300"])


def test_energy_of_a_fix_is_that_of_the_whole_mission() -> None:
    """As the energy is, from whatever instant on fixes are judged."""
    powers = {"transmit_w": 10.0, "receive_w": 0.5, "idle_w": 0.1}
    worlds = [
        scenario(acoustics={"hf": powers, "mf": powers}, record={"metrics_from_s": begin})
        for begin in (0.0, 20.0)
    ]
    whole, late = (simulate(world, 1).auvs for world in worlds)
    assert (late.fixes_delivered < whole.fixes_delivered).all()
    assert (late.energy_per_fix_j == whole.energy_per_fix_j).all()


@pytest.mark.parametrize(("duration", "begin", "rate"), [(30, 15, 0.05), (30, 15, 0.01), (9, 8, 1)])
def test_a_rate_too_low_to_judge_by_is_named(duration: float, begin: float, rate: float) -> None:
    """With one that would do."""
    asked = {"metrics_from_s": begin, "metrics_hz": rate}
    with pytest.raises(ValueError, match=r"s are left to judge, and record.metrics_hz") as told:
        scenario(duration_s=duration, record=asked)
    said = re.search(r"set it to (\S+),", str(told.value))
    assert said
    scenario(duration_s=duration, record={**asked, "metrics_hz": float(said[1])})


def test_headings_in_tables_are_within_half_a_turn() -> None:
    """However often a hull has turned about."""
    corners = [[0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [0.0, 20.0]]
    route = {"kind": "waypoints", "points_m": [[*corners, *corners, corners[0]]]}
    world = scenario(duration_s=170.0, auvs={"count": 1, "vehicle": "bluerov2", "route": route})
    tracks = simulate(world, 1).tables["tracks"]
    yaw = tracks[tracks.vehicle == "AUV0"].yaw_rad.to_numpy()
    assert np.ptp(np.unwrap(yaw)) > 2.4 * np.pi
    assert (np.abs(yaw) <= np.pi).all()
