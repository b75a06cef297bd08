"""The world of a mission put together as its scenario describes it."""

import math
from collections.abc import Generator
from dataclasses import replace
from itertools import count
from typing import TypeVar

import numpy as np
import simpy

from ..acoustics.bursts import pairs
from ..acoustics.named_channels import hf_channel, loss_of, mf_channel, timing_sd_of
from ..acoustics.propagation import SignalBand
from ..core.plugins import is_plugin
from ..core.streams import Purpose, Streams
from ..navigation.gnss import GnssReceivers
from ..navigation.navigators import Navigator
from ..protocol.access.serving import access_of, serve_at_random
from ..protocol.broadcasters import broadcaster_named
from ..protocol.dissemination import Announcing, Dissemination, Knowledge, LastHeard
from ..protocol.downlinks import downlink_named
from ..protocol.hf.outcomes import Measuring, Outcomes
from ..protocol.hf.uplink import Uplink
from ..protocol.mf.downlink import Deliveries, FrameBand, MfDownlink
from ..protocol.network import Network
from ..protocol.passive.beacons import Beacons, PassiveOutcomes
from ..protocol.passive.network import OwnFixes, PassiveNetwork, take_turns
from ..protocol.predicted_positions import PredictedPositions, prediction_of
from ..protocol.ranging import ranging_of, strayed
from ..protocol.replies import Replies, reply_delay_of
from ..protocol.schedules.named import schedule_named
from ..protocol.schedules.polling import Answers
from ..protocol.schedules.view import known_of
from ..protocol.slots import slots_of
from ..protocol.steps import moment
from ..protocol.tdma import serve
from ..records.rows import Jacobians, Recorder, Rows
from ..scenario.agreement.instruments import taken_for
from ..scenario.channel_settings import burst_s
from ..scenario.destinations import failures_of
from ..scenario.families import downlink_of, ready_plugins, schedule_of, tells_slots
from ..scenario.own_sensors import estimated_kinds
from ..scenario.scenario import Scenario, kept
from ..scenario.site import assumed_sound_speed_of, sound_speed_of
from ..usbl.array import elements_of
from ..usbl.instrument import Usbl, sheet_of
from ..usbl.own_instrument import instrument_named
from ..usbl.slow_errors import slow_numbers
from ..usbl.systematic_fixes import Astray
from ..vehicles.fleet import VehicleFleet
from ..vehicles.motion import places
from ..vehicles.poses import Poses, PoseSource
from .closed_loop import MissionCurrent, afterwards_s
from .launch import launch_anchors, launch_asvs, launch_auvs, posed
from .onboard import equip_auvs
from .sensor_errors import systematic_errors_of, wrong_reckoning
from .world import World

HfBand = TypeVar("HfBand", Uplink, Beacons)


def build_world(
    env: simpy.Environment,
    scenario: Scenario,
    seed: int,
    source: PoseSource | None = None,
    pose_step_s: float = 0.1,
) -> World:
    """Put the world of a scenario together, at rest at time 0; the protocol goes on as `env` does.

    A `source` of poses, asked each `pose_step_s` (s), moves the vehicles that it answers for.
    """
    ready_plugins(scenario)
    streams = Streams(seed)
    columns = sum(len(kind.sds) * kind.times for kind in estimated_kinds(scenario))
    record = Recorder(scenario.record.detail == "full", jacobians=Jacobians(columns))
    water = MissionCurrent(scenario, streams)
    wrong = wrong_reckoning(scenario, streams, water)
    moved = {} if source is None else _moved(scenario, source, pose_step_s)
    auvs, asvs = moved.get("auvs"), moved.get("asvs")
    if auvs is None:
        auvs = launch_auvs(scenario, water, wrong)
    anchors = launch_anchors(scenario, auvs, record) if asvs is None else None
    if anchors is not None:
        asvs = anchors.fleet
    if asvs is None:
        asvs = launch_asvs(scenario, streams, water)
    if scenario.asvs.failures:
        asvs = replace(asvs, failures=failures_of(scenario))
    reckoning, navigator = equip_auvs(scenario, auvs, wrong, record)
    make = _passive if scenario.protocol.asvs_ping else _network
    network = make(env, scenario, auvs, asvs, navigator, record, streams)
    if scenario.navigation.gnss_fix is not None:
        equip_with_gnss(env, scenario, auvs, network.deliveries, record, streams)
    if anchors is not None:
        known = None if scenario.protocol.asvs_ping else record.fixes
        env.process(anchors.keep_placing(env, known))
    if isinstance(network, PassiveNetwork):
        env.process(take_turns(network))
    elif scenario.protocol.random_access:
        access = access_of(scenario, streams, auvs, network.uplink.band, hf_channel(scenario))
        env.process(serve_at_random(network, access))
    else:
        env.process(serve(network))
    return World(scenario, auvs, asvs, reckoning, navigator, network, record, streams)


