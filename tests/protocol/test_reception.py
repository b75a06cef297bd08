"""Pings and frames between vehicles that move, worked by hand."""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from statistics import NormalDist
from typing import Any

import numpy as np
import pytest
import simpy
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds import QUIET_NAVIGATION, QUIET_USBL, blank, fixed_gain, scenario, still

from bindusbl_des import simulate
from bindusbl_des.acoustics.loss import LOSS_LAWS, LossTerms, range_loss
from bindusbl_des.acoustics.messages import Message
from bindusbl_des.acoustics.propagation import SignalBand
from bindusbl_des.acoustics.travel_time import travel_time, travel_time_to
from bindusbl_des.core.clock import Clock, ExactClock, TickClock
from bindusbl_des.core.streams import ROWS, NoiseStore, Purpose, Streams
from bindusbl_des.navigation.dead_reckoning import DeadReckoning, random_walk
from bindusbl_des.protocol.broadcasters import hearers
from bindusbl_des.protocol.hf.band import NO_CALL, HfBand
from bindusbl_des.protocol.hf.calling import CALL
from bindusbl_des.protocol.hf.outcomes import Measuring, Outcomes
from bindusbl_des.protocol.hf.reception import Air, overlapped
from bindusbl_des.protocol.mf.downlink import FrameBand, MfDownlink
from bindusbl_des.protocol.replies import Replies
from bindusbl_des.records.events import (
    COLLIDED,
    DELIVERED,
    HEARD,
    IN_FLIGHT,
    LOST,
    OUT_OF_RANGE,
    Fix,
    Round,
)
from bindusbl_des.records.rows import CALLED, FIX, NONE, ROOM, SIGHT, EventBuffer, Recorder
from bindusbl_des.records.rows import PING as PING_ROW
from bindusbl_des.usbl.array import ARRAYS
from bindusbl_des.usbl.instrument import Usbl
from bindusbl_des.usbl.measuring import NOISE_WIDTH
from bindusbl_des.vehicles.fleet import VehicleFleet
from bindusbl_des.vehicles.motion import distance_at, lines, places, together
from bindusbl_des.vehicles.reckoning import steady
from bindusbl_des.vehicles.vehicle import Place, SegmentedTrajectory, moored, recorded

SOUND = 1500.0  # m/s
PING = 0.01  # s
QUIET = LossTerms(np.zeros(5), 2, 0.0, 0.999)
PERFECT = Usbl(ARRAYS["oem5"], 0.0, 0.0, 0.0, (0.0, 0.0, 0.0), 0.0, SOUND)


def at(x: float, y: float = 0.0, z: float = 0.0) -> SegmentedTrajectory:
    """Return a vehicle that keeps its place (m)."""
    return moored(Place(x, y, z, 0.0))


def moving(x: float, speed: float, y: float = 0.0, z: float = 0.0) -> SegmentedTrajectory:
    """Return a vehicle that goes along x for 100 s, at `x` (m) at 0 s."""
    return recorded(np.array([0.0, 100.0]), np.array([[x, y, z], [x + 100.0 * speed, y, z]]))


def fleet(*vehicles: SegmentedTrajectory) -> VehicleFleet:
    """Return vehicles whose way is known."""
    return VehicleFleet(vehicles, together([vehicle.legs for vehicle in vehicles]))


def uplink(
    auvs: VehicleFleet, asvs: VehicleFleet, record: Recorder | None = None, **changes: Any
) -> tuple[HfBand, Outcomes, Recorder]:
    """Return a quiet HF band of 3 km between two fleets, what becomes of its pings, the record."""
    record, streams = record or Recorder(), changes.pop("streams", Streams(1))
    reach, slant = changes.pop("hf_range", 3000.0), changes.pop("slant", True)
    instrument = changes.pop("instrument", PERFECT)
    law = SignalBand(slant, reach, PING, SOUND)
    band = HfBand(auvs, asvs, law, changes.pop("channel", QUIET), streams, record)
    measuring = Measuring(instrument, streams, len(auvs), len(asvs), record)
    return band, Outcomes(band, measuring, np.zeros(len(auvs)), streams, record), record


