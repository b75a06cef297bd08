"""What holds for every mission: determinism, conservation, causality, independent streams."""

import gc
import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from properties.books import alone_on_a_band, causal, collide_by_overlap, conserved, finite
from worlds import scenario, still

from bindusbl_des import Mission, Result, Scenario, simulate

FINGERPRINT = """
import hashlib
from worlds import scenario
from bindusbl_des import simulate
result = simulate(scenario(duration_s=60.0), seed=3)
text = "".join(t.to_csv() for _, t in sorted(result.tables.items()))
found = hashlib.sha256(text.encode()).hexdigest()
"""


def busy(**changes: object) -> Scenario:
    """Return a mission in which everything happens: losses, collisions, every kind of outcome."""
    return scenario(
        duration_s=90.0,
        auvs={"count": 6, "speed_m_per_s": 2.0},
        acoustics={"loss": {"combine": "clamp_first"}, "mf": {"range_m": 70.0}},
        protocol={"positions": "last_fix"},
        **changes,
    )


def same(a: Result, b: Result) -> bool:
    return all(a.arrow[name].equals(b.arrow[name]) for name in a.arrow)


def test_same_scenario_and_seed_give_identical_tables() -> None:
    """A mission repeats bit for bit; another seed gives another mission."""
    assert same(simulate(busy(), 5), simulate(busy(), 5))
    assert not same(simulate(busy(), 5), simulate(busy(), 6))


