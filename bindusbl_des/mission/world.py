"""The world of one mission: its vehicles, what they carry, and the network between them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..core.streams import Purpose, Streams
from ..navigation.dead_reckoning import DeadReckoning
from ..navigation.navigators import Navigator
from ..protocol.network import Network
from ..protocol.passive.network import PassiveNetwork
from ..records.recorder import Recorder
from ..scenario.scenario import Scenario
from ..vehicles.fleet import Fleet


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

    def depth_noise(self, auv: int, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the pressure sensor's errors (m) at instants (s); equal at equal IMU samples."""
        navigation = self.scenario.navigation
        index = (times * navigation.imu_rate_hz).astype(np.intp)
        stream = self.streams.of(Purpose.DEPTH, auv)
        return stream.standard_normal(int(index[-1]) + 1)[index] * navigation.depth_sd_m
