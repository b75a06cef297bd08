"""Builds the world of a mission from its scenario."""

import math
from collections.abc import Generator, Sequence
from dataclasses import replace
from itertools import count
from operator import attrgetter
from typing import Any

import numpy as np
import simpy

from ...support.streams import Purpose, Streams
from ..acoustics.bursts import pairs
from ..acoustics.named_channels import in_shadow
from ..acoustics.shadows import AskedDisc, shadowed
from ..acoustics.travel_time import PASSED
from ..navigation.gnss import GnssReceivers
from ..navigation.navigators import Navigator
from ..navigation.team import Team
from ..protocol.access.air import SharedAir
from ..protocol.access.node import Node
from ..protocol.access.serving import run_programs
from ..protocol.acknowledged import Acknowledged, Repeating
from ..protocol.answers import Answers
from ..protocol.data import Data
from ..protocol.deliveries import Deliveries, OwnFixes
from ..protocol.dissemination import Announcing, Dissemination, Knowledge, LastHeard
from ..protocol.exchange import Exchange
from ..protocol.frames import FrameBand, MfDownlink, Replies
from ..protocol.network import Network, PassiveNetwork
from ..protocol.outcomes import AnsweredOutcomes, Measuring, Outcomes, OwnOutcomes
from ..protocol.own_parts import checked_choice, checked_groups, checked_round
from ..protocol.peers import Peers, PeerSensors
from ..protocol.pings import BeaconBand, HfBand
from ..protocol.predicted_positions import PredictedPositions, prediction_of
from ..protocol.ranging import ranging_of, strayed
from ..protocol.slots import gap_s, packet_s
from ..protocol.steps import moment
from ..protocol.tdma import serve, take_turns
from ..protocol.view import known_of
from ..records.rows import Jacobians, Recorder
from ..scenario.families import BROADCASTER, DOWNLINK, SCHEDULE
from ..scenario.part_choice import checked_part
from ..setup import Setup
from ..usbl.fixes import UsblWithErrors
from ..usbl.instrument import Usbl
from ..usbl.own_instrument import OwnInstrument, instrument_named
from ..usbl.range_rates import RangeRates
from ..usbl.slow_errors import slow_numbers
from ..vehicles.fleet import VehicleFleet
from ..vehicles.motion import places
from ..vehicles.poses import Poses, PoseSource
from .launch import (
    MissionCurrent,
    equip_auvs,
    launch_anchors,
    launch_asvs,
    launch_auvs,
    posed,
)
from .modems import begin_modems
from .sensor_errors import (
    clocks,
    pressure_errors,
    systematic_errors_of,
    turned_arrays,
    wrong_reckoning,
)
from .world import World


def build_world(
    env: simpy.Environment,
    setup: Setup,
    seed: int,
    source: PoseSource | None = None,
    pose_step_s: float = 0.1,
) -> World:
    """Build the world of a scenario, at rest at time 0; the protocol runs on `env`.

    A `source` of poses, asked each `pose_step_s` (s), moves the vehicles that it has poses for.
    """
    streams = Streams(seed)
    columns = sum(len(kind.sds) * kind.times for kind in setup.estimated_errors)
    record = Recorder(setup.scenario.record.detail == "full", jacobians=Jacobians(columns))
    water = MissionCurrent(setup, streams)
    wrong = wrong_reckoning(setup, streams, water)
    moved = {} if source is None else _moved(setup, source, pose_step_s)
    auvs, asvs = moved.get("auvs"), moved.get("asvs")
    if auvs is None:
        auvs = launch_auvs(setup, water, wrong)
    anchors = launch_anchors(setup, auvs, record) if asvs is None else None
    if anchors is not None:
        asvs = anchors.fleet
    if asvs is None:
        asvs = launch_asvs(setup, streams, water)
    if setup.scenario.asvs.failures or not asvs.vehicles:  # no round begins while none works
        asvs = replace(asvs, failures=setup.failures)
    reckoning, navigator = equip_auvs(setup, auvs, wrong, record, water)
    given = env, setup, auvs, asvs, navigator, record, streams
    passive = setup.scenario.protocol.asvs_ping
    network = _passive(*given) if passive else _network(*given)
    if setup.scenario.navigation.gnss_fix is not None:
        equip_with_gnss(env, setup, auvs, network.deliveries, record, streams)
    if anchors is not None:
        env.process(anchors.keep_placing(env, None if passive else record.fixes))
    if isinstance(network, PassiveNetwork):
        env.process(take_turns(network))
    else:
        if isinstance(navigator, Team):
            begin_peers(env, setup, network, navigator, record, streams)
        if setup.scenario.modems is not None:
            network.modems = begin_modems(setup, network, record, streams)
        if setup.scenario.protocol.random_access:
            rate = setup.scenario.acoustics.hf.bit_rate_bps
            late = clocks(setup, streams)
            run_programs(network, setup.scenario.protocol, streams, rate, late)
        else:
            env.process(serve(network))
    return World(setup, auvs, asvs, reckoning, navigator, network, record, streams)


