"""What inputs are about: a folder of a run and one of a campaign, made once; links; devices."""

import os
import shutil
from collections.abc import Iterable
from contextlib import suppress
from itertools import count
from pathlib import Path
from stat import S_IFCHR
from typing import Any
from unittest.mock import patch

import pytest
from campaigns_for_tests import WORKERS, OneThread, fly_with
from commands_for_tests import call

from bindusbl_des.apps.commands import missions, sweeps
from bindusbl_des.apps.commands.console import refuse, weigh

MASTERS = {
    "run": "run master.yaml --no-advice --out run",
    "campaign": "sweep master.yaml --vary asvs.count=2,3 --seeds 2 --out campaign",
}
MASTER = "name: master\nduration_s: 8\nauvs: {count: 2}\nasvs: {count: 2}\n"

# A mission that takes longer (s) or more memory (bytes) by its own estimate may well do so.
WORTH_RUNNING_S, WORTH_RUNNING_BYTES = 0.5, 3e8

_masters = Path()


def prepare(folder: Path) -> None:
    """Make the folders that others are copied from; have campaigns run in this process."""
    global _masters
    _masters = folder
    here = pytest.MonkeyPatch()  # for as long as this process lasts
    fly_with(here, _pool_for)
    for module in ("campaigns.running", "planning.flying"):
        here.setattr(f"bindusbl_des.apps.{module}.compile_kernels", lambda *_: None)
    missions.weigh = sweeps.weigh = _weigh
    os.chdir(folder)
    Path("master.yaml").write_text(MASTER, encoding="utf-8")
    ticks = count()
    with patch("time.perf_counter", lambda: 0.25 * next(ticks)), patch("time.time", lambda: 1.7e9):
        for line in MASTERS.values():  # the same, byte by byte, whenever they are made
            ended = call(*line.split())
            assert ended.exit_code == 0, ended.output


def _pool_for(backend: str, workers: int) -> Any:
    return OneThread() if backend == "local" else WORKERS(backend, workers)


def _weigh(name: str, cost: Any, anyway: bool, at_once: int = 1) -> None:
    weigh(name, cost, anyway, at_once)
    if cost.seconds > WORTH_RUNNING_S or cost.bytes > WORTH_RUNNING_BYTES:
        refuse(f"{name}: takes {cost}, more than an input may")


def lay_out(masters: Iterable[str]) -> None:
    """Put copies of some of the masters here, an empty folder, links, and two devices."""
    for name in masters:
        shutil.copytree(_masters / name, name)
    Path("empty").mkdir()
    Path("loop").symlink_to("loop")
    Path("dangling").symlink_to("nowhere/at/all")
    _device("null", 3)
    _device("full", 7)


def _device(name: str, minor: int) -> None:
    """Make a device of one's own: who may do so could also replace /dev/null for everybody."""
    with suppress(OSError):
        os.mknod(name, S_IFCHR | 0o666, os.makedev(1, minor))
        return
    Path(name).symlink_to(f"/dev/{name}")
