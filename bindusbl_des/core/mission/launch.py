"""The fleet at the start of a mission: vehicles on their routes, and the AUVs' navigation.

Hulls and controllers are imported when they are needed: most missions are kinematic.
"""

import math
from collections.abc import Callable, Sequence
from functools import partial
from itertools import groupby
from typing import TYPE_CHECKING, NamedTuple
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
from ..protocol.anchors.information import FixErrors, fix_errors
from ..protocol.anchors.placing import Anchors, anchors_of
from ..protocol.predicted_positions import CarriedForward, courses, planned_vehicles
from ..protocol.view import known_of
from ..records.rows import LEARNT, Recorder, Rows
from ..scenario.families import ASV, AUV, NAVIGATOR
from ..scenario.groups import Auv, Vessels
from ..scenario.own_routes import WayView, own_motion
from ..scenario.part_choice import own_part
from ..scenario.scenario_keys import Wind
from ..scenario.sections.navigation import Navigation
from ..setup import Setup
from ..vehicles.currents import CONTROL_S, carried, current_series, gauss_markov
from ..vehicles.fleet import VehicleFleet
from ..vehicles.motion import LEG_COLUMNS, Motion, places, together
from ..vehicles.poses import PosedVehicle, Poses
from ..vehicles.reckoning import NOTHING, Missed, Wrong
from ..vehicles.vehicle import Place, SegmentedTrajectory, Vehicle, moored, recorded

if TYPE_CHECKING:
    from ..vehicles.guidance.guided_fleet import GuidedFleet, Shared


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


def guided_auvs(
    setup: Setup, auvs: Sequence[Auv], water: MissionCurrent, wrong: Wrong, shared: "Shared | None"
) -> "GuidedFleet":
    """Return the guided fleet of `auvs`, which have consecutive numbers, one hull and one feedback.

    If they steer by their estimates, their dead reckoning has the errors of `wrong`.  The fleet
    writes its motion into the arrays `shared` with other fleets; None: into its own.
    """
    from ..vehicles.guidance.departure import DeparturePlan
    from ..vehicles.guidance.guided_fleet import GuidedFleet
    from ..vehicles.guidance.sensing import SteeringDrift

    navigation, group, drift = setup.scenario.navigation, auvs[0].group, None
    if group.by_estimate:
        beyond = math.ceil((setup.afterwards_s + 1.0) * navigation.imu_rate_hz)
        own = wrong.of(slice(auvs[0].number, auvs[-1].number + 1))
        walks = np.pad(own.walks, ((0, 0), (0, beyond), (0, 0)), mode="edge")
        drift = SteeringDrift(
            own._replace(walks=walks), navigation.velocity == "through_water", setup.log_sees_m
        )
    plans = [plan for auv in auvs if (plan := setup.plans[auv.number]) is not None]
    return GuidedFleet(
        group.vehicle.model,
        DeparturePlan(
            paths=[plan.tour for plan in plans],
            speed_m_per_s=[auv.speed_m_per_s for auv in auvs],
            depth_m=[auv.depth_m for auv in auvs],
            names=[f"AUV{auv.number}" for auv in auvs],
            keeping=setup.keeping(group),
            bottom=setup.bottom,
        ),
        dict(group.vehicle.coefficients),
        currents=water.series,
        field=setup.flow.field,
        duration_s=setup.control_intervals * CONTROL_S,
        drift=drift,
        shared=shared,
    )


