"""What other programs take of a task, and give back: tables of Parquet, without the truth.

`inputs` writes what the AUVs of each mission knew: their dead reckoning, and the fixes that reached
them.  Estimates come back as one file: task, seed, auv, time_s, x_m, y_m, xx_m2, yy_m2, xy_m2, a
row for each AUV at each instant of `odometry`.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ...core.mission.simulation import simulate
from ...core.results.result import Result
from ...support.arrays import Floats
from .methods import filled
from .tasks import Task

COLUMNS = ("task", "seed", "auv", "time_s", "x_m", "y_m", "xx_m2", "yy_m2", "xy_m2")

# Of fixes: what an AUV is told
FIX_COLUMNS = (
    *("fix", "auv", "pinged_at_s", "valid_at_s", "delivered_at_s", "x_m", "y_m"),
    *("sd_x_m", "sd_y_m", "cov_xy_m2"),
)


def write_inputs(task: Task, folder: Path, seeds: slice) -> int:
    """Write the inputs of some of a task's missions to folders TASK/SEED; return how many."""
    for seed in task.seeds[seeds]:
        result = simulate(task.scenario(filled(task.baseline, task)), seed)
        place = folder / task.name / str(seed)
        place.mkdir(parents=True, exist_ok=True)
        tracks = result.tables["tracks"]
        own = tracks[tracks.vehicle.str.startswith("AUV")]
        odometry = own[["time_s", "vehicle", "imu_x_m", "imu_y_m", "yaw_rad", "estimate_z_m"]]
        names = {"vehicle": "auv", "imu_x_m": "x_m", "imu_y_m": "y_m", "estimate_z_m": "z_m"}
        odometry.rename(columns=names).to_parquet(place / "odometry.parquet", index=False)
        fixes = result.tables["fixes"]
        fixes = fixes[fixes.outcome == "delivered"].sort_values("delivered_at_s")
        fixes[list(FIX_COLUMNS)].to_parquet(place / "fixes.parquet", index=False)
    return len(task.seeds[seeds])


def estimates_of(path: Path, task: str) -> pd.DataFrame:
    """Return the estimates of a task in a file.

    Raises:
        ValueError: when it cannot be read, or lacks columns or the task.
    """
    try:
        table = pd.read_parquet(path)
    except (OSError, ValueError) as error:
        raise ValueError(f"{path}: cannot be read ({str(error).splitlines()[0]})") from None
    lacking = [name for name in COLUMNS if name not in table]
    if lacking:
        raise ValueError(f"{path}: lacks {', '.join(lacking)}; it needs {', '.join(COLUMNS)}")
    own = table[table.task == task]
    if not len(own):
        raise ValueError(f"{path}: holds no estimates of the task {task}; add them, or name --task")
    return own


def errors_by(
    table: pd.DataFrame, task: str, seed: int, result: Result
) -> list[tuple[Floats, Floats, Floats, Floats]]:
    """Return of each AUV the errors (n, 2), m, of estimates, and their covariances xx, yy, xy (n,),
    m2, at all instants of its track but the first.

    Raises:
        ValueError: when there is not one estimate for each.
    """
    truth, found = result.tables["tracks"], []
    own: Any = table[table.seed == seed]
    for auv in [f"AUV{k}" for k in range(result.scenario.auvs.count)]:
        track = truth[(truth.vehicle == auv) & (truth.time_s > 0.0)]
        given = own[(own.auv == auv) & (own.time_s > 0.0)].sort_values("time_s")
        if len(given) != len(track) or not np.allclose(
            given.time_s, track.time_s, rtol=0.0, atol=1e-6
        ):
            raise ValueError(
                f"{task}, seed {seed}: {auv} has {len(given)} estimates where `odometry` has "
                f"{len(track)} instants; give one for each"
            )
        places, true = given[["x_m", "y_m"]].to_numpy(float), track[["x_m", "y_m"]].to_numpy(float)
        if not np.isfinite(given[["x_m", "y_m", "xx_m2", "yy_m2", "xy_m2"]].to_numpy(float)).all():
            raise ValueError(f"{task}, seed {seed}: an estimate of {auv} is not finite")
        found.append((places - true, *(given[c].to_numpy(float) for c in COLUMNS[6:])))
    return found
