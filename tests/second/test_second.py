"""The simulator agrees event for event with a second implementation, over drawn scenarios."""

import math
from collections.abc import Callable
from pathlib import Path

import pytest
from comparing import disagreements
from drawing import contending, exchanging, mixed, scenario, with_land


def agree(
    first: int,
    count: int,
    folder: Path,
    longest_s: float = math.inf,
    draw: Callable[[int, Path], dict] = scenario,
) -> None:
    """Fly scenarios twice; fail with the first differences found."""
    rows = 0
    for number in range(first, first + count):
        keys = draw(number, folder)
        keys["duration_s"] = min(keys["duration_s"], longest_s)
        found, counts = disagreements(keys)
        assert not found, f"scenario {number}: " + "\n".join(found)
        rows += sum(counts.values())
    assert rows > 100 * count  # an empty mission agrees with anything


def test_a_second_implementation_agrees(tmp_path: Path) -> None:
    """Fifty drawn scenarios, short and of no whole ticks: each ping, reception, frame, fix."""
    agree(0, 50, tmp_path, longest_s=15.873)


@pytest.mark.slow
def test_a_second_implementation_agrees_a_thousand_times(tmp_path: Path) -> None:
    """A thousand further ones."""
    agree(1000, 1000, tmp_path)


def test_a_second_implementation_acknowledges_repeats_and_relays_alike(tmp_path: Path) -> None:
    """Twelve drawn scenarios: when who forwards and acknowledges what, and what the fleet knows."""
    agree(2000, 12, tmp_path, longest_s=15.873, draw=exchanging)


def test_a_second_implementation_flies_fleets_of_two_kinds(tmp_path: Path) -> None:
    """Eight drawn scenarios, each with two groups of AUVs."""
    agree(4000, 8, tmp_path, longest_s=15.873, draw=mixed)


@pytest.mark.slow
def test_a_second_implementation_does_two_hundred_times(tmp_path: Path) -> None:
    """Two hundred further ones."""
    agree(3000, 200, tmp_path, draw=exchanging)


def test_a_second_implementation_loses_what_land_crosses(tmp_path: Path) -> None:
    """Twelve drawn scenarios with islands, and whoever they keep from hearing whom."""
    agree(4000, 12, tmp_path, longest_s=12.345, draw=with_land)


@pytest.mark.slow
def test_a_second_implementation_does_so_two_hundred_times(tmp_path: Path) -> None:
    """Two hundred further ones."""
    agree(5000, 200, tmp_path, draw=with_land)


def test_a_second_implementation_contends(tmp_path: Path) -> None:
    """Six drawn scenarios: ALOHA with acknowledgements, by which AUVs repeat pings or do not."""
    agree(0, 6, tmp_path, longest_s=12.345, draw=contending)


@pytest.mark.slow
def test_a_second_implementation_contends_two_hundred_times(tmp_path: Path) -> None:
    """Two hundred further ones."""
    agree(1000, 200, tmp_path, draw=contending)


def test_a_fix_is_known_once_its_ping_has_passed(tmp_path: Path) -> None:
    """The answer of round 10 passes ASV2 during the frame; in round 11 the nearer ASV1 calls."""
    keys = scenario(0, tmp_path, schedule="polling", ranging="owtt_sync", downlink="sequential")
    keys["protocol"] |= {"broadcaster": "rotate", "positions": "last_fix", "tick_rate_hz": None}
    keys["protocol"] |= {"shortest_downlink_slot_s": 2.0, "duplex": "per_band"}
    route = {"kind": "waypoints", "points_m": [[[5.0, 0.0], [65.0, 0.0]]]}
    keys["auvs"] = {"count": 1, "speed_m_per_s": 1.0, "route": route}
    stations = [[-10.0, 0.0], [60.0, 0.0], [25.0, 70.0]]
    keys["asvs"] = {"count": 3, "formation": {"positions_m": stations}, "failures": []}
    keys["acoustics"]["hf"] |= {"range_m": 80.0, "range_metric": "horizontal"}
    assert not disagreements(keys)[0]


@pytest.mark.parametrize("number", [1003, 1036])
def test_who_was_not_told_tries_its_luck(number: int, tmp_path: Path) -> None:
    """In a contention slot, of which the everyday fifty have none."""
    keys = scenario(number, tmp_path)
    assert keys["protocol"]["knowledge"]["missed"] == "contention"
    assert not disagreements(keys)[0]


def test_who_has_no_slot_waits_for_the_frames_of_all(tmp_path: Path) -> None:
    """In round 88 the first of two names the only slot, and the other, which is to come, nobody."""
    assert not disagreements(scenario(1381, tmp_path))[0]


def test_an_instant_reply_is_delivered_on_a_tick(tmp_path: Path) -> None:
    """It leaves at the front of a ping that is longer than the way back."""
    keys = scenario(0, tmp_path, schedule="one_per_slot", ranging="owtt_sync", tick_rate_hz=30.0)
    reply = {"model": "direct_reply", "reply": "instant", "reply_at": "ping_front"}
    keys["protocol"] |= {"downlink": reply, "broadcaster": "rotate", "positions": "truth"}
    keys["auvs"] |= {"count": 1, "route": {"kind": "hold", "positions_m": [[3.0, 0.0]]}}
    keys["asvs"] = {"count": 1, "formation": {"positions_m": [[0.0, 0.0]]}, "failures": []}
    keys["acoustics"]["hf"] |= {"range_m": 50.0, "ping_s": 0.03}
    assert not disagreements(keys)[0]
