"""Which missions of a plan have a row, and which of them failed: by rows, or by runs of numbers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from ...results.columns import numpy_array
from .folder import MOST_MISSIONS

OK, FAILED = "ok", "failed"

# Missions in more pieces than this are not listed in the record of their part: rows are read.
MOST_RUNS = 10_000


@dataclass(frozen=True)
class Done:
    """Missions that have a row: their numbers in the plan, ascending, and which of them failed."""

    numbers: NDArray[np.int64]
    failed: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.numbers)


def in_runs(done: Done) -> dict[str, Any]:
    """Return which missions a part has, and which of them failed; nothing where that is long.

    >>> in_runs(Done(np.array([4, 6, 8, 20]), np.array([False, True, False, False])))
    {'missions': {'step': 2, 'runs': [[4, 3], [20, 1]]}, 'failed': {'step': 1, 'runs': [[6, 1]]}}
    """
    runs = {"missions": _runs(done.numbers), "failed": _runs(done.numbers[done.failed])}
    return runs if sum(len(listed["runs"]) for listed in runs.values()) <= MOST_RUNS else {}


def _runs(numbers: NDArray[np.int64]) -> dict[str, Any]:
    """Return ascending numbers as runs of one step, each by its first number and its length."""
    gaps = np.diff(numbers)
    step = int(gaps.min(initial=MOST_MISSIONS)) if len(gaps) else 1
    begins = np.flatnonzero(np.concatenate(([True], gaps != step))) if len(numbers) else gaps
    lengths = np.diff(np.append(begins, len(numbers)))
    return {"step": step, "runs": np.column_stack((numbers[begins], lengths)).tolist()}


def _numbers(listed: Mapping[str, Any]) -> NDArray[np.int64]:
    """Return numbers from their runs.

    Raises:
        ValueError: when they are no missions.
    """
    step, runs = int(listed["step"]), [(int(first), int(count)) for first, count in listed["runs"]]
    is_possible = all(min(run) >= 0 and run[0] + step * run[1] < 2**63 for run in runs)
    if step < 1 or not is_possible or sum(count for _, count in runs) > MOST_MISSIONS:
        raise ValueError("its missions are none")
    each = [np.arange(first, first + step * count, step) for first, count in runs]
    return np.concatenate([np.zeros(0, np.int64), *each])


def of_runs(found: Mapping[str, Any]) -> Done:
    """Return the missions of :func:`in_runs`.

    Raises:
        ValueError: when they are no missions.
    """
    numbers, failed = (_numbers(found[key]) for key in ("missions", "failed"))
    return Done(numbers, np.isin(numbers, failed) if len(failed) else np.zeros(len(numbers), bool))


def united(some: Sequence[Done]) -> Done:
    """Return all missions; one that is there twice counts as it is where it comes first."""
    numbers = np.concatenate([np.zeros(0, np.int64), *(done.numbers for done in some)])
    failed = np.concatenate([np.zeros(0, bool), *(done.failed for done in some)])
    unique, first = np.unique(numbers, return_index=True)
    return Done(unique, failed[first])


def done_in(rows: pa.Table) -> Done:
    """Return the missions of rows."""
    return united([Done(mission_numbers(rows), has_status(rows, FAILED))])


def has_status(rows: pa.Table, status: str) -> NDArray[np.bool_]:
    """Tell row by row whether the mission has a status, without Arrow's compute library."""
    words = rows["status"].combine_chunks().dictionary_encode()
    same = np.array([*(word == status for word in words.dictionary.to_pylist()), False])
    places = np.nan_to_num(numpy_array(words.indices), nan=len(same) - 1)
    found: NDArray[np.bool_] = same[places.astype(np.int64)]
    return found


def mission_numbers(rows: pa.Table) -> NDArray[np.int64]:
    """Return the numbers of missions in the plan, row by row."""
    return numpy_array(rows["mission"].combine_chunks())
