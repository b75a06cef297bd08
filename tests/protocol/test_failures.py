"""ASVs that fail: what they miss, who takes over, and that nothing else changes."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands_for_tests import explained
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds import QUIET_NAVIGATION, QUIET_USBL, merged, scenario

from bindusbl_des import Result, Scenario, Setup, load_result, simulate, warnings_of


def between_two(*failures: dict[str, float], **changes: Any) -> Scenario:
    """Two AUVs hold at the surface, 15 and 30 m from ASV0, ASV1 at 45 m; nothing is lost, no noise.

    A ping is 10 ms long and takes 10 ms for 15 m: slots of 100 ms, then 0.5 s for the downlink.
    """
    base = {
        "duration_s": 6.0,
        "survey": {"side_m": 60.0, "depth_m": 0.0},
        "auvs": {"count": 2, "route": {"kind": "hold", "positions_m": [[15.0, 0.0], [30.0, 0.0]]}},
        "asvs": {
            "count": 2,
            "formation": {"positions_m": [[0.0, 0.0], [45.0, 0.0]]},
            "failures": list(failures),
        },
        "acoustics": {"loss": {"law": "none"}},
        "protocol": {"downlink_guard_s": 0.0, "shortest_downlink_slot_s": 0.5},
        "usbl": QUIET_USBL,
        "navigation": QUIET_NAVIGATION,
    }
    return scenario(**merged(base, changes))


def outcomes(result: Result, asv: str) -> dict[float, str]:
    """Return what became of pings at an ASV by when they arrived (ms)."""
    met = result.tables["receptions"]
    met = met[met.asv == asv]
    return {round(1e3 * at): it for at, it in zip(met.arrived_at_s, met.outcome, strict=True)}


def test_who_hears_what_when() -> None:
    """AUV0 pings at 0, 0.7, 1.4 ... s, AUV1 0.1 s later; ASV1 fails at 0.725 s, while it hears.

    AUV0's ping of 0.7 s comes to it at 0.720 s and would end at 0.730 s: it is lost; at ASV0, where
    it comes at 0.710 s, it is heard.  From then on ASV1 is not there.
    """
    result = simulate(between_two({"asv": 1, "at_s": 0.725}), 0)
    there = outcomes(result, "ASV1")
    assert [there[at] for at in (20, 110, 720)] == ["heard", "heard", "lost"]
    assert {outcome for at, outcome in there.items() if at > 720} == {"out_of_range"}
    assert set(outcomes(result, "ASV0").values()) == {"heard"}
    pings = result.tables["pings"]
    assert pings.in_range_of.tolist()[:4] == [2, 2, 2, 1]
    assert pings.heard_by.tolist()[:4] == [2, 2, 1, 1]
    assert result.tables["fixes"].asvs.tolist()[:4] == ["ASV0 ASV1", "ASV0 ASV1", "ASV0", "ASV0"]
    told = explained(result, ping=2)
    assert "ASV1 loses it" in told
    assert "ASV1 failed at 0.725 s, while it was hearing it" in told
    assert "ASV1 had failed at 0.725 s" in explained(result, ping=3)


def test_who_fails_as_a_ping_ends_has_heard_it() -> None:
    """The ping of 0.7 s ends at 0.730 s."""
    result = simulate(between_two({"asv": 1, "at_s": 0.7301}), 0)
    assert outcomes(result, "ASV1")[720] == "heard"


def test_a_frame_that_is_on_the_air_is_cut() -> None:
    """ASV1 sends the second frame from 0.9 s on, for 0.32 s, and fails at 1.0 s: both fixes lost.

    The downlink slot lasts as it was planned, and ASV0 takes over.
    """
    result = simulate(between_two({"asv": 1, "at_s": 1.0}), 0)
    frames, fixes = result.tables["broadcasts"], result.tables["fixes"]
    assert frames.asv.tolist()[:4] == ["ASV0", "ASV1", "ASV0", "ASV0"]
    assert frames.sent_at_s.tolist()[:3] == pytest.approx([0.2, 0.9, 1.6])
    assert frames.airtime_s.tolist()[:3] == pytest.approx([0.32, 0.1, 0.32])
    assert fixes.outcome.tolist()[:6] == ["delivered"] * 2 + ["lost"] * 2 + ["delivered"] * 2
    told = explained(result, fix=2)
    assert "never delivered: ASV1 failed at 1 s, while it broadcast" in " ".join(told.split())
    assert "cut after 0.1000 s" in " ".join(told.split())
    assert result.auvs.fixes_lost.tolist() == [1, 1]


def test_who_works_again_hears_and_broadcasts_again() -> None:
    result = simulate(between_two({"asv": 1, "at_s": 1.0, "until_s": 3.0}), 0)
    there = outcomes(result, "ASV1")
    assert {it for at, it in there.items() if 1000 <= at < 3000} == {"out_of_range"}
    assert {it for at, it in there.items() if at >= 3000} == {"heard"}
    frames = result.tables["broadcasts"]
    assert set(frames.asv[(frames.sent_at_s >= 1.0) & (frames.sent_at_s < 3.0)]) == {"ASV0"}
    assert set(frames.asv[frames.sent_at_s >= 3.0]) == {"ASV0", "ASV1"}


def test_while_nobody_works_no_round_begins() -> None:
    """Both fail from 1 to 3 s: the round of 0.7 s is the last before 3 s, where the next begins."""
    both = ({"asv": asv, "at_s": 1.0, "until_s": 3.0} for asv in (0, 1))
    result = simulate(between_two(*both), 0)
    assert result.tables["rounds"].started_at_s.tolist()[:4] == pytest.approx([0.0, 0.7, 3.0, 3.7])
    for_good = simulate(between_two(*({"asv": asv, "at_s": 1.0} for asv in (0, 1))), 0)
    assert len(for_good.tables["rounds"]) == 2
    assert for_good.auvs.fix_age_max_s.min() > 4.9  # dead reckoning to the end
    assert for_good.tables["fixes"].outcome.tolist() == ["delivered"] * 2 + ["lost"] * 2


def test_fixes_wait_while_nobody_works() -> None:
    """All fail at 0.15 s, in the first round, whose pings are heard, and work again from 2 s."""
    both = ({"asv": asv, "at_s": 0.15, "until_s": 2.0} for asv in (0, 1))
    result = simulate(between_two(*both), 0)
    fixes = result.tables["fixes"]
    assert fixes.pinged_at_s.tolist()[:4] == pytest.approx([0.0, 0.1, 2.0, 2.1])
    assert fixes.broadcast_at_s.tolist()[:4] == pytest.approx([2.2] * 4)
    assert set(fixes.outcome[:-2]) == {"delivered"}


def test_frames_go_on_from_when_somebody_works_again() -> None:
    """Rounds of 1 s each; none from 2 s on until 3.5 s, from where on there is one each second."""
    both = ({"asv": asv, "at_s": 1.9, "until_s": 3.5} for asv in (0, 1))
    result = simulate(between_two(*both, protocol={"schedule": "round_robin"}, duration_s=7.0), 0)
    starts = result.tables["rounds"].started_at_s.tolist()
    assert starts == pytest.approx([0.0, 1.0, 3.5, 4.5, 5.5, 6.5])
    assert result.tables["pings"].auv.tolist() == ["AUV0", "AUV1"] * 3


def test_the_conflict_graph_follows() -> None:
    """Both AUVs are heard by ASV1, which keeps them apart; once it has failed, nothing does."""
    apart = {
        "auvs": {"route": {"positions_m": [[30.0, 0.0], [60.0, 0.0]]}},
        "acoustics": {"hf": {"range_m": 29.0}},
    }
    rounds = simulate(between_two({"asv": 1, "at_s": 3.0}, **apart), 0).tables["rounds"]
    before = rounds.started_at_s < 3.0
    assert set(rounds.conflicts[before]) == {1}
    assert set(rounds.colours[before]) == {2}
    assert set(rounds.conflicts[~before]) == {0}
    assert set(rounds.colours[~before]) == {1}


@pytest.mark.parametrize(
    "broadcaster", ["rotate", "random", "most_fixes", "nearest", "fixed", "parallel"]
)
def test_no_broadcaster_chooses_who_has_failed(broadcaster: str) -> None:
    protocol = {"broadcaster": broadcaster}
    frames = simulate(between_two({"asv": 0, "at_s": 2.0}, protocol=protocol), 0).tables[
        "broadcasts"
    ]
    assert "ASV0" in set(frames.asv[frames.sent_at_s < 2.0])
    assert set(frames.asv[frames.sent_at_s >= 2.0]) == {"ASV1"}


def stubborn(view: Any) -> int:
    """A broadcaster that does not look who has failed."""
    return 1


def careful(view: Any) -> int:
    """A broadcaster that does."""
    return next(asv for asv in range(view.count) if asv not in view.failed)


SEEN: list[tuple[bool, tuple[int, ...], bool]] = []


def watching(view: Any) -> list[list[int]]:
    """A schedule that notes what it sees of ASV1."""
    SEEN.append((view.time >= 2.0, view.failed, bool(view.heard[:, 1].any())))
    return [[0], [1]]


def asking(slot: Any, time: float) -> Any:
    """A ranging in which ASV1 calls, whatever has become of it."""
    slot.call(slot.group, [1] * len(slot.group), time)
    yield slot.until(time + 0.01)


GONE = {"asv": 1, "at_s": 2.0}


def test_a_broadcaster_of_ones_own_is_told() -> None:
    told = r"returned 1 in broadcast 3, but ASV1 has failed by 2\.3 s; .*not among view\.failed"
    with pytest.raises(ValueError, match=told):
        simulate(between_two(GONE, protocol={"broadcaster": stubborn}), 0)
    world = between_two(GONE, protocol={"broadcaster": careful})
    assert set(simulate(world, 0).tables["broadcasts"].asv) == {"ASV0"}


def test_a_schedule_of_ones_own_sees_it_gone() -> None:
    SEEN.clear()
    simulate(between_two(GONE, protocol={"schedule": watching}), 0)
    assert set(SEEN) == {(False, (), True), (True, (1,), False)}


def test_a_ranging_of_ones_own_cannot_let_it_call() -> None:
    told = r"ASV1 has failed by 2\.\d+ s; let another one call"
    with pytest.raises(ValueError, match=told):
        simulate(between_two(GONE, protocol={"ranging": asking}), 0)


def test_another_asv_calls() -> None:
    """Two-way ranging: AUV0 is nearest to ASV0, which fails, so that ASV1 calls it; a call that is
    cut is lost.
    """
    two_way = {"protocol": {"ranging": "twtt"}}
    pings = simulate(between_two({"asv": 0, "at_s": 2.0}, **two_way), 0).tables["pings"]
    first = pings[pings.auv == "AUV0"]
    assert set(first.called_by[first.called_at_s < 2.0]) == {"ASV0"}
    assert set(first.called_by[first.called_at_s >= 2.0]) == {"ASV1"}
    begun = float(first.called_at_s.iloc[1])
    result = simulate(between_two({"asv": 0, "at_s": begun + 0.005}, **two_way), 0)
    cut = result.tables["pings"]
    cut = cut[cut.called_at_s == begun]
    assert cut.call.tolist() == ["lost"]
    told = explained(result, ping=int(cut.ping.iloc[0]))
    assert f"ASV0 failed at {begun + 0.005:g} s, while it called" in told


def test_asvs_that_ping_leave_their_turn_to_others() -> None:
    """Passive ranging: who has failed has no slot, so the others' come round sooner."""
    passive = {"protocol": {"ranging": "passive"}}
    result = simulate(between_two({"asv": 1, "at_s": 3.0}, **passive), 0)
    pings, rounds = result.tables["pings"], result.tables["rounds"]
    assert set(pings.asv[pings.sent_at_s < 3.0]) == {"ASV0", "ASV1"}
    assert set(pings.asv[pings.sent_at_s >= 3.0]) == {"ASV0"}
    late = rounds.started_at_s >= 3.0
    assert set(rounds.colours[~late]) == {2}
    assert set(rounds.colours[late]) == {1}
    sent = float(pings.sent_at_s[pings.asv == "ASV1"].iloc[1])
    result = simulate(between_two({"asv": 1, "at_s": sent + 0.005}, **passive), 0)
    pings, met = result.tables["pings"], result.tables["receptions"]
    cut = met[met.ping == pings.ping[pings.sent_at_s == sent].iloc[0]]
    assert cut.outcome.tolist() == ["lost", "lost"]
    told = explained(result, ping=int(cut.ping.iloc[0]))
    assert f"ASV1 failed at {sent + 0.005:g} s, while it pinged" in " ".join(told.split())


