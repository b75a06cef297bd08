"""Where the surface fleet believes the AUVs to be: the last fix of each, or that carried forward.

A chart knows what the fleet knows: where it launched the AUVs, what it has planned for them, and
the fixes that it has made.  It never sees where they are.
"""

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..geometry.paths import Path
from ..records.rows import Rows
from ..vehicles.vehicle import Vehicle

Array = NDArray[np.float64]
Spot = tuple[float, float]

# A fix is sought on the tour where its AUV should be by now, give or take this share of the way
# since the fix before, and this much more (m): turns and fix noise.  Wide enough for a vehicle that
# a current delays, narrow enough that the next lap is not mistaken for this one.
SHARE_OF_WAY, LEAST_REACH = 0.3, 10.0
STEP_M, MOST_STEPS = 0.25, 4000

# How far (m) a fix is beside the way of its AUV, about: noise, and how well it steers.
BESIDE_M = 2.0


class Course(Protocol):
    """What is planned for one AUV, by which a fix of it is carried on."""

    def fixed(self, time: float, place: Spot) -> None:
        """Take in that the AUV was at a place (m) at an instant (s)."""

    def at(self, time: float) -> Spot:
        """Return where (m) it should be at an instant (s) after its last fix."""


class Touring:
    """A course along a planned tour at the planned speed (m/s), from its start.

    A fix tells how far along the tour the AUV is.  That it is beside it is left out: it is noise of
    the fix, or an error that the AUV steers back from when it has the fix.  Where legs lie close to
    each other, the one is taken on which it is most likely by now.
    """

    def __init__(self, tour: Path, speed: float) -> None:
        self._tour, self._speed = tour, speed
        self._along = self._since = 0.0

    def fixed(self, time: float, place: Spot) -> None:
        if time < self._since:  # an older ping, decided later
            return
        travelled = self._speed * (time - self._since)
        expected, reach = self._along + travelled, LEAST_REACH + SHARE_OF_WAY * travelled
        steps = min(math.ceil(2 * reach / STEP_M), MOST_STEPS)
        along = np.linspace(max(expected - reach, 0.0), expected + reach, steps + 1)
        ways = self._tour.sample(along)
        beside = np.hypot(ways[:, 0] - place[0], ways[:, 1] - place[1])
        unlikely = (beside / BESIDE_M) ** 2 + (2 * (along - expected) / reach) ** 2
        here = np.abs(along - along[np.argmin(unlikely)]) <= 2 * BESIDE_M
        nearest = int(np.argmin(np.where(here, beside, np.inf)))
        x, y, yaw = ways[nearest]
        ahead = (place[0] - x) * math.cos(yaw) + (place[1] - y) * math.sin(yaw)
        self._along, self._since = max(float(along[nearest] + ahead), 0.0), time

    def at(self, time: float) -> Spot:
        x, y, _ = self._tour.at(self._along + self._speed * (time - self._since))
        return x, y


class Shifted:
    """A course of which the shape and times are known: a track to be repeated, or a place to hold.

    The last fix moves it as a whole.
    """

    def __init__(self, shape: Vehicle) -> None:
        self._shape = shape
        self._since, self._aside = -math.inf, (0.0, 0.0)

    def fixed(self, time: float, place: Spot) -> None:
        if time >= self._since:
            x, y = self._shape.at(time)[:2]
            self._since, self._aside = time, (place[0] - x, place[1] - y)

    def at(self, time: float) -> Spot:
        x, y = self._shape.at(time)[:2]
        return x + self._aside[0], y + self._aside[1]


class LastFixes:
    """A chart of raw fixes: each AUV where its last fix had it, at first where it was launched."""

    def __init__(self, launched: Array) -> None:
        """Take the places x, y, z (m) of the launch, shape (n, 3)."""
        self._places = launched

    def note(self, fixes: Rows) -> None:
        """Plot fixes, rows of the buffer."""
        for fix in fixes:
            self._places[fix["auv"], :2] = fix["x_m"], fix["y_m"]

    def at(self, time: float) -> Array:
        """Return where the AUVs are believed to be at an instant (s), shape (n, 3), m."""
        return self._places.copy()


class CarriedForward:
    """A chart of fixes carried on by what is planned: each AUV where it should be by now."""

    def __init__(self, launched: Array, courses: Sequence[Course]) -> None:
        self._places, self._courses = launched, courses

    def note(self, fixes: Rows) -> None:
        """Plot fixes, rows of the buffer; each holds at the instant of its ping."""
        for fix in fixes:
            place = float(fix["x_m"]), float(fix["y_m"])
            self._courses[fix["auv"]].fixed(float(fix["pinged_at_s"]), place)

    def at(self, time: float) -> Array:
        """Return where the AUVs are believed to be at an instant (s), shape (n, 3), m."""
        places = self._places.copy()
        places[:, :2] = [course.at(time) for course in self._courses]
        return places


Chart = LastFixes | CarriedForward
