"""What changes are predicted to do where no mission could be flown."""

import json
from dataclasses import asdict

import pytest

from bindusbl_des import load_scenario, simulate
from bindusbl_des.apps.planning import relief
from bindusbl_des.apps.planning.relief import foreseen
from bindusbl_des.core.results.effects import Advice, from_data


def test_changes_are_predicted_where_none_is_flown() -> None:
    """A mission too large to try: the page says what is predicted, what it really is like."""
    result = simulate(load_scenario("recovery_140m"), seed=0)
    found = foreseen(result)
    assert found == tuple(sorted(found, key=lambda it: it.then_m))
    assert all(it.then_m < 0.9 * it.now_m for it in found)
    best = found[0]
    assert best.settings == ("navigation.filter=kalman",)
    better = simulate(load_scenario("recovery_140m", overrides=list(best.settings)), seed=0)
    flown = [max(it.auvs.position_error_m) for it in (result, better)]
    for predicted, error in zip((best.now_m, best.then_m), flown, strict=True):
        assert abs(predicted - error) < 0.35 * error
    result.advice = Advice(0, foreseen=found, shortage="too large")
    assert from_data(json.loads(json.dumps(asdict(result.advice)))).foreseen == found
    page = result.report()
    assert "<b>Predicted, not flown:</b>" in page
    assert f"<b>{best.now_m:.2f} to {best.then_m:.2f} m</b>" in page


def test_what_cannot_be_predicted_has_no_predictions() -> None:
    """AUVs that ping as they like have no rounds."""
    overrides = ["duration_s=20", "protocol.schedule=aloha", "protocol.frame_s=5"]
    assert foreseen(simulate(load_scenario("recovery_140m", overrides=overrides), seed=0)) == ()


def test_large_fleets_are_not_predicted(monkeypatch: pytest.MonkeyPatch) -> None:
    """A reader of a mission of seconds would wait for minutes."""
    result = simulate(load_scenario("recovery_140m"), seed=0)
    monkeypatch.setattr(relief, "LARGEST", 8)
    assert foreseen(result) == ()
