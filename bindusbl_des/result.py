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

from .effects import Advice, from_data
from .result_folder import ADVICE, fill, result_draft
from .scenario import Scenario
from .summary import summary
from .tables import EVENT_TABLES, DamagedFile, read_parquet, schema
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
            "scenario": self.scenario.model_dump(mode="json"),
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
    """Return the fingerprint of a scenario: equal scenarios, equal fingerprints."""
    canonical = json.dumps(scenario.model_dump(mode="json"), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(canonical.encode()).hexdigest()


def load_result(folder: str | Path) -> Result:
    """Read a result folder back.

    Raises:
        FileNotFoundError: when the folder is not that of a finished run.
        ValueError: naming the file that is damaged or of another version, and what to do.
    """
    folder = Path(folder)
    path = folder / "run.json"
    if not path.is_file() and (folder / "missions").is_dir():
        raise FileNotFoundError(f"{folder} is a campaign's, or was: its campaign.json is missing")
    if not path.is_file():
        raise FileNotFoundError(
            f"{folder} is no result folder (it has no run.json); give the folder that "
            "`bindusbl-des run` wrote"
        )
    scenario, run = _read_record(path)
    promised = ("auvs", "mission", *(EVENT_TABLES if scenario.record.detail == "full" else ()))
    arrow, damaged = {}, []
    for name in promised:
        try:
            arrow[name] = read_parquet(folder / f"{name}.parquet", needed=schema(name).names)
        except DamagedFile as error:
            damaged.append(str(error))
    if damaged:
        raise ValueError("; ".join([*damaged, _again(folder, run["seed"])]))
    told = [Caution(it["key"], it["message"]) for it in run.get("warnings", ())]
    result = Result(scenario, run["seed"], arrow, run["wall_time_s"], told)
    result.advice = _read_advice(folder)
    return result


def _read_advice(folder: Path) -> Advice | None:
    """Return what was advised beside a mission; None where nothing was tried."""
    path = folder / ADVICE
    if not path.is_file():
        return None
    try:
        return from_data(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, AttributeError, KeyError, TypeError, ValueError) as error:
        raise ValueError(
            f"{folder} is damaged or of another version: {error}; make the advice "
            f"again: bindusbl-des report {folder} --advice-s 3"
        ) from None


def _read_record(path: Path) -> tuple[Scenario, dict[str, Any]]:
    """Return the scenario in `run.json`, and all that the file holds."""
    try:
        run = json.loads(path.read_text(encoding="utf-8"))
        scenario = Scenario.model_validate(run["scenario"])
        numbers = {"seed": int(run["seed"]), "wall_time_s": float(run["wall_time_s"])}
        _ = [(it["key"], it["message"]) for it in run.get("warnings", ())]
        return scenario, {**run, **numbers}
    except (OSError, AttributeError, KeyError, TypeError, ValueError) as error:
        reason = (str(error).splitlines() or [""])[-1].strip()
        raise ValueError(
            f"{path} is damaged or of another version ({type(error).__name__}: {reason}); "
            f"{_again(path.parent, 'N')}"
        ) from None


def _again(folder: Path, seed: int | str) -> str:
    """Return the command that makes a damaged folder anew."""
    return (
        f"run the mission again: bindusbl-des run {folder / 'scenario.yaml'} --seed {seed} "
        f"--out {folder} --force"
    )
