"""The tables of a campaign in parts: files that are whole or absent, the missions' row last.

A part has one name in all tables.  It counts from the moment when its file in `missions/` is there;
a file of that name elsewhere without one in `missions/` is what a killed process left.  The record
of a part in `checksums/`, written before that, has the SHA-256 and size of each of its files, the
plan that it is of and the parts that it replaces, so that no row is ever counted twice.  Before
rows are read, the file's checksum is compared.  To count missions, sizes are compared, and the
record, which has a checksum of its own, lists them.
"""

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from stat import S_ISREG
from typing import Any

import numpy as np
import pyarrow as pa

from ....core.results.columns import numpy_array
from ....core.results.result_folder import DamagedFile, SummedFile, sha256_of, write_parquet
from ....core.results.schemas import EVENT_TABLES
from ....support.arrays import Flags, Ints
from ....support.files import SEAL, check_seal, draft_of, read_json, sealed, sync
from .folder import MOST_MISSIONS, CampaignError, write_json

MISSIONS, CHECKSUMS = "missions", "checksums"

# The missions come last: they commit the part.
TABLES = ("auvs", *EVENT_TABLES, MISSIONS)

NAME = re.compile(r"all-[0-9]{4,9}|[0-9]{8,}-[0-9a-f]{8}")

# What begins so is not read, neither here nor by programs that read the folder as one table.
ASIDE = "_damaged"

# So many parts are remembered: those of a campaign of some days on many machines.
MOST_REMEMBERED = 8192

Stamp = tuple[int, ...]

# Of each table, and of the records: what the file system says of the file of each part.
Listed = Mapping[str, Mapping[str, os.stat_result]]


OK, FAILED = "ok", "failed"

# Missions in more pieces than this are not listed in the record of their part: rows are read.
MOST_RUNS = 10_000


@dataclass(frozen=True)
class Done:
    """Missions that have a row: their numbers in the plan, ascending, and which of them failed."""

    numbers: Ints
    failed: Flags

    def __len__(self) -> int:
        return len(self.numbers)

    @classmethod
    def in_rows(cls, rows: pa.Table) -> "Done":
        """Return the missions of rows."""
        return united([cls(mission_numbers(rows), has_status(rows, FAILED))])

    @classmethod
    def of_runs(cls, record: Mapping[str, Any]) -> "Done":
        """Return the missions listed in a record.

        Raises:
            ValueError: when the list is invalid.
        """
        numbers, failed = (_numbers(record[key]) for key in ("missions", "failed"))
        return cls(numbers, np.isin(numbers, failed))

    def runs(self) -> dict[str, Any]:
        """Return the missions, and which failed, as runs; {} if the list would be long.

        >>> Done(np.array([4, 6, 8, 20]), np.array([False, True, False, False])).runs()["missions"]
        {'step': 2, 'runs': [[4, 3], [20, 1]]}
        """
        runs = {"missions": _runs(self.numbers), "failed": _runs(self.numbers[self.failed])}
        return runs if sum(len(listed["runs"]) for listed in runs.values()) <= MOST_RUNS else {}


def _runs(numbers: Ints) -> dict[str, Any]:
    """Return ascending numbers as runs of one step, each by its first number and its length."""
    gaps = np.diff(numbers)
    step = int(gaps.min(initial=MOST_MISSIONS)) if len(gaps) else 1
    begins = np.flatnonzero(np.concatenate(([True], gaps != step))) if len(numbers) else gaps
    lengths = np.diff(np.append(begins, len(numbers)))
    return {"step": step, "runs": np.column_stack((numbers[begins], lengths)).tolist()}


def _numbers(listed: Mapping[str, Any]) -> Ints:
    """Return numbers from their runs."""
    step, runs = int(listed["step"]), [(int(first), int(count)) for first, count in listed["runs"]]
    is_possible = all(min(run) >= 0 and run[0] + step * run[1] < 2**63 for run in runs)
    if step < 1 or not is_possible or sum(count for _, count in runs) > MOST_MISSIONS:
        raise ValueError("its missions are none")
    each = [np.arange(first, first + step * count, step) for first, count in runs]
    return np.concatenate([np.zeros(0, np.int64), *each])


