"""What campaigns cost beyond their missions: `python benchmarks/campaigns.py [MISSIONS] [NAME]`.

One campaign of missions of some 20 ms runs in three ways: in two processes, as eight shards, two at
a time, that are merged, and on a Dask cluster of eight worker processes of this machine.  Each is
what a user runs, from the start of Python to the last file.  *Efficiency* is the processor time
that the missions alone take, one after the other in one process, over that of all processes of the
campaign: what is missing from 1 is starting, handing out, writing and reporting.  By the clock the
ideal is that time over the machine's cores, which eight workers on two cores share like two.

Then campaigns of ever more missions, each a copy of one whose rows are written without flying it:
what the parent keeps in memory, and how long `status` takes.  What is measured is printed, and kept
in history.json under NAME if one is given.
"""

import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from bindusbl_des import Scenario, simulate
from bindusbl_des.benchmark.command_lines import call
from bindusbl_des.benchmark.missions import standard_mission
from bindusbl_des.benchmark.stopwatch import Took, clocked
from bindusbl_des.campaigns.campaign import Campaign
from bindusbl_des.campaigns.experiments.experiment import Experiment
from bindusbl_des.campaigns.experiments.plan import Plan
from bindusbl_des.campaigns.running import first_record
from bindusbl_des.campaigns.storage.folder import RECORD, write_json, write_scenario
from bindusbl_des.campaigns.workers.batches import gathered, write
from bindusbl_des.campaigns.workers.gathering import Ran
from bindusbl_des.campaigns.workers.supervisor import batch_of

HERE = Path(__file__).resolve().parent

MISSIONS = 2000
POINTS = 8
SHARDS = WORKERS_OF_CLUSTER = 8
WORKERS = 2

# Missions of the campaigns that `status` looks at, and in each of their parts.
LARGE = (1000, 10_000, 100_000)
IN_PART = 700

ON_DASK = """
import sys
from distributed import LocalCluster
from bindusbl_des import sweep

if __name__ == "__main__":
    options = {"threads_per_worker": 1, "dashboard_address": None}
    with LocalCluster(n_workers=int(sys.argv[3]), **options) as it:
        sweep(sys.argv[1], sys.argv[2], backend=f"dask:{it.scheduler_address}")
"""

# What the system says of a process that has begun another program is of both, but for this file.
STATUS = """
import sys
from bindusbl_des.cli import main
try:
    main(["status", sys.argv[1]])
finally:
    print(open("/proc/self/status").read())
"""


def scaled_out(missions: int) -> dict[str, Any]:
    """Return what a campaign costs in each of the ways."""
    each_s = mission_s()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        file = experiment_file(folder, missions)
        in_processes(file, folder / "warm")  # compiles and loads
        ways = {
            f"{WORKERS} processes": in_processes,
            f"{SHARDS} shards, {WORKERS} at a time, merged": in_shards,
            f"Dask, {WORKERS_OF_CLUSTER} worker processes": on_dask,
        }
        took = {
            way: clocked(lambda n=n, run=run: run(file, folder / str(n)))  # type: ignore[misc]
            for n, (way, run) in enumerate(ways.items())
        }
    return {
        "missions": missions,
        "mission_ms": 1e3 * each_s,
        "cores": len(os.sched_getaffinity(0)),
        "ways": {way: efficiency(missions * each_s, it) for way, it in took.items()},
    }


def efficiency(ideal_s: float, took: Took) -> dict[str, float]:
    """Return what a campaign took, and how much of that its missions take alone."""
    return {
        "wall_s": took.wall,
        "processor_s": took.processor,
        "efficiency": ideal_s / took.processor,
        "efficiency_by_the_clock": ideal_s / len(os.sched_getaffinity(0)) / took.wall,
    }


def scenario(point: int) -> Scenario:
    """Return the scenario of a point: three AUVs under three ASVs, each point a little faster."""
    mission = standard_mission(3, 3)
    auvs = mission.auvs.model_copy(update={"speed_m_per_s": speed(point)})
    record = mission.record.model_copy(update={"detail": "summary"})
    return mission.model_copy(update={"auvs": auvs, "record": record})


def speed(point: int) -> float:
    """Return how fast AUVs of a point are (m/s)."""
    return 0.6 + 0.01 * point


def mission_s() -> float:
    """Return the processor time (s) of one mission among many of its point."""
    simulate(scenario(0))
    took = clocked(lambda: [simulate(scenario(n % POINTS), n) for n in range(8 * POINTS)])
    return took.processor / (8 * POINTS)


