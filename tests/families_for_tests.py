"""Families of parts that tests run through, and a folder with parts of one's own."""

import sys
from collections.abc import Iterable, Iterator
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest

from bindusbl_des.core.scenario.families import FAMILIES
from bindusbl_des.support import plugins
from bindusbl_des.support.plugins import Family

MISSION: dict[str, Any] = {
    "name": "m",
    "duration_s": 6.0,
    "auvs": {"count": 2},
    "survey": {"side_m": 40.0},
}
OPEN = [family for family in FAMILIES if family.is_open]
BY_KEY = {family.key: family for family in OPEN}
ASV, AUV = BY_KEY["asvs.vehicle"], BY_KEY["auvs.vehicle"]
CHANNEL, MF_CHANNEL = BY_KEY["acoustics.hf.channel"], BY_KEY["acoustics.mf.channel"]
SCHEDULE, DOWNLINK = BY_KEY["protocol.schedule"], BY_KEY["protocol.downlink"]
ACCESS = BY_KEY["protocol.access"]
BROADCASTER, RANGING = BY_KEY["protocol.broadcaster"], BY_KEY["protocol.ranging"]
INSTRUMENT, NAVIGATOR = BY_KEY["usbl.model"], BY_KEY["navigation.filter"]
PLACEMENT, ROUTE = BY_KEY["asvs.formation"], BY_KEY["auvs.route"]


def put(data: dict[str, Any], key: str, value: Any) -> dict[str, Any]:
    """Return plain data with a value at a dotted key."""
    *sections, last = key.split(".")
    out = part = deepcopy(data)
    for name in sections:
        part = part.setdefault(name, {})
    part[last] = value
    return out


def allow(names: Iterable[str]) -> None:
    """Have parts of one's own be allowed in this process."""
    plugins.allow(names)


def forbid() -> None:
    """Have nothing be allowed in this process any more."""
    plugins._admitted.clear()


def forget() -> None:
    """Have this process know no parts of one's own that it has loaded."""
    plugins._loaded.clear()


def unknown(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have this process know no parts of one's own, and allow none, until the test ends."""
    monkeypatch.setattr(plugins, "_admitted", set())
    monkeypatch.setattr(plugins, "_loaded", {})


def forget_objects(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have this process know no objects that were given in Python, until the test ends."""
    monkeypatch.setattr(plugins, "_here", {})


def home_of(folder: Path, monkeypatch: pytest.MonkeyPatch, **modules: str) -> Iterator[Path]:
    """Work in a folder with modules of one's own; nothing has been allowed in this process."""
    for name, text in modules.items():
        (folder / f"{name}.py").write_text(text)
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.setenv("PYTHONPATH", str(folder), prepend=":")
    monkeypatch.chdir(folder)
    monkeypatch.delenv("BINDUSBL_ALLOW_PLUGINS", raising=False)
    unknown(monkeypatch)
    yield folder
    for name in modules:
        sys.modules.pop(name, None)


def each_but_slow_ones(families: Iterable[Family], daily: Family) -> pytest.MarkDecorator:
    """Return a mark that runs a test with each family; every day with one of them only."""
    cases = [pytest.param(it, marks=() if it is daily else pytest.mark.slow) for it in families]
    return pytest.mark.parametrize("family", cases, ids=lambda family: family.noun)
