"""The fleet's believed positions of all vehicles, and so which AUVs are within reach of which ASVs,
with the margin of a scenario (`protocol.conflict_margin_m`).

The fleet knows where it launched the AUVs, what it has planned for them, and the fixes that it has
made: it believes each AUV at its last fix, or where the plan has carried it from there.  It knows
true positions only where a scenario says so.
"""

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from ...support.arrays import Flags, Floats
from ..acoustics.propagation import SignalBand
from ..geometry.land import Land
from ..geometry.paths import Path
from ..records.rows import EventBuffer, Rows
from ..scenario.groups import Auv
from ..scenario.site import Site
from ..vehicles.fleet import VehicleFleet
from ..vehicles.motion import SPEED, places
from ..vehicles.vehicle import (
    Place,
    SegmentedTrajectory,
    Vehicle,
    kinematic,
    moored,
    recorded,
)
from .conflicts import Surveyed, VehiclePositions, hearing

Spot = tuple[float, float]

# The part of the tour that is searched for a fix: around the expected position, this share of the
# distance since the fix before, and this much more (m) for turns and fix noise.  Wide enough for a
# vehicle that a current delays, narrow enough not to mistake the next lap for this one.
SHARE_OF_WAY, LEAST_REACH = 0.3, 10.0
STEP_M, MOST_STEPS = 0.25, 4000

# Typical distance (m) of a fix from the AUV's tour: noise, and steering errors
BESIDE_M = 2.0


class Course(Protocol):
    """What is planned for one AUV, and carries its fixes forward."""

    def fixed(self, time: float, place: Spot) -> None:
        """Take in a fix: the AUV was at `place`, x and y (m), at `time` (s)."""

    def at(self, time: float) -> Spot:
        """Return the position (m) that is expected at an instant (s) after its last fix."""


class Touring:
    """A course along a planned tour at the planned speed (m/s), from its start.

    A fix gives the distance along the tour.  Its distance from the tour is left out: that is noise
    of the fix, or an error that the AUV corrects once it has the fix.  Where legs lie close to each
    other, the most likely one is taken.
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
    """A course whose shape and times are known: a track to repeat, or a position to hold.

    The last fix shifts it as a whole.
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
    """Believes each AUV at its last fix, at first where it was launched."""

    def __init__(self, launched: Floats) -> None:
        """Take the positions x, y, z (m) of the launch, shape (n, 3)."""
        self._places = launched

    def note(self, fixes: Rows) -> None:
        """Note fixes, rows of the buffer."""
        for fix in fixes:
            self._places[fix["auv"], :2] = fix["x_m"], fix["y_m"]

    def at(self, time: float) -> Floats:
        """Return the believed positions of the AUVs at an instant (s), shape (n, 3), m."""
        return self._places.copy()


class CarriedForward:
    """Believes each AUV where its plan has carried it since its last fix."""

    def __init__(self, launched: Floats, courses: Sequence[Course]) -> None:
        self._places, self._courses = launched, courses

    def note(self, fixes: Rows) -> None:
        """Note fixes, rows of the buffer; each holds at the instant of its ping."""
        for fix in fixes:
            place = float(fix["x_m"]), float(fix["y_m"])
            self._courses[fix["auv"]].fixed(float(fix["pinged_at_s"]), place)

    def at(self, time: float) -> Floats:
        """Return the believed positions of the AUVs at an instant (s), shape (n, 3), m."""
        places = self._places.copy()
        places[:, :2] = [course.at(time) for course in self._courses]
        return places


Prediction = LastFixes | CarriedForward