MODES: list[dict[str, Any]] = [
    {},
    {"ranging": "twtt"},
    {"ranging": "passive"},
    {"downlink": "direct_reply"},
    {"downlink": "pipelined_group", "broadcaster": "nearest"},
    {"schedule": "random", "tick_rate_hz": 30.0},
]
spans = st.tuples(st.integers(0, 3), st.floats(0.0, 20.0), st.floats(0.1, 9.0) | st.none())


@pytest.mark.parametrize("protocol", MODES, ids=str)
@settings(max_examples=6, deadline=None)
@given(failed=st.lists(spans, max_size=5), seed=st.integers(0, 99))
def test_nothing_is_missing_and_nobody_hears_who_has_failed(
    protocol: dict[str, Any], failed: list[tuple[int, float, float | None]], seed: int
) -> None:
    """Every ping is accounted for at every ASV, whoever fails when; no failed ASV has any part."""
    given: list[dict[str, Any]] = []
    for asv, begin, length in failed:
        if not any(it["asv"] == asv for it in given):
            end = None if length is None else begin + length
            given.append({"asv": asv, "at_s": begin, "until_s": end})
    world = scenario(
        duration_s=20.0,
        survey={"side_m": 80.0},
        asvs={"count": 4, "failures": [it for it in given if it["at_s"] < 20.0]},
        protocol=protocol,
    )
    result = simulate(world, seed)
    tables, failures = result.tables, Setup(world).failures
    assert len(tables["receptions"]) == len(tables["pings"]) * (
        3 if world.protocol.asvs_ping else 4
    )
    counts = result.auvs[["fixes_delivered", "fixes_out_of_range", "fixes_lost", "fixes_in_flight"]]
    assert counts.sum(axis=1).tolist() == result.auvs.fixes.tolist()
    if failures is None:
        return
    it: Any
    for it in tables["receptions"].query("outcome == 'heard'").itertuples():
        number, ends = int(it.asv[3:]), it.arrived_at_s + world.acoustics.hf.ping_s
        if world.protocol.asvs_ping:
            ends -= it.travel_time_s
        begins = ends - world.acoustics.hf.ping_s
        missed, cut = failures.met([number], begins, ends)
        assert not missed[0]
        assert not cut[0]
    for it in tables["broadcasts"].itertuples():
        assert int(it.asv[3:]) not in failures.failed(it.sent_at_s)
    for it in tables["pings"].query("called_by.notna()").itertuples():
        assert int(it.called_by[3:]) not in failures.failed(it.called_at_s)


