"""What programs of access know and say: levels, clocks, their own measurement, acknowledgements."""

import re
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from programs_for_tests import PING_S, flown, held, way_s
from worlds import LOUD, packets_of

from bindusbl_des import Mission, simulate

PROGRAMS = ("aloha", "slotted_aloha", "csma", "t_lohi", "macau", "dacap")
SONAR = {"hf": {"channel": {**LOUD, "source_level_db": 170.0}}}


# ASVs that fail


def beacon(node: Any) -> Iterator[Any]:
    """AUV0 and ASV0 each send a second of sound, one after the other."""
    at = {"AUV0": 2.0, "ASV0": 5.0}
    if node.name in at:
        yield node.until(at[node.name])
        yield node.send("x", lasts_s=1.0)


@pytest.mark.parametrize(
    ("at", "until", "lost"),
    [(2.5, 4.0, ("AUV0", "ASV0")), (5.5, 9.0, ("ASV0", "AUV0")), (3.5, 4.0, None)],
)
def test_signals_are_lost_where_one_of_both_asvs_fails_meanwhile(
    at: float, until: float, lost: tuple[str, str] | None
) -> None:
    """As pings, calls and frames are: by who hears as by who sends; told at once and on record."""
    told: list[tuple[str, str]] = []

    def program(node: Any) -> Iterator[Any]:
        yield from beacon(node)
        while (heard := (yield node.hears(within_s=9.0))) is not None:
            told.append((heard.sender, node.name))

    failures = [{"asv": 0, "at_s": at, "until_s": until}]
    tables = flown([[30.0, 0.0]], program, asvs={"failures": failures}).tables
    senders, met = tables["signals"].sender, tables["signal_receptions"]
    ways = list(zip(senders[met.signal], met.listener, strict=True))
    assert ways == [("AUV0", "ASV0"), ("ASV0", "AUV0")]
    for way, outcome, why in zip(ways, met.outcome, met.why, strict=True):
        expected = ("lost", "failed_meanwhile") if way == lost else ("heard", "nan")
        assert (outcome, str(why)) == expected
        assert (way in told) == (way != lost)


# Levels


def test_a_signal_is_as_loud_as_it_is_sent() -> None:
    """20 lg r + alpha r below its level; at 30 dB less it is not decoded at 90 m, which it is at
    30 m, nor does it drown anything there; and it takes as much less power.
    """
    places = [[0.0, 0.0], [30.0, 0.0], [90.0, 0.0]]
    told: dict[str, list[Any]] = {"AUV1": [], "AUV2": []}

    def program(node: Any) -> Iterator[Any]:
        if node.name == "AUV0":
            for level in (None, 140.0, 110.0):
                yield node.send("x", lasts_s=1.0, level_db=level)
        while node.name in told:
            told[node.name].append((yield node.hears()))

    powers = {"transmit_w": 100.0, "receive_w": 0.0, "idle_w": 0.0}
    hf = {**powers, "channel": {"model": "sonar", "source_level_db": 170.0, "shadowing_sd_db": 0.0,
                                "snr_threshold_db": 30.0}}  # fmt: skip
    result = flown(places, program, acoustics={"hf": hf})
    near, far = (told[name] for name in ("AUV1", "AUV2"))
    assert [heard.level_db for heard in near] == pytest.approx(
        [170.0 - 20.0 * np.log10(30.0), 140.0 - 20.0 * np.log10(30.0)], abs=0.4
    )
    assert near[0].level_db - near[1].level_db == pytest.approx(30.0, abs=1e-9)
    assert len(far) == 1
    assert near[0].level_db - far[0].level_db == pytest.approx(20.0 * np.log10(3.0), abs=0.6)
    assert result.tables["signals"].level_db.tolist()[1:] == [140.0, 110.0]
    energy = 100.0 * (1.0 + 1e-3 + 1e-6)
    assert result.auvs.energy_j.tolist() == pytest.approx([energy, 0.0, 0.0], abs=1e-6)


def test_pings_have_levels_too() -> None:
    """Two that ping at one instant, one 20 dB lower: so it is told where they are heard."""
    places = [[30.0, 0.0], [-30.0, 40.0]]

    def program(node: Any) -> Iterator[Any]:
        if not node.is_asv:
            yield node.until(1.0 + 0.0 * node.number)
            yield node.send("ping", level_db=150.0 if node.name == "AUV0" else None)

    tables = flown(places, program, acoustics=SONAR).tables
    level = tables["receptions"].set_index("auv").level_db
    ways = [SPREAD(way_s(place, [0.0, 0.0], 10.0)) for place in places]
    assert level["AUV0"] == pytest.approx(150.0 - ways[0], abs=0.4)
    assert level["AUV1"] == pytest.approx(170.0 - ways[1], abs=0.4)


