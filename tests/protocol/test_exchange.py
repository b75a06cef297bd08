"""AUVs acknowledge frames and forward them, ASVs repeat fixes: timelines worked out by hand."""

from typing import Any

import numpy as np
import pandas as pd
import pytest
from explain_for_tests import chain_of_ping
from worlds import merged, scenario

from bindusbl_des import (
    Mission,
    Scenario,
    broadcast,
    downlink_free,
    ping_group,
    simulate,
    until,
    verify,
)

# Sound takes 1 s for 1500 m, a ping 0.01 s; at 2,000 bit/s twice a byte takes 8 ms; MF reaches as
# far as sound goes in 0.04 s; crossing the survey it takes 0.04 s, so that slots are of 0.1 s at
# least, and a downlink's guard is 0.05 s, its slot 0.4 s at least.
C, WAY, GUARD = 1500.0, 0.04, 0.05


def frame_s(fixes: int) -> float:
    """Return how long a frame lasts: 8 B, and 16 B for each fix."""
    return (8 + 16 * fixes) * 0.008


ACKNOWLEDGEMENT = (8 + 2) * 0.008


def held(*places: tuple[float, float], duration_s: float = 4.0, **changes: Any) -> Scenario:
    """Return AUVs at the surface that hold still about an ASV at the origin, on an exact clock."""
    base = {
        "duration_s": duration_s,
        "survey": {"side_m": 60.0, "depth_m": 0.0},
        "auvs": {"count": len(places), "route": {"kind": "hold", "positions_m": list(places)}},
        "asvs": {"count": 1, "formation": {"model": "positions", "positions_m": [[0.0, 0.0]]}},
        "acoustics": {
            "loss": {"law": "none"}, "hf": {"range_m": 100.0}, "mf": {"range_m": 60.0},
        },
        "protocol": {"schedule": "one_per_slot"},
    }  # fmt: skip
    return scenario(**merged(base, changes))


def fixes_of(found: Any) -> pd.DataFrame:
    return found.tables["fixes"].set_index("fix")


def slot_s(reach_m: float = 100.0) -> float:
    """Return T_UL: a ping, the longest way and half a crossing, 0.1 s at least."""
    return max(0.01 + reach_m / C + 0.02, 0.1)


# What AUVs acknowledge


def test_a_ping_tells_what_its_auv_has_had_since_the_ping_before() -> None:
    """The AUV, 30 m away, has its first fix at 0.1 + 0.192 + 0.02 s; the slot of the downlink ends
    0.4 s after the frame began; the next ping is heard in full 0.02 + 0.01 s later.
    """
    found = simulate(held((30.0, 0.0), protocol={"acknowledge": "ping"}))
    fix = fixes_of(found).loc[0]
    sent = slot_s()
    assert fix.delivered_at_s == pytest.approx(sent + frame_s(1) + 0.02)
    assert fix.acknowledged_at_s == pytest.approx(sent + 0.4 + 0.02 + 0.01)
    assert "auv_frames" not in found.tables
    last = fixes_of(found).iloc[-1]
    assert np.isnan(last.acknowledged_at_s)  # no ping has come since


def test_what_a_ping_would_tell_that_nobody_hears_is_not_known() -> None:
    """The only ASV has failed while the second ping is on its way; the third tells of nothing, for
    nothing was delivered meanwhile.
    """
    second = slot_s() + 0.4
    changes = {"asvs": {"failures": [{"asv": 0, "at_s": second + 0.001, "until_s": second + 0.09}]}}
    found = simulate(held((30.0, 0.0), protocol={"acknowledge": "ping"}, **changes))
    fixes, pings = fixes_of(found), found.tables["pings"]
    assert pings.heard_by[:3].tolist() == [1, 0, 1]
    assert fixes.outcome[0] == "delivered"
    assert np.isnan(fixes.acknowledged_at_s[0])
    assert fixes.acknowledged_at_s[1] > fixes.delivered_at_s[1]


