"""Vessels that are told again and again where to go, as a mission goes on."""

from collections.abc import Generator
from itertools import count
from math import ceil
from typing import Any, NamedTuple

import numpy as np
import simpy
from numpy.typing import NDArray

from ....support.arrays import Floats
from ....support.plugins import PluginError, asked, shown
from ...records.rows import EventBuffer
from ...scenario.families import PLACEMENT
from ...scenario.own_routes import own_placement
from ...scenario.sections.placements import REPLAN_S, SPEED_M_PER_S, Assign, Follow, Placed, Zigzag
from ...scenario.sections.vehicles import Auvs
from ...scenario.site import Site
from ...vehicles.fleet import VehicleFleet
from ...vehicles.vehicle import Steered
from ..predicted_positions import CarriedForward
from ..steps import moment
from ..view import KnownFixes
from . import assign, follow, zigzag
from .view import AnchorView, Mover, OwnMover


class Room(NamedTuple):
    """How far (m) from the origin vessels may go, and the longest (s) that a sound between them and
    AUVs is under way then.
    """

    farthest_m: float
    lead_s: float


class Pace(NamedTuple):
    """How fast (m/s) vessels go, and how often (s) they are told where to."""

    speed_m_per_s: float
    replan_s: float


class Anchors:
    """The vessels of a mission, and who tells them where to go.

    They set out for what they are told a `lead` (s) later: no sound that is under way by then is
    still on its way when they do, so that where they are was known whenever it was worked out.
    """

    def __init__(
        self,
        site: Site,
        mover: Mover,
        pace: Pace,
        prediction: CarriedForward,
        known: KnownFixes,
        lead_s: float,
    ) -> None:
        """Launch the vessels where the site says, or else where they are to be at first.

        The `prediction` knows where AUVs were launched, and is told of the fixes of vessels alone;
        what is `known` of AUVs' estimates goes by those that were broadcast.
        """
        self._known = known
        self._mover, self._pace, self._prediction, self._lead = mover, pace, prediction, lead_s
        scenario = site.scenario
        self._reach, number = site.horizontal_reach_m, scenario.asvs.count
        self._failures, self._all = site.failures, np.ones(number, dtype=np.bool_)
        given = getattr(scenario.asvs.formation, "start_m", None)
        #: Whether nobody has told vessels yet where to go.
        self._is_new = given is not None
        nowhere = np.full((number, 2), np.nan)
        start = np.array(given) if given else mover.targets(self._view(0.0, 0.0, nowhere, nowhere))
        orders = 1 + ceil(scenario.duration_s / pace.replan_s)
        self.steered = Steered(start, pace.speed_m_per_s, orders, lead_s)
        self.fleet = VehicleFleet(self.steered.vehicles, self.steered.motion, steered=self.steered)
        self._noted = 0

    def _view(self, time: float, begins: float, vessels: Floats, bound_for: Floats) -> AnchorView:
        return AnchorView(
            time, begins, vessels, bound_for, self._working(begins), self._pace.speed_m_per_s,
            self._reach, self._prediction, self._known,
        )  # fmt: skip

    def _working(self, time: float) -> NDArray[np.bool_]:
        """Return who has not failed by an instant (s) (m,); at first all are launched."""
        if self._failures is None or time == 0.0:
            return self._all.copy()
        return self._failures.alive(time)

    def keep_placing(
        self, env: simpy.Environment, fixes: EventBuffer | None
    ) -> Generator[simpy.Event, None, None]:
        """Tell vessels where to go, again and again, on the fixes made so far.

        There are none where AUVs fix themselves: then the fleet knows what is planned alone.
        """
        for number in count(0 if self._is_new else 1):
            time = number * self._pace.replan_s
            yield moment(env, time)
            if fixes is not None:
                self._note(fixes)
            begins = time + self._lead
            places, bound_for = self.steered.places(begins), self.steered.bound_for.copy()
            view = self._view(time, begins, places, bound_for)
            if view.working.any():
                self.steered.go(begins, self._mover.targets(view))

    def _note(self, fixes: EventBuffer) -> None:
        """Plot the last fix of each AUV that has new ones."""
        made, self._noted = fixes.rows[self._noted :], fixes.count
        last = {auv: row for row, auv in enumerate(made["auv"].tolist())}
        self._prediction.note(made[sorted(last.values())])


def anchors_of(site: Site, prediction: CarriedForward, known: KnownFixes, room: Room) -> Anchors:
    """Return the vessels that are told where to go, of a site where they are.

    Raises:
        PluginError: when a placement of one's own cannot be used.
    """
    asvs = site.scenario.asvs
    placed = asvs.formation.replanned
    mover: Mover
    if placed is not None:
        mover = _shipped(placed, site.scenario.auvs)
        pace = Pace(placed.speed_m_per_s, placed.replan_s)
    else:
        own = own_placement(asvs.formation.choice, site.plan_view)  # made anew: it may remember
        name = str(asvs.formation.choice)
        if asvs.vehicle.is_steered:
            raise PluginError(
                PLACEMENT.key,
                f"{name!r} moves ASVs along straight lines, and {asvs.vehicle} keeps a "
                "station; use asvs.vehicle: moored",
            )
        mover = OwnMover(name, own, room.farthest_m)
        words = ("speed_m_per_s", SPEED_M_PER_S), ("replan_s", REPLAN_S)
        pace = Pace(*(_number(name, own, word, usual) for word, usual in words))
    return Anchors(site, mover, pace, prediction, known, room.lead_s)


def _shipped(placement: Placed, auvs: Auvs) -> Mover:
    """Return a placement that ships, made anew, for some AUVs."""
    match placement:
        case Follow(horizon_s=horizon, hysteresis=share):
            return follow.FollowPlacement(horizon_s=horizon, hysteresis=share)
        case Assign(horizon_s=horizon, hysteresis=share):
            return assign.AssignPlacement(horizon_s=horizon, hysteresis=share)
        case Zigzag():
            still = auvs.route.is_held
            return zigzag.ZigzagPlacement(
                amplitude_m=placement.amplitude_m,
                period_s=placement.period_s,
                hysteresis=placement.hysteresis,
                replan_s=placement.replan_s,
                auv_speed=0.0 if still else max(auvs.speeds),
            )
    raise AssertionError(placement)


def _number(name: str, part: Any, word: str, usual: float) -> float:
    """Return the speed or the interval that somebody's own placement has, or the usual one."""
    found = asked(PLACEMENT.key, name, getattr, part, word, usual)
    least, most = (0.001, 20.0) if word == "speed_m_per_s" else (0.1, 1e6)
    fits = isinstance(found, int | float) and not isinstance(found, bool) and least <= found <= most
    if not fits:
        said = shown(PLACEMENT.key, name, found)
        raise PluginError(
            PLACEMENT.key,
            f"{name!r} has a {word} of {said}; it must be a number from {least:g} to {most:g}",
        )
    return float(found)
