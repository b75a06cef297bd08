"""Programs of access: what a vehicle hears and sends by its own, as its program asks it to."""

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from programs_for_tests import PING_S, Program, flown, held, way_s
from worlds import packets_of, scenario

from bindusbl_des import Result, simulate


def test_a_signal_is_heard_by_all_within_range_when_the_light_time_equation_says() -> None:
    """Kind, sender, whom it is for, what it says, and when; by ASVs as by AUVs."""
    places = [[30.0, 0.0], [30.0, 45.0], [-95.0, 0.0]]
    told: list[tuple[str, Any, float]] = []

    def program(node: Any) -> Iterator[Any]:
        if node.name == "AUV0":
            yield node.until(1.0)
            ended = node.send("hello", to="ASV0", bytes=10, data={"depth": 10.0})
            yield ended
            assert node.clock == 1.08
        else:
            told.append((node.name, (yield node.hears()), node.clock))

    result = flown(places, program)
    assert [name for name, *_ in told] == ["ASV0", "AUV1"]  # the third is 125 m away
    for (_, heard, now), way in zip(
        told, (way_s(places[0], [0.0, 0.0], 10.0), way_s(places[0], places[1])), strict=True
    ):
        assert heard[:3] == ("hello", "AUV0", "ASV0")
        assert (heard.bytes, heard.data) == (10, {"depth": 10.0})
        assert heard.began_at_s == pytest.approx(1.0 + way, abs=1e-12)
        assert heard.ended_at_s == now == pytest.approx(1.08 + way, abs=1e-12)
    (signal,) = result.tables["signals"].to_dict("records")
    assert np.isnan([signal.pop("level_db"), signal.pop("ping")]).all()
    assert signal == {
        "signal": 0, "kind": "hello", "sender": "AUV0", "to": "ASV0", "sent_at_s": 1.0,
        "lasts_s": 0.08, "size_bytes": 10,
    }  # fmt: skip
    received = result.tables["signal_receptions"]
    assert received.listener.tolist() == ["AUV1", "ASV0"]
    assert set(received.outcome) == {"heard"}


def test_what_overlaps_destroys_itself_and_who_sends_is_deaf() -> None:
    """Two signals at a third AUV, which hears neither; and the two do not hear each other."""
    places = [[0.0, 0.0], [60.0, 0.0], [30.0, 30.0]]
    heard = []

    def program(node: Any) -> Iterator[Any]:
        if node.name in ("AUV0", "AUV1"):
            yield node.send("x", lasts_s=0.1)
        heard.append((node.name, (yield node.hears(within_s=5.0))))

    table = flown(places, program).tables["signal_receptions"]
    assert all(got is None for _, got in heard)
    assert set(table.outcome) == {"collided"}
    own = table[table.why == "own_signal"]
    assert sorted(own.listener) == ["AUV0", "AUV1"]
    at_others = table[table.why == "signal"]
    assert sorted(at_others.listener) == ["ASV0", "ASV0", "AUV2", "AUV2"]
    assert sorted(at_others.overlapped_by) == [0, 0, 1, 1]


def test_a_signal_drowns_a_ping_at_an_asv_and_a_ping_a_signal() -> None:
    """One sea for both: the ping is lost there, with what overlapped it, and so is the signal."""
    places = [[30.0, 0.0], [-30.0, 0.0]]

    def program(node: Any) -> Iterator[Any]:
        if node.name == "AUV0":
            yield node.until(1.0)
            yield node.send("ping")
        elif node.name == "AUV1":
            yield node.until(1.005)
            yield node.send("noise", lasts_s=0.2)

    tables = flown(places, program).tables
    (reception,) = tables["receptions"].to_dict("records")
    assert (reception["outcome"], reception["why"]) == ("collided", "signal")
    assert reception["overlapped_by"] == 0
    at_asv = tables["signal_receptions"].query("listener == 'ASV0'")
    assert at_asv[["outcome", "why", "overlapped_by"]].to_numpy().tolist() == [
        ["collided", "ping", 0]
    ]
    # the ping is a sound at the other AUV, which sent itself as it came
    at_auv = tables["signal_receptions"].query("ping == 0")
    assert at_auv[["listener", "why"]].to_numpy().tolist() == [["AUV1", "own_signal"]]


