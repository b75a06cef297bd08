"""What is compiled where the package is installed."""

from pathlib import Path

import pytest

from bindusbl_des import load_scenario
from bindusbl_des.campaigns.experiments.experiment import Experiment, ExperimentPlan
from bindusbl_des.campaigns.workers import batches
from bindusbl_des.commands import doctor as warming
from bindusbl_des.core.compiled import warm_marker


@pytest.mark.parametrize("kind", warming.KINDS, ids=" ".join)
def test_every_kind_is_a_scenario(kind: tuple[str, ...]) -> None:
    load_scenario(kind[0], overrides=kind[1:])


def test_a_folder_says_when_it_holds_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Then the parent of a campaign loads no code: its workers do."""
    monkeypatch.setattr(warming, "KINDS", warming.KINDS[-1:])
    flown: list[str] = []
    monkeypatch.setattr(batches, "warm", lambda scenario, _: flown.append(scenario))
    monkeypatch.setattr(batches, "kept_in", lambda: tmp_path)
    plan = ExperimentPlan(Experiment("bay", {"name": "bay"}, ({},), (0,)))
    batches.compile_kernels(plan, tmp_path)
    assert not warm_marker(tmp_path).exists()
    assert len(flown) == 1
    assert list(warming.warm(tmp_path)) == [1]
    assert warm_marker(tmp_path).exists()
    batches.compile_kernels(plan, tmp_path)
    assert len(flown) == 1
