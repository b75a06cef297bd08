"""The fleet at the start of a mission: vehicles on their routes, and the AUVs' navigation.

Hulls and controllers are imported when they are needed: most missions are kinematic.
"""

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from ...support.arrays import Floats
from ...support.facts import cached_property
from ...support.streams import Purpose, Streams
from ..acoustics.channel import PLAIN
from ..navigation.assumptions import columns_of, common_to_all, peer_errors
from ..navigation.dead_reckoning import DeadReckoning
from ..navigation.fix_update import WEIGHED, Rule
from ..navigation.navigators import LinearNavigator, Navigator, OwnNavigator
from ..navigation.range_rates import Rates
from ..navigation.smoother import Smoother
from ..navigation.team import Team
from ..protocol.anchors.placing import Anchors, anchors_of
from ..protocol.predicted_positions import CarriedForward, courses, planned_vehicles
from ..protocol.view import known_of
from ..records.rows import LEARNT, Recorder
from ..scenario.families import ASV, AUV, NAVIGATOR
from ..scenario.own_routes import WayView, own_motion
from ..scenario.part_choice import own_part
from ..scenario.sections.navigation import Navigation
from ..setup import Setup
from ..vehicles.currents import CONTROL_S, carried, current_series, gauss_markov
from ..vehicles.fleet import VehicleFleet
from ..vehicles.motion import places, together
from ..vehicles.poses import PosedVehicle, Poses
from ..vehicles.reckoning import Wrong
from ..vehicles.vehicle import Place, SegmentedTrajectory, moored, recorded

if TYPE_CHECKING:
    from ..vehicles.guidance.guided_fleet import GuidedFleet


class MissionCurrent:
    """The current of one mission, and the displacement of what drifts in it."""

    def __init__(self, setup: Setup, streams: Streams) -> None:
        self._setup, self._streams = setup, streams

    @property
    def is_steady(self) -> bool:
        """Whether the current never varies, so that it is the same for every seed."""
        return self._setup.scenario.environment.current_variation_m_per_s == 0.0

    @property
    def series(self) -> Floats:
        """The current (m/s) along x and y in each control interval, shape (n, 2)."""
        return self._drawn[: self._setup.control_intervals]

    @cached_property
    def _drawn(self) -> Floats:
        """The same up to the last sample of the IMU, which may come long after the end."""
        asked, rate = self._setup.scenario.environment, self._setup.scenario.navigation.imu_rate_hz
        last = math.ceil(self._setup.scenario.duration_s * rate) / rate
        count = max(self._setup.control_intervals, math.ceil(last / CONTROL_S))
        return current_series(
            asked.current_m_per_s,
            math.radians(asked.current_direction_deg),
            asked.current_variation_m_per_s,
            asked.current_variation_time_s,
            CONTROL_S,
            self._streams.of(Purpose.CURRENT).standard_normal((count, 2)),
        )

    def carried(self, times: Floats) -> Floats:
        """Return the displacement (m) of the water by each instant (s), shape (n, 2)."""
        return carried(self._drawn, CONTROL_S, times)


def slow_gnss(setup: Setup, streams: Streams) -> Floats:
    """Return the slow error (m) of each ASV's GNSS position in each control interval, (m, n, 2)."""
    usbl, asvs = setup.scenario.usbl, setup.scenario.asvs.count
    count = setup.control_intervals
    if usbl.gnss_correlated_sd_m == 0.0:
        return np.zeros((asvs, 1, 2))
    return np.stack([
        gauss_markov(
            usbl.gnss_correlated_sd_m, usbl.gnss_time_constant_s, CONTROL_S,
            streams.of(Purpose.GNSS, asv).standard_normal((count, 2)),
        )
        for asv in range(asvs)
    ])  # fmt: skip


def guided_auvs(setup: Setup, water: MissionCurrent, wrong: Wrong | None) -> "GuidedFleet":
    """Return the trajectories of all AUVs with dynamics along their tours.

    They steer by estimates whose dead reckoning is `wrong`; None: by the truth.
    """
    from ..vehicles.guidance.departure import DeparturePlan
    from ..vehicles.guidance.guided_fleet import GuidedFleet
    from ..vehicles.guidance.sensing import SteeringDrift

    scenario, auvs, navigation = setup.scenario, setup.scenario.auvs, setup.scenario.navigation
    drift = None
    if wrong is not None:
        beyond = math.ceil((setup.afterwards_s + 1.0) * navigation.imu_rate_hz)
        walks = np.pad(wrong.walks, ((0, 0), (0, beyond), (0, 0)), mode="edge")
        drift = SteeringDrift(wrong._replace(walks=walks), navigation.velocity == "through_water")
    return GuidedFleet(
        auvs.vehicle.model,
        DeparturePlan(
            paths=[plan.tour for plan in setup.plans],
            speed_m_per_s=auvs.speeds,
            depth_m=[scenario.survey.depth(auv) for auv in range(auvs.count)],
            names=[f"AUV{index}" for index in range(auvs.count)],
        ),
        dict(auvs.vehicle.coefficients),
        currents=water.series,
        duration_s=setup.control_intervals * CONTROL_S,
        drift=drift,
    )


