"""ASVs that get new targets again and again during a mission."""

from collections.abc import Callable, Generator
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
from ...scenario.own_routes import placed as answer_of
from ...scenario.sections.placements import REPLAN_S, SPEED_M_PER_S
from ...scenario.site import Site
from ...vehicles.fleet import VehicleFleet
from ...vehicles.vehicle import Steered
from ..predicted_positions import CarriedForward
from ..steps import moment
from ..view import KnownFixes
from .information import FixErrors
from .view import AnchorView, Mover, OwnMover


class Room(NamedTuple):
    """How far (m) from the origin ASVs may go, and the longest travel time (s) of sound between
    ASVs and AUVs then.
    """

    farthest_m: float
    lead_s: float


class Pace(NamedTuple):
    """The speed of each ASV (m/s), (m,), and how often (s) they get new targets."""

    speeds_m_per_s: Floats
    replan_s: float


class Anchors:
    """The moving ASVs of a mission, and the placement that gives them targets.

    ASVs set out for a new target a `lead` (s) later: sound that is under way as the target is given
    has arrived by then, so the ASV's motion was known while it travelled.
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
        """Launch the ASVs where the site says, or else at their first targets.

        The `prediction` knows where AUVs were launched, and gets all fixes of ASVs; `known`
        estimates go by the fixes that were broadcast.
        """
        self._known = known
        self._mover, self._pace, self._prediction, self._lead = mover, pace, prediction, lead_s
        scenario = site.scenario
        self._closed = site.closed
        self._reach, number = site.horizontal_reach_m, scenario.asvs.count
        self._failures, self._all = site.failures, np.ones(number, dtype=np.bool_)
        given = getattr(scenario.asvs.formation, "start_m", None)
        #: Whether the first targets are yet to be given, at 0 s.
        self._is_new = given is not None
        nowhere = np.full((number, 2), np.nan)
        start = np.array(given) if given else mover.targets(self._view(0.0, 0.0, nowhere, nowhere))
        if self._closed is not None:
            start = np.array([self._closed.afloat((x, y)) for x, y in start.tolist()])
        orders = 1 + ceil(scenario.duration_s / pace.replan_s)
        self.steered = Steered(start, pace.speeds_m_per_s, orders, lead_s)
        self.fleet = VehicleFleet(self.steered.vehicles, self.steered.motion, steered=self.steered)
        self._noted = 0

    def _view(self, time: float, begins: float, vessels: Floats, bound_for: Floats) -> AnchorView:
        return AnchorView(
            time, begins, vessels, bound_for, self._working(begins), self._pace.speeds_m_per_s,
            self._reach, self._prediction, self._known,
        )  # fmt: skip

    def _working(self, time: float) -> NDArray[np.bool_]:
        """Return which ASVs have not failed by an instant (s), (m,); at first all are launched."""
        if self._failures is None or time == 0.0:
            return self._all.copy()
        return self._failures.alive(time)

    def keep_placing(
        self, env: simpy.Environment, fixes: EventBuffer | None
    ) -> Generator[simpy.Event, None, None]:
        """Give ASVs new targets, again and again, on the fixes made so far.

        `fixes` is None where AUVs fix themselves: then the fleet knows only what is planned.
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
                self.steered.go(begins, self._before_land(places, self._mover.targets(view)))

    def _before_land(self, places: Floats, targets: Floats) -> Floats:
        """Return targets (m, 2), m, that ASVs at places (m, 2) reach without going over land."""
        closed = self._closed
        if closed is None:
            return targets
        ways = zip(places.tolist(), targets.tolist(), strict=True)
        return np.array([closed.stopped((x, y), (to_x, to_y)) for (x, y), (to_x, to_y) in ways])

    def _note(self, fixes: EventBuffer) -> None:
        """Hand the last new fix of each AUV to the prediction."""
        made, self._noted = fixes.rows[self._noted :], fixes.count
        last = {auv: row for row, auv in enumerate(made["auv"].tolist())}
        self._prediction.note(made[sorted(last.values())])


def anchors_of(
    site: Site,
    prediction: CarriedForward,
    known: KnownFixes,
    room: Room,
    errors: Callable[[], list[FixErrors]],
) -> Anchors:
    """Return the moving ASVs of a site; `errors` returns each ASV's expected fixes of the AUVs.

    Raises:
        PluginError: when a user-defined placement cannot be used.
    """
    asvs = site.scenario.asvs
    placed = asvs.formation.replanned
    mover: Mover
    if placed is not None:
        mover = placed.mover(site, errors)
        speed, replan = placed.speed_m_per_s, placed.replan_s
    else:
        own = answer_of(asvs.formation, site.plan_view)  # new, since it may have state
        name = str(asvs.formation.choice)
        if not site.keeps_still:
            raise PluginError(
                PLACEMENT.key,
                f"{name!r} moves ASVs along straight lines, and {asvs.words} keeps a "
                "station; use asvs.vehicle: moored",
            )
        mover = OwnMover(name, own, room.farthest_m)
        words = ("speed_m_per_s", SPEED_M_PER_S), ("replan_s", REPLAN_S)
        speed, replan = (_number(name, own, word, usual) for word, usual in words)
    speeds = [group.speed_m_per_s or speed for group in site.vessels for _ in group.members]
    return Anchors(site, mover, Pace(np.array(speeds), replan), prediction, known, room.lead_s)


def _number(name: str, part: Any, word: str, usual: float) -> float:
    """Return the attribute `word`, a speed or an interval, of a user-defined placement `part`, or
    `usual` if it has none.

    Raises:
        PluginError: when it is no number that a vessel can have.
    """
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
