"""Random access as a whole: cycles of the downlink, conservation, failures, and what it refuses."""

from typing import Any

import numpy as np
import pytest
from commands_for_tests import each_explained
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from worlds import merged, scenario

from bindusbl_des import Mission, Result, Scenario, Setup, simulate, warnings_of
from bindusbl_des.apps.planning.prediction.gathering import inputs_of
from bindusbl_des.apps.preflight.effort import effort

RANDOM_ACCESS = ["aloha", "slotted_aloha", "csma"]

MOVING = {
    "duration_s": 40.0,
    "auvs": {"count": 4, "speed_m_per_s": 2.0},
    "asvs": {"count": 3, "formation": {"radius_m": 35.0}},
    "survey": {"side_m": 100.0},
    "protocol": {"frame_s": 0.8},
}


def moving(schedule: Any, **changes: Any) -> Scenario:
    """Four AUVs on lanes under three ASVs, which ping as they like."""
    return scenario(**merged(merged(MOVING, {"protocol": {"schedule": schedule}}), changes))


def same(one: Result, other: Result) -> bool:
    """Tell whether two missions have the same tables."""
    return all(table.equals(other.arrow[name]) for name, table in one.arrow.items())


@pytest.mark.parametrize("schedule", RANDOM_ACCESS)
@pytest.mark.parametrize("rate", [None, 30.0])
def test_a_round_is_a_cycle_of_the_downlink(schedule: str, rate: float | None) -> None:
    """It begins as MF is free, broadcasts once, as soon as a fix waits, and ends with that slot."""
    result = simulate(moving(schedule, protocol={"tick_rate_hz": rate}), 4)
    slots, clock = result.setup.slots, result.setup.slots.clock
    rounds, frames = result.tables["rounds"], result.tables["broadcasts"]
    assert len(rounds) > 20
    assert set(rounds.colours) == {0}
    assert frames["round"].tolist() == list(range(len(frames)))  # each its own, none empty
    assert frames.fixes.min() >= 1
    whole = rounds[: len(frames)]
    assert whole.fixes.tolist() == frames.fixes.tolist()
    sent, begun = frames.sent_at_s.to_numpy(), whole.started_at_s.to_numpy()
    assert whole.uplink_s.to_numpy() == pytest.approx(sent - begun, abs=1e-9)
    over = [
        clock.after(at, slots.downlink_slot(n)) for at, n in zip(sent, frames.fixes, strict=True)
    ]
    assert begun[1:] == pytest.approx(over[:-1], abs=1e-12)
    met = result.tables["receptions"]
    heard_by = met[met.outcome != "out_of_range"].groupby("ping").arrived_at_s.max()
    fixes = result.tables["fixes"]
    known = heard_by[fixes.ping].to_numpy() + result.scenario.acoustics.hf.ping_s
    for number, at in enumerate(sent):
        first = known[(fixes.broadcast_at_s == at).to_numpy()].min()
        earliest = max(begun[number], clock.after(first - 1e-12, 0.0))
        assert at == pytest.approx(earliest, abs=1e-9)


@pytest.mark.parametrize("schedule", RANDOM_ACCESS)
def test_each_ping_has_one_outcome_everywhere(schedule: str) -> None:
    """Pings are in order and in the round under way; each is met by every ASV, and fixed once."""
    result = simulate(moving(schedule), 4)
    pings, met, fixes = (result.tables[it] for it in ("pings", "receptions", "fixes"))
    rounds = result.tables["rounds"]
    assert (np.diff(pings.sent_at_s) >= 0.0).all()
    begun = rounds.started_at_s.to_numpy()
    assert pings["round"].tolist() == (begun.searchsorted(pings.sent_at_s, "right") - 1).tolist()
    assert set(pings.slot) == {0}
    assert (met.groupby("ping").asv.nunique() == 3).all()
    assert len(met) == 3 * len(pings)
    heard = met[met.outcome == "heard"].groupby("ping").size()
    assert pings.heard_by[heard.index].tolist() == heard.tolist()
    assert sorted(fixes.ping) == sorted(heard.index)
    assert pings.waited_s.isna().all() == (schedule != "csma")


@given(st.integers(0, 2**16), st.sampled_from(RANDOM_ACCESS), st.data())
@settings(max_examples=12, deadline=None)
def test_who_looks_changes_nothing(seed: int, schedule: str, data: st.DataObject) -> None:
    """A mission that is stopped at any instants has the tables of one that was not."""
    plan = moving(schedule, duration_s=8.0, protocol={"frame_s": 0.3})
    mission = Mission(plan, seed)
    for instant in sorted(data.draw(st.lists(st.floats(0.0, 8.0), max_size=6))):
        mission.advance(instant)
        mission.auvs()
        mission.pings_under_way()
    assert same(mission.result(), simulate(plan, seed))


@pytest.mark.parametrize("schedule", RANDOM_ACCESS)
def test_happenings_are_told_as_they_are_recorded(schedule: str) -> None:
    """Who waits for pings and deliveries has each, and changes nothing."""
    plan = moving(schedule, duration_s=10.0)
    mission = Mission(plan, 2)
    told = list(mission.happenings("ping", "delivery"))
    result = mission.result()
    assert same(result, simulate(plan, 2))
    pings, fixes = result.tables["pings"], result.tables["fixes"]
    assert [it.row.ping for it in told if it.kind == "ping"] == pings.ping.tolist()
    waited = [it.row.waited_s for it in told if it.kind == "ping"]
    assert waited == [None if np.isnan(it) else it for it in pings.waited_s]
    delivered = fixes[fixes.outcome == "delivered"].sort_values(["delivered_at_s", "fix"])
    assert [it.row.fix for it in told if it.kind == "delivery"] == delivered.fix.tolist()