def begin_peers(
    env: simpy.Environment, setup: Setup, network: Network, team: Team, record: Recorder,
    streams: Streams,
) -> None:  # fmt: skip
    """Let AUVs range each other."""
    scenario, fleet, band = setup.scenario, network.auv_fleet, network.uplink.band
    asked = scenario.navigation.peers
    assert asked is not None
    air = SharedAir(
        env, network.uplink, record, streams,
        bit_rate_bps=scenario.acoustics.hf.bit_rate_bps, hearing=True,
    )  # fmt: skip
    network.air = air

    def depth(auv: int, time: float) -> float:
        below = fleet.vehicles[auv].at(time).z
        return below + float(pressure_errors(setup, streams, auv, np.array([time]))[0])

    sensors = PeerSensors(
        replace(setup.usbl, gnss_sd=0.0), asked.bearing == "array", clocks(setup, streams),
        turned_arrays(setup, streams), depth, scenario.navigation.depth_sd_m,
    )  # fmt: skip
    peers = Peers(
        air, fleet, team, network.deliveries, record, streams, sensors, asked.traits, asked.every_s,
        asked.message_bytes, PASSED * band.reach / band.sound_speed,
    )  # fmt: skip
    peers.begin(
        [
            Node(name, network.slots, streams.of(Purpose.PEER, auv), iter(()), air, auv)
            for auv, name in enumerate(air.names[: air.auvs])
        ]
    )


def equip_with_gnss(
    env: simpy.Environment,
    setup: Setup,
    auvs: VehicleFleet,
    deliveries: Deliveries,
    record: Recorder,
    streams: Streams,
) -> None:
    """Let AUVs make GNSS fixes at the surface.

    AUVs that steer by fixes, or are moved from outside, get each at its instant; those of others
    are made when they are asked for.
    """
    asked, end = setup.scenario.navigation.gnss_fix, float(setup.scenario.duration_s)
    assert asked is not None
    receivers = GnssReceivers(auvs, asked, end, streams, record.gnss_fixes)
    deliveries.gnss = receivers
    if not auvs.foreseen:
        env.process(deliver_each(env, deliveries, receivers.every_s, end))


def deliver_each(
    env: simpy.Environment, deliveries: Deliveries, every_s: float, end: float
) -> Generator[simpy.Event, None, None]:
    """Deliver fixes at each multiple of `every_s` (s) before an end (s)."""
    for number in count(1):
        if (instant := number * every_s) >= end:
            return
        yield moment(env, instant)
        deliveries.deliver(instant)


