"""Timelines of tiny worlds, worked by hand."""

import math
from pathlib import Path

import numpy as np
import pytest
from worlds import scenario, still

from bindusbl_des import Setup, airtime, downlink_slot, load_scenario, simulate, uplink_slot

TICK = 1 / 30
ON_TICKS = Setup(still()).slots.clock  # of 30 Hz


def payload_bytes(fixes: int) -> int:
    """Return the bytes of a header and so many fixes."""
    return 8 + 16 * fixes


def crossing_time(side: float) -> float:
    """Return how long (s) sound takes across a survey."""
    return Setup(scenario(survey={"side_m": float(side)})).slots.crossing_time


@pytest.mark.parametrize(
    ("side", "slot_ticks", "downlink_ticks"),
    [
        (60, 3, [12, 12, 12, 15, 19, 23]),
        (100, 5, [20, 20, 20, 20, 20, 24]),
        (140, 7, [28, 28, 28, 28, 28, 28]),
    ],
)
def test_slots_are_the_papers(side: int, slot_ticks: int, downlink_ticks: list[int]) -> None:
    """The slots of the paper's three surveys, in ticks, for 0 to 5 fixes."""
    slots, clock = Setup(still(side=float(side))).slots, ON_TICKS
    assert clock.after(0, slots.uplink_slot) * 30 == pytest.approx(slot_ticks)
    found = [round(clock.after(0, slots.downlink_slot(k)) * 30) for k in range(6)]
    assert found == downlink_ticks


def test_ticks_are_rounded_up_robustly() -> None:
    """An uplink slot of L / 600 s is L / 20 ticks for every survey, whatever the float says."""
    for side in range(20, 2001, 20):
        crossing = side / 1500.0
        assert ON_TICKS.after(0, 2.5 * crossing) * 30 == pytest.approx(side / 20)
        assert ON_TICKS.after(0, 10 * crossing) * 30 == pytest.approx(side / 5)


@pytest.mark.parametrize(("fixes", "ticks"), [(1, [6, 7, 7, 8]), (3, [14, 14, 15, 16])])
def test_delivery_takes_one_ceiling(fixes: int, ticks: list[int]) -> None:
    """Airtime and travel time are added before they are rounded up to a tick."""
    for distance, expected in zip((0, 20, 50, 100), ticks, strict=True):
        duration = airtime(payload_bytes(fixes)) + distance / 1500
        assert round(ON_TICKS.after(0, duration) * 30) == expected


def test_guard_is_inert_in_the_papers_surveys() -> None:
    """The shortest uplink slot, not the echo guard, decides in every survey of the paper."""
    for side in (60, 100, 140):
        crossing = crossing_time(side)
        assert uplink_slot(0.01, 50 / 1500, crossing) == 2.5 * crossing
        assert 0.01 + 50 / 1500 + 0.5 * crossing < 2.5 * crossing


def test_downlink_slot_grows_with_the_payload() -> None:
    """Ten fixes take 1.344 s on the air, beyond the shortest slot of a 60 m survey."""
    assert airtime(payload_bytes(10)) == pytest.approx(1.344)
    assert downlink_slot(1.344, 0.04) == pytest.approx(1.394)
    assert Setup(scenario(protocol={"tick_rate_hz": None})).slots.clock.after(1.0, 0.498) == 1.498


def expected_fixes(side: float, count: int, duration: float = 300.0) -> tuple[int, list[float]]:
    """Work out deliveries per AUV and latency per slot of AUVs that all conflict and are heard."""
    up = math.ceil(max(0.01 + 50 / 1500 + 0.5 * side / 1500, 2.5 * side / 1500) * 30 - 1e-9)
    on_air = (8 + 16 * count) * 16 / 2000
    down = math.ceil(max(on_air + 1.25 * side / 1500, 10 * side / 1500) * 30 - 1e-9)
    flight = math.ceil((on_air + math.hypot(20, 10) / 1500) * 30 - 1e-9)
    round_ticks, ends = up * count + down, duration * 30
    deliveries = sum(1 for n in range(100_000) if n * round_ticks + up * count + flight < ends)
    return deliveries, [(up * (count - slot) + flight) / 30 for slot in range(count)]


