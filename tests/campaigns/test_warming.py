"""Compiled code is made before missions are handed out: once for each kind of mission."""

from pathlib import Path

import pytest
from campaigns_for_tests import OneThread, hand_made

from bindusbl_des import Scenario, sweep
from bindusbl_des.apps.campaigns import running
from bindusbl_des.apps.campaigns.workers import batches as warming


def test_missions_of_one_kind_are_begun_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Other numbers, names and places need no other code; an option that is on may need some."""
    begun: list[Scenario] = []
    monkeypatch.setattr(warming, "simulate", lambda scenario, _: begun.append(scenario))
    monkeypatch.setattr(warming, "_ready", set())
    bay = {"name": "bay", "duration_s": 60.0}
    biased = {"environment": {"assumed_sound_speed_m_per_s": 1500.0}}
    for changes in (
        {}, {"name": "cove", "duration_s": 90.0}, {"auvs": {"count": 5}},
        {"asvs": {"count": 2, "formation": {"positions_m": [[0.0, 0.0], [9.0, 9.0]]}}},
        {"navigation": {"random_walk_m_per_sqrt_s": 0.5}}, biased,
    ):  # fmt: skip
        scenario = Scenario.model_validate({**bay, **changes}).model_dump_json()
        warming.warm(scenario, tmp_path)
    assert [it.environment.assumed_sound_speed_m_per_s for it in begun] == [None, 1500.0]
    assert {it.duration_s for it in begun} == {warming.WARMING_S}


def test_workers_start_while_equations_are_compiled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They import for as long as their parent needs to find compiled code, and wait for batches."""
    begun: list[str] = []

    class Pool(OneThread):
        def begin(self) -> None:
            begun.append("workers")

    hand_made(monkeypatch, lambda *_: [{}])
    monkeypatch.setattr(running, "pool_for", Pool)
    monkeypatch.setattr(running, "compile_kernels", lambda *_: begun.append("equations"))
    sweep(Scenario(name="bay", duration_s=5.0), tmp_path / "bay", quiet=True)
    assert begun == ["workers", "equations"]
