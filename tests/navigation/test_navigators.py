"""What AUVs believe of their dead reckoning, and how fixes change it, against worked examples."""

import itertools
import math
from typing import ClassVar

import numpy as np
import pytest
from commands_for_tests import explained
from hypothesis import given
from hypothesis import strategies as st
from worlds import QUIET_NAVIGATION, QUIET_USBL, blank, paper_case, scenario

from bindusbl_des import DeadReckoning, Odometry, Scenario, simulate
from bindusbl_des.navigation.belief import Belief, Growth, carry, first_belief
from bindusbl_des.navigation.correcting import REMEMBERED
from bindusbl_des.navigation.fix_update import MOST_REFUSED, WEIGHED, Rule, weigh
from bindusbl_des.navigation.navigators import NOTHING, LinearNavigator
from bindusbl_des.records.rows import FIX, LEARNT, Jacobians
from bindusbl_des.vehicles.motion import together
from bindusbl_des.vehicles.reckoning import DeadReckoned, steady
from bindusbl_des.vehicles.vehicle import recorded

KALMAN = Rule(WEIGHED, at_ping=True, gate=0.0)
NOTHING_IN_COMMON = np.zeros((2, 0))


def straight(speed: float, seconds: float = 1000.0) -> DeadReckoning:
    """Return the faultless dead reckoning of an AUV that goes north at a speed (m/s)."""
    track = recorded(np.array([0.0, seconds]), np.array([[0, 0, 5], [speed * seconds, 0, 5]]))
    return DeadReckoning(
        together([track.legs]), steady(np.zeros((1, 2, 2)), 1.0, (0.0, 0.0), False)
    )


def fixes_at(
    pinged: list[float], delivered: list[float], places: np.ndarray, sd: float
) -> np.ndarray:
    """Return the rows of fixes of one AUV."""
    fixes = blank(FIX, len(pinged))
    fixes["auv"] = 0
    fixes["valid_at_s"], fixes["delivered_at_s"] = pinged, delivered
    fixes["x_m"], fixes["y_m"] = places.T
    fixes["sd_x_m"] = fixes["sd_y_m"] = sd
    fixes["cov_xy_m2"] = 0.0
    return fixes


def navigator_of(
    reckoning: DeadReckoning, rule: Rule, growth: Growth, first: Belief, common: Jacobians = NOTHING
) -> LinearNavigator:
    """Return the navigator of one AUV, by which nobody steers."""
    steering = np.zeros((1, 2)), np.zeros(1, dtype=LEARNT)
    return LinearNavigator(reckoning, rule, growth, first, *steering, common)


