"""Result folders read back: nothing in one is believed that was not checked."""

import json
from pathlib import Path
from typing import Any

from .effects import Advice, from_data
from .result import Result
from .result_folder import ADVICE
from .scenario import Scenario
from .tables import EVENT_TABLES, DamagedFile, read_parquet, schema
from .worth_knowing import Caution


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
