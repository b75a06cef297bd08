"""One vehicle of a fleet under way, as the rest of the mission sees it."""

from math import cos, sin
from typing import Protocol

import numpy as np

from ...core.handed import Handed
from .. import logs
from ..hulls.frames import Floats
from ..motion import HEADINGS, PLACE, Motion, distance_at, lines, place_at
from ..vehicle import Place
from . import departure, flight
from .tracks import Flags, Ints, Tracks


class UnderWay(Protocol):
    """What a vehicle needs of its fleet: to be moved on, and its log."""

    control_s: float
    motion: Motion
    active: Ints
    at_limit: Flags  # whether an actuator was at its limit, for each vehicle and control instant
    stations: Floats
    tracks: Tracks
    flight: Handed  # what compiled code is handed once, a Flight

    def advance(self, time_s: float) -> None:
        """Make the state at an instant (s) known."""


class GuidedVehicle:
    """A vehicle that goes where its controller, its hull and the sea take it.

    It answers for the past as well as for the present; asked for later, its whole fleet moves on.
    """

    def __init__(self, fleet: UnderWay, number: int) -> None:
        self._fleet, self._number = fleet, number

    def _known(self, times: Floats) -> Floats:
        """Return instants (s) up to which the fleet has been moved by now, (n,)."""
        instants = np.array(times, dtype=np.float64)
        if len(instants):
            self._fleet.advance(float(instants.max()))
        return instants

    def _table(self, times: Floats) -> Floats:
        """Return the interpolated line of the log of each instant, (n, 6)."""
        return lines(*self._fleet.motion, self._number, self._known(times))

    def at(self, time: float) -> Place:
        """Return the true place at an instant (s)."""
        self._fleet.advance(time)
        return Place(*place_at(*self._fleet.motion, self._number, time))

    def velocity(self, time: float) -> tuple[float, float, float]:
        """Return the true velocity over ground (m/s) along x, y and z at an instant (s)."""
        self._fleet.advance(time)
        table, first, step = self._fleet.motion
        begin, end = first[self._number : self._number + 2].tolist()
        return logs.velocity_at(table, begin, end, step, time)

    def sample(self, times: Floats) -> Floats:
        """Return x, y, z (m) and yaw (rad) at each instant (s), shape (n, 4)."""
        return self._table(times)[:, PLACE]

    def heading_integral(self, times: Floats) -> Floats:
        """Return the integrals of cos(yaw) and sin(yaw) from 0 to each instant (s), (n, 2)."""
        return self._table(times)[:, HEADINGS]

    def distance(self, time: float) -> float:
        """Return the horizontal distance travelled over ground until an instant (m)."""
        self._fleet.advance(time)
        return distance_at(*self._fleet.motion, self._number, time)

    def along(self, time: float) -> float | None:
        """Return how far (m) along its path it is, whole rows of the path before it and what of a
        straight one is behind it; None for a vehicle that keeps a station.
        """
        fleet, place = self._fleet, self.at(time)
        if len(fleet.stations):
            return None
        _, end, again = fleet.tracks.bounds[self._number].item()
        flown = fleet.active[self._number, : max(departure.begun(time, fleet.control_s), 1)]
        row = fleet.tracks.rows[flown[-1]]
        x, y, yaw, curvature, begin, length, *_ = row.item()
        into = (place.x - x) * cos(yaw) + (place.y - y) * sin(yaw)
        into = min(max(into, 0.0), length) if curvature == 0.0 else 0.0
        laps = int(np.count_nonzero(flown[1:] < flown[:-1]))
        last = fleet.tracks.rows[end - 1]
        lap = last["begin"] + last["length"] - fleet.tracks.rows[again]["begin"]
        return float(begin + into + laps * lap)

    def saturated(self, time: float) -> float:
        """Return the share of its control instants before an instant (s) at an actuator's limit."""
        self._fleet.advance(time)
        instants = max(departure.begun(time, self._fleet.control_s), 1)
        return float(self._fleet.at_limit[self._number, :instants].mean())

    def path_error(self, times: Floats) -> Floats:
        """Return the distance (m) of the true place from the path flown, or from the station."""
        fleet = self._fleet
        if len(fleet.stations):
            off = self._table(times)[:, :2] - fleet.stations[self._number]
            return np.asarray(np.hypot(off[:, 0], off[:, 1]))
        instants = self._known(times)
        errors = np.empty(len(instants))
        flight.beside(fleet.flight.address, self._number, instants, errors)
        return errors