@pytest.mark.parametrize("side", [60.0, 100.0, 140.0])
@pytest.mark.parametrize("count", [1, 2, 3, 4, 7])
def test_still_auvs_are_served_like_clockwork(side: float, count: int) -> None:
    """AUVs that hold still in range, without loss, get exactly the fixes that the slots allow."""
    result = simulate(still(count, side=side, record={"tracks_hz": 0.1}))
    deliveries, latencies = expected_fixes(side, count)
    assert result.auvs.fixes_delivered.tolist() == [deliveries] * count
    fixes = result.tables["fixes"]
    for slot, latency in enumerate(latencies):
        mine = fixes[(fixes.auv == f"AUV{slot}") & (fixes.outcome == "delivered")]
        assert mine.latency_s.to_numpy() == pytest.approx(latency, abs=1e-9)


@pytest.mark.parametrize(
    ("side", "fixes", "first", "last"),
    [(60, 375, 23, 17), (100, 257, 29, 19), (140, 183, 35, 21)],
)
def test_three_still_auvs_match_the_published_round(
    side: int, fixes: int, first: int, last: int
) -> None:
    """Three AUVs 20 m from one ASV: 375, 257 and 183 fixes each, and the latencies by slot."""
    result = simulate(still(3, side=float(side)))
    assert result.auvs.fixes_delivered.tolist() == [fixes] * 3
    means = result.auvs.latency_mean_s.tolist()
    assert means[0] == pytest.approx(first * TICK)
    assert means[2] == pytest.approx(last * TICK)


@pytest.mark.parametrize(
    ("side", "count", "rate"),
    [(60, 3, 2.0), (60, 10, 0.714286), (100, 3, 1.5), (140, 3, 1.071429), (140, 10, 0.428571)],
)
def test_pipelined_rounds_take_the_longer_of_the_two(side: int, count: int, rate: float) -> None:
    """With pipelining the round lasts as long as the slower band (rate bounds, section 6)."""
    world = still(count, side=float(side), protocol={"downlink": "pipelined_round"})
    rounds = simulate(world).tables["rounds"].started_at_s.to_numpy()
    assert 1 / np.diff(rounds)[2:].mean() == pytest.approx(rate, rel=1e-4)


def test_pipelined_groups_broadcast_one_fix_at_a_time() -> None:
    """One broadcast per ping group: each frame holds the one fix of its group."""
    result = simulate(still(3, protocol={"downlink": "pipelined_group"}))
    assert set(result.tables["broadcasts"].fixes[1:]) == {1}
    delivered = result.tables["fixes"].query("outcome == 'delivered'")
    assert delivered.latency_s.min() == pytest.approx((3 + 7) * TICK)  # slot, then T_tx(1) + d/c


@pytest.mark.parametrize(("reply_at", "decoding"), [("ping_front", 0.0), ("ping_end", 0.01)])
def test_direct_reply_takes_two_ways_only(reply_at: str, decoding: float) -> None:
    """A ping answered at once: two travel times, and the ping itself if it is decoded first."""
    downlink = {"model": "direct_reply", "reply": "instant", "reply_at": reply_at}
    protocol = {"downlink": downlink, "schedule": "round_robin"}
    fixes = simulate(still(2, at=40.0, protocol=protocol)).tables["fixes"]
    two_way = 2 * math.hypot(40, 10) / 1500 + decoding
    assert set(fixes.latency_s.round(9)) == {round(math.ceil(two_way * 30) * TICK, 9)}
    assert len(fixes) == 300
    assert fixes.pinged_at_s.tolist() == list(range(300))
    exact = simulate(still(2, at=40.0, protocol={**protocol, "tick_rate_hz": None}))
    fixes = exact.tables["fixes"]
    assert fixes.latency_s.to_numpy() == pytest.approx(two_way, abs=1e-12)
    arrived = exact.tables["receptions"].arrived_at_s
    assert fixes.broadcast_at_s.to_numpy() == pytest.approx(arrived + decoding, abs=1e-12)
    # the answers come before their slots end: no latency counts from there
    assert exact.arrow["auvs"]["latency_from_slot_s"].null_count == 2


