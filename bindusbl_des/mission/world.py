"""The world of one mission: its vehicles, what they carry, and the network between them."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..core.streams import Purpose, Streams
from ..navigation.dead_reckoning import DeadReckoning
from ..navigation.navigators import Navigator
from ..protocol.network import Network
from ..protocol.passive.network import PassiveNetwork
from ..records.recorder import Recorder
from ..scenario.plans import plans_of
from ..scenario.scenario import Scenario
from ..scenario.survey_area import area_of, swath_of
from ..vehicles.fleet import Fleet
from ..vehicles.sweeping import Sweep, sweep
from ..vehicles.vehicle import Vehicle

# A lane whose end is this near (m) is flown; the instant of it is found to 2^-50 of the mission.
ARRIVED_M, HALVINGS = 1e-6, 50


@dataclass(frozen=True)
class World:
    """Everything that takes part in a mission, and the record of what has happened."""

    scenario: Scenario
    auv_fleet: Fleet
    asv_fleet: Fleet
    reckoning: DeadReckoning
    navigator: Navigator
    network: Network | PassiveNetwork
    record: Recorder
    streams: Streams

    @cached_property
    def swept(self) -> Sweep | None:
        """What of the survey the AUVs have swept, and when; None where nobody says how wide."""
        swath = swath_of(self.scenario)
        if swath is None:
            return None
        area, vehicles = area_of(self.scenario), self.auv_fleet.vehicles
        return sweep(area, vehicles, swath, self.scenario.duration_s)

    @cached_property
    def lanes(self) -> tuple[tuple[tuple[float, float], ...], ...] | None:
        """Where along its plan (m) each AUV's lanes begin and end; None without a plan."""
        if any(vehicle.along(0.0) is None for vehicle in self.auv_fleet.vehicles):
            return None
        if self.scenario.auvs.route.kind == "hold":
            return None
        return tuple(plan.lanes for plan in plans_of(self.scenario))

    def swept_m2(self, time: float, auv: int | None = None) -> float | None:
        """Return how much of the survey (m2) is swept by an instant (s): by all, or first by one.

        None where nobody says how wide a swath is.
        """
        return None if self.swept is None else float(self.swept.area(np.array([time]), auv)[0])

    def lanes_flown(self, auv: int) -> float | None:
        """Return which share of its lanes an AUV has flown; None without a plan."""
        if self.lanes is None:
            return None
        along = self.auv_fleet.vehicles[auv].along(self.scenario.duration_s)
        begin, end = np.array(self.lanes[auv]).T
        return float(np.clip(along - begin, 0.0, end - begin).sum() / (end - begin).sum())

    @property
    def finished_at(self) -> float | None:
        """The instant (s) at which the last AUV had flown all its lanes; None if one has not."""
        if self.lanes is None:
            return None
        found = [
            _reached(vehicle, lanes[-1][1] - ARRIVED_M, self.scenario.duration_s)
            for vehicle, lanes in zip(self.auv_fleet.vehicles, self.lanes, strict=True)
        ]
        known = [time for time in found if time is not None]
        return max(known) if len(known) == len(found) else None

    def depth_noise(self, auv: int, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the pressure sensor's errors (m) at instants (s); equal at equal IMU samples."""
        navigation = self.scenario.navigation
        index = (times * navigation.imu_rate_hz).astype(np.intp)
        stream = self.streams.of(Purpose.DEPTH, auv)
        return stream.standard_normal(int(index[-1]) + 1)[index] * navigation.depth_sd_m


def _reached(vehicle: Vehicle, along: float, until: float) -> float | None:
    """Return when (s) a vehicle was so far along its plan (m); None if it was not by an instant."""
    low, high = 0.0, until
    if (vehicle.along(high) or 0.0) < along:
        return None
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        if (vehicle.along(middle) or 0.0) < along:
            low = middle
        else:
            high = middle
    return high
