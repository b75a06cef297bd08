"""The world of one mission: vehicles, bands and fleet as a scenario describes them."""

from dataclasses import dataclass

import numpy as np
import simpy
from numpy.typing import NDArray

from .acoustics import COMBINERS, LOSS_LAWS, contention_loss
from .boards import Board, Frame, ReplyBoard
from .broadcasters import BROADCASTERS, Choice
from .chart import Chart, chart_of
from .conflicts import hearing, survey
from .dead_reckoning import DeadReckoning
from .downlink import MfDownlink
from .fleet import Fleet
from .hydrophones import ARRAYS
from .launch import board_auvs, launch_asvs, launch_auvs
from .motion import places
from .navigation import Navigator
from .ranging import OneWay, TwoWay, strayed
from .reception import Loss
from .recorder import Recorder
from .scenario import Scenario
from .schedules import Schedule, View, is_framed, schedule_named
from .slots import (
    Clock,
    ExactClock,
    Slots,
    TickClock,
    crossing_time,
    longest_way,
    two_way_uplink_slot,
    uplink_slot,
)
from .streams import Purpose, Streams
from .uplink import Uplink
from .usbl import Usbl
from .voyages import Water, velocity_biases, walks


@dataclass
class World:
    """Everything that takes part in a mission, and what the fleet knows of it."""

    env: simpy.Environment
    scenario: Scenario
    slots: Slots
    auv_fleet: Fleet
    asv_fleet: Fleet
    reckoning: DeadReckoning
    navigator: Navigator
    record: Recorder
    board: Board | ReplyBoard
    uplink: Uplink
    downlink: MfDownlink
    ranging: OneWay | TwoWay
    schedule: Schedule
    broadcaster: Choice
    streams: Streams
    frame: float
    downlink_free_at: float = 0.0

    def __post_init__(self) -> None:
        self._schedule_draw = self.streams.of(Purpose.SCHEDULE)
        self._broadcaster_draw = self.streams.of(Purpose.BROADCASTER)
        self._chart = chart_of(self.scenario, places(self.auv_fleet.motion, 0.0)[:, :3])
        self._fixes_plotted = 0

    @property
    def policy(self) -> str:
        """Name of the downlink policy."""
        return self.scenario.protocol.downlink

    def view(self, round_number: int, time: float) -> View:
        """Return what the fleet knows when it schedules a round."""
        hf, asvs = self.scenario.acoustics.hf, self.asv_fleet.motion
        if self._chart is None:
            self.auv_fleet.reach(time)
            seen = survey(self.auv_fleet.motion, asvs, time, hf.range_m, hf.range_metric)
        else:
            plot, own = self._plotted(self._chart, time), places(asvs, time)[:, :3]
            seen = plot, own, hearing(plot, own, hf.range_m, hf.range_metric)
        return View(round_number, time, *seen, hf.range_m, hf.range_metric, self._schedule_draw)

    def _plotted(self, chart: Chart, time: float) -> NDArray[np.float64]:
        """Return where the fleet believes the AUVs to be, by all fixes made so far."""
        chart.note(self.record.fixes.rows[self._fixes_plotted :])
        self._fixes_plotted = self.record.fixes.count
        return chart.at(time)

    def depth_noise(self, auv: int, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the pressure sensor's errors (m) at instants (s); equal at equal IMU samples."""
        navigation = self.scenario.navigation
        index = (times * navigation.imu_rate_hz).astype(np.intp)
        stream = self.streams.of(Purpose.DEPTH, auv)
        return stream.standard_normal(int(index[-1]) + 1)[index] * navigation.depth_sd_m

    def next_broadcaster(self, frame: Frame, time: float) -> int:
        """Choose the ASV of the next broadcast."""
        number = len(self.record.broadcasts)
        return self.broadcaster(number, frame, self.asv_fleet, time, self._broadcaster_draw)


def build_world(env: simpy.Environment, scenario: Scenario, seed: int) -> World:
    """Put the world of a scenario together, at rest at time 0."""
    streams, slots = Streams(seed), slots_of(scenario)
    record = Recorder(everything=scenario.record.detail == "full")
    water = Water(scenario, streams)
    lost = walks(scenario, streams, water)
    biases = velocity_biases(scenario, streams)
    auvs = launch_auvs(scenario, water, lost, biases)
    asvs = launch_asvs(scenario, streams, water)
    reckoning, navigator = board_auvs(scenario, auvs, lost, biases)
    sound_speed, hf = scenario.environment.sound_speed_m_per_s, scenario.acoustics.hf
    uplink = Uplink(
        auvs,
        asvs,
        hf_range=hf.range_m,
        metric=hf.range_metric,
        ping_duration=hf.ping_s,
        sound_speed=sound_speed,
        loss=loss_of(scenario),
        usbl=usbl_of(scenario),
        strayed=strayed(scenario, auvs),
        streams=streams,
        record=record,
    )
    downlink = MfDownlink(
        env,
        auvs,
        asvs,
        navigator,
        record,
        mf_range=scenario.acoustics.mf.range_m,
        sound_speed=sound_speed,
        clock=slots.clock,
    )
    board = (
        ReplyBoard(env, uplink, downlink, record, reply_delay_of(scenario))
        if scenario.protocol.downlink == "direct_reply"
        else Board(uplink, record)
    )
    ranging = (
        OneWay(uplink, board)
        if scenario.protocol.ranging == "owtt_sync"
        else TwoWay(env, uplink, board, turnaround=scenario.protocol.turnaround_s)
    )
    schedule = schedule_named(scenario.protocol.schedule)
    framed = is_framed(scenario.protocol.schedule, schedule)
    return World(
        env, scenario, slots, auvs, asvs, reckoning, navigator, record, board, uplink, downlink,
        ranging, schedule, BROADCASTERS[scenario.protocol.broadcaster], streams,
        scenario.protocol.frame_s if framed else 0.0,
    )  # fmt: skip


def clock_of(scenario: Scenario) -> Clock:
    """Return the clock on which slots start and fixes are delivered."""
    rate = scenario.protocol.tick_rate_hz
    return ExactClock() if rate is None else TickClock(rate)


def slots_of(scenario: Scenario) -> Slots:
    """Derive every duration of the protocol from the survey and the bands."""
    sound_speed = scenario.environment.sound_speed_m_per_s
    hf, mf = scenario.acoustics.hf, scenario.acoustics.mf
    crossing = crossing_time(scenario.survey.side_m, sound_speed)
    longest = longest_way(hf.range_m, scenario.survey.depth_m, hf.range_metric) / sound_speed
    slot = (
        uplink_slot(hf.ping_s, longest, crossing)
        if scenario.protocol.ranging == "owtt_sync"
        else two_way_uplink_slot(hf.ping_s, longest, scenario.protocol.turnaround_s, crossing)
    )
    return Slots(
        crossing, hf.ping_s, longest, slot, mf.header_bytes, mf.fix_bytes, mf.bit_rate_bps,
        mf.overhead, clock_of(scenario),
    )  # fmt: skip


def usbl_of(scenario: Scenario) -> Usbl:
    """Return the USBL instrument that every ASV carries."""
    usbl = scenario.usbl
    roll, pitch, heading = np.radians((usbl.roll_sd_deg, usbl.pitch_sd_deg, usbl.heading_sd_deg))
    return Usbl(
        ARRAYS[usbl.array],
        usbl.tdoa_sd_s,
        usbl.travel_time_sd_s,
        usbl.quantum_s,
        (float(roll), float(pitch), float(heading)),
        usbl.gnss_sd_m,
        scenario.environment.sound_speed_m_per_s,
    )


def reply_delay_of(scenario: Scenario) -> float:
    """Return how long after a ping's front an ASV answers it (s)."""
    return scenario.acoustics.hf.ping_s if scenario.protocol.reply_at == "ping_end" else 0.0


def loss_of(scenario: Scenario) -> Loss:
    """Return how likely a ping is lost on its way."""
    loss = scenario.acoustics.loss
    law = LOSS_LAWS[loss.law]
    return Loss(
        np.array((law.a, law.b, law.c, law.d)),
        list(COMBINERS).index(loss.combine),
        contention_loss(scenario.auvs.count, loss.contention_per_auv),
        loss.cap,
    )
