"""Polling: AUV after AUV is called, the next as soon as the answer has been decoded."""

import math
from typing import Any

import numpy as np
import pytest
from families_for_tests import allow
from pydantic import ValidationError
from worlds import merged, scenario, still

from bindusbl_des import Result, Scenario, Setup, simulate

PLACES = [[20.0, 0.0], [-36.0, 0.0], [0.0, 45.0]]
PING, SOUND = 0.01, 1500.0


def polled(places: Any = PLACES, **changes: Any) -> Scenario:
    """Return AUVs that hold still around one ASV, polled without loss on the exact clock."""
    base = {
        "duration_s": 20.0,
        "auvs": {"route": {"positions_m": places}},
        "protocol": {"schedule": "polling", "tick_rate_hz": None},
    }
    return still(len(places), **merged(base, changes))


def polls(turnaround: float = 0.0) -> np.ndarray:
    """Return how long (s) each AUV takes: two pings, the turnaround and both ways."""
    ways = np.hypot(np.linalg.norm(PLACES, axis=1), 10.0)
    return np.asarray(2 * PING + turnaround + 2 * ways / SOUND)


@pytest.mark.parametrize(
    ("ranging", "turnaround"),
    [("owtt_sync", 0.0), ("twtt", 0.0), ({"model": "twtt", "turnaround_s": 0.05}, 0.05)],
)
def test_a_round_is_the_sum_of_its_round_trips(ranging: Any, turnaround: float) -> None:
    """Sum of 2 T_P + turnaround + 2 d / c, to a nanosecond; each call at the end of an answer."""
    result = simulate(polled(protocol={"ranging": ranging}))
    rounds, pings = result.tables["rounds"], result.tables["pings"]
    assert rounds.uplink_s[:-1].to_numpy() == pytest.approx(polls(turnaround).sum(), abs=1e-9)
    first = pings[pings["round"] == 0]
    called = np.concatenate(([0.0], np.cumsum(polls(turnaround))[:-1]))
    assert first.called_at_s.to_numpy() == pytest.approx(called, abs=1e-9)
    assert first.auv.tolist() == ["AUV0", "AUV1", "AUV2"]
    assert set(result.tables["receptions"].outcome) <= {"heard", "in_flight"}


# Header and one fix, 24 B at 2000 bit/s and overhead 2, and the guard of 1.25 t_C
ANSWERS = {"frame": 0.192 + 1.25 * 0.04, "instant": 0.0}


@pytest.mark.parametrize(("reply", "answer"), ANSWERS.items())
def test_without_any_downlink_slot_the_next_round_follows_at_once(
    reply: str, answer: float
) -> None:
    """Direct replies: 20 s hold as many round trips and answers as fit, and each brings a fix."""
    result = simulate(polled(protocol={"downlink": {"model": "direct_reply", "reply": reply}}))
    rounds = 20.0 / (polls() + answer).sum()
    assert len(result.tables["pings"]) == pytest.approx(3 * rounds, abs=3)
    assert result.auvs.fixes_delivered.sum() == pytest.approx(3 * rounds, abs=3)


def test_calls_begin_on_ticks() -> None:
    """At 30 Hz each poll takes whole ticks: 50, 70 and 81 ms are two, three and three of them."""
    result = simulate(polled(protocol={"tick_rate_hz": 30.0}))
    pings = result.tables["pings"]
    ticks = pings[pings["round"] == 0].called_at_s.to_numpy() * 30.0
    assert ticks == pytest.approx([0.0, 2.0, 5.0])
    assert result.tables["rounds"].uplink_s[0] == pytest.approx(8.0 / 30.0)


def test_who_is_not_answered_waits_for_the_slot() -> None:
    """An AUV out of range is called, and its two-way slot waited for; others are not delayed."""
    result = simulate(polled([*PLACES[:2], [300.0, 0.0]]))
    pings, wait = result.tables["pings"], result.setup.slots.uplink_slot
    assert pings[pings.auv == "AUV2"].call.unique().tolist() == ["out_of_range"]
    assert wait == pytest.approx(max(2 * PING + 2 * math.hypot(50, 10) / SOUND + 0.02, 0.1))
    length = polls()[:2].sum() + wait
    assert result.tables["rounds"].uplink_s[:-1].to_numpy() == pytest.approx(length, abs=1e-9)


def test_who_does_not_decode_an_answer_waits_too() -> None:
    """Where one ping in three is lost, polls last one round trip, or T_UL: nothing in between."""
    loss = {"law": "none", "combine": "clamp_first", "contention_per_auv": 0.15}
    world = polled(acoustics={"loss": loss}, protocol={"downlink": "direct_reply"})
    result = simulate(world, 3)
    pings, met = result.tables["pings"], result.tables["receptions"]
    lasted = np.diff(pings.called_at_s)
    decoded = set(met.ping[met.outcome == "heard"])
    answered = pings.ping.isin(decoded).to_numpy()[:-1]
    own = polls()[[int(name[3:]) for name in pings.auv[:-1]]] + ANSWERS["frame"]
    wait = Setup(world).slots.uplink_slot
    assert 0.3 < answered.mean() < 0.8
    assert lasted == pytest.approx(np.where(answered, own, wait), abs=1e-9)


