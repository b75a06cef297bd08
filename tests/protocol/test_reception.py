"""Pings and frames between vehicles that move, worked by hand."""

import math
from statistics import NormalDist
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from played_for_tests import PING, SOUND, Track, at, moving, played
from worlds import QUIET_NAVIGATION, QUIET_USBL, scenario, still

from bindusbl_des import Mission, Result, Scenario, range_loss, simulate, travel_time


def receptions(world: Scenario) -> pd.DataFrame:
    return simulate(world).tables["receptions"]


def test_a_ping_is_measured_from_where_the_vessel_is_when_it_arrives() -> None:
    """A vessel that has moved 10 m while the ping was under way finds it where it was sent."""
    # 15 m/s away from a ping sent 990 m behind: caught up with after 2/3 s, 1000 m away
    result = simulate(played([at(-990.0)], [moving(0.0, 15.0)], pings=[(0.0, 0)]))
    found = result.tables["receptions"].iloc[0]
    met = found.arrived_at_s, found.slant_range_m, found.travel_time_s
    assert met == pytest.approx((2 / 3, 1000.0, 2 / 3))
    [fix] = result.tables["fixes"].itertuples()
    assert fix.x_m == pytest.approx(-990.0, abs=0.01)
    assert fix.error_m < 0.01


def test_a_turning_vessel_measures_by_its_heading_at_the_arrival() -> None:
    """A vessel that turns from +x to +y while a ping is under way still finds it."""
    turns = [(0.0, 0.0, 0.0, 0.0), (0.3, 3.0, 0.0, 0.0), (1.0, 3.0, 7.0, 0.0)]
    result = simulate(played([at(600.0, 300.0, 50.0)], [turns], pings=[(0.0, 0)]))
    [fix] = result.tables["fixes"].itertuples()
    assert (fix.x_m, fix.y_m, fix.z_m) == pytest.approx((600.0, 300.0, 50.0), abs=0.1)


def test_sound_meets_a_vehicle_as_equations_of_one_vehicle_say() -> None:
    """A known motion is met when `travel_time` says, at a bend as well."""
    bend = np.array([(0.0, 0, 0, 0), (1.0, 400, 9, 0), (1.2, 300, 50, 0), (9.0, 300, 51, 0)])

    def place(time: float) -> tuple[float, ...]:
        return tuple(np.interp(time, bend[:, 0], along) for along in bend[:, 1:].T)

    instants = (0.0, 0.8, 0.9, 1.1, 5.0)
    world = played([at(-200.0, 30.0, 2.0)], [bend.tolist()], pings=[(it, 0) for it in instants])
    expected = [travel_time((-200.0, 30.0, 2.0), place, it, SOUND) for it in instants]
    assert receptions(world).travel_time_s.to_numpy() == pytest.approx(expected, abs=1e-12)


def offset(sounding: Any) -> Any:
    """An instrument whose fixes are 3 m and 4 m from where the AUV was when it pinged."""
    count = len(sounding.asvs)
    return np.tile(sounding.source + np.array((3.0, 4.0, 0.0)), (count, 1)), [np.eye(3)] * count


def sent(asv: Track, auv: Track, airtime: float, *, time: float = 3.0) -> Any:
    """Send a frame from ASV to AUV with the fix of a ping 2 s earlier; return the fix."""
    world = played(
        [auv], [asv], pings=[(time - 2.0, 0)], frames=[(time, 0)], airtime=airtime,
        usbl={"model": offset},
    )  # fmt: skip
    [fix] = simulate(world).tables["fixes"].itertuples()
    return fix


def test_a_frame_comes_from_where_its_sender_ends_it() -> None:
    """A vessel at 20 m/s ends a frame of 2 s 40 m nearer to the AUV than it began it."""
    fix = sent(moving(0.0, 20.0), at(340.0), 2.0, time=5.0)
    assert fix.outcome == "delivered"
    assert fix.delivered_at_s == pytest.approx(5.0 + 2.0 + (340 - 140) / SOUND, abs=1e-12)
    assert fix.latency_s == pytest.approx(fix.delivered_at_s - 3.0)
    told = fix.broadcast_at_s, fix.broadcast_by, fix.innovation_m
    assert told == (5.0, "ASV0", pytest.approx(5.0))


