"""Parts of somebody's own that live in time: their slots and instants, and what they leave."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from commands_for_tests import call
from families_for_tests import allow, forget, home_of

from bindusbl_des import Scenario, load_result, simulate, sweep

OWN = """
from bindusbl_des.core.protocol.tdma import broadcast, downlink_free, ping_group, until

def nobody(view):
    return [[]]

def silent(slot, time):
    yield slot.until(time)

def slow(slot, time):
    slot.ping(slot.group, time)
    yield slot.until(time)
slow.slot_s = lambda ping_s, way_s, crossing_s: 1.5

def often(network, turn, time):
    time = yield from ping_group(network, turn, 0, time)
    for _ in range(4):
        broadcast(network, turn, time)
        time = yield from downlink_free(network, time)
    return time

def waits(network, turn, time):
    yield until(network, time + 0.5)
    return time + 0.5

def helper(slot):
    return 1 / (slot.number - slot.number)

def raises(slot, time):
    yield slot.until(time)
    helper(slot)

def again(slot, time):
    slot.ping(slot.group, time)
    yield slot.until(time + 0.004)
    slot.ping(slot.group, time + 0.004)

def one_after_the_other(slot, time):
    slot.ping(slot.group, time)
    yield slot.until(time + 0.01)
    slot.ping(slot.group, time + 0.01)

def unassigned(network, turn, time):
    yield from ping_group(network, turn, 0, time)
    broadcast(network, turn, time)
    return (yield from downlink_free(network, time))

def early(network, turn, time):
    time = yield from ping_group(network, turn, 0, time + 1.0)
    return time

def unfinished(network, turn, time):
    time = ping_group(network, turn, 0, time)
    broadcast(network, turn, time)
    return time

def nowhen(network, turn, time):
    yield until(network, float("nan"))
    return time
"""


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder with a module of parts, which no process has loaded yet."""
    yield from home_of(tmp_path, monkeypatch, timed_parts=OWN)


def mission(key: str, name: str) -> Scenario:
    """Return some seconds with a part of one's own, named and admitted, and not loaded yet."""
    part = f"timed_parts:{name}"
    allow([part])
    data: dict[str, Any] = {"name": "m", "duration_s": 6.0, "protocol": {key: part}}
    return Scenario.model_validate(data)


def test_the_first_mission_of_a_process_asks_how_long_slots_are(home: Path) -> None:
    """A worker's first mission is as its second: `slot_s` is asked, whoever has loaded the part."""
    first, second = (simulate(mission("ranging", "slow"), 0) for _ in range(2))
    rounds = first.tables["rounds"]
    assert rounds.uplink_s[0] == 1.5 * rounds.colours[0]
    assert rounds.equals(second.tables["rounds"])


@pytest.mark.slow
def test_workers_ask_how_long_slots_are(home: Path) -> None:
    """Missions are those of this process, in however many workers they are flown."""
    world = mission("ranging", "slow")
    campaign = sweep(world, seeds=3, workers=2, allow_plugins=True)
    alone = [float(simulate(world, seed).mission.rounds[0]) for seed in range(3)]
    assert campaign.missions.sort_values("seed").rounds.tolist() == alone


def test_timing_asks_how_long_slots_are_with_leave(home: Path) -> None:
    """Without it slots are those of one ping and its way, and the table says whose they are."""
    (home / "m.yaml").write_text("name: m\nprotocol: {ranging: 'timed_parts:slow'}\n")
    asked = call("timing", home / "m.yaml", "--allow-plugins")
    assert " 1500.000 ms\nSlots last as timed_parts:slow says." in asked.stdout
    forget()
    unasked = call("timing", home / "m.yaml")
    assert "those of timed_parts:slow may differ: --allow-plugins asks it." in unasked.stdout
    assert "1500.000" not in unasked.stdout


@pytest.mark.parametrize(
    ("key", "name"),
    [("schedule", "nobody"), ("ranging", "silent"), ("downlink", "often"), ("downlink", "waits")],
)
def test_what_they_leave_can_be_read(home: Path, key: str, name: str) -> None:
    """Rounds without a ping, and several frames a round, are what a part may decide."""
    result = simulate(mission(key, name), 0)
    result.write(home / "r")
    assert "run scenario.yaml --seed 0 --allow-plugins</code>" in result.report()
    found = load_result(home / "r")
    assert len(found.tables["rounds"]) == len(result.tables["rounds"]) >= 2
    assert len(found.tables["broadcasts"]) == len(result.tables["broadcasts"])


@pytest.mark.parametrize(
    ("key", "name", "said"),
    [
        ("ranging", "raises", "raised ZeroDivisionError in slot 0 of round 0: division by zero"),
        ("ranging", "again", "AUV0 is still pinging, until 0.01 s"),
        ("downlink", "unassigned", "it is 0.233333 s, not 0 s: `time = yield from"),
        ("downlink", "early", "it is 0 s, not 1 s: `time = yield from"),
        ("downlink", "unfinished", "must be a number of seconds; got a generator: `time = yield"),
        ("downlink", "nowhen", "nan s is no instant that can be waited for"),
    ],
)
def test_a_mistake_names_its_line(home: Path, key: str, name: str, said: str) -> None:
    """What is said ends with the line of one's own module that it came by."""
    with pytest.raises(ValueError, match=said) as caught:
        simulate(mission(key, name), 0)
    assert str(caught.value).startswith(f"protocol.{key}: 'timed_parts:{name}' raised ")
    assert said in str(caught.value)
    line = int(str(caught.value).rpartition(", at timed_parts.py:")[2])
    inside = "    return 1 / " if name == "raises" else f"def {name}("
    lines = OWN.splitlines()
    assert any(text.startswith(inside) for text in lines[line - 4 : line])


def test_an_auv_may_ping_again_once_its_ping_is_over(home: Path) -> None:
    pings = simulate(mission("ranging", "one_after_the_other"), 0).tables["pings"]
    assert len(pings) >= 6
    assert pings.groupby(["round", "slot", "auv"]).size().eq(2).all()
