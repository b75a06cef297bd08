"""A vehicle, moving or moored, and where it is at any instant.

Vessels that are steered go in straight legs at one speed, then rest.  An order holds from an
instant on that has not been asked for yet, and changes nothing before it; so the motion is known
for certain as far ahead as the lead of the orders.
"""

from collections.abc import Sequence
from math import atan2, cos, hypot, inf, sin
from typing import NamedTuple

import numpy as np

from ...support.arrays import Floats
from ..geometry.paths import Path, path_rows
from . import motion
from .motion import COS, HEADINGS, LEG_COLUMNS, PLACE, Motion


class Place(NamedTuple):
    """A vehicle's position (survey frame, m, z down) and heading (rad, from +x to +y)."""

    x: float
    y: float
    z: float
    yaw: float


class Vehicle:
    """A vehicle, whose lines in a fleet's motion say where it is at any instant of the mission."""

    def __init__(self, of_fleet: Motion, number: int) -> None:
        self._motion, self._number = of_fleet, number

    def _advance(self, time: float) -> None:
        """Make the motion known up to an instant (s), where it is not known beforehand."""

    def _until(self, times: Floats) -> Floats:
        """Return a copy of instants (s), (n,), after making the motion known up to the last of
        them.
        """
        instants = np.array(
            times, dtype=np.float64
        )  # numba would compile anew for a read-only array
        if len(instants):
            self._advance(float(instants.max()))
        return instants

    def _lines(self, times: Floats) -> Floats:
        """Return the vehicle's lines at n instants (s), (n, 8), as :func:`.motion.lines` has
        them.
        """
        return motion.lines(*self._motion, self._number, self._until(times))

    def at(self, time: float) -> Place:
        """Return the true position and heading at an instant (s)."""
        self._advance(time)
        return Place(*motion.place_at(*self._motion, self._number, time))

    def sample(self, times: Floats) -> Floats:
        """Return x, y, z (m) and yaw (rad) at each instant (s), shape (n, 4)."""
        return self._lines(times)[:, PLACE]

    def heading_integral(self, times: Floats) -> Floats:
        """Return the integrals of cos(yaw) and sin(yaw) from 0 to each instant (s), shape (n, 2).

        With them a velocity that is constant in the body frame is integrated along the path
        travelled.
        """
        return self._lines(times)[:, HEADINGS]

    def distance(self, time: float) -> float:
        """Return the distance (m) travelled by an instant (s)."""
        self._advance(time)
        return motion.distance_at(*self._motion, self._number, time)

    def path_error(self, times: Floats) -> Floats:
        """Return the distance (m) from the planned path at instants (s); empty without a plan."""
        return np.zeros(0)

    def along(self, time: float) -> float | None:
        """Return how far (m) along its planned path the vehicle is at an instant (s), repeated
        tours included.

        None without a plan that it is known to follow.
        """
        return None

    def saturated(self, time: float) -> float | None:
        """Return the share of control instants before an instant (s) with an actuator at its limit.

        None for a vehicle without actuators.
        """
        return None


class SegmentedTrajectory(Vehicle):
    """A vehicle without dynamics: it keeps exactly to legs that are known beforehand.

    `legs` are its lines as :mod:`.motion` has them; `planned` says whether they are its planned
    path.
    """

    def __init__(self, legs: Floats, *, planned: bool = True) -> None:
        super().__init__(Motion(legs, np.array([0, len(legs)]), np.zeros(1)), 0)
        self.legs, self._planned = legs, planned

    def path_error(self, times: Floats) -> Floats:
        return np.zeros(len(times) if self._planned else 0)

    def along(self, time: float) -> float | None:
        return self.distance(time) if self._planned else None


def moored(place: Place) -> SegmentedTrajectory:
    """Return a vehicle that rests at a position."""
    return SegmentedTrajectory(motion.legs(np.array([[*place, 0.0, 0.0, 0.0, 0.0]])))


def kinematic(path: Path, speed: float, depth: float, until: float = 0.0) -> SegmentedTrajectory:
    """Return a vehicle that follows a path at constant speed (m/s) and depth (m), exactly.

    Where the path slopes, `speed` is horizontal and the depth changes.  At the end of a path the
    vehicle rests; a tour it repeats until the instant `until` (s), at least.
    """
    rows, again = path_rows(path)
    flown = [rows]
    end = path.length
    while again >= 0 and end < speed * until:
        lap = rows[again:].copy()
        lap["begin"] += end - rows["begin"][again]
        end += path.length - rows["begin"][again]
        flown.append(lap)
    rows = np.concatenate(flown)
    table = np.zeros((len(rows) + 1, COS))
    table[:-1, motion.X], table[:-1, motion.Y] = rows["x"], rows["y"]
    table[:-1, motion.YAW] = rows["yaw"]
    table[:-1, motion.SPEED] = speed
    table[:-1, motion.TURN] = rows["curvature"] * speed
    table[:-1, motion.BEGIN] = rows["begin"] / speed
    table[-1, [motion.X, motion.Y, motion.YAW]] = path.end
    table[-1, motion.BEGIN] = end / speed
    table[:, motion.Z] = depth
    table[:-1, motion.Z] -= rows["above"]
    table[:-1, motion.CLIMB] = rows["slope"] * speed
    return SegmentedTrajectory(motion.legs(table))


