"""Who waits for what happens is told of it at its instant, and changes nothing of the mission."""

import math
from collections import Counter
from collections.abc import Generator, Iterator
from typing import Any

import numpy as np
import pytest
import simpy
from test_mission import DURATION_S, MISSIONS, flown, look, same
from worlds import merged

from bindusbl_des import (
    Mission,
    Network,
    Scenario,
    Turn,
    View,
    broadcast,
    downlink_free,
    ping_group,
    simulate,
    until,
)
from bindusbl_des.core.protocol.happenings import KINDS

# Where somebody waits, the band is busy: pings are lost, collide, and come in whatever order.
BUSY: dict[str, Any] = {
    "auvs": {"count": 6},
    "acoustics": {"loss": {"combine": "clamp_first"}, "hf": {"range_m": 60.0}},
}
PAPERS_REPLY = {
    "protocol": {
        "downlink": {"model": "direct_reply", "reply": "instant", "reply_at": "ping_front"}
    }
}


def neighbours(view: View) -> list[list[int]]:
    """Whoever starts side by side pings at once."""
    return [[0, 1], [2], [3, 4], [5]]


def twice_and_once(network: Network, turn: Turn, time: float) -> Generator[simpy.Event, Any, float]:
    """All groups ping twice before any ping is decided: their noise is taken in order."""
    for slot in [*range(len(turn.groups))] * 2:
        time = yield from ping_group(network, turn, slot, time)
    broadcast(network, turn, time)
    return (yield from downlink_free(network, time))


def acknowledged(network: Network, turn: Turn, time: float) -> Generator[simpy.Event, Any, float]:
    """The next round begins as soon as the last of the fixes has been delivered, or never will."""
    for slot in range(len(turn.groups)):
        time = yield from ping_group(network, turn, slot, time)
    deliveries = network.happenings("delivery", round=turn.row.round)
    broadcast(network, turn, time)
    over = until(network, network.downlink_free_at)
    for _ in range(turn.row.fixes):
        delivery = deliveries.next()
        yield delivery | over
        time = delivery.value.time if delivery.triggered else network.downlink_free_at
        if over.processed:
            break
    deliveries.close()
    return max(time, network.env.now)


def busy(name: str) -> Scenario:
    """Return a mission of the table, or one of those here, in which everything happens."""
    own: dict[str, list[dict[str, Any]]] = {
        "colliding": [{"protocol": {"schedule": neighbours}}],
        "colliding_direct": [PAPERS_REPLY, {"protocol": {"schedule": neighbours}}],
        "twice": [{"protocol": {"downlink": twice_and_once}}],
    }
    changes = merged(flown(name if name in MISSIONS else "sequential").model_dump(), BUSY)
    for change in own.get(name, []):
        changes = merged(changes, change)
    return Scenario.model_validate(changes)


NAMES = [*MISSIONS, "colliding", "colliding_direct", "twice"]


def kinds_of(name: str) -> list[str]:
    """Return what happens in a mission: where AUVs fix themselves nobody broadcasts, and signals
    are of programs (`protocol/test_program_verbs.py`).
    """
    never = {"signal", "signal_reception", *(["broadcast"] if "passive" in name else [])}
    return [kind for kind in KINDS if kind not in never]


TOLD = [(kind, name) for name in NAMES for kind in kinds_of(name)]


@pytest.mark.parametrize("name", NAMES)
def test_waiting_for_everything_changes_nothing(name: str) -> None:
    """Every table is bit for bit that of a mission in which nobody waits."""
    mission, told = Mission(busy(name), 1), Counter[str]()
    for happening in mission.happenings(*kinds_of(name)):
        told[happening.kind] += 1
        assert happening.time <= mission.time
        if sum(told.values()) % 7 == 0:
            look(mission)
    assert set(told) == set(kinds_of(name))
    assert min(told.values()) > 5
    assert same(mission.result(), simulate(busy(name), 1))