def test_frames_of_acknowledgement_have_turns() -> None:
    """AUVs 30 and 45 m away decode the frame 20 and 30 ms after it has ended at its ASV; the second
    in it waits for a turn of the first: a frame and two longest ways.
    """
    found = simulate(held((30.0, 0.0), (0.0, 45.0), protocol={"acknowledge": "frame"}))
    sent = 2 * slot_s()
    over = sent + frame_s(2)
    frames, fixes = found.tables["auv_frames"], fixes_of(found)
    turn = ACKNOWLEDGEMENT + 2 * WAY
    assert frames.auv[:2].tolist() == ["AUV0", "AUV1"]
    assert frames.kind[:2].tolist() == ["acknowledgement"] * 2
    assert frames.payload_bytes[:2].tolist() == [10, 10]
    assert frames.sent_at_s[:2].tolist() == pytest.approx([over + 0.02, over + 0.03 + turn])
    known = [over + 2 * 0.02 + ACKNOWLEDGEMENT, over + 2 * 0.03 + turn + ACKNOWLEDGEMENT]
    assert fixes.acknowledged_at_s[:2].tolist() == pytest.approx(known)
    assert found.tables["rounds"].downlink_s[0] == pytest.approx(frame_s(2) + 2 * turn + GUARD)
    heard = found.tables["auv_frame_receptions"]
    assert set(heard.outcome[heard.arrived_at_s < 3.0]) == {"heard"}


def test_acknowledgements_are_sounds_that_overlap() -> None:
    """A downlink of one's own broadcasts once more before the acknowledgement has come: the ASV is
    deaf as it arrives, and the fleet does not know.
    """

    def hasty(network: Any, turn: Any, time: float) -> Any:
        time = yield from ping_group(network, turn, 0, time)
        broadcast(network, turn, time)
        early = time + frame_s(1) + 0.05
        yield until(network, early)
        broadcast(network, turn, early)
        return (yield from downlink_free(network, early))

    plan = held((30.0, 0.0), protocol={"acknowledge": "frame", "downlink": hasty})
    found = simulate(plan)
    heard = found.tables["auv_frame_receptions"]
    assert heard.outcome[0] == "collided"
    assert heard.why[0] == "own_frame"
    assert np.isnan(fixes_of(found).acknowledged_at_s[0])


def test_a_failed_asv_hears_no_acknowledgement() -> None:
    plan = held(
        (30.0, 0.0), protocol={"acknowledge": "frame"},
        asvs={"failures": [{"asv": 0, "at_s": 0.4, "until_s": 0.5}]},
    )  # fmt: skip
    found = simulate(plan)
    assert slot_s() + frame_s(1) + 2 * 0.02 < 0.4 < slot_s() + frame_s(1) + 2 * 0.02 + 0.08
    heard = found.tables["auv_frame_receptions"]
    assert (heard.outcome[0], heard.why[0]) == ("lost", "failed_meanwhile")
    assert np.isnan(fixes_of(found).acknowledged_at_s[0])


def test_schedules_and_broadcasters_of_ones_own_are_told() -> None:
    """What is known as a round begins, and since when; nothing that has not been heard."""
    seen: list[tuple[float, float, float]] = []

    def schedule(view: Any) -> Any:
        seen.append((view.time, view.acknowledged_at_s[0], view.acknowledged_ping_s[0]))
        return [[0]]

    sent: list[float] = []

    def broadcaster(view: Any) -> int:
        sent.append(float(view.acknowledged_at_s[0]))
        return 0

    plan = held((30.0, 0.0), protocol={"acknowledge": "frame", "broadcaster": broadcaster})
    mission = Mission(plan, schedule=schedule)
    fixes = fixes_of(mission.result())
    assert np.isnan(seen[0][1])
    assert np.isnan(sent[0])
    for begins, since, pinged_at in seen[1:]:
        told = fixes[fixes.acknowledged_at_s <= begins].iloc[-1]
        assert (since, pinged_at) == (told.acknowledged_at_s, told.pinged_at_s)
    assert sent[1:] == [since for _, since, _ in seen[1 : len(sent)]]

    def asking(view: Any) -> Any:
        return [[0]] if view.acknowledged_at_s.size else []

    with pytest.raises(ValueError, match=r"set protocol\.acknowledge to ping or frame"):
        Mission(held((30.0, 0.0)), schedule=asking).result()


# What is repeated

TURNS = {"schedule": "round_robin", "frame_s": 1.0}