def united(some: Sequence[Done]) -> Done:
    """Return all missions; for a mission in several, the first status counts."""
    numbers = np.concatenate([np.zeros(0, np.int64), *(done.numbers for done in some)])
    failed = np.concatenate([np.zeros(0, bool), *(done.failed for done in some)])
    unique, first = np.unique(numbers, return_index=True)
    return Done(unique, failed[first])


def mission_numbers(rows: pa.Table) -> Ints:
    """Return the numbers of missions in the plan, row by row."""
    return numpy_array(rows["mission"].combine_chunks())


def coded(column: pa.ChunkedArray) -> tuple[Ints, list[str | None]]:
    """Return for each row of a column which of its words it has, and the words, the last of them
    None; without Arrow's compute library.
    """
    each = column.combine_chunks().dictionary_encode()
    words = each.dictionary.to_pylist()
    places = np.nan_to_num(numpy_array(each.indices), nan=len(words)).astype(np.int64)
    return places, [*words, None]


def has_status(rows: pa.Table, status: str) -> Flags:
    """Tell row by row whether the mission has a status."""
    places, words = coded(rows["status"])
    same: Flags = np.array([word == status for word in words])[places]
    return same


def part_path(folder: Path, table: str, part: str) -> Path:
    """Return where a part of a table lies."""
    return folder.joinpath(table, f"part-{part}.parquet")


def record_path(folder: Path, part: str) -> Path:
    """Return where the record of a part lies."""
    return folder.joinpath(CHECKSUMS, f"part-{part}.json")


@dataclass(frozen=True)
class PartRecord:
    """The record of a part: its plan, the parts that it replaces, its files and its missions.

    `files` has the SHA-256 and the size (bytes) of each table; `done` is None if too long to list.
    """

    plan_sha256: str
    replaces: tuple[str, ...]
    files: Mapping[str, tuple[str, int]]
    done: Done | None = None


class PartWriter:
    """A part that is being written, a table after the other, `missions` last."""

    def __init__(
        self, folder: Path, part: str, plan_sha256: str, done: Done, replaces: Sequence[str] = ()
    ) -> None:
        self._folder, self._part = folder, part
        self._files: dict[str, dict[str, Any]] = {}
        self._record = {
            "part": part, "plan_sha256": plan_sha256, "replaces": list(replaces),
            "files": self._files, **done.runs(),
        }  # fmt: skip

    @contextmanager
    def file(self, table: str) -> Iterator[SummedFile]:
        """Yield the file of a table to be written; with that of `missions` the part counts.

        Raises:
            OSError: when it cannot be written.
        """
        with whole_file(part_path(self._folder, table, self._part)) as file:
            yield file
            self._files[table] = {"sha256": file.sha256(), "bytes": file.tell()}
            if table == MISSIONS:
                path = record_path(self._folder, self._part)
                _make_durably(path.parent)
                write_json(path, sealed(self._record))


def commit(folder: Path, part: str, tables: Mapping[str, pa.Table], plan_sha256: str) -> None:
    """Write a part of each table, `missions` last.

    Raises:
        OSError: when it cannot be written; nothing of it counts then.
    """
    writer = PartWriter(folder, part, plan_sha256, Done.in_rows(tables[MISSIONS]))
    for name in TABLES:
        if name in tables:
            with writer.file(name) as file:
                # Joined they are zstd: until then half the time to write and to read counts more
                write_parquet(tables[name], name, file, {}, "snappy")


@contextmanager
def whole_file(path: Path) -> Iterator[SummedFile]:
    """Yield a file to be written that appears under its name only when it is whole, on the disk.

    Raises:
        OSError: when it cannot be written.
    """
    _make_durably(path.parent)
    with draft_of(path) as draft, SummedFile(draft) as file:
        yield file