def test_two_pings_at_once_destroy_each_other() -> None:
    """Two AUVs in one slot, equally far from one ASV, collide; 16 m apart in range they do not."""
    together = still(2, protocol={"schedule": "schedules_for_tests:all_at_once"})
    outcomes = simulate(together).tables["receptions"].outcome
    assert set(outcomes) == {"collided"}
    apart = still(
        2,
        auvs={"route": {"kind": "hold", "positions_m": [[20.0, 0.0], [-36.0, 0.0]]}},
        protocol={"schedule": "schedules_for_tests:all_at_once"},
    )
    assert set(simulate(apart).tables["receptions"].outcome) == {"heard"}


def test_touching_arrivals_do_not_collide() -> None:
    """Half-open arrivals: two pings that touch at an ASV are both heard."""
    for gap, outcome in ((15.0, "heard"), (14.999, "collided")):
        world = still(
            2,
            survey={"depth_m": 0.0},
            auvs={"route": {"kind": "hold", "positions_m": [[20.0, 0.0], [-20.0 - gap, 0.0]]}},
            protocol={"schedule": "schedules_for_tests:all_at_once"},
        )
        assert set(simulate(world).tables["receptions"].outcome) == {outcome}


@pytest.mark.parametrize("asv", ["moored", "otter"])
def test_a_frame_that_outlasts_the_mission_stays_under_way(asv: str) -> None:
    """At 1 bit/s a frame of one fix takes 384 s: nothing of it arrives in a minute, nor fails."""
    result = simulate(scenario(
        duration_s=60.0, survey={"side_m": 60.0}, environment={"current_m_per_s": 0.1},
        auvs={"count": 1, "vehicle": "bluerov2", "speed_m_per_s": 0.5},
        asvs={"count": 1, "vehicle": asv}, acoustics={"mf": {"bit_rate_bps": 1.0}},
    ))  # fmt: skip
    assert result.tables["broadcasts"].airtime_s.tolist() == [384.0]
    assert set(result.tables["fixes"].outcome) == {"in_flight"}


def test_an_empty_round_still_broadcasts_its_header() -> None:
    """AUVs that nobody hears still ping, together, and a header goes out each round."""
    result = simulate(still(3, at=55.0))
    rounds, broadcasts = result.tables["rounds"], result.tables["broadcasts"]
    assert set(rounds.colours) == {1}
    assert set(rounds.conflicts) == {0}
    assert set(broadcasts.payload_bytes) == {8}
    assert set(broadcasts.airtime_s.round(12)) == {0.064}
    assert set(result.tables["receptions"].outcome) == {"out_of_range"}
    assert result.auvs.hf_coverage.tolist() == [0.0] * 3


def test_range_edges_count_as_in_range() -> None:
    """An AUV exactly at the edge of both ranges is heard and served; just beyond it is not."""
    bands = {"hf": {"range_m": 50.0}, "mf": {"range_m": 50.0}}
    assert simulate(still(1, at=50.0, acoustics=bands)).auvs.fixes_delivered[0] > 100
    assert simulate(still(1, at=50.001, acoustics=bands)).auvs.pings_in_range[0] == 0
    short = {"hf": {"range_m": 50.0}, "mf": {"range_m": 49.999}}
    lost = simulate(still(1, at=50.0, acoustics=short))
    assert lost.auvs.fixes_delivered[0] == 0
    assert set(lost.tables["fixes"].outcome) <= {"out_of_range", "in_flight"}


def test_slant_metric_counts_the_depth() -> None:
    """With the slant metric an AUV 49.5 m away at 10 m depth is out of a range of 50 m."""
    hf = {"range_metric": "slant"}
    assert simulate(still(1, at=49.5, acoustics={"hf": hf})).auvs.pings_in_range[0] == 0
    assert simulate(still(1, at=48.9, acoustics={"hf": hf})).auvs.pings_in_range[0] > 0