def guided_asvs(
    setup: Setup,
    stations: Sequence[tuple[float, float]],
    streams: Streams,
    water: MissionCurrent,
) -> "GuidedFleet":
    """Return the trajectories of ASVs with dynamics, which keep station by noisy GNSS positions."""
    from ..vehicles.guidance.departure import DeparturePlan
    from ..vehicles.guidance.guided_fleet import GuidedFleet

    scenario, asvs, count = setup.scenario, setup.scenario.asvs, setup.control_intervals
    noise = [
        streams.of(Purpose.STATION, asv).standard_normal((count, 2)) * scenario.usbl.gnss_sd_m
        for asv in range(asvs.count)
    ]
    return GuidedFleet(
        asvs.vehicle.model,
        DeparturePlan(
            stations=np.array(stations), names=[f"ASV{index}" for index in range(asvs.count)]
        ),
        dict(asvs.vehicle.coefficients),
        currents=water.series,
        duration_s=count * CONTROL_S,
        position_noise=np.stack(noise) + slow_gnss(setup, streams),
    )


def posed(poses: Poses, kind: str, count: int) -> VehicleFleet:
    """Return a fleet, "auvs" or "asvs", that an outside program moves."""
    vehicles = [PosedVehicle(poses, kind, number) for number in range(count)]
    return VehicleFleet(vehicles, poses.motion(kind), poses=poses)


def launch_auvs(setup: Setup, water: MissionCurrent, wrong: Wrong) -> VehicleFleet:
    """Return the AUVs of a setup, in index order.

    Their dead reckoning, by which some of them steer, is `wrong`.  Motions that no seed changes are
    worked out once.
    """
    auvs = setup.scenario.auvs
    if not auvs.vehicle.has_dynamics:
        return _once(setup, "auvs", _unguided_auvs)
    if auvs.feedback == "truth" and water.is_steady:
        return _once(setup, "auvs", _foreseen)
    return _guided(setup, water, None if auvs.feedback == "truth" else wrong)


# Fleets whose motion no seed changes, by setup
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


# Motions of hulls that no seed changes, which take long to integrate, by the keys that change them
_voyages: dict[tuple[object, ...], VehicleFleet] = {}


def _foreseen(setup: Setup) -> VehicleFleet:
    asked = setup.scenario
    key = asked.survey, asked.auvs, asked.environment, setup.control_intervals, setup.route
    if key not in _voyages:
        _voyages.clear()  # before: two long motions of large fleets may not fit into memory
        _voyages[key] = _guided(setup, MissionCurrent(setup, Streams(0)), None)
    return _voyages[key]


def _guided(setup: Setup, water: MissionCurrent, wrong: Wrong | None) -> VehicleFleet:
    """Return AUVs with dynamics; if they steer by the truth, they are integrated to the end."""
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
    """Return the moving ASVs of a setup; None if there are none.

    They know where the AUVs were launched, what is planned for them, and the fixes on record.
    """
    if not setup.are_steered:
        return None
    launched = places(auvs.motion, 0.0)[:, :3]
    prediction = CarriedForward(launched, courses(setup))
    return anchors_of(setup, prediction, known_of(setup, auvs, record), setup.room)


def equip_auvs(
    setup: Setup, fleet: VehicleFleet, wrong: Wrong, record: Recorder
) -> tuple[DeadReckoning, Navigator]:
    """Return the AUVs' dead reckoning and navigator, by which some of them steer.

    The record has the receptions of fixes, and their Jacobians by systematic errors.
    """
    navigation = setup.scenario.navigation
    reckoning = DeadReckoning(fleet.motion, wrong)
    if fleet.poses is not None:
        fleet.poses.on_known = reckoning.follow
    elif fleet.foreseen:
        reckoning.follow(setup.scenario.duration_s)
    if fleet.guided is None:
        steering = np.zeros((len(fleet), 2)), np.zeros(len(fleet), dtype=LEARNT)
    else:
        fleet.guided.has_learnt = navigation.weighs
        steering = fleet.guided.corrections, fleet.guided.learnt
    if navigation.filter.is_own:
        make = own_part(NAVIGATOR, navigation.filter).part
        made = navigation.filter, make, reckoning, steering[0]
        receiver = PLAIN if setup.ping_channel is None else setup.ping_channel.receiver
        fixes = record.receptions, record.gnss_fixes
        return reckoning, OwnNavigator(*made, *fixes, receiver.levels)
    first, growth = setup.beliefs
    made_of = (
        reckoning,
        _rule(navigation, setup.navigator.has_gain),
        growth,
        first,
        *steering,
        record.jacobians,
        record.receptions,
        record.gnss_fixes,
    )
    if navigation.peers is not None and len(fleet) > 1:
        return reckoning, Team(
            *made_of,
            fusion=navigation.peers.fusion,
            raw=navigation.peers.share == "raw",
            fleet=common_to_all(setup.taken),
            errors=peer_errors(setup),
            every_s=float(navigation.peers.every_s),
            sound_speed=setup.assumed_sound_speed_m_per_s,
            columns=columns_of(setup),
        )
    rates = _rates(setup) if navigation.filter.settings.get("range_rate") else None
    navigator = LinearNavigator(*made_of, rates)
    if not setup.navigator.is_smoother:
        return reckoning, navigator
    lag = navigation.filter.settings.get("lag_s")
    return reckoning, Smoother(navigator, reckoning, growth, first, lag)


def _rates(setup: Setup) -> Rates:
    """Return the errors of range rates that the filter uses."""
    sd = setup.scenario.usbl.range_rate_sd_m_per_s or 0.0
    is_told = any(kind.name == "sound_speed" for kind in setup.estimated_errors)
    return Rates(sd**2, abs(setup.taken.sound_speed_error) if is_told else 0.0)


def _rule(navigation: Navigation, has_gain: bool) -> Rule:
    """Return how the filter weighs fixes."""
    if navigation.weighs:
        return Rule(WEIGHED, at_ping=True, gate=navigation.nis_gate or 0.0)
    gain = navigation.fixed_gain.gain if has_gain else 0.0
    return Rule(gain, at_ping=navigation.fixed_gain.delay_compensation == "shift", gate=0.0)
