"""Messages of a real modem: timelines worked by hand with the airtimes of the S2C."""

from typing import Any

import numpy as np
import pytest
from worlds import QUIET_NAVIGATION, QUIET_USBL, scenario, still

from bindusbl_des import Result, Setup, airtime, simulate

# From 20 m away and 10 m deep to the vessel (s)
WAY = np.hypot(20.0, 10.0) / 1500.0

# Airtimes and processing delays (s) of messages of 1 and 3 fixes, 24 and 56 B
ONE, THREE = (0.417916, 0.08861), (0.770201, 0.092341)
S2C = {"mf": {"modem": "s2c_instant"}}


def flown(count: int, rate: float | None = None, seconds: float = 6.0, **changes: Any) -> Result:
    """Return a mission of AUVs that hold still 20 m from an ASV (t_C = 40 ms), without noise."""
    acoustics = changes.pop("acoustics", S2C)
    world = still(
        count,
        duration_s=seconds,
        acoustics=acoustics,
        protocol={"tick_rate_hz": rate, **changes.pop("protocol", {})},
        usbl=QUIET_USBL,
        navigation=QUIET_NAVIGATION,
        **changes,
    )
    return simulate(world)


def of_auv(result: Result, auv: int) -> Any:
    """Return the fixes of one AUV, in the order of their pings."""
    fixes = result.tables["fixes"]
    return fixes[fixes.auv == f"AUV{auv}"].reset_index()


def test_a_round_on_the_s2c() -> None:
    """Three slots of 100 ms, a frame of 56 B at 0.3 s; the modem hands it over 92 ms after its end.

    The next round begins when frame and guard of 1.25 t_C are over, longer than 10 t_C.
    """
    result = flown(3)
    frame = result.tables["broadcasts"].iloc[0]
    assert frame.sent_at_s == pytest.approx(0.3)
    assert (frame.payload_bytes, frame.airtime_s) == (56, 0.770201)
    had = 0.3 + 0.770201 + WAY + 0.092341
    for auv in range(3):
        fix = of_auv(result, auv).iloc[0]
        assert fix.delivered_at_s == pytest.approx(had, abs=1e-9)
        assert fix.latency_s == pytest.approx(had - 0.1 * auv, abs=1e-9)
    assert result.tables["rounds"].started_at_s[1] == pytest.approx(0.3 + 0.770201 + 0.05)


def test_a_round_on_the_s2c_in_ticks() -> None:
    """One ceiling after airtime, way and processing: 27 ticks; the downlink slot takes 25."""
    result = flown(3, rate=30.0)
    assert of_auv(result, 0).delivered_at_s[0] * 30 == pytest.approx(9 + 27)
    assert result.tables["rounds"].started_at_s[1] * 30 == pytest.approx(9 + 25)


def test_the_delay_is_no_airtime() -> None:
    """It makes deliveries later by itself; rounds and the use of the band stay."""
    quick, slow = (flown(3, acoustics={"mf": {**S2C["mf"], "processing_s": s}}) for s in (0.0, 0.5))
    assert quick.tables["rounds"].equals(slow.tables["rounds"])
    assert quick.tables["broadcasts"].equals(slow.tables["broadcasts"])
    later = of_auv(slow, 0).delivered_at_s[0] - of_auv(quick, 0).delivered_at_s[0]
    assert later == pytest.approx(0.5)


def test_what_one_message_does_not_hold_follows_in_another() -> None:
    """Four fixes: three in 56 B, the fourth in 24 B right behind; then the guard."""
    result = flown(4)
    frames = result.tables["broadcasts"]
    assert frames.fixes[:4].tolist() == [3, 1, 3, 1]
    assert frames.part[:4].tolist() == [0, 1, 0, 1]
    assert frames.payload_bytes[:2].tolist() == [56, 24]
    second = 0.4 + THREE[0]
    assert frames.sent_at_s[:2].tolist() == pytest.approx([0.4, second])
    assert of_auv(result, 2).delivered_at_s[0] == pytest.approx(second + WAY + THREE[1])
    assert of_auv(result, 3).delivered_at_s[0] == pytest.approx(second + ONE[0] + WAY + ONE[1])
    assert result.tables["rounds"].started_at_s[1] == pytest.approx(second + ONE[0] + 0.05)
    assert result.tables["rounds"].fixes[0] == 4


def test_one_vessel_sends_all_messages_of_a_broadcast() -> None:
    """The vessels take turns by broadcasts, not by messages."""
    stations = {"positions_m": [[0.0, 0.0], [1.0, 0.0]]}
    result = flown(4, asvs={"count": 2, "formation": stations})
    assert result.tables["broadcasts"].asv[:4].tolist() == ["ASV0", "ASV0", "ASV1", "ASV1"]


def test_the_oldest_go_first_and_the_rest_wait() -> None:
    """Three of four fixes are sent; the next frame begins with the one that waited."""
    result = flown(4, acoustics={"mf": {**S2C["mf"], "overfull": "oldest_first"}}, seconds=8.0)
    fixes, frames = result.tables["fixes"], result.tables["broadcasts"]
    assert set(frames.fixes) == {3}
    assert set(frames.part) == {0}
    by_frame = fixes.groupby("broadcast_at_s").auv.apply(list).tolist()
    assert by_frame[:3] == [
        ["AUV0", "AUV1", "AUV2"], ["AUV3", "AUV0", "AUV1"], ["AUV2", "AUV3", "AUV0"],
    ]  # fmt: skip
    waits = of_auv(result, 3)
    assert waits.broadcast_at_s[0] == pytest.approx(frames.sent_at_s[1])