def test_busy_is_what_is_heard_at_the_own_place() -> None:
    """From the front of a signal to its end there, not where it is sent."""
    places, busy = [[0.0, 0.0], [90.0, 0.0]], []
    way = way_s(*places)

    def program(node: Any) -> Iterator[Any]:
        if node.name == "AUV0":
            yield node.send("x", lasts_s=0.02)
        elif node.name == "AUV1":
            for instant in (way - 0.001, way + 0.001, way + 0.019, way + 0.021):
                yield node.until(instant)
                busy.append(node.busy())
            assert node.heard(0.0) == pytest.approx(np.array([(way, way + 0.02)]))

    flown(places, program)
    assert busy == [False, True, True, False]


def test_what_came_meanwhile_is_heard_later_in_its_order() -> None:
    """Nothing that was decoded is lost because a program did something else."""
    places, kinds = [[0.0, 0.0], [40.0, 0.0]], []

    def program(node: Any) -> Iterator[Any]:
        if node.name == "AUV0":
            for kind in ("a", "b"):
                yield node.send(kind, bytes=1)
        elif node.name == "AUV1":
            yield node.until(3.0)
            for _ in range(3):
                got = yield node.hears(within_s=1.0)
                kinds.append(got and (got.kind, round(node.clock, 6)))

    flown(places, program)
    assert kinds == [("a", 3.0), ("b", 3.0), None]


def test_a_signal_is_lost_as_often_as_a_ping_over_the_same_way() -> None:
    """By a chance of its own for each pair of vehicles."""
    places = [[150.0, 0.0], [-100.0, 0.0]]

    def program(node: Any) -> Iterator[Any]:
        if node.name == "AUV0":
            for _ in range(2000):
                yield node.send("x", lasts_s=0.001)
                yield node.wait(0.2)

    loss = {"law": "paper"}
    table = flown(
        places, program, duration_s=410.0, acoustics={"loss": loss, "hf": {"range_m": 300.0}}
    ).tables["signal_receptions"]
    chances = table.groupby("listener").loss_probability.agg(["min", "max"])
    assert (chances["min"] == chances["max"]).all()
    for listener, chance in chances["min"].items():
        lost = (table[table.listener == listener].outcome == "lost").mean()
        assert 0.01 < chance < 0.5
        assert lost == pytest.approx(chance, abs=4.5 * np.sqrt(chance * (1.0 - chance) / 2000))


def test_moving_vehicles_hear_when_they_are_met() -> None:
    """AUVs that steer by their estimates, whose way nobody knows beforehand: as on the record."""
    told: list[tuple[str, float]] = []

    def program(node: Any) -> Iterator[Any]:
        if node.is_asv:
            while True:
                heard = yield node.hears()
                told.append((node.name, heard.ended_at_s))
                assert node.clock == pytest.approx(heard.ended_at_s, abs=2e-3)
        while True:
            yield node.wait(1.0 + node.random.random())
            yield node.send("x", bytes=1)

    plan = scenario(
        duration_s=30.0,
        auvs={"count": 2, "vehicle": "bluerov2", "feedback": "estimate"},
        acoustics={"loss": {"law": "none"}},
        protocol={"access": program},
    )
    table = simulate(plan, 0).tables["signal_receptions"].query("outcome == 'heard'")
    met = 0
    for asv in range(plan.asvs.count):
        ends = sorted(table.arrived_at_s[table.listener == f"ASV{asv}"] + 0.008)
        assert [at for name, at in told if name == f"ASV{asv}"] == pytest.approx(ends, abs=1e-9)
        met += len(ends)
    assert met > 10


def test_tables_of_ones_own_are_read_where_it_is_not_loaded(tmp_path: Path) -> None:
    """Whatever it declares: who reads a folder may not have the part."""

    def program(node: Any) -> Iterator[Any]:
        yield node.send("x", bytes=1)

    program.signals = False  # type: ignore[attr-defined]  # of a function
    folder = flown([[30.0, 0.0]], program).write(tmp_path / "r")
    reader = (
        "import sys, bindusbl_des as b; print(len(b.load_result(sys.argv[1]).tables['signals']))"
    )
    told = subprocess.run([sys.executable, "-c", reader, folder], capture_output=True, text=True)
    assert told.stdout == "2\n", told.stderr


