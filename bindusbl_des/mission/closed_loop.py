"""Vehicles with dynamics on their way: hulls, controllers and the water of a scenario.

Hulls and controllers are loaded when somebody needs them: most missions are kinematic.
"""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..core.arrays import Floats
from ..core.facts import cached_property
from ..core.streams import Purpose, Streams
from ..setup import Setup
from ..vehicles.currents import CONTROL_S, carried, current_series, gauss_markov
from ..vehicles.reckoning import Wrong

if TYPE_CHECKING:
    from ..vehicles.guidance.guided_fleet import GuidedFleet


class MissionCurrent:
    """The current of one mission, and how far it has carried what drifts in it."""

    def __init__(self, setup: Setup, streams: Streams) -> None:
        self._setup, self._streams = setup, streams

    @property
    def is_steady(self) -> bool:
        """Whether the current never varies, so that it is the same for every seed."""
        return self._setup.scenario.environment.current_variation_m_per_s == 0.0

    @property
    def series(self) -> Floats:
        """The current (m/s) along x and y in each control interval, shape (n, 2)."""
        return self._drawn[: self._setup.control_intervals]

    @cached_property
    def _drawn(self) -> Floats:
        """The same, as far as the last sample of the IMU, which may come long after the end."""
        asked, rate = self._setup.scenario.environment, self._setup.scenario.navigation.imu_rate_hz
        last = math.ceil(self._setup.scenario.duration_s * rate) / rate
        count = max(self._setup.control_intervals, math.ceil(last / CONTROL_S))
        return current_series(
            asked.current_m_per_s,
            math.radians(asked.current_direction_deg),
            asked.current_variation_m_per_s,
            asked.current_variation_time_s,
            CONTROL_S,
            self._streams.of(Purpose.CURRENT).standard_normal((count, 2)),
        )

    def carried(self, times: Floats) -> Floats:
        """Return how far (m) the water has moved by each instant (s), shape (n, 2)."""
        return carried(self._drawn, CONTROL_S, times)


def slow_gnss(setup: Setup, streams: Streams) -> Floats:
    """Return the slow error (m) of each ASV's GNSS position in each control interval, (m, n, 2)."""
    usbl, asvs = setup.scenario.usbl, setup.scenario.asvs.count
    count = setup.control_intervals
    if usbl.gnss_correlated_sd_m == 0.0:
        return np.zeros((asvs, 1, 2))
    return np.stack([
        gauss_markov(
            usbl.gnss_correlated_sd_m, usbl.gnss_time_constant_s, CONTROL_S,
            streams.of(Purpose.GNSS, asv).standard_normal((count, 2)),
        )
        for asv in range(asvs)
    ])  # fmt: skip


def guided_auvs(setup: Setup, water: MissionCurrent, wrong: Wrong | None) -> "GuidedFleet":
    """Return the trajectories of all AUVs along their tours.

    They steer by their estimates, and their dead reckoning is `wrong`; by the truth for None.
    """
    from ..vehicles.guidance.departure import DeparturePlan
    from ..vehicles.guidance.guided_fleet import GuidedFleet
    from ..vehicles.guidance.sensing import SteeringDrift

    scenario, auvs, navigation = setup.scenario, setup.scenario.auvs, setup.scenario.navigation
    drift = None
    if wrong is not None:
        beyond = math.ceil((setup.afterwards_s + 1.0) * navigation.imu_rate_hz)
        walks = np.pad(wrong.walks, ((0, 0), (0, beyond), (0, 0)), mode="edge")
        drift = SteeringDrift(wrong._replace(walks=walks), navigation.velocity == "through_water")
    return GuidedFleet(
        auvs.vehicle.model,
        DeparturePlan(
            paths=[plan.tour for plan in setup.plans],
            speed_m_per_s=auvs.speeds,
            depth_m=[scenario.survey.depth(auv) for auv in range(auvs.count)],
            names=[f"AUV{index}" for index in range(auvs.count)],
        ),
        dict(auvs.vehicle.coefficients),
        currents=water.series,
        duration_s=setup.control_intervals * CONTROL_S,
        drift=drift,
    )


def guided_asvs(
    setup: Setup,
    stations: Sequence[tuple[float, float]],
    streams: Streams,
    water: MissionCurrent,
) -> "GuidedFleet":
    """Return the trajectories of all ASVs, which keep their stations by noisy GNSS positions."""
    from ..vehicles.guidance.departure import DeparturePlan
    from ..vehicles.guidance.guided_fleet import GuidedFleet

    scenario, asvs, count = setup.scenario, setup.scenario.asvs, setup.control_intervals
    noise = [
        streams.of(Purpose.STATION, asv).standard_normal((count, 2)) * scenario.usbl.gnss_sd_m
        for asv in range(asvs.count)
    ]
    return GuidedFleet(
        asvs.vehicle.model,
        DeparturePlan(
            stations=np.array(stations), names=[f"ASV{index}" for index in range(asvs.count)]
        ),
        dict(asvs.vehicle.coefficients),
        currents=water.series,
        duration_s=count * CONTROL_S,
        position_noise=np.stack(noise) + slow_gnss(setup, streams),
    )