def test_a_fix_is_repeated_until_its_auv_has_a_newer_one() -> None:
    """One AUV pings in each frame of 1 s: with the fix of the one goes that of the other again."""
    plan = held((30.0, 0.0), (0.0, 45.0), protocol={**TURNS, "repeat": 3})
    found = simulate(plan)
    assert found.tables["broadcasts"].fixes.tolist() == [1, 2, 2, 2]
    fixes = fixes_of(found)
    assert fixes.repeats.tolist() == [1, 1, 1, 0]
    assert fixes.duplicates.tolist() == [1, 1, 1, 0]
    assert (fixes.outcome == "delivered").all()
    assert found.auvs.fixes_delivered.tolist() == [2, 2]  # a copy is no second delivery
    once = held((30.0, 0.0), (0.0, 45.0), protocol=TURNS)
    assert fixes_of(simulate(once)).correction_m[0] == fixes.correction_m[0]


@pytest.mark.parametrize(
    ("repeat", "carried"),
    [("none", [1] * 6), (0, [1] * 6), (1, [1] + [2] * 5), (2, [1, 2, *[3] * 4])],
)
def test_a_fix_is_repeated_so_many_times(repeat: Any, carried: list[int]) -> None:
    """Three AUVs ping in turn: a fix waits for the next of its AUV for three frames."""
    places = [(30.0, 0.0), (0.0, 45.0), (0.0, -45.0)]
    found = simulate(held(*places, duration_s=6.0, protocol={**TURNS, "repeat": repeat}))
    assert found.tables["broadcasts"].fixes.tolist() == carried


def test_a_fix_whose_frame_was_cut_comes_by_the_next() -> None:
    """The ASV fails in the midst of the first frame, and works again."""
    changes = {"asvs": {"failures": [{"asv": 0, "at_s": 0.2, "until_s": 0.5}]}}
    plan = held((30.0, 0.0), (0.0, 45.0), protocol={**TURNS, "repeat": 1}, **changes)
    found = simulate(plan)
    fix = fixes_of(found).loc[0]
    assert (fix.outcome, fix.repeats, fix.duplicates, fix.came_in) == ("delivered", 1, 0, 1)
    assert fix.delivered_at_s == pytest.approx(1.0 + slot_s() + frame_s(2) + 0.02)
    assert fix.broadcast_at_s == pytest.approx(slot_s())
    told = chain_of_ping(found, 0)
    assert "broadcasts it once more" in told.text()
    assert sum(part.duration_s for part in told.parts) == pytest.approx(fix.latency_s)


def test_until_acknowledged_ends_with_the_acknowledgement() -> None:
    """By a frame the fleet knows before the next one; by pings not before the AUV's next turn."""
    places = [(30.0, 0.0), (0.0, 45.0), (0.0, -45.0)]
    for by, carried in (("frame", [1] * 6), ("ping", [1, 2, 3, 3, 3, 3])):
        protocol = {**TURNS, "acknowledge": by, "repeat": "until_acknowledged"}
        found = simulate(held(*places, duration_s=6.0, protocol=protocol))
        assert found.tables["broadcasts"].fixes.tolist() == carried


def test_full_messages_carry_new_fixes_before_repeated_ones() -> None:
    """A message holds one fix: what is repeated finds no room beside a new one."""
    plan = held(
        (30.0, 0.0), (0.0, 45.0), protocol={**TURNS, "repeat": 5},
        acoustics={"mf": {"payload_bytes": 24, "overfull": "oldest_first"}},
    )  # fmt: skip
    found = simulate(plan)
    assert found.tables["broadcasts"].fixes.tolist() == [1] * 4
    assert fixes_of(found).repeats.tolist() == [0] * 4


# What is relayed

NEAR, FAR, FARTHER = (30.0, 0.0), (75.0, 0.0), (75.0, 45.0)


def test_a_fix_beyond_reach_comes_by_a_hop() -> None:
    """AUV1 is 75 m from the ASV, 45 m from AUV0, which decodes the frame 20 ms after its end, and
    forwards it at once, in the first turn; AUV1 hears that 30 ms later.
    """
    found = simulate(held(NEAR, FAR, protocol={"relay": {"hops": 1}}))
    over = 2 * slot_s() + frame_s(2)
    fixes, frames = fixes_of(found), found.tables["auv_frames"]
    assert fixes.hops[:2].tolist() == [0, 1]
    assert fixes.relayed_by[:2].fillna("").tolist() == ["", "AUV0"]
    assert frames.sent_at_s[0] == pytest.approx(over + 0.02)
    assert fixes.delivered_at_s[:2].tolist() == pytest.approx(
        [over + 0.02, over + 0.02 + frame_s(2) + 0.03]
    )
    turns = 2 * (frame_s(2) + 2 * WAY)  # AUV1 has one as well, and nothing to forward a hop further
    assert found.tables["rounds"].downlink_s[0] == pytest.approx(frame_s(2) + turns + GUARD)
    assert (frames.auv == "AUV0").all()
    assert (frames.hops == 1).all()
    told = chain_of_ping(found, 1)
    assert "AUV0 forwards it" in told.text()
    assert "by 1 hop" in told.told
    assert sum(part.duration_s for part in told.parts) == pytest.approx(fixes.latency_s[1])


