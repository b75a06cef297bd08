"""The fleet at the start of a mission: each vehicle on its route, AUVs with their drift."""

from collections.abc import Callable, Sequence
from functools import partial
from weakref import WeakKeyDictionary

import numpy as np

from ..core.arrays import Floats
from ..core.streams import Streams
from ..protocol.anchors.placing import Anchors, anchors_of
from ..protocol.predicted_positions import CarriedForward, courses, planned_vehicles
from ..protocol.schedules.view import known_of
from ..records.rows import Recorder
from ..scenario.families import ASV, AUV
from ..scenario.own_routes import WayView, own_motion
from ..setup import Setup
from ..vehicles.fleet import VehicleFleet
from ..vehicles.motion import places, together
from ..vehicles.poses import PosedVehicle, Poses
from ..vehicles.reckoning import Wrong
from ..vehicles.vehicle import Place, SegmentedTrajectory, moored, recorded
from .closed_loop import MissionCurrent, guided_asvs, guided_auvs


def posed(poses: Poses, kind: str, count: int) -> VehicleFleet:
    """Return a fleet, "auvs" or "asvs", that an outside program moves."""
    vehicles = [PosedVehicle(poses, kind, number) for number in range(count)]
    return VehicleFleet(vehicles, poses.motion(kind), poses=poses)


def launch_auvs(setup: Setup, water: MissionCurrent, wrong: Wrong) -> VehicleFleet:
    """Return the AUVs of a setup, in index order.

    Their dead reckoning, by which some of them steer, is `wrong`.  Where they go whatever the seed
    is worked out once.
    """
    auvs = setup.scenario.auvs
    if not auvs.vehicle.has_dynamics:
        return _once(setup, "auvs", _unguided_auvs)
    if auvs.feedback == "truth" and water.is_steady:
        return _once(setup, "auvs", _foreseen)
    return _guided(setup, water, None if auvs.feedback == "truth" else wrong)


# Where vehicles go whatever the seed is worked out once for all seeds of a scenario.
_launched: WeakKeyDictionary[Setup, dict[str, VehicleFleet]] = WeakKeyDictionary()


def _once(setup: Setup, whose: str, launch: Callable[[Setup], VehicleFleet]) -> VehicleFleet:
    fleets = _launched.setdefault(setup, {})
    if whose not in fleets:
        fleets[whose] = launch(setup)
    return fleets[whose]


def _unguided_auvs(setup: Setup) -> VehicleFleet:
    scenario, own = setup.scenario, setup.scenario.auvs.vehicle.own
    if not own:
        return _segmented(planned_vehicles(setup, scenario.duration_s + setup.afterwards_s))
    speed, depth = scenario.auvs.speed, scenario.survey.depth
    ways = [
        WayView(number, speed(number), depth(number), scenario.duration_s, plan.tour.sample)
        for number, plan in enumerate(setup.plans)
    ]
    return _segmented([recorded(*track) for track in own_motion(AUV, own, ways)])


# Voyages take long to integrate, and other keys than these change nothing of them.
_voyages: dict[tuple[object, ...], VehicleFleet] = {}


def _foreseen(setup: Setup) -> VehicleFleet:
    asked = setup.scenario
    key = asked.survey, asked.auvs, asked.environment, setup.control_intervals, setup.route
    if key not in _voyages:
        _voyages.clear()  # beforehand: there may not be room for two long voyages of large fleets
        _voyages[key] = _guided(setup, MissionCurrent(setup, Streams(0)), None)
    return _voyages[key]


def _guided(setup: Setup, water: MissionCurrent, wrong: Wrong | None) -> VehicleFleet:
    """Return AUVs with dynamics; where they know where they are their whole way is foreseen."""
    guided = guided_auvs(setup, water, wrong)
    members = [guided.vehicle(auv) for auv in range(setup.scenario.auvs.count)]
    if wrong is not None:
        return VehicleFleet(members, guided.motion, guided)
    guided.advance(guided.duration_s)
    return VehicleFleet(members, guided.motion)


def launch_asvs(setup: Setup, streams: Streams, water: MissionCurrent) -> VehicleFleet:
    """Return the ASVs of a setup at their stations or on their tracks, in index order."""
    vehicle = setup.scenario.asvs.vehicle
    if setup.asv_tracks is None and vehicle.has_dynamics:
        guided = guided_asvs(setup, setup.stations_m, streams, water)
        guided.advance(guided.duration_s)
        members = [guided.vehicle(asv) for asv in range(setup.scenario.asvs.count)]
        return VehicleFleet(members, guided.motion)
    return _once(setup, "asvs", _unguided_asvs)


def _unguided_asvs(setup: Setup) -> VehicleFleet:
    own = setup.scenario.asvs.vehicle.own
    if setup.asv_tracks is not None:
        return _segmented([recorded(*track) for track in setup.asv_tracks])
    if not own:
        return _segmented([moored(Place(x, y, 0.0, 0.0)) for x, y in setup.stations_m])
    ways = [
        WayView(number, 0.0, 0.0, setup.scenario.duration_s, partial(_stay, (x, y, 0.0)))
        for number, (x, y) in enumerate(setup.stations_m)
    ]
    return _segmented([recorded(*track) for track in own_motion(ASV, own, ways)])


def _stay(place: tuple[float, float, float], distances: Floats) -> Floats:
    return np.tile(place, (len(distances), 1))


def _segmented(vehicles: Sequence[SegmentedTrajectory]) -> VehicleFleet:
    return VehicleFleet(vehicles, together([vehicle.legs for vehicle in vehicles]))


def launch_anchors(setup: Setup, auvs: VehicleFleet, record: Recorder) -> Anchors | None:
    """Return the ASVs of a setup that are told where to go; None where there are none such.

    They know where the AUVs were launched, what is planned for them, and the fixes on record.
    """
    if not setup.are_steered:
        return None
    launched = places(auvs.motion, 0.0)[:, :3]
    prediction = CarriedForward(launched, courses(setup))
    return anchors_of(setup, prediction, known_of(setup, auvs, record), setup.room)
