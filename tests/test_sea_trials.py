"""Trials at sea: the tables of docs/validation.md are what experiments/sea prints."""

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="module")
def predict() -> ModuleType:
    """The script, loaded as a module."""
    spec = importlib.util.spec_from_file_location("predict", ROOT / "experiments/sea/predict.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_modes_of_a_modem(predict: ModuleType) -> None:
    page = (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
    assert predict.table_of_modes(predict.by_mode()) in page


def test_the_fit_has_seen_no_mode_but_its_own(predict: ModuleType, tmp_path: Path) -> None:
    """Other measurements of the other modes change no prediction."""
    rows = predict.pd.read_csv(predict.HERE / "delivery_by_mode.csv")
    rows.loc[rows["mode"] != predict.FITTED, "delivery_ratio"] = 0.5
    rows.to_csv(tmp_path / "delivery_by_mode.csv", index=False)
    found = predict.by_mode().predicted
    here, predict.HERE = predict.HERE, tmp_path
    try:
        assert (predict.by_mode().predicted == found).all()
    finally:
        predict.HERE = here


def test_a_makers_own_test(predict: ModuleType) -> None:
    page = (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
    assert predict.table_of_the_makers_test() in page
