"""Vehicles with dynamics on their voyage: hulls, controllers and the water of a scenario.

Hulls and controllers are loaded when somebody needs them: most missions are kinematic.
"""

import math
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..core.streams import Purpose, Streams
from ..geometry.paths import Path
from ..navigation.dead_reckoning import random_walk
from ..scenario.planned import asv_stations
from ..scenario.scenario import Scenario
from ..vehicles.currents import CONTROL_S, carried, current_series, gauss_markov

if TYPE_CHECKING:
    from ..vehicles.guidance import GuidedFleet

Array = NDArray[np.float64]

# Sound is at least this fast (m/s), so that it has arrived this long after the mission's end.
SLOWEST_SOUND = 1300.0


class Water:
    """The current of one mission, and how far it has carried what drifts in it."""

    def __init__(self, scenario: Scenario, streams: Streams) -> None:
        self._scenario, self._streams = scenario, streams

    @property
    def is_steady(self) -> bool:
        """Whether the current never varies, so that it is the same for every seed."""
        return self._scenario.environment.current_variation_m_per_s == 0.0

    @cached_property
    def series(self) -> Array:
        """The current (m/s) along x and y in each control interval, shape (n, 2)."""
        asked, count = self._scenario.environment, control_intervals(self._scenario)
        return current_series(
            asked.current_m_per_s,
            math.radians(asked.current_direction_deg),
            asked.current_variation_m_per_s,
            asked.current_variation_time_s,
            CONTROL_S,
            self._streams.of(Purpose.CURRENT).standard_normal((count, 2)),
        )

    def carried(self, times: Array) -> Array:
        """Return how far (m) the water has moved by each instant (s), shape (n, 2)."""
        return carried(self.series, CONTROL_S, times)


def afterwards_s(scenario: Scenario) -> float:
    """Return how long (s) after its end a mission still asks where vehicles are.

    Sound sent at the last instant is followed to the farthest vehicle.
    """
    farthest = max(math.hypot(x, y) for x, y in asv_stations(scenario))
    across = scenario.acoustics.hf.range_m + 2 * scenario.survey.side_m
    return 2.0 + (farthest + across + scenario.survey.depth_m) / SLOWEST_SOUND


def control_intervals(scenario: Scenario) -> int:
    """Return the number of control intervals of a voyage that outlasts the mission a little."""
    return math.ceil((scenario.duration_s + afterwards_s(scenario)) / CONTROL_S)


def velocity_biases(scenario: Scenario, streams: Streams) -> Array:
    """Return the velocity bias (m/s) of each AUV's dead reckoning in this mission, (n, 2)."""
    navigation, count = scenario.navigation, scenario.auvs.count
    biases = np.tile(np.array(navigation.velocity_bias_m_per_s, dtype=np.float64), (count, 1))
    return biases + _drawn(
        streams, Purpose.VELOCITY_BIAS, count, navigation.velocity_bias_sd_m_per_s
    )


def _drawn(streams: Streams, purpose: Purpose, count: int, sd: float) -> Array:
    """Return what each of some AUVs has drawn once for the mission, along two axes, (n, 2)."""
    if sd == 0.0:
        return np.zeros((count, 2))
    return sd * np.array([streams.of(purpose, auv).standard_normal(2) for auv in range(count)])


def walks(scenario: Scenario, streams: Streams, water: Water) -> Array:
    """Return each AUV's dead-reckoning error (m) but for its bias, at its IMU's samples (n, k, 2).

    A walk begins with the error of the initial position.  Dead reckoning through the water misses
    the current: it falls behind by what the water moved.
    """
    navigation, rate = scenario.navigation, scenario.navigation.imu_rate_hz
    count = max(1, math.ceil(scenario.duration_s * rate))
    noise = np.zeros((scenario.auvs.count, count + 1, 2))
    noise[:, 0] = _drawn(
        streams, Purpose.INITIAL_POSITION, len(noise), navigation.initial_position_sd_m
    )
    for auv, its_own in enumerate(noise):
        streams.of(Purpose.DRIFT, auv).standard_normal(out=its_own[1:])
    lost = random_walk(rate, navigation.random_walk_m_per_sqrt_s, noise)
    if navigation.velocity == "through_water":
        lost -= water.carried(np.arange(count + 1) / rate)
    return lost


def slow_gnss(scenario: Scenario, streams: Streams) -> Array:
    """Return the slow error (m) of each ASV's GNSS position in each control interval, (m, n, 2)."""
    usbl, count = scenario.usbl, control_intervals(scenario)
    if usbl.gnss_correlated_sd_m == 0.0:
        return np.zeros((scenario.asvs.count, 1, 2))
    return np.stack([
        gauss_markov(
            usbl.gnss_correlated_sd_m, usbl.gnss_time_constant_s, CONTROL_S,
            streams.of(Purpose.GNSS, asv).standard_normal((count, 2)),
        )
        for asv in range(scenario.asvs.count)
    ])  # fmt: skip


def guided_auvs(
    scenario: Scenario, tours: Sequence[Path], water: Water, walks: Array, biases: Array
) -> "GuidedFleet":
    """Return the voyage of all AUVs along their tours; they steer as `auvs.feedback` says."""
    from ..vehicles.guidance import GuidedFleet, Plan, SteeringDrift

    auvs, navigation = scenario.auvs, scenario.navigation
    drift = None
    if auvs.feedback == "estimate":
        beyond = math.ceil((afterwards_s(scenario) + 1.0) * navigation.imu_rate_hz)
        drift = SteeringDrift(
            biases,
            navigation.bias_frame == "body",
            np.pad(walks, ((0, 0), (0, beyond), (0, 0)), mode="edge"),
            navigation.imu_rate_hz,
            through_water=navigation.velocity == "through_water",
        )
    return GuidedFleet(
        auvs.vehicle.model,
        Plan(
            paths=tours,
            speed_m_per_s=auvs.speed_m_per_s,
            depth_m=scenario.survey.depth_m,
            names=[f"AUV{index}" for index in range(auvs.count)],
        ),
        dict(auvs.vehicle.coefficients),
        currents=water.series,
        duration_s=control_intervals(scenario) * CONTROL_S,
        drift=drift,
    )


def guided_asvs(
    scenario: Scenario, stations: Sequence[tuple[float, float]], streams: Streams, water: Water
) -> "GuidedFleet":
    """Return the voyage of all ASVs, which keep their stations by noisy GNSS positions."""
    from ..vehicles.guidance import GuidedFleet, Plan

    asvs, count = scenario.asvs, control_intervals(scenario)
    noise = [
        streams.of(Purpose.STATION, asv).standard_normal((count, 2)) * scenario.usbl.gnss_sd_m
        for asv in range(asvs.count)
    ]
    return GuidedFleet(
        asvs.vehicle.model,
        Plan(stations=np.array(stations), names=[f"ASV{index}" for index in range(asvs.count)]),
        dict(asvs.vehicle.coefficients),
        currents=water.series,
        duration_s=count * CONTROL_S,
        position_noise=np.stack(noise) + slow_gnss(scenario, streams),
    )
