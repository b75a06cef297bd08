"""What was reached of what was possible: never more, whatever the scenario."""

import random
from typing import Any

import pytest
from commands_for_tests import params
from pydantic import ValidationError
from worlds import scenario, still

from bindusbl_des import Scenario, simulate
from bindusbl_des.apps.report.possible import reached
from bindusbl_des.apps.report.recording import recording

# The parts of a protocol that come with the package
PARTS = {
    row["key"].rpartition(".")[2]: tuple(it for it in row["choices"] if ":" not in it)
    for row in params("protocol.*")
    if row["choices"]
}


def found(mission: Scenario, seed: int = 0) -> dict[str, Any]:
    return {row.name: row for row in reached(recording(simulate(mission, seed=seed)))}


def test_a_fleet_below_one_asv() -> None:
    """Three AUVs in three slots of 3 ticks, and a downlink slot of 15: all fixed every 0.8 s."""
    rows = found(still(3, duration_s=80.0))
    assert rows["Pings in HF range"].share == 1.0
    assert rows["Fixes per AUV, mean"].reached == pytest.approx(1.25, abs=0.02)
    assert rows["Fixes per AUV of the best protocol"].possible == pytest.approx(1 / 0.448)
    groups = rows["Ping groups in a round"]
    assert (groups.reached, groups.possible, groups.share) == (3.0, 3.0, 1.0)
    assert rows["AUVs in range that share a slot"].share == 1.0
    assert rows["Pings decoded by the busiest ASV"].reached == pytest.approx(3.75, abs=0.05)
    assert rows["Records on the downlink"].possible == pytest.approx(3 / 0.448)
    latency = rows["Latency, mean of all fixes"]
    assert latency.possible == pytest.approx(0.192 + 2 * 22.36 / 1500, abs=1e-3)
    assert latency.share == pytest.approx(latency.possible / latency.reached)


def test_rates_are_those_of_the_time_that_is_judged() -> None:
    late = found(still(3, duration_s=80.0, record={"metrics_from_s": 60.0}))
    rate = late["Fixes per AUV, mean"]
    assert (rate.reached, rate.possible) == pytest.approx((1.25, 1.25), abs=0.05)


def test_the_page_shows_each_limit_with_a_bar() -> None:
    """A bar says how much of a limit was reached; what reached it is told in a sentence."""
    mission = still(3, duration_s=20.0)
    page = simulate(mission, seed=0).report()
    section = page.split('<section id="possible">')[1].split("</section>")[0]
    rows = found(mission)
    full = {name for name, row in rows.items() if row.share is not None and row.share > 0.995}
    assert 0 < len(full) < len(rows)
    sentence = section.split("<p>At their limit: ")[1].split("</p>")[0]
    for name in rows:
        assert (f'<th scope="row">{name}<small>' in section) == (name not in full)
        assert (name in sentence) == (name in full)
    assert section.count("<svg") == len(rows) - len(full)


def test_a_mission_without_any_fix_has_its_limits_too() -> None:
    rows = found(still(2, at=400.0, duration_s=10.0))
    assert rows["Pings in HF range"].share == 0.0
    assert "Latency, mean of all fixes" not in rows


def test_what_comes_from_an_asv_that_has_failed_was_possible() -> None:
    """The first frame is still in the water when its ASV, the only one, fails."""
    mission = still(2, duration_s=10.0)
    arrival = simulate(mission, seed=0).tables["fixes"]["delivered_at_s"][0]
    failures = [{"asv": 0, "at_s": arrival - 0.001}]
    rows = found(still(2, duration_s=10.0, asvs={"count": 1, "failures": failures}))
    latency = rows["Latency, mean of all fixes"]
    assert latency.possible == pytest.approx(0.192 + 2 * 22.36 / 1500, abs=1e-3)
    assert latency.share is not None
    assert latency.share < 1.0


def test_a_schedule_that_errs_about_places_is_not_better_than_possible() -> None:
    """By beliefs it may make fewer groups than are free of conflicts: nothing is said of them."""
    positions = {"positions": "last_fix"}
    rows = found(still(2, duration_s=10.0, protocol=positions))
    assert "Fixes per AUV, mean" in rows
    assert "Ping groups in a round" not in rows
    assert "AUVs in range that share a slot" not in rows


def test_a_mission_without_any_round_has_a_page() -> None:
    nobody = [{"asv": 0, "at_s": 0.0}]
    result = simulate(scenario(duration_s=10.0, asvs={"count": 1, "failures": nobody}))
    assert len(result.tables["rounds"]) == 0
    names = {row.name for row in reached(recording(result))}
    assert "Fixes per AUV, mean" in names
    assert "Ping groups in a round" not in names
    assert '<section id="possible">' in result.report()


def drawn(draw: random.Random) -> Scenario:
    """Return a fleet, a survey and a protocol drawn at random; what contradicts itself anew."""
    protocol: dict[str, Any] = {
        "schedule": draw.choice(PARTS["schedule"]),
        "downlink": draw.choice(PARTS["downlink"]),
        "broadcaster": draw.choice(PARTS["broadcaster"]),
        "ranging": draw.choice((*PARTS["ranging"], "owtt_sync")),
        "frame_s": draw.choice((0.5, 1.0, 3.0)),
        "tick_rate_hz": draw.choice((None, 30.0)),
        "positions": draw.choice(("truth", "last_fix", "carried_forward")),
    }
    if draw.random() < 0.5:
        protocol |= {"uplink_guard_s": 0.0, "shortest_uplink_slot_s": 0.0}
        protocol |= {"downlink_guard_s": 0.0, "shortest_downlink_slot_s": 0.0}
    try:
        return scenario(
            duration_s=draw.choice((20.0, 60.0)),
            survey={"side_m": draw.choice((40, 100, 140)), "depth_m": draw.choice((2.0, 10.0))},
            auvs={
                "count": draw.randint(1, 7),
                "speed_m_per_s": draw.choice((0.6, 1.5)),
                "vehicle": {"model": "kinematic", "turning_radius_m": 2},
            },
            asvs={"count": draw.randint(1, 4)},
            acoustics={
                "hf": {"range_m": draw.choice((30.0, 50.0)), "ping_s": draw.choice((0.005, 0.05))},
                "mf": {"payload_bytes": draw.choice((None, 24, 60))},
                "loss": {"law": draw.choice(("paper", "none"))},
            },
            protocol=protocol,
        )
    except ValidationError:
        return drawn(draw)


@pytest.mark.parametrize("seed", range(24))
def test_nothing_is_reached_above_its_limit(seed: int) -> None:
    """A round under way as the mission ends, or as an AUV leaves the range, counts whole."""
    mission = drawn(random.Random(seed))
    result = simulate(mission, seed=seed)
    rounds = len(result.tables["rounds"])
    for row in reached(recording(result)):
        slack = 0.005 if row.least or row.unit == "" else 1.0 / rounds + 0.02
        assert row.share is not None
        assert row.share <= 1.0 + slack + 1e-3, (row, mission.protocol)
