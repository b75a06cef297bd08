"""Drift and its correction, against closed forms."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from played_for_tests import played
from test_estimates import Keeping
from worlds import merged, scenario

from bindusbl_des import Setup, Sounding, broadcast, ping_group, simulate, until

CHECKS = json.loads((Path(__file__).parents[1] / "reference" / "physics_checks.json").read_text())
BIAS = (0.06, 0.03)


@pytest.mark.parametrize("frame", ["body", "world"])
def test_a_bias_carries_dead_reckoning_along_the_way_travelled(frame: str) -> None:
    """Dead reckoning is truth plus the integral of the bias, which turns with the body, on legs and
    in turns; there and back it cancels.
    """
    world = scenario(
        duration_s=200.0, survey={"side_m": 60.0},
        navigation={
            "velocity_bias_m_per_s": list(BIAS), "random_walk_m_per_sqrt_s": 0.0,
            "bias_frame": frame,
        },
        record={"tracks_hz": 50.0},
    )  # fmt: skip
    for _, own in simulate(world).tables["tracks"].groupby("vehicle", observed=True):
        if own.imu_x_m.isna().any():
            continue  # an ASV
        yaw = own.yaw_rad.to_numpy() if frame == "body" else np.zeros(len(own))
        rates = np.exp(1j * yaw) * complex(*BIAS)
        sums = np.append(0.0, np.cumsum((rates[1:] + rates[:-1]) / 2.0)) / 50.0
        drift = (own.imu_x_m - own.x_m) + 1j * (own.imu_y_m - own.y_m)
        assert np.abs(drift - sums).max() < 5e-3
        assert (np.abs(drift).max() > 10.0) == (frame == "world")


def test_drift_has_the_mean_and_covariance_of_its_model() -> None:
    """Over 400 missions the drift at 100 s has mean b t and variance sigma^2 t per axis."""
    count, end, sigma = 400, 100.0, 0.5
    hold = {"kind": "hold", "positions_m": [[500.0, 0.0]] * count}
    navigation = {"random_walk_m_per_sqrt_s": sigma}
    tracks = simulate(
        scenario(
            duration_s=end + 0.5, auvs={"count": count, "route": hold}, asvs={"count": 1},
            navigation=navigation, record={"tracks_hz": 0.01},
        )
    ).tables["tracks"]  # fmt: skip
    last = tracks[(tracks.time_s == end) & tracks.vehicle.str.startswith("AUV")]
    drift = np.column_stack((last.imu_x_m - 500.0, last.imu_y_m))
    sd = sigma * math.sqrt(end)
    assert drift.mean(axis=0) == pytest.approx([6.0, 6.0], abs=4 * sd / math.sqrt(count))
    # the standard error of a variance is sqrt(2 / n), that of a correlation 1 / sqrt(n)
    assert drift.var(axis=0) == pytest.approx([sd**2] * 2, rel=4 * math.sqrt(2 / count))
    assert abs(np.corrcoef(drift.T)[0, 1]) < 4 / math.sqrt(count)


@pytest.mark.parametrize(
    ("time", "rms"),
    [(1.59, 0.143249921), (4.02, 0.349594108), (60, 5.099752935), (300, 25.464434021)],
)
def test_drift_rms(time: float, rms: float) -> None:
    """The RMS drift of the paper on a straight leg is linear in time, not quadratic."""
    found = Setup(scenario()).own_sensors.straight_drift_rms(time, 0.627)
    assert found == pytest.approx(rms)


def test_between_samples_the_drift_is_linear() -> None:
    """The IMU holds its velocity between samples; from one to the next its steps are a walk's."""
    hold = {"kind": "hold", "positions_m": [[3.0, 4.0]] * 200}
    world = scenario(
        duration_s=20.0, auvs={"count": 200, "route": hold}, asvs={"count": 1},
        navigation={"imu_rate_hz": 2.0, "velocity_bias_m_per_s": [0, 0],
                    "random_walk_m_per_sqrt_s": 3.0, "initial_position_sd_m": 1.0},
        record={"tracks_hz": 8.0},
    )  # fmt: skip
    tracks = simulate(world).tables["tracks"]
    tracks = tracks[tracks.vehicle.str.startswith("AUV")]
    drift = np.stack([own.imu_x_m - 3.0 for _, own in tracks.groupby("vehicle", observed=True)])
    samples = drift[:, ::4]
    for part in (1, 2, 3):
        between = samples[:, :-1] + part / 4.0 * np.diff(samples, axis=1)
        assert drift[:, part::4][:, : between.shape[1]] == pytest.approx(between, abs=1e-9)
    steps = np.diff(samples, axis=1)
    assert steps.std() == pytest.approx(3.0 / math.sqrt(2.0), rel=4 / math.sqrt(2 * steps.size))
    assert np.abs(np.corrcoef(steps.T) - np.eye(steps.shape[1])).max() < 5.0 / math.sqrt(200)


