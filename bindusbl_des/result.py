"""The result of one mission: its tables, and the folder that holds them."""

import hashlib
import json
import os
import platform
import shutil
import tempfile
from collections.abc import Mapping
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa
import pyarrow.parquet as pq

from .effects import Advice, as_data, from_data
from .scenario import Scenario
from .summary import summary
from .tables import EVENT_TABLES, TABLES, data_dictionary, write_parquet

if TYPE_CHECKING:
    import pandas as pd

# The file of what would help, in folders whose mission was advised on.
ADVICE = "advice.json"

PACKAGES = ("bindusbl-des", "simpy", "numpy", "networkx", "pandas", "pyarrow", "numba")


class Result:
    """What happened in one mission, and what it achieved."""

    def __init__(
        self, scenario: Scenario, seed: int, arrow: Mapping[str, pa.Table], wall_time_s: float
    ) -> None:
        """Take the Arrow tables by name; with `record.detail: summary` only auvs and mission."""
        self.scenario, self.seed = scenario, seed
        self.arrow = dict(arrow)
        self.wall_time_s = wall_time_s
        #: What would help, as measured beside the mission; None if nothing was tried (`advise`).
        self.advice: Advice | None = None

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
        """Return what `run.json` holds: scenario, seed, versions, times, status."""
        return {
            "status": "complete",
            "scenario": self.scenario.model_dump(mode="json"),
            "scenario_sha256": scenario_sha256(self.scenario),
            "seed": self.seed,
            "versions": {"python": platform.python_version(), **{p: version(p) for p in PACKAGES}},
            "wall_time_s": self.wall_time_s,
            "sim_seconds_per_second": self.scenario.duration_s / self.wall_time_s,
        }

    def write(
        self, folder: str | Path, *, force: bool = False, scenario_text: str | None = None
    ) -> Path:
        """Write the result folder, all of it or nothing; return its path.

        Everything is written beside the folder first and then renamed, so that a run killed half
        way leaves no folder that looks complete.

        Raises:
            FileExistsError: when the folder exists and `force` is not given.
        """
        folder = Path(folder)
        if folder.exists() and not force:
            raise FileExistsError(f"{folder} exists; choose another folder or use force (--force)")
        if folder.exists() and not replaceable(folder):
            raise FileExistsError(f"{folder} is not a result folder; it is left as it is")
        folder.parent.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(prefix=f".{folder.name}-", dir=folder.parent))
        try:
            self._write_into(draft, scenario_text)
            draft.chmod(0o755)
            if folder.exists():
                discarded = draft.with_name(draft.name + "-old")
                folder.rename(discarded)
                draft.rename(folder)
                shutil.rmtree(discarded) if discarded.is_dir() else discarded.unlink()
            else:
                os.rename(draft, folder)
        except BaseException:
            shutil.rmtree(draft, ignore_errors=True)
            raise
        return folder

    def _write_into(self, draft: Path, scenario_text: str | None) -> None:
        from .report.run_page import run_page

        run = self.run_record()
        origin = {
            "bindusbl.scenario_sha256": run["scenario_sha256"],
            "bindusbl.seed": str(self.seed),
        }
        for name, table in self.arrow.items():
            write_parquet(table, name, draft / f"{name}.parquet", origin)
        text = scenario_text or json.dumps(run["scenario"], indent=2)  # JSON is YAML
        (draft / "scenario.yaml").write_text(text, encoding="utf-8")
        _write_json(draft / "data_dictionary.json", data_dictionary())
        if self.advice is not None:
            (draft / ADVICE).write_text(advice_text(self.advice), encoding="utf-8")
        (draft / "report.html").write_text(run_page(self), encoding="utf-8")
        _write_json(draft / "run.json", run)


def replaceable(folder: Path) -> bool:
    """Tell whether a folder may be replaced by force: an earlier result, or empty."""
    return folder.is_dir() and ((folder / "run.json").is_file() or not any(folder.iterdir()))


def advice_text(advice: Advice) -> str:
    """Return what `advice.json` holds."""
    return json.dumps(as_data(advice), indent=2) + "\n"


def _write_json(path: Path, data: Any) -> None:
    path.write_text(json.dumps(data, indent=2) + "\n", encoding="utf-8")


def scenario_sha256(scenario: Scenario) -> str:
    """Return the fingerprint of a scenario: equal scenarios, equal fingerprints."""
    canonical = json.dumps(scenario.model_dump(mode="json"), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(canonical.encode()).hexdigest()


def load_result(folder: str | Path) -> Result:
    """Read a result folder back.

    Raises:
        FileNotFoundError: when the folder is not that of a finished run.
        ValueError: when it is damaged or of another version.
    """
    folder = Path(folder)
    path = folder / "run.json"
    if not path.is_file():
        raise FileNotFoundError(
            f"{folder} is no result folder (it has no run.json); give the folder that "
            "`bindusbl-des run` wrote"
        )
    try:
        run = json.loads(path.read_text(encoding="utf-8"))
        scenario = Scenario.model_validate(run["scenario"])
        arrow = {
            name: pq.read_table(folder / f"{name}.parquet")
            for name in TABLES
            if (folder / f"{name}.parquet").is_file()
        }
        promised = ("auvs", "mission", *(EVENT_TABLES if scenario.record.detail == "full" else ()))
        missing = [f"{name}.parquet" for name in promised if name not in arrow]
        if missing:
            raise ValueError(f"{', '.join(missing)} missing; run the mission again")
        result = Result(scenario, int(run["seed"]), arrow, float(run["wall_time_s"]))
        if (folder / ADVICE).is_file():
            result.advice = from_data(json.loads((folder / ADVICE).read_text(encoding="utf-8")))
        return result
    except (KeyError, ValueError, pa.ArrowException) as error:
        raise ValueError(f"{folder} is damaged or of another version: {error}") from None