def test_hash_seed_does_not_matter() -> None:
    """Two interpreters with different hash seeds agree on every cell: this one and a new one."""
    own: dict[str, Any] = {}
    exec(FINGERPRINT, own)
    seed = "2" if os.environ.get("PYTHONHASHSEED") == "1" else "1"
    path = os.pathsep.join([str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    other = subprocess.run(
        [sys.executable, "-c", f"{FINGERPRINT}print(found)"],
        env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert other.split() == [own["found"]]


@pytest.mark.parametrize(
    "downlink", ["sequential", "pipelined_round", "pipelined_group", "direct_reply"]
)
@pytest.mark.parametrize(
    "schedule", ["spatial_reuse", "dsatur", "one_per_slot", "round_robin", "random"]
)
@pytest.mark.parametrize("ranging", ["owtt_sync", "twtt"])
def test_everything_is_accounted_for(downlink: str, schedule: str, ranging: str) -> None:
    """Pings x ASVs = receptions; each reception and fix has one outcome; nothing is too early."""
    changes = {"downlink": downlink, "schedule": schedule, "ranging": ranging}
    for tick_rate in (None, 30.0):
        data = busy().model_dump(mode="json")
        data["protocol"] |= {**changes, "tick_rate_hz": tick_rate}
        data["duration_s"] = 20.0
        result = simulate(Scenario.model_validate(data), 1)
        for holds in (finite, causal, conserved, alone_on_a_band, collide_by_overlap):
            holds(result)


def test_a_further_asv_leaves_the_drift_as_it_was() -> None:
    """Dead reckoning without fixes is the same whoever listens."""
    one, three = simulate(scenario(asvs={"count": 1}), 4), simulate(scenario(asvs={"count": 3}), 4)
    columns = ["time_s", "vehicle", "imu_x_m", "imu_y_m", "estimate_z_m"]
    auvs = [
        r.tables["tracks"][lambda t: t.vehicle.str.startswith("AUV")][columns] for r in (one, three)
    ]
    pd.testing.assert_frame_equal(*auvs)


def test_a_further_auv_leaves_the_others_noise_as_it_was() -> None:
    """AUV0's drift noise does not depend on the size of the team."""

    def noise(count: int) -> np.ndarray:
        hold = {"kind": "hold", "positions_m": [[0.0, 0.0]] * count}
        tracks = simulate(scenario(auvs={"count": count, "route": hold})).tables["tracks"]
        return tracks[tracks.vehicle == "AUV0"].imu_x_m.to_numpy()

    assert np.array_equal(noise(1), noise(4))


def test_recording_does_not_change_the_mission() -> None:
    """What is recorded, and how often, leaves what happens unchanged."""
    full = simulate(busy(), 2)
    fast = simulate(busy(record={"tracks_hz": 10.0}), 2)
    summary = simulate(busy(record={"detail": "summary"}), 2)
    assert full.arrow["fixes"].equals(fast.arrow["fixes"])
    assert full.arrow["auvs"].equals(summary.arrow["auvs"])
    assert set(summary.arrow) == {"auvs", "mission"}


@pytest.mark.parametrize("variation", [0.0, 0.05])
def test_seeds_share_voyages_only_in_a_steady_current(variation: float) -> None:
    """Where the current varies each seed has its own; where it does not, none goes elsewhere."""
    mission = scenario(
        duration_s=20.0, survey={"side_m": 60.0}, record={"tracks_hz": 1.0},
        auvs={"count": 1, "vehicle": "bluerov2", "speed_m_per_s": 0.5},
        environment={"current_m_per_s": 0.1, "current_variation_m_per_s": variation,
                     "current_variation_time_s": 5.0},
    )  # fmt: skip
    one, other, again = (simulate(mission, seed).tables["tracks"].x_m[:20] for seed in (1, 2, 1))
    assert one.equals(again)
    assert one.equals(other) == (variation == 0.0)


def steering(compensation: str = "shift", **record: object) -> Scenario:
    """Return AUVs that steer by their fixes, which are delivered late on coarse ticks."""
    return scenario(
        duration_s=24.7,
        survey={"side_m": 60.0},
        auvs={"vehicle": "bluerov2", "speed_m_per_s": 0.5, "feedback": "estimate"},
        protocol={"tick_rate_hz": 7.0, "schedule": "round_robin", "frame_s": 3.0},
        navigation={
            "random_walk_m_per_sqrt_s": 0.3,
            "filter": {"model": "fixed_gain", "delay_compensation": compensation},
        },
        record=record,
    )


@pytest.mark.parametrize("compensation", ["none", "shift"])
def test_auvs_that_steer_by_fixes_do_so_whoever_looks(compensation: str) -> None:
    """An AUV steers by a fix from its delivery on, however often somebody asks where it is."""
    seen = []
    for every in (5.0, 0.013):
        looked = Mission(steering(compensation, tracks_hz=10.0), 3)
        for instant in np.arange(every, looked.scenario.duration_s, every):
            looked.advance(float(instant))
            looked.auvs()
        seen.append(looked.result())
    assert len(seen[0].arrow["fixes"]) > 5
    for name in ("tracks", "fixes"):
        assert seen[0].arrow[name].equals(seen[1].arrow[name])


def test_tracks_of_steering_auvs_go_on_to_the_end() -> None:
    """After the last ping an AUV goes on; a summary tells of the same way."""
    result = simulate(steering(tracks_hz=10.0), 3)
    summary = simulate(steering(detail="summary"), 3)
    assert result.arrow["auvs"].equals(summary.arrow["auvs"])
    assert result.arrow["mission"].equals(summary.arrow["mission"])
    for _, track in result.tables["tracks"].groupby("vehicle"):
        steps = np.hypot(track.x_m.diff(), track.y_m.diff())
        assert steps.max() < 0.1 * 0.8  # m in a tenth of a second


@pytest.mark.parametrize("rounds", [30, 100, 258, 1000])
def test_a_round_that_would_begin_at_the_end_is_none(rounds: int) -> None:
    """Seven sixths of a second, added 258 times, come to a little less than 301 s."""
    acoustics = {"hf": {"range_m": 50}}
    frame = {"schedule": "random", "frame_s": 1.0}
    fleet = {"auvs": {"count": 2}, "asvs": {"count": 2}}
    mission = {"name": "m", **fleet, "protocol": frame, "acoustics": acoustics}
    flown = Scenario.model_validate({**mission, "duration_s": rounds * 7.0 / 6.0})
    began = simulate(flown).tables["rounds"].started_at_s
    assert began[1] == pytest.approx(7.0 / 6.0)
    assert len(began) == rounds


def test_a_frame_is_delivered_as_far_as_the_mission_goes() -> None:
    """A fix that arrives at the mission's end is in flight; others of its frame are delivered."""
    # two slots of 0.1 s, 40 bytes in 0.32 s, 20 m and 40 m of way
    first, second = 0.52 + 20 / 1500, 0.52 + 40 / 1500

    def fixes(end: float, *outcomes: str) -> pd.DataFrame:
        result = simulate(still(
            2, duration_s=end, survey={"depth_m": 0.0},
            auvs={"route": {"positions_m": [[20.0, 0.0], [40.0, 0.0]]}},
            asvs={"formation": {"positions_m": [[0.0, 0.0]]}},
            protocol={"tick_rate_hz": None},
        ))  # fmt: skip
        fixes = result.tables["fixes"].sort_values("auv")
        delivered = np.array(outcomes) == "delivered"
        assert fixes.outcome.tolist() == list(outcomes)
        assert fixes.innovation_m.notna().tolist() == delivered.tolist()
        assert result.auvs.fixes_delivered.tolist() == delivered.astype(int).tolist()
        assert result.auvs.fixes_in_flight.tolist() == (~delivered).astype(int).tolist()
        return fixes

    both = fixes(0.6, "delivered", "delivered")
    assert both.broadcast_at_s.tolist() == pytest.approx([0.2, 0.2])
    assert both.delivered_at_s.tolist() == pytest.approx([first, second])
    arrives = float(both.delivered_at_s.iloc[1])
    for end in (0.54, arrives):
        cut = fixes(end, "delivered", "in_flight")
        assert cut.delivered_at_s.iloc[0] == both.delivered_at_s.iloc[0]
        assert cut[["delivered_at_s", "latency_s"]].iloc[1].isna().all()
    fixes(math.nextafter(arrives, 1.0), "delivered", "delivered")


DIRECTION = ["azimuth_deg", "elevation_deg", "body_azimuth_deg", "body_elevation_deg"]


@pytest.mark.parametrize("downlink", ["pipelined_group", "direct_reply"])
@pytest.mark.parametrize("steers", [False, True])
def test_a_shorter_mission_is_the_beginning_of_a_longer_one(steers: bool, downlink: str) -> None:
    """Cut anywhere, a mission has what happened before the cut; the rest is in flight."""
    mission = steering() if steers else busy()
    data = mission.model_dump(mode="json")
    schedule = "one_per_slot" if steers else "schedules_for_tests:all_at_once"
    data["protocol"] |= {"downlink": downlink, "tick_rate_hz": None, "schedule": schedule}

    def tables(duration: float) -> tuple[pd.DataFrame, pd.DataFrame]:
        cut = Scenario.model_validate({**data, "duration_s": duration})
        result = simulate(cut, 3)
        return result.tables["fixes"], result.tables["receptions"]

    long, heard = tables(20.0)
    frames = long[long.outcome == "delivered"].groupby("broadcast_at_s").delivered_at_s
    ends = [end for _, arrivals in frames for end in (arrivals.max(), arrivals.mean())]
    ping_s = mission.acoustics.hf.ping_s
    passes = heard[heard.outcome != "out_of_range"].groupby("ping").arrived_at_s.max() + ping_s
    for end in (*ends[:: len(ends) // 8], *passes[2 :: len(passes) // 4], 7.77):
        cut, heard_then = tables(float(end))
        late = (heard.arrived_at_s + ping_s >= end) & (heard.outcome != "out_of_range")
        expected = heard.assign(outcome=heard.outcome.mask(late, "in_flight"))[: len(heard_then)]
        unmade = late if downlink == "direct_reply" else late.groupby(heard.ping).transform("any")
        expected.loc[unmade[: len(heard_then)], DIRECTION] = np.nan  # measured for the fix
        expected.loc[late[: len(heard_then)], ["why", "overlapped_by"]] = None
        pd.testing.assert_frame_equal(heard_then, expected)
        # what has not happened by the end
        fixes = long[: len(cut)].copy()
        fixes.loc[fixes.broadcast_at_s >= end, "broadcast_by"] = None
        fixes.loc[fixes.broadcast_at_s >= end, "broadcast_at_s"] = np.nan
        later = (fixes.outcome == "delivered") & (fixes.delivered_at_s >= end)
        late_columns = ["delivered_at_s", "latency_s", "innovation_m", "correction_m", "nis"]
        fixes.loc[later, late_columns] = np.nan
        fixes.loc[later | fixes.broadcast_at_s.isna(), "outcome"] = "in_flight"
        pd.testing.assert_frame_equal(cut, fixes)
        under_way = set(heard_then[heard_then.outcome == "in_flight"].ping)
        if downlink != "direct_reply":
            assert set(cut.ping) == set(heard_then[heard_then.outcome == "heard"].ping) - under_way


@pytest.mark.parametrize("seed", [-1, 1.5, True, "1"])
def test_a_bad_seed_is_refused(seed: object) -> None:
    """A seed is a whole number, zero or more."""
    with pytest.raises(ValueError, match="seed must be a whole number"):
        simulate(scenario(duration_s=1.0), seed)  # type: ignore[arg-type]


@pytest.mark.parametrize("asvs", [1, 2, 3])
def test_fused_fixes_are_as_good_as_they_say(asvs: int) -> None:
    """Over a mission the errors of fixes agree with their own 3x3 covariances (NEES)."""
    world = scenario(
        survey={"side_m": 60.0},
        auvs={"count": 4, "vehicle": {"model": "kinematic", "turning_radius_m": 3.0}},
        asvs={"count": asvs, "formation": {"radius_m": 20.0}},
        acoustics={"hf": {"range_m": 100.0}},
    )
    nees = []
    for seed in range(3):
        result = simulate(world, seed)
        fixes = result.tables["fixes"].merge(
            result.tables["pings"], on="ping", suffixes=("", "_true")
        )
        assert (fixes.asvs.str.split().str.len() == asvs).all()
        error = np.array([fixes[f"{axis}_m"] - fixes[f"{axis}_m_true"] for axis in "xyz"]).T
        covariance = np.empty((len(fixes), 3, 3))
        for i, a in enumerate("xyz"):
            covariance[:, i, i] = fixes[f"sd_{a}_m"] ** 2
            for j, b in enumerate("xyz"):
                if i < j:
                    covariance[:, i, j] = covariance[:, j, i] = fixes[f"cov_{a}{b}_m2"]
        nees.append(np.einsum("ni,nij,nj->n", error, np.linalg.inv(covariance), error))
    found = np.concatenate(nees)
    # chi-square with 3 degrees of freedom, 4 sigma, and 2 % for what is beyond second order
    assert found.mean() == pytest.approx(3.0, abs=4 * np.sqrt(6 / len(found)) + 0.06)


@pytest.mark.parametrize(
    "keys",
    [
        *({}, {"downlink": "direct_reply"}, {"schedule": "aloha"}, {"ranging": "passive"}),
        *({"knowledge": "broadcast"}, {"schedule": "polling", "ranging": "twtt"}),
    ],
)
def test_a_mission_leaves_its_memory_as_it_ends(keys: dict[str, str]) -> None:
    """Nothing waits for what was still to come, so no circle has to be found by Python."""
    plan = scenario(duration_s=5.0, protocol=keys)
    simulate(plan)  # what numba compiles meanwhile leaves circles of its own
    gc.disable()
    try:
        before = records()
        simulate(plan)
        assert records() <= before
    finally:
        gc.enable()


def records() -> set[int]:
    """Return the records of missions, and their streams of noise, that are in memory."""
    return {id(it) for it in gc.get_objects() if type(it).__name__ in ("Recorder", "Streams")}
