"""Whatever moves or keeps still in the mission, and where it is at any instant."""

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from .paths import Path

Array = NDArray[np.float64]


class Place(NamedTuple):
    """Where a vehicle is (survey frame, m, z down) and where it heads (rad, from +x to +y)."""

    x: float
    y: float
    z: float
    yaw: float


class Vehicle(Protocol):
    """A vehicle knows its place at any instant of the mission."""

    def at(self, time: float) -> Place:
        """Return the true place at an instant (s)."""

    def sample(self, times: Array) -> Array:
        """Return x, y, z (m) and yaw (rad) at each instant (s), shape (n, 4)."""

    def heading_integral(self, times: Array) -> Array:
        """Return the integrals of cos(yaw) and sin(yaw) from 0 to each instant (s), shape (n, 2).

        They carry a velocity that is constant in the body frame along the path actually travelled.
        """

    def distance(self, time: float) -> float:
        """Return the distance travelled until an instant (m)."""

    def path_error(self, times: Array) -> Array:
        """Return the distance from the planned path (m) at each instant; empty without a plan."""

    def saturated(self) -> float | None:
        """Return the share of control instants with an actuator at its limit; None without any."""


class Moored:
    """A vehicle that keeps its place."""

    def __init__(self, place: Place) -> None:
        self.place = place

    def at(self, time: float) -> Place:
        return self.place

    def sample(self, times: Array) -> Array:
        return np.tile(np.array(self.place), (len(times), 1))

    def heading_integral(self, times: Array) -> Array:
        return np.outer(times, (np.cos(self.place.yaw), np.sin(self.place.yaw)))

    def distance(self, time: float) -> float:
        return 0.0

    def path_error(self, times: Array) -> Array:
        return np.zeros(len(times))

    def saturated(self) -> None:
        return None


class Kinematic:
    """A vehicle that follows a path at constant speed and depth, exactly."""

    def __init__(self, path: Path, speed: float, depth: float) -> None:
        self.path = path
        self.speed = speed
        self.depth = depth

    def at(self, time: float) -> Place:
        x, y, yaw = self.path.at(self.speed * time)
        return Place(x, y, self.depth, yaw)

    def sample(self, times: Array) -> Array:
        poses = self.path.sample(self.speed * times)
        return np.insert(poses, 2, self.depth, axis=1)

    def heading_integral(self, times: Array) -> Array:
        # At constant speed the heading's integral is the displacement over the speed.  A path that
        # has ended keeps its last heading.
        poses = self.path.sample(self.speed * times)
        moved = (poses[:, :2] - np.array(self.path.start[:2])) / self.speed
        if self.path.repeats_from is None:
            resting = np.maximum(times - self.path.length / self.speed, 0.0)
            yaw = self.path.end.yaw
            moved = moved + np.outer(resting, (np.cos(yaw), np.sin(yaw)))
        return np.asarray(moved)

    def distance(self, time: float) -> float:
        travelled = self.speed * time
        ends = self.path.repeats_from is None
        return min(travelled, self.path.length) if ends else travelled

    def path_error(self, times: Array) -> Array:
        return np.zeros(len(times))

    def saturated(self) -> None:
        return None


class Recorded:
    """A vehicle that repeats a recorded track: straight lines between its samples.

    Before the first and after the last sample it keeps its place.
    """

    def __init__(self, times: Array, positions: Array) -> None:
        """Take times (n,), s, strictly increasing, and positions (n, 3), m, z down; n >= 2."""
        steps = np.diff(positions[:, :2], axis=0)
        yaw = np.arctan2(steps[:, 1], steps[:, 0])
        still = np.hypot(steps[:, 0], steps[:, 1]) == 0.0
        for leg in np.flatnonzero(still):  # a leg without motion keeps the heading before it
            yaw[leg] = yaw[leg - 1] if leg else 0.0
        self._times, self._positions, self._yaw = times, positions, yaw
        self._travelled = np.concatenate(([0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))))

    def at(self, time: float) -> Place:
        x, y, z, yaw = self.sample(np.array([time]))[0].tolist()
        return Place(x, y, z, yaw)

    def _leg(self, times: Array) -> NDArray[np.intp]:
        index = np.searchsorted(self._times, times, side="right") - 1
        return np.clip(index, 0, len(self._yaw) - 1)

    def sample(self, times: Array) -> Array:
        columns = [np.interp(times, self._times, column) for column in self._positions.T]
        return np.column_stack((*columns, self._yaw[self._leg(times)]))

    def heading_integral(self, times: Array) -> Array:
        # headings hold from each sample to the next, the first and last of them without end
        starts = self._times[:-1].copy()
        starts[0] = min(starts[0], 0.0)
        rates = np.column_stack((np.cos(self._yaw), np.sin(self._yaw)))
        at_starts = np.concatenate(
            (np.zeros((1, 2)), np.cumsum(rates[:-1] * np.diff(starts)[:, None], axis=0))
        )

        def integral(instants: Array) -> Array:
            leg = np.clip(np.searchsorted(starts, instants, side="right") - 1, 0, len(rates) - 1)
            return np.asarray(at_starts[leg] + rates[leg] * (instants - starts[leg])[:, None])

        return integral(times) - integral(np.zeros(1))

    def distance(self, time: float) -> float:
        start, end = np.interp([0.0, time], self._times, self._travelled)
        return float(end - start)

    def path_error(self, times: Array) -> Array:
        return np.empty(0)

    def saturated(self) -> None:
        return None