def test_a_frame_ends_where_its_receiver_is_by_then() -> None:
    """An AUV that runs away at 20 m/s is caught up with where it is when the frame ends."""
    fix = sent(at(0.0), moving(240.0, 20.0), 2.0)
    # 300 m away as the frame begins: 1500 t = 340 + 20 t
    assert fix.delivered_at_s == pytest.approx(5.0 + 340 / 1480, abs=1e-12)


def test_a_frame_reaches_whom_it_finds_in_range_as_it_begins() -> None:
    """The MF range is horizontal, its edge counts, and what comes later does not."""
    assert sent(at(0.0), at(300.0, 400.0, 900.0), 1.0).outcome == "delivered"
    assert sent(moving(0.0, -20.0), at(439.0), 1.0).outcome == "delivered"
    assert sent(moving(0.0, 20.0), at(561.0), 1.0).outcome == "out_of_range"
    assert sent(at(0.0), moving(561.0, -20.0), 1.0).outcome == "out_of_range"
    late = sent(moving(0.0, 20.0), at(540.0), 1.0)
    assert late.delivered_at_s == pytest.approx(4.0 + (540 - 80) / SOUND)


ANSWERED: dict[str, Any] = {"model": "direct_reply", "reply": "instant", "reply_at": "ping_front"}


def test_the_first_to_decode_a_ping_answers_from_where_it_heard_it() -> None:
    """An answer sets out from the vessel where the ping met it, to where the AUV will be."""
    world = played([moving(300.0, 30.0)], [moving(0.0, -30.0)], pings=[(0.0, 0)], downlink=ANSWERED)
    met = 300 / 1470  # 1500 t = 300 + 30 t
    latency = simulate(world).tables["fixes"].latency_s[0]
    assert latency == pytest.approx(met + (1500 * met + 30 * met) / 1470, abs=1e-12)


def test_fixes_are_applied_in_the_order_of_their_arrival() -> None:
    """A frame from nearby overtakes an earlier one from afar, though it has another fix as well."""
    errors = iter((8.0, 4.0, 4.0))

    def off(sounding: Any) -> Any:
        return [sounding.source + np.array((next(errors), 0.0, 0.0))], [np.eye(3)]

    world = played(
        [at(0.0), at(-480.0)], [at(450.0), at(-15.0), at(-480.0, 15.0)], hf_range=100.0,
        pings=[(3.0, 0), (5.05, [0, 1])], frames=[(5.0, 0), (5.1, 1)], airtime=0.06,
        usbl={"model": off},
    )  # fmt: skip
    fixes = simulate(world).tables["fixes"]
    assert fixes.auv.tolist() == ["AUV0", "AUV0", "AUV1"]
    # AUV0 has the second frame, of two fixes, after 15 m; the first after 450 m
    arrived = [5.06 + 450 / SOUND, 5.2 + 15 / SOUND, 5.2 + 465 / SOUND]
    assert fixes.delivered_at_s.to_numpy() == pytest.approx(arrived, abs=1e-12)
    # 4 m: half of it; then 8 m, of which 6 are left: half of them.  As sent it would have been 4.
    assert fixes.innovation_m.to_numpy() == pytest.approx([6.0, 4.0, 4.0])
    assert fixes.correction_m.to_numpy() == pytest.approx([3.0, 2.0, 2.0])


def test_pings_of_earlier_slots_collide_with_later_ones() -> None:
    """A ping from afar meets one sent a second later from nearby; those between are over."""
    world = played(
        [at(1500.0), at(0.0, 150.0), at(15.0, 0.0)], [at(0.0)],
        pings=[(0.0, 0), (0.5, 1), (0.995, 2)],
    )  # fmt: skip
    result = simulate(world)
    met = result.tables["receptions"]
    assert met.arrived_at_s.to_numpy() == pytest.approx([1.0, 0.6, 1.005])
    assert met.outcome.tolist() == ["collided", "heard", "collided"]
    assert result.tables["fixes"].auv.tolist() == ["AUV1"]


def test_no_ping_is_decided_before_it_is_over() -> None:
    """A ping that has arrived is not decided while another that is sent now could overlap it."""
    world = played(
        [at(1500.0), at(3.0)], [at(0.0)], pings=[(0.0, 0), (1.005, 1), (2.0, 0)], duration_s=4.0
    )
    mission = Mission(world)
    for instant, known in ((1.5, False), (3.0 + PING - 1e-9, False), (3.0 + PING, True)):
        mission.advance(instant)
        assert np.isfinite(mission.fleet_fixes()[0]).all() == known
    result = mission.result()
    assert result.tables["receptions"].outcome.tolist() == ["collided", "collided", "heard"]
    assert result.tables["fixes"].pinged_at_s.tolist() == [2.0]