@pytest.mark.parametrize("protocol", [MODES[0], MODES[2]], ids=str)
def test_a_folder_is_read_again_and_its_page_tells_of_failures(
    protocol: dict[str, Any], tmp_path: Path
) -> None:
    """The tables contradict neither the scenario nor each other, whatever failed."""
    failures = {"asv": 1, "at_s": 1.0, "until_s": 3.0}, {"asv": 0, "at_s": 2.0}
    world = between_two(*failures, protocol=protocol)
    simulate(world, 0).write(tmp_path / "run")
    assert load_result(tmp_path / "run").scenario == world
    page = (tmp_path / "run" / "report.html").read_text()
    assert "ASV1 failed at 1 s and worked again from 3 s; ASV0 failed at 2 s." in page


def test_the_same_failures_give_the_same_tables_and_none_before_they_happen() -> None:
    """What happens before a failure is what happens without it, to the last bit."""
    failing, whole = (
        simulate(scenario(duration_s=40.0, asvs={"failures": list(it)}), 5)
        for it in (({"asv": 1, "at_s": 20.0},), ())
    )
    again = simulate(scenario(duration_s=40.0, asvs={"failures": [{"asv": 1, "at_s": 20.0}]}), 5)
    for name in ("pings", "receptions", "fixes", "tracks"):
        assert failing.arrow[name].equals(again.arrow[name])
    for name, instant in (("pings", "sent_at_s"), ("tracks", "time_s")):
        rows = [
            it.tables[name].loc[it.tables[name][instant] < 19.0].reset_index(drop=True)
            for it in (failing, whole)
        ]
        assert rows[0].equals(rows[1])