def SPREAD(way: float) -> float:
    """Return what spreading takes (dB) of sound that is under way for so long (s)."""
    return float(20.0 * np.log10(1500.0 * way))


@pytest.mark.parametrize(
    ("acoustics", "level", "said"),
    [
        ({}, 150.0, "`level_db` must be left out where the channel knows of no levels"),
        (SONAR, 171.0, "`level_db` must be at most 170 dB, the channel's source_level_db; met 171"),
        (SONAR, float("nan"), "`level_db` must be at most 170 dB"),
    ],
)
def test_levels_that_cannot_be_are_refused(
    acoustics: dict[str, Any], level: float, said: str
) -> None:
    """One line, with part, vehicle and instant."""

    def program(node: Any) -> Iterator[Any]:
        yield node.wait(1.0)
        yield node.send("x", bytes=1, level_db=level)

    with pytest.raises(ValueError, match=f"for AUV0 at 1 s: {re.escape(said)}"):
        flown([[10.0, 0.0]], program, acoustics=acoustics)


# Clocks


def test_a_program_goes_by_its_clock() -> None:
    """An AUV whose clock is late, and later and later, does everything so much later; an ASV has
    GNSS.  What it is told of the past is by its clock as well.
    """
    read: dict[str, list[float]] = {}

    def program(node: Any) -> Iterator[Any]:
        if node.is_asv:
            yield node.until(10.0)
            yield node.send("x", bytes=1)
            return
        read[node.name] = [node.clock]
        yield node.until(5.0)
        yield node.send("y", bytes=1)
        heard = yield node.hears()
        read[node.name] += [heard.began_at_s, node.heard(heard.began_at_s)[0][0], node.clock]

    places = [[30.0, 0.0], [-80.0, 0.0]]  # who do not hear each other
    sds = {"clock_offset_sd_s": 0.5, "clock_drift_sd": 0.001}
    signals = flown(places, program, navigation=sds).tables["signals"]
    sent = signals[signals.kind == "y"].sort_values("sender").sent_at_s.to_numpy()
    assert signals[signals.kind == "x"].sent_at_s.tolist() == [10.0]
    late = -np.array([read[f"AUV{auv}"][0] for auv in (0, 1)])
    drift = (sent - 5.0 - late) / -sent  # says 5.0 once late, and later each second, add up to it
    assert (np.abs(late) > 0.01).all()
    assert (np.abs(drift) > 1e-5).all()
    for auv, place in enumerate(places):
        came = 10.0 + way_s(place, [0.0, 0.0], 10.0)
        says = came - late[auv] + drift[auv] * came
        assert read[f"AUV{auv}"][1:3] == pytest.approx([says, says], abs=1e-9)
        ended = came + 0.008
        assert read[f"AUV{auv}"][3] == pytest.approx(ended - late[auv] + drift[auv] * ended)


@pytest.mark.parametrize("program", PROGRAMS)
def test_programs_that_ship_wait_by_clocks_that_drift(program: str) -> None:
    """What they have waited for has come, to the last digit; as many pings as by exact clocks."""
    counts = []
    for sd in (0.0, 1e-3):
        plan = held(
            [[30.0, 0.0], [-30.0, 20.0]], {"model": program, "acknowledgement_bytes": 2},
            navigation={"clock_drift_sd": sd, "clock_offset_sd_s": sd},
        )  # fmt: skip
        counts.append(len(simulate(plan, 1).tables["pings"]))
    assert counts[0] > 5
    assert counts[1] == pytest.approx(counts[0], abs=4)


def test_slots_of_slotted_aloha_part_with_clocks() -> None:
    """Nobody shares a slot's begin any more where clocks differ."""
    places = [[30.0, 0.0], [-30.0, 0.0]]
    begins = []
    for sd in (0.0, 0.05):
        plan = held(places, "slotted_aloha", duration_s=60.0, navigation={"clock_offset_sd_s": sd})
        result = simulate(plan, 1)
        slot = result.setup.slots.uplink_slot
        begins.append(result.tables["pings"].sent_at_s.to_numpy() % slot)
    exact, off = begins
    near = np.minimum(exact, slot - exact)
    assert near.max() < 1e-9
    assert np.minimum(off, slot - off).max() > 1e-3


# What an ASV has measured