def equip_with_gnss(
    env: simpy.Environment,
    scenario: Scenario,
    auvs: VehicleFleet,
    deliveries: Deliveries,
    record: Recorder,
    streams: Streams,
) -> None:
    """Let AUVs have fixes by GNSS at the surface.

    Those that steer by them, or are moved meanwhile, have each at its instant; the others' are made
    when somebody wants to know.
    """
    asked, end = scenario.navigation.gnss_fix, float(scenario.duration_s)
    assert asked is not None
    receivers = GnssReceivers(auvs, asked, end, streams, record.gnss_fixes)
    deliveries.gnss = receivers
    if not auvs.foreseen:
        env.process(deliver_each(env, deliveries, receivers.every_s, end))


def deliver_each(
    env: simpy.Environment, deliveries: Deliveries, every_s: float, end: float
) -> Generator[simpy.Event, None, None]:
    """Let AUVs have what has reached them at each multiple of a time before an end (s)."""
    for number in count(1):
        if (instant := number * every_s) >= end:
            return
        yield moment(env, instant)
        deliveries.deliver(instant)


def _moved(scenario: Scenario, source: PoseSource, step_s: float) -> dict[str, VehicleFleet]:
    """Return the fleets that an outside program moves."""
    counts = {"auvs": scenario.auvs.count, "asvs": scenario.asvs.count}
    ahead = afterwards_s(scenario)
    poses = Poses(source, step_s, counts, scenario.duration_s + ahead, ahead)
    return {kind: posed(poses, kind, counts[kind]) for kind in poses.kinds}


def _network(
    env: simpy.Environment,
    scenario: Scenario,
    auvs: VehicleFleet,
    asvs: VehicleFleet,
    navigator: Navigator,
    record: Recorder,
    streams: Streams,
) -> Network:
    """Return both bands, and the surface fleet that works with them."""
    slots, protocol = slots_of(scenario), scenario.protocol
    uplink = _on_hf(Uplink, scenario, auvs, asvs, record, streams)
    deliveries = MfDownlink(
        env,
        auvs,
        asvs,
        navigator,
        record,
        band=frame_band(scenario, streams),
        clock=slots.clock,
        streams=streams,
    )
    outcomes = Outcomes(
        uplink,
        asvs,
        _measuring(scenario, record, streams),
        strayed(scenario, auvs),
        record,
        deliveries.frames if protocol.deafens_asvs else None,
    )
    replies = answers = None
    if protocol.replies:
        message = slots.messages.packed(1)[0] if protocol.replies_in_frames else None
        delay = reply_delay_of(scenario)
        replies = Replies(env, outcomes, deliveries, record, message, delay)
    if schedule_of(scenario).calls:
        answers = Answers(env, outcomes, record, slots)
    schedule = schedule_named(protocol.schedule)
    framed = schedule_of(scenario).framed
    network = Network(
        env,
        slots,
        auvs,
        asvs,
        record,
        uplink,
        outcomes,
        deliveries,
        ranging_of(scenario, env, uplink, streams, answers),
        downlink=downlink_named(protocol.downlink),
        frame_s=protocol.frame_s if framed else 0.0,
        schedule=schedule,
        schedule_draw=streams.of(Purpose.SCHEDULE),
        broadcaster=broadcaster_named(protocol.broadcaster),
        broadcaster_draw=streams.of(Purpose.BROADCASTER),
        mf_range=scenario.acoustics.mf.range_m,
        mf_slant=scenario.acoustics.mf.range_metric == "slant",
        positions=PredictedPositions(
            auvs,
            asvs,
            uplink.band,
            protocol.conflict_margin_m,
            prediction_of(scenario, places(auvs.motion, 0.0)[:, :3]),
            record.fixes,
        ),
        estimates=known_of(scenario, auvs, record),
        answers=answers,
        replies=replies,
    )
    if tells_slots(scenario):
        network.dissemination = dissemination_of(scenario, network, streams)
    return network


