"""What campaigns cost beyond their missions: `python benchmarks/campaigns.py [MISSIONS] [NAME]`.

One campaign of missions of some 12 ms runs in three ways, two processes each: in a pool, as two
shares that are merged, and on a Dask cluster of this machine.  Each is what a user runs, from the
start of Python to the last file.  They run in turns, a small campaign and a large one each time:
what the small one takes beyond its missions is the *fixed cost* of a way, and what the large one
takes more, by mission, is what it costs at any length.  *Efficiency* is the pool's processor time
over that of a way, for the same large campaign.

Then campaigns of ever more missions, all but the last of which are copies of one, in parts of many
or few: how long `status` takes, `resume` of the last missions and of none, and what the process
that supervises them keeps in memory until its report is written.  What is measured is printed, and
kept in history.json under NAME if one is given.  0 MISSIONS leave what is kept there of the ways.
"""

import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

from bindusbl_des import Scenario, simulate
from bindusbl_des.apps.campaigns.experiments.experiment import Experiment, ExperimentPlan
from bindusbl_des.apps.campaigns.running import first_record
from bindusbl_des.apps.campaigns.storage.folder import RECORD, write_json, write_scenario
from bindusbl_des.apps.campaigns.workers.batches import Gathered, Ran, write
from bindusbl_des.apps.campaigns.workers.supervisor import batch_of
from bindusbl_des.benchmarks.command_lines import call
from bindusbl_des.benchmarks.missions import standard_mission
from bindusbl_des.benchmarks.timing import Took, clocked

HERE = Path(__file__).resolve().parent

MISSIONS, FEW = 6000, 16
# Points of the campaign
POINTS = 8
WORKERS = 2
TURNS = 3

# Large campaigns: their missions, and those in a part, which has half a minute of them: short ones,
# and such as take a second.  So many are not yet flown.
LARGE = ((1000, 700), (10_000, 700), (100_000, 700), (100_000, 30))
LEFT = 16

# Without its profiler, which samples missions all the time, as docs/clusters.md has it.
DASK_SETTINGS = {
    "DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED": "False",
    "DASK_DISTRIBUTED__ADMIN__TICK__INTERVAL": "1s",
}

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
COMMAND = """
import sys
from bindusbl_des.cli import main
if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    finally:
        print(open("/proc/self/status").read())
"""


def scaled_out(missions: int) -> dict[str, Any]:
    """Return what a campaign costs in each of the ways."""
    ways = {
        f"pool of {WORKERS} processes": in_processes,
        f"{WORKERS} shares at once, merged": in_shares,
        f"Dask, {WORKERS} worker processes": on_dask,
    }
    took: dict[str, list[tuple[Took, Took]]] = {way: [] for way in ways}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        small, large = (experiment_file(folder, count) for count in (FEW, missions))
        in_processes(small, folder / "warm")  # compiles and loads
        for turn in range(TURNS):
            for n, (way, run) in enumerate(ways.items()):
                out = folder / f"{n}-{turn}"
                sizes = ((small, out / "small"), (large, out / "large"))
                few, many = (clocked(partial(run, *size)) for size in sizes)
                took[way].append((few, many))
    pool = median(large.processor for _, large in next(iter(took.values())))
    return {
        "missions": missions,
        "turns": TURNS,
        "cores": len(os.sched_getaffinity(0)),
        "ways": {way: costs(turns, missions, pool) for way, turns in took.items()},
    }


