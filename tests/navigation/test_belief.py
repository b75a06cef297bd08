"""Beliefs of more states than six: errors of the way told, and those that fixes have in common."""

import math
from math import inf

import numpy as np
import pytest
from test_navigators import KALMAN, NOTHING_IN_COMMON, estimate, fixes_at, navigator_of, straight

from bindusbl_des.navigation.belief import (
    Belief,
    Growth,
    carry,
    error_spread,
    expected,
    first_belief,
    on_circle,
    turn_with,
)
from bindusbl_des.navigation.fix_update import weigh
from bindusbl_des.records.rows import Jacobians
from bindusbl_des.vehicles.reckoning import DeadReckoned, way_since


def grown(walk: float, sds: list[float], lasts: list[float], **places: int) -> Growth:
    """Return how a belief of further states grows, in the survey frame."""
    return Growth(walk, 0.0, False, sds=np.array(sds), time_constants=np.array(lasts), **places)


@pytest.mark.parametrize("lasts", [inf, 40.0], ids=["constant", "gauss_markov"])
@pytest.mark.parametrize("order", [[0, 1, 2, 3], [0, 2, 1, 3]], ids=["in_turn", "out_of_turn"])
def test_an_error_that_fixes_share_is_weighed_as_one(lasts: float, order: list[int]) -> None:
    """As the best linear estimate from all fixes at once, whose covariance is written down here."""
    pinged, sd, start, shared = np.array([10.0, 20.0, 30.0, 40.0]), 0.3, 2.0, 1.5
    rng = np.random.default_rng(7)
    common = rng.normal(0.0, 1.0, (4, 2, 1))
    places = rng.normal(0.0, 2.0, (4, 2))
    jacobians = Jacobians(1)
    jacobians.of = np.concatenate((common, np.zeros((4, 2, 3))), axis=2)
    jacobians.left = np.tile((sd**2, sd**2, 0.0), (4, 1))
    navigator = navigator_of(
        straight(0.0),
        KALMAN,
        grown(0.0, [shared], [lasts]),
        first_belief(start, (0.0, 0.0), 0.0, [shared]),
        jacobians,
    )
    fixes = fixes_at(pinged.tolist(), [50.0] * 4, places, sd)
    for row in order:
        navigator.correct(fixes, np.array([row]))
    place, spread = estimate(navigator, straight(0.0), 50.0)

    stacked = common.reshape(8, 1)
    instants = np.repeat(pinged, 2)
    alike = np.exp(-np.abs(instants[:, None] - instants) / lasts)
    noise = sd**2 * np.eye(8) + shared**2 * alike * (stacked @ stacked.T)
    seen = np.tile(np.eye(2), (4, 1))
    weight = seen.T @ np.linalg.inv(noise)
    covariance = np.linalg.inv(weight @ seen + np.eye(2) / start**2)
    assert place == pytest.approx(covariance @ weight @ places.ravel(), abs=1e-9)
    assert spread == pytest.approx((covariance[0, 0], covariance[1, 1], covariance[0, 1]), abs=1e-9)


def test_a_fix_teaches_what_it_shares_with_the_next() -> None:
    """Of a position that is known, a fix says only what is wrong with fixes, and that stays."""
    belief = first_belief(0.0, (0.0, 0.0), 0.0, [2.0])
    common = np.array([[1.0], [0.5]])
    gain = np.zeros((7, 2))
    variance = 4.0 * common @ common.T + 0.01 * np.eye(2)
    gain[6] = -(4.0 * common.T @ np.linalg.inv(variance))[0]
    weigh(belief, gain, -1.0, -0.5, (0.01, 0.01, 0.0), common)
    assert belief.state[6] == pytest.approx(1.0, rel=0.01)
    assert belief.covariance[6, 6] == pytest.approx(1 / (1 / 4.0 + 1.25 / 0.01), rel=1e-9)
    assert (belief.state[:6] == 0.0).all()