def test_nobody_answers_before_a_ping_is_over() -> None:
    """A ping overlapped by one that is sent after it has begun to arrive gets no answer."""
    world = played(
        [at(1500.0), at(3.0)], [at(0.0)], pings=[(0.0, 0), (1.005, 1), (2.0, 1)], downlink=ANSWERED
    )
    result = simulate(world)
    assert result.tables["receptions"].outcome.tolist() == ["collided", "collided", "heard"]
    assert result.tables["fixes"].pinged_at_s.tolist() == [2.0]
    assert result.tables["rounds"].fixes[0] == len(result.tables["broadcasts"]) == 1


@settings(max_examples=60, deadline=None)
@given(
    pings=st.lists(st.tuples(st.integers(0, 400), st.integers(-200, 200)), min_size=2, max_size=30),
    vessels=st.lists(st.integers(-200, 200), min_size=1, max_size=3),
    reach=st.integers(5, 400),
)
def test_overlaps_are_those_that_comparing_all_pairs_finds(
    pings: list[tuple[int, int]], vessels: list[int], reach: int
) -> None:
    """In steps of half a ping and half its length, pings overlap that are less than two apart."""
    pings.sort()
    length = SOUND * PING / 2
    met = receptions(
        played(
            [at(length * place) for _, place in pings], [at(length * asv) for asv in vessels],
            pings=[(time * PING / 2, auv) for auv, (time, _) in enumerate(pings)],
            hf_range=length * (reach + 0.5), duration_s=6.0,
        )
    )  # fmt: skip
    arrivals = [
        (asv, time + abs(place - vessel), abs(place - vessel) <= reach)
        for time, place in pings
        for asv, vessel in enumerate(vessels)
    ]
    expected = [
        "out_of_range" if not heard
        else "collided" if any(
            other_heard and other == asv and abs(other_comes - comes) < 2
            for k, (other, other_comes, other_heard) in enumerate(arrivals) if k != row
        )
        else "heard"
        for row, (asv, comes, heard) in enumerate(arrivals)
    ]  # fmt: skip
    assert met.outcome.tolist() == expected


def test_a_broadcaster_is_told_whose_measurements_made_its_fixes() -> None:
    """For each fix they are the ASVs that heard its ping, whatever others missed."""
    told = []

    def noting(view: Any) -> int:
        told.extend(view.heard.tolist())
        return 0

    result = simulate(scenario(
        duration_s=60.0, survey={"side_m": 200.0}, auvs={"count": 5},
        asvs={"formation": {"radius_m": 50.0}},
        acoustics={"hf": {"range_m": 130.0}, "loss": {"law": "head", "combine": "clamp_first"}},
        protocol={"broadcaster": noting},
    ))  # fmt: skip
    fixes, met = result.tables["fixes"], result.tables["receptions"]
    heard = met[met.outcome == "heard"].groupby("ping").asv.agg(" ".join)
    names = [" ".join(f"ASV{asv}" for asv in range(3) if own[asv]) for own in told]
    assert names == fixes.asvs[: len(names)].tolist() == heard[fixes.ping[: len(names)]].tolist()
    assert {len(it.split()) for it in names} == {1, 2, 3}


def test_what_is_out_of_range_drowns_nobody() -> None:
    """Sound from beyond the HF range arrives together with a ping, which is heard all the same."""
    world = played([at(90.0), at(-101.0)], [at(0.0)], pings=[(0.0, [0, 1])], hf_range=100.0)
    assert receptions(world).outcome.tolist() == ["heard", "out_of_range"]


def test_at_the_end_what_has_arrived_is_decided_and_the_rest_under_way() -> None:
    """A mission ends between two arrivals: one ASV has heard the ping, but there is no fix yet."""

    def ended(lasts: float) -> Result:
        vessels = [at(1500.0), at(150.0)]
        return simulate(played([at(0.0)], vessels, pings=[(0.0, 0)], duration_s=lasts))

    result = ended(0.5)
    assert result.tables["receptions"].outcome.tolist() == ["in_flight", "heard"]
    assert result.tables["pings"].heard_by.tolist() == [1]
    assert len(result.tables["fixes"]) == 0
    # a ping that ends with the mission does not end in it
    assert ended(0.1 + PING).tables["receptions"].outcome.tolist() == ["in_flight"] * 2