def costs(turns: list[tuple[Took, Took]], missions: int, pool_s: float) -> dict[str, float]:
    """Return what a way costs, of its turns with a small and a large campaign."""
    few, many = (median(it.processor for it in size) for size in zip(*turns, strict=True))
    each_s = (many - few) / (missions - FEW)
    return {
        "wall_s": median(it.wall for _, it in turns),
        "processor_s": many,
        "mission_ms": 1e3 * each_s,
        "fixed_s": few - FEW * each_s,
        "efficiency": pool_s / many,
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


def experiment_file(folder: Path, missions: int) -> Path:
    """Write the campaign's experiment; return its file."""
    given = standard_mission(3, 3).model_dump(mode="json", exclude_unset=True)
    (folder / "base.yaml").write_text(json.dumps(given))  # JSON is YAML
    vary = {"auvs.speed_m_per_s": [speed(point) for point in range(POINTS)]}
    file = folder / f"experiment-{missions}.yaml"
    seeds = missions // POINTS
    file.write_text(json.dumps({"scenario": "base.yaml", "vary": vary, "seeds": seeds}))
    return file


def in_processes(file: Path, out: Path) -> None:
    """Run it in two processes."""
    call(["sweep", str(file), "--workers", str(WORKERS), "--out", str(out)])


def in_shares(file: Path, out: Path) -> None:
    """Run its shares, a process each, at once, and merge them."""
    words = [sys.executable, "-m", "bindusbl_des.cli", "-q", "sweep", str(file), "--workers", "1"]
    shares = [f"{out}-{part}" for part in range(1, WORKERS + 1)]
    running = [
        subprocess.Popen(
            [*words, "--shard", f"{part}/{WORKERS}", "--out", share], stdout=subprocess.DEVNULL
        )
        for part, share in enumerate(shares, start=1)
    ]
    ended = [it.wait() for it in running]
    if any(ended):
        raise RuntimeError("a share failed")
    call(["merge", *shares, "--out", str(out)])


def on_dask(file: Path, out: Path) -> None:
    """Run it on a cluster of this machine, which is started and ended."""
    script = file.parent / "on_dask.py"
    script.write_text(ON_DASK)
    words = [sys.executable, str(script), str(file), str(out), str(WORKERS)]
    subprocess.run(words, check=True, capture_output=True, env=os.environ | DASK_SETTINGS)


def large_folders() -> Iterator[dict[str, Any]]:
    """Yield what is taken by asking how far ever larger campaigns are, and by their last missions.

    The parent of those reads all rows, puts them in one part and makes the report.
    """
    tables = simulate(scenario(0)).arrow
    for missions, in_part in LARGE:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name, "out")
            write_most(folder, missions, in_part, tables)
            parts = len(list((folder / "missions").iterdir()))
            resume = ("-q", "resume", str(folder), "--workers", str(WORKERS))
            yield {
                "missions": missions,
                "parts": parts,
                "status": asked("status", str(folder), times=TURNS),
                "resume": asked(*resume),
                "complete": asked(*resume, times=TURNS),
            }


def write_most(folder: Path, missions: int, in_part: int, tables: Any) -> None:
    """Write a campaign that lacks its last missions; the others have the same rows each."""
    points = tuple({"auvs.speed_m_per_s": speed(point)} for point in range(POINTS))
    given = standard_mission(3, 3).model_dump(mode="json", exclude_unset=True)
    plan = ExperimentPlan(Experiment("large", given, points, tuple(range(missions // POINTS))))
    folder.mkdir()
    session = {"began_at": time.time(), "rows_before": 0}
    record = {**first_record(plan, None), "session": session, "status": "interrupted"}
    write_json(folder / RECORD, record)
    write_scenario(folder, given)
    sha = plan.fingerprint()
    for first in range(0, len(plan) - LEFT, in_part):
        numbers = tuple(range(first, min(first + in_part, len(plan) - LEFT)))
        batch = batch_of(plan, folder, numbers, 0.0, plan_sha256=sha)
        rows = Gathered(batch)
        for mission in batch.missions:
            rows.add(Ran(mission, 0.02, tables))
        write(batch, rows)


def asked(*words: str, times: int = 1) -> dict[str, float]:
    """Return what a command takes, from the start of Python, and the memory of its process (MB).

    Of several `times` the one that took least processor time counts.
    """
    said = ""

    def ask() -> None:
        nonlocal said
        ran = subprocess.run(
            [sys.executable, "-c", COMMAND, *words], capture_output=True, text=True
        )
        said = ran.stdout

    took = min((clocked(ask) for _ in range(times)), key=lambda it: it.processor)
    peak = re.search(r"^VmHWM:\s*(\d+) kB$", said, re.MULTILINE)
    if peak is None:
        raise RuntimeError(f"{' '.join(words)}: {said}")
    return {"wall_s": took.wall, "processor_s": took.processor, "memory_mb": int(peak[1]) / 1e3}


def main(words: list[str]) -> None:
    """Measure, print, and keep."""
    missions = int(words[0]) if words else MISSIONS
    found = {**(scaled_out(missions) if missions else {}), "large": list(large_folders())}
    print(json.dumps(found, indent=1))
    if len(words) > 1:
        sys.path[:0] = [str(HERE), str(HERE / "peers")]
        from record import history, keep

        before = history()[words[1]]
        keep(words[1], {**before, "campaigns": {**before["campaigns"], **found}})


if __name__ == "__main__":
    main(sys.argv[1:])