CASES = {
    "tau0": (0.0, 0.0, "none"),
    "tau.57_v.63": (0.57, 0.63, "none"),
    "tau.57_comp": (0.57, 0.63, "shift"),
}


def half_a_metre_off(sounding: Sounding) -> tuple[np.ndarray, np.ndarray]:
    """Measure a place with an error of 0.5 m along each axis."""
    off = sounding.random.normal(0.0, 0.5, (len(sounding.asvs), 3))
    return sounding.source + off, np.tile(np.eye(3) / 4.0, (len(sounding.asvs), 1, 1))


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("period", [1.59, 4.02])
def test_fixed_gain_reaches_its_closed_form(case: str, period: float) -> None:
    """Under regular fixes the error settles at the closed forms, before and after each: over 2000
    fixes of a mission, of which neighbours hardly depend on each other with a gain of 0.9.
    """
    (latency, speed, compensation), count, step = CASES[case], 2000, 0.03
    lasts = (count + 1) * period
    told = {"model": "fixed_gain", "gain": 0.9, "delay_compensation": compensation}
    navigation = {
        "velocity_bias_m_per_s": [0.06, 0.0], "bias_frame": "world", "imu_rate_hz": 1.0 / step,
        "random_walk_m_per_sqrt_s": 0.027, "filter": told,
    }  # fmt: skip
    if latency == 0.0:
        gnss = {"every_s": period, "sd_m": 0.5}
        world = scenario(
            duration_s=lasts, survey={"depth_m": 0.3}, asvs={"count": 1},
            auvs={"count": 1, "route": {"kind": "hold", "positions_m": [[5e3, 0.0]]}},
            navigation=merged(navigation, {"gnss_fix": gnss}), record={"tracks_hz": 1.0 / step},
        )  # fmt: skip
    else:

        def downlink(network: Any, turn: Any, time: float) -> Any:
            yield from ping_group(network, turn, 0, time)
            yield until(network, time + latency - 0.5 - 3.0 / 1500.0)
            broadcast(network, turn, time + latency - 0.5 - 3.0 / 1500.0)
            yield until(network, time + period)
            return time + period

        way = [[(0.0, 0.0, 0.0, z), (lasts, speed * lasts, 0.0, z)] for z in (3.0, 0.0)]
        world = played(
            way[:1], way[1:], duration_s=lasts, hf_range=20.0, downlink=downlink,
            ranging="owtt_sync", protocol={"shortest_uplink_slot_s": 0.0, "broadcaster": "rotate"},
            usbl={"model": half_a_metre_off}, navigation=navigation,
            record={"tracks_hz": 1.0 / step},
        )  # fmt: skip
    tables = simulate(world, 3).tables
    fixes = tables["fixes"] if latency else tables["gnss_fixes"]
    track = tables["tracks"].query("vehicle == 'AUV0'")
    errors = (track.estimate_x_m - track.x_m).to_numpy()
    given = np.arange(10, count) * period + latency
    assert len(fixes) >= count
    expected = {m: CHECKS[f"fixed_gain T={period:g} {case} {m}"]["value"] for m in
                ("m_minus", "m_plus", "V_minus", "V_plus")}  # fmt: skip
    for later, side in ((-1.5, "minus"), (1.5, "plus")):
        found = errors[np.floor(given / step + later).astype(int)]
        spread, bound = math.sqrt(expected[f"V_{side}"]), 4.0 / math.sqrt(0.8 * found.size)
        close = bound * spread + 0.12 * step  # by which the bias goes on in two steps
        assert found.mean() == pytest.approx(expected[f"m_{side}"], abs=close)
        assert found.var() == pytest.approx(expected[f"V_{side}"], rel=bound * math.sqrt(2.0))