def test_the_nearest_of_two_calls_and_both_hear() -> None:
    """One after the other by default; side by side where no ASV hears both."""
    far = {"positions_m": [[0.0, 0.0], [200.0, 0.0]]}
    places = [[20.0, 0.0], [180.0, 0.0], [-30.0, 0.0]]
    one = simulate(polled(places, asvs={"count": 2, "formation": far}))
    pings = one.tables["pings"]
    assert pings.called_by[:3].tolist() == ["ASV0", "ASV1", "ASV0"]
    assert set(one.tables["rounds"].colours) == {3}
    both = {"model": "polling", "side_by_side": True}
    two = simulate(polled(places, asvs={"count": 2, "formation": far}, protocol={"schedule": both}))
    first = two.tables["pings"].iloc[:3]
    assert first.called_by.tolist() == ["ASV0", "ASV1", "ASV0"]
    trips = 2 * PING + 2 * np.hypot([20.0, 20.0, 30.0], 10.0) / SOUND
    assert first.called_at_s.to_numpy() == pytest.approx([0.0, 0.0, trips[0]], abs=1e-9)
    assert two.tables["rounds"].uplink_s[0] == pytest.approx(trips[0] + trips[2], abs=1e-9)


TIMED: list[float | None] = []


def timing(sounding: Any) -> Any:
    """Note which calls are timed; place nobody well."""
    TIMED.append(sounding.call_time)
    return np.zeros((1, 3)), np.eye(3)[None]


@pytest.mark.parametrize(("ranging", "timed"), [("owtt_sync", False), ("twtt", True)])
def test_ranges_are_those_of_the_ranging(ranging: str, timed: bool) -> None:
    """The way of the call is timed with two-way ranging only."""
    TIMED.clear()
    allow([f"{__name__}:timing"])
    simulate(polled(duration_s=2.0, usbl={"model": timing}, protocol={"ranging": ranging}))
    assert {it is not None for it in TIMED} == {timed}


@pytest.mark.slow
def test_clocks_that_are_wrong_count_where_ranges_are_one_way() -> None:
    """Clocks 1 ms off (sd) move one-way fixes by metres, called or not."""
    usbl = {"model": {"model": "datasheet", "bearing_sd_deg": 0.01}}
    errors = [
        simulate(polled(
            usbl=usbl, navigation={"clock_offset_sd_s": 1e-3}, protocol={"schedule": schedule},
        )).tables["fixes"].error_m[:3].tolist()
        for schedule in ("polling", "one_per_slot")
    ]  # fmt: skip
    assert errors[0] == pytest.approx(errors[1], abs=0.02)
    assert 0.1 < max(errors[0]) < 10.0


@pytest.mark.parametrize("downlink", ["sequential", "pipelined_round", "pipelined_group"])
def test_every_ping_is_accounted_for(downlink: str) -> None:
    """One outcome at each ASV, one fix of each ping that was heard; the same again with a seed."""
    world = scenario(
        duration_s=60.0, survey={"side_m": 140.0}, auvs={"count": 5}, asvs={"count": 3},
        acoustics={"loss": {"combine": "clamp_first"}},
        protocol={"schedule": "polling", "downlink": downlink, "positions": "last_fix"},
    )  # fmt: skip
    result, again = simulate(world, 5), simulate(world, 5)
    pings, met = result.tables["pings"], result.tables["receptions"]
    sent = pings[pings.call == "heard"]
    assert met[met.ping.isin(sent.ping)].groupby("ping").asv.nunique().tolist() == [3] * len(sent)
    heard = met[met.outcome == "heard"].ping.unique()
    assert set(result.tables["fixes"].ping) <= set(heard)
    assert len(heard) - len(result.tables["fixes"]) <= 1
    assert again.tables["pings"].equals(pings)


def test_the_last_caller_that_fails_is_waited_for() -> None:
    """While no ASV works nobody calls, and the mission goes on when one does again."""
    failures = [{"asv": 0, "at_s": 5.03, "until_s": 9.0}]
    result = simulate(polled(asvs={"failures": failures}))
    called = result.tables["pings"].called_at_s.to_numpy()
    assert not ((called > 5.03) & (called < 9.0)).any()
    assert (called >= 9.0).sum() > 20


def silent(slot: Any, time: float) -> Any:
    """Let nobody ping, in a ranging of one's own."""
    yield slot.until(time)


def test_what_polling_does_not_go_with_is_refused_with_a_remedy() -> None:
    with pytest.raises(
        ValidationError, match=r"(?s)polling calls the AUVs itself.*use owtt_sync or"
    ):
        polled(protocol={"ranging": silent})


@pytest.mark.parametrize("ranging", ["owtt_sync", "twtt"])
def test_calls_cost_energy_whatever_is_ranged(ranging: str) -> None:
    """An AUV that answers has sent a ping; all receive every call, and answers within 50 m."""
    modem = {"transmit_w": 10.0, "receive_w": 1.0, "idle_w": 0.0}
    result = simulate(polled(acoustics={"hf": modem}, protocol={"ranging": ranging}))
    answered = np.bincount(result.tables["pings"].auv.str[3:].astype(int))
    apart = np.hypot(*(np.array(PLACES)[:, None] - np.array(PLACES)).transpose(2, 0, 1))
    received = (
        len(PLACES) * answered.sum() + ((apart > 0.0) & (apart <= 50.0)).sum(axis=1) @ answered
    )
    expected = PING * (10.0 * answered.sum() + 1.0 * received)
    assert result.auvs.energy_j.sum() == pytest.approx(expected, rel=3e-3)


def test_latency_from_slots_is_not_told_where_slots_are_not_equal() -> None:
    result: Result = simulate(polled())
    assert result.arrow["auvs"]["latency_from_slot_s"].null_count == 3