@pytest.mark.parametrize("steps", [1, 7])
def test_a_bias_that_wanders_carries_off_as_its_integral(steps: int) -> None:
    """On a straight leg, in one step or several: the variance of an integral.

    That of a stationary Gauss-Markov process, 2 sigma^2 tau^2 (t / tau - 1 + exp(-t / tau)).
    """
    sd, lasts, time = 0.05, 60.0, 90.0
    growth = grown(0.0, [sd, sd], [lasts, lasts], wandering=6)
    belief = first_belief(0.0, (0.0, 0.0), 0.0, [sd, sd])
    for k in range(1, steps + 1):
        carry(belief, DeadReckoned(k * time / steps, 0.0, 0.0, 0.0, 0.0), growth)
    fallen = math.exp(-time / lasts)
    p = belief.covariance
    assert p[0, 0] == pytest.approx(2 * sd**2 * lasts**2 * (time / lasts - 1 + fallen), rel=1e-9)
    assert p[1, 1] == pytest.approx(p[0, 0])
    assert (p[6, 6], p[6, 0]) == pytest.approx((sd**2, sd**2 * lasts * (1 - fallen)), rel=1e-9)
    assert np.array_equal(p, p.T)


def test_what_is_known_of_a_wandering_bias_is_forgotten() -> None:
    """It falls as exp(-t / tau), and so does what it carries dead reckoning off by."""
    growth = Growth(0.0, 0.0, True, 0, 6, np.full(2, 0.05), np.full(2, 60.0))
    belief = first_belief(0.0, (0.0, 0.0), 0.0, [0.0, 0.0])
    belief.state[6:] = 0.04, 0.02
    carry(belief, DeadReckoned(30.0, 0.0, 0.0, 0.0, 30.0), growth)  # to the east
    fallen = math.exp(-0.5)
    assert belief.state[6:] == pytest.approx([0.04 * fallen, 0.02 * fallen])
    gone = 60.0 * (1 - fallen)
    assert belief.state[:2] == pytest.approx([-0.02 * gone, 0.04 * gone])


def test_a_scale_factor_and_a_heading_error_stretch_and_turn_the_way() -> None:
    """Whoever knows both, and his bias, knows where he is, exactly."""
    scale, turned, bias = 0.03, math.radians(4.0), 0.1
    c, s = math.cos(turned), math.sin(turned)
    way, told = np.array([120.0, -40.0]), (1 + scale) * np.array([[c, -s], [s, c]])
    x, y = told @ way + np.array([bias * 200.0, 0.0])
    belief = first_belief(0.0, (0.0, 0.0), 0.0, [1.0, 1.0])
    belief.state[2], belief.state[6:] = bias, (1 - c / (1 + scale), s / (1 + scale))
    growth = grown(0.0, [1.0, 1.0], [inf, inf], stretched=6)
    carry(belief, DeadReckoned(200.0, x, y, 0.0, 0.0), growth)
    assert np.array([x, y]) - belief.state[:2] == pytest.approx(way, abs=1e-9)


def test_a_place_that_its_own_array_turns_goes_on_a_circle_about_the_asv() -> None:
    """What no fix tells of stays what it is about, wherever the place is corrected to."""
    sd, asv, place, moved = 0.05, np.array([7.0, -3.0]), np.array([40.0, 5.0]), (1.5, -0.8)
    quarter = np.array([[0.0, -1.0], [1.0, 0.0]])
    sure = 0.01 * np.eye(3)
    mode = np.append(quarter @ (place - asv), 1.0)
    spread = sure + sd**2 * np.outer(mode, mode)
    turn_with(spread, 2, *moved)
    mode = np.append(quarter @ (place + moved - asv), 1.0)
    sheared = np.eye(3)
    sheared[:2, 2] = quarter @ moved
    expected = sheared @ sure @ sheared.T + sd**2 * np.outer(mode, mode)
    assert spread == pytest.approx(expected, abs=1e-12)


def test_an_ellipse_holds_what_lies_on_a_circle() -> None:
    """The second moments of a turned place about the one believed, by a million draws."""
    sd, reach = 0.1, np.array([30.0, 40.0])
    quarter = np.array([[0.0, -1.0], [1.0, 0.0]])
    mode = np.append(quarter @ reach, 1.0)
    spread = sd**2 * np.outer(mode, mode)
    xx, yy, xy = on_circle(spread, 2)
    assert on_circle(spread, 0) == (spread[0, 0], spread[1, 1], spread[0, 1])
    c = np.random.default_rng(5).normal(0.0, sd, 10**6)
    off = (np.cos(c) - 1.0)[:, None] * reach + np.sin(c)[:, None] * (quarter @ reach)
    radial = reach / np.hypot(*reach)
    found = np.array([[xx, xy], [xy, yy]])
    assert radial @ found @ radial == pytest.approx(((off @ radial) ** 2).mean(), rel=0.02)
    assert radial @ found @ radial > 0.1


