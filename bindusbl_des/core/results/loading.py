"""Result folders read back: each file has the checksum that `run.json` records."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import pyarrow as pa

from ...support.files import check_seal, read_json, unreadable
from ...support.kept_files import placed
from ...support.mistakes import ScenarioWarning
from ..scenario.files.former_keys import as_now
from ..scenario.scenario import Scenario
from .effects import BEYOND_MEASURE, Advice, from_data
from .result import Result, sha256_as_written
from .result_folder import (
    ADVICE,
    DICTIONARY,
    FILE_SUMS,
    SCENARIO,
    SUMS,
    DamagedFile,
    compare_sum,
    read_table,
)
from .result_folder import RECORD as RUN
from .schemas import EVENT_TABLES, SCHEMA_VERSION, SOMETIMES
from .violations import is_violations, violations_in

T = TypeVar("T")


def load_result(folder: str | Path) -> Result:
    """Return the result in a folder, if its files are as they were written.

    Raises:
        FileNotFoundError: when the folder is not that of a finished run.
        ValueError: naming the file that is damaged or of another version, and what to do.
    """
    folder = Path(folder)
    path = folder / "run.json"
    if not path.is_file():
        raise FileNotFoundError(f"{folder} {_other(folder)}")
    scenario, run = _read_record(path)
    try:
        arrow = _tables(folder, scenario, run)
    except _Damaged as error:
        own = any(text.startswith(f"{folder / SCENARIO} ") for text in error.damage)
        lost = [f"what was flown stands at scenario in {path}: put that back"] if own else []
        remedies = *lost, _again(folder, run["seed"])
        raise ValueError("; ".join([*error.damage, ", then ".join(remedies)])) from None
    warnings = [
        ScenarioWarning(warning["key"], warning["message"]) for warning in run.get("warnings", ())
    ]
    broken = violations_in(run.get("violations"))
    result = Result(
        scenario, run["seed"], arrow, float(run["wall_time_s"]), warnings, violations=broken,
        overrides=run.get("overrides", ()),
    )  # fmt: skip
    result.advice, result.whole_time_s = _read_advice(folder, scenario), run.get("whole_time_s")
    return result


def _other(folder: Path) -> str:
    """Return what kind of folder this is, which holds no run."""
    if (folder / "campaign.json").is_file():
        return (
            "holds a campaign; give the folder of one run (in Python, load_campaign reads "
            "campaigns)"
        )
    if (folder / "question.json").is_file():
        return (
            f"holds a plan: open its plan.html; `bindusbl-des run {folder}/best.yaml` flies its "
            "answer"
        )
    if (folder / "missions").is_dir():
        return "is a campaign's, or was: its campaign.json is missing"
    return "is no result folder (it has no run.json); give the folder that `bindusbl-des run` wrote"


class _Newer(ValueError):
    """A folder is of a later version of the program."""


class _Damaged(Exception):
    """Files of a folder are damaged; `damage` describes each."""

    def __init__(self, damage: list[str]) -> None:
        self.damage = damage


def _tables(folder: Path, scenario: Scenario, run: Mapping[str, Any]) -> dict[str, pa.Table]:
    """Return the tables of a mission; no table is parsed before all files have their checksums.

    Folders of earlier versions have no checksums.

    Raises:
        _Damaged: naming each damaged file.
    """
    names = ("auvs", "mission", *(EVENT_TABLES if scenario.record.detail == "full" else ()))
    names = tuple(name for name in names if name not in SOMETIMES or SOMETIMES[name](scenario))
    paths = {name: folder / f"{name}.parquet" for name in names}
    origin = {
        "bindusbl.scenario_sha256": run["scenario_sha256"],
        "bindusbl.seed": str(run["seed"]),
    }
    if SUMS in run:
        _each(names, lambda name: compare_sum(paths[name], run[SUMS].get(name), RUN))
    if FILE_SUMS in run:
        beside = (SCENARIO, DICTIONARY)
        _each(beside, lambda name: compare_sum(folder / name, run[FILE_SUMS].get(name), RUN))
    return _each(names, lambda name: read_table(paths[name], name, origin))


def _each(names: Sequence[str], work: Callable[[str], T]) -> dict[str, T]:
    """Return `work(name)` by name; raise _Damaged, which lists all damaged files, if any is."""
    results, damaged = {}, []
    for name in names:
        try:
            results[name] = work(name)
        except DamagedFile as error:
            damaged.append(str(error))
    if damaged:
        raise _Damaged(damaged)
    return results


def _read_advice(folder: Path, scenario: Scenario) -> Advice | None:
    """Return the advice in a folder; None where no change was tried."""
    path = folder / ADVICE
    if not path.exists():
        return None
    try:
        advice = from_data(data := read_json(path))
        strangers = {harm.auv for harm in advice.harms} - {
            f"AUV{n}" for n in range(scenario.auvs.count)
        }
        if strangers:
            raise ValueError(f"harms: the mission has no {min(strangers)[:30]!r}")
        check_seal(data)
        return advice
    except PermissionError as error:
        raise ValueError(unreadable(path, error)) from None
    except (OSError, ValueError) as error:
        raise ValueError(
            f"{path} is damaged or of another version ({_reason(error)}); delete it, then make the "
            f"advice again: bindusbl-des report {folder} --advice"
        ) from None


def _read_record(path: Path) -> tuple[Scenario, dict[str, Any]]:
    """Return the scenario in `run.json`, and all of the file's data."""
    try:
        run = read_json(path)
        if not isinstance(run, dict):
            raise ValueError("it holds no keys")
        if type(found := run.get("schema", 1)) is int and found > SCHEMA_VERSION:
            raise _Newer(
                f"{path} is of schema {found}, of a newer bindusbl-des; this one reads up to "
                f"schema {SCHEMA_VERSION}: read it with the version that wrote it"
            )
        for key, (is_right, meaning) in RECORD.items():
            if key not in run and key not in ALWAYS:
                continue
            if not is_right(run.get(key)):
                raise ValueError(f"{key} is {'not ' if key in run else 'missing; it is '}{meaning}")
        if run["scenario_sha256"] != sha256_as_written(run["scenario"]):
            raise ValueError("scenario_sha256 is not that of its scenario: one of them was edited")
        check_seal(run)
        return Scenario.model_validate(placed(_as_flown(run["scenario"]), path.parent)), run
    except _Newer:
        raise
    except PermissionError as error:
        raise ValueError(unreadable(path, error)) from None
    except (OSError, ValueError) as error:
        raise ValueError(
            f"{path} is damaged or of another version ({_reason(error)}); "
            f"{_again(path.parent, 'N')}"
        ) from None