def wrong_send(node: Any) -> Iterator[Any]:
    yield node.send("x", bytes=100)
    node.send("x", bytes=100)
    node.send("y", bytes=1)


def pings_as_asv(node: Any) -> Iterator[Any]:
    yield node.send("ping")


def nobody(node: Any) -> Iterator[Any]:
    yield node.send("x", bytes=1, to="ASV7")


def too_long(node: Any) -> Iterator[Any]:
    yield node.send("x", bytes=10**9)


def nothing(node: Any) -> Iterator[Any]:
    yield node.send("x")


def no_word(node: Any) -> Iterator[Any]:
    yield node.send(3, bytes=1)


def no_number(node: Any) -> Iterator[Any]:
    yield node.wait(float("nan"))


def no_event(node: Any) -> Iterator[Any]:
    yield 5


def raises(node: Any) -> Iterator[Any]:
    yield node.wait(2.5)
    raise KeyError("nothing")


def no_time(node: Any) -> Iterator[Any]:
    yield node.wait(1.5)
    while True:
        yield node.wait(0.0)


def looks_on(node: Any) -> Iterator[Any]:
    yield node.wait(1.5)
    while node.clock < 2.0:
        pass


def takes_all_packets(node: Any) -> Iterator[Any]:
    yield node.wait(1.5)
    yield node.until(max(node.packets))


def no_generator(node: Any) -> int:
    return 3


@pytest.mark.parametrize(
    ("program", "said"),
    [
        (wrong_send, "AUV0 at 0.8 s: send must wait until the vehicle's last signal is over"),
        (pings_as_asv, "for ASV0 at 0 s: `kind` must be another one where an ASV sends"),
        (nobody, "`to` must name a vehicle, such as ASV0; met ASV7"),
        (too_long, "`bytes` must be 0 to 65535; met 1000000000"),
        (nothing, "duration (s) of a signal must be finite and above 0"),
        (no_word, "`kind` must be a word; met 3"),
        (no_number, "wait (s) must be finite and not below 0; met nan"),
        (no_event, "yielded 5 for AUV0 at 0 s; it must be an event"),
        (raises, "raised KeyError for AUV0 at 2.5 s: 'nothing'"),
        (no_time, "takes more than 10,000 steps for AUV0 at 1.5 s while no time goes by"),
        (looks_on, "raised ValueError for AUV0 at 1.5 s: it asks for clock, sounds or packets"),
        (takes_all_packets, "raised ValueError for AUV0 at 1.5 s: it asks for clock, sounds"),
        (no_generator, "returned 3 for AUV0 at 0 s; it must be a generator function"),
    ],
)
def test_a_wrong_step_is_told_with_part_vehicle_and_instant(program: Program, said: str) -> None:
    """The mission ends with one line."""
    with pytest.raises(ValueError, match=f"^protocol.access: .*{re.escape(said)}"):
        flown([[10.0, 0.0], [20.0, 0.0]], program)


def test_who_waits_for_ever_holds_up_nobody() -> None:
    """A program that waits for what never comes does nothing more; the others go on."""

    def program(node: Any) -> Iterator[Any]:
        if node.name == "AUV1":
            yield node.air.env.event()
        while not node.is_asv:
            yield node.wait(1.0)
            yield node.send("ping")

    pings = flown([[10.0, 0.0], [20.0, 0.0]], program).tables["pings"]
    assert set(pings.auv) == {"AUV0"}
    assert len(pings) == 19