class PredictedPositions:
    """The fleet's believed positions of its AUVs: the truth, or predicted from their fixes."""

    def __init__(
        self,
        auvs: VehicleFleet,
        asvs: VehicleFleet,
        band: SignalBand,
        margin: float,
        prediction: Prediction | None,
        fixes: EventBuffer,
        land: Land | None = None,
    ) -> None:
        """An ASV hears AUVs within the reach of the HF band plus a margin (m), but for those behind
        land, wherever within that margin they are.

        Without a `prediction` the fleet knows the truth.
        """
        self._auvs, self._asvs, self._slant = auvs, asvs, band.slant
        self._reach = band.reach + margin
        self._survey = VehiclePositions(Surveyed(auvs.motion, asvs.motion, self._reach, band.slant))
        self._prediction, self._fixes, self._noted = prediction, fixes, 0
        self._land = None if land is None else land.within(margin)

    @property
    def follow_fixes(self) -> bool:
        """Whether fixes change the believed positions."""
        return self._prediction is not None

    def seen(self, time: float) -> tuple[Floats, Floats, Flags]:
        """Return the believed positions of AUVs (n, 3) and ASVs (m, 3), m, at an instant (s), and
        which AUVs each ASV that works is believed to hear, (n, m).
        """
        self._asvs.advance(time)
        if self._prediction is None:
            self._auvs.advance(time)
            auvs, asvs, heard = self._survey.at(time)
        else:
            self._prediction.note(self._fixes.rows[self._noted :])
            self._noted = self._fixes.count
            auvs = self._prediction.at(time)
            asvs = places(self._asvs.motion, time)[:, :3]
            heard = hearing(auvs, asvs, self._reach, self._slant)
        if failed := self._asvs.failed(time):
            heard[:, failed] = False
        if self._land is not None:
            heard &= ~self._land.crossed(auvs, asvs)
        return auvs, asvs, heard

    def within(self, reach: float, slant: bool, time: float) -> Flags:
        """Return which AUVs are believed within a reach (m) of each ASV, (n, m), horizontal unless
        `slant`.
        """
        auvs, asvs, _ = self.seen(time)
        return hearing(auvs, asvs, reach, slant)


def prediction_of(site: Site, launched: Floats) -> Prediction | None:
    """Return how a fleet predicts the AUVs that it has launched at positions (n, 3), m; None where
    it knows the truth.
    """
    match site.positions:
        case "last_fix":
            return LastFixes(launched)
        case "carried_forward":
            return CarriedForward(launched, courses(site))
        case _:
            return None


def courses(site: Site) -> list[Course]:
    """Return what is planned for each AUV of a scenario."""
    return [
        Touring(plan.tour, auv.speed_m_per_s) if plan is not None else Shifted(_unflown(site, auv))
        for auv, plan in zip(site.auvs, site.plans, strict=True)
    ]


def _unflown(site: Site, auv: Auv) -> SegmentedTrajectory:
    """Return the motion of an AUV without a plan: it holds its position, or repeats a track."""
    held, track = site.held_places_m[auv.number], site.auv_tracks[auv.number]
    if held is not None:
        return moored(Place(*held, site.depth_at(auv, held), 0.0))
    assert track is not None, "an AUV flies, holds, or repeats a track"
    return recorded(*track)


def planned_vehicles(site: Site, lasts: float) -> list[SegmentedTrajectory]:
    """Return the planned motion of the AUVs of a scenario for `lasts` (s), AUV0 first.

    AUVs with dynamics are planned without, at their commanded speed.

    Raises:
        ValueError: when the route cannot be flown.
        PluginError: when a user-defined route is not allowed, or makes none.
    """
    return [
        _unflown(site, auv)
        if plan is None
        else kinematic(
            plan.tour if auv.group.altitude.altitude_m is None else site.tour_of(auv, plan),
            auv.speed_m_per_s,
            auv.depth_m,
            lasts,
        )
        for auv, plan in zip(site.auvs, site.plans, strict=True)
    ]


def planned_speeds(site: Site, auvs: VehicleFleet) -> Floats:
    """Return the planned speed of each AUV (m/s), (n,): on a track the speed of its fastest leg."""
    speed = np.array(site.planned_speeds_m_per_s)
    for wing, route in zip(site.wings, site.routes, strict=True):
        if route.is_recorded and auvs.poses is None:
            members = list(wing.members)
            fastest = np.maximum.reduceat(auvs.motion.table[:, SPEED], auvs.motion.first[:-1])
            speed[members] = fastest[members]
    return speed