def test_a_ping_is_measured_from_where_the_vessel_is_when_it_arrives() -> None:
    """A vessel that has moved 10 m while the ping was under way finds it where it was sent."""
    # 15 m/s away from a ping sent 990 m behind: caught up with after 2/3 s, 1000 m away
    band, outcomes, record = uplink(fleet(at(-990.0, z=0.0)), fleet(moving(0.0, 15.0)))
    band.send(0, 0, [0], 0.0)
    assert outcomes.resolve_passed(1.0) == range(1)
    [fix] = record.fixes.rows
    found = record.receptions.rows[0]
    found = found["arrived_at_s"], found["slant_range_m"], found["travel_time_s"]
    assert found == pytest.approx((2 / 3, 1000.0, 2 / 3))
    assert fix["x_m"] == pytest.approx(-990.0, abs=0.01)
    assert fix["error_m"] < 0.01


def test_a_turning_vessel_measures_by_its_heading_at_the_arrival() -> None:
    """A vessel that turns from +x to +y while a ping is under way still finds it."""
    turns = recorded(np.array([0.0, 0.3, 1.0]), np.array([[0, 0, 0], [3, 0, 0], [3, 7, 0.0]]))
    band, outcomes, record = uplink(fleet(at(600.0, 300.0, 50.0)), fleet(turns))
    band.send(0, 0, [0], 0.0)
    assert outcomes.resolve_passed(1.0) == range(1)
    [fix] = record.fixes.rows
    assert [fix["x_m"], fix["y_m"], fix["z_m"]] == pytest.approx([600.0, 300.0, 50.0], abs=0.1)


@dataclass
class Steered:
    """A voyage that has been told where to go only as far as somebody has asked."""

    reached: float = 0.0

    def advance(self, time: float) -> None:
        self.reached = max(self.reached, time)


def steered(auvs: VehicleFleet) -> VehicleFleet:
    """Return the fleet as one whose way is known only as far as somebody has asked."""
    return VehicleFleet(auvs.vehicles, auvs.motion, Steered())  # type: ignore[arg-type]


def downlink(
    env: simpy.Environment, auvs: VehicleFleet, asvs: VehicleFleet, record: Recorder, **changes: Any
) -> MfDownlink:
    """Return an MF band of 500 m on the exact clock to AUVs that know where they are."""
    walks, sums = np.zeros((len(auvs), 2, 2)), np.zeros((len(auvs), 2))
    reckoning = DeadReckoning(auvs.motion, steady(walks, 1.0, (0.0, 0.0), False))
    return MfDownlink(env, auvs, asvs, **{
        "navigator": fixed_gain(reckoning, 0.5, "none", sums), "record": record,
        "band": FrameBand(500.0, SOUND, None), "clock": ExactClock(), "streams": Streams(1),
        **changes,
    })  # fmt: skip


# Receivers that tell all frames apart that arrive at once
HEARS_ALL = FrameBand(500.0, SOUND, None, capture=0.0)


def lasting(airtime: float) -> Message:
    """Return a message that is on the air for so long (s)."""
    return Message(0, 0, 0, airtime, 0.0)


def made(record: Recorder, auv: int, pinged_at: float, x: float, y: float = 0.0) -> range:
    """Put a fix (m) of an AUV's ping (s) on record; return its row."""
    fixes = record.fixes
    fixes.room_for(1)[fixes.count] = blank(FIX, 1)[0]
    row = fixes.array[fixes.count]
    row["auv"], row["outcome"] = auv, IN_FLIGHT
    row["pinged_at_s"] = row["valid_at_s"] = pinged_at
    row["x_m"], row["y_m"] = x, y
    fixes.count += 1
    return range(fixes.count - 1, fixes.count)


@pytest.fixture(params=["foreseen", "steering"])
def frames(request: pytest.FixtureRequest) -> Callable[..., Fix]:
    """Return a function that sends a frame from ASV to AUV and returns the fix afterwards.

    It is 3 m and 4 m from where the AUV was when it pinged, 2 s before the frame.
    """

    def send(
        asv: SegmentedTrajectory, auv: SegmentedTrajectory, airtime: float, *, time: float = 0.0
    ) -> Fix:
        env, auvs, record = simpy.Environment(time), fleet(auv), Recorder()
        if request.param == "steering":
            auvs = steered(auvs)
        band = downlink(env, auvs, fleet(asv), record)
        pinged_from = auv.at(time - 2.0)
        fix = made(record, 0, time - 2.0, pinged_from.x + 3.0, pinged_from.y + 4.0)
        band.send(0, np.array(fix), 0, time, lasting(airtime))
        assert auvs.foreseen or auvs.guided.reached == time  # type: ignore[union-attr]
        env.run()
        band.settle(100.0)
        row = record.fixes.rows[0]
        return Fix(**{it.name: row[it.name] if it.name != "asvs" else "" for it in fields(Fix)})

    return send


