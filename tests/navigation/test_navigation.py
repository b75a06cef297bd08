"""Drift and its correction, against closed forms."""

import json
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from worlds import believed, blank, fixed_gain, lanes_over_square, scenario

from bindusbl_des import DeadReckoning, simulate
from bindusbl_des.core.arrays import Floats
from bindusbl_des.core.spreads import drift_rms
from bindusbl_des.geometry.paths import Path as RoutePath
from bindusbl_des.geometry.paths import Pose, Segment
from bindusbl_des.navigation.dead_reckoning import random_walk
from bindusbl_des.records.rows import FIX
from bindusbl_des.vehicles.motion import together
from bindusbl_des.vehicles.reckoning import steady
from bindusbl_des.vehicles.vehicle import Place, SegmentedTrajectory, kinematic, moored, recorded

CHECKS = json.loads((Path(__file__).parents[1] / "reference" / "physics_checks.json").read_text())
BIAS = (0.06, 0.06)


def boustrophedon() -> SegmentedTrajectory:
    """Return a vehicle on legs of 60 m, 10 m apart, at 1.5 m/s (legs of 40 s, turns of 10.47 s)."""
    turn = math.pi * 5
    legs = []
    for leg in range(4):
        legs += [Segment(0.0, 60.0), Segment(0.2 if leg % 2 == 0 else -0.2, turn)]
    return kinematic(RoutePath(Pose(0, 0, 0), tuple(legs)), 1.5, 10.0)


def bias_drift(frame: str, times: Floats, headings: Floats) -> Floats:
    """Return the drift (n, 2), m, of the bias by eq. dead_reckoning."""
    if frame == "world":
        return np.outer(times, BIAS)
    (ahead, aside), (cosine, sine) = BIAS, headings.T
    return np.column_stack((cosine * ahead - sine * aside, sine * ahead + cosine * aside))


def test_body_bias_cancels_on_legs_there_and_back() -> None:
    """On a boustrophedon the drift is a triangle wave: legs cancel pairwise, turns accumulate."""
    vehicle, turn = boustrophedon(), math.pi * 5 / 1.5
    times = np.cumsum([40, turn, 40, turn, 40, turn, 40])
    drift = bias_drift("body", times, vehicle.heading_integral(times))
    expected = [
        (2.4, 2.4),
        (2.0, 2.8),
        (-0.4, 0.4),
        (-0.8, 0.8),
        (1.6, 3.2),
        (1.2, 3.6),
        (-1.2, 1.2),
    ]
    assert drift == pytest.approx(np.array(expected), abs=1e-9)


def test_heading_integrals_agree_with_quadrature() -> None:
    """Whatever the path, the integral of the heading is that of fine steps."""
    track = recorded(np.array([1.0, 4.0, 9.0]), np.array([[0, 0, 5], [3, 0, 5], [3, 5, 6.0]]))
    lanes = lanes_over_square(60, 3, 1, spacing=5.0, margin=5.0, radius=4.0)
    for vehicle in (track, kinematic(lanes, 0.9, 10.0), boustrophedon()):
        steps = (np.arange(200_000) + 0.5) * 1e-3
        yaw = vehicle.sample(steps)[:, 3]
        sums = np.cumsum(np.column_stack((np.cos(yaw), np.sin(yaw))), axis=0) * 1e-3
        ends = steps[999::20_000] + 0.5e-3
        assert vehicle.heading_integral(ends) == pytest.approx(sums[999::20_000], abs=2e-3)


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
    """The RMS drift on a straight leg is linear in time, not quadratic."""
    assert drift_rms(time, BIAS, 0.027) == pytest.approx(rms)


