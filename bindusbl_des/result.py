"""The result of one mission: its tables, and the folder that holds them."""

import hashlib
import json
import platform
from collections.abc import Mapping, Sequence
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa

from .effects import Advice
from .kept_tracks import portable
from .result_folder import fill, result_draft
from .scenario import Scenario
from .summary import summary
from .worth_knowing import Caution, cautions

if TYPE_CHECKING:
    import pandas as pd

PACKAGES = ("bindusbl-des", "simpy", "numpy", "networkx", "pandas", "pyarrow", "numba")


class Result:
    """What happened in one mission, and what it achieved."""

    def __init__(
        self,
        scenario: Scenario,
        seed: int,
        arrow: Mapping[str, pa.Table],
        wall_time_s: float,
        warnings: Sequence[Caution] | None = None,
    ) -> None:
        """Take the Arrow tables by name; with `record.detail: summary` only auvs and mission.

        `warnings` are what was worth knowing when the mission was run, by default now.
        """
        self.scenario, self.seed = scenario, seed
        self.arrow = dict(arrow)
        self.wall_time_s = wall_time_s
        #: What would help, as measured beside the mission; None if nothing was tried (`advise`).
        self.advice: Advice | None = None
        self._told = warnings

    @cached_property
    def warnings(self) -> tuple[Caution, ...]:
        """What is worth knowing about the scenario before the results are believed."""
        return tuple(cautions(self.scenario) if self._told is None else self._told)

    @cached_property
    def tables(self) -> "dict[str, pd.DataFrame]":
        """All tables as pandas frames, by name."""
        return {name: table.to_pandas() for name, table in self.arrow.items()}

    @property
    def auvs(self) -> "pd.DataFrame":
        """Metrics, a row per AUV."""
        return self.tables["auvs"]

    @property
    def mission(self) -> "pd.DataFrame":
        """Metrics of the mission, one row."""
        return self.tables["mission"]

    def summary(self) -> str:
        """Return the metrics that matter most, in a table of at most 80 columns, and the advice."""
        auvs, mission = (self.arrow[name].to_pylist() for name in ("auvs", "mission"))
        return summary(auvs, mission[0], self.advice)

    def run_record(self) -> dict[str, Any]:
        """Return what `run.json` holds: scenario, seed, warnings, versions, times, status."""
        return {
            "status": "complete",
            "scenario": portable(self.scenario.model_dump(mode="json")),
            "scenario_sha256": scenario_sha256(self.scenario),
            "seed": self.seed,
            "warnings": [{"key": it.key, "message": it.message} for it in self.warnings],
            "versions": {"python": platform.python_version(), **{p: version(p) for p in PACKAGES}},
            "wall_time_s": self.wall_time_s,
            "sim_seconds_per_second": self.scenario.duration_s / self.wall_time_s,
        }

    def write(
        self, folder: str | Path, *, force: bool = False, scenario_text: str | None = None
    ) -> Path:
        """Write the result folder, all of it or nothing; return its path.

        An earlier run's folder is replaced by force alone, and only if nothing else is in it.  If
        another process takes the name meanwhile, the results are kept beside it.

        Raises:
            FileExistsError: when the folder exists or came to exist; it says where results are.
            OSError: when it cannot be written, or the disk is full.
        """
        folder = Path(folder)
        with result_draft(folder, force=force) as draft:
            fill(draft, self, scenario_text)
        return folder


def scenario_sha256(scenario: Scenario) -> str:
    """Return the fingerprint of a scenario: equal scenarios, equal fingerprints.

    Track files count by their contents and names, wherever they lie.
    """
    data = portable(scenario.model_dump(mode="json"))
    canonical = json.dumps(data, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(canonical.encode()).hexdigest()
