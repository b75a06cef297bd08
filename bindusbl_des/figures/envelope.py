"""How large a fused position error may be, by the models of drift and fixes alone."""

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from ..result import Result
    from ..scenario import Scenario

Array = NDArray[np.float64]

# Standard deviations per axis: a circular Gaussian error is within three 98.9 % of the time.
SIGMAS = 3.0


def envelope(result: "Result", auv: str, times: Array) -> Array:
    """Return the largest horizontal error (m) to expect of an AUV at each instant (s).

    It is B + 3 s: B bounds what the velocity bias b does on a straight course, s is the standard
    deviation per axis of random walk and fixes.  As time goes by B grows by |b| t and s^2 by
    sigma^2 t.  Of the error at the ping a fix leaves (1 - g), g being the gain, and of the drift
    since the ping all; without delay compensation the way V L travelled while the fix was under way
    counts as an error of g V L instead.  Turns make a bias in the body frame cancel, so that errors
    may stay far below.
    """
    table = result.tables["fixes"]
    own = table[(table.auv == auv) & (table.outcome == "delivered")].sort_values("delivered_at_s")
    bias, walk = _growth(result.scenario)
    knots = [(0.0, 0.0, 0.0)]
    columns = own[["delivered_at_s", "latency_s", "sd_x_m", "sd_y_m"]].to_numpy(float)
    for time, age, sd_x, sd_y in columns.tolist():
        last, bound, variance = knots[-1]
        grown = bound + bias * (time - last), variance + walk**2 * (time - last)
        knots.append((time, *_corrected(result.scenario, grown, age, max(sd_x, sd_y))))
    at, bounds, variances = np.array(knots).T
    index = np.searchsorted(at, times, side="right") - 1
    since = times - at[index]
    deviation = np.sqrt(variances[index] + walk**2 * since)
    return np.asarray(bounds[index] + bias * since + SIGMAS * deviation)


def _growth(scenario: "Scenario") -> tuple[float, float]:
    """Return how dead reckoning drifts: bias and currents (m/s), walk per axis (m/sqrt(s))."""
    navigation, water = scenario.navigation, scenario.environment
    bias = math.hypot(*navigation.velocity_bias_m_per_s)
    if navigation.velocity == "through_water":  # a current that dead reckoning does not see
        bias += water.current_m_per_s + SIGMAS * water.current_variation_m_per_s
    return bias, navigation.random_walk_m_per_sqrt_s


def _corrected(
    scenario: "Scenario", grown: tuple[float, float], age: float, deviation: float
) -> tuple[float, float]:
    """Return bound (m) and variance (m2) after a fix that is `age` (s) old."""
    gain, (bound, variance) = scenario.navigation.gain, grown
    bias, walk = _growth(scenario)
    if scenario.navigation.delay_compensation == "shift":
        drifted, walked, lag = bias * age, walk**2 * age, 0.0
    else:
        drifted, walked, lag = 0.0, 0.0, gain * scenario.auvs.speed_m_per_s * age
    left = 1.0 - gain
    return (
        left * max(bound - drifted, 0.0) + drifted + lag,
        left**2 * max(variance - walked, 0.0) + walked + (gain * deviation) ** 2,
    )
