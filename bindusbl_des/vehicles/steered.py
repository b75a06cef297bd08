"""Vessels that are told during the mission where to go: straight legs at one speed, then rest.

Each order says from when on it holds.  What has been asked for up to that instant stays as it was,
so a motion that is ordered farther ahead than anybody looks is as sure as one that is foreseen.
"""

from collections.abc import Sequence
from math import atan2, cos, hypot, inf, sin

import numpy as np

from ..core.arrays import Floats
from .motion import BEGIN, LEG_COLUMNS, Motion, legs
from .vehicle import SegmentedTrajectory


class Steered:
    """Vehicles without dynamics at the surface, each on its way to where it was last told to go.

    `motion` is that of all of them, in one table: orders are written into it.
    """

    def __init__(self, places: Floats, speed: float, orders: int, lead_s: float) -> None:
        """Let vehicles rest at places (m, 2), in m, until they are told where to go.

        They go at a `speed` (m/s), and are told `orders` times at most, each time for `lead_s` (s)
        later or more.
        """
        count, lines = len(places), 1 + 2 * orders
        self._tables = np.zeros((count, lines, LEG_COLUMNS))
        self._tables[:, :, BEGIN] = inf  # legs of orders that are still to come
        for table, (x, y) in zip(self._tables, places, strict=True):
            table[0] = legs(np.array([[x, y, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]]))[0]
        first = np.arange(count + 1, dtype=np.int64) * lines
        self.motion = Motion(self._tables.reshape(-1, LEG_COLUMNS), first, 0.0)
        self.vehicles: Sequence[SegmentedTrajectory] = [
            SegmentedTrajectory(table, planned=False) for table in self._tables
        ]
        self.speed, self.lead_s = speed, lead_s
        #: Where each vehicle rests, or will when it has arrived (m, 2), m.
        self.bound_for: Floats = np.array(places, dtype=np.float64)

    def places(self, time: float) -> Floats:
        """Return where the vehicles are at an instant (s), by the orders so far, (m, 2), m."""
        return np.array([vehicle.at(time)[:2] for vehicle in self.vehicles])

    def go(self, time: float, targets: Floats) -> None:
        """From an instant (s) on, no earlier than of any order before, go to targets (m, 2), m.

        Who is told to go where it goes already goes on.
        """
        for number in np.flatnonzero((targets != self.bound_for).any(axis=1)).tolist():
            self._turn(number, time, float(targets[number, 0]), float(targets[number, 1]))
        self.bound_for = np.array(targets, dtype=np.float64)

    def _turn(self, number: int, time: float, x: float, y: float) -> None:
        """Write the leg of a vehicle to a place (m) that it sets out for at an instant (s)."""
        vehicle, table = self.vehicles[number], self._tables[number]
        here = vehicle.at(time)
        ahead, aside = vehicle.heading_integral(np.array([time]))[0].tolist()
        travelled, way = vehicle.distance(time), hypot(x - here.x, y - here.y)
        yaw = atan2(y - here.y, x - here.x) if way else here.yaw
        cosine, sine, lasts = cos(yaw), sin(yaw), way / self.speed
        line = int(np.searchsorted(table[:, BEGIN], time))  # legs from here on are not gone
        table[line:, BEGIN] = inf
        if way:
            going = here.x, here.y, 0.0, yaw, self.speed, 0.0, 0.0, time
            table[line] = *going, ahead, aside, travelled, cosine, sine
            line += 1
        resting = x, y, 0.0, yaw, 0.0, 0.0, 0.0, time + lasts
        ahead, aside = ahead + cosine * lasts, aside + sine * lasts
        table[line] = *resting, ahead, aside, travelled + way, cosine, sine