def test_an_asv_hears_pings_and_has_measured_them() -> None:
    """What its fix will be made of, as the ping ends there; those before it first asked, too."""
    told: list[tuple[Any, Any, float]] = []

    def program(node: Any) -> Iterator[Any]:
        if node.is_asv:
            yield node.until(4.0)
            for _ in range(4):
                heard = yield node.hears()
                told.append((heard, node.sight(heard), node.clock))
        elif node.name == "AUV0":
            for instant in (1.0, 2.0, 6.0):
                yield node.until(instant)
                yield node.send("ping")
            yield node.send("word", bytes=1)

    tables = flown([[30.0, 0.0]], program).tables
    heard, sights, clocks = zip(*told, strict=True)
    way = way_s([30.0, 0.0], [0.0, 0.0], 10.0)
    assert [it.kind for it in heard] == ["ping", "ping", "ping", "word"]
    assert [it.ping for it in heard] == [0, 1, 2, None]
    assert [it.began_at_s for it in heard[:3]] == pytest.approx(np.array((1.0, 2.0, 6.0)) + way)
    assert clocks[:3] == pytest.approx((4.0, 4.0, 6.0 + way + PING_S))
    assert (sights[0], sights[1], sights[3]) == (None, None, None)  # asked late, or no ping
    fix = tables["fixes"].iloc[2]
    assert sights[2].place[:2] == pytest.approx((fix.x_m, fix.y_m), abs=1e-9)


def test_busy_is_what_an_asv_hears_of_pings_as_well() -> None:
    """From the front of a ping to its end."""
    way, busy = way_s([30.0, 0.0], [0.0, 0.0], 10.0), []

    def program(node: Any) -> Iterator[Any]:
        if node.is_asv:
            for instant in (way - 0.001, way + 0.001, way + PING_S - 0.001, way + PING_S + 0.001):
                yield node.until(instant)
                busy.append(node.busy())
            assert node.heard(0.0) == pytest.approx(np.array([(way, way + PING_S)]))
        else:
            yield node.send("ping")

    flown([[30.0, 0.0]], program)
    assert busy == [False, True, True, False]


# Whoever waits for signals from outside


def test_happenings_of_signals_are_the_tables() -> None:
    """Each that begins, and what became of it at each that it reached, at its end there."""
    plan = held([[30.0, 0.0], [-30.0, 10.0]], "t_lohi", protocol={"frame_s": 0.5})
    mission = Mission(plan, 1)
    told = list(mission.happenings("signal", "signal_reception"))
    assert [it.time for it in told] == sorted(it.time for it in told)
    tables = mission.result().tables
    sent, met = tables["signals"], tables["signal_receptions"]
    begun = [it.row for it in told if it.kind == "signal"]
    assert [(it.signal, it.kind, it.sender) for it in begun] == list(
        zip(sent.signal, sent.kind, sent.sender, strict=True)
    )
    came = [it.row for it in told if it.kind == "signal_reception"]
    over = met[met.outcome != "in_flight"]
    assert len(over) > 50
    assert {"heard", "collided"} == {it.outcome for it in came}

    def known(rows: Any) -> set[tuple[Any, ...]]:
        return {
            tuple(None if value != value else value for value in row)
            for row in zip(*(rows[name] for name in COLUMNS), strict=True)
        }

    assert {tuple(getattr(it, name) for name in COLUMNS) for it in came} == known(over)
    plain = simulate(plan, 1).tables
    assert plain["signals"].equals(sent)
    assert plain["signal_receptions"].equals(met)


COLUMNS = ("signal", "ping", "listener", "arrived_at_s", "outcome", "why", "overlapped_by")


# Acknowledgements


def test_a_ping_is_acknowledged_by_hand() -> None:
    """It is over at the ASV after its way; 16 ms of sound go back; the AUV is content."""
    plan = held([[30.0, 0.0]], {"model": "aloha", "acknowledgement_bytes": 2, "repeat": 3})
    (packets,) = packets_of(plan, 1, 30)
    tables, way = simulate(plan, 1).tables, way_s([30.0, 0.0], [0.0, 0.0], 10.0)
    pings, signals = tables["pings"].sent_at_s.to_numpy(), tables["signals"]
    assert pings[0] == packets[0]
    assert signals.sent_at_s.to_numpy() == pytest.approx(pings + PING_S + way)
    assert set(signals.lasts_s) == {0.016}
    assert signals.to.tolist() == ["AUV0"] * len(pings)
    assert signals.ping.tolist() == list(range(len(pings)))
    later = [packet for packet in packets[1:] if packet >= packets[0] + PING_S + 2 * way + 0.016]
    assert pings[1] == later[0]


