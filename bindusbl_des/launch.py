"""The fleet at the start of a mission: each vehicle on its route, AUVs with their drift."""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .belief import Growth, first_belief
from .consistency import FILTERS
from .dead_reckoning import DeadReckoning
from .fleet import Fleet
from .formations import formation, formation_radius
from .motion import together
from .navigation import WEIGHED, LinearNavigator, Navigator, Rule
from .own_navigator import OwnNavigator
from .own_parts import own_part
from .paths import Path
from .routes import lawnmower, waypoint_path
from .scenario import Auvs, Environment, Scenario, Survey
from .streams import Streams
from .track_file import read_tracks
from .turns import there_and_back
from .vehicles import Legged, Place, kinematic, moored, recorded
from .voyages import Water, afterwards_s, asv_voyage, auv_voyage, voyage_intervals

if TYPE_CHECKING:
    from .guidance import Member, Voyage

Array = NDArray[np.float64]


def launch_auvs(scenario: Scenario, water: Water, walks: Array, biases: Array) -> Fleet:
    """Return the AUVs of a scenario, in index order.

    `walks` and `biases` are what makes their dead reckoning wrong, by which some of them steer.
    """
    auvs = scenario.auvs
    if not auvs.vehicle.has_dynamics:
        if auvs.route.kind == "track":
            route, duration = auvs.route, scenario.duration_s
            tracks = read_tracks(route.files, route.time_offset_s, duration)
            return _legged([recorded(*track) for track in tracks])
        return _kinematic_auvs(scenario)
    if auvs.feedback == "truth":
        return _voyage_foreseen(scenario) if water.is_steady else _voyage(scenario, water)
    voyage = auv_voyage(scenario, _tours(scenario), water, walks, biases)
    return Fleet(_members(voyage, auvs.count), voyage.motion, voyage)


# Where vehicles go whatever the seed is worked out once for all seeds of a scenario.
@lru_cache(maxsize=4)
def _kinematic_auvs(scenario: Scenario) -> Fleet:
    return _legged([_kinematic(scenario, index) for index in range(scenario.auvs.count)])


def _voyage_foreseen(scenario: Scenario) -> Fleet:
    # What decides it: where they are to go in which water, and for how long.
    plan = scenario.survey, scenario.auvs, scenario.environment, voyage_intervals(scenario)
    fleet = _foreseen.get(plan)
    if fleet is None:
        _foreseen.clear()  # beforehand: there may not be room for two long voyages of large fleets
        fleet = _foreseen[plan] = _voyage(scenario, Water(scenario, Streams(0)))
    return fleet


_foreseen: dict[tuple[Survey, Auvs, Environment, int], Fleet] = {}


@lru_cache(maxsize=4)
def _moored_asvs(scenario: Scenario) -> Fleet:
    return _legged([moored(Place(x, y, 0.0, 0.0)) for x, y in asv_stations(scenario)])


def _legged(vehicles: Sequence[Legged]) -> Fleet:
    return Fleet(vehicles, together([vehicle.legs for vehicle in vehicles]))


def _voyage(scenario: Scenario, water: Water) -> Fleet:
    """Return AUVs with dynamics that know where they are: their whole way is foreseen."""
    voyage = auv_voyage(scenario, _tours(scenario), water, np.empty(0), np.empty(0))
    voyage.advance(voyage.duration_s)
    return Fleet(_members(voyage, scenario.auvs.count), voyage.motion)


def _tours(scenario: Scenario) -> list[Path]:
    return [planned_tour(scenario, index) for index in range(scenario.auvs.count)]


def _members(voyage: "Voyage", count: int) -> "list[Member]":
    return [voyage.member(index) for index in range(count)]


def _kinematic(scenario: Scenario, index: int) -> Legged:
    """Return one AUV without dynamics on its route, at its depth."""
    route, depth = scenario.auvs.route, scenario.survey.depth_m
    if route.kind == "hold":
        return moored(Place(*route.positions_m[index], depth, 0.0))
    lasts = scenario.duration_s + afterwards_s(scenario)
    return kinematic(planned_tour(scenario, index), scenario.auvs.speed_m_per_s, depth, lasts)


def board_auvs(
    scenario: Scenario, fleet: Fleet, walks: Array, biases: Array
) -> tuple[DeadReckoning, Navigator]:
    """Return what the AUVs carry: dead reckoning, and navigators by which some of them steer."""
    navigation = scenario.navigation
    reckoning = DeadReckoning(
        fleet.motion, walks, navigation.imu_rate_hz, biases, navigation.bias_frame
    )
    if fleet.voyage is None:
        steering = np.zeros((len(fleet), 2)), np.zeros((len(fleet), 7))
    else:
        fleet.voyage.has_learnt = navigation.filter == "kalman"
        steering = fleet.voyage.corrections, fleet.voyage.learnt
    if ":" in navigation.filter:
        make = own_part("navigation.filter", navigation.filter, FILTERS)
        return reckoning, OwnNavigator(navigation.filter, make, reckoning, steering[0])
    return reckoning, LinearNavigator(
        reckoning, _rule(scenario), _growth(scenario), _first_belief(scenario), *steering
    )