def test_who_works_when() -> None:
    """Failures hold from their instant on, up to that from which the ASV works again."""
    world = between_two({"asv": 1, "at_s": 2.0, "until_s": 3.0}, {"asv": 0, "at_s": 4.0})
    failures = Setup(world).failures
    assert failures is not None
    for time, working in ((1.9, (1, 1)), (2.0, (1, 0)), (3.0, (1, 1)), (4.0, (0, 1))):
        assert world.asvs.alive(time) == tuple(map(bool, working))
        assert failures.alive(time).tolist() == list(world.asvs.alive(time))
    changes = [0.0, *(failures.next_change(it) for it in (0.0, 2.0, 3.0, 4.0))]
    assert changes == [0.0, 2.0, 3.0, 4.0, np.inf]
    assert failures.worked_s(6.0).tolist() == [4.0, 5.0]
    assert failures.worked_s(2.5).tolist() == [2.5, 2.0]
    assert Setup(between_two()).failures is None


def test_a_modem_that_has_failed_draws_nothing() -> None:
    """Listening costs 1 W: ASV1 works for 2 of 6 s, and is never heard of after that."""
    powers = {"transmit_w": 1.0, "receive_w": 1.0, "idle_w": 1.0}
    world = {"acoustics": {"hf": powers, "mf": {"transmit_w": None}}}
    drawn = [
        simulate(between_two(*it, **world), 0).mission.energy_j.iloc[0]
        for it in ((), ({"asv": 1, "at_s": 2.0},))
    ]
    assert drawn == pytest.approx([4 * 6.0, 3 * 6.0 + 2.0])


def test_failures_are_told_beforehand() -> None:
    late = between_two({"asv": 1, "at_s": 6.0}, {"asv": 0, "at_s": 2.0})
    assert [str(it) for it in warnings_of(late) if "failures" in it.key] == [
        "asvs.failures.0.at_s: has no effect: it is for 6 s, and the mission ends at 6 s; remove it"
    ]
    none = between_two({"asv": 1, "at_s": 3.0}, {"asv": 0, "at_s": 2.0})
    told = [str(it) for it in warnings_of(none) if "failures" in it.key]
    assert len(told) == 1
    assert "asvs.failures.0.at_s: leaves no ASV at 3 s" in told[0]
    assert not any("failures" in it.key for it in warnings_of(between_two({"asv": 1, "at_s": 3.0})))
    at_once = between_two({"asv": 0, "at_s": 0.0}, {"asv": 1, "at_s": 0.0})
    assert [it.key for it in warnings_of(at_once) if "failures" in it.key] == [
        "asvs.failures.0.at_s"
    ]
