"""The monitor names what broke a schedule first, whatever is recorded."""

import json
from typing import Any

import pytest
from worlds import scenario

from bindusbl_des import Scenario, load_result, simulate, verify

COLLIDING = {
    "pings": {},
    "calls": {"protocol": {"ranging": "twtt"}},
    "frames": {
        "acoustics": {"mf": {"range_m": 300.0}},
        "protocol": {"schedule": "one_per_slot", "downlink": "pipelined_group",
                     "downlink_guard_s": 0.0, "shortest_downlink_slot_s": 0.0,
                     "uplink_guard_s": 0.0, "shortest_uplink_slot_s": 0.0},
    },
    "beacons": {
        "survey": {"depth_m": 0.0},
        "asvs": {"formation": {"radius_m": 28.9}},
        "environment": {"sound_speed_m_per_s": 1480.0, "assumed_sound_speed_m_per_s": 1500.0},
        "protocol": {"ranging": "passive", "uplink_guard_s": 0.0, "shortest_uplink_slot_s": 0.0},
    },
}  # fmt: skip


@pytest.mark.parametrize("changes", COLLIDING.values(), ids=COLLIDING)
def test_the_first_violation_is_what_the_witness_says(changes: dict[str, Any]) -> None:
    """Found from tables by the verifier, and by the monitor from what was recorded."""
    witness = verify(scenario(**changes)).witness
    assert witness is not None
    broken = simulate(Scenario.model_validate(witness.plan), witness.seed).violations
    assert broken is not None
    assert broken.first is not None
    assert broken.count >= 1
    assert broken.first.receiver == witness.receiver
    assert broken.first.sender in {signal.sender for signal in witness.signals}


def test_who_met_whom_is_told_in_every_face(tmp_path: Any) -> None:
    """In the summary, in run.json read again, on the page; also with metrics alone."""
    witness = verify("recovery_140m").witness
    assert witness is not None
    for detail in ("full", "summary"):
        plan = {**witness.plan, "record": {"detail": detail}}
        result = simulate(Scenario.model_validate(plan))
        assert result.violations is not None
        told = result.violations.text
        assert told == (
            "The schedule was violated 2 times, first at 0.2672 s a ping of AUV2 (round 0, slot 1) "
            "met that of AUV1 at ASV0."
        )
        assert told in " ".join(result.summary().split("\n"))
        result.write(tmp_path / detail)
        assert load_result(tmp_path / detail).violations == result.violations
        assert told in (tmp_path / detail / "report.html").read_text()


def test_whoever_pings_as_he_likes_breaks_no_schedule() -> None:
    """Collisions of random access are no violations; those without any are told nothing of."""
    free = simulate(scenario(duration_s=20.0, protocol={"schedule": "aloha", "frame_s": 0.2}))
    assert free.violations is None
    kept = simulate(scenario(duration_s=20.0, asvs={"count": 1}))
    assert kept.violations is not None
    assert (kept.violations.count, kept.violations.first) == (0, None)
    assert "violated" not in kept.summary()


def test_violations_read_back_are_checked(tmp_path: Any) -> None:
    witness = verify("recovery_140m").witness
    assert witness is not None
    simulate(Scenario.model_validate(witness.plan)).write(tmp_path / "r")
    file = tmp_path / "r" / "run.json"
    data = json.loads(file.read_text())
    told = data["violations"]
    for wrong in ({**told, "count": -1}, {**told, "first": {"kind": "song"}}, {"count": 1}, 7):
        file.write_text(json.dumps({**data, "violations": wrong}))
        with pytest.raises(ValueError, match="violations"):
            load_result(tmp_path / "r")
