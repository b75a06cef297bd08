"""The fleet at the start of a mission: each vehicle on its route, AUVs with their drift."""

from collections.abc import Sequence
from functools import lru_cache, partial
from typing import TYPE_CHECKING

import numpy as np

from ..core.arrays import Floats
from ..core.plugins import load
from ..core.streams import Streams
from ..protocol.anchors.placing import Anchors, anchors_of
from ..protocol.predicted_positions import CarriedForward, courses, planned_vehicles
from ..protocol.schedules.view import known_of
from ..records.rows import Recorder
from ..scenario.destinations import are_steered, asv_stations, route_of
from ..scenario.families import ASV, AUV
from ..scenario.flight_plans import planned_tours
from ..scenario.own_routes import WayView, own_motion
from ..scenario.part_choice import PartChoice
from ..scenario.scenario import Scenario
from ..scenario.scenario_keys import Environment
from ..scenario.sections.survey import Survey
from ..scenario.sections.vehicles import Auvs
from ..scenario.site import vessel_tracks
from ..vehicles.fleet import VehicleFleet
from ..vehicles.motion import places, together
from ..vehicles.poses import PosedVehicle, Poses
from ..vehicles.reckoning import Wrong
from ..vehicles.vehicle import Place, SegmentedTrajectory, moored, recorded
from .closed_loop import (
    MissionCurrent,
    afterwards_s,
    control_intervals,
    guided_asvs,
    guided_auvs,
    room_of,
)

if TYPE_CHECKING:
    from ..vehicles.guidance import GuidedFleet, GuidedVehicle


def posed(poses: Poses, kind: str, count: int) -> VehicleFleet:
    """Return a fleet, "auvs" or "asvs", that an outside program moves."""
    vehicles = [PosedVehicle(poses, kind, number) for number in range(count)]
    return VehicleFleet(vehicles, poses.motion(kind), poses=poses)


def launch_auvs(scenario: Scenario, water: MissionCurrent, wrong: Wrong) -> VehicleFleet:
    """Return the AUVs of a scenario, in index order.

    Their dead reckoning, by which some of them steer, is `wrong`.
    """
    auvs = scenario.auvs
    if auvs.vehicle.own:
        return _own_auvs(scenario, auvs.vehicle.own, id(load(AUV, str(auvs.vehicle.own))))
    if not auvs.vehicle.has_dynamics:
        route = route_of(scenario)
        return _kinematic(scenario) if route.is_recorded else _kinematic_auvs(scenario, route)
    if auvs.feedback == "truth":
        return _guided_foreseen(scenario) if water.is_steady else _guided(scenario, water)
    guided = guided_auvs(scenario, planned_tours(scenario), water, wrong)
    return VehicleFleet(_members(guided, auvs.count), guided.motion, guided)


# Where vehicles go whatever the seed is worked out once for all seeds of a scenario.
@lru_cache(maxsize=4)
def _kinematic_auvs(scenario: Scenario, _route: object) -> VehicleFleet:
    return _kinematic(scenario)


@lru_cache(maxsize=4)
def _own_auvs(scenario: Scenario, own: PartChoice, _loaded: int) -> VehicleFleet:
    speed, depth = scenario.auvs.speed, scenario.survey.depth
    ways = [
        WayView(number, speed(number), depth(number), scenario.duration_s, tour.sample)
        for number, tour in enumerate(planned_tours(scenario))
    ]
    return _segmented([recorded(*track) for track in own_motion(scenario, AUV, own, ways)])


@lru_cache(maxsize=4)
def _own_asvs(scenario: Scenario, own: PartChoice, _loaded: int) -> VehicleFleet:
    ways = []
    for number, (x, y) in enumerate(asv_stations(scenario)):
        station = partial(_stay, (x, y, 0.0))
        ways.append(WayView(number, 0.0, 0.0, scenario.duration_s, station))
    return _segmented([recorded(*track) for track in own_motion(scenario, ASV, own, ways)])


def _stay(place: tuple[float, float, float], distances: Floats) -> Floats:
    return np.tile(place, (len(distances), 1))


def _guided_foreseen(scenario: Scenario) -> VehicleFleet:
    # What decides it: where they are to go in which water, and for how long.
    plan = scenario.survey, scenario.auvs, scenario.environment, control_intervals(scenario)
    route = route_of(scenario)  # of somebody's own, which may go by more than that
    fleet = _foreseen.get((*plan, route))
    if fleet is None:
        _foreseen.clear()  # beforehand: there may not be room for two long voyages of large fleets
        fleet = _foreseen[(*plan, route)] = _guided(scenario, MissionCurrent(scenario, Streams(0)))
    return fleet


_foreseen: dict[tuple[Survey, Auvs, Environment, int, object], VehicleFleet] = {}


@lru_cache(maxsize=4)
def _moored_asvs(stations: tuple[tuple[float, float], ...]) -> VehicleFleet:
    return _segmented([moored(Place(x, y, 0.0, 0.0)) for x, y in stations])


def _segmented(vehicles: Sequence[SegmentedTrajectory]) -> VehicleFleet:
    return VehicleFleet(vehicles, together([vehicle.legs for vehicle in vehicles]))


def _guided(scenario: Scenario, water: MissionCurrent) -> VehicleFleet:
    """Return AUVs with dynamics that know where they are: their whole way is foreseen."""
    guided = guided_auvs(scenario, planned_tours(scenario), water, None)
    guided.advance(guided.duration_s)
    return VehicleFleet(_members(guided, scenario.auvs.count), guided.motion)


def _members(guided: "GuidedFleet", count: int) -> "list[GuidedVehicle]":
    return [guided.vehicle(index) for index in range(count)]


def _kinematic(scenario: Scenario) -> VehicleFleet:
    return _segmented(planned_vehicles(scenario, scenario.duration_s + afterwards_s(scenario)))


def launch_anchors(scenario: Scenario, auvs: VehicleFleet, record: Recorder) -> Anchors | None:
    """Return the ASVs of a scenario that are told where to go; None where there are none such.

    They know where the AUVs were launched, what is planned for them, and the fixes on record.
    """
    if not are_steered(scenario):
        return None
    launched = places(auvs.motion, 0.0)[:, :3]
    prediction = CarriedForward(launched, courses(scenario))
    return anchors_of(scenario, prediction, known_of(scenario, auvs, record), room_of(scenario))


def launch_asvs(scenario: Scenario, streams: Streams, water: MissionCurrent) -> VehicleFleet:
    """Return the ASVs of a scenario at their stations or on their tracks, in index order."""
    own, placement = scenario.asvs.vehicle.own, scenario.asvs.formation
    if placement.recording is not None:
        tracks = vessel_tracks(scenario, placement.recording)
        return _segmented([recorded(*track) for track in tracks])
    if own:
        return _own_asvs(scenario, own, id(load(ASV, str(own))))
    if not scenario.asvs.vehicle.has_dynamics:
        return _moored_asvs(tuple(asv_stations(scenario)))
    guided = guided_asvs(scenario, asv_stations(scenario), streams, water)
    guided.advance(guided.duration_s)
    return VehicleFleet(_members(guided, scenario.asvs.count), guided.motion)
