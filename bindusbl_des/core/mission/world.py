"""The world of one mission: its vehicles, their navigation, and the network between them."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...support.arrays import Floats
from ...support.facts import cached_property
from ...support.streams import Streams
from ..navigation.dead_reckoning import DeadReckoning, Odometry
from ..navigation.navigators import Navigator
from ..protocol.network import Network, PassiveNetwork
from ..records.rows import Recorder, Rows
from ..results.tables import numbers_of
from ..setup import Setup
from ..vehicles.fleet import VehicleFleet, VehicleTrack
from .trajectories import Trajectories, trajectories_of


class Samples(NamedTuple):
    """One AUV at n instants: its true motion and its own view of it.

    `odometry` is the dead reckoning of its sensors, `estimate` its estimated position (n, 2), m,
    with every fix delivered by then.
    """

    way: VehicleTrack
    odometry: Odometry
    estimate: Floats


def wrapped(yaw: Floats) -> Floats:
    """Return headings (rad) in (-pi, pi].

    >>> wrapped(np.array([0.0, np.pi, -np.pi])).round(9).tolist()
    [0.0, 3.141592654, 3.141592654]
    """
    return np.asarray(np.pi - np.mod(np.pi - yaw, 2 * np.pi))


@dataclass(frozen=True)
class World:
    """Everything that takes part in a mission, and its record."""

    setup: Setup
    auv_fleet: VehicleFleet
    asv_fleet: VehicleFleet
    reckoning: DeadReckoning
    navigator: Navigator
    network: Network | PassiveNetwork
    record: Recorder
    streams: Streams

    @cached_property
    def trajectories(self) -> Trajectories:
        """What follows from the AUVs' motion, once that is known to the mission's end."""
        return trajectories_of(self.setup, self.auv_fleet)

    @cached_property
    def broadcasts(self) -> Rows:
        """All frames of the mission as a row of numbers each, once it has ended."""
        return numbers_of("broadcasts", self.record.broadcasts)

    def sample(self, auv: int, times: Floats) -> Samples:
        """Sample one AUV at instants (s) by which its motion is known."""
        way = self.auv_fleet.ways.of(auv, times)
        odometry = self.reckoning.odometry(auv, way)
        return Samples(way, odometry, self.navigator.estimate(auv, odometry))