def test_between_samples_the_drift_is_linear() -> None:
    """The IMU holds its velocity between samples."""
    noise = np.zeros((1, 5, 2))
    noise[0, 1:] = np.random.default_rng(0).standard_normal((4, 2))
    still = together([moored(Place(3.0, 4.0, 5.0, 0.0)).legs])
    [walk] = walks = random_walk(2.0, 1.0, noise)
    reckoning = DeadReckoning(still, steady(walks, 2.0, (0.0, 0.0), False))
    middle = (np.array(reckoning.at(0, 0.5)) + np.array(reckoning.at(0, 1.0))) / 2
    assert reckoning.at(0, 0.75) == pytest.approx(middle)
    truth, odometry = reckoning.sample(0, np.array([0.75, 2.0]))
    drift = odometry.position - truth[:, :2]
    assert truth[0].tolist() == [3.0, 4.0, 5.0, 0.0]
    assert truth[0, :2] + drift[0] == pytest.approx(middle)
    assert reckoning.at(0, 2.0) == pytest.approx(truth[1, :2] + drift[1])
    assert np.array(reckoning.at(0, 2.0)) - (3.0, 4.0) == pytest.approx(walk[4])
    last = np.array(reckoning.at(0, 1.75)) - (3.0, 4.0)
    assert last == pytest.approx((walk[3] + walk[4]) / 2)


def test_a_random_walk_sums_up_steps_of_its_own_scale() -> None:
    """At 4 Hz a walk of 3 m/sqrt(s) takes steps of 1.5 m times its noise, from where it begins."""
    noise = np.array([[[10.0, 0.0], [1.0, 2.0], [-1.0, 0.0]], [[0.0, 0.0], [0.0, 4.0], [2.0, 0.0]]])
    assert random_walk(4.0, 3.0, noise).tolist() == [
        [[10.0, 0.0], [11.5, 3.0], [10.0, 3.0]],
        [[0.0, 0.0], [0.0, 6.0], [3.0, 6.0]],
    ]


@pytest.mark.parametrize("frame", ["body", "world"])
def test_a_bias_carries_dead_reckoning_along_the_way_travelled(frame: str) -> None:
    """Dead reckoning is truth plus the drift of its bias, on legs and in turns."""
    vehicle = boustrophedon()
    reckoning = DeadReckoning(
        together([vehicle.legs]), steady(np.zeros((1, 2, 2)), 1.0, BIAS, frame == "body")
    )
    times = np.array([0.0, 12.3, 45.0, 130.7, 250.0])
    expected = bias_drift(frame, times, vehicle.heading_integral(times))
    truth, odometry = reckoning.sample(0, times)
    drift = odometry.position - truth[:, :2]
    assert odometry.headings == pytest.approx(vehicle.heading_integral(times))
    assert truth == pytest.approx(vehicle.sample(times))
    assert drift == pytest.approx(expected, abs=1e-12)
    assert reckoning.at(0, 45.0) == pytest.approx(truth[2, :2] + expected[2])


def fixes_of(auvs: int, valid_at: float, delivered_at: float) -> np.ndarray:
    """Return the rows of one fix for each AUV, at (0, 0) and of the same instants (s)."""
    fixes = blank(FIX, auvs)
    fixes["auv"] = np.arange(auvs)
    fixes["valid_at_s"], fixes["delivered_at_s"] = valid_at, delivered_at
    fixes["x_m"] = fixes["y_m"] = 0.0
    return fixes


