"""Flight plans: the path of each AUV, and which stretches of it are lanes."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import dist
from typing import TYPE_CHECKING

from ..geometry.area import Area, turned
from ..geometry.lanes import SHORTEST_LANE, Ruling, Share, equal_lengths, strips
from ..geometry.paths import through
from ..geometry.routes import (
    FlightPlan,
    Surfacing,
    Turning,
    begun,
    ended,
    lawnmower,
    surfaced,
    there_and_back,
    waypoint_poses,
)
from .groups import Auv, Group
from .sections.routes import Lawnmower, RouteTraits
from .sections.survey import LONGEST_S, SHORTEST_S, SURVEY, SurveyEnd

if TYPE_CHECKING:
    from ..geometry.following import Slopes
    from ..geometry.ways import Water

# Margin for vehicles with dynamics over their plan: for the start from rest (s), and a share of the
# whole for turns that they follow loosely.
STARTING_S, LOOSELY = 10.0, 0.05

# Standard deviations of a varying current that a plan allows for.
SIGMAS = 3.0


@dataclass(frozen=True)
class Planner:
    """The inputs of flight plans: AUVs and the route that they share, in metres; the area, the
    heading of its lanes (rad), and the turning radius (m) of each AUV; what paths of groups follow.
    """

    auvs: Sequence[Auv]
    route: RouteTraits
    area: Area
    lanes_heading: float
    radii: Sequence[float]
    follows: "Mapping[Group, Slopes]" = field(default_factory=dict)
    _waters: "dict[float, Water]" = field(default_factory=dict)

    def plans(self) -> tuple[FlightPlan, ...]:
        """Return the flight plan of each AUV (routes lawnmower and waypoints).

        Raises:
            ValueError: when the route cannot be flown.
        """
        auvs, lanes = range(len(self.auvs)), self.route.lanes
        if lanes is not None:
            shares = shares_of(self.area, self.lanes_heading, lanes, len(self.auvs))
            plans = [self._over_lanes(lanes, shares[auv], auv) for auv in auvs]
        else:
            plans = [self._along_points(auv) for auv in auvs]
        plans = [self._surfaced(plan, auv) for auv, plan in enumerate(plans)]
        if self.follows:
            plans = [self._deepened(plan, auv) for auv, plan in enumerate(plans)]
        return tuple(plans)

    def _deepened(self, plan: FlightPlan, auv: int) -> FlightPlan:
        """Return the plan of an AUV along the bottom, if it keeps an altitude."""
        slopes = self.follows.get(self.auvs[auv].group)
        if slopes is None:
            return plan
        from ..geometry.following import following

        return plan._replace(path=following(plan.path, slopes), tour=following(plan.tour, slopes))

    def _surfaced(self, plan: FlightPlan, auv: int) -> FlightPlan:
        """Return the plan of an AUV with ascents to the surface, if its route has them."""
        route, speed = self.route.surfacing, self.auvs[auv].speed_m_per_s
        if route is None or route.surface_every_s is None:
            return plan
        asked = Surfacing(
            speed * route.surface_every_s,
            self.radii[auv],
            self.auvs[auv].depth_m,
            math.radians(route.climb_angle_deg),
            speed * route.surface_for_s,
        )
        path, breaks = surfaced(plan.path, asked)
        lanes = []
        for begin, end in plan.lanes:  # ascents, and stretches at the surface, are no lanes
            ends = [begin, *(ascent for ascent in breaks if begin < ascent < end), end]
            circled = asked.length * sum(ascent <= begin for ascent in breaks)
            for first, last in pairwise(ends):
                lanes.append((first + circled, last + circled))
                circled += asked.length
        return FlightPlan(path, tuple(lanes), surfaced(plan.tour, asked)[0])

    def _over_lanes(self, route: Lawnmower, share: Share, auv: int) -> FlightPlan:
        """Return the plan of an AUV over its lanes."""
        area, own, radius = self.area, self.auvs[auv], self.radii[auv]
        group = own.group
        if 2 * radius > area.across:
            raise ValueError(
                f"{group.key('vehicle')}: at {own.speed_m_per_s:g} m/s {group.vehicle} turns with "
                f"a radius of {radius:.1f} m, too wide for a survey of {area.words}; use another "
                "vehicle (bluerov2 turns tightly), another speed or a larger survey"
            )
        heading, join = self.lanes_heading, math.radians(group.join_angle_deg)
        launch, recovery = (
            None if place is None else turned(place, -heading)
            for place in (own.launch_m, own.recovery_m)
        )
        here = area.along(heading)
        start = share.centre if route.start == "strip_centre" else None
        turning, box, spacing = Turning(radius, route.turns, join), here.box, route.lane_spacing_m
        if here.closed or share.inside:
            from ..geometry.round_land import over_water  # brings networkx
            from ..geometry.ways import water_of

            water = self._waters.get(radius)
            if water is None:
                water = self._waters[radius] = water_of(here, radius, inside=share.inside)
            if start is not None and not water.rooms[0].afloat(start):
                start = None  # the plan begins with its first lane
            plan = over_water(share.lanes, spacing, route.turns, water, launch or start, recovery)
            return FlightPlan(plan.path.turned(heading), plan.lanes, plan.tour.turned(heading))
        path, lanes = lawnmower(
            share, spacing, turning, begin=launch or start, recovery=recovery, box=box
        )
        tour = path if recovery is not None else there_and_back(path, box, radius, join)
        return FlightPlan(path.turned(heading), lanes, tour.turned(heading))

    def _along_points(self, auv: int) -> FlightPlan:
        """Return the plan of an AUV along way points; from the first to the last is one lane."""
        _, group, _, _, launch, recovery = self.auvs[auv]
        points, radius = self.route.places[auv], self.radii[auv]
        before = launch is not None and dist(launch, points[0]) >= SHORTEST_LANE
        behind = recovery is not None and dist(recovery, points[-1]) >= SHORTEST_LANE
        if self.route.is_rounded:
            from ..geometry.drawn_routes import along_route  # brings shapely

            along = along_route(points, radius)
            path = begun(along, launch, radius) if launch and before else along
            first, last = path.length - along.length, path.length
            path = ended(path, recovery, radius) if recovery and behind else path
        else:
            places = [*([launch] if launch else []), *points, *([recovery] if recovery else [])]
            apart = [place for one, place in pairwise(places) if dist(one, place) >= SHORTEST_LANE]
            path, passed = through(waypoint_poses([places[0], *apart]), radius)
            first, last = passed[int(before)], passed[-1 - int(behind)]
        tour = path
        if recovery is None:
            join = math.radians(group.join_angle_deg)
            tour = there_and_back(path, self.area.box, radius, join)
        return FlightPlan(path, ((first, last),), tour)


def shares_of(area: Area, heading: float, route: Lawnmower, auvs: int) -> list[Share]:
    """Return each AUV's share of the lanes, in the frame of the lanes' heading (rad).

    Raises:
        ValueError: when there are fewer lanes than AUVs that are to share them.
    """
    spacing, margin = route.lane_spacing_m, route.end_margin_m
    inside = route.inside
    if inside is None:
        inside = not (area.is_rectangle or area.is_convex)
    ruling = Ruling(spacing, spacing / 2 if margin is None else margin, inside)
    divide = strips if route.division == "strips" else equal_lengths
    return divide(area.along(heading), ruling, auvs)


def survey_end(
    auvs: Sequence[Auv], against: float, plans: Sequence[FlightPlan | None]
) -> SurveyEnd:
    """Return when (s) the last AUV has flown its lanes, or reached its recovery place, if any.

    For AUVs without dynamics this is exact.  For others it is an upper bound: the plan at the speed
    left by the current (`against`, m/s: three standard deviations of its variation with it), with a
    margin for start and turns.

    Raises:
        ValueError: when a current leaves no headway, or the survey takes longer than a mission may.
    """
    last = max(flown_s(auvs, against, plans))
    if not SHORTEST_S <= last <= LONGEST_S or not math.isfinite(last):
        raise ValueError(f"{SURVEY} takes {last:.3g} s; a mission may last {LONGEST_S:g} s")
    return SurveyEnd(last)


def flown_s(auvs: Sequence[Auv], against: float, plans: Sequence[FlightPlan | None]) -> list[float]:
    """Return when (s) each AUV has flown its lanes, or reached its recovery place, if any, against
    a current (m/s).

    It is 0 without lanes.

    Raises:
        ValueError: when a current leaves no headway.
    """
    ends = [0.0] * len(auvs)
    for auv, plan in zip(auvs, plans, strict=True):
        if plan is None:
            continue
        length = plan.lanes[-1][1] if auv.recovery_m is None else plan.path.length
        speed = auv.speed_m_per_s
        if not auv.group.vehicle.has_dynamics:
            ends[auv.number] = length / speed
            continue
        if speed <= against:
            raise ValueError(
                f"{SURVEY} has no end: at {speed:g} m/s AUV{auv.number} makes no headway against a "
                f"current of up to {against:g} m/s; give the seconds, or ask for more speed"
            )
        ends[auv.number] = STARTING_S + (1.0 + LOOSELY) * length / (speed - against)
    return ends
