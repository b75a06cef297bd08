"""Campaigns on a Dask cluster: a scheduler and two workers, each a process of its own, over TCP."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from campaigns_for_tests import fly_with, parts, same

from bindusbl_des import Campaign, sweep

SLOW = """
import os, time

def slow(view):
    if view.round == 0:
        open(f"{os.path.dirname(__file__)}/pid-{os.getpid()}", "w").close()
        time.sleep(0.05)
    return [[auv] for auv in range(len(view.auvs))]
"""


@dataclass
class Cluster:
    """A cluster of this machine."""

    address: str
    workers: "list[subprocess.Popen[bytes]]"


def start(home: Path, *words: str) -> "subprocess.Popen[bytes]":
    """Start one of Dask's own commands, as its users do."""
    with open(home / "dask.log", "ab") as log:
        return subprocess.Popen(
            [sys.executable, "-m", "dask", *words],
            cwd=home,
            env={**os.environ, "PYTHONPATH": f"{home}:{Path(__file__).parents[2]}"},
            stdout=log,
            stderr=log,
        )


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder with an experiment of missions that take a moment."""
    pytest.importorskip("distributed")
    folder = tmp_path_factory.mktemp("cluster")
    (folder / "moments.py").write_text(SLOW)
    (folder / "base.yaml").write_text(
        "name: tiny\nduration_s: 5\nprotocol: {schedule: 'moments:slow'}\n"
    )
    (folder / "experiment.yaml").write_text(
        "scenario: base.yaml\nvary: {asvs.count: [2, 3]}\nseeds: 20\n"
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("BINDUSBL_ALLOW_PLUGINS", "1")
        patch.syspath_prepend(str(folder))
        yield folder


@pytest.fixture(scope="module")
def cluster(home: Path) -> Iterator[Cluster]:
    """A scheduler and two workers, one mission at a time each."""
    file = home / "scheduler.json"
    file.unlink(missing_ok=True)
    options = ("--host", "127.0.0.1", "--no-dashboard")
    scheduler = start(home, "scheduler", *options, "--port", "0", "--scheduler-file", str(file))
    until = time.monotonic() + 120
    while not file.exists():
        assert time.monotonic() < until, (home / "dask.log").read_text()
        time.sleep(0.05)
    address = json.loads(file.read_text())["address"]
    words = ("worker", address, *options, "--nthreads", "1", "--no-nanny")
    workers = [start(home, *words) for _ in range(2)]
    yield Cluster(address, workers)
    for process in (*workers, scheduler):
        process.kill()
        process.wait()


@pytest.fixture(scope="module")
def undisturbed(home: Path) -> Campaign:
    """The campaign run in one process."""
    with pytest.MonkeyPatch.context() as patch:
        fly_with(patch)
        return sweep(home / "experiment.yaml", home / "undisturbed")


@pytest.mark.slow
def test_a_cluster_finds_what_one_process_finds(
    cluster: Cluster, undisturbed: Campaign, home: Path, tmp_path: Path
) -> None:
    """The tables are equal, and both workers ran some of the missions."""
    found = sweep(home / "experiment.yaml", tmp_path / "c", backend=f"dask:{cluster.address}")
    same(undisturbed, found)
    assert found.state().status == "complete"
    for worker in cluster.workers:
        assert (home / f"pid-{worker.pid}").exists()


@pytest.mark.slow
def test_a_worker_of_a_cluster_that_is_killed_costs_nothing(
    cluster: Cluster, undisturbed: Campaign, home: Path, tmp_path: Path
) -> None:
    """Its missions are run again by the other one, once each."""
    folder = tmp_path / "killed"
    killed: list[int] = []

    def kill() -> None:
        until = time.monotonic() + 120
        while len(parts(folder)) < 2 and time.monotonic() < until:
            time.sleep(0.02)
        killed.append(len(parts(folder)))
        cluster.workers[0].send_signal(signal.SIGKILL)

    killer = threading.Thread(target=kill)
    killer.start()
    found = sweep(home / "experiment.yaml", folder, backend=f"dask:{cluster.address}")
    killer.join()
    assert killed[0] >= 2
    assert cluster.workers[0].wait(60) == -signal.SIGKILL
    same(undisturbed, found)