CASES = {
    "tau0": (0.0, 0.0, "none"),
    "tau.57_v.63": (0.57, 0.63, "none"),
    "tau.57_comp": (0.57, 0.63, "shift"),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("period", [1.59, 4.02])
def test_fixed_gain_reaches_its_closed_form(case: str, period: float) -> None:
    """Under regular fixes the error settles at the closed forms, before and after each."""
    latency, speed, compensation = CASES[case]
    runs, fixes, bias, sigma, fix_sd, gain = 4000, 12, 0.06, 0.027, 0.5, 0.9
    step, auvs = 0.03, 500  # a whole number of steps in every period and latency; a fleet's size
    rng = np.random.default_rng(3)
    track = recorded(np.array([0.0, 100.0]), np.array([[0, 0, 5], [speed * 100, 0, 5]]))
    motion, steps = together([track.legs] * auvs), round(fixes * period / step)
    before, after = np.empty((2, runs // auvs, auvs))
    for fleet in range(runs // auvs):
        noise = np.zeros((auvs, steps + 1, 2))
        noise[:, 1:] = rng.standard_normal((auvs, steps, 2))
        walks = random_walk(1 / step, sigma, noise)
        reckoning = DeadReckoning(motion, steady(walks, 1 / step, (bias, 0.0), False))
        navigator = fixed_gain(reckoning, gain, compensation, np.zeros((auvs, 2)))
        for k in range(1, fixes + 1):
            pinged, now = k * period - latency, k * period
            if k == fixes:
                before[fleet] = [believed(navigator, reckoning, it, now)[0] for it in range(auvs)]
            made = fixes_of(auvs, pinged, now)
            made["x_m"] = speed * pinged + fix_sd * rng.standard_normal(auvs)
            navigator.correct(made, np.arange(auvs))
        after[fleet] = [believed(navigator, reckoning, it, now)[0] for it in range(auvs)]
    expected = {m: CHECKS[f"fixed_gain T={period:g} {case} {m}"]["value"] for m in
                ("m_minus", "m_plus", "V_minus", "V_plus")}  # fmt: skip
    for places, side in ((before, "minus"), (after, "plus")):
        spread = math.sqrt(expected[f"V_{side}"])
        errors = places - speed * fixes * period
        assert errors.mean() == pytest.approx(expected[f"m_{side}"], abs=4 * spread / runs**0.5)
        assert errors.var() == pytest.approx(expected[f"V_{side}"], rel=4 * math.sqrt(2 / runs))


def test_overlapping_fixes_are_not_charged_twice() -> None:
    """A fix pinged before, but delivered after another's correction, does not correct again."""
    still = together([moored(Place(10.0, 0.0, 5.0, 0.0)).legs])
    reckoning = DeadReckoning(still, steady(np.zeros((1, 2, 2)), 1.0, (0.0, 0.0), False))
    navigator = fixed_gain(reckoning, 1.0, "shift", np.zeros((1, 2)))
    fixes = np.concatenate((fixes_of(1, 1.0, 3.0), fixes_of(1, 2.0, 4.0)))
    navigator.correct(fixes, np.array([0]))
    assert believed(navigator, reckoning, 0, 3.0) == [0.0, 0.0]
    navigator.correct(fixes, np.array([1]))
    assert fixes["innovation_m"].tolist() == [10.0, 0.0]
    assert fixes["correction_m"].tolist() == [10.0, 0.0]
    assert believed(navigator, reckoning, 0, 4.0) == [0.0, 0.0]


def test_a_fix_corrects_only_the_auv_that_it_locates() -> None:
    """Navigators of a fleet keep apart; corrections go where they are wanted."""
    places = ((10.0, 0.0), (20.0, 5.0), (30.0, 7.0))
    still = together([moored(Place(x, y, 5.0, 0.0)).legs for x, y in places])
    reckoning = DeadReckoning(still, steady(np.zeros((3, 2, 2)), 1.0, (0.0, 0.0), False))
    wanted = np.zeros((3, 2))
    navigator = fixed_gain(reckoning, 0.5, "none", wanted)
    fixes = fixes_of(3, 1.0, 3.0)
    navigator.correct(fixes, np.array([2, 0]))
    assert wanted.tolist() == [[-5.0, 0.0], [0.0, 0.0], [-15.0, -3.5]]
    places = [believed(navigator, reckoning, auv, 3.0) for auv in range(3)]
    assert places == [[5, 0], [20, 5], [15, 3.5]]
    assert fixes["correction_m"][[0, 2]] == pytest.approx([5.0, np.hypot(15.0, 3.5)])
    assert np.isnan([fixes[1]["innovation_m"], fixes[1]["correction_m"]]).all()


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