def test_a_frame_comes_from_where_its_sender_ends_it(frames: Callable[..., Fix]) -> None:
    """A vessel at 20 m/s ends a frame of 2 s 40 m nearer to the AUV than it began it."""
    fix = frames(moving(0.0, 20.0), at(340.0), 2.0, time=5.0)
    assert fix.outcome == DELIVERED
    assert fix.delivered_at_s == pytest.approx(5.0 + 2.0 + (340 - 140) / SOUND, abs=1e-12)
    assert fix.latency_s == pytest.approx(fix.delivered_at_s - 3.0)
    assert (fix.broadcast_at_s, fix.broadcast_by, fix.innovation_m) == (5.0, 0, 5.0)


def test_a_frame_ends_where_its_receiver_is_by_then(frames: Callable[..., Fix]) -> None:
    """An AUV that runs away at 20 m/s is caught up with where it is when the frame ends."""
    fix = frames(at(0.0), moving(300.0, 20.0), 2.0)
    # 1500 t = 340 + 20 t
    assert fix.delivered_at_s == pytest.approx(2.0 + 340 / 1480, abs=1e-12)


def test_a_frame_reaches_whom_it_finds_in_range_as_it_begins(frames: Callable[..., Fix]) -> None:
    """The MF range is horizontal, its edge counts, and what comes later does not."""
    assert frames(at(0.0), at(300.0, 400.0, 900.0), 1.0).outcome == DELIVERED
    assert frames(moving(0.0, -20.0), at(499.0), 1.0).outcome == DELIVERED
    assert frames(moving(0.0, 20.0), at(501.0), 1.0).outcome == OUT_OF_RANGE
    assert frames(at(0.0), moving(501.0, -20.0), 1.0).outcome == OUT_OF_RANGE
    late = frames(moving(0.0, 20.0), at(540.0), 1.0, time=3.0)
    assert late.delivered_at_s == pytest.approx(4.0 + (540 - 80) / SOUND)


def test_the_first_to_decode_a_ping_answers_from_where_it_heard_it() -> None:
    """An answer sets out from the vessel where the ping met it, to where the AUV will be."""
    env, record = simpy.Environment(), Recorder()
    band = downlink(env, fleet(moving(0.0, -30.0)), fleet(moving(600.0, 30.0)), record)
    met = 600 / 1470  # 1500 t = 600 + 30 t
    [fix] = made(record, 0, 0.0, 0.0)
    band.reply(0, fix, 0, met)
    band.settle(100.0)
    latency = record.fixes.rows["latency_s"][fix]
    assert latency == pytest.approx(met + (1500 * met + 30 * met) / 1470, abs=1e-12)


@pytest.mark.parametrize("steers", [False, True])
def test_fixes_are_applied_in_the_order_of_their_arrival(steers: bool) -> None:
    """A frame from nearby overtakes an earlier one from afar, though both have fixes for others."""
    env, record = simpy.Environment(), Recorder()
    auvs, asvs = fleet(at(0.0), at(-480.0)), fleet(at(450.0), at(-15.0))
    sums = np.zeros((2, 2))
    reckoning = DeadReckoning(auvs.motion, steady(np.zeros((2, 2, 2)), 1.0, (0.0, 0.0), False))
    band = downlink(
        env, steered(auvs) if steers else auvs, asvs, record,
        navigator=fixed_gain(reckoning, 0.5, "none", sums), band=HEARS_ALL,
    )  # fmt: skip
    first = np.array(made(record, 0, 0.0, 8.0))
    band.send(0, first, 0, 0.0, lasting(0.5))  # AUV0 has it 450 m later, at 0.8 s

    def second() -> Any:
        yield env.timeout(0.1)  # AUV0 has it after 15 m, at 0.61 s, AUV1 after 465 m, at 0.91 s
        rows = range(made(record, 0, 0.0, 4.0).start, made(record, 1, 0.0, -476.0).stop)
        band.send(0, np.array(rows), 1, 0.1, lasting(0.5))

    env.process(second())
    env.run()
    band.settle(100.0)
    fixes = record.fixes.rows
    assert fixes["delivered_at_s"] == pytest.approx([0.8, 0.61, 0.91], abs=1e-12)
    # 4 m: half of it; then 8 m, of which 6 are left: half of them.  As sent it would have been 4.
    assert fixes["innovation_m"].tolist() == [6.0, 4.0, 4.0]
    assert fixes["correction_m"].tolist() == [3.0, 2.0, 2.0]
    assert sums.tolist() == [[5.0, 0.0], [2.0, 0.0]]