def _as_flown(scenario: dict[str, Any]) -> dict[str, Any]:
    """Return a scenario of an older version with the keys it lacks set to what that version did."""
    protocol = scenario.get("protocol")
    if isinstance(protocol, dict) and "turnaround_s" in protocol and "reply" not in protocol:
        scenario = {**scenario, "protocol": {**protocol, "reply": "instant"}}
    return as_now(scenario)


def _is_number(value: Any) -> bool:
    return type(value) in (int, float) and 0 < value < BEYOND_MEASURE


def _is_warnings(value: Any) -> bool:
    return isinstance(value, list) and all(map(_is_warning, value))


def _is_warning(value: Any) -> bool:
    return isinstance(value, dict) and all(
        isinstance(value.get(key), str) for key in ("key", "message")
    )


def _is_texts(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(text, str) for text in value)


def _is_words(value: Any) -> bool:
    return isinstance(value, dict) and all(isinstance(word, str) for word in value.values())


# Keys of `run.json`: the check and the meaning of each; those in ALWAYS are in every folder.
RECORD: Mapping[str, tuple[Callable[[Any], bool], str]] = {
    "scenario": (lambda value: isinstance(value, dict), "a scenario"),
    "scenario_sha256": (lambda value: isinstance(value, str), "a fingerprint"),
    "seed": (lambda value: type(value) is int and value >= 0, "a whole number >= 0"),
    "wall_time_s": (_is_number, "a number of seconds above 0"),
    "whole_time_s": (_is_number, "a number of seconds above 0"),
    "sim_seconds_per_second": (_is_number, "a number above 0"),
    "status": (lambda value: value == "complete", '"complete"'),
    "schema": (lambda value: type(value) is int and value > 0, "a whole number > 0"),
    "overrides": (_is_texts, "a list of KEY=VALUE"),
    "warnings": (_is_warnings, "a list of keys with messages"),
    "violations": (is_violations, "null, or a count and the first"),
    "versions": (_is_words, "a version for each package"),
    SUMS: (_is_words, "a checksum for each table"),
    FILE_SUMS: (_is_words, "a checksum for each file"),
}
ALWAYS = ("scenario", "scenario_sha256", "seed", "wall_time_s")


def _reason(error: Exception) -> str:
    """Return in one line what is wrong; of an invalid scenario its first wrong key."""
    if isinstance(error, OSError):
        return error.strerror or type(error).__name__
    lines = [line.strip() for line in str(error).splitlines()] or [type(error).__name__]
    return lines[0] if len(lines) < 3 else f"scenario.{lines[1]}: {lines[2]}"


def _again(folder: Path, seed: int | str) -> str:
    """Return the command that makes a damaged folder again."""
    return (
        f"run the mission again: bindusbl-des run {folder / SCENARIO} --seed {seed} "
        f"--out {folder} --force"
    )