@pytest.mark.parametrize("overfull", ["split", "oldest_first"])
@pytest.mark.parametrize("downlink", ["sequential", "pipelined_round", "pipelined_group"])
@pytest.mark.parametrize("rate", [None, 30.0])
def test_no_fix_is_lost_or_sent_twice(overfull: str, downlink: str, rate: float | None) -> None:
    """Fixes ride in the order in which they were made, each once at most; no frames overlap."""
    mf = {"modem": "s2c_instant", "payload_bytes": 40, "overfull": overfull}
    result = flown(5, rate, 12.0, acoustics={"mf": mf}, protocol={"downlink": downlink})
    fixes, frames = result.tables["fixes"], result.tables["broadcasts"]
    sent = fixes[fixes.broadcast_at_s.notna()]
    assert sent.index.tolist() == list(range(len(sent)))
    assert frames.fixes.sum() == len(sent) == result.tables["rounds"].fixes.sum()
    assert frames.fixes.max() == (1 if downlink == "pipelined_group" else 2)
    assert sent.groupby("broadcast_at_s").size().tolist() == frames.fixes[frames.fixes > 0].tolist()
    ends = frames.sent_at_s + frames.airtime_s
    assert (frames.sent_at_s[1:].to_numpy() >= ends[:-1].to_numpy() - 1e-9).all()
    delivered = fixes[fixes.outcome == "delivered"]
    assert len(delivered) + (fixes.outcome == "in_flight").sum() == len(fixes)
    assert delivered.delivered_at_s.max() < 12.0


def test_who_steers_by_fixes_has_those_of_later_messages_too() -> None:
    """Where the way of AUVs is not sure, a message sets out when it is sent, not before."""
    world = scenario(
        duration_s=10.0,
        survey={"side_m": 60.0},
        auvs={"vehicle": "bluerov2", "feedback": "estimate", "speed_m_per_s": 0.5},
        asvs={"count": 1},
        acoustics={"mf": {"modem": "s2c_instant", "payload_bytes": 24}},
    )
    result = simulate(world)
    fixes, frames = result.tables["fixes"], result.tables["broadcasts"]
    delivered = fixes[fixes.outcome == "delivered"]
    assert len(delivered) > 3
    assert frames.part.max() > 0
    late = delivered.delivered_at_s - delivered.broadcast_at_s
    assert late.min() > 0.417916 + 0.08861
    assert late.max() < 0.417916 + 0.08861 + 60.0 / 1500.0


def test_guards_are_the_papers_unless_given() -> None:
    """Each of the four has a key; null is the paper's share of the crossing time (40 ms)."""
    papers = Setup(still(3)).slots
    assert (papers.uplink_guard, papers.downlink_guard) == (0.5 * 0.04, 1.25 * 0.04)
    assert papers.uplink_slot == 2.5 * 0.04
    assert papers.shortest_downlink == papers.downlink_slot(0) == 0.4

    def own(**protocol: float) -> Any:
        return Setup(still(3, protocol=protocol)).slots

    longest = np.hypot(50.0, 10.0) / 1500.0
    assert own(shortest_uplink_slot_s=0.0).uplink_slot == pytest.approx(0.01 + longest + 0.02)
    assert own(uplink_guard_s=0.2).uplink_slot == pytest.approx(0.01 + longest + 0.2)
    assert own(shortest_downlink_slot_s=0.0).downlink_slot(3) == pytest.approx(0.448 + 0.05)
    assert own(downlink_guard_s=0.3).downlink_slot(3) == pytest.approx(0.448 + 0.3)
    called = own(ranging={"model": "twtt", "turnaround_s": 0.1}, uplink_guard_s=0.2)  # type: ignore[arg-type]
    assert called.uplink_slot == pytest.approx(2 * 0.01 + 0.1 + 2 * longest + 0.2)


def test_shorter_guards_bring_more_fixes() -> None:
    """Without the least of 10 t_C a round of 140 m takes 0.7 + 0.448 + 0.1167 s, not 1.6333 s."""
    papers, own = (
        flown(3, seconds=60.0, side=140.0, acoustics={}, protocol=protocol)
        for protocol in ({}, {"shortest_downlink_slot_s": 0.0})
    )
    assert np.diff(papers.tables["rounds"].started_at_s) == pytest.approx(0.7 + 0.93333, abs=1e-4)
    assert np.diff(own.tables["rounds"].started_at_s) == pytest.approx(1.264667, abs=1e-4)


def test_every_payload_of_the_table_is_sent_for_so_long() -> None:
    """Records of 1 B, one to 64 fixes: a frame lasts what the table says, to the last digit."""
    mf = {"modem": "s2c_instant", "header_bytes": 0, "fix_bytes": 1}
    slots = Setup(still(1, acoustics={"mf": mf})).slots
    table = [slots.messages.modem.table.airtime(size) for size in range(1, 65)]  # type: ignore[union-attr]
    assert [slots.airtime(fixes) for fixes in range(1, 65)] == table
    assert slots.airtime(65) == table[63] + table[0]
    assert slots.airtime(0) == table[0]
    assert Setup(still(1)).slots.airtime(3) == airtime(56) == 0.448