def _make_durably(folder: Path) -> None:
    """Make a folder if need be, so that a power cut does not take it and what is synced in it.

    Another process may have made it, and not have synced its name yet.
    """
    if not folder.is_dir():
        folder.mkdir(exist_ok=True)
        sync(folder.parent)
    else:
        _sync_name(folder, folder.stat().st_ino)


@lru_cache(maxsize=64)
def _sync_name(folder: Path, _: int) -> None:
    sync(folder.parent)


def part_record(folder: Path, part: str) -> PartRecord:
    """Return the record of a part.

    Raises:
        DamagedFile: when it cannot be read.
    """
    return _record(folder, part, stamp(record_path(folder, part)))


@lru_cache(maxsize=MOST_REMEMBERED)
def _record(folder: Path, part: str, _: Stamp) -> PartRecord:
    """Return what the record of a part says, which is read again only when it has changed."""
    path = record_path(folder, part)
    try:
        found = read_json(path)
        files = {
            name: (str(file["sha256"]), int(file["bytes"])) for name, file in found["files"].items()
        }
        name, plan, replaces = found["part"], str(found["plan_sha256"]), tuple(found["replaces"])
        check_seal(found)
        done = Done.of_runs(found) if SEAL in found and "missions" in found else None
    except FileNotFoundError:
        missions = part_path(folder, MISSIONS, part)
        raise DamagedFile(str(missions), f"has no record in {CHECKSUMS}/") from None
    except (OSError, ArithmeticError, LookupError, AttributeError, TypeError, ValueError) as error:
        said = (str(error).splitlines() or [type(error).__name__])[0]
        raise DamagedFile(str(path), f"is damaged ({said})") from None
    if name != part:
        raise DamagedFile(str(path), f"is that of part {name}")
    return PartRecord(plan, replaces, files, done)


def listed(folder: Path) -> Listed:
    """Return what the file system says of all parts; each folder of them is gone through once."""
    return {name: _listed(folder / name) for name in (*TABLES, CHECKSUMS)}


def _listed(folder: Path) -> dict[str, os.stat_result]:
    found: dict[str, os.stat_result] = {}
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.startswith("part-"):
                with suppress(FileNotFoundError):  # removed meanwhile
                    name = entry.name.removeprefix("part-").rpartition(".")[0]
                    found[name] = entry.stat(follow_symlinks=False)
    return found


def check_part(
    folder: Path, files: Listed, part: str, plan_sha256: str | None = None
) -> PartRecord:
    """Refuse a part with a missing file, a wrong size, or another plan; return its record.

    Raises:
        DamagedFile: naming the file and what is wrong.
    """
    missions = part_path(folder, MISSIONS, part)
    if not NAME.fullmatch(part):
        raise DamagedFile(str(missions), "has a name that no part has")
    written = files[CHECKSUMS].get(part)
    record = _record(folder, part, _stamp_of(written) if written else ())
    if plan_sha256 is not None and record.plan_sha256 != plan_sha256:
        raise DamagedFile(str(missions), "belongs to another campaign")
    for table in TABLES:
        if why := _wrong(files[table].get(part), record.files.get(table)):
            raise DamagedFile(str(part_path(folder, table, part)), why)
    return record


def _wrong(found: os.stat_result | None, expected: tuple[str, int] | None) -> str:
    """Return what is wrong with a file, of which a record expects checksum and size, "" if nothing.

    Of what is not there nothing was `found`.
    """
    if found is None:
        return "is missing" if expected else ""
    if not S_ISREG(found.st_mode):
        return "is no file"
    if expected is None:
        return "does not belong to the other tables of this part"
    is_whole = found.st_size == expected[1]
    return "" if is_whole else f"is damaged (it should have {expected[1]:,} bytes)"