def _rule(scenario: Scenario) -> Rule:
    """Return how fixes are weighed."""
    navigation = scenario.navigation
    if navigation.filter == "kalman":
        return Rule(WEIGHED, at_ping=True, gate=navigation.nis_gate or 0.0)
    gain = navigation.gain if navigation.filter == "fixed_gain" else 0.0
    return Rule(gain, at_ping=navigation.delay_compensation == "shift", gate=0.0)


def _growth(scenario: Scenario) -> Growth:
    """Return how dead reckoning becomes unsure, as its own sensors' sheets say."""
    navigation, water = scenario.navigation, scenario.environment
    wander = 0.0
    if navigation.velocity == "through_water":  # a Gauss-Markov current, as far as it is short-term
        wander = 2 * water.current_variation_m_per_s**2 / water.current_variation_time_s
    return Growth(navigation.random_walk_m_per_sqrt_s**2, wander, navigation.bias_frame == "body")


def _first_belief(scenario: Scenario) -> Array:
    """Return what AUVs believe at the start: that nothing is wrong, as surely as it may be so."""
    navigation, water = scenario.navigation, scenario.environment
    x, y = navigation.velocity_bias_m_per_s
    sd = navigation.velocity_bias_sd_m_per_s
    current = 0.0
    if navigation.velocity == "through_water":
        current = math.hypot(water.current_m_per_s, water.current_variation_m_per_s)
    return first_belief(
        navigation.initial_position_sd_m, (math.hypot(x, sd), math.hypot(y, sd)), current
    )


def turning_radius(scenario: Scenario) -> float:
    """Return the radius (m) of planned turns: as asked for, or as the vehicle model can turn."""
    auvs = scenario.auvs
    if not auvs.vehicle.has_dynamics:
        return auvs.turning_radius_m
    from .guidance import smallest_turn

    try:
        return smallest_turn(
            auvs.vehicle.model, auvs.speed_m_per_s, dict(auvs.vehicle.coefficients)
        )
    except ValueError as error:
        raise ValueError(f"auvs.speed_m_per_s: {error}; ask for less") from None


def planned_tour(scenario: Scenario, index: int) -> Path:
    """Return the endless tour of one AUV along its planned path, there and back."""
    return there_and_back(
        planned_path(scenario, index),
        scenario.survey.side_m,
        turning_radius(scenario),
        math.radians(scenario.auvs.join_angle_deg),
    )


def planned_path(scenario: Scenario, index: int) -> Path:
    """Return the path that one AUV is to fly, once through (routes lawnmower and waypoints).

    Raises:
        ValueError: when the route has no plan: an AUV that holds or repeats a track.
    """
    auvs, side, route = scenario.auvs, scenario.survey.side_m, scenario.auvs.route
    if route.kind == "waypoints":
        return waypoint_path(route.points_m[index], turning_radius(scenario))
    if route.kind != "lawnmower":
        raise ValueError(f"an AUV whose route is {route.kind!r} has no planned path")
    spacing, margin = route.lane_spacing_m, route.end_margin_m
    radius = turning_radius(scenario)
    if 2 * radius > side:
        raise ValueError(
            f"auvs.vehicle: at {auvs.speed_m_per_s:g} m/s {auvs.vehicle} turns with a radius of "
            f"{radius:.1f} m, too wide for a survey of {side:g} m; use another vehicle (bluerov2 "
            "turns tightly), another speed or a larger survey"
        )
    return lawnmower(
        side,
        auvs.count,
        index,
        spacing=spacing,
        margin=spacing / 2 if margin is None else margin,
        radius=radius,
        start=route.start,
        turns=route.turns,
        join_angle=math.radians(auvs.join_angle_deg),
    )


def launch_asvs(scenario: Scenario, streams: Streams, water: Water) -> Fleet:
    """Return the ASVs of a scenario at their stations, in index order."""
    if not scenario.asvs.vehicle.has_dynamics:
        return _moored_asvs(scenario)
    voyage = asv_voyage(scenario, asv_stations(scenario), streams, water)
    voyage.advance(voyage.duration_s)
    return Fleet(_members(voyage, scenario.asvs.count), voyage.motion)


def asv_stations(scenario: Scenario) -> list[tuple[float, float]]:
    """Return where the ASVs keep station, [x, y] in m (eq. formation)."""
    asked, asvs = scenario.asvs.formation, scenario.asvs
    if asked.positions_m is not None:
        return list(asked.positions_m)
    radius = asked.radius_m
    if radius is None:
        radius = formation_radius(scenario.acoustics.hf.range_m, asked.clearance_m)
    vertices = formation(asvs.count, radius, math.radians(asked.angle_deg))
    return [(x, y) for x, y in vertices.tolist()]


def horizontal_reach(scenario: Scenario) -> float:
    """Return how far (m), seen from above, an ASV hears an AUV at the survey's depth."""
    hf, depth = scenario.acoustics.hf, scenario.survey.depth_m
    if hf.range_metric == "horizontal":
        return hf.range_m
    return math.sqrt(max(hf.range_m**2 - depth**2, 0.0))
