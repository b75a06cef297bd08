"""Errors marched through fixes against closed forms (physics of fixed gains and of Kalman's)."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from plans_for_tests import Inputs, Turns, inputs_of, predict

from bindusbl_des import Scenario, Setup
from bindusbl_des.apps.planning.prediction.inputs import (
    DriftSource,
    PlannedWays,
    PredictedNavigator,
)
from bindusbl_des.apps.planning.prediction.march import errors_of
from bindusbl_des.apps.planning.prediction.sights import Fixes
from bindusbl_des.core.scenario.families import NAVIGATOR

Floats = NDArray[np.float64]

# Random walk (m2/s), noise of a fix (m2), velocity bias (m/s) and gain of the closed forms
WALK, NOISE, BIAS, GAIN = 0.027**2, 0.25, 0.06, 0.9
STEPS = 50  # instants between two fixes


def navigating(name: str, *rest: Any) -> PredictedNavigator:
    """Return a navigator with what ships by its name."""
    return PredictedNavigator(name, NAVIGATOR.traits[name], *rest)


def straight_on(period: float, fixes: int, navigator: PredictedNavigator, speed: float) -> Inputs:
    """Return an AUV that goes along x for so many periods."""
    given = inputs_of(
        Setup(Scenario.model_validate({"name": "m", "auvs": {"count": 1}, "asvs": {"count": 1}}))
    )
    times = np.linspace(0.0, fixes * period, fixes * STEPS + 1)
    along = np.stack((times, np.zeros(len(times))), axis=-1)[np.newaxis]
    ways = PlannedWays(times, speed * along, along, np.array([10.0]))
    return replace(given, duration_s=float(times[-1]), ways=ways, navigator=navigator)


def marched(
    period: float,
    fixes: int,
    navigator: PredictedNavigator,
    *,
    late: float = 0.0,
    speed: float = 0.0,
    chance: float = 1.0,
) -> tuple[Floats, Floats]:
    """Return mean (k,), m, and variance (k,), m2, along x of an AUV's error over the last period.

    It pings half a step after instants, so that none of them falls on a ping.
    """
    inputs = straight_on(period, fixes, navigator, speed)
    pinged = np.linspace(0.0, (fixes - 1) * period, fixes)[np.newaxis] + 0.5 * period / STEPS
    none = np.zeros((1, fixes), dtype=np.int64)
    turns = Turns(pinged, pinged + late, np.full((1, fixes), chance), none, none, 1)
    instants = len(inputs.ways.times_s)
    noise = np.full((1, instants, 1, 3), NOISE)
    noise[..., 2] = 0.0
    found = errors_of(inputs, turns, Fixes(noise, np.zeros(noise.shape), np.zeros(noise.shape[:3])))
    last = slice(-STEPS, None)
    return found.mean[0, last, 0], found.covariance[0, last, 0]


def gained(compared_at_ping: bool = True) -> PredictedNavigator:
    bias = DriftSource("body", (BIAS, 0.0), (0.0, 0.0), (0.0, 0.0))
    return navigating("fixed_gain", GAIN, compared_at_ping, 0.0, 0.0, WALK, WALK, (bias,))


@pytest.mark.parametrize(
    ("period", "late", "at_ping", "speed", "square"),
    [
        (1.59, 0.0, True, 0.0, 0.209294038),
        (1.59, 0.57, True, 0.63, 0.214866928),
        (1.59, 0.57, False, 0.63, 0.296375788),
        (1.59, 0.57, False, 1.5, 0.840626038),
        (4.02, 0.0, True, 0.0, 0.232615226),
        (4.02, 0.57, True, 0.63, 0.244282556),
        (4.02, 0.57, False, 1.5, 0.711586226),
    ],
)
def test_a_fixed_gain_settles_as_its_closed_form(
    period: float, late: float, at_ping: bool, speed: float, square: float
) -> None:
    mean, variance = marched(period, 40, gained(at_ping), late=late, speed=speed)
    assert float((mean**2 + variance).mean()) == pytest.approx(square, rel=1e-3)


def test_fixes_that_come_by_chance_leave_a_fixed_gain_longer_alone() -> None:
    """With p = 0.7 the time mean of the squared error is that of physics.md 4.2."""
    mean, variance = marched(1.59, 60, gained(), chance=0.7)
    assert float((mean**2 + variance).mean()) == pytest.approx(0.222784966, rel=1e-3)


@pytest.mark.parametrize(("period", "root"), [(1.59, 0.135825), (4.02, 0.174981)])
def test_a_kalman_filter_with_a_bias_settles_as_its_riccati_equation(
    period: float, root: float
) -> None:
    bias = DriftSource("body", (0.0, 0.0), (0.1, 0.1), (0.1, 0.1), wander_per_s=1e-8)
    kalman = navigating("kalman", GAIN, True, 0.0, 0.0, WALK, WALK, (bias,))
    mean, variance = marched(period, 3000, kalman)
    assert np.sqrt(variance.mean()) == pytest.approx(root, rel=1e-3)
    assert not mean.any()


def test_a_known_bias_leaves_the_middle_between_two_fixes() -> None:
    """Without a bias to learn, P half way is sqrt(q^2 T^2 / 4 + q T r)."""
    kalman = navigating("kalman", GAIN, True, 0.0, 0.0, WALK, WALK, ())
    _, variance = marched(4.02, 400, kalman)
    half_way = np.sqrt((WALK * 4.02) ** 2 / 4.0 + WALK * 4.02 * NOISE)
    assert variance.mean() == pytest.approx(half_way, rel=1e-4)


@pytest.mark.parametrize(
    ("source", "spread"),
    [
        (DriftSource("body", (0.0, 0.0), (0.1, 0.0), (0.0, 0.0)), 100.0),
        (DriftSource("world", (0.0, 0.0), (0.1, 0.0), (0.0, 0.0)), 100.0),
        (DriftSource("way", (0.0, 0.0), (0.1, 0.0), (0.0, 0.0)), 25.0),
        # of a Gauss-Markov process of 0.1 m/s and 50 s: spreads.wandering_rms squared
        (DriftSource("world", (0.0, 0.0), (0.1, 0.1), (0.0, 0.0), 50.0), 56.766764),
    ],
)
def test_dead_reckoning_drifts_as_its_sources_say(source: DriftSource, spread: float) -> None:
    """After 100 s at 0.5 m/s."""
    alone = navigating("dead_reckoning", GAIN, True, 0.0, 0.0, 0.0, 0.0, (source,))
    _, variance = marched(100.0, 1, alone, speed=0.5)
    assert variance[-1] == pytest.approx(spread, rel=1e-6)


def test_a_smoother_knows_more_than_the_filter_and_the_filter_more_than_none() -> None:
    def expected(filter_: str) -> float:
        own = Scenario.model_validate({"name": "m", "navigation": {"filter": filter_}})
        found = predict(inputs_of(Setup(own)), [[0.0, 0.0]])
        return float(found.position_error_m.mean())

    smoother, kalman, none = map(expected, ("smoother", "kalman", "dead_reckoning"))
    assert smoother < kalman < none