def test_signals_cost_energy_and_the_band() -> None:
    """What a modem sends and receives, by its powers; overlaps are received once."""

    def program(node: Any) -> Iterator[Any]:
        if node.name == "AUV0":
            yield node.send("x", lasts_s=2.0)
        elif node.name == "AUV1":
            yield node.until(1.0)
            yield node.send("x", lasts_s=3.0)

    powers = {"transmit_w": 100.0, "receive_w": 10.0, "idle_w": 1.0}
    quiet = {"loss": {"law": "none"}, "hf": powers}
    result = flown([[10.0, 0.0], [20.0, 0.0], [0.0, 10.0]], program, acoustics=quiet)
    sent, waiting = [2.0, 3.0, 0.0], 20.0
    received = [3.0, 2.0, 4.0]
    for auv, (sending, receiving) in enumerate(zip(sent, received, strict=True)):
        drawn = 100.0 * sending + 10.0 * receiving + (waiting - sending - receiving)
        assert result.tables["auvs"].energy_j[auv] == pytest.approx(drawn, abs=0.5)
    assert result.tables["mission"].hf_utilisation[0] == pytest.approx(4.0 / 20.0)


# T-Lohi


def tones_and_pings(result: Result) -> tuple[Any, Any]:
    """Return the tones and the pings of a mission."""
    signals = result.tables["signals"]
    return signals[signals.kind == "tone"], result.tables["pings"]


def test_t_lohi_alone_pings_after_a_tone_and_a_round() -> None:
    """By hand: 5 ms of tone, then twice the longest way and 5 ms, and it has the band."""
    plan = held([[30.0, 0.0]], "t_lohi", duration_s=60.0)
    (packets,) = packets_of(plan, 1, 40)
    result = simulate(plan, 1)
    tones, pings = tones_and_pings(result)
    longest = result.setup.slots.longest_travel_time
    sent: list[float] = []
    for packet in packets:
        if not sent or packet >= sent[-1] + PING_S:
            sent.append(packet + 0.005 + 0.005 + 2.0 * longest)
    sent = [at for at in sent if at < 60.0]
    assert pings.sent_at_s.to_numpy() == pytest.approx(np.array(sent))
    assert tones.sent_at_s.to_numpy()[: len(sent)] == pytest.approx(
        np.array(sent) - 0.010 - 2.0 * longest
    )


def test_two_that_contend_by_hand() -> None:
    """Both hear the other's tone within the round, back off, and the sooner one goes first."""
    places = [[30.0, 0.0], [-30.0, 0.0]]
    plan = held(places, "t_lohi", protocol={"frame_s": 0.2})
    result = simulate(plan, 3)
    tones, pings = tones_and_pings(result)
    longest = result.setup.slots.longest_travel_time
    length, way = 0.005 + 2.0 * longest, way_s(*places)
    met = 0
    for auv in ("AUV0", "AUV1"):
        own, others = tones[tones.sender == auv], tones[tones.sender != auv]
        theirs = pings[pings.auv != auv]
        for ended in (own.sent_at_s + 0.005).tolist():
            if ended + length >= 20.0:
                continue
            heard = [
                at
                for at, lasts in [
                    *zip(others.sent_at_s + way, [0.005] * len(others), strict=True),
                    *zip(theirs.sent_at_s + way, [PING_S] * len(theirs), strict=True),
                ]
                if at < ended + length - 1e-9 and at + lasts > ended + 1e-9
            ]
            won = (pings[pings.auv == auv].sent_at_s - (ended + length)).abs().min() < 1e-9
            assert won == (not heard)
            met += bool(heard)
    assert met > 5


@given(seed=st.integers(0, 2**16), count=st.integers(2, 6), every_s=st.sampled_from([0.3, 1.0]))
@settings(max_examples=8, deadline=None)
def test_t_lohi_lets_no_two_ping_at_once_that_hear_each_other(
    seed: int, count: int, every_s: float
) -> None:
    """The conservative round's proof: who is alone for a round there and back is alone."""
    places = np.random.default_rng(seed).uniform(-40.0, 40.0, (count, 2)).tolist()
    plan = held(places, "t_lohi", protocol={"frame_s": every_s})
    result = simulate(plan, seed)
    pings = result.tables["pings"].sort_values("sent_at_s")
    assert len(pings) > 5
    assert (result.tables["receptions"].why != "ping").all()
    gaps = np.diff(pings.sent_at_s)
    assert (gaps > PING_S).all()


