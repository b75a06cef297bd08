"""What is compiled where the package is installed."""

from pathlib import Path

import pytest

from bindusbl_des import load_scenario
from bindusbl_des.commands import doctor as warming


@pytest.mark.parametrize("kind", warming.KINDS, ids=" ".join)
def test_every_kind_is_a_scenario(kind: tuple[str, ...]) -> None:
    load_scenario(kind[0], overrides=kind[1:])


def test_a_folder_says_when_it_holds_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(warming, "KINDS", warming.KINDS[-1:])
    assert not warming.warmed(tmp_path).exists()
    assert list(warming.warm(tmp_path)) == [1]
    assert warming.warmed(tmp_path).exists()
    monkeypatch.setattr(warming, "KINDS", (*warming.KINDS, ("remus_1km",)))
    assert not warming.warmed(tmp_path).exists(), "another kind was never flown"