def frames_received(
    seed: int, way: str, clock: Clock, compensation: str
) -> tuple[np.ndarray, np.ndarray]:
    """Return the fixes of twelve frames that overtake each other, and the sums of corrections.

    They go as they are (`way` "frames"), with each fix in a frame of its own ("apart"), or to AUVs
    that steer by them ("steering").
    """
    draw = np.random.default_rng(seed)
    env, record = simpy.Environment(), Recorder()
    auvs = fleet(*[moving(*draw.uniform((-2000, -2, -50, 0), (2000, 2, 50, 90))) for _ in range(5)])
    asvs = fleet(*[moving(*draw.uniform((-2000, -2), (2000, 2))) for _ in range(3)])
    sums = np.zeros((5, 2))
    walks = random_walk(10.0, 0.3, draw.standard_normal((5, 100, 2)))
    reckoning = DeadReckoning(auvs.motion, steady(walks, 10.0, (0.5, -0.2), True))
    band = downlink(
        env, steered(auvs) if way == "steering" else auvs, asvs, record,
        band=HEARS_ALL._replace(reach=3000.0),
        navigator=fixed_gain(reckoning, 0.7, compensation, sums), clock=clock,
    )  # fmt: skip

    def send() -> Any:
        for time in np.sort(draw.uniform(0.2, 6.0, 12)).tolist():
            yield env.timeout(time - env.now)
            group = draw.permutation(5)[: draw.integers(1, 6)]
            rows = [made(record, auv, time - 0.2, *draw.uniform(-9, 9, 2)).start for auv in group]
            asv, airtime = int(draw.integers(3)), float(draw.uniform(0.1, 0.9))
            for row in rows if way == "apart" else rows[:1]:
                carried = np.arange(row, row + 1 if way == "apart" else rows[-1] + 1)
                band.send(0, carried, asv, time, lasting(airtime))

    env.process(send())
    env.run()
    band.settle(100.0)
    fixes = record.fixes.rows
    fixes["frame"] = NONE  # they are numbered otherwise where each fix has its own
    return fixes, sums


@pytest.mark.parametrize("compensation", ["none", "shift"])
@pytest.mark.parametrize("clock", [ExactClock(), TickClock(7.0)], ids=["exact", "ticks"])
def test_a_frames_fixes_are_as_good_as_events_of_their_own(clock: Clock, compensation: str) -> None:
    """Fixes settled together are left as an event for each leaves them, bit for bit."""
    overtaken = 0
    for seed in range(20):
        fixes, sums = frames_received(seed, "frames", clock, compensation)
        apart, sums_apart = frames_received(seed, "apart", clock, compensation)
        assert fixes.tobytes() == apart.tobytes()
        assert np.array_equal(sums, sums_apart)
        steering, _ = frames_received(seed, "steering", clock, compensation)
        for name in fixes.dtype.names:
            expected = pytest.approx(steering[name], rel=1e-12, abs=1e-9, nan_ok=True)
            assert fixes[name] == expected, name
        for auv in range(5):
            own = fixes[(fixes["auv"] == auv) & (fixes["outcome"] == DELIVERED)]
            overtaken += int((np.diff(own["delivered_at_s"]) < 0).sum())
    assert overtaken > 50


def test_pings_of_earlier_slots_collide_with_later_ones() -> None:
    """A ping from afar meets one sent a second later from nearby; those between are over."""
    band, outcomes, record = uplink(
        fleet(at(1500.0), at(0.0, 150.0), at(15.0, 0.0)), fleet(at(0.0))
    )
    decided = []
    for auv, time in ((0, 0.0), (1, 0.5), (2, 0.995)):
        decided += outcomes.resolve_passed(time)
        band.send(0, auv, [auv], time)
    decided += outcomes.resolve_passed(1.5)
    assert record.receptions.rows["arrived_at_s"] == pytest.approx([1.0, 0.6, 1.005])
    assert record.receptions.rows["outcome"].tolist() == [COLLIDED, HEARD, COLLIDED]
    assert decided == [0]
    assert record.fixes.rows["auv"].tolist() == [1]