# MACA-U


def test_macau_pings_once_an_asv_has_cleared_it() -> None:
    """By hand: a request of 32 ms, the way, a clear of 32 ms, the way back, and the ping."""
    plan = held([[30.0, 0.0]], "macau", duration_s=60.0)
    (packets,) = packets_of(plan, 1, 40)
    result = simulate(plan, 1)
    way = way_s([30.0, 0.0], [0.0, 0.0], 10.0)
    signals = result.tables["signals"]
    requests, clears = (signals[signals.kind == kind] for kind in ("request", "clear"))
    pings = result.tables["pings"].sent_at_s.to_numpy()
    first = packets[0]
    assert requests.sent_at_s.iloc[0] == pytest.approx(first)
    assert clears.sent_at_s.iloc[0] == pytest.approx(first + 0.032 + way)
    assert pings[0] == pytest.approx(first + 0.064 + 2.0 * way)
    assert 15 < len(pings) <= len(clears) <= len(requests) <= len(pings) + 1


def test_macau_keeps_hidden_auvs_apart() -> None:
    """Two AUVs that do not hear each other: the ASV clears one at a time; ALOHA's pings meet."""
    places = [[70.0, 0.0], [-70.0, 0.0]]
    met = {}
    for access in ("aloha", "macau"):
        plan = held(places, access, protocol={"frame_s": 0.1}, duration_s=120.0)
        receptions = simulate(plan, 5).tables["receptions"]
        met[access] = int((receptions.why == "ping").sum())
    assert met["macau"] == 0 < met["aloha"]


# DACAP


@pytest.mark.parametrize("away", [20.0, 90.0])
def test_dacap_waits_the_longer_the_nearer_its_asv_is(away: float) -> None:
    """By hand: request and clear of 32 ms, the way there and back, and t_min less that."""
    plan = held([[away, 0.0]], {"model": "dacap", "handshake_s": 0.1}, duration_s=40.0)
    (packets,) = packets_of(plan, 1, 30)
    result = simulate(plan, 1)
    signals, pings = result.tables["signals"], result.tables["pings"].sent_at_s.to_numpy()
    way = way_s([away, 0.0], [0.0, 0.0], 10.0)
    clear = signals[signals.kind == "clear"].sent_at_s.iloc[0]
    assert clear == pytest.approx(packets[0] + 0.032 + way)
    assert pings[0] == pytest.approx(clear + 0.032 + way + max(0.1 - 2.0 * way, 0.0))
    assert (signals.kind == "warning").sum() == 0


def test_dacap_warns_of_hidden_auvs_and_no_ping_is_met() -> None:
    """Two AUVs that do not hear each other ask one ASV; a handshake too short lets pings meet."""
    places, met = [[70.0, 0.0], [-70.0, 0.0], [0.0, 40.0]], {}
    for handshake in (None, 0.0):
        access = {"model": "dacap", "handshake_s": handshake, "request_bytes": 1}
        plan = held(places, access, protocol={"frame_s": 0.2}, duration_s=300.0)
        result = simulate(plan, 5)
        signals, receptions = result.tables["signals"], result.tables["receptions"]
        met[handshake] = int((receptions.outcome == "collided").sum())
        warnings = signals[signals.kind == "warning"]
        assert len(warnings) > 5
        assert set(warnings.sender) == {"ASV0"}
        assert len(result.tables["pings"]) > 100
    assert met[None] == 0 < met[0.0]


def test_a_request_is_repeated_after_a_backoff_and_to_the_next_asv() -> None:
    """An AUV out of range of the one it asks first is cleared by the other."""
    plan = held(
        [[80.0, 0.0]],
        "macau",
        asvs={
            "count": 2,
            "formation": {"positions_m": [[-60.0, 0.0], [60.0, 0.0]]},
        },
    )
    result = simulate(plan, 1)
    signals = result.tables["signals"]
    assert signals.to.iloc[:2].tolist() == ["ASV0", "ASV1"]
    assert set(signals[signals.kind == "clear"].sender) == {"ASV1"}
    assert len(result.tables["pings"]) > 0
