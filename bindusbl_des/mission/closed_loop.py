"""Vehicles with dynamics on their way: hulls, controllers and the water of a scenario.

Hulls and controllers are loaded when somebody needs them: most missions are kinematic.
"""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..core.arrays import Floats
from ..core.lazy import cached_property
from ..core.streams import Purpose, Streams
from ..geometry.paths import Path
from ..protocol.anchors.placing import Room
from ..scenario.destinations import NoStations, asv_stations, route_of, tracks_of
from ..scenario.scenario import Scenario
from ..scenario.site import area_of, vessel_tracks
from ..vehicles.currents import CONTROL_S, carried, current_series, gauss_markov
from ..vehicles.reckoning import Wrong

if TYPE_CHECKING:
    from ..vehicles.guidance import GuidedFleet


# Sound is at least this fast (m/s), so that it has arrived this long after the mission's end.
SLOWEST_SOUND = 1300.0

# Vessels that are told where to go set out so much later (s), at least.
STARTING_S = 1.0


class MissionCurrent:
    """The current of one mission, and how far it has carried what drifts in it."""

    def __init__(self, scenario: Scenario, streams: Streams) -> None:
        self._scenario, self._streams = scenario, streams

    @property
    def is_steady(self) -> bool:
        """Whether the current never varies, so that it is the same for every seed."""
        return self._scenario.environment.current_variation_m_per_s == 0.0

    @property
    def series(self) -> Floats:
        """The current (m/s) along x and y in each control interval, shape (n, 2)."""
        return self._drawn[: control_intervals(self._scenario)]

    @cached_property
    def _drawn(self) -> Floats:
        """The same, as far as the last sample of the IMU, which may come long after the end."""
        asked, rate = self._scenario.environment, self._scenario.navigation.imu_rate_hz
        last = math.ceil(self._scenario.duration_s * rate) / rate
        count = max(control_intervals(self._scenario), math.ceil(last / CONTROL_S))
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


def afterwards_s(scenario: Scenario) -> float:
    """Return how long (s) after its end a mission still asks where vehicles are.

    Sound sent at the last instant is followed to the farthest vehicle.
    """
    try:
        farthest = max(math.hypot(x, y) for x, y in asv_stations(scenario))
    except NoStations:
        farthest = room_of(scenario).farthest_m
    area, auvs = area_of(scenario), scenario.auvs
    ends = [math.hypot(*place) for place in (*(auvs.launch_m or ()), *(auvs.recovery_m or ()))]
    across = scenario.acoustics.hf.range_m + 2 * max(area.across, area.farthest, *ends)
    return 2.0 + (farthest + across + scenario.survey.deepest) / SLOWEST_SOUND


def room_of(scenario: Scenario) -> Room:
    """Return where ASVs that move may go, and how long (s) sound travels in it at most.

    Twice as far from the origin as any AUV is planned to be, nobody has a reason to be farther.
    """
    auvs, route, area = scenario.auvs, route_of(scenario), area_of(scenario)
    tracks = tracks_of(scenario) or []
    places = (
        *(auvs.launch_m or ()), *(auvs.recovery_m or ()),
        *(place for way in route.places for place in way),
        *(place[:2] for _, track in tracks for place in track),
    )  # fmt: skip
    extent = max(area.farthest, area.across, *(math.hypot(*place) for place in places))
    placement = scenario.asvs.formation
    tracks = vessel_tracks(scenario, placement.recording) if placement.recording else []
    vessels = (
        *(getattr(placement, "start_m", None) or ()),
        *(place[:2] for _, track in tracks for place in track),
    )
    farthest = max([2.0 * extent, *(math.hypot(*place) for place in vessels)])
    way = extent + farthest + scenario.survey.deepest
    return Room(farthest, STARTING_S + way / SLOWEST_SOUND)


def control_intervals(scenario: Scenario) -> int:
    """Return the number of control intervals of a trajectory that outlasts the mission a little."""
    return math.ceil((scenario.duration_s + afterwards_s(scenario)) / CONTROL_S)


def slow_gnss(scenario: Scenario, streams: Streams) -> Floats:
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
    scenario: Scenario, tours: Sequence[Path], water: MissionCurrent, wrong: Wrong | None
) -> "GuidedFleet":
    """Return the trajectories of all AUVs along their tours.

    They steer by their estimates, and their dead reckoning is `wrong`; by the truth for None.
    """
    from ..vehicles.guidance import DeparturePlan, GuidedFleet, SteeringDrift

    auvs, navigation = scenario.auvs, scenario.navigation
    drift = None
    if wrong is not None:
        beyond = math.ceil((afterwards_s(scenario) + 1.0) * navigation.imu_rate_hz)
        walks = np.pad(wrong.walks, ((0, 0), (0, beyond), (0, 0)), mode="edge")
        drift = SteeringDrift(wrong._replace(walks=walks), navigation.velocity == "through_water")
    return GuidedFleet(
        auvs.vehicle.model,
        DeparturePlan(
            paths=tours,
            speed_m_per_s=auvs.speeds,
            depth_m=[scenario.survey.depth(auv) for auv in range(auvs.count)],
            names=[f"AUV{index}" for index in range(auvs.count)],
        ),
        dict(auvs.vehicle.coefficients),
        currents=water.series,
        duration_s=control_intervals(scenario) * CONTROL_S,
        drift=drift,
    )


def guided_asvs(
    scenario: Scenario,
    stations: Sequence[tuple[float, float]],
    streams: Streams,
    water: MissionCurrent,
) -> "GuidedFleet":
    """Return the trajectories of all ASVs, which keep their stations by noisy GNSS positions."""
    from ..vehicles.guidance import DeparturePlan, GuidedFleet

    asvs, count = scenario.asvs, control_intervals(scenario)
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
        position_noise=np.stack(noise) + slow_gnss(scenario, streams),
    )
