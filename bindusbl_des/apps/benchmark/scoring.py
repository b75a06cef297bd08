"""How methods score: metrics of each mission, and their means with intervals paired by seed."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from math import nan
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
import pandas as pd

from ...core.mission.simulation import simulate
from ...core.results.result import Result
from ...support.arrays import Floats
from ..campaigns.statistics.intervals import Interval, interval
from .methods import filled, fits, is_recorded
from .recorded import errors_by, estimates_of
from .tasks import VERSION, Task

# What of the normal error in the plane is inside its 95 % ellipse.
ELLIPSE = -2.0 * np.log(0.05)

# Metrics in the order of the table: words, unit, decimals, whether less is better (None: neither)
METRICS: dict[str, tuple[str, str, int, bool | None]] = {
    "worst_error_m": ("worst AUV, mean", "m", 3, True),
    "worst_error_p95_m": ("95 % of the time below", "m", 3, True),
    "nees": ("NEES", "", 2, None),
    "inside_95": ("inside 95 %", "", 3, None),
    "sent_bytes": ("sent", "B", 0, True),
    "energy_j": ("energy", "J", 0, True),
    "fairness": ("fairness", "", 3, False),
    "cpu_s": ("processor", "s", 3, True),
}


@dataclass(frozen=True)
class Score:
    """A metric of a method in a task: its mean, and how much that is above the baseline's on the
    same seeds, each with its 95 % interval.
    """

    version: int
    task: str
    method: str
    metric: str
    seeds: int
    mean: float
    low: float
    high: float
    difference: float
    difference_low: float
    difference_high: float


@lru_cache(maxsize=512)
def flown(task: Task, method: str, seed: int) -> dict[str, float]:
    """Return the metrics of one mission of a task with a method."""
    began = process_time()
    result = simulate(task.scenario(filled(method, task)), seed)
    return {**_measured(result), "cpu_s": process_time() - began}


def _measured(result: Result) -> dict[str, float]:
    mission = result.mission.iloc[0]
    tracks = result.tables["tracks"]
    tracks = tracks[tracks.vehicle.str.startswith("AUV") & (tracks.time_s > 0.0)]
    errors = tracks[["estimate_x_m", "estimate_y_m"]].to_numpy(float)
    errors = errors - tracks[["x_m", "y_m"]].to_numpy(float)
    xx, yy, xy = (
        tracks.estimate_sd_x_m.to_numpy() ** 2,
        tracks.estimate_sd_y_m.to_numpy() ** 2,
        tracks.estimate_cov_xy_m2.to_numpy(),
    )
    nees, inside = consistency(errors, xx, yy, xy)
    signals = result.tables.get("signals")
    sent = float(result.tables["broadcasts"].payload_bytes.sum())
    return {
        "worst_error_m": float(mission.worst_position_error_m),
        "worst_error_p95_m": float(mission.worst_position_error_p95_m),
        "nees": nees,
        "inside_95": inside,
        "sent_bytes": sent + (0.0 if signals is None else float(signals.size_bytes.sum())),
        "energy_j": _number(mission.energy_j),
        "fairness": _number(mission.fairness),
    }


def _number(value: Any) -> float:
    return nan if pd.isna(value) else float(value)


def consistency(errors: Floats, xx: Floats, yy: Floats, xy: Floats) -> tuple[float, float]:
    """Return the mean normalised square of errors (n, 2), m, with covariances (n,), m2, and the
    share of them inside their 95 % ellipse; instants of which a filter is sure are left out.
    """
    determinant, (x, y) = xx * yy - xy * xy, errors.T
    unsure = determinant > 1e-12 * (xx + yy) ** 2
    squares = (yy * x * x - 2.0 * xy * x * y + xx * y * y)[unsure] / determinant[unsure]
    if not squares.size:
        return nan, nan
    return float(squares.mean()), float((squares < ELLIPSE).mean())


def scores(method: str, task: Task, seeds: Sequence[int] | None = None) -> Iterator[Score]:
    """Yield the score of a method in a task, metric by metric.

    Raises:
        PluginError: when a user-defined part fails.
        ValueError: when recorded estimates do not fit the task.
    """
    chosen = task.seeds if seeds is None else tuple(seeds)
    base = [flown(task, task.baseline, seed) for seed in chosen]
    if is_recorded(method):
        recorded = estimates_of(Path(method), task.name)
        own = [
            {**mission, "cpu_s": nan, **_recorded(task, seed, recorded)}
            for seed, mission in zip(chosen, base, strict=True)
        ]
    else:
        own = [flown(task, method, seed) for seed in chosen]
    for metric in METRICS:
        values = [mission[metric] for mission in own]
        more = [value - mission[metric] for value, mission in zip(values, base, strict=True)]
        yield Score(
            VERSION, task.name, method, metric, len(chosen), *_ends(interval(values)),
            *_ends(interval(more)),
        )  # fmt: skip


def _recorded(task: Task, seed: int, recorded: pd.DataFrame) -> dict[str, float]:
    """Return the metrics of estimates that another program has made of a mission."""
    result = simulate(task.scenario(filled(task.baseline, task)), seed)
    each = errors_by(recorded, task.name, seed, result)
    means = [float(np.hypot(*errors.T).mean()) for errors, *_ in each]
    most = [float(np.quantile(np.hypot(*errors.T), 0.95)) for errors, *_ in each]
    together = (np.concatenate(parts) for parts in zip(*each, strict=True))
    nees, inside = consistency(*together)
    return {
        "worst_error_m": max(means),
        "worst_error_p95_m": max(most),
        "nees": nees,
        "inside_95": inside,
    }


def _ends(found: Interval) -> tuple[float, float, float]:
    return found.mean, found.low, found.high


def ranking(task: Task, methods: Sequence[str], seeds: Sequence[int]) -> list[str]:
    """Return the methods that fit a task, the best of the worst AUV's mean error first."""
    entered = [method for method in methods if fits(method, task)]
    error = {
        method: np.mean([flown(task, method, seed)["worst_error_m"] for seed in seeds])
        for method in entered
    }
    return sorted(entered, key=lambda method: float(error[method]))


def frame(found: Sequence[Score]) -> pd.DataFrame:
    """Return scores as a table, a row for each."""
    return pd.DataFrame([asdict(score) for score in found])