def check_table(folder: Path, table: str, part: str) -> None:
    """Refuse a file of a part with a wrong checksum; compare again only if it changed.

    Raises:
        DamagedFile: saying what is wrong with it.
    """
    record, path = part_record(folder, part), part_path(folder, table, part)
    expected = record.files.get(table)
    if expected is None and path.exists():
        raise DamagedFile(str(path), "does not belong to the other tables of this part")
    if expected is not None and _sum(path, stamp(path)) != expected[0]:
        raise DamagedFile(
            str(path), f"is damaged or was edited (its SHA-256 is not that in {CHECKSUMS}/)"
        )


@lru_cache(maxsize=MOST_REMEMBERED)
def _sum(path: Path, _: Stamp) -> str:
    return sha256_of(path)


def committed(folder: Path) -> list[str]:
    """Return the names of the parts that count, sorted.

    Raises:
        CampaignError: when one is damaged that may replace others.
    """
    names = part_names(folder)
    replaced: set[str] = set()
    with told_by(folder):
        for name in names:
            if name.startswith("all-"):  # what only merging and compaction write
                replaced |= set(part_record(folder, name).replaces)
    return sorted(names - replaced)


def part_names(folder: Path) -> set[str]:
    """Return the names of all parts that have a row of missions."""
    ending = ".parquet"
    with suppress(OSError):
        names = [name for name in os.listdir(folder / MISSIONS) if name.endswith(ending)]
        return {name[5 : -len(ending)] for name in names if name.startswith("part-")}
    return set()


def plans_of_parts(folder: Path) -> set[str]:
    """Return the fingerprints of the plans that parts are of, as far as they can be read."""
    found = set()
    for part in part_names(folder):
        with suppress(DamagedFile):
            found.add(part_record(folder, part).plan_sha256)
    return found


def clean_parts(folder: Path) -> None:
    """Remove parts that do not count: replaced ones, and those without a row of missions."""
    kept = set(committed(folder))
    for name in (*TABLES[::-1], CHECKSUMS):
        for path in (folder / name).glob("part-*"):
            if path.stem.removeprefix("part-") not in kept:
                path.unlink(missing_ok=True)


def stamp(path: Path) -> Stamp:
    """Return what tells whether a file has changed; () where it is not there."""
    try:
        return _stamp_of(path.lstat())
    except OSError:
        return ()


def _stamp_of(found: os.stat_result) -> Stamp:
    return found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns


@contextmanager
def told_by(folder: Path) -> Iterator[None]:
    """Turn a DamagedFile of the block into a CampaignError that names the remedy."""
    try:
        yield
    except DamagedFile as error:
        raise CampaignError(
            f"{error}; `bindusbl-des resume {folder}` sets it aside and runs its missions again"
        ) from None


def set_aside(folder: Path, plan_sha256: str) -> list[str]:
    """Compare all parts of a campaign with their checksums; rename the files of damaged ones.

    They do not count then.
    Returns a line for each damaged part.

    Raises:
        OSError: when a file cannot be renamed.
    """
    told, files = [], listed(folder)
    for part in sorted(part_names(folder)):
        try:
            check_part(folder, files, part, plan_sha256)
            for table in TABLES:
                check_table(folder, table, part)
        except DamagedFile as error:
            aside = _rename(folder, part)
            told.append(f"{error}; set aside as {aside}, its missions are run again")
    return told


def _rename(folder: Path, part: str) -> Path:
    """Give the files of a part names that are not read; return that in `missions`."""
    number = 1
    while any(_aside(folder, table, part, number).exists() for table in TABLES):
        number += 1
    for table in TABLES[::-1]:  # the missions first: without them the others do not count
        path = part_path(folder, table, part)
        if path.exists() or path.is_symlink():
            path.rename(_aside(folder, table, part, number))
    record_path(folder, part).unlink(missing_ok=True)
    return _aside(folder, MISSIONS, part, number)


def _aside(folder: Path, table: str, part: str, number: int) -> Path:
    path = part_path(folder, table, part)
    return path.with_name(f"{ASIDE}{'' if number == 1 else f'-{number}'}-{path.name}")
