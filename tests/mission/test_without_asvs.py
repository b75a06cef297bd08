"""Fleets of AUVs alone: `asvs.count: 0`."""

import json
from pathlib import Path

import numpy as np
import pytest
from commands_for_tests import call

from bindusbl_des import Scenario, plan, simulate

RISING = {
    "name": "alone", "duration_s": 240.0, "asvs": {"count": 0},
    "auvs": {"count": 2, "route": {"surface_every_s": 60}},
    "navigation": {"gnss_fix": {"sd_m": 1}},
}  # fmt: skip


def test_without_asvs_no_round_begins_and_auvs_drift() -> None:
    drifting = simulate(Scenario(name="m", duration_s=60.0, asvs={"count": 0}), seed=1)
    deaf = {"count": 1, "formation": {"positions_m": [[9e4, 0.0]]}}
    unheard = simulate(Scenario(name="m", duration_s=60.0, asvs=deaf), seed=1)
    assert len(drifting.tables["rounds"]) == len(drifting.tables["pings"]) == 0
    own, other = (it.auvs.position_error_m.to_numpy() for it in (drifting, unheard))
    assert np.all(own > 0.5)
    np.testing.assert_array_equal(own, other)


def test_auvs_that_come_up_are_fixed_by_gnss_alone() -> None:
    result = simulate(Scenario.model_validate(RISING), seed=1)
    assert len(result.tables["gnss_fixes"]) > 10
    assert len(result.tables["fixes"]) == 0
    stays = {**RISING, "auvs": {"count": 2}}
    below = simulate(Scenario.model_validate(stays), seed=1)
    assert result.auvs.position_error_m.max() < 0.8 * below.auvs.position_error_m.max()


def test_random_access_needs_an_asv() -> None:
    with pytest.raises(ValueError, match=r"asvs.count: is 0, and with aloha AUVs send to ASVs"):
        Scenario(name="m", asvs={"count": 0}, protocol={"access": "aloha"})


def test_a_modem_of_no_vessel_is_told(tmp_path: Path) -> None:
    path = tmp_path / "alone.yaml"
    path.write_text(json.dumps(RISING), encoding="utf-8")
    told = call("live", str(path), "--to", "seatrac:pty")
    assert told.exit_code == 2
    assert "seatrac:pty: there is no ASV0; there are AUV0, AUV1" in told.stderr


@pytest.mark.slow
def test_no_asv_is_a_team_beside_others(tmp_path: Path) -> None:
    path = tmp_path / "plan.yaml"
    (tmp_path / "alone.yaml").write_text(json.dumps(RISING), encoding="utf-8")
    question = {
        "scenario": "alone.yaml",
        "goal": {"metric": "position_error_m", "below": 4},
        "candidates": [{"asvs.count": 0}, {"asvs.count": 1}],
    }
    path.write_text(json.dumps(question), encoding="utf-8")
    record = plan(path, tmp_path / "made", workers=1).record
    assert record["answer"]["asvs.count"] == 0
    assert record["told"][0].startswith("no ASV:")
    assert any(text.startswith("Coming up to fix takes AUV") for text in record["told"])
    assert {row["what"] for row in record["sensitivity"]} == {"drift"}
