"""What is known afterwards: against dense least squares, GTSAM, the filter, and the truth."""

import math
from typing import Any

import numpy as np
import pytest
from test_navigators import KALMAN, fixes_at, navigator_of

from bindusbl_des import DeadReckoning, Odometry, load_scenario, simulate
from bindusbl_des.navigation.belief import (
    MOMENT,
    STATES,
    Belief,
    Growth,
    carry,
    first_belief,
)
from bindusbl_des.navigation.smoother import Smoother
from bindusbl_des.navigation.smoothing import Sights, filtered, smooth, transition
from bindusbl_des.records.rows import Jacobians
from bindusbl_des.vehicles.motion import together
from bindusbl_des.vehicles.reckoning import DeadReckoned, steady
from bindusbl_des.vehicles.vehicle import recorded

WANDERING = Growth(0.03**2, 1e-4, True, 0, 6, np.full(2, 0.02), np.full(2, 30.0))
PLAIN = Growth(0.03**2, 1e-4, in_body=True)


def winding(count: int = 30, seed: int = 0) -> Odometry:
    """Return the odometry of an AUV that winds its way at 0.7 m/s, at random instants."""
    rng = np.random.default_rng(seed)
    times = np.sort(rng.uniform(0.0, 100.0, count))
    yaws = np.cumsum(rng.normal(0.0, 0.3, count))
    steps = np.diff(times, prepend=0.0)[:, None]
    headings = np.cumsum(np.column_stack((np.cos(yaws), np.sin(yaws))) * steps, axis=0)
    return Odometry(times, 0.7 * headings, headings)


def dr_at(odometry: Odometry, row: int) -> DeadReckoned:
    """Return what dead reckoning has told by one of its instants."""
    return DeadReckoned(
        float(odometry.times[row]),
        *odometry.position[row].tolist(),
        *odometry.headings[row].tolist(),
    )


def seen(states: int, nodes: int, count: int = 15, seed: int = 1) -> Sights:
    """Return sights of the error, and of the last state."""
    rng = np.random.default_rng(seed)
    rows = np.zeros((count, states))
    rows[:, :2], rows[:, -1] = rng.normal(size=(count, 2)), rng.normal(size=count)
    where = np.sort(rng.integers(0, nodes, count))
    return Sights(where, rows, rng.normal(size=count), rng.uniform(0.0, 0.5, count))