def experiment_file(folder: Path, missions: int) -> Path:
    """Write the campaign's experiment; return its file."""
    given = standard_mission(3, 3).model_dump(mode="json", exclude_unset=True)
    (folder / "base.yaml").write_text(json.dumps(given))  # JSON is YAML
    vary = {"auvs.speed_m_per_s": [speed(point) for point in range(POINTS)]}
    file = folder / "experiment.yaml"
    seeds = missions // POINTS
    file.write_text(json.dumps({"scenario": "base.yaml", "vary": vary, "seeds": seeds}))
    return file


def in_processes(file: Path, out: Path) -> None:
    """Run it in two processes."""
    call(["sweep", str(file), "--workers", str(WORKERS), "--out", str(out)])


def in_shards(file: Path, out: Path) -> None:
    """Run its shards, two at a time, and merge them."""
    words = [sys.executable, "-m", "bindusbl_des.cli", "-q", "sweep", str(file), "--workers", "1"]
    shards = [f"{out}-{part}" for part in range(1, SHARDS + 1)]
    for first in range(0, SHARDS, WORKERS):
        running = [
            subprocess.Popen(
                [*words, "--shard", f"{part + 1}/{SHARDS}", "--out", shards[part]],
                stdout=subprocess.DEVNULL,
            )
            for part in range(first, first + WORKERS)
        ]
        ended = [it.wait() for it in running]
        if any(ended):
            raise RuntimeError("a shard failed")
    call(["merge", *shards, "--out", str(out)])


def on_dask(file: Path, out: Path) -> None:
    """Run it on a cluster of this machine, which is started and ended."""
    script = file.parent / "on_dask.py"
    script.write_text(ON_DASK)
    words = [sys.executable, str(script), str(file), str(out), str(WORKERS_OF_CLUSTER)]
    subprocess.run(words, check=True, capture_output=True)


def large_folders() -> Iterator[dict[str, Any]]:
    """Yield what `status` takes of campaigns of ever more missions."""
    tables = simulate(scenario(0)).arrow
    for missions in LARGE:
        with tempfile.TemporaryDirectory() as name:
            campaign = written(Path(name, "out"), missions, tables)
            yield {"missions": missions, "parts": -(-missions // IN_PART), **status(campaign)}


def written(folder: Path, missions: int, tables: Any) -> Campaign:
    """Return a campaign all of whose missions have the same rows, but for their labels."""
    points = tuple({"auvs.speed_m_per_s": speed(point)} for point in range(POINTS))
    given = standard_mission(3, 3).model_dump(mode="json", exclude_unset=True)
    plan = Plan(Experiment("large", given, points, tuple(range(missions // POINTS))))
    folder.mkdir()
    session = {"began_at": time.time(), "rows_before": 0}
    record = {**first_record(plan, None), "session": session, "status": "interrupted"}
    write_json(folder / RECORD, record)
    write_scenario(folder, given)
    for first in range(0, len(plan), IN_PART):
        numbers = tuple(range(first, min(first + IN_PART, len(plan))))
        batch = batch_of(plan, folder, numbers, 0.0)
        rows = gathered(batch)
        for mission in batch.missions:
            rows.add(Ran(mission, 0.02, tables))
        write(batch, rows)
    return Campaign(folder, plan, record)


def status(campaign: Campaign) -> dict[str, float]:
    """Return how long `status` takes, from the start of Python, and its memory."""
    said = ""

    def ask() -> None:
        nonlocal said
        words = [sys.executable, "-c", STATUS, str(campaign.folder)]
        said = subprocess.run(words, check=True, capture_output=True, text=True).stdout

    took = min((clocked(ask) for _ in range(3)), key=lambda it: it.processor)
    if f"{len(campaign.plan)}" not in said:
        raise RuntimeError(f"status says something else: {said}")
    peak = re.search(r"^VmHWM:\s*(\d+) kB$", said, re.MULTILINE)
    assert peak is not None
    return {
        "status_wall_s": took.wall,
        "status_processor_s": took.processor,
        "status_memory_mb": int(peak[1]) * 1024 / 1e6,
    }


def main(words: list[str]) -> None:
    """Measure, print, and keep."""
    missions = int(words[0]) if words else MISSIONS
    found = {**scaled_out(missions), "large": list(large_folders())}
    print(json.dumps(found, indent=1))
    if len(words) > 1:
        sys.path[:0] = [str(HERE), str(HERE / "peers")]
        from record import history, keep

        keep(words[1], {**history()[words[1]], "campaigns": found})


if __name__ == "__main__":
    main(sys.argv[1:])