def test_a_navigator_tells_how_its_own_array_turns_its_place() -> None:
    """Between fixes as well, where nothing else is estimated of the way."""
    growth = Growth(0.027**2, 0.0, False, sds=np.array([0.1]), time_constants=np.array([inf]))
    first = first_belief(1.0, (0.0, 0.0), 0.0, [0.1])
    first.covariance[0, 6] = first.covariance[6, 0] = 0.05
    first.covariance[1, 6] = first.covariance[6, 1] = -0.02
    reckoning = straight(1.0)
    aligned = estimate(
        navigator_of(reckoning, KALMAN, growth._replace(aligned=6), first), reckoning, 9.0
    )
    plain = estimate(navigator_of(reckoning, KALMAN, growth, first), reckoning, 9.0)
    more = 0.75 * np.array([0.02**2, 0.05**2, 0.02 * 0.05])
    assert aligned[1] - plain[1] == pytest.approx(more, rel=1e-9)


def numbered(belief: Belief) -> float:
    """Return the smallest eigenvalue of a belief's covariance."""
    return float(np.linalg.eigvalsh(belief.covariance)[0])


def test_covariances_stay_covariances() -> None:
    """With all further states at once, carried and weighed a thousand times."""
    rng = np.random.default_rng(3)
    sds, lasts = [0.02, 0.05, 0.05, 0.05, 0.3, 0.4], [inf, inf, 30.0, 30.0, inf, 100.0]
    growth = Growth(0.027**2, 1e-6, True, 6, 8, np.array(sds), np.array(lasts), 10.0)
    belief = first_belief(1.0, (0.05, 0.05), 0.1, sds)
    at = np.zeros(5)
    for _ in range(1000):
        passed, yaw = rng.exponential(4.0), rng.uniform(0.0, 6.0)
        ahead, aside = passed * math.cos(yaw), passed * math.sin(yaw)
        at += passed, ahead, aside, ahead, aside
        carry(belief, DeadReckoned(at[0], at[1], at[2], at[3], at[4]), growth)
        assert numbered(belief) > -1e-12
        common = rng.normal(0.0, 1.0, (2, 2))
        gain = np.zeros((12, 2))
        gain[:2] = 0.1 * np.eye(2)
        weigh(belief, gain, *rng.normal(0.0, 0.1, 2), (0.25, 0.25, 0.1), common)
        assert numbered(belief) > -1e-12
    assert np.allclose(belief.covariance, belief.covariance.T, atol=1e-12)


@pytest.mark.parametrize("in_body", [True, False], ids=["body", "world"])
def test_how_sure_one_is_of_the_error_is_what_carrying_makes_of_it(in_body: bool) -> None:
    """To the bit, forth and back in time, with an error that fixes have in common beside it."""
    rng = np.random.default_rng(5)
    growth = Growth(0.027**2, 1e-6, in_body, sds=np.full(1, 0.3), time_constants=np.full(1, 50.0))
    for passed in rng.uniform(-5.0, 60.0, 20).tolist():
        belief = first_belief(1.0, (0.05, 0.05), 0.1, [0.3])
        belief.covariance[:] = np.cov(rng.normal(0.0, 1.0, (7, 20)))
        told = DeadReckoned(passed, *rng.normal(0.0, 30.0, 4).tolist())
        way = way_since(expected(belief, growth), told, growth.in_body)
        found = error_spread(belief.covariance, way, growth)
        carry(belief, told, growth)
        p = belief.covariance
        assert found == (p[0, 0], p[1, 1], p[0, 1])


def test_nothing_in_common_is_nothing() -> None:
    """A fix without common errors leaves their states to what correlations say."""
    belief = first_belief(1.0, (0.0, 0.0), 0.0, [3.0])
    gain = np.zeros((7, 2))
    gain[:2] = 0.5 * np.eye(2)
    weigh(belief, gain, 1.0, 0.0, (1.0, 1.0, 0.0), NOTHING_IN_COMMON)
    assert belief.state.tolist() == [0.5, 0, 0, 0, 0, 0, 0]
    assert belief.covariance[6, 6] == 9.0