@pytest.mark.parametrize("name", NAMES)
def test_waiting_now_and_then_changes_nothing(name: str) -> None:
    """Nor does it who begins to wait at any instant, for one kind or another, and gives it up."""
    mission, draw = Mission(busy(name), 2), np.random.default_rng(3)
    while mission.time < 0.9 * DURATION_S:
        mission.advance(min(mission.time + draw.exponential(0.05), DURATION_S))
        kind = draw.choice(kinds_of(name))
        which = {"auv": int(draw.integers(6))} if draw.random() < 0.5 else {}
        if kind == "broadcast" or (kind == "ping" and "passive" in name):
            which = {}
        event = mission.happening(kind, **which)
        if draw.random() < 0.5:
            since, found = mission.time, mission.advance(event)
            if found is None:
                assert mission.time == DURATION_S
                break
            assert found.kind == kind
            assert found.time <= mission.time
            assert found.time > since or "direct" in name
            assert all(getattr(found.row, column) == value for column, value in which.items())
    assert same(mission.result(), simulate(busy(name), 2))


def test_who_begins_to_wait_hears_of_fixes_that_are_under_way() -> None:
    """A tenth of a millisecond before each delivery, when its frame has long been sent."""
    world = busy("sequential")
    fixes = simulate(world, 1).tables["fixes"]
    instants = np.unique(fixes.delivered_at_s.dropna())
    for instant in instants[:: len(instants) // 8]:
        mission = Mission(world, 1)
        mission.advance(instant - 1e-4)
        found = mission.advance(mission.happening("delivery"))
        assert found is not None
        assert found.time == mission.time == pytest.approx(instant, abs=1e-9)


def listening(mission: Mission, *kinds: str) -> list[tuple[float, Any]]:
    """Run a mission to its end; return all happenings of some kinds, and when they were told."""
    told: list[tuple[float, Any]] = []

    def listen() -> Iterator[simpy.Event]:
        watch = mission._world.network.happenings(*kinds)
        while True:
            happening = yield watch.next()  # type: ignore[misc]
            told.append((mission.env.now, happening))

    mission.env.process(listen())
    mission.advance(DURATION_S)
    return told


def number(name: Any) -> Any:
    return int(name[3:]) if isinstance(name, str) and name[:3] in ("AUV", "ASV") else name


def rows_of(kind: str, mission: Mission) -> list[dict[str, Any]]:
    """Return what the tables of a mission say of the happenings of a kind, by instant.

    What happens at 0 s has happened when a mission is there.
    """
    tables, lasts = mission.result().tables, mission.scenario.acoustics.hf.ping_s
    table, instant = {
        "ping": ("pings", tables["pings"].sent_at_s),
        "arrival": ("receptions", tables["receptions"].arrived_at_s),
        "reception": ("receptions", tables["receptions"].arrived_at_s + lasts),
        "broadcast": ("broadcasts", tables["broadcasts"].sent_at_s),
        "delivery": ("fixes", tables["fixes"].delivered_at_s),
    }[kind]
    rows = tables[table].assign(instant=instant)
    if kind == "ping":
        rows = rows[rows.call.isna() | (rows.call == "heard")]
    if table == "receptions":
        rows = rows[rows.outcome != "out_of_range"]
    rows = rows[(rows.instant > 0.0) & (rows.instant < DURATION_S)].sort_values(
        "instant", kind="stable"
    )
    plain = rows.astype(object).where(rows.notna(), None).to_dict("records")
    return [
        {key: value if key == "asvs" else number(value) for key, value in row.items()}
        for row in plain
    ]


# What is known once a ping is decided: what was measured, and why it was not.
DECIDED = (
    *("azimuth_deg", "elevation_deg", "body_azimuth_deg", "body_elevation_deg"),
    *("why", "overlapped_by", "loss_probability"),
    *("misalignment_deg", "gnss_error_x_m", "gnss_error_y_m", "slow_range_error_m", "clock_late_s"),
)


@pytest.mark.parametrize(("kind", "name"), TOLD)
def test_what_is_told_is_what_the_tables_say(kind: str, name: str) -> None:
    """Each happening is told once, in order, at its instant, and its row is that of the table."""
    mission = Mission(busy(name), 1)
    told = listening(mission, kind)
    rows = rows_of(kind, mission)
    assert len(told) == len(rows) > 5
    late = 0.0
    if kind == "broadcast" and name == "colliding_direct":  # answers the front of a ping
        late = mission.scenario.acoustics.hf.ping_s  # which nobody knows to be heard until it ends
    told.sort(key=lambda it: it[1].time)
    for (now, happening), row in zip(told, rows, strict=True):
        assert happening.kind == kind
        assert happening.time == row["instant"]
        assert now == pytest.approx(happening.time + late, abs=1e-9)
        for column in KINDS[kind].__dataclass_fields__:
            value = getattr(happening.row, column)
            if column == "heard_by":
                assert value == 0  # nobody has, as it is sent
            elif kind == "arrival" and column == "outcome":
                assert value == "in_flight"
            elif kind in ("arrival", "reception") and column in DECIDED:
                assert value is None  # it is measured when the ping is decided, `sight_of` tells
            else:
                assert value == row[column], column
    if kind == "reception" and "colliding" in name:
        assert {happening.row.outcome for _, happening in told} == {"heard", "lost", "collided"}


def test_a_happening_is_the_next_that_was_asked_for() -> None:
    """An event is for one happening; of what the columns of its row say it must be."""
    mission = Mission(busy("sequential"), 1)
    mission.advance(5.0)
    fixes = simulate(busy("sequential"), 1).tables["fixes"]
    for auv in (1, 3, 1):
        delivered = fixes[(fixes.auv == f"AUV{auv}") & (fixes.delivered_at_s > mission.time)]
        happening = mission.advance(mission.happening("delivery", auv=auv))
        assert happening.time == mission.time == delivered.delivered_at_s.min()
        seen = mission.auvs()
        assert np.hypot(*(seen.estimate - seen.truth[:, :2])[auv]) < 3.0
    lost = mission.advance(mission.happening("reception", outcome="lost", asv=2))
    assert (lost.row.outcome, lost.row.asv) == ("lost", 2)


def test_a_mission_that_ends_before_a_happening_ends() -> None:
    """Who advances to what never happens is at the end, and is told nothing."""
    mission = Mission(busy("sequential"), 1)
    assert mission.advance(mission.happening("ping", round=10_000)) is None
    assert mission.time == DURATION_S
    assert list(mission.happenings("ping")) == []
    assert same(mission.result(), simulate(busy("sequential"), 1))


def test_a_process_of_ones_own_runs_beside_the_mission() -> None:
    """A watchdog wakes at each delivery, or when it has waited for too long."""
    mission, waited = Mission(busy("exact_clock"), 1), []

    def watch(auv: int, patience: float) -> Iterator[simpy.Event]:
        while True:
            since, late = mission.env.now, mission.env.timeout(patience)
            yield mission.happening("delivery", auv=auv) | late
            waited.append(mission.env.now - since)

    mission.env.process(watch(2, 1.5))
    mission.advance(DURATION_S)
    fixes = mission.result().tables["fixes"]
    delivered = fixes[fixes.auv == "AUV2"].delivered_at_s.dropna().sort_values().to_numpy()
    woken = np.cumsum(waited)
    assert max(waited) <= 1.5 + 1e-9
    assert np.abs(woken[:, None] - delivered).min(axis=0) == pytest.approx(0.0, abs=1e-9)
    gaps = np.diff(delivered, prepend=0.0)
    assert len(woken) >= len(delivered) + np.floor(gaps / 1.5).sum() - 1
    assert same(mission.result(), simulate(busy("exact_clock"), 1))


def test_a_downlink_of_ones_own_waits_for_deliveries() -> None:
    """Rounds that begin as soon as fixes are delivered are shorter than those of whole slots."""
    plain = flown("exact_clock").model_dump()
    changes = merged(plain, {"protocol": {"downlink": acknowledged}})
    eager = simulate(Scenario.model_validate(changes), 1)
    sequential = merged(plain, {"protocol": {"downlink": "sequential"}})
    slow = simulate(Scenario.model_validate(sequential), 1)
    assert len(eager.tables["rounds"]) > len(slow.tables["rounds"])
    fixes, rounds = eager.tables["fixes"], eager.tables["rounds"].started_at_s.to_numpy()
    last = fixes.groupby("round").delivered_at_s.agg(lambda it: it.max(skipna=False)).dropna()
    last = last[last.index + 1 < len(rounds)]
    assert len(last) > 5
    assert rounds[last.index + 1] == pytest.approx(last.to_numpy(), abs=1e-9)


@pytest.mark.parametrize(
    ("kind", "which", "told"),
    [
        ("delivry", {}, r"'delivry' happens; did you mean 'delivery'\?; wait for one of ping"),
        (
            "delivery",
            {"avu": 1},
            r"delivery has no column 'avu'; did you mean 'auv'\?; it has fix",
        ),
        ("broadcast", {"auv": 1}, "a broadcast has no column 'auv'"),
        ("delivery", {"auv": "AUV1"}, "auv of a delivery is never 'AUV1'; it is a number"),
        ("reception", {"outcome": "herd"}, "outcome of a reception is never 'herd'; it is one of"),
        (
            "reception",
            {"outcome": "delivered"},
            "outcome of a reception is never 'delivered'; it is one of heard, lost, collided",
        ),
        ("reception", {"auv": None}, "auv of a reception is never None"),
        ("delivery", {"auv": np.arange(2)}, "auv of a delivery is never array"),
        (3, {}, "nothing of the kind 3 happens"),
        (
            "delivery",
            {"auv": 77},
            "auv of a delivery is never 77; there are [0-9]+, of numbers from 0",
        ),
        ("broadcast", {"asv": -1}, "asv of a broadcast is never -1"),
    ],
)
def test_what_never_happens_is_told(kind: str, which: dict[str, Any], told: str) -> None:
    """A kind or a column that there is not is named, with the nearest that there is."""
    mission = Mission(busy("sequential"), 1)
    with pytest.raises(ValueError, match=told):
        mission.happening(kind, **which)
    with pytest.raises(ValueError, match=told):
        mission.happenings(kind, **which)


@pytest.mark.parametrize("ranging", ["owtt_sync", "twtt"])
def test_a_mission_that_has_ended_stays_so(ranging: str) -> None:
    """Events of one's own beyond its end neither turn it back nor close it again."""
    changes = merged(busy("sequential").model_dump(), {"protocol": {"ranging": ranging}})
    mission = Mission(Scenario.model_validate(changes), 1)
    mission.advance(DURATION_S)
    late = mission.env.event()
    assert mission.advance(late.succeed(5)) is None
    assert mission.advance(mission.env.timeout(0.0)) is None
    assert mission.time == DURATION_S
    assert same(mission.result(), simulate(mission.scenario, 1))


def test_who_waits_for_nothing_is_told() -> None:
    """Without a kind there is nothing to wait for."""
    with pytest.raises(ValueError, match="wait for one or more of ping, arrival"):
        Mission(busy("sequential"), 1).happenings()


def test_events_are_of_their_mission() -> None:
    """An event of another mission is refused, and so is waiting after an error."""
    mission, other = (Mission(busy("sequential"), seed) for seed in (1, 2))
    with pytest.raises(ValueError, match="of another mission"):
        mission.advance(other.happening("ping"))

    def failing() -> Iterator[simpy.Event]:
        yield mission.happening("broadcast")
        raise OSError("no such device")

    mission.env.process(failing())
    with pytest.raises(OSError, match="no such device"):
        mission.advance(DURATION_S)
    assert 0.0 < mission.time < DURATION_S
    with pytest.raises(RuntimeError, match="ended with an error"):
        mission.advance(mission.happening("ping"))


def test_nobody_who_waits_costs_anything() -> None:
    """Events for arrivals and deliveries are there for who waits, and for nobody else."""

    def events(mission: Mission) -> int:
        steps = 0
        while mission.env.peek() < DURATION_S and math.isfinite(mission.env.peek()):
            mission.env.happen_next()
            steps += 1
        return steps

    unwatched, watched = Mission(busy("sequential"), 1), Mission(busy("sequential"), 1)
    once = Mission(busy("sequential"), 1)
    once.advance(once.happening("arrival"))
    watched.happenings("arrival", "reception", "delivery")
    few, many, again = events(unwatched), events(watched), events(once)
    assert many > 3 * few
    assert again <= few + 2