def guided_asvs(
    setup: Setup, vessels: Vessels, streams: Streams, water: MissionCurrent,
    shared: "Shared | None",
) -> "GuidedFleet":  # fmt: skip
    """Return the trajectories of ASVs with dynamics, which keep station by noisy GNSS positions."""
    from ..vehicles.guidance.departure import DeparturePlan
    from ..vehicles.guidance.guided_fleet import GuidedFleet

    count, members = setup.control_intervals, list(vessels.members)
    noise = [
        streams.of(Purpose.STATION, asv).standard_normal((count, 2)) * vessels.usbl.gnss_sd_m
        for asv in members
    ]
    return GuidedFleet(
        vessels.vehicle.model,
        DeparturePlan(
            stations=np.array([setup.stations_m[asv] for asv in members]),
            names=[f"ASV{asv}" for asv in members],
        ),
        dict(vessels.vehicle.coefficients),
        currents=water.series,
        field=setup.flow.field,
        duration_s=count * CONTROL_S,
        position_noise=np.stack(noise) + slow_gnss(setup, streams)[members],
        shared=shared,
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
    steered = [group for group in setup.groups if group.vehicle.has_dynamics]
    if not steered:
        return _once(setup, "auvs", _unguided_auvs)
    if water.is_steady and not any(group.by_estimate for group in steered):
        return _once(setup, "auvs", partial(_foreseen, wrong=wrong))
    return _guided(setup, water, wrong)


# Fleets whose motion no seed changes, by setup
_launched: WeakKeyDictionary[Setup, dict[str, VehicleFleet]] = WeakKeyDictionary()


def _once(setup: Setup, whose: str, launch: Callable[[Setup], VehicleFleet]) -> VehicleFleet:
    fleets = _launched.setdefault(setup, {})
    if whose not in fleets:
        fleets[whose] = launch(setup)
    return fleets[whose]


def _unguided_auvs(setup: Setup) -> VehicleFleet:
    if not any(group.vehicle.own for group in setup.groups):
        lasts = setup.scenario.duration_s + setup.afterwards_s
        return _segmented(planned_vehicles(setup, lasts))
    return _segmented([vehicle for auvs in _alike(setup) for vehicle in _unguided(setup, auvs)])


def _alike(setup: Setup) -> list[list[Auv]]:
    """Return the AUVs of one hull that follow each other, and steer by the same."""
    kinds = groupby(
        setup.auvs,
        lambda auv: (auv.group.vehicle.plain(), auv.group.by_estimate, auv.group.altitude),
    )
    return [list(auvs) for _, auvs in kinds]


def _unguided(setup: Setup, auvs: Sequence[Auv]) -> list[SegmentedTrajectory]:
    """Return AUVs without dynamics."""
    duration, own = setup.scenario.duration_s, auvs[0].group.vehicle.own
    if not own:
        planned = planned_vehicles(setup, duration + setup.afterwards_s)
        return [planned[auv.number] for auv in auvs]
    ways = [
        WayView(auv.number, auv.speed_m_per_s, auv.depth_m, duration, plan.tour.sample)
        for auv in auvs
        if (plan := setup.plans[auv.number]) is not None
    ]
    return [recorded(*track) for track in own_motion(AUV, own, ways)]


# Motions of hulls that no seed changes, which take long to integrate, by the keys that change them
_voyages: dict[tuple[object, ...], VehicleFleet] = {}


def _foreseen(setup: Setup, wrong: Wrong) -> VehicleFleet:
    asked = setup.scenario
    key = asked.survey, asked.auvs, asked.environment, setup.control_intervals, setup.routes
    if key not in _voyages:
        _voyages.clear()  # beforehand: there may not be room for two long voyages of large fleets
        _voyages[key] = _guided(setup, MissionCurrent(setup, Streams(0)), wrong)
    return _voyages[key]


def _guided(setup: Setup, water: MissionCurrent, wrong: Wrong) -> VehicleFleet:
    """Return AUVs some of which have dynamics; the whole way of those that know where they are is
    foreseen.
    """
    return _mixed(
        [
            Alike(
                auvs[0].group.vehicle.model,
                slice(auvs[0].number, auvs[-1].number + 1),
                None if auvs[0].group.vehicle.has_dynamics else _segmented(_unguided(setup, auvs)),
                partial(guided_auvs, setup, auvs, water, wrong),
            )
            for auvs in _alike(setup)
        ],
        setup.control_intervals * CONTROL_S,
    )


class Alike(NamedTuple):
    """Vehicles of one hull, by their numbers: `foreseen`, or else made by `guide`."""

    model: str
    numbers: slice
    foreseen: VehicleFleet | None
    guide: "Callable[[Shared | None], GuidedFleet]"


def _mixed(kinds: Sequence[Alike], lasts: float) -> VehicleFleet:
    """Return a fleet of vehicles some of which have dynamics, for a time (s).  Those of several
    kinds share one table of motions.
    """
    from ..vehicles.guidance.guided_fleet import Shared, lines_of
    from ..vehicles.hulls.fleet import find

    if len(kinds) == 1 and kinds[0].foreseen is not None:
        return kinds[0].foreseen
    if len(kinds) == 1:
        guided = kinds[0].guide(None)
        members = [guided.vehicle(number) for number in range(kinds[0].numbers.stop)]
        return _under_way(members, guided.motion, [guided], (guided.corrections, guided.learnt))
    sizes: list[int] = []
    steps: list[float] = []
    for model, whose, own, _ in kinds:
        count = whose.stop - whose.start
        if own is not None:
            sizes += np.diff(own.motion.first).tolist()
            steps += own.motion.steps.tolist()
        else:
            sizes += [lines_of(model, lasts)] * count
            steps += [find(model).step_s] * count
    first = np.concatenate(([0], np.cumsum(sizes)))
    table = np.zeros((first[-1], LEG_COLUMNS))
    corrections, learnt = np.zeros((len(steps), 2)), np.zeros(len(steps), dtype=LEARNT)
    vehicles: list[Vehicle] = []
    fleets: list[GuidedFleet] = []
    for _, whose, own, guide in kinds:
        rows = table[first[whose.start] : first[whose.stop]]
        if own is not None:
            rows[:, : own.motion.table.shape[1]] = own.motion.table
            vehicles += own.vehicles
            continue
        fleets.append(guide(Shared(rows, corrections[whose], learnt[whose])))
        vehicles += [fleets[-1].vehicle(number) for number in range(whose.stop - whose.start)]
    motion = Motion(table, first.astype(np.int64), np.array(steps))
    return _under_way(vehicles, motion, fleets, (corrections, learnt))


def _under_way(
    vehicles: Sequence[Vehicle],
    motion: Motion,
    fleets: "Sequence[GuidedFleet]",
    steering: tuple[Floats, Rows],
) -> VehicleFleet:
    """Return vehicles of guided fleets; those that steer by no estimate are flown to the end."""
    guided = tuple(fleet for fleet in fleets if fleet.by_estimate)
    for fleet in fleets:
        if not fleet.by_estimate:
            fleet.advance(fleet.duration_s)
    return VehicleFleet(vehicles, motion, guided, steering if guided else None)


def launch_asvs(setup: Setup, streams: Streams, water: MissionCurrent) -> VehicleFleet:
    """Return the ASVs of a setup at their stations or on their tracks, in index order."""
    hulls = [vessels.vehicle for vessels in setup.vessels]
    blows = setup.scenario.environment.wind is not None
    moves = any(hull.has_dynamics or (blows and hull.sails) for hull in hulls)
    if setup.asv_tracks is not None or not moves or not setup.stations_m:
        return _once(setup, "asvs", _unguided_asvs)

    def foreseen(vessels: Vessels) -> VehicleFleet | None:
        if vessels.vehicle.sails:
            return sailing_asvs(setup, vessels, streams, water)
        return None if vessels.vehicle.has_dynamics else _unguided_asvs(setup, vessels)

    return _mixed(
        [
            Alike(
                vessels.vehicle.model,
                slice(vessels.members.start, vessels.members.stop),
                foreseen(vessels),
                partial(guided_asvs, setup, vessels, streams, water),
            )
            for vessels in setup.vessels
        ],
        setup.control_intervals * CONTROL_S,
    )


def sailing_asvs(
    setup: Setup, vessels: Vessels, streams: Streams, water: MissionCurrent
) -> VehicleFleet:
    """Return ASVs that sail, which keep station by the wind of this mission.

    They begin at rest at their stations, with the wind abeam.
    """
    from ..vehicles.sailing import rig_of, sailed

    air, rig = winds_of(setup, streams), rig_of(**vessels.vehicle.sailing.model_dump())
    stations = np.array([setup.stations_m[asv] for asv in vessels.members])
    across = math.atan2(-air[0, 1], -air[0, 0]) + math.pi / 2.0
    starts = np.column_stack((stations, np.full((len(stations), 2), (across, 0.0))))
    motion = sailed(rig, stations, starts, air, water.series, CONTROL_S, setup.flow.field)
    return VehicleFleet([Vehicle(motion, asv) for asv in range(len(stations))], motion)


def winds_of(setup: Setup, streams: Streams) -> Floats:
    """Return the wind of a mission (m/s) in each control interval, (n, 2), along x and y, towards
    where it blows.
    """
    from ..vehicles.wind import mean_wind, read_wind

    asked, count = setup.scenario.environment.wind or Wind(), setup.control_intervals
    samples = None if asked.file is None else read_wind(asked.file)
    times = CONTROL_S * np.arange(count, dtype=np.float64)
    speed, origin = mean_wind(asked.speed_m_per_s, asked.from_deg, samples, times)
    noise = streams.of(Purpose.WIND).standard_normal((count, 2))
    varied = gauss_markov(1.0, asked.gust_time_s, CONTROL_S, noise)
    speed = np.maximum(speed + asked.gust_sd_m_per_s * varied[:, 0], 0.0)
    origin = origin + math.radians(asked.veer_sd_deg) * varied[:, 1]
    return np.column_stack((-speed * np.cos(origin), -speed * np.sin(origin)))


def _unguided_asvs(setup: Setup, only: Vessels | None = None) -> VehicleFleet:
    """Return ASVs without dynamics at their stations or on their tracks, all or `only` some."""
    if setup.asv_tracks is not None:
        return _segmented([recorded(*track) for track in setup.asv_tracks])
    found: list[SegmentedTrajectory] = []
    for vessels in setup.vessels if only is None else (only,):
        stations = [(asv, setup.stations_m[asv]) for asv in vessels.members]
        if not (own := vessels.vehicle.own):
            found += [moored(Place(x, y, 0.0, 0.0)) for _, (x, y) in stations]
            continue
        ways = [
            WayView(number, 0.0, 0.0, setup.scenario.duration_s, partial(_stay, (x, y, 0.0)))
            for number, (x, y) in stations
        ]
        found += [recorded(*track) for track in own_motion(ASV, own, ways)]
    return _segmented(found)


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
    depths = np.array([auv.depth_m for auv in setup.auvs])

    def errors() -> list[FixErrors]:
        given = setup.ping_loss, depths, setup.horizontal_reach_m
        found = {id(usbl): fix_errors(usbl, *given) for usbl in setup.usbls}
        return [found[id(usbl)] for usbl in setup.usbls]

    return anchors_of(setup, prediction, known_of(setup, auvs, record), setup.room, errors)


def equip_auvs(
    setup: Setup, fleet: VehicleFleet, wrong: Wrong, record: Recorder, water: MissionCurrent
) -> tuple[DeadReckoning, Navigator]:
    """Return the AUVs' dead reckoning and navigator, by which some of them steer.

    The record has the receptions of fixes, and their Jacobians by systematic errors.
    """
    navigation = setup.scenario.navigation
    missed = NOTHING
    if wrong.swept.shape[1] > 1:
        walks = navigation.velocity == "through_water"  # which have the uniform current
        uniform = np.zeros((0, 2)) if walks else np.ascontiguousarray(water.series)
        missed = Missed(setup.flow.field, uniform, setup.bottom, setup.log_sees_m)
    reckoning = DeadReckoning(fleet.motion, wrong, missed)
    if fleet.poses is not None:
        fleet.poses.on_known = reckoning.follow
    else:  # who steers by what is reckoned sums up its own
        foreseen = [auv.number for auv in setup.auvs if not auv.group.by_estimate]
        reckoning.follow(setup.scenario.duration_s, foreseen)
    steering = fleet.steering or (np.zeros((len(fleet), 2)), np.zeros(len(fleet), dtype=LEARNT))
    for guided in fleet.guided:
        guided.has_learnt = navigation.weighs
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