@pytest.mark.parametrize("compensation", ["none", "shift"])
def test_a_fixed_gain_moves_whom_the_fix_locates_by_its_share(compensation: str) -> None:
    """Of what it is off as it is delivered, or was off at its ping by all that is known then: so a
    fix that was pinged before, but delivered after another's correction, corrects by the rest.
    """
    told = {"model": "fixed_gain", "gain": 0.6, "delay_compensation": compensation}
    changes: dict[str, Any] = {
        "duration_s": 40.0, "survey": {"side_m": 60.0, "depth_m": 0.3}, "auvs": {"count": 2},
        "acoustics": {"mf": {"bit_rate_bps": 300.0}},
        "navigation": {"gnss_fix": {"every_s": 0.9}, "initial_position_sd_m": 3.0},
    }  # fmt: skip
    runs = [
        simulate(scenario(**merged(changes, {"navigation": {"filter": it}})), 3)
        for it in (Keeping, told)
    ]
    late = runs[1].tables["fixes"].query("outcome == 'delivered'")
    gnss = runs[1].tables["gnss_fixes"]
    gnss = gnss.assign(valid_at_s=gnss.fixed_at_s, delivered_at_s=gnss.fixed_at_s)
    both = pd.concat([late, gnss]).sort_values("delivered_at_s")
    off = dict.fromkeys(("AUV0", "AUV1"), np.zeros(2))
    for fix in both.itertuples():
        at = fix.valid_at_s if compensation == "shift" else fix.delivered_at_s
        [told_place] = Keeping.last.odometry(int(fix.auv[3:]), np.array([at])).position
        innovation = np.array([fix.x_m, fix.y_m]) - told_place - off[fix.auv]
        assert fix.innovation_m == pytest.approx(np.hypot(*innovation), abs=1e-9)
        assert fix.correction_m == pytest.approx(0.6 * np.hypot(*innovation), abs=1e-9)
        off[fix.auv] = off[fix.auv] + 0.6 * innovation
    assert len(late) > 10


def test_fixes_beat_dead_reckoning_in_a_mission() -> None:
    """Served AUVs stay within a metre, unserved ones drift linearly."""
    result = simulate(scenario(asvs={"count": 3}, navigation={"bias_frame": "world"}), 1)
    assert (result.auvs.imu_error_m > 10).all()
    assert (result.auvs.position_error_m < 1.5).all()


def test_each_seed_draws_its_inertial_systems() -> None:
    """Biases and starts have the spread asked for and do not depend on who else is there."""
    sd, start = 0.02, 1.5

    def tracks(seed: int, count: int) -> pd.DataFrame:
        world = scenario(
            duration_s=60.0,
            auvs={
                "count": count,
                "route": {"kind": "hold", "positions_m": [[500.0, 0.0]] * count},
            },
            asvs={"count": 1},
            navigation={
                "velocity_bias_m_per_s": [0.06, -0.01],
                "velocity_bias_sd_m_per_s": sd,
                "initial_position_sd_m": start,
                "random_walk_m_per_sqrt_s": 0.0,
            },
            record={"tracks_hz": 0.02},
        )
        own = simulate(world, seed).tables["tracks"]
        return own[own.vehicle.str.startswith("AUV")]

    drawn = pd.concat([tracks(seed, 20) for seed in range(20)])
    alone = tracks(7, 1)
    assert alone.imu_x_m.tolist() == tracks(7, 2).query("vehicle == 'AUV0'").imu_x_m.tolist()
    begin, later = drawn[drawn.time_s == 0.0], drawn[drawn.time_s == 50.0]
    off = np.stack([begin.imu_x_m - begin.x_m, begin.imu_y_m - begin.y_m])
    moved = np.stack([later.imu_x_m - later.x_m, later.imu_y_m - later.y_m]) - off
    bound = 4.0 / math.sqrt(2 * 400)  # four standard errors of a standard deviation
    assert off.std(axis=1) == pytest.approx(start, rel=bound)
    assert (moved / 50).std(axis=1) == pytest.approx(sd, rel=bound)
    assert (moved / 50).mean(axis=1) == pytest.approx([0.06, -0.01], abs=4 * sd / math.sqrt(400))
    assert abs(np.corrcoef(off[0], moved[0])[0, 1]) < 4 / math.sqrt(400)