def test_hops_have_turns_of_their_own() -> None:
    """AUV2 hears AUV1 alone (45 m), which hears AUV0 (45 m), which hears the ASV (30 m).  Each turn
    is a frame and three longest ways; AUV1's turn in the second hop is the fifth of six.
    """
    plan = held(
        NEAR, FAR, FARTHER, protocol={"relay": {"hops": 2}},
        acoustics={"hf": {"range_m": 120.0}, "mf": {"range_m": 60.0}}, duration_s=8.0,
    )  # fmt: skip
    found = simulate(plan)
    over, turn = 3 * slot_s(120.0) + frame_s(3), frame_s(3) + 3 * WAY
    fixes, frames = fixes_of(found), found.tables["auv_frames"]
    assert fixes.hops[:3].tolist() == [0, 1, 2]
    assert fixes.relayed_by[:3].fillna("").tolist() == ["", "AUV0", "AUV1"]
    first = over + 0.02
    assert frames.sent_at_s[:2].tolist() == pytest.approx([first, first + 0.03 + 4 * turn])
    assert fixes.delivered_at_s[2] == pytest.approx(first + 2 * 0.03 + 4 * turn + frame_s(3))
    assert found.tables["rounds"].downlink_s[0] == pytest.approx(frame_s(3) + 6 * turn + GUARD)
    once = simulate(held(NEAR, FAR, FARTHER, protocol={"relay": {"hops": 1}}))
    assert fixes_of(once).outcome[2] == "out_of_range"


def test_a_slot_is_known_by_the_frame_that_another_forwards() -> None:
    """AUV1 hears no ASV: of frames that name its slots it decodes those that AUV0 forwards, and
    pings in the second slot of each round; else after the first, which was agreed, in none.
    """
    told = {"knowledge": {"model": "broadcast", "missed": "silent"}, "positions": "last_fix"}
    pings = {}
    for relay in ({}, {"relay": {"hops": 1}}):
        tables = simulate(held(NEAR, FAR, duration_s=9.0, protocol={**told, **relay})).tables
        own = tables["assignments"].query("auv == 'AUV1'").outcome.tolist()
        pings[bool(relay)] = tables["pings"].query("auv == 'AUV1'").sent_at_s.tolist()
        assert set(own[1:]) == {"known" if relay else "missed"}
    assert pings[False] == [slot_s()]
    frame = (8 + 2 * 2 + 2 * 16) * 0.008  # two slots and two fixes
    round_s = 2 * slot_s() + frame + 2 * (frame + 2 * WAY) + GUARD
    assert pings[True] == pytest.approx([k * round_s + slot_s() for k in range(len(pings[True]))])
    assert len(pings[True]) == 7


def test_only_those_who_are_asked_forward() -> None:
    found = simulate(held(NEAR, FAR, protocol={"relay": {"who": [1]}}))
    assert fixes_of(found).outcome[1] == "out_of_range"
    assert len(found.tables["auv_frames"]) == 0


def test_acknowledgements_follow_all_relays() -> None:
    """AUV1 has its fix by AUV0; its acknowledgement is heard by AUV0, not by the ASV, 75 m away,
    and is not forwarded.
    """
    found = simulate(
        held(NEAR, FAR, protocol={"relay": {"hops": 1}, "acknowledge": "frame"}, duration_s=6.0)
    )
    over, turn = 2 * slot_s() + frame_s(2), frame_s(2) + 2 * WAY
    own = ACKNOWLEDGEMENT + 3 * WAY
    frames, fixes = found.tables["auv_frames"], fixes_of(found)
    told = frames[frames.kind == "acknowledgement"].head(2)
    assert told.auv.tolist() == ["AUV0", "AUV1"]
    first = over + 2 * turn
    assert told.sent_at_s.tolist() == pytest.approx([first + 0.02, first + 0.05 + own])
    assert fixes.acknowledged_at_s[0] == pytest.approx(first + 2 * 0.02 + ACKNOWLEDGEMENT)
    assert np.isnan(fixes.acknowledged_at_s[1])
    lasts = frame_s(2) + 2 * turn + 2 * own + GUARD
    assert found.tables["rounds"].downlink_s[0] == pytest.approx(lasts)