@pytest.mark.parametrize(
    ("metric", "reach"), [("horizontal", 50.0), ("slant", 130.0)], ids=["horizontal", "slant"]
)
def test_the_edge_of_the_hf_range_is_within(metric: str, reach: float) -> None:
    """Pings and calls reach 50 m seen from above, or 130 m in all, and not a hair further."""
    for limit, expected in ((reach, "heard"), (math.nextafter(reach, 0.0), "out_of_range")):
        world: dict[str, Any] = {"hf_range": limit, "metric": metric, "pings": [(0.0, 0)]}
        pinged = played([at(30.0, 40.0, 120.0)], [at(0.0)], **world)
        assert receptions(pinged).outcome.tolist() == [expected]
        called = played([at(30.0, 40.0, 120.0)], [at(0.0)], **world, ranging="twtt")
        assert simulate(called).tables["pings"].call.tolist() == [expected]


def test_pings_are_lost_by_their_slant_range() -> None:
    """From 260 m, 100 m of them down, that share is lost that the law has for 260 m."""
    result = simulate(still(
        1, side=20.0, at=240.0, duration_s=600.0, survey={"depth_m": 100.0},
        asvs={"formation": {"positions_m": [[0.0, 0.0]]}},
        acoustics={"hf": {"range_m": 300.0}, "loss": {"law": "paper", "combine": "clamp_first"}},
    ))  # fmt: skip
    outcomes = result.tables["receptions"].outcome.to_numpy()[:-1]  # the last is under way
    assert len(outcomes) > 1000
    chance = range_loss(260.0)
    assert 0.1 < chance < 0.5
    assert set(outcomes) == {"lost", "heard"}
    spread = math.sqrt(chance * (1.0 - chance) / len(outcomes))
    assert (outcomes == "lost").mean() == pytest.approx(chance, abs=4 * spread)


def test_noise_is_a_pairs_own_and_new_for_each_ping() -> None:
    """Ranges err as a normal law has it, for hundreds of pings, whoever else is there."""
    sd = 1e-4  # s

    def errors(auvs: list[list[float]], asvs: list[list[float]]) -> np.ndarray:
        result = simulate(scenario(
            duration_s=120.0, survey={"side_m": 60.0, "depth_m": 0.0},
            auvs={"count": len(auvs), "route": {"kind": "hold", "positions_m": auvs}},
            asvs={"count": len(asvs), "formation": {"positions_m": asvs}},
            acoustics={"loss": {"law": "none"}}, protocol={"frame_s": 0.5},
            usbl={**QUIET_USBL, "travel_time_sd_s": sd}, navigation=QUIET_NAVIGATION,
        ), seed=9)  # fmt: skip
        fixes = result.tables["fixes"]
        return fixes[fixes.auv == "AUV0"].x_m.to_numpy() - 20.0

    alone = errors([[20.0, 0.0]], [[0.0, 0.0]])
    crowd = errors([[20.0, 0.0], [0.0, 30.0]], [[0.0, 0.0], [500.0, 0.0]])
    assert len(alone) > len(crowd) >= 200  # whose rounds are longer
    assert crowd == pytest.approx(alone[: len(crowd)], abs=1e-12)
    assert len(np.unique(alone)) == len(alone)
    scaled = alone / (SOUND * sd)
    assert scaled.std() == pytest.approx(1.0, abs=4 / math.sqrt(2 * len(scaled)))
    expected = [NormalDist().inv_cdf((k + 0.5) / len(scaled)) for k in range(len(scaled))]
    assert np.corrcoef(np.sort(scaled), expected)[0, 1] > 0.99


def test_a_ping_is_fixed_once_and_heard_by_all_that_hear_it() -> None:
    """Decided one ASV after the other, a ping makes one fix, and every ASV that heard it counts."""
    vessels = [at(150.0), at(300.0), at(450.0)]
    mission = Mission(played([at(0.0)], vessels, pings=[(0.0, 0)], duration_s=1.0))
    seen = [mission.time for _ in mission.happenings("reception")]
    assert seen == pytest.approx([0.1 + PING, 0.2 + PING, 0.3 + PING])
    result = mission.result()
    assert result.tables["pings"].heard_by.tolist() == [3]
    assert result.tables["fixes"].asvs.tolist() == ["ASV0 ASV1 ASV2"]
