"""What is compiled where the package is installed."""

from pathlib import Path

import pytest

from bindusbl_des import Scenario, load_scenario, sweep
from bindusbl_des.apps.campaigns.workers import batches
from bindusbl_des.apps.commands import doctor as warming


@pytest.mark.parametrize("kind", warming.KINDS, ids=" ".join)
def test_every_kind_is_a_scenario(kind: tuple[str, ...]) -> None:
    load_scenario(kind[0], overrides=kind[1:])


@pytest.mark.usefixtures("in_this_process")
def test_a_folder_says_when_it_holds_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Then the parent of a campaign loads no code: its workers do."""
    monkeypatch.setattr(warming, "KINDS", warming.KINDS[-1:])
    flown: list[str] = []
    monkeypatch.setattr(batches, "warm", lambda scenario, _: flown.append(scenario))
    monkeypatch.setattr(batches, "kept_in", lambda: tmp_path)
    bay = Scenario(name="bay", duration_s=2.0)
    sweep(bay)
    assert len(flown) == 2  # by the parent, and by who flies it
    assert list(warming.warm(tmp_path)) == [1]
    flown.clear()
    sweep(bay)
    assert len(flown) == 1