@pytest.mark.parametrize("ranging", ["owtt_sync", "twtt"])
def test_slots_hold_the_slant_way_at_depth(ranging: str) -> None:
    """Near 100 m seen from above and 400 m down, pings arrive within their slots."""
    world = still(
        2, at=99.0, survey={"depth_m": 400.0}, acoustics={"hf": {"range_m": 100.0}},
        protocol={"ranging": ranging, "tick_rate_hz": None},
    )  # fmt: skip
    slots, way = Setup(world).slots, math.hypot(100.0, 400.0) / 1500
    assert slots.longest_travel_time == pytest.approx(way)
    calls = 1 if ranging == "owtt_sync" else 2
    assert slots.uplink_slot == pytest.approx(calls * (0.010 + way) + 0.02)
    result = simulate(world)
    slot = result.tables["pings"].slot.to_numpy()[result.tables["receptions"].ping]
    rounds = result.tables["rounds"].started_at_s.to_numpy()
    begins = rounds[result.tables["pings"]["round"].to_numpy()[result.tables["receptions"].ping]]
    ends = begins + (slot + 1) * slots.uplink_slot
    assert (result.tables["receptions"].arrived_at_s + 0.010 <= ends + 1e-9).all()
    assert set(result.tables["receptions"].outcome) <= {"heard", "in_flight"}


@pytest.mark.parametrize("name", ["recovery_140m", "failure_140m", "baseline_60m_tdma"])
def test_the_depth_changes_no_slot_of_the_paper(name: str) -> None:
    """There the floor of 2.5 t_C is longer than the slant way, as it is longer than R_HF."""
    world = load_scenario(f"{Path(__file__).parents[2]}/scenarios/{name}.yaml")
    crossing = world.survey.side_m / 1500
    assert Setup(world).slots.uplink_slot == 2.5 * crossing
    assert Setup(world).slots.longest_travel_time > world.acoustics.hf.range_m / 1500


def test_two_way_ranging_waits_for_the_call() -> None:
    """In twtt the AUV pings when the call has reached it, and the slot holds both ways."""
    result = simulate(still(2, protocol={"ranging": {"model": "twtt", "turnaround_s": 0.05}}))
    one_way = math.hypot(20, 10) / 1500
    pings = result.tables["pings"]
    assert pings.sent_at_s[0] == pytest.approx(one_way + 0.01 + 0.05)
    first = result.tables["rounds"].uplink_s[0]
    ways = 2 * math.hypot(50, 10) / 1500
    assert first == pytest.approx(2 * math.ceil((0.02 + 0.05 + ways + 0.02) * 30) / 30)
    assert set(result.tables["receptions"].outcome) <= {"heard", "in_flight"}


def test_broadcasters_choose_as_they_say() -> None:
    """Rotate takes turns, fixed stays, nearest and most_fixes follow the AUVs."""

    def voices(broadcaster: str) -> list[str]:
        world = still(
            2,
            auvs={"route": {"kind": "hold", "positions_m": [[20.0, 0.0], [25.0, 0.0]]}},
            asvs={"count": 3, "formation": {"positions_m": [[-40, 0], [20, 5], [200, 0]]}},
            protocol={"broadcaster": broadcaster},
        )
        return simulate(world).tables["broadcasts"].asv.tolist()

    assert voices("rotate")[:4] == ["ASV0", "ASV1", "ASV2", "ASV0"]
    assert set(voices("fixed")) == {"ASV0"}
    assert set(voices("nearest")) == {"ASV1"}
    assert set(voices("most_fixes")) == {"ASV1"}
    assert set(voices("random")) == {"ASV0", "ASV1", "ASV2"}