def dissemination_of(scenario: Scenario, network: Network, streams: Streams) -> Dissemination:
    """Return who knows which slots, where frames carry them."""
    protocol, count = scenario.protocol, scenario.auvs.count
    ahead = downlink_of(scenario).tells_ahead
    return Dissemination(
        network.env,
        network.slots,
        network.record,
        network.deliveries,
        network.ranging,
        network.schedule,
        network.view,
        network.opens,
        network.asv_fleet.works_from,
        LastHeard(count, network.record.fixes, protocol.forget_after_s),
        Announcing(
            ahead, protocol.dissemination.missed, protocol.contention_chance, protocol.recall_rounds
        ),
        [Knowledge() for _ in range(count)],
        streams,
    )


def _passive(
    env: simpy.Environment,
    scenario: Scenario,
    auvs: VehicleFleet,
    asvs: VehicleFleet,
    navigator: Navigator,
    record: Recorder,
    streams: Streams,
) -> PassiveNetwork:
    """Return the HF band on which ASVs ping, and AUVs that fix themselves by that."""
    beacons = _on_hf(Beacons, scenario, auvs, asvs, record, streams)
    outcomes = PassiveOutcomes(beacons, auvs, _measuring(scenario, record, streams), record)
    fixes = OwnFixes(env, auvs, navigator, record, outcomes)
    return PassiveNetwork(env, slots_of(scenario), auvs, asvs, record, beacons, outcomes, fixes)


def _measuring(scenario: Scenario, record: Recorder, streams: Streams) -> Measuring:
    """Return how the instrument of a scenario measures a ping between an AUV and an ASV."""
    instrument = instrument_named(scenario.usbl.model) or carried(scenario, streams)
    counts, slow = (scenario.auvs.count, scenario.asvs.count), slow_errors(scenario, streams)
    return Measuring(instrument, streams, *counts, record, slow)


def _on_hf(
    kind: type[HfBand],
    scenario: Scenario,
    auvs: VehicleFleet,
    asvs: VehicleFleet,
    record: Recorder,
    streams: Streams,
) -> HfBand:
    """Return the HF band of a kind: of the pings of AUVs and calls, or of the pings of ASVs."""
    hf = scenario.acoustics.hf
    return kind(
        auvs,
        asvs,
        SignalBand(hf.range_metric == "slant", hf.range_m, hf.ping_s, sound_speed_of(scenario)),
        hf_channel(scenario) or loss_of(scenario),
        streams,
        record,
        pairs(burst_s(hf.channel), streams, Purpose.BURST, len(auvs), len(asvs)),
    )


def frame_band(scenario: Scenario, streams: Streams) -> FrameBand:
    """Return what holds for all frames of the downlink."""
    channel, mf = mf_channel(scenario), scenario.acoustics.mf
    capture = math.inf if channel is None else channel(1, 1.0).receiver.capture
    deafening = scenario.acoustics.hf.ping_s if scenario.protocol.duplex == "per_node" else 0.0
    return FrameBand(
        mf.range_m,
        sound_speed_of(scenario),
        channel,
        capture,
        deafening,
        pairs(
            burst_s(mf.channel),
            streams,
            Purpose.FRAME_BURST,
            scenario.auvs.count,
            scenario.asvs.count,
        ),
        mf.range_metric == "slant",
    )


def carried(scenario: Scenario, streams: Streams) -> Usbl | Astray:
    """Return the USBL instrument that every ASV carries, or with passive ranging every AUV, and
    what is wrong all the time.
    """
    usbl, systematic = usbl_of(scenario), systematic_errors_of(scenario, streams)
    return usbl if systematic is None else Astray(usbl, systematic)


def slow_errors(scenario: Scenario, streams: Streams) -> Rows | None:
    """Return the slow acoustic errors of each AUV and ASV; None where there are none."""
    usbl = scenario.usbl
    if is_plugin(usbl.model):
        return None
    counts = len(elements_of(usbl.array)), streams, scenario.auvs.count, scenario.asvs.count
    return slow_numbers(usbl.slow_share, usbl.correlation_s, *counts)


@kept
def usbl_of(scenario: Scenario) -> Usbl:
    """Return that instrument as far as it is the same for all."""
    usbl = scenario.usbl
    roll, pitch, heading = np.radians((usbl.roll_sd_deg, usbl.pitch_sd_deg, usbl.heading_sd_deg))
    return Usbl(
        elements_of(usbl.array),
        usbl.tdoa_sd_s,
        usbl.travel_time_sd_s,
        usbl.quantum_s,
        (float(roll), float(pitch), float(heading)),
        usbl.gnss_sd_m,
        assumed_sound_speed_of(scenario),
        sound_speed_of(scenario),
        sheet_of(scenario),
        timing_sd_of(scenario),
        taken_for(scenario).usbl.slow_share
        if any(kind.name == "slow" for kind in estimated_kinds(scenario))
        else 0.0,
    )
