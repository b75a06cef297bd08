"""AUVs that know only the slots they were told: timelines worked by hand, and what always holds."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from commands_for_tests import each_explained, explained
from hypothesis import given
from hypothesis import strategies as st
from worlds import QUIET_NAVIGATION, QUIET_USBL, merged, paper_case, scenario, still

from bindusbl_des import Mission, Result, Scenario, simulate, warnings_of
from bindusbl_des.core.acoustics.messages import Messages, Modem

CURVE = str(Path(__file__).parents[2] / "bindusbl_des/models/presets/ahoi_delivery.csv")
MISSED = ("silent", "last_slot", "contention")

# From 20 m away and 10 m deep to the vessel (s)
WAY = np.hypot(20.0, 10.0) / 1500.0


def apart(missed: str, seconds: float = 6.0, **changes: Any) -> Result:
    """Return a mission of two AUVs and two vessels, each 20 m from one and 180 m from the other.

    The vessels broadcast in turn and reach 100 m, so that each AUV decodes every other frame: AUV0
    those of even rounds.  t_C = 40 ms, without noise or loss.
    """
    base = {
        "duration_s": seconds,
        "survey": {"side_m": 60.0},
        "auvs": {"count": 2, "route": {"kind": "hold", "positions_m": [[20.0, 0.0], [180.0, 0.0]]}},
        "asvs": {"count": 2, "formation": {"positions_m": [[0.0, 0.0], [200.0, 0.0]]}},
        "acoustics": {"loss": {"law": "none"}},
        "protocol": {"knowledge": {"model": "broadcast", "missed": missed}},
        "usbl": QUIET_USBL,
        "navigation": QUIET_NAVIGATION,
    }
    return simulate(scenario(**merged(base, changes)))


def instants(result: Result, auv: int) -> list[float]:
    """Return when an AUV pinged (s)."""
    pings = result.tables["pings"]
    return pings[pings.auv == f"AUV{auv}"].sent_at_s.tolist()


def near(count: int, **changes: Any) -> Scenario:
    """Return AUVs that hold still 20 m from a vessel, told their slots; without noise."""
    base = {
        "duration_s": 30.0,
        "protocol": {"knowledge": {"model": "broadcast"}, "tick_rate_hz": None},
        "usbl": QUIET_USBL,
        "navigation": QUIET_NAVIGATION,
    }
    return still(count, **merged(base, changes))


def test_who_has_not_decoded_the_frame_is_silent() -> None:
    """The first round is agreed at launch; then each AUV knows every other round.

    Two fixes and two assignments are 44 B, 0.352 s and a guard of 0.05 s after a slot of 0.1 s; one
    fix less fits the shortest downlink slot of 0.4 s.
    """
    result = apart("silent")
    starts = [0.0, 0.502, 1.002, 1.502, 2.002]
    rounds = result.tables["rounds"]
    assert rounds.started_at_s[:5].tolist() == pytest.approx(starts)
    assert rounds.assigned.tolist() == [2] * len(rounds)
    assert rounds.informed[:4].tolist() == [2, 1, 1, 1]
    assert instants(result, 0)[:3] == pytest.approx([starts[0], starts[1], starts[3]])
    assert instants(result, 1)[:3] == pytest.approx([starts[0], starts[2], starts[4]])
    assert set(result.tables["broadcasts"].named) == {2}
    assert result.tables["broadcasts"].payload_bytes[:2].tolist() == [8 + 2 * 16 + 4, 8 + 16 + 4]
    second = result.tables["assignments"].query("round == 1")
    assert second.outcome.tolist() == ["known", "missed"]
    assert second.told_by.tolist() == ["ASV0", "ASV0"]
    assert second.told_at_s.tolist() == pytest.approx([0.1, 0.1])
    assert result.tables["assignments"].told_by[:2].isna().all()
    assert result.auvs.slots_missed.tolist() == [(len(rounds) - 1) // 2, len(rounds) // 2]


def test_why_an_auv_was_silent_is_explained() -> None:
    """The next ping of AUV1 tells of the slot it missed, and whose frame has told it this one."""
    result = apart("silent")
    ping = int(result.tables["pings"].query("auv == 'AUV1'").ping.iloc[1])
    told = explained(result, ping=int(ping))
    assert "has missed 1 slot since its last ping, in round 1 the last" in told
    assert "out of MF range of the frame of ASV0 that began at 0.1000 s: 180.0 m > 100 m" in told
    assert "tells AUV1 that slot 0 of round 2 is its own" in told


def test_the_last_slot_is_reckoned_from_the_rounds_that_were_told() -> None:
    """All ping always, since all rounds are as long as the last known: 0.502 s."""
    result = apart("last_slot")
    starts = result.tables["rounds"].started_at_s.tolist()
    assert np.diff(starts) == pytest.approx(0.502)
    for auv in range(2):
        assert instants(result, auv) == pytest.approx(starts)
    assert result.tables["rounds"].informed[1:].tolist() == [1] * (len(starts) - 1)
    ping = result.tables["pings"].query("auv == 'AUV1' and round == 1").ping.iloc[0]
    assert "by its reckoning" in explained(result, ping=int(ping))


def test_reckoning_goes_astray_where_rounds_change() -> None:
    """An AUV beyond MF range is told nothing: it pings each launch-planned round length for ever.

    A round that brings no fix of it is 0.5 s, one as planned at launch, with three fixes, 0.748 s:
    three slots, and 62 B on the air for 0.496 s.
    """
    result = simulate(near(
        3,
        auvs={"route": {"kind": "hold", "positions_m": [[20.0, 0.0], [0.0, 25.0], [49.0, 0.0]]}},
        acoustics={"mf": {"range_m": 40.0}},
        protocol={"knowledge": {"missed": "last_slot"}, "schedule": "one_per_slot"},
    ))  # fmt: skip
    planned = 3 * 0.1 + (8 + 3 * 16 + 3 * 2) * 8 * 2 / 2000 + 0.05
    own = instants(result, 2)
    assert np.diff(own) == pytest.approx(planned)
    assert own[0] == pytest.approx(0.2)
    assert result.auvs.slots_missed[:2].tolist() == [0, 0]
    assert result.auvs.slots_missed[2] == len(result.tables["rounds"]) - 1


def test_pings_by_reckoning_collide_with_those_of_others() -> None:
    """Who reckons wrongly pings into the slots of others: counted, not hidden.

    AUV1 is beyond HF range, so that rounds are shorter than AUV2 takes them for.
    """
    still_there = [[20.0, 0.0], [60.0, 5.0], [48.0, 0.0]]
    collisions = {}
    for missed in ("silent", "last_slot"):
        result = simulate(near(
            3,
            duration_s=120.0,
            auvs={"route": {"kind": "hold", "positions_m": still_there}},
            acoustics={"mf": {"range_m": 40.0}},
            protocol={"knowledge": {"missed": missed}},
        ))  # fmt: skip
        collisions[missed] = int(result.mission.collisions.iloc[0])
    assert collisions["silent"] == 0
    assert collisions["last_slot"] > 0


def test_a_contention_slot_ends_each_round() -> None:
    """It is a further slot, not for those that have their own; others try half of them."""
    told = simulate(near(2, protocol={"knowledge": {"missed": "contention"}}))
    rounds = told.tables["rounds"]
    assert set(rounds.colours) == {3}
    assert set(rounds.uplink_s.round(9)) == {0.3}
    assert set(told.tables["pings"].slot) == {0, 1}
    untold = apart("contention", seconds=120.0)
    by_chance = untold.tables["pings"].query("slot == 1")
    tries = untold.auvs.slots_missed.sum()
    # each luck is that of a coin: within four standard deviations
    assert abs(len(by_chance) - tries / 2) < 4 * np.sqrt(tries / 4)


def test_lost_auvs_have_no_slot_and_are_recalled_in_turn() -> None:
    """Two of three AUVs are beyond HF range: lost after 5 s, one of them called every other round.

    They decode the frames, and so ping when they are called.
    """
    result = simulate(near(
        3,
        auvs={"route": {"kind": "hold", "positions_m": [[20.0, 0.0], [60.0, 0.0], [0.0, 70.0]]}},
        protocol={"forget_after_s": 5.0, "recall_rounds": 2},
    ))  # fmt: skip
    rounds, assigned = result.tables["rounds"], result.tables["assignments"]
    late = rounds[rounds.started_at_s > 6.0]
    by_round = assigned.groupby("round").auv.apply(list)
    found = [by_round[number] for number in late["round"]]
    assert all(it[0] == "AUV0" for it in found)
    calls = [it[1:] for number, it in zip(late["round"], found, strict=True) if number % 2 == 0]
    assert all(it[1:] == [] for n, it in zip(late["round"], found, strict=True) if n % 2)
    assert {*map(tuple, calls)} == {("AUV1",), ("AUV2",)}
    assert all(one != other for one, other in pairwise(calls))
    assert late.colours.tolist() == [1 + (number % 2 == 0) for number in late["round"]]
    assert result.auvs.slots_missed.tolist() == [0, 0, 0]


def test_who_comes_back_into_range_is_assigned_again() -> None:
    """An AUV swims out of HF range, is lost, and returns: recalled and heard, it has its slot."""
    there_and_back = [[0.0, 10.0], [100.0, 10.0], [0.0, 12.0]]
    world = scenario(
        duration_s=200.0,
        survey={"side_m": 200.0},
        auvs={
            "count": 2,
            "speed_m_per_s": 1.0,
            "vehicle": {"model": "kinematic", "turning_radius_m": 1.0},
            "route": {"kind": "waypoints", "points_m": [[[0, 0], [30, 0]], there_and_back]},
        },
        asvs={"count": 1},
        acoustics={"mf": {"range_m": 200.0}, "loss": {"law": "none"}},
        protocol={"knowledge": "broadcast", "forget_after_s": 10.0, "recall_rounds": 3},
    )
    result = simulate(world)
    assigned = result.tables["assignments"].query("auv == 'AUV1'")
    rounds = result.tables["rounds"]
    has_slot = rounds["round"].isin(assigned["round"])
    share = has_slot.groupby((rounds.started_at_s // 20.0).astype(int)).mean()
    assert share[0] == share[9] == 1.0
    assert share[5] == pytest.approx(1 / 3, abs=0.1)  # beyond 90 m, called every third round
    assert result.tables["pings"].query("auv == 'AUV1' and sent_at_s > 180").heard_by.min() == 1


def same(one: Result, other: Result, *but: str) -> None:
    """Compare the tables of two missions, but for some columns."""
    for name, table in one.tables.items():
        if name not in ("assignments", "mission"):
            columns = [it for it in table.columns if it not in but]
            pd.testing.assert_frame_equal(table[columns], other.tables[name][columns])


@pytest.mark.parametrize("downlink", ["sequential", "pipelined_round"])
@pytest.mark.parametrize("schedule", ["spatial_reuse", "one_per_slot", "round_robin"])
@pytest.mark.parametrize("rate", [None, 30.0])
def test_who_is_told_everything_in_time_fares_as_if_all_knew(
    downlink: str, schedule: str, rate: float | None
) -> None:
    """Told at no cost, in reach of every frame, at rest: the tables are those of `shared`.

    So each round begins when its frame has said; nobody reckons otherwise.
    """
    protocol = {"downlink": downlink, "schedule": schedule, "tick_rate_hz": rate}
    told_at_no_cost = {"model": "broadcast", "assignment_bytes": 0, "missed": "last_slot"}
    known, told = (
        simulate(near(4, duration_s=20.0, protocol={**protocol, "knowledge": knowledge}))
        for knowledge in ("shared", told_at_no_cost)
    )
    same(known, told, "assigned", "informed", "named")
    assert told.auvs.slots_missed.tolist() == [0] * 4
    assert known.tables["assignments"].empty
    assert known.tables["rounds"].assigned.isna().all()


@pytest.mark.parametrize("missed", MISSED)
@pytest.mark.parametrize("downlink", ["sequential", "pipelined_round"])
def test_every_slot_is_known_or_missed_and_nobody_pings_unasked(missed: str, downlink: str) -> None:
    """Each slot of an AUV is on record once; silent AUVs ping in the slots they know, no other."""
    world = paper_case(
        2,
        duration_s=120.0,
        acoustics={"mf": {"range_m": 60.0}},
        protocol={"knowledge": {"model": "broadcast", "missed": missed}, "downlink": downlink,
                  "forget_after_s": 20.0},
        record={"detail": "full"},
    )  # fmt: skip
    result = simulate(world, 3)
    rounds, assigned, pings = (result.tables[it] for it in ("rounds", "assignments", "pings"))
    assert not assigned.duplicated(["round", "auv"]).any()
    over = rounds.downlink_s.notna()
    counts = assigned.groupby("round").size().reindex(rounds["round"], fill_value=0)
    assert (counts.to_numpy() == rounds.assigned)[over].all()
    known = assigned[assigned.outcome == "known"]
    told = known.groupby("round").size().reindex(rounds["round"], fill_value=0)
    assert (told.to_numpy() == rounds.informed)[over].all()
    missed_by = assigned[assigned.outcome == "missed"].groupby("auv").size()
    names = [f"AUV{auv}" for auv in range(3)]
    assert result.auvs.slots_missed.tolist() == missed_by.reindex(names, fill_value=0).tolist()
    assert result.auvs.slots_missed.sum() > 0
    told_pings = {*zip(known["round"], known.slot, known.auv, known.starts_at_s, strict=True)}
    sent = {*zip(pings["round"], pings.slot, pings.auv, pings.sent_at_s, strict=True)}
    assert told_pings <= sent
    if missed == "silent":
        assert told_pings == sent
    assert (np.diff(pings.sent_at_s) >= 0).all()
    lasts = world.acoustics.hf.ping_s
    assert all((np.diff(own.sent_at_s) >= lasts - 1e-12).all() for _, own in pings.groupby("auv"))


@pytest.mark.parametrize("missed", MISSED)
def test_who_looks_on_changes_nothing(missed: str) -> None:
    """The same seed gives the same tables, at whatever instants the mission is held."""
    world = paper_case(
        1, duration_s=30.0, acoustics={"mf": {"range_m": 60.0}}, record={"detail": "full"},
        protocol={"knowledge": {"model": "broadcast", "missed": missed}},
    )  # fmt: skip
    held = Mission(world, 5)
    for step in range(1, 60):
        held.advance(0.5 * step)
        held.auvs()
    whole = simulate(world, 5)
    for name, table in held.result().tables.items():
        pd.testing.assert_frame_equal(table, whole.tables[name])


def test_frames_that_a_channel_loses_leave_auvs_silent() -> None:
    """Where a modem decodes some frames of many, slots are missed as often as frames are."""
    result = simulate(near(
        1,
        at=150.0,
        duration_s=200.0,
        survey={"side_m": 400.0},
        acoustics={"hf": {"range_m": 200.0}, "mf": {"channel": {"model": "curve", "file": CURVE}}},
    ))  # fmt: skip
    slots = len(result.tables["rounds"]) - 1
    fixes = result.tables["fixes"]
    lost = (fixes.outcome == "lost").mean()
    share = result.auvs.slots_missed[0] / slots
    assert 0.02 < share < 0.98
    assert abs(share - lost) < 4 * np.sqrt(0.25 / len(fixes) + 0.25 / slots)


@given(
    fixes=st.integers(0, 40), named=st.integers(0, 40), room=st.integers(16, 120),
    each=st.integers(0, 16),
)  # fmt: skip
def test_messages_hold_what_they_carry(fixes: int, named: int, room: int, each: int) -> None:
    """All fixes and assignments are sent, no message is overfull, none but the first is empty."""
    messages = Messages(Modem(2000.0, 2.0), 8, 16, room // 16, True, room, each)
    loads = messages.packed(fixes, named)
    assert sum(load.fixes for load in loads) == fixes
    assert sum(load.named for load in loads) == named
    assert all(load.size_bytes <= room + 8 for load in loads)
    assert all(load.fixes or load.named for load in loads[1:])


def test_slots_are_told_in_the_first_of_several_messages() -> None:
    """Of the S2C's 64 B four assignments take 8 beside three fixes; the fourth fix follows."""
    result = simulate(near(4, acoustics={"mf": {"modem": "s2c_instant"}}, duration_s=12.0))
    frames = result.tables["broadcasts"]
    assert frames.payload_bytes[:2].tolist() == [64, 24]
    assert frames.named[:2].tolist() == [4, 0]
    assert result.auvs.slots_missed.tolist() == [0] * 4


