"""What tests of campaigns share: campaigns without workers, or cut short; tables that are equal."""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from bindusbl_des import Campaign, CampaignState, Scenario, sweep
from bindusbl_des.apps.campaigns import running
from bindusbl_des.apps.campaigns.workers import batches
from bindusbl_des.apps.campaigns.workers.batches import run_batch
from bindusbl_des.apps.planning import flying
from bindusbl_des.core.mission.metrics import AUV_METRICS, mission_metrics
from bindusbl_des.core.records.metrics import Utilisation
from bindusbl_des.core.results.tables import from_numbers, from_row


class OneThread:
    """A pool of one thread of this process: no accident can happen to it, and it starts at once."""

    size = 1

    def __init__(self, *_: object) -> None:
        self._executor = ThreadPoolExecutor(1)
        self._running = 0

    def begin(self) -> None:
        pass

    def has_room(self) -> bool:
        return self._running == 0

    def submit(self, batch: Any) -> "Future[Any]":
        self._running += 1
        return self._executor.submit(run_batch, batch)

    def end(self, future: "Future[Any]") -> None:
        pass

    def release(self, future: "Future[Any]") -> int | None:
        self._running -= 1
        return None

    def close(self) -> None:
        self._executor.shutdown()


class Singly(OneThread):
    """A pool that is given a mission at a time, so that each is a part of its campaign."""

    size = 100_000


# What flies campaigns where no test says otherwise
WORKERS = running.pool_for


def fly_with(patch: pytest.MonkeyPatch, pool: Callable[..., Any] = OneThread) -> None:
    """Have campaigns and plans flown by a pool of the tests' own."""
    for module in (running, flying):
        patch.setattr(module, "pool_for", pool)


class Killed(BaseException):
    """The process of a campaign is gone."""


def cut_short(experiment: Any, folder: str | Path, after: int = 1, **settings: Any) -> Path:
    """Sweep into a folder until so many missions are flown, then end as if killed; return it."""

    def kill(state: CampaignState) -> None:
        if state.done + state.failed >= after:
            raise Killed

    with pytest.raises(Killed):
        sweep(experiment, folder, progress=kill, **settings)
    return Path(folder)


def parts(folder: str | Path) -> list[str]:
    """Return the names of the parts in which a campaign has the rows of its missions."""
    return sorted(path.stem.removeprefix("part-") for path in Path(folder).glob("missions/part-*"))


def read_record(folder: str | Path) -> dict[str, Any]:
    """Return what `campaign.json` says."""
    found: dict[str, Any] = json.loads(Path(folder, "campaign.json").read_text())
    return found


def sealed(record: Mapping[str, Any]) -> str:
    """Return the text of a record with its SHA-256, as a stranger would forge it."""
    data = {key: record[key] for key in record if key != "sha256"}
    seal = hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()
    return json.dumps({**data, "sha256": seal})


def write_record(folder: str | Path, record: Mapping[str, Any]) -> None:
    """Have `campaign.json` say something else."""
    Path(folder, "campaign.json").write_text(sealed(record))


def same(one: Campaign, other: Campaign) -> None:
    """Check that two campaigns found the same, but for the time it took."""
    for name in ("missions", "auvs"):
        frames = [
            getattr(it, name).drop(columns="wall_time_s", errors="ignore") for it in (one, other)
        ]
        pd.testing.assert_frame_equal(*frames)


def auv(error: float, **metrics: float | None) -> dict[str, float | None]:
    """Return metrics of an AUV with an error (m); its p95 is twice that unless given."""
    return {"position_error_m": error, "position_error_p95_m": 2 * error, **metrics}


# What an AUV is that got no fix in a mission of 100 s
UNSERVED: dict[str, float | None] = {
    "fixes": 0, "fixes_delivered": 0, "fix_rate_hz": 0.0, "hf_coverage": 0.0,
    "fix_age_mean_s": 50.0, "fix_age_p95_s": 95.0, "fix_age_max_s": 100.0,
    **{f"{name}_s": None for name in (
        "interval_mean", "interval_p95", "interval_max", "latency_mean", "latency_p95",
        "latency_max", "latency_from_broadcast", "latency_from_slot",
    )},
}  # fmt: skip


def hand_made(
    monkeypatch: pytest.MonkeyPatch,
    fleet: Callable[[Scenario, int], Sequence[dict[str, float | None]]],
) -> None:
    """Let missions come to what `fleet` says of a scenario and a seed: some metrics of each AUV.

    The others have the values of an AUV that is served well; the mission's follow from them.
    """

    def simulate(scenario: Scenario, seed: int) -> Any:
        rows = []
        for number, given in enumerate(fleet(scenario, seed)):
            own: dict[str, Any] = dict.fromkeys(AUV_METRICS.names, 1.0)
            own |= {"auv": number, "imu_error_m": 9.0, "path_error_m": None, **given}
            own["fix_benefit_m"] = own["imu_error_m"] - own["position_error_m"]
            rows.append(tuple(own.values()))
        metrics = np.array(rows, dtype=AUV_METRICS)
        mission = mission_metrics(metrics, Utilisation(10, 0, 0, 0.5, 0.5, None, None, 100.0))
        return SimpleNamespace(
            arrow={
                "auvs": from_numbers("auvs", metrics),
                "mission": from_row("mission", mission),
            }
        )

    fly_with(monkeypatch)
    for module in (running, flying):
        monkeypatch.setattr(module, "compile_kernels", lambda *_: None)
    monkeypatch.setattr(batches, "simulate", simulate)
