"""Families of parts that tests run through, and a folder with parts of one's own."""

import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest

from bindusbl_des.core import plugins
from bindusbl_des.core.plugins import PERMISSION, Family
from bindusbl_des.scenario.families import FAMILIES

MISSION: dict[str, Any] = {
    "name": "m",
    "duration_s": 6.0,
    "auvs": {"count": 2},
    "survey": {"side_m": 40.0},
}
OPEN = [family for family in FAMILIES if family.is_open]


def home_of(folder: Path, monkeypatch: pytest.MonkeyPatch, **modules: str) -> Iterator[Path]:
    """Work in a folder with modules of one's own; nothing has been allowed in this process."""
    for name, text in modules.items():
        (folder / f"{name}.py").write_text(text)
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.setenv("PYTHONPATH", str(folder), prepend=":")
    monkeypatch.chdir(folder)
    monkeypatch.delenv(PERMISSION, raising=False)
    monkeypatch.setattr(plugins, "_admitted", set())
    monkeypatch.setattr(plugins, "_loaded", {})
    yield folder
    for name in modules:
        sys.modules.pop(name, None)


def each_but_slow_ones(families: Iterable[Family], daily: Family) -> pytest.MarkDecorator:
    """Return a mark that runs a test with each family; every day with one of them only."""
    cases = [pytest.param(it, marks=() if it is daily else pytest.mark.slow) for it in families]
    return pytest.mark.parametrize("family", cases, ids=lambda family: family.noun)