def recorded(times: Floats, positions: Floats) -> SegmentedTrajectory:
    """Return a vehicle that repeats a recorded track: straight legs between its samples.

    Take times (n,), s, strictly increasing, and positions (n, 3), m, z down; n >= 2.  Before the
    first and after the last sample it rests there, with the heading of the leg next to it.
    """
    steps, spans = np.diff(positions, axis=0), np.diff(times)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    yaw = np.arctan2(steps[:, 1], steps[:, 0])
    for leg in np.flatnonzero(lengths == 0.0):  # a leg without motion keeps the heading before it
        yaw[leg] = yaw[leg - 1] if leg else 0.0
    table = np.zeros((len(times) + 1, COS))
    table[1:, : motion.YAW] = positions
    table[1:-1, motion.YAW] = yaw
    table[1:-1, motion.SPEED] = lengths / spans
    table[1:-1, motion.CLIMB] = steps[:, 2] / spans
    table[1:, motion.BEGIN] = times
    table[-1, motion.YAW] = yaw[-1]
    table[0, : motion.SPEED] = table[1, : motion.SPEED]  # at rest until the track begins
    table[0, motion.BEGIN] = times[0]
    return SegmentedTrajectory(motion.legs(table), planned=False)


class Steered:
    """Surface vehicles without dynamics, each on its way to the target of its last order.

    `motion` is one table of all their legs; orders are written into it.
    """

    def __init__(self, places: Floats, speeds: Floats, orders: int, lead_s: float) -> None:
        """Let vehicles rest at `places` (m, 2), in m, until their first orders.

        They go at `speeds` (m,), m/s.  Each gets at most `orders` orders, each `lead_s` (s) or more
        ahead.
        """
        count, lines = len(places), 1 + 2 * orders
        self._tables = np.zeros((count, lines, LEG_COLUMNS))
        self._tables[:, :, motion.BEGIN] = inf  # legs without an order yet
        for table, (x, y) in zip(self._tables, places, strict=True):
            table[0] = motion.legs(np.array([[x, y, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]]))[0]
        first = np.arange(count + 1, dtype=np.int64) * lines
        self.motion = Motion(self._tables.reshape(-1, LEG_COLUMNS), first, np.zeros(count))
        self.vehicles: Sequence[SegmentedTrajectory] = [
            SegmentedTrajectory(table, planned=False) for table in self._tables
        ]
        self.speeds, self.lead_s = speeds.tolist(), lead_s
        #: The target of each vehicle: where it rests, or will rest (m, 2), m.
        self.bound_for: Floats = np.array(places, dtype=np.float64)

    def places(self, time: float) -> Floats:
        """Return the positions (m, 2), m, at an instant (s), by the orders so far."""
        return np.array([vehicle.at(time)[:2] for vehicle in self.vehicles])

    def go(self, time: float, targets: Floats) -> None:
        """Order all vehicles to their targets (m, 2), m, from an instant (s) on.

        The instant must not be before that of an earlier order.  A vehicle whose target is
        unchanged goes on.
        """
        for number in np.flatnonzero((targets != self.bound_for).any(axis=1)).tolist():
            self._turn(number, time, float(targets[number, 0]), float(targets[number, 1]))
        self.bound_for = np.array(targets, dtype=np.float64)

    def _turn(self, number: int, time: float, x: float, y: float) -> None:
        """Write the leg of a vehicle that sets out for a position (m) at an instant (s)."""
        vehicle, table = self.vehicles[number], self._tables[number]
        here = vehicle.at(time)
        ahead, aside = vehicle.heading_integral(np.array([time]))[0].tolist()
        travelled, way = vehicle.distance(time), hypot(x - here.x, y - here.y)
        yaw = atan2(y - here.y, x - here.x) if way else here.yaw
        cosine, sine, speed = cos(yaw), sin(yaw), self.speeds[number]
        lasts = way / speed
        line = int(np.searchsorted(table[:, motion.BEGIN], time))  # legs from here on are replaced
        table[line:, motion.BEGIN] = inf
        if way:
            going = here.x, here.y, 0.0, yaw, speed, 0.0, 0.0, time
            table[line] = *going, ahead, aside, travelled, cosine, sine
            line += 1
        resting = x, y, 0.0, yaw, 0.0, 0.0, 0.0, time + lasts
        ahead, aside = ahead + cosine * lasts, aside + sine * lasts
        table[line] = *resting, ahead, aside, travelled + way, cosine, sine
