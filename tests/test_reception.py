"""Pings and frames between vehicles that move, worked by hand."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from statistics import NormalDist
from typing import Any

import numpy as np
import pytest
import simpy
from worlds import QUIET_NAVIGATION, QUIET_USBL, scenario, still

from bindusbl_des import simulate
from bindusbl_des.acoustics import LOSS_LAWS, range_loss, travel_time
from bindusbl_des.boards import ReplyBoard
from bindusbl_des.downlink import MfDownlink
from bindusbl_des.events import COLLIDED, HEARD, IN_FLIGHT, OUT_OF_RANGE, Fix, Ping, Round
from bindusbl_des.fleet import Auv, Fleet
from bindusbl_des.hydrophones import ARRAYS
from bindusbl_des.motion import light_time, lines, places, together
from bindusbl_des.propagation import HEARD_BY, OUTCOME
from bindusbl_des.ranging import TwoWay
from bindusbl_des.reception import Loss
from bindusbl_des.recorder import ROOM, Ledger, Recorder
from bindusbl_des.slots import ExactClock
from bindusbl_des.streams import ROWS, NoiseStore, Purpose, Streams
from bindusbl_des.uplink import Heard, Passes, Uplink
from bindusbl_des.usbl import NOISE_WIDTH, Usbl
from bindusbl_des.vehicles import Legged, Place, moored, recorded

SOUND = 1500.0  # m/s
PING = 0.01  # s
QUIET = Loss(np.zeros(4), 2, 0.0, 0.999)
PERFECT = Usbl(ARRAYS["oem5"], 0.0, 0.0, 0.0, (0.0, 0.0, 0.0), 0.0, SOUND)


def at(x: float, y: float = 0.0, z: float = 0.0) -> Legged:
    """Return a vehicle that keeps its place (m)."""
    return moored(Place(x, y, z, 0.0))


def moving(x: float, speed: float, y: float = 0.0, z: float = 0.0) -> Legged:
    """Return a vehicle that goes along x for 100 s, at `x` (m) at 0 s."""
    return recorded(np.array([0.0, 100.0]), np.array([[x, y, z], [x + 100.0 * speed, y, z]]))


def fleet(*vehicles: Legged) -> Fleet:
    """Return vehicles whose way is known."""
    return Fleet(vehicles, together([vehicle.legs for vehicle in vehicles]))


@dataclass
class Listening:
    """Surface vessels that note what they hear of a ping, each by itself."""

    heard: list[Heard] = field(default_factory=list)

    def expect(self, passes: Passes, rows: range, ends: float) -> None:
        for row in rows:
            passes(range(row, row + 1), ends)

    def hear(self, heard: Heard) -> None:
        self.heard.append(heard)


def uplink(
    env: simpy.Environment, auvs: Fleet, asvs: Fleet, **changes: Any
) -> tuple[Uplink, Listening, Recorder]:
    """Return a quiet HF band of 3 km between two fleets, who listens, and the record."""
    listening, record = Listening(), Recorder()
    band = Uplink(env, auvs, asvs, **{
        "hf_range": 3000.0, "metric": "slant", "ping_duration": PING, "sound_speed": SOUND,
        "loss": QUIET, "usbl": PERFECT, "streams": Streams(1), "record": record,
        "listener": listening, **changes,
    })  # fmt: skip
    return band, listening, record


def test_a_ping_is_measured_from_where_the_vessel_is_when_it_arrives() -> None:
    """A vessel that has moved 10 m while the ping was under way finds it where it was sent."""
    env = simpy.Environment()
    # 15 m/s away from a ping sent 990 m behind: caught up with after 2/3 s, 1000 m away
    band, listening, record = uplink(env, fleet(at(-990.0, z=0.0)), fleet(moving(0.0, 15.0)))
    band.send(0, 0, 0, 0.0)
    env.run()
    [heard] = listening.heard
    assert record.receptions.rows[0, 3:6] == pytest.approx([2 / 3, 1000.0, 2 / 3])
    assert heard.estimate[0] == pytest.approx(-990.0, abs=0.01)
    assert heard.estimate[9] < 0.01


def test_a_turning_vessel_measures_by_its_heading_at_the_arrival() -> None:
    """A vessel that turns from +x to +y while a ping is under way still finds it."""
    turns = recorded(np.array([0.0, 0.3, 1.0]), np.array([[0, 0, 0], [3, 0, 0], [3, 7, 0.0]]))
    env = simpy.Environment()
    band, listening, _ = uplink(env, fleet(at(600.0, 300.0, 50.0)), fleet(turns))
    band.send(0, 0, 0, 0.0)
    env.run()
    assert listening.heard[0].estimate[:3] == pytest.approx([600.0, 300.0, 50.0], abs=0.1)


def test_who_called_ranges_by_half_the_round_trip() -> None:
    """The caller takes half of both ways for its range; another ASV takes its one way."""
    env = simpy.Environment()
    auvs, asvs = fleet(at(600.0)), fleet(moving(0.0, 30.0), at(2000.0))
    band, listening, record = uplink(env, auvs, asvs)
    TwoWay(env, band, auvs, asvs, ping_duration=PING, turnaround=0.19, sound_speed=SOUND).ping(
        0, 0, 0, 0.0
    )
    env.run()
    # called from x = 0 in 0.4 s, answered at 0.6 s; met at 30 (0.6 + t) = 600 - 1500 t
    back = (600 - 18) / 1530
    assert record.pings.rows[0, 4] == pytest.approx(0.6)
    assert record.receptions.rows[:, 5] == pytest.approx([back, 1400 / 1500])
    vessel, half = 30 * (0.6 + back), SOUND * (0.4 + back) / 2
    assert [heard.asvs for heard in listening.heard] == [[0], [1]]
    found = [heard.estimate[0] for heard in listening.heard]
    assert found == pytest.approx([vessel + half, 600.0], abs=1e-6)


@dataclass
class Steered:
    """A voyage that has been told where to go only as far as somebody has asked."""

    reached: float = 0.0

    def advance(self, time: float) -> None:
        self.reached = max(self.reached, time)


class Navigator:
    """Notes when its fixes come."""

    def __init__(self) -> None:
        self.corrected: list[tuple[float, float]] = []

    def correct(self, fix: object, pinged_at: float, time: float) -> tuple[float, float]:
        self.corrected.append((pinged_at, time))
        return 3.0, 4.0


@pytest.fixture(params=["foreseen", "steering"])
def frames(request: pytest.FixtureRequest) -> Callable[..., Fix]:
    """Return a function that sends a frame from ASV to AUV and returns the fix afterwards."""

    def send(asv: Legged, auv: Legged, airtime: float, *, time: float = 0.0) -> Fix:
        env, voyage = simpy.Environment(time), Steered()
        vehicles = fleet(auv)
        if request.param == "steering":
            vehicles = Fleet(vehicles.vehicles, vehicles.motion, voyage)  # type: ignore[arg-type]
        auvs: Sequence[Auv] = [Auv(0, auv, None, Navigator())]  # type: ignore[arg-type]
        band = MfDownlink(
            env, auvs, vehicles, fleet(asv), mf_range=500.0, sound_speed=SOUND, clock=ExactClock()
        )
        fix = Fix(0, 0, 0, 0, "ASV0", time - 2.0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0)
        band.send([fix], 0, time, airtime)
        assert vehicles.foreseen or voyage.reached == time
        env.run()
        return fix

    return send


def test_a_frame_comes_from_where_its_sender_ends_it(frames: Callable[..., Fix]) -> None:
    """A vessel at 20 m/s ends a frame of 2 s 40 m nearer to the AUV than it began it."""
    fix = frames(moving(0.0, 20.0), at(340.0), 2.0, time=5.0)
    assert fix.outcome == "delivered"
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
    assert frames(at(0.0), at(300.0, 400.0, 900.0), 1.0).outcome == "delivered"
    assert frames(moving(0.0, -20.0), at(499.0), 1.0).outcome == "delivered"
    assert frames(moving(0.0, 20.0), at(501.0), 1.0).outcome == "out_of_range"
    assert frames(at(0.0), moving(501.0, -20.0), 1.0).outcome == "out_of_range"
    late = frames(moving(0.0, 20.0), at(540.0), 1.0, time=3.0)
    assert late.delivered_at_s == pytest.approx(4.0 + (540 - 80) / SOUND)


def test_the_first_to_decode_a_ping_answers_from_where_it_heard_it() -> None:
    """An answer sets out from the vessel where the ping met it, to where the AUV will be."""
    env = simpy.Environment()
    auv, asv = moving(0.0, -30.0), moving(600.0, 30.0)
    band = MfDownlink(
        env, [Auv(0, auv, None, Navigator())],  # type: ignore[arg-type]
        fleet(auv), fleet(asv), mf_range=1.0, sound_speed=SOUND, clock=ExactClock(),
    )  # fmt: skip
    met = 600 / 1470  # 1500 t = 600 + 30 t
    fix = Fix(0, 0, 0, 0, "ASV0", 0.0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0)
    band.reply(fix, 0, met)
    env.run()
    assert fix.latency_s == pytest.approx(met + (1500 * met + 30 * met) / 1470, abs=1e-12)


def test_pings_of_earlier_slots_collide_with_later_ones() -> None:
    """A ping from afar meets one sent a second later from nearby; those between are over."""
    env = simpy.Environment()
    band, listening, record = uplink(
        env, fleet(at(1500.0), at(0.0, 150.0), at(15.0, 0.0)), fleet(at(0.0))
    )

    def pings() -> Any:
        for auv, time in ((0, 0.0), (1, 0.5), (2, 0.995)):
            yield env.timeout(time - env.now)
            band.send(0, auv, auv, time)

    env.process(pings())
    env.run()
    assert record.receptions.rows[:, 3] == pytest.approx([1.0, 0.6, 1.005])
    assert record.receptions.rows[:, OUTCOME].tolist() == [COLLIDED, HEARD, COLLIDED]
    assert [heard.flight.auv for heard in listening.heard] == [1]


def test_nobody_answers_before_a_ping_is_over() -> None:
    """A ping overlapped by one that is sent after it has begun to arrive gets no answer."""
    env, record = simpy.Environment(), Recorder(rounds=[Round(0, 0.0, 1, 0)])
    auvs, asvs = fleet(at(1500.0), at(3.0)), fleet(at(0.0))
    down = MfDownlink(
        env, [Auv(n, auvs.vehicles[n], None, Navigator()) for n in range(2)],  # type: ignore[arg-type]
        auvs, asvs, mf_range=1.0, sound_speed=SOUND, clock=ExactClock(),
    )  # fmt: skip
    band, _, _ = uplink(env, auvs, asvs, record=record, listener=ReplyBoard(down, record, PING))

    def pings() -> Any:
        for auv, time in ((0, 0.0), (1, 1.005), (1, 2.0)):
            yield env.timeout(time - env.now)
            band.send(0, 0, auv, time)

    env.process(pings())
    env.run()
    assert record.receptions.rows[:, OUTCOME].tolist() == [COLLIDED, COLLIDED, HEARD]
    assert [fix.pinged_at_s for fix in record.fixes] == [2.0]
    assert record.rounds[0].fixes == len(record.broadcasts) == 1


def test_what_is_out_of_range_drowns_nobody() -> None:
    """Sound from beyond the HF range arrives together with a ping, which is heard all the same."""
    env = simpy.Environment()
    band, _, record = uplink(env, fleet(at(90.0), at(-101.0)), fleet(at(0.0)), hf_range=100.0)
    band.send(0, 0, 0, 0.0)
    band.send(0, 0, 1, 0.0)
    env.run()
    assert record.receptions.rows[:, OUTCOME].tolist() == [HEARD, OUT_OF_RANGE]


def test_at_the_end_what_has_arrived_is_decided_and_the_rest_under_way() -> None:
    """A mission ends between two arrivals: one ASV has heard the ping, but there is no fix yet."""
    env = simpy.Environment()
    band, listening, record = uplink(env, fleet(at(0.0)), fleet(at(1500.0), at(150.0)))
    band.send(0, 0, 0, 0.0)
    env.run(until=0.5)
    band.close(0.5)
    assert record.receptions.rows[:, OUTCOME].tolist() == [IN_FLIGHT, HEARD]
    assert record.pings.rows[0, HEARD_BY] == 1
    assert listening.heard == []
    # a ping that ends with the mission does not end in it
    band, _, record = uplink(simpy.Environment(), fleet(at(0.0)), fleet(at(1500.0), at(150.0)))
    band.send(0, 0, 0, 0.0)
    band.close(0.1 + PING)
    assert record.receptions.rows[:, OUTCOME].tolist() == [IN_FLIGHT] * 2


@pytest.mark.parametrize(
    ("metric", "place", "reach"),
    [("horizontal", (30.0, 40.0, 120.0), 50.0), ("slant", (30.0, 40.0, 120.0), 130.0)],
)
def test_the_edge_of_the_hf_range_is_within(
    metric: str, place: tuple[float, float, float], reach: float
) -> None:
    """Pings and calls reach 50 m seen from above, or 130 m in all, and not a hair further."""
    for limit, expected in ((reach, IN_FLIGHT), (math.nextafter(reach, 0.0), OUT_OF_RANGE)):
        band, _, record = uplink(
            simpy.Environment(), fleet(at(*place)), fleet(at(0.0)), metric=metric, hf_range=limit
        )
        band.send(0, 0, 0, 0.0)
        assert record.receptions.rows[0, OUTCOME] == expected
        assert band.in_range(Place(*place, 0.0), Place(0, 0, 0, 0)) == (expected == IN_FLIGHT)


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
    ledger = Ledger(Ping)
    for number in range(2 * ROOM + 1):
        ledger.room_for(3)[number, :] = number
        ledger.count += 1
        assert len(ledger.array) >= ledger.count
    assert ledger.rows[:, 0].tolist() == list(range(2 * ROOM + 1))
    assert ledger.rows.shape[1] == 10
    assert len(ledger.room_for(9 * ROOM)) >= 11 * ROOM  # one ping at thousands of ASVs


def test_sound_meets_a_vehicle_as_equations_of_one_vehicle_say() -> None:
    """A known motion is met when `acoustics.travel_time` says; faster than sound, never."""
    bend = recorded(np.array([-3.0, 1.0, 1.2]), np.array([[0, 0, 5], [400, 9, 5], [300, 50, 9.0]]))
    motion = fleet(at(7.0), bend).motion
    for time in (0.0, 0.9, 1.1, 1000.0):
        expected = travel_time((-200.0, 30.0, 2.0), bend.at, time, SOUND)
        assert light_time(-200.0, 30.0, 2.0, *motion, 1, time, SOUND) == pytest.approx(
            expected, abs=2e-13 + 1e-15 * time
        )
    endless, fast = np.array([0.0, 1e40]), np.array([[1.0, 0, 0], [2e43, 0, 0]])
    motion = fleet(recorded(endless, fast)).motion
    with pytest.raises(ValueError, match="outruns the sound"):
        light_time(0.0, 0.0, 0.0, *motion, 0, 0.0, SOUND)


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
        assert found[:, 6].tolist() == [vehicle.distance(time) for time in times]
    assert track.distance(8.0) == pytest.approx(3.0 + math.hypot(4.0, 0.0))
