"""What each AUV of a scenario is to fly: its path, and where along it its lanes are."""

import math
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import pairwise
from math import dist

from ..geometry.area import turned
from ..geometry.lanes import Ruling, Share, equal_lengths, strips
from ..geometry.paths import Path, through
from ..geometry.routes import (
    FlightPlan,
    Turning,
    begun,
    ended,
    lawnmower,
    surfaced,
    there_and_back,
    waypoint_poses,
)
from .agreement.vehicles import SHORTEST_WAY
from .destinations import route_of, surfacing_of, turning_radius
from .scenario_keys import Environment, ScenarioKeys
from .sections.routes import Lawnmower, RouteTraits
from .sections.survey import LONGEST_S, SHORTEST_S, SURVEY, Survey, SurveyEnd
from .sections.vehicles import Auvs
from .site import area_of, lanes_heading

# What vehicles with dynamics take longer than their plan says: starting from rest (s), and a share
# of the whole for turns that they follow loosely.
STARTING_S, LOOSELY = 10.0, 0.05

# Standard deviations of a varying current that are reckoned with.
SIGMAS = 3.0


def planned_paths(scenario: ScenarioKeys) -> list[Path]:
    """Return the path that each AUV is to fly, once through (routes lawnmower and waypoints).

    Raises:
        ValueError: when the route has no plan: AUVs hold or repeat tracks.
    """
    return [plan.path for plan in plans_of(scenario)]


def planned_tours(scenario: ScenarioKeys) -> list[Path]:
    """Return the endless tour of each AUV along its planned path, there and back.

    Where it is to be recovered the path ends there, and is not flown again.
    """
    return [plan.tour for plan in plans_of(scenario)]


def plans_of(scenario: ScenarioKeys) -> tuple[FlightPlan, ...]:
    """Return what each AUV is to fly, AUV0 first (routes lawnmower and waypoints).

    Raises:
        ValueError: when the route has no plan, or cannot be flown.
    """
    where = scenario.survey, scenario.environment
    return _plans(_Asked(*where, scenario.auvs, route_of(scenario), scenario))


@dataclass(frozen=True)
class _Asked:
    """What plans follow from, and a `scenario` that has it: others share its plans."""

    survey: Survey
    environment: Environment
    auvs: Auvs
    route: RouteTraits
    scenario: ScenarioKeys = field(compare=False)


@lru_cache(maxsize=4)
def _plans(asked: _Asked) -> tuple[FlightPlan, ...]:
    scenario, route = asked.scenario, asked.route
    auvs, lanes = range(scenario.auvs.count), route.lanes
    if not route.is_flown:
        kind = str(scenario.auvs.route.choice)
        raise ValueError(f"an AUV whose route is {kind!r} has no planned path")
    if lanes is not None:
        shares = shares_of(scenario, lanes)
        plans = [_over_lanes(scenario, lanes, shares[auv], auv) for auv in auvs]
    else:
        plans = [_along_points(scenario, route, auv) for auv in auvs]
    return tuple(_surfaced(scenario, plan, auv) for auv, plan in enumerate(plans))


def _surfaced(scenario: ScenarioKeys, plan: FlightPlan, auv: int) -> FlightPlan:
    """Return the plan of an AUV, with its ways to the surface where its route asks for them."""
    asked = surfacing_of(scenario, auv)
    if asked is None:
        return plan
    path, breaks = surfaced(plan.path, asked)
    lanes = []
    for begin, end in plan.lanes:  # what is flown at the surface, or on the way there, is no lane
        ends = [begin, *(ascent for ascent in breaks if begin < ascent < end), end]
        circled = asked.length * sum(ascent <= begin for ascent in breaks)
        for first, last in pairwise(ends):
            lanes.append((first + circled, last + circled))
            circled += asked.length
    return FlightPlan(path, tuple(lanes), surfaced(plan.tour, asked)[0])


def shares_of(scenario: ScenarioKeys, route: Lawnmower) -> list[Share]:
    """Return the lanes of each AUV, in the frame of the lanes.

    Raises:
        ValueError: when there are fewer lanes than AUVs that are to share them.
    """
    spacing, margin = route.lane_spacing_m, route.end_margin_m
    ruling = Ruling(spacing, spacing / 2 if margin is None else margin)
    divide = strips if route.division == "strips" else equal_lengths
    return divide(area_of(scenario).along(lanes_heading(scenario)), ruling, scenario.auvs.count)