def test_policies_with_rounds_mean_the_same() -> None:
    """There is no round to wait for: each broadcasts as soon as MF is free."""
    one, *others = (
        simulate(moving("aloha", protocol={"downlink": policy}), 1)
        for policy in ("sequential", "pipelined_round", "pipelined_group")
    )
    assert all(same(one, other) for other in others)


def test_direct_replies_need_no_cycles() -> None:
    """Each ping is answered as it is heard, all in one round that lasts as long as the mission."""
    result = simulate(moving("aloha", protocol={"downlink": "direct_reply"}), 1)
    assert len(result.tables["rounds"]) == 1
    fixes = result.tables["fixes"]
    assert result.tables["rounds"].fixes.tolist() == [len(fixes)]
    assert fixes.latency_s.max() < 0.3
    at_random = simulate(moving("aloha"), 1)
    assert result.arrow["pings"]["sent_at_s"].equals(at_random.arrow["pings"]["sent_at_s"])


def test_while_all_asvs_have_failed_fixes_wait() -> None:
    """AUVs ping on, knowing nothing of it; the first ASV to work again broadcasts what waits."""
    failures = [{"asv": asv, "at_s": 10.0, "until_s": 20.0 + asv} for asv in range(3)]
    result = simulate(moving("aloha", asvs={"failures": failures}), 1)
    pings, frames = result.tables["pings"], result.tables["broadcasts"]
    assert pings.sent_at_s.between(10.0, 20.0).sum() > 20
    assert not frames.sent_at_s.between(10.0, 20.0, inclusive="neither").any()
    assert pings.in_range_of[pings.sent_at_s.between(10.0, 19.9)].max() == 0
    again = frames[frames.sent_at_s >= 20.0].iloc[0]
    assert again.asv == "ASV0"
    gone = simulate(
        moving("aloha", asvs={"failures": [{"asv": n, "at_s": 10.0} for n in range(3)]})
    )
    assert gone.tables["broadcasts"].sent_at_s.max() < 10.0
    assert gone.tables["pings"].sent_at_s.max() > 39.0


def test_what_does_not_fit_a_message_waits_for_the_next() -> None:
    """One fix a message: older fixes first, a broadcast each, one after the other."""
    mf = {"payload_bytes": 24, "overfull": "oldest_first"}
    result = simulate(moving("aloha", acoustics={"mf": mf}), 1)
    frames, fixes = result.tables["broadcasts"], result.tables["fixes"]
    assert set(frames.fixes) == {1}
    sent = fixes.broadcast_at_s.dropna().to_numpy()
    assert (np.diff(sent) > 0.0).all()
    assert fixes.broadcast_at_s.isna().sum() > 10  # more pings than MF holds


@pytest.mark.parametrize("schedule", RANDOM_ACCESS)
def test_what_needs_slots_is_refused(schedule: str) -> None:
    """Nobody calls an AUV that pings as it likes, and no downlink of one's own has rounds."""
    with pytest.raises(ValidationError, match="AUVs ping as they like; use owtt_sync"):
        moving(schedule, protocol={"ranging": "twtt"})
    with pytest.raises(ValidationError, match="use one that ships, or a schedule with slots"):
        moving(schedule, protocol={"downlink": "parts:late"})
    found = {it.key for it in warnings_of(moving(schedule, protocol={"ranging": "passive"}))}
    assert "protocol.schedule" in found  # ASVs ping, and AUVs have no schedule at all


@pytest.mark.parametrize("schedule", RANDOM_ACCESS)
def test_errors_are_not_predicted(schedule: str) -> None:
    """There are no rounds to predict by, which is told."""
    with pytest.raises(ValueError, match="has no rounds to predict errors by"):
        inputs_of(Setup(moving(schedule)))


@pytest.mark.parametrize("schedule", RANDOM_ACCESS)
def test_what_it_takes_is_estimated(schedule: str) -> None:
    """Pings, receptions and fixes are counted as they come about, within a fifth."""
    plan = moving(schedule, duration_s=200.0)
    counts, result = effort(Setup(plan)).counts, simulate(plan, 0)
    assert counts["pings"] == pytest.approx(len(result.tables["pings"]), rel=0.2)
    assert counts["receptions"] == pytest.approx(len(result.tables["receptions"]), rel=0.2)
    assert counts["rounds"] == pytest.approx(len(result.tables["rounds"]), rel=0.5)


@pytest.mark.parametrize("schedule", RANDOM_ACCESS)
def test_each_ping_and_fix_is_explained(schedule: str) -> None:
    """Why it was sent then, who else was on the air, and what its fix has waited for."""
    result = simulate(moving(schedule, protocol={"frame_s": 0.2}, duration_s=4.0), 1)
    told = each_explained(result, "ping", result.tables["pings"].ping[:24])
    assert all("AUVs ping as they like" in it for it in told)
    assert any("nobody else" in it for it in told)
    assert any("others ping meanwhile: AUV" in it for it in told)
    assert any("overlaps ping" in it for it in told)
    rule = {
        "aloha": "an instant of its own Poisson process",
        "slotted_aloha": "in the one before",
        "csma": "held back for",
    }[schedule]
    assert any(rule in " ".join(it.split()) for it in told)
    fixes = result.tables["fixes"]
    broadcast = fixes.fix[fixes.broadcast_by.notna()]
    known = each_explained(result, "fix", broadcast[:4])
    plain = [" ".join(it.split()) for it in known]
    assert any("MF was free, so that it is broadcast at once" in it for it in plain)
    assert any("frames before it held the band until now" in it for it in plain)