def test_who_is_named_in_a_later_message_needs_that_one() -> None:
    """Messages of 24 B name eight AUVs each: with 10 the rest is told in the second."""
    result = simulate(near(10, acoustics={"mf": {"payload_bytes": 24}}, duration_s=12.0))
    frames = result.tables["broadcasts"]
    assert frames.named[:3].tolist() == [8, 2, 0]
    assert frames.fixes[:3].tolist() == [0, 0, 1]
    told = result.tables["assignments"].query("round == 1").told_at_s.tolist()
    assert told[:8] == [frames.sent_at_s[0]] * 8
    assert told[8:] == [frames.sent_at_s[1]] * 2


def test_oldest_first_keeps_room_for_all_assignments() -> None:
    """Four assignments leave room for three fixes of 16 B in 64 B, five for two."""
    mf = {"modem": "s2c_instant", "overfull": "oldest_first"}
    for count, carried in ((4, 3), (5, 2)):
        frames = simulate(near(count, acoustics={"mf": mf}, duration_s=10.0)).tables["broadcasts"]
        assert set(frames.fixes) == {carried}
        assert set(frames.named) == {count}


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"protocol": {"downlink": "direct_reply"}}, "direct_reply answers each ping at once"),
        ({"protocol": {"downlink": "pipelined_group"}}, "use sequential or pipelined_round"),
        (
            {"protocol": {"knowledge": {"missed": "contention"}, "schedule": "worst_first"}},
            "worst_first names some, and the others cannot tell",
        ),
        (
            {"protocol": {"knowledge": {"assignment_bytes": 20}},
             "acoustics": {"mf": {"payload_bytes": 24}}},
            "a message has room for 16 B beside its header, and one slot takes 20 B",
        ),
        (
            {"auvs": {"count": 30},
             "acoustics": {"mf": {"modem": "s2c_instant", "overfull": "oldest_first"}}},
            "tells 30 AUVs their slots in 60 B, which leaves no fix of 16 B",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_told_is_refused(changes: dict[str, Any], told: str) -> None:
    """Downlinks whose rounds no frame foretells, and messages that hold no assignments."""
    with pytest.raises(ValueError, match=told):
        scenario(**merged({"protocol": {"knowledge": {"model": "broadcast"}}}, changes))


@pytest.mark.parametrize("missed", MISSED)
def test_several_vessels_at_once_tell_each_its_own(missed: str) -> None:
    """Parallel broadcasts name the AUVs that are nearest, which so know every slot."""
    told = {
        rule: apart(missed, protocol={"broadcaster": rule}).auvs.slots_missed.tolist()
        for rule in ("parallel", "rotate")
    }
    assert told["parallel"] == [0, 0]
    assert min(told["rotate"]) > 0


@pytest.mark.parametrize("schedule", ["super_tdma", "worst_first", "dsatur"])
def test_other_schedules_are_told_as_well(schedule: str) -> None:
    """Slots of any length, or for some AUVs alone: rounds begin and go on as their frames said."""
    result = simulate(
        near(4, protocol={"schedule": schedule, "knowledge": {"missed": "last_slot"}})
    )
    assert result.auvs.slots_missed.tolist() == [0] * 4
    assert len(result.tables["assignments"]) == len(result.tables["pings"])
    assert result.auvs.fixes_delivered.min() > 5


@pytest.mark.parametrize(
    ("schedule", "downlink"),
    [
        ("super_tdma", "sequential"),
        ("worst_first", "pipelined_round"),
        pytest.param("super_tdma", "pipelined_round", marks=pytest.mark.slow),
        pytest.param("worst_first", "sequential", marks=pytest.mark.slow),
    ],
)
def test_who_comes_into_range_before_a_round_begins_is_allowed_for(
    schedule: str, downlink: str
) -> None:
    """Rounds are planned a frame or a round before they begin: 68 and 18 pings collided here."""
    exact = dict.fromkeys(
        ("tdoa_sd_s", "travel_time_sd_s", "quantum_s", "roll_sd_deg", "pitch_sd_deg",
         "heading_sd_deg"), 0.0,
    )  # fmt: skip
    outcomes: list[str] = []
    for reach in (30.0, 40.0, 50.0):
        world = scenario(
            duration_s=200.0, survey={"side_m": 120.0}, usbl=exact,
            asvs={"count": 2, "formation": {"radius_m": 30.0}},
            auvs={"count": 5, "speed_m_per_s": 5.0,
                  "vehicle": {"model": "kinematic", "turning_radius_m": 2.0},
                  "route": {"lane_spacing_m": 6.0}},
            acoustics={"loss": {"law": "none"}, "hf": {"range_m": reach}, "mf": {"range_m": 1e3}},
            protocol={"schedule": schedule, "downlink": downlink, "knowledge": "broadcast",
                      "forget_after_s": None, "broadcaster": "fixed",
                      "positions": "carried_forward"},
        )  # fmt: skip
        outcomes += simulate(world).tables["receptions"]["outcome"].tolist()
    assert outcomes.count("collided") == 0
    assert outcomes.count("heard") > 1000


@pytest.mark.parametrize("schedule", ["super_tdma", "worst_first", "one_per_slot"])
def test_a_last_slot_that_is_another_s_by_now_is_told(schedule: str) -> None:
    """Schedules that deal slots anew are warned of, and `explain` says whose slot it was."""
    world = paper_case(
        3, duration_s=60.0, record={"detail": "full"}, auvs={"count": 6},
        acoustics={"mf": {"range_m": 60.0}},
        protocol={"schedule": schedule, "knowledge": {"model": "broadcast", "missed": "last_slot"}},
    )  # fmt: skip
    warned = [it.message for it in warnings_of(world) if it.key == "protocol.knowledge.missed"]
    assert [schedule in it for it in warned] == [True] * (schedule != "one_per_slot")
    result = simulate(world)
    pings, known = result.tables["pings"], result.tables["assignments"].query("outcome == 'known'")
    beside = pings.merge(known, on=["round", "slot", "auv"], how="left")
    reckoned = pings.ping[beside.outcome.isna().to_numpy()].tolist()
    assert len(reckoned) > 10
    told = each_explained(result, "ping", reckoned[:8])
    assert any("by now, of AUV" in it for it in told)