def test_frames_of_several_messages_are_forwarded_one_by_one() -> None:
    """A message holds one fix: two frames, each forwarded by AUV0, in turn."""
    plan = held(
        NEAR, FAR, protocol={"relay": {"hops": 1, "who": [0]}},
        acoustics={"mf": {"payload_bytes": 24}},
    )  # fmt: skip
    found = simulate(plan)
    over = 2 * slot_s() + 2 * frame_s(1)
    frames = found.tables["auv_frames"]
    first = over + 0.02 + WAY  # the last of several frames is waited for a little
    expected = [first, first + frame_s(1) + 2 * WAY]
    assert frames.sent_at_s[:2].tolist() == pytest.approx(expected)
    assert fixes_of(found).hops[:2].tolist() == [0, 1]


MOVING: dict[str, Any] = {
    "duration_s": 30.0,
    "survey": {"side_m": 110.0},
    "auvs": {"count": 3, "speed_m_per_s": 1.5},
    "asvs": {"count": 1, "formation": {"model": "positions", "positions_m": [[-20.0, -30.0]]}},
    "acoustics": {
        "hf": {"range_m": 120.0},
        "mf": {"range_m": 50.0, "processing_s": 0.1, "payload_bytes": 40},  # several frames
    },
}


@pytest.mark.parametrize("downlink", ["sequential", "pipelined_round", "pipelined_group"])
@pytest.mark.parametrize("steers", [False, True])
def test_turns_keep_frames_apart(downlink: str, steers: bool) -> None:
    """Whatever AUVs forward and acknowledge while they move, no frame meets another; the fleet
    knows of each fix not before its AUV has it.
    """
    auvs = {"vehicle": "bluerov2", "feedback": "estimate", "speed_m_per_s": 0.6} if steers else {}
    protocol = {"downlink": downlink, "relay": {"hops": 2}, "acknowledge": "frame", "repeat": 1}
    found = simulate(scenario(**merged(MOVING, {"auvs": auvs, "protocol": protocol})), seed=3)
    fixes = fixes_of(found)
    for table in ("frame_receptions", "auv_frame_receptions"):
        assert not (found.tables[table].outcome == "collided").any(), table
    assert (fixes.hops > 0).any()
    assert (found.tables["auv_frames"].hops == 2).any()
    known = fixes[fixes.acknowledged_at_s.notna()]
    assert len(known) > 4
    assert (known.acknowledged_at_s > known.delivered_at_s).all()
    assert fixes.latency_s[fixes.outcome == "delivered"].min() > 0.0


def test_relays_cost_energy_and_airtime() -> None:
    """AUV0 sends 192 + 80 ms more in each round: 10 W of that instead of 1 W."""
    power = {"transmit_w": 10.0, "receive_w": 1.0, "idle_w": 1.0}
    changes: dict[str, Any] = {"acoustics": {"mf": power}, "duration_s": 3.0}
    one = held(NEAR, protocol={"relay": {"hops": 1}, "acknowledge": "frame"}, **changes)
    found = simulate(one)
    sent = found.tables["auv_frames"]
    lasts = np.minimum(sent.airtime_s, 3.0 - sent.sent_at_s).sum()
    assert lasts > 0.5
    assert found.auvs.energy_j[0] == pytest.approx(3.0 + 9.0 * lasts)
    frames = found.tables["broadcasts"]
    by_asv = np.minimum(frames.airtime_s, 3.0 - frames.sent_at_s).sum()
    assert found.mission.mf_utilisation[0] == pytest.approx((lasts + by_asv) / 3.0)


# What reasons about it


def test_nothing_is_proved_of_frames_of_auvs() -> None:
    plan = held(NEAR, FAR, protocol={"relay": {"hops": 1}})
    verdict = verify(plan)
    assert verdict.verdict == "undecided"
    assert verdict.witness is None
    kinds = {pair.kind for pair in verdict.pairs if not pair.is_safe}
    assert kinds == {"acknowledged, repeated, relayed"}
    told = held(NEAR, FAR, protocol={"acknowledge": "ping"})
    assert verify(told).accepted  # no signal is another than without