@pytest.mark.parametrize("broadcaster", ["nearest", "most_fixes", "parallel"])
def test_without_fixes_asvs_broadcast_in_turn(broadcaster: str) -> None:
    """So that an AUV hears of its slots again that has strayed from the first one's reach."""
    told = scenario(
        duration_s=300.0,
        auvs={"count": 1, "route": {"kind": "waypoints", "points_m": [[[-100, 0], [100, 0]]]}},
        asvs={"count": 2, "formation": {"positions_m": [[-70, 0], [70, 0]]}},
        acoustics={"hf": {"range_m": 60}, "mf": {"range_m": 60}, "loss": {"law": "none"}},
        protocol={"knowledge": "broadcast", "broadcaster": broadcaster},
    )
    result = simulate(told, 0)
    fixes, sent = result.tables["fixes"], result.tables["broadcasts"]
    assert set(fixes[fixes.outcome == "delivered"].broadcast_by) == {"ASV0", "ASV1"}
    assert set(sent[sent.fixes == 0].asv) == {"ASV0", "ASV1"}


def test_schedules_choose_as_they_say() -> None:
    """Two AUVs under ASVs of their own share a slot with reuse, and only with reuse."""

    def groups(schedule: str) -> set[int]:
        world = still(
            4,
            auvs={"route": {"kind": "hold", "positions_m": [[-99, 0], [-98, 0], [99, 0], [98, 0]]}},
            asvs={"count": 2, "formation": {"positions_m": [[-100, 0], [100, 0]]}},
            protocol={"schedule": schedule},
        )
        return set(simulate(world).tables["rounds"].colours)

    assert groups("spatial_reuse") == groups("dsatur") == {2}
    assert groups("one_per_slot") == {4}
    assert groups("round_robin") == groups("random") == {1}


def test_a_fleet_that_knows_only_estimates_misses_conflicts() -> None:
    """Scheduling by the last fixes instead of the truth leads to collisions, which are counted."""
    moving = {
        "auvs": {"count": 6, "speed_m_per_s": 2.0},
        "survey": {"side_m": 140.0},
        "asvs": {"count": 3},
        "record": {"detail": "summary"},
    }
    believed = simulate(scenario(**moving, protocol={"positions": "last_fix"}))
    true = simulate(scenario(**moving))
    assert believed.mission.collisions[0] > 10 * true.mission.collisions[0]


def test_an_auv_that_is_not_late_pings_as_its_slot_begins() -> None:
    """However the instants of waits are rounded, nobody waits for the past ("Negative delay")."""
    late = scenario(
        duration_s=40.0,
        survey={"side_m": 66.57076956645662},
        auvs={"count": 2, "ping_late_s": [0.0, 0.0]},
        acoustics={"hf": {"range_m": 28.446889947097716}},
        protocol={
            "schedule": "random", "downlink": "pipelined_group", "frame_s": 1.6005231269518714,
            "tick_rate_hz": 7.3,
        },
    )  # fmt: skip
    result = simulate(late)
    assert len(result.tables["pings"]) == len(result.tables["rounds"]) > 20


@pytest.mark.parametrize("name", ["no_groups", "twice", "stranger"])
def test_a_schedule_that_breaks_the_rules_is_refused(name: str) -> None:
    """A schedule of one's own may not let an AUV ping twice, or none at all."""
    with pytest.raises(ValueError, match=r"each of the AUVs 0\.\.1 at most once"):
        simulate(still(2, protocol={"schedule": f"schedules_for_tests:{name}"}))
    with pytest.raises(ValueError, match="cannot load 'schedules_for_tests:absent'"):
        simulate(still(2, protocol={"schedule": "schedules_for_tests:absent"}))


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("broken", "raised IndexError in round 0: only integers"),
        ("nothing", "returned None in round 0; a round"),
    ],
)
def test_a_schedule_that_fails_is_named(name: str, said: str) -> None:
    """Whatever a schedule of one's own raises or returns, the error says which it was and where."""
    with pytest.raises(ValueError, match=f"protocol.schedule: 'schedules_for_tests:{name}' {said}"):
        simulate(still(2, protocol={"schedule": f"schedules_for_tests:{name}"}))