def _moved(setup: Setup, source: PoseSource, step_s: float) -> dict[str, VehicleFleet]:
    """Return the fleets that an outside program moves, by "auvs" and "asvs"."""
    counts = {"auvs": setup.scenario.auvs.count, "asvs": setup.scenario.asvs.count}
    ahead = setup.afterwards_s
    poses = Poses(source, step_s, counts, setup.scenario.duration_s + ahead, ahead)
    return {kind: posed(poses, kind, counts[kind]) for kind in poses.kinds}


def _network(
    env: simpy.Environment,
    setup: Setup,
    auvs: VehicleFleet,
    asvs: VehicleFleet,
    navigator: Navigator,
    record: Recorder,
    streams: Streams,
) -> Network:
    """Return both bands and the surface fleet."""
    slots, protocol, mf = setup.slots, setup.scenario.protocol, setup.scenario.acoustics.mf
    uplink = HfBand(*_on_hf(setup, auvs, asvs, record, streams))
    given = env, auvs, asvs, navigator, record
    named: Any = {
        "band": frame_band(setup, streams), "clock": slots.clock, "streams": streams,
        "ping_s": slots.ping_duration,
    }  # fmt: skip
    acknowledged = exchange = repeating = replies = answers = None
    if protocol.acknowledge != "none":
        acknowledged = Acknowledged(record.fixes, len(auvs))
    if protocol.exchanges:
        exchange = Exchange(
            *given, **named, behind=slots.behind, acknowledged=acknowledged,
            by_ping=protocol.acknowledge == "ping", asked={*protocol.relays(len(auvs))},
        )  # fmt: skip
    if protocol.most_repeats != 0:
        repeating = Repeating(record.fixes, protocol.most_repeats, acknowledged)
    deliveries = exchange or MfDownlink(*given, **named)
    measuring = _measuring(setup, record, streams)
    decided = AnsweredOutcomes if protocol.replies else Outcomes
    outcomes = decided(uplink, measuring, strayed(setup, auvs), record)
    if protocol.deafens_asvs:
        deliveries.deafens = uplink.sounds
    if protocol.duplex == "per_node":
        uplink.on_ping.append(deliveries.deafen)
        if exchange is not None:
            exchange.deafens_auvs = uplink.sounds
    if protocol.replies:
        message = slots.messages.packed(1)[0] if protocol.replies_in_frames else None
        replies = Replies(env, outcomes, deliveries, record, message, setup.reply_delay_s)
    if setup.schedule.calls:
        answers = Answers(env, outcomes, record, slots)
    launched = places(auvs.motion, 0.0)[:, :3]
    network = Network(
        env,
        slots,
        auvs,
        asvs,
        record,
        uplink,
        outcomes,
        deliveries,
        ranging_of(protocol, setup.scenario.auvs.ping_late_s, env, uplink, streams, answers),
        downlink=checked_part(DOWNLINK, protocol.downlink, checked_round),
        frame_s=protocol.frame_s if setup.schedule.framed else 0.0,
        schedule=checked_part(SCHEDULE, protocol.schedule, checked_groups),
        schedule_draw=streams.of(Purpose.SCHEDULE),
        broadcaster=checked_part(BROADCASTER, protocol.broadcaster, checked_choice),
        broadcaster_draw=streams.of(Purpose.BROADCASTER),
        mf_range=mf.range_m,
        mf_slant=mf.range_metric == "slant",
        positions=PredictedPositions(
            auvs, asvs, uplink.band, protocol.conflict_margin_m, prediction_of(setup, launched),
            record.fixes, setup.land,
        ),
        estimates=known_of(setup, auvs, record),
        answers=answers,
        replies=replies,
        exchange=exchange,
        acknowledged=acknowledged,
        repeating=repeating,
    )  # fmt: skip
    if (traffic := setup.scenario.traffic) is not None:
        hf = setup.scenario.acoustics.hf
        network.data = Data(
            env, uplink, record, streams, traffic, lasts_s=packet_s(hf, traffic), gap_s=gap_s(hf)
        )
        uplink.on_ping.append(network.data.follow)
    if setup.tells_slots:
        network.dissemination = dissemination_of(setup, network, streams)
    return network


