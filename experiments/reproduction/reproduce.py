"""Reproduce the paper: run its experiments, judge its numbers, draw its figures, write it down."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypedDict, Unpack

from bindusbl_des.apps.campaigns.experiments.experiment import Experiment
from bindusbl_des.apps.campaigns.failures import check_name
from bindusbl_des.apps.campaigns.storage.folder import CampaignError
from bindusbl_des.apps.campaigns.storage.parts import whole_file

from .campaigns import (
    CATALOGUE,
    READINGS_FOLDER,
    Runs,
    all_readings,
    experiments,
    one_reading,
    run_all,
)
from .counting import Foretelling, Tally, ranking, tally
from .document import FIGURES, claimed, compared, document, table
from .drawings import draw, draw_readings
from .numbers import Claimed, Measured, published
from .readings import Reading
from .readings_page import page, readings_document, section

if TYPE_CHECKING:
    import pandas as pd

DOCUMENT = "reproduction.md"
READINGS_DOCUMENT = "readings.md"

LEFT_OUT = (
    "## The paper in one reading",
    "Left out of a quick look; `bindusbl-des reproduce --quick --readings` counts joint readings.",
)


@dataclass(frozen=True)
class Reproduction:
    """Everything the paper says beside what was measured, and the folder that shows it."""

    folder: Path
    runs: Runs
    numbers: Sequence[Measured]
    claims: Mapping[str, Sequence[Claimed]]

    def sentences(self) -> list[Claimed]:
        """Return every sentence with its verdict."""
        return [claim for section in self.claims.values() for claim in section]


@dataclass(frozen=True)
class Counted:
    """What each joint reading meets of the paper, and the folder that shows it."""

    folder: Path
    runs: Runs
    tally: Tally


class How(TypedDict, total=False):
    """How missions are run, which but for `quick` (few seeds and teams) changes no number."""

    quick: bool
    workers: int | None
    quiet: bool
    tell: Callable[[str], None]


def reproduce(folder: str | Path, **how: Unpack[How]) -> Reproduction:
    """Run every experiment of the paper in a folder and write what came out of it.

    A call that was cut short is continued by the next one.

    Raises:
        CampaignError: when the folder holds other things or other campaigns.
        CampaignInterrupted: when the user stopped it.
        SomeFailed: when a mission failed.
    """
    folder, quick = Path(folder), how.get("quick", False)
    _check(folder)
    runs = _run(experiments(quick=quick), folder, how)
    joint: Iterable[str] = LEFT_OUT
    joint_runs: Runs = {}
    if not quick:
        counted = _count(folder, how)
        joint, joint_runs = section(counted.tally, counted.runs), counted.runs
    _tell(how, "figures and tables")
    found = Reproduction(folder, runs, compared(runs), claimed(runs))
    _write_table(folder, "paper_vs_measured", table(found.numbers))
    draw(runs, _figures(folder))
    text = document(
        found.numbers, found.claims, runs, quick=quick, joint=joint, joint_runs=joint_runs
    )
    _write(folder / DOCUMENT, text)
    return found


def reproduce_reading(reading: Reading, folder: str | Path, **how: Unpack[How]) -> Reproduction:
    """Run the experiments of one joint reading in a folder and write what came out of it.

    Raises as :func:`reproduce` does.
    """
    folder, quick = Path(folder), how.get("quick", False)
    _check(folder)
    runs = _run(one_reading(reading, quick=quick), folder, how)
    foretelling = Foretelling(runs)
    numbers = [foretelling.measured(row, reading) for row in published()]
    _write_table(folder, "paper_vs_measured", table(numbers))
    _write(folder / DOCUMENT, page(reading, numbers, runs, quick=quick))
    return Reproduction(folder, runs, numbers, {})


def count_readings(folder: str | Path, **how: Unpack[How]) -> Counted:
    """Run the experiments of all joint readings in a folder and write what each of them meets.

    Raises as :func:`reproduce` does.
    """
    folder = Path(folder)
    _check(folder)
    counted = _count(folder, how)
    quick = how.get("quick", False)
    _write(folder / READINGS_DOCUMENT, readings_document(counted.tally, counted.runs, quick=quick))
    return counted


def _count(folder: Path, how: How) -> Counted:
    """Run and count all joint readings; write their table and figure."""
    experiments = all_readings(quick=how.get("quick", False))
    runs = _run(experiments, folder / READINGS_FOLDER, how)
    _tell(how, "counting joint readings")
    counted = Counted(folder, runs, tally(runs))
    _write_table(folder, "readings", ranking(counted.tally))
    draw_readings(counted.tally, _figures(folder))
    return counted


def _check(folder: Path) -> None:
    """Refuse a folder that holds other things than a reproduction.

    Raises:
        CampaignError: when it does, or when no folder can have that name.
    """
    check_name(folder)
    ours = (READINGS_FOLDER, *(entry.name for entry in CATALOGUE))
    is_ours = any((folder / name).is_dir() for name in ours)
    if folder.is_dir() and any(folder.iterdir()) and not is_ours:
        raise CampaignError(f"{folder}: is not empty and no reproduction; name another folder")


def _run(experiments: Iterable[Experiment], folder: Path, how: How) -> Runs:
    return run_all(
        experiments,
        folder,
        workers=how.get("workers"),
        quiet=how.get("quiet", True),
        tell=lambda text: _tell(how, text),
    )


def _tell(how: How, text: str) -> None:
    if "tell" in how:
        how["tell"](text)


def _figures(folder: Path) -> Path:
    (folder / FIGURES).mkdir(parents=True, exist_ok=True)
    return folder / FIGURES


def _write_table(folder: Path, name: str, frame: "pd.DataFrame") -> None:
    """Write a table as CSV and Parquet, each whole or not at all."""
    _write(folder / f"{name}.csv", frame.to_csv(index=False))
    with whole_file(folder / f"{name}.parquet") as file:
        frame.to_parquet(file, compression="zstd")


def _write(path: Path, text: str) -> None:
    with whole_file(path) as file:
        file.write(text.encode())