def test_no_ping_is_decided_before_it_is_over() -> None:
    """A ping that has arrived is not decided while another that is sent now could overlap it."""
    band, outcomes, record = uplink(fleet(at(1500.0), at(3.0)), fleet(at(0.0)))
    for auv, time in ((0, 0.0), (1, 1.005), (0, 2.0)):
        assert outcomes.resolve_passed(time) == range(0)
        band.send(0, 0, [auv], time)
    assert outcomes.resolve_passed(math.nextafter(3.0 + PING, 0.0)) == range(0)
    assert record.receptions.rows["outcome"].tolist() == [COLLIDED, COLLIDED, IN_FLIGHT]
    assert outcomes.resolve_passed(3.0 + PING) == range(1)
    assert record.fixes.rows["pinged_at_s"].tolist() == [2.0]


def test_nobody_answers_before_a_ping_is_over() -> None:
    """A ping overlapped by one that is sent after it has begun to arrive gets no answer."""
    env, record = simpy.Environment(), Recorder(rounds=[Round(0, 0.0, 1, 0)])
    auvs, asvs = fleet(at(1500.0), at(3.0)), fleet(at(0.0))
    band, outcomes, _ = uplink(auvs, asvs, record)
    near = downlink(env, auvs, asvs, record, band=FrameBand(1.0, SOUND, None))
    band.answered_by = Replies(env, outcomes, near, record, None, PING).expect

    def pings() -> Any:
        for auv, time in ((0, 0.0), (1, 1.005), (1, 2.0)):
            yield env.timeout(time - env.now)
            band.send(0, 0, [auv], time)

    env.process(pings())
    env.run()
    assert record.receptions.rows["outcome"].tolist() == [COLLIDED, COLLIDED, HEARD]
    assert record.fixes.rows["pinged_at_s"].tolist() == [2.0]
    assert record.rounds[0].fixes == len(record.broadcasts) == 1


# Any sound that overlaps another destroys it, and levels are not known
ANY = (math.inf, 0.0)


def test_overlaps_are_found_with_pings_sent_later_as_well_as_earlier() -> None:
    """Two pings that meet at an ASV do so for both; what was sent between them meets neither."""
    auvs = fleet(at(1500.0), at(0.0, 150.0), at(15.0), at(0.0, 30.0))
    band, _, record = uplink(auvs, fleet(at(0.0)))
    for auv, time in enumerate((0.0, 0.5, 0.995, 1.0)):
        band.send(0, 0, [auv], time)
    pings, receptions = record.pings.rows, record.receptions.rows
    assert receptions["arrived_at_s"] == pytest.approx([1.0, 0.6, 1.005, 1.02])
    calls = np.empty(0, dtype=CALL)
    air = Air(pings, receptions, calls, PING, *ANY)
    found = [overlapped(row, air, None) for row in range(4)]
    assert found == [True, False, True, False]
    sooner = Air(pings, receptions[:2], calls, PING, *ANY)  # none sent later yet
    assert [overlapped(row, sooner, None) for row in range(2)] == [False, False]


@settings(max_examples=200, deadline=None)
@given(
    pings=st.lists(st.tuples(st.integers(0, 400), st.integers(-200, 200)), min_size=2, max_size=30),
    vessels=st.lists(st.integers(-200, 200), min_size=1, max_size=3),
    reach=st.integers(5, 400),
    everything=st.booleans(),
)
def test_overlaps_are_those_that_comparing_all_pairs_finds(
    pings: list[tuple[int, int]], vessels: list[int], reach: int, everything: bool
) -> None:
    """In steps of half a ping and half its length, pings overlap that are less than two apart."""
    pings.sort()
    length = SOUND * PING / 2
    band, _, record = uplink(
        fleet(*[at(length * place) for _, place in pings]),
        fleet(*[at(length * vessel) for vessel in vessels]),
        Recorder(everything), hf_range=length * (reach + 0.5),
    )  # fmt: skip
    arrivals = []
    for auv, (time, place) in enumerate(pings):
        band.send(0, 0, [auv], time * PING / 2)
        ways = [abs(place - vessel) for vessel in vessels]
        arrivals += [
            (asv, time + way, way <= reach)
            for asv, way in enumerate(ways)
            if everything or way <= reach
        ]
    assert record.receptions.count == len(arrivals)
    for row, (asv, comes, heard) in enumerate(arrivals):
        if heard:
            expected = any(
                other_heard and other == asv and abs(other_comes - comes) < 2
                for k, (other, other_comes, other_heard) in enumerate(arrivals)
                if k != row
            )
            calls = np.empty(0, dtype=CALL)
            air = Air(record.pings.rows, record.receptions.rows, calls, PING, *ANY)
            assert expected == overlapped(row, air, None)