def dissemination_of(setup: Setup, network: Network, streams: Streams) -> Dissemination:
    """Return the dissemination of slots by frames."""
    protocol, count = setup.scenario.protocol, setup.scenario.auvs.count
    ahead = setup.downlink.tells_ahead
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
    setup: Setup,
    auvs: VehicleFleet,
    asvs: VehicleFleet,
    navigator: Navigator,
    record: Recorder,
    streams: Streams,
) -> PassiveNetwork:
    """Return the HF band on which ASVs ping, and the AUVs that fix themselves."""
    band = BeaconBand(*_on_hf(setup, auvs, asvs, record, streams))
    outcomes = OwnOutcomes(band, _measuring(setup, record, streams), streams, record)
    fixes = OwnFixes(env, auvs, navigator, record, outcomes)
    return PassiveNetwork(env, setup.slots, auvs, asvs, record, band, outcomes, fixes)


def _measuring(setup: Setup, record: Recorder, streams: Streams) -> Measuring:
    """Return how the fleet of a scenario measures pings."""
    usbl = setup.scenario.usbl
    instrument: Sequence[Usbl] | UsblWithErrors | OwnInstrument | None = instrument_named(
        usbl.model
    )
    counts, slow = (setup.scenario.auvs.count, setup.scenario.asvs.count), None
    if instrument is None:
        systematic = systematic_errors_of(setup, streams)
        fleet = setup.scenario.asvs
        carried = setup.usbls if fleet.groups else (setup.usbl,) * max(fleet.count, 1)
        instrument = carried if systematic is None else UsblWithErrors(carried, systematic)
        elements = max(map(len, map(attrgetter("array"), carried)))
        slow = slow_numbers(usbl.slow_share, usbl.correlation_s, elements, streams, *counts)
    rates, sd = None, usbl.range_rate_sd_m_per_s
    if sd is not None:
        scale = setup.assumed_sound_speed_m_per_s / setup.sound_speed_m_per_s
        passive = setup.scenario.protocol.asvs_ping
        rates = RangeRates(sd, scale, streams, *counts, asvs_ping=passive)
    return Measuring(instrument, streams, *counts, record, slow, rates)


def _on_hf(
    setup: Setup, auvs: VehicleFleet, asvs: VehicleFleet, record: Recorder, streams: Streams
) -> tuple[Any, ...]:
    """Return the arguments of the HF band (:class:`HfBand`), whether AUVs or ASVs ping."""
    hf, bursts = setup.scenario.acoustics.hf, None
    if hf.burst_s is not None:
        bursts = pairs(hf.burst_s, streams, Purpose.BURST, len(auvs), len(asvs))
    channel, band, land = setup.ping_channel or setup.ping_loss, setup.hf_band, setup.land
    if land is not None:
        channel = shadowed(setup.ping_channel or AskedDisc(setup.ping_loss, band.slant), land)
    return auvs, asvs, band, channel, streams, record, bursts, hf.doppler_limit_m_per_s, land


def frame_band(setup: Setup, streams: Streams) -> FrameBand:
    """Return what holds for all frames of the downlink."""
    channel, mf = setup.frame_channel, setup.scenario.acoustics.mf
    if setup.land is not None:
        channel = in_shadow(channel, mf.range_metric == "slant", setup.land)
    capture = math.inf if channel is None else channel(1, 1.0).receiver.capture
    counts = setup.scenario.auvs.count, setup.scenario.asvs.count
    return FrameBand(
        mf.range_m,
        setup.sound_speed_m_per_s,
        channel,
        capture,
        None if mf.burst_s is None else pairs(mf.burst_s, streams, Purpose.FRAME_BURST, *counts),
        mf.range_metric == "slant",
        mf.doppler_limit_m_per_s,
    )