def moved_and_spread(
    moment: np.ndarray, told: DeadReckoned, growth: Growth, states: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return F and Q from one instant to another; `moment` is carried there."""
    blank = Belief(moment, np.zeros(states), np.zeros((states, states)))
    move = np.empty((states, states))
    transition(blank, told, growth, move)
    carry(blank, told, growth)
    return move, blank.covariance


@pytest.mark.parametrize("growth", [PLAIN, WANDERING], ids=["six states", "eight states"])
def test_smoothing_is_least_squares_over_all_sights(growth: Growth) -> None:
    """The states of all instants as one Gaussian vector, conditioned on all sights at once."""
    first = first_belief(0.5, (0.1, 0.2), 0.1, growth.sds.tolist())
    odometry, k = winding(), len(first.state)
    count = len(odometry.times)
    joint = np.zeros((count, count, k, k))
    moment, own = np.zeros(1, dtype=MOMENT), first.covariance
    for n in range(count):
        move, noise = moved_and_spread(moment, dr_at(odometry, n), growth, k)
        for m in range(n):
            joint[n, m] = move @ joint[n - 1, m]
            joint[m, n] = joint[n, m].T
        own = joint[n, n] = move @ own @ move.T + noise
    whole = joint.transpose(0, 2, 1, 3).reshape(count * k, count * k)
    sights = seen(k, count)
    told = np.zeros((len(sights.nodes), count, k))
    told[np.arange(len(sights.nodes)), sights.nodes] = sights.rows
    told = told.reshape(len(sights.nodes), -1)
    total = told @ whole @ told.T + np.diag(sights.variances)
    gain = np.linalg.solve(total, told @ whole).T
    states, spread = (gain @ sights.values).reshape(count, k), whole - gain @ told @ whole
    found = smooth(first, odometry, sights, growth)
    assert found.states == pytest.approx(states, abs=1e-8)
    spread = spread.reshape(count, k, count, k)
    own_spreads = np.array([spread[n, :, n] for n in range(count)])
    assert found.covariances == pytest.approx(own_spreads, abs=1e-8)
    last = filtered(first, odometry, sights, growth)
    assert last.state == pytest.approx(found.states[-1], abs=1e-12)
    assert last.covariance == pytest.approx(found.covariances[-1], abs=1e-12)


def test_what_is_known_exactly_stays_so() -> None:
    """No variance anywhere: sights change nothing, and make no NaN."""
    first, growth = first_belief(0.0, (0.0, 0.0), 0.0), Growth(0.0, 0.0, in_body=True)
    odometry = winding()
    sights = seen(STATES, len(odometry.times))._replace(variances=np.zeros(15))
    found = smooth(first, odometry, sights, growth)
    assert np.abs(found.states).max() == 0.0
    assert np.abs(found.covariances).max() == 0.0


@pytest.mark.parametrize(
    "growth",
    [
        PLAIN,
        WANDERING,
        Growth(0.01, 0.0, True, 6, 8, np.full(4, 0.02), np.array([math.inf, math.inf, 20, 20])),
        Growth(0.01, 0.0, False, 6, 0, np.full(2, 0.02), np.full(2, math.inf)),
    ],
)
def test_a_transition_is_what_carrying_does(growth: Growth) -> None:
    """F P F' + Q, with F written once more, is the covariance that a belief is carried to."""
    rng, k = np.random.default_rng(3), STATES + len(growth.sds)
    half = rng.normal(size=(k, k))
    moment = np.zeros(1, dtype=MOMENT)
    moment["at_s"], moment["cosine_s"], moment["x_m"] = 5.0, 3.0, 2.0
    told = DeadReckoned(11.0, 6.0, -2.0, 7.0, 2.5)
    state = 0.05 * rng.normal(size=k)
    belief = Belief(moment.copy(), state.copy(), half @ half.T)
    move, before = np.empty((k, k)), belief.covariance.copy()
    transition(belief, told, growth, move)
    carry(belief, told, growth)
    blank = Belief(moment.copy(), state.copy(), np.zeros((k, k)))
    carry(blank, told, growth)
    assert belief.covariance == pytest.approx(move @ before @ move.T + blank.covariance, abs=1e-10)


def reckoned(seconds: float = 120.0) -> DeadReckoning:
    """Return faultless dead reckoning on a way with two turns."""
    way = np.array([[0, 0, 5], [30, 0, 5], [30, 30, 5], [0, 30, 5]], dtype=float)
    track = recorded(np.linspace(0.0, seconds, 4), way)
    wrong = steady(np.zeros((1, 2, 2)), 1.0, (0.0, 0.0), in_body=False)
    return DeadReckoning(together([track.legs]), wrong)


def late_fixes(count: int, seed: int = 0) -> np.ndarray:
    """Return fixes that come late by up to 20 s, so not in the order in which they hold."""
    rng = np.random.default_rng(seed)
    pinged = np.sort(rng.uniform(0.0, 90.0, count))
    delivered = pinged + rng.uniform(0.1, 20.0, count)
    fixes = fixes_at(pinged.tolist(), delivered.tolist(), rng.normal(0.0, 3.0, (count, 2)), 0.5)
    fixes["sd_y_m"], fixes["cov_xy_m2"] = 0.8, 0.1
    return fixes[np.argsort(delivered)]


def smoother_of(
    fixes: np.ndarray, growth: Growth, first: Belief, lag: float | None = None
) -> Smoother:
    """Return a smoother that has had some fixes."""
    reckoning = reckoned()
    navigator = navigator_of(reckoning, KALMAN, growth, first)
    smoother = Smoother(navigator, reckoning, growth, first, lag)
    for row in range(len(fixes)):
        smoother.correct(fixes, np.array([row]))
    return smoother


STRETCHED = Growth(
    0.02**2, 1e-5, True, 6, 8, np.array([0.02, 0.03, 0.02, 0.02]),
    np.array([math.inf, math.inf, 25.0, 25.0]), step=7.0,
)  # fmt: skip


@pytest.mark.parametrize("growth", [PLAIN, STRETCHED], ids=["six states", "ten, in steps"])
def test_without_a_lag_it_is_the_filter(growth: Growth) -> None:
    """What is known at an instant then, and its covariance, out of order or not.

    Asked for one by one: what stretches the way is not linear, and a belief about one instant is
    carried on from the last that was asked for.
    """
    first = first_belief(0.5, (0.1, 0.2), 0.1, growth.sds.tolist())
    fixes = late_fixes(12)
    smoother = smoother_of(fixes, growth, first, lag=0.0)
    kalman = navigator_of(reckoned(), KALMAN, growth, first)
    for row in range(len(fixes)):
        kalman.correct(fixes, np.array([row]))
    for time in np.arange(0.0, 115.0, 2.3):
        odometry = reckoned().sample(0, np.array([time]))[1]
        for verb in ("estimate", "covariance"):
            found, asked = (getattr(it, verb)(0, odometry) for it in (smoother, kalman))
            assert found == pytest.approx(asked, abs=1e-9), (verb, time)


@pytest.mark.parametrize("lag", [5.0, 30.0])
def test_a_lag_is_the_whole_mission_as_known_then(lag: float) -> None:
    """At each instant: all fixes delivered up to the lag later, and no other."""
    first = first_belief(0.5, (0.1, 0.2), 0.1)
    fixes = late_fixes(12)
    smoother = smoother_of(fixes.copy(), PLAIN, first, lag)
    times = np.array([3.0, 20.0, 41.5, 60.0, 88.0, 110.0])
    found = smoother.estimate(0, reckoned().sample(0, times)[1])
    spreads = smoother.covariance(0, reckoned().sample(0, times)[1])
    for time, place, spread in zip(times, found, spreads, strict=True):
        known = fixes[fixes["delivered_at_s"] <= time + lag]
        then = smoother_of(known.copy(), PLAIN, first)
        odometry = reckoned().sample(0, np.array([time]))[1]
        assert then.estimate(0, odometry)[0] == pytest.approx(place, abs=1e-9)
        assert then.covariance(0, odometry)[0] == pytest.approx(spread, abs=1e-9)


def test_the_order_of_delivery_does_not_matter_afterwards() -> None:
    """Also of fixes that are too late for the filter's memory."""
    first, fixes = first_belief(0.5, (0.1, 0.2), 0.1), late_fixes(40)
    odometry = reckoned().sample(0, np.arange(0.0, 110.0, 2.0))[1]
    asked = smoother_of(fixes.copy(), PLAIN, first).estimate(0, odometry)
    oldest = int(np.argmin(fixes["valid_at_s"]))
    fixes["delivered_at_s"][oldest] = 119.0  # 39 later ones have been taken in
    fixes = np.append(np.delete(fixes, oldest), fixes[oldest])
    found = smoother_of(fixes[:-1], PLAIN, first)
    assert found.estimate(0, odometry) != pytest.approx(asked, abs=1e-9)
    found.correct(fixes, np.array([39]))
    assert found.estimate(0, odometry) == pytest.approx(asked, abs=1e-9)


def test_errors_that_fixes_have_in_common_are_smoothed_too() -> None:
    """A constant offset of all fixes, told as one of their last states: as an offset that is zero
    with a variance, by dense least squares over all fixes.
    """
    fixes, offset_sd = late_fixes(10), 2.0
    shared = np.array([offset_sd]), np.array([math.inf])
    growth = Growth(0.03**2, 0.0, True, 0, 0, *shared)
    first = first_belief(0.5, (0.0, 0.0), 0.0, (offset_sd,))
    reckoning = reckoned()
    jacobians = Jacobians(1)
    jacobians.make_room(10)
    of, left = jacobians.of, jacobians.left
    navigator = navigator_of(reckoning, KALMAN, growth, first, jacobians)
    of[:10, 0, 0], of[:10, 1, 0], of[:10, :, 1:] = 1.0, 0.0, 0.0
    left[:10] = 0.04, 0.09, 0.01  # less than the fixes' own covariances, which hold the offset too
    smoother = Smoother(navigator, reckoning, growth, first)
    smoother.correct(fixes, np.arange(10))
    asked_at = np.array([50.0])
    found = smoother.estimate(0, reckoning.sample(0, asked_at)[1])[0]
    valid = np.append(fixes["valid_at_s"], 50.0)
    walked = 0.5**2 + 0.03**2 * np.minimum.outer(valid, valid)
    places = reckoning.sample(0, fixes["valid_at_s"])[1].position
    off = places - np.column_stack((fixes["x_m"], fixes["y_m"]))
    # errors of x and y of each fix, x then y: walk, white noise, and the offset in x
    total = np.kron(np.eye(2), walked[:10, :10])
    white = np.array([[0.04, 0.01], [0.01, 0.09]])
    total += np.kron(white, np.eye(10))
    total[:10, :10] += offset_sd**2
    along = np.kron(np.eye(2), walked[10:, :10])
    errors = along @ np.linalg.solve(total, off.T.ravel())
    assert found == pytest.approx(reckoning.sample(0, asked_at)[1].position[0] - errors, abs=1e-8)


def test_kalman_and_smoother_are_gtsams() -> None:
    """In the linear case: a Gaussian factor graph of errors, currents and one bias, solved."""
    gtsam = pytest.importorskip("gtsam", reason="the extra `replay`")
    fixes = late_fixes(15)
    first = first_belief(0.5, (0.1, 0.2), 0.1)
    reckoning = reckoned()
    times = np.sort(np.append(fixes["valid_at_s"], [40.0, 110.0]))
    odometry = reckoning.sample(0, times)[1]
    smoother = smoother_of(fixes, PLAIN, first)
    found = odometry.position - smoother.estimate(0, odometry)
    errors = solved(gtsam, fixes, first, odometry)
    assert found == pytest.approx(errors, abs=1e-6)
    kalman = navigator_of(reckoning, KALMAN, PLAIN, first)
    kalman.correct(fixes, np.arange(len(fixes)))
    last = reckoning.sample(0, times[-1:])[1]
    assert last.position - kalman.estimate(0, last) == pytest.approx(errors[-1:], abs=1e-6)


def solved(gtsam: Any, fixes: np.ndarray, first: Belief, odometry: Odometry) -> np.ndarray:
    """Return the errors (n, 2), m, that a Gaussian factor graph has at the instants."""
    graph, bias, split = gtsam.GaussianFactorGraph(), 10_000, [0, 1, 4, 5]

    def add(terms: dict[int, np.ndarray], value: np.ndarray, spread: np.ndarray) -> None:
        """Add: the sum of the terms is the value, but for noise; both made white."""
        white = np.linalg.inv(np.linalg.cholesky(spread))
        parts = [part for key, matrix in terms.items() for part in (key, white @ matrix)]
        graph.add(*parts, white @ value, gtsam.noiseModel.Unit.Create(len(value)))

    moment, k = np.zeros(1, dtype=MOMENT), STATES
    add({bias: np.eye(2)}, np.zeros(2), first.covariance[2:4, 2:4])
    for n in range(len(odometry.times)):
        move, spread = moved_and_spread(moment, dr_at(odometry, n), PLAIN, k)
        own, pushed = move[np.ix_(split, split)], move[np.ix_(split, [2, 3])]
        if n == 0:
            start = first.covariance[np.ix_(split, split)]
            start = own @ start @ own.T + spread[np.ix_(split, split)]
            add({0: np.eye(4), bias: -pushed}, np.zeros(4), start)
        else:
            terms = {n - 1: -own, n: np.eye(4), bias: -pushed}
            add(terms, np.zeros(4), spread[np.ix_(split, split)])
    places = dict(zip(odometry.times.tolist(), odometry.position, strict=True))
    for fix in fixes:
        row = int(np.searchsorted(odometry.times, fix["valid_at_s"]))
        off = places[float(fix["valid_at_s"])] - np.array([fix["x_m"], fix["y_m"]])
        white = np.array([[fix["sd_x_m"] ** 2, 0.1], [0.1, fix["sd_y_m"] ** 2]])
        add({row: np.eye(2, 4)}, off, white)
    result = graph.optimize()
    return np.array([result.at(n)[:2] for n in range(len(odometry.times))])


def test_guidance_goes_on_with_the_filter() -> None:
    """AUVs that steer by their estimates go where they went; what is told of them is smoothed."""
    filtered_run, smoothed = (
        simulate(
            load_scenario(
                "harbour_current", overrides=["duration_s=60", f"navigation.filter={name}"]
            ),
            seed=2,
        )
        for name in ("kalman", "smoother")
    )
    for table in ("pings", "fixes"):
        assert filtered_run.arrow[table].equals(smoothed.arrow[table])
    ways = [it.tables["tracks"][["x_m", "y_m"]] for it in (filtered_run, smoothed)]
    assert ways[0].equals(ways[1])
    assert smoothed.auvs.position_error_m.mean() < filtered_run.auvs.position_error_m.mean()


def test_what_the_filter_is_told_of_the_smoother_is_told_of() -> None:
    """Scale, heading, a bias that wanders and errors of ASVs: without a lag it is the filter, but
    for what is not linear; afterwards it is nearer to the truth.
    """
    changes = [
        "duration_s=100", "usbl.misalignment_sd_deg=1",
        "navigation.filter.delay_compensation=shift",
        "navigation.velocity_bias_m_per_s=[0,0]", "navigation.velocity_bias_sd_m_per_s=0.06",
        "navigation.velocity_bias_time_constant_s=60", "navigation.heading_sd_deg=2",
        "navigation.scale_factor_sd=0.02",
    ]  # fmt: skip
    runs = [
        simulate(load_scenario("recovery_140m", overrides=[*changes, f"navigation.filter={name}"]))
        for name in ("kalman", "{model: smoother, lag_s: 0}", "smoother")
    ]
    columns = ["estimate_x_m", "estimate_y_m", "estimate_sd_x_m", "estimate_sd_y_m"]
    kalman, at_once, _ = (run.tables["tracks"][columns].to_numpy(float) for run in runs)
    assert np.nanmax(np.abs(at_once - kalman)) < 0.12  # of a standard deviation of 0.43 m there
    assert runs[2].auvs.position_error_rms_m.mean() < 0.9 * runs[0].auvs.position_error_rms_m.mean()


def test_afterwards_one_knows_better_and_knows_how_well() -> None:
    """Twelve seeds with a bias drawn from what the filter is told: nearer, and NEES about 2."""
    changes = ["record.detail=summary", "record.metrics_hz=1", "duration_s=120"]
    changes += ["navigation.velocity_bias_m_per_s=[0,0]"]
    changes += ["navigation.velocity_bias_sd_m_per_s=0.06"]
    errors, nees = [], []
    for name in ("kalman", "{model: smoother, lag_s: 10}", "smoother"):
        own = load_scenario("quickstart", overrides=[*changes, f"navigation.filter={name}"])
        found = [simulate(own, seed=seed).auvs for seed in range(12)]
        errors.append(np.mean([it.position_error_rms_m.mean() for it in found]))
        nees.append(np.mean([it.nees.mean() for it in found]))
    assert errors[2] < errors[1] < errors[0]
    assert errors[2] < 0.75 * errors[0]
    assert nees == pytest.approx([2.0, 2.0, 2.0], abs=0.4)