def test_a_ping_that_nobody_hears_is_repeated_after_a_longer_backoff_each() -> None:
    """Three more times, each after the turns of all ASVs and up to 2, 4, 8 times as long."""
    asvs = {"count": 2, "formation": {"positions_m": [[0.0, 0.0], [1.0, 0.0]]}}
    plan = held(
        [[190.0, 0.0]], {"model": "aloha", "acknowledgement_bytes": 2, "repeat": 3}, asvs=asvs,
        duration_s=200.0, protocol={"frame_s": 30.0},
    )  # fmt: skip
    result = simulate(plan, 2)
    (packets,) = packets_of(plan, 2, 30)
    way = result.setup.slots.longest_travel_time
    turns = 2 * (0.016 + 2 * way)
    pings = result.tables["pings"].sent_at_s.to_numpy()
    whole = pings[: len(pings) // 4 * 4].reshape(-1, 4)
    assert len(whole) > 2
    assert np.isin(whole[:, 0], packets).all()
    gaps = np.diff(whole, axis=1) - PING_S - turns
    assert (gaps > 0.0).all()
    assert (gaps < (2 * way + PING_S + turns) * np.array((2.0, 4.0, 8.0))).all()
    assert gaps.max(axis=0)[2] > gaps.max(axis=0)[0]
    assert len(result.tables["signals"]) == 0


def test_asvs_acknowledge_in_turn_and_once() -> None:
    """Two that hear one another: the first does.  The second does what the first has not heard."""
    asvs = {"count": 2, "formation": {"positions_m": [[0.0, 0.0], [60.0, 0.0]]}}
    access = {"model": "aloha", "acknowledgement_bytes": 2, "repeat": 1}
    by = {}
    for name, place in (("both", [20.0, 0.0]), ("second", [140.0, 0.0])):
        result = simulate(held([place], access, asvs=asvs), 1)
        signals, pings = result.tables["signals"], result.tables["pings"]
        by[name] = set(signals.sender)
        assert len(signals) == len(pings) > 5
        if name == "second":
            turn = 0.016 + 2.0 * result.setup.slots.longest_travel_time
            way = way_s(place, [60.0, 0.0], 10.0)
            assert signals.sent_at_s.to_numpy() == pytest.approx(
                pings.sent_at_s + PING_S + way + turn
            )
    assert by == {"both": {"ASV0"}, "second": {"ASV1"}}


@pytest.mark.parametrize("program", PROGRAMS)
def test_every_program_repeats_what_is_not_acknowledged(program: str) -> None:
    """Where AUVs meet, fewer of what they had to send are heard by nobody; all of it is sound."""
    places, heard = [[30.0, 0.0], [-30.0, 0.0], [0.0, 40.0]], {}
    for repeat in (0, 4):
        access = {"model": program, "acknowledgement_bytes": 2, "repeat": repeat}
        plan = held(places, access, protocol={"frame_s": 0.4}, duration_s=30.0)
        result = simulate(plan, 3)
        tables = result.tables
        pings, signals = tables["pings"], tables["signals"]
        acknowledged = signals[signals.kind == "acknowledgement"]
        assert set(acknowledged.sender) == {"ASV0"}
        assert 0 < len(acknowledged) <= pings.heard_by.sum()
        assert len(acknowledged) >= 0.5 * pings.heard_by.sum()
        about = pings.loc[acknowledged.ping]
        assert about.auv.tolist() == acknowledged.to.tolist()
        assert (about.sent_at_s.to_numpy() + PING_S < acknowledged.sent_at_s).all()
        before = signals.drop(acknowledged.index).dropna(subset="ping")
        about = pings.loc[before.ping]
        whose = np.where(before.sender == "ASV0", before.to, before.sender)
        assert about.auv.tolist() == whose.tolist()
        assert (about.sent_at_s.to_numpy() >= before.sent_at_s).all()
        heard[repeat] = pings.heard_by.mean()
        assert result.setup.schedule.access == "program"  # no closed form tells of it
    assert len(pings) > 10
    if program == "macau":
        kinds = signals.kind.value_counts()
        assert kinds["acknowledgement"] <= kinds["clear"]


def test_without_acknowledgements_each_is_repeated_so_often() -> None:
    """Blindly: two pings for each that is wanted."""
    plan = held([[30.0, 0.0]], {"model": "csma", "repeat": 1}, protocol={"frame_s": 5.0})
    result = simulate(plan, 1)
    (packets,) = packets_of(plan, 1, 30)
    pings = result.tables["pings"]
    assert "signals" not in result.tables
    firsts = pings.sent_at_s[pings.waited_s == 0.0]
    assert np.isin(firsts, packets).all()
    assert len(pings) == 2 * len(firsts)