NOISY = Usbl(ARRAYS["oem5"], 1e-6, 1e-5, 1e-6, (0.01, 0.01, 0.02), 0.5, SOUND)
LOSSY = LossTerms(LOSS_LAWS["head"].coefficients, 2, 0.2, 0.9)


def heard_by_a_busy_fleet(seed: int, instants: Callable[[float], list[float]]) -> Recorder:
    """Return the record of 120 slots of pings that meet, decided at `instants` of each slot (s).

    They are asked for by the start of the next slot; what is left is decided after the last.
    """
    draw = np.random.default_rng(seed)
    auvs = fleet(*[moving(*draw.uniform((-900, -2, -90, 0), (900, 2, 90, 90))) for _ in range(6)])
    asvs = fleet(*[moving(*draw.uniform((-900, -2), (900, 2))) for _ in range(3)])
    band, outcomes, record = uplink(
        auvs, asvs, hf_range=1200.0, channel=LOSSY, instrument=NOISY, streams=Streams(seed)
    )
    decided, time = [], 0.0
    for slot in range(120):
        group = draw.permutation(6)[: draw.integers(1, 7)].tolist()
        caller = int(draw.integers(-1, 3))
        call = np.array([(time - 0.11, caller, HEARD, NONE, 0.1)], dtype=CALLED)
        band.send(slot // 3, slot % 3, group, time, NO_CALL if caller < 0 else call)
        time += float(draw.choice([0.005, 0.05, 0.3, 1.5]))
        for instant in instants(time):
            decided += outcomes.resolve_passed(instant)
    decided += outcomes.resolve_passed(time + 2.0)
    assert decided == list(range(record.fixes.count))
    return record


def test_deciding_late_equals_deciding_early() -> None:
    """Pings of a busy mission come to the same whether decided at once, now and then or at last."""
    for seed in range(8):
        lot = np.random.default_rng(seed)
        early, some, late = (
            heard_by_a_busy_fleet(seed, instants)
            for instants in (
                lambda time: [time],
                lambda time, lot=lot: [time] if lot.random() < 0.1 else [],
                lambda time: [],
            )
        )
        outcomes = early.receptions.rows["outcome"]
        assert set(outcomes) == {HEARD, OUT_OF_RANGE, LOST, COLLIDED}
        pairs = early.receptions.rows[outcomes != OUT_OF_RANGE][["auv", "asv"]]
        assert np.unique(pairs, return_counts=True)[1].max() > ROWS  # noise was refilled
        assert early.fixes.count > 50
        for other in (some, late):
            for buffer in ("pings", "receptions", "fixes"):
                rows, others = getattr(early, buffer).rows, getattr(other, buffer).rows
                for name in (it for it in rows.dtype.names if not it.startswith("said_")):
                    known = rows["outcome"] == HEARD if name in SIGHT else slice(None)
                    assert rows[name][known].tobytes() == others[name][known].tobytes(), name


def test_a_frame_tells_whose_measurements_made_its_fixes() -> None:
    """For each fix they are the ASVs that heard its ping, whatever others missed."""
    record = heard_by_a_busy_fleet(0, lambda time: [time])
    receptions, rows = record.receptions.rows, range(7, 41)
    fused = hearers(record, rows, 3)
    assert {1, 2, 3} == set(fused.sum(axis=1).tolist())
    for fix, asvs in zip(rows, fused, strict=True):
        of_ping = receptions["ping"] == record.fixes.rows["ping"][fix]
        heard = receptions["asv"][of_ping & (receptions["outcome"] == HEARD)]
        assert np.flatnonzero(asvs).tolist() == heard.tolist()
    assert hearers(record, range(0), 3).shape == (0, 3)


def test_what_is_out_of_range_drowns_nobody() -> None:
    """Sound from beyond the HF range arrives together with a ping, which is heard all the same."""
    band, outcomes, record = uplink(fleet(at(90.0), at(-101.0)), fleet(at(0.0)), hf_range=100.0)
    assert band.send(0, 0, [0, 1], 0.0) == range(2)
    assert outcomes.resolve_passed(1.0) == range(1)
    assert record.receptions.rows["outcome"].tolist() == [HEARD, OUT_OF_RANGE]


def test_at_the_end_what_has_arrived_is_decided_and_the_rest_under_way() -> None:
    """A mission ends between two arrivals: one ASV has heard the ping, but there is no fix yet."""
    band, outcomes, record = uplink(fleet(at(0.0)), fleet(at(1500.0), at(150.0)))
    band.send(0, 0, [0], 0.0)
    assert outcomes.resolve_passed(0.5) == range(0)
    outcomes.close(0.5)
    assert record.receptions.rows["outcome"].tolist() == [IN_FLIGHT, HEARD]
    assert record.pings.rows["heard_by"][0] == 1
    assert record.fixes.count == 0
    # a ping that ends with the mission does not end in it
    band, outcomes, record = uplink(fleet(at(0.0)), fleet(at(1500.0), at(150.0)))
    band.send(0, 0, [0], 0.0)
    outcomes.close(0.1 + PING)
    assert record.receptions.rows["outcome"].tolist() == [IN_FLIGHT] * 2


@pytest.mark.parametrize(
    ("slant", "reach"), [(False, 50.0), (True, 130.0)], ids=["horizontal", "slant"]
)
def test_the_edge_of_the_hf_range_is_within(slant: bool, reach: float) -> None:
    """Pings and calls reach 50 m seen from above, or 130 m in all, and not a hair further."""
    for limit, expected in ((reach, IN_FLIGHT), (math.nextafter(reach, 0.0), OUT_OF_RANGE)):
        auvs = fleet(at(30.0, 40.0, 120.0))
        band, _, record = uplink(auvs, fleet(at(0.0)), slant=slant, hf_range=limit)
        band.send(0, 0, [0], 0.0)
        assert record.receptions.rows["outcome"][0] == expected
        [call] = band.call([0], np.array([0]), 1.0)
        assert call["call"] == (HEARD if expected == IN_FLIGHT else OUT_OF_RANGE)


def test_pings_are_lost_by_their_slant_range() -> None:
    """From 260 m, 100 m of them down, that share is lost whose own number is below the law's."""
    result = simulate(still(
        1, side=20.0, at=240.0, duration_s=600.0, survey={"depth_m": 100.0},
        asvs={"formation": {"positions_m": [[0.0, 0.0]]}},
        acoustics={"hf": {"range_m": 300.0}, "loss": {"law": "head"}},
    ))  # fmt: skip
    outcomes = result.tables["receptions"].outcome.to_numpy()[:-1]  # the last is under way
    assert len(outcomes) > 1000
    noise = Streams(0).of(Purpose.MEASUREMENT, 0, 0).standard_normal((len(outcomes), 13))
    chance = range_loss(260.0, LOSS_LAWS["head"])
    lost = noise[:, NOISE_WIDTH] < NormalDist().inv_cdf(chance)
    assert lost.mean() == pytest.approx(chance, abs=4 * math.sqrt(chance / len(lost)))
    assert (outcomes == np.where(lost, "lost", "heard")).all()


def test_each_pair_draws_its_own_noise_in_order() -> None:
    """The k-th ping of an AUV at an ASV is measured with row k of their stream, past any block."""
    sd = 1e-4  # s
    result = simulate(scenario(
        duration_s=120.0, survey={"side_m": 60.0, "depth_m": 0.0},
        auvs={"count": 2, "route": {"kind": "hold", "positions_m": [[20.0, 0.0], [0.0, 30.0]]}},
        asvs={"count": 2, "formation": {"positions_m": [[500.0, 0.0], [0.0, 0.0]]}},
        acoustics={"loss": {"law": "none"}},
        usbl={**QUIET_USBL, "travel_time_sd_s": sd}, navigation=QUIET_NAVIGATION,
    ), seed=9)  # fmt: skip
    fixes = result.tables["fixes"]
    for auv, name, distance in ((0, "x_m", 20.0), (1, "y_m", 30.0)):
        found = fixes[fixes.auv == f"AUV{auv}"][name].to_numpy()
        assert len(found) > 2 * ROWS
        stream = Streams(9).of(Purpose.MEASUREMENT, auv, 1)
        noise = stream.standard_normal((len(found), NOISE_WIDTH + 1))
        assert found == pytest.approx(distance + SOUND * sd * noise[:, 5], abs=1e-4)


def test_noise_of_many_pairs_is_kept_apart() -> None:
    """Whatever the order in which pairs use up their noise, each continues its own stream."""
    store = NoiseStore(Streams(2), 3, 2, 4)
    for auv, asv in ((0, 0), (2, 1), (0, 0), (1, 0), (2, 1)):
        store.refill(auv, asv)
    for auv, asv, blocks in ((0, 0, 2), (2, 1, 2), (1, 0, 1)):
        drawn = Streams(2).of(Purpose.MEASUREMENT, auv, asv).standard_normal((blocks * ROWS, 4))
        assert np.array_equal(store.blocks[store.shelf[auv, asv]], drawn[-ROWS:])
    assert store.taken.tolist() == [[0, ROWS], [0, ROWS], [ROWS, 0]]


def test_a_ledger_keeps_its_rows_when_it_grows() -> None:
    """Rows beyond the first room are added to those before."""
    buffer = EventBuffer(PING_ROW)
    for number in range(2 * ROOM + 1):
        buffer.room_for(3)[number]["ping"] = number
        buffer.count += 1
        assert len(buffer.array) >= buffer.count
    assert buffer.rows["ping"].tolist() == list(range(2 * ROOM + 1))
    assert len(buffer.room_for(9 * ROOM)) >= 11 * ROOM  # one ping at thousands of ASVs


def test_sound_meets_a_vehicle_as_equations_of_one_vehicle_say() -> None:
    """A known motion is met when `acoustics.travel_time` says; faster than sound, never."""
    bend = recorded(np.array([-3.0, 1.0, 1.2]), np.array([[0, 0, 5], [400, 9, 5], [300, 50, 9.0]]))
    motion = fleet(at(7.0), bend).motion
    for time in (0.0, 0.9, 1.1, 1000.0):
        expected = travel_time((-200.0, 30.0, 2.0), bend.at, time, SOUND)
        assert travel_time_to((-200.0, 30.0, 2.0, 0.0), motion, 1, time, SOUND) == pytest.approx(
            expected, abs=2e-13 + 1e-15 * time
        )
    endless, fast = np.array([0.0, 1e40]), np.array([[1.0, 0, 0], [2e43, 0, 0]])
    motion = fleet(recorded(endless, fast)).motion
    with pytest.raises(ValueError, match="outruns the sound"):
        travel_time_to((0.0, 0.0, 0.0, 0.0), motion, 0, 0.0, SOUND)


def test_a_fleet_is_where_its_vehicles_are() -> None:
    """One vehicle or the fleet, one instant or many: the same places, ways and headings."""
    track = recorded(np.array([2.0, 4.0, 9.0]), np.array([[0, 0, 5], [3, 0, 5], [3, 5, 6.0]]))
    vehicles = (moving(5.0, 2.0, 1.0, 3.0), at(1.0, 2.0, 3.0), track)
    motion, times = fleet(*vehicles).motion, np.array([0.0, 2.0, 3.5, 4.0, 8.0, 200.0])
    for time in times:
        assert places(motion, time).tolist() == [list(vehicle.at(time)) for vehicle in vehicles]
    for number, vehicle in enumerate(vehicles):
        found = lines(*motion, number, times)
        assert found[:, :4].tolist() == vehicle.sample(times).tolist()
        assert found[:, 4:6].tolist() == vehicle.heading_integral(times).tolist()
        ways = [distance_at(*motion, number, time) for time in times]
        assert ways == [vehicle.distance(time) for time in times]
    assert track.distance(8.0) == pytest.approx(3.0 + math.hypot(4.0, 0.0))


def test_a_ping_is_fixed_once_and_heard_by_all_that_hear_it() -> None:
    """Decided one ASV after the other, a ping makes one fix, and every ASV that heard it counts."""
    band, outcomes, record = uplink(fleet(at(0.0)), fleet(at(150.0), at(300.0), at(450.0)))
    [ping] = band.send(0, 0, [0], 0.0)
    assert [outcomes.resolve(ping, row) for row in range(3)] == [True, False, False]
    assert (record.pings.rows["heard_by"][0], record.fixes.count) == (3, 1)