def _over_lanes(scenario: ScenarioKeys, route: Lawnmower, share: Share, auv: int) -> FlightPlan:
    """Return the plan of an AUV over its lanes."""
    area, auvs, radius = area_of(scenario), scenario.auvs, turning_radius(scenario, auv)
    if 2 * radius > area.across:
        raise ValueError(
            f"auvs.vehicle: at {auvs.speed(auv):g} m/s {auvs.vehicle} turns with a radius of "
            f"{radius:.1f} m, too wide for a survey of {area.words}; use another vehicle "
            "(bluerov2 turns tightly), another speed or a larger survey"
        )
    heading = lanes_heading(scenario)
    launch, recovery = (
        None if place is None else turned(place, -heading)
        for place in (auvs.launch(auv), auvs.recovery(auv))
    )
    box = area.along(heading).box
    start = share.centre if route.start == "strip_centre" else None
    path, lanes = lawnmower(
        share,
        route.lane_spacing_m,
        Turning(radius, route.turns, math.radians(auvs.join_angle_deg)),
        begin=launch or start,
        recovery=recovery,
        box=box,
    )
    tour = path
    if recovery is None:
        tour = there_and_back(path, box, radius, math.radians(auvs.join_angle_deg))
    return FlightPlan(path.turned(heading), lanes, tour.turned(heading))


def _along_points(scenario: ScenarioKeys, route: RouteTraits, auv: int) -> FlightPlan:
    """Return the plan of an AUV along way points, which from first to last count as one lane."""
    launch, recovery = scenario.auvs.launch(auv), scenario.auvs.recovery(auv)
    points, radius = route.places[auv], turning_radius(scenario, auv)
    before = launch is not None and dist(launch, points[0]) >= SHORTEST_WAY
    behind = recovery is not None and dist(recovery, points[-1]) >= SHORTEST_WAY
    if route.is_rounded:
        from ..geometry.drawn_routes import along_route  # brings shapely

        along = along_route(points, radius)
        path = begun(along, launch, radius) if launch and before else along
        first, last = path.length - along.length, path.length
        path = ended(path, recovery, radius) if recovery and behind else path
    else:
        places = [*([launch] if launch else []), *points, *([recovery] if recovery else [])]
        apart = [place for one, place in pairwise(places) if dist(one, place) >= SHORTEST_WAY]
        path, passed = through(waypoint_poses([places[0], *apart]), radius)
        first, last = passed[int(before)], passed[-1 - int(behind)]
    tour = path
    if recovery is None:
        box, join = area_of(scenario).box, math.radians(scenario.auvs.join_angle_deg)
        tour = there_and_back(path, box, radius, join)
    return FlightPlan(path, ((first, last),), tour)


def survey_end(scenario: ScenarioKeys) -> SurveyEnd:
    """Return when (s) the last AUV has flown its lanes, and is where it is recovered, if anywhere.

    AUVs without dynamics do what is planned.  What others do is known only once they have done it:
    for them it is an upper bound, the plan at the speed that the current leaves them (it and three
    standard deviations of what it varies), and a little for starting and turns.

    Raises:
        ValueError: when there is no plan, it cannot be flown, or a current leaves no headway.
    """
    auvs, water, last = scenario.auvs, scenario.environment, 0.0
    against = water.current_m_per_s + SIGMAS * water.current_variation_m_per_s
    for auv, plan in enumerate(plans_of(scenario)):
        length = plan.lanes[-1][1] if auvs.recovery(auv) is None else plan.path.length
        speed = auvs.speed(auv)
        if not auvs.vehicle.has_dynamics:
            last = max(last, length / speed)
            continue
        if speed <= against:
            raise ValueError(
                f"{SURVEY} has no end: at {speed:g} m/s AUV{auv} makes no headway against a "
                f"current of up to {against:g} m/s; give the seconds, or ask for more speed"
            )
        last = max(last, STARTING_S + (1.0 + LOOSELY) * length / (speed - against))
    if not SHORTEST_S <= last <= LONGEST_S or not math.isfinite(last):
        raise ValueError(f"{SURVEY} takes {last:.3g} s; a mission may last {LONGEST_S:g} s")
    return SurveyEnd(last)