def estimate(
    navigator: LinearNavigator, reckoning: DeadReckoning, time: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return where the AUV believes to be, and how surely (xx, yy, xy), at an instant (s)."""
    odometry = reckoning.sample(0, np.array([time]))[1]
    return navigator.estimate(0, odometry)[0], navigator.covariance(0, odometry)[0]


def test_a_late_fix_speaks_of_its_ping() -> None:
    """A ping at 1 s, delivered at 1.5 s: as reprocessing and stochastic cloning have it.

    Source: worked example with x = [p, b] = 0, P = diag(1, 0.01), u = 1 m/s, q = 0.027^2.
    """
    reckoning, growth = straight(1.0), Growth(0.027**2, 0.0, in_body=True)
    first = first_belief(1.0, (0.1, 0.1), 0.0)
    navigator = navigator_of(reckoning, KALMAN, growth, first)
    fixes = fixes_at([1.0], [1.5], np.array([[0.8, 0.0]]), 0.5)
    navigator.correct(fixes, np.array([0]))
    place, spread = estimate(navigator, reckoning, 1.5)
    assert place[0] == pytest.approx(1.3388664, abs=5e-8)
    assert spread[0] == pytest.approx(0.205253157673, abs=1e-12)
    assert fixes["innovation_m"][0] == pytest.approx(0.2)
    # until it is delivered, nobody knows of it
    assert estimate(navigator, reckoning, 1.25)[0] == pytest.approx([1.25, 0.0])
    naive = first_belief(1.0, (0.1, 0.1), 0.0)
    carry(naive, DeadReckoned(1.0, 1.0, 0.0, 1.0, 0.0), growth)
    p = naive.covariance
    gain = p[:, :2] / (p[0, 0] + 0.25)
    weigh(naive, gain, -(0.8 - 1.0), 0.0, (0.25, 0.25, 0.0), NOTHING_IN_COMMON)
    carry(naive, DeadReckoned(1.5, 1.5, 0.0, 1.5, 0.0), growth)
    # too fast, and that is the bias
    assert naive.state[2] == pytest.approx(0.00158638, abs=5e-9)
    assert (p[0, 0], p[0, 2], p[2, 2]) == pytest.approx(
        (0.205253157673, 0.006943320095, 0.009920680812), abs=1e-12
    )


@pytest.mark.parametrize(
    ("period", "gains", "before", "after"),
    [
        (1.59, (0.071079720, 0.000243062), 0.019129661, 0.017769930),
        (4.02, (0.115030468, 0.000377231), 0.032495601, 0.028757617),
    ],
)
def test_the_gain_settles_where_riccati_says(
    period: float, gains: tuple[float, float], before: float, after: float
) -> None:
    """A current that wanders by 1e-8 m2/s3, fixes of 0.5 m: the gains of the Riccati equation."""
    belief = first_belief(1.0, (0.0, 0.0), 0.1)
    p, growth = belief.covariance, Growth(0.027**2, 1e-8, in_body=True)
    for k in range(1, 4000):
        carry(belief, DeadReckoned(k * period, 0.0, 0.0, k * period, 0.0), growth)
        gain, was = p[:, :2] / (p[0, 0] + 0.25), p[0, 0]
        weigh(belief, gain, 0.0, 0.0, (0.25, 0.25, 0.0), NOTHING_IN_COMMON)
    assert (gain[0, 0], -gain[4, 0]) == pytest.approx(gains, rel=3e-6)
    assert (was, p[0, 0]) == pytest.approx((before, after), rel=1e-7)


@given(st.randoms(use_true_random=False), st.booleans())
def test_the_order_of_delivery_changes_nothing_in_the_end(draw: object, in_body: bool) -> None:
    """Fixes delivered out of the order of their pings leave the belief that the order leaves."""
    rng = np.random.default_rng(draw.randint(0, 2**32))  # type: ignore[attr-defined]
    reckoning, growth = straight(0.6), Growth(0.03**2, 1e-5, in_body)
    first = first_belief(0.5, (0.1, 0.2), 0.1)
    pinged = np.sort(rng.uniform(0.0, 90.0, REMEMBERED - 1)).tolist()
    places = rng.normal(0.0, 2.0, (len(pinged), 2)) + np.outer(pinged, (0.6, 0.0))
    beliefs = []
    for order in (np.arange(len(pinged)), rng.permutation(len(pinged))):
        navigator = navigator_of(reckoning, KALMAN, growth, first)
        fixes = fixes_at(pinged, [99.0] * len(pinged), places, 0.7)
        for row in order:
            navigator.correct(fixes, np.array([row]))
        beliefs.append(np.concatenate(estimate(navigator, reckoning, 100.0)))
    assert beliefs[0] == pytest.approx(beliefs[1], abs=1e-9)


def test_a_wild_fix_is_refused_and_a_lost_navigator_comes_back() -> None:
    """One outlier changes nothing; when everything looks like one, the belief gives way."""
    reckoning, growth = straight(0.0), Growth(1e-4, 0.0, in_body=True)
    rule = Rule(WEIGHED, at_ping=True, gate=9.21)
    navigator = LinearNavigator(
        reckoning,
        rule,
        growth,
        first_belief(0.1, (0.0, 0.0), 0.0),
        np.zeros((1, 2)),
        np.zeros(1, dtype=LEARNT),
    )
    count = MOST_REFUSED + 1
    instants = [float(k) for k in range(1, count + 1)]
    fixes = fixes_at(instants, instants, np.array([[30.0, 0.0]] * count), 0.5)
    for row in range(count - 1):
        navigator.correct(fixes, np.array([row]))
        place, covariance = estimate(navigator, reckoning, instants[row])
        assert place.tolist() == [0.0, 0.0]
        # so that the NIS of the fifth is 9.21: 30 m squared over that, less the fix's own variance
        wide = 900.0 / 9.21 - 0.25 if row == MOST_REFUSED - 1 else 0.0
        assert covariance[:2] == pytest.approx(wide, abs=0.05)
    navigator.correct(fixes, np.array([count - 1]))
    assert estimate(navigator, reckoning, instants[-1])[0] == pytest.approx((30.0, 0.0), abs=0.2)
    assert np.isnan(fixes["correction_m"][:-1]).all()
    assert fixes["correction_m"][-1] == pytest.approx(30.0, abs=0.2)
    assert (fixes["nis"][:-1] > 1000).all()
    assert fixes["nis"][-1] == pytest.approx(9.21, abs=0.1)


def test_a_gate_that_refuses_good_fixes_makes_nobody_unsure() -> None:
    """Of a gate below all that fixes err by, each sixth passes."""
    reckoning, growth = straight(0.0), Growth(1e-4, 0.0, in_body=True)
    first = first_belief(0.5, (0.0, 0.0), 0.0)
    rule = Rule(WEIGHED, at_ping=True, gate=5e-324)
    navigator = LinearNavigator(
        reckoning, rule, growth, first, np.zeros((1, 2)), np.zeros(1, dtype=LEARNT)
    )
    instants, rng = [float(k) for k in range(1, 61)], np.random.default_rng(4)
    fixes = fixes_at(instants, instants, rng.normal(0.0, 0.5, (60, 2)), 0.5)
    for row in range(60):
        navigator.correct(fixes, np.array([row]))
        covariance = estimate(navigator, reckoning, instants[row])[1]
        assert 0.01 < min(covariance[:2]) <= max(covariance[:2]) < 2.0
    assert np.isfinite(fixes["correction_m"]).sum() == 10


def test_what_comes_too_late_for_its_place_is_left_out() -> None:
    """A fix older than all that a navigator remembers of has no place, and no effect."""
    reckoning, growth = straight(0.0), Growth(1e-4, 0.0, in_body=True)
    navigator = LinearNavigator(
        reckoning,
        KALMAN,
        growth,
        first_belief(0.1, (0.0, 0.0), 0.0),
        np.zeros((1, 2)),
        np.zeros(1, dtype=LEARNT),
    )
    pinged = [*map(float, range(10, 11 + REMEMBERED)), 1.0]
    fixes = fixes_at(pinged, [50.0] * len(pinged), np.zeros((len(pinged), 2)), 0.5)
    fixes["x_m"][-1] = 5.0
    for row in range(len(fixes)):
        navigator.correct(fixes, np.array([row]))
    assert estimate(navigator, reckoning, 60.0)[0].tolist() == [0.0, 0.0]
    assert np.isnan([fixes[-1][name] for name in ("innovation_m", "nis", "correction_m")]).all()


def drawn(**changes: object) -> Scenario:
    """Return the recovery mission with inertial systems that are drawn, and a Kalman navigator."""
    navigation = {
        "filter": "kalman",
        "velocity_bias_m_per_s": [0.0, 0.0],
        "velocity_bias_sd_m_per_s": 0.06,
        **changes,
    }
    return paper_case(3, navigation=navigation, acoustics={"loss": {"combine": "off"}})


def test_kalman_halves_the_error() -> None:
    """Over 40 seeds the RMS error of every AUV is below half that of the fixed gain."""
    runs = {
        name: [simulate(drawn(filter=name), seed).auvs for seed in range(40)]
        for name in ("kalman", "fixed_gain")
    }
    rms = {
        name: np.sqrt(np.mean([run.position_error_rms_m**2 for run in found], axis=0))
        for name, found in runs.items()
    }
    assert (rms["kalman"] < 0.5 * rms["fixed_gain"]).all()


def test_who_knows_everything_needs_no_fix() -> None:
    """Without noise of any kind the Kalman navigator has nothing to weigh, and makes no NaN."""
    result = simulate(
        scenario(
            duration_s=60.0,
            usbl=QUIET_USBL,
            navigation={**QUIET_NAVIGATION, "filter": "kalman"},
        )
    )
    assert result.auvs.position_error_max_m.max() < 1e-9
    assert result.auvs.fixes_delivered.min() > 0


def test_dead_reckoning_alone_is_a_navigator() -> None:
    """It takes fixes for what they are, news of how wrong it is, and does nothing about it."""
    result = simulate(scenario(duration_s=60.0, navigation={"filter": "dead_reckoning"}))
    assert result.auvs.position_error_m.tolist() == result.auvs.imu_error_m.tolist()
    fixes = result.tables["fixes"].query("outcome == 'delivered'")
    assert (fixes.correction_m == 0.0).all()
    assert (fixes.innovation_m > 0.0).all()
    assert math.isclose(result.auvs.fix_benefit_m.max(), 0.0)


class Still:
    """A navigator of somebody's own that believes whatever the last fix said, and is told so."""

    def __init__(self, reckoning: DeadReckoning, auvs: int) -> None:
        self.held: list[list[tuple[float, np.ndarray]]] = [[] for _ in range(auvs)]

    def correct(self, fixes: np.ndarray, due: np.ndarray) -> None:
        for fix in fixes[due]:
            self.held[fix.auv].append((fix.delivered_at_s, np.array((fix.x_m, fix.y_m))))

    def estimate(self, auv: int, odometry: Odometry) -> np.ndarray:
        out = odometry.position.copy()
        for since, place in self.held[auv]:
            out[odometry.times >= since] = place
        return out

    def covariance(self, auv: int, odometry: Odometry) -> np.ndarray:
        return np.tile((4.0, 4.0, 0.0), (len(odometry.times), 1))


class Noting(Still):
    """The same, with what it is given in `fixes`."""

    given: ClassVar[list[np.recarray]] = []
    weighs = True

    def correct(self, fixes: np.ndarray, due: np.ndarray) -> None:
        super().correct(fixes, due)
        self.given.append(fixes[due])


class Silent(Still):
    """Answers nothing that could be used."""

    def estimate(self, auv: int, odometry: Odometry) -> np.ndarray:
        return np.full((1, 7), np.nan)


@pytest.mark.parametrize("vehicle", ["kinematic", "bluerov2"])
def test_a_navigator_of_ones_own_is_asked(vehicle: str) -> None:
    """Tracks, metrics and an autopilot have its estimate, which is not additive."""
    feedback = "truth" if vehicle == "kinematic" else "estimate"
    result = simulate(
        scenario(
            duration_s=40.0,
            survey={"side_m": 60.0},
            auvs={"count": 2, "vehicle": vehicle, "feedback": feedback, "speed_m_per_s": 0.3},
            asvs={"count": 1, "formation": {"radius_m": 0.0}},
            navigation={"filter": "test_navigators:Still"},
        )
    )
    tracks = result.tables["tracks"].query("vehicle == 'AUV0'")
    fixes = result.tables["fixes"].query("auv == 'AUV0' and outcome == 'delivered'")
    last = fixes[fixes.delivered_at_s <= tracks.time_s.iloc[-1]].iloc[-1]
    assert tracks.estimate_x_m.iloc[-1] == pytest.approx(last.x_m)
    assert (tracks.estimate_sd_x_m == 2.0).all()
    assert (fixes.correction_m > 0).all()


@pytest.mark.parametrize("ranging", ["owtt_sync", "passive"])
def test_a_navigator_of_ones_own_is_given_the_columns_of_table_fixes(ranging: str) -> None:
    """All of them and no others, texts as in the table, vehicles as numbers; but no truth, and
    nothing that comes of the correction.
    """
    Noting.given.clear()
    result = simulate(
        scenario(
            duration_s=30.0,
            survey={"side_m": 60.0},
            auvs={"count": 2},
            asvs={"count": 2, "formation": {"radius_m": 35.0}},
            protocol={"ranging": ranging},
            navigation={"filter": "test_navigators:Noting"},
        )
    )
    table = result.tables["fixes"].query("outcome == 'delivered'").set_index("fix")
    given = np.concatenate(Noting.given).view(np.recarray)
    assert list(given.dtype.names) == list(result.tables["fixes"].columns)
    assert sorted(given.fix) == list(table.index)
    assert len({*given.asvs}) > 1
    for fix in given:
        row = table.loc[fix.fix]
        assert f"AUV{fix.auv}" == row.auv
        assert (fix.asvs, fix.outcome) == (row.asvs, "delivered")
        assert f"ASV{fix.broadcast_by}" == row.broadcast_by or ranging == "passive"
        assert math.isnan(fix.error_m)
        assert math.isnan(fix.correction_m)
        for name in {*table.columns} - {"auv", "asvs", "outcome", "error_m", "correction_m"}:
            if given.dtype[name] == np.float64:
                assert fix[name] == pytest.approx(row[name], nan_ok=True), name
    assert [fix.fix for fix in given] == sorted(
        given.fix, key=lambda fix: table.delivered_at_s[fix]
    )


def test_nis_of_a_navigator_of_ones_own_is_counted() -> None:
    """Against what it believed of the instant at which the fix holds: here its last fix, which it
    took to be known to 2 m; dof 2, and what explain says of it names no gate, since it has none.
    """
    result = simulate(
        scenario(
            duration_s=40.0,
            survey={"side_m": 60.0},
            auvs={"count": 1, "speed_m_per_s": 0.3},
            asvs={"count": 1, "formation": {"radius_m": 0.0}},
            navigation={"filter": "test_navigators:Noting"},
        )
    )
    fixes = result.tables["fixes"].query("outcome == 'delivered'")
    assert fixes.nis.notna().all()
    for before, fix in itertools.pairwise(fixes.itertuples()):
        if before.delivered_at_s > fix.valid_at_s:
            continue  # it believed something else then
        off = np.array((fix.x_m - before.x_m, fix.y_m - before.y_m))
        spread = [[4 + fix.sd_x_m**2, fix.cov_xy_m2], [fix.cov_xy_m2, 4 + fix.sd_y_m**2]]
        assert fix.nis == pytest.approx(off @ np.linalg.inv(spread) @ off)
    assert result.auvs.nis[0] == pytest.approx(fixes.nis.mean())
    assert result.mission.nis[0] == pytest.approx(fixes.nis.mean())
    told = explained(result, fix=int(fixes.fix.iloc[5]))
    assert f"normalised, its square is {fixes.nis.iloc[5]:.2f}" in told
    assert "gate" not in told


def test_what_a_navigator_of_ones_own_gets_wrong_is_told() -> None:
    """Its name, the verb, and what was expected."""
    for name, message in (
        ("test_navigators:Silent", "answered estimate with an array of shape"),
        ("test_navigators:Nobody", "cannot load 'test_navigators:Nobody'"),
        ("math:sqrt", "'math:sqrt' cannot be called as a filter is"),
    ):
        with pytest.raises(ValueError, match=f"navigation.filter: .*{message}"):
            simulate(scenario(duration_s=5.0, navigation={"filter": name}))
    with pytest.raises(ValueError, match="did you mean 'kalman'"):
        scenario(navigation={"filter": "kalmann"})
