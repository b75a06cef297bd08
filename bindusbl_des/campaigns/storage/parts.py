"""The tables of a campaign in parts: files that are whole or absent, the missions' row last.

A part has one name in all tables.  It counts from the moment when its file in `missions/` is there;
a file of that name elsewhere without one in `missions/` is what a killed process left.  The record
of a part in `checksums/`, written before that, has the SHA-256 and size of each of its files, the
plan that it is of and the parts that it replaces, so that no row is ever counted twice.  Whoever
reads rows compares the file's checksum first; whoever counts missions compares sizes, and finds
which missions there are in the record, which has a checksum of its own.
"""

import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from stat import S_ISREG
from typing import Any, TypeVar

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from ...core.files import SEAL, check_seal, draft_of, read_json, sealed, sync
from ...results.result_folder import (
    DamagedFile,
    SummedFile,
    read_parquet,
    read_pieces,
    read_schema,
    sha256_of,
    write_parquet,
)
from ...results.schemas import EVENT_TABLES, arrow, numpy_array, schema
from .folder import MOST_MISSIONS, CampaignError, write_json

OK, FAILED = "ok", "failed"

MISSIONS, CHECKSUMS = "missions", "checksums"

# The missions come last: they commit the part.
TABLES = ("auvs", *EVENT_TABLES, MISSIONS)

NAME = re.compile(r"all-[0-9]{4,9}|[0-9]{8,}-[0-9a-f]{8}")

# What begins so is read by nobody: neither here nor by who reads the folder as one table.
ASIDE = "_damaged"

# So many parts are remembered: those of a campaign of some days on many machines.
MOST_REMEMBERED = 8192

# Missions in more pieces than this are not listed in the record of their part: rows are read.
MOST_RUNS = 10_000
ARROW_TYPES = {
    "bool": pa.bool_(),
    "int": pa.int64(),
    "float": pa.float64(),
    "text": pa.string(),
    "json": pa.string(),
}

Read = TypeVar("Read")
Stamp = tuple[int, ...]

# Of each table, and of the records: what the file system says of the file of each part.
Listed = Mapping[str, Mapping[str, os.stat_result]]


def part_path(folder: Path, table: str, part: str) -> Path:
    """Return where a part of a table lies."""
    return folder.joinpath(table, f"part-{part}.parquet")


def record_path(folder: Path, part: str) -> Path:
    """Return where the record of a part lies."""
    return folder.joinpath(CHECKSUMS, f"part-{part}.json")


@dataclass(frozen=True)
class Done:
    """Missions that have a row: their numbers in the plan, ascending, and which of them failed."""

    numbers: NDArray[np.int64]
    failed: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.numbers)


@dataclass(frozen=True)
class PartRecord:
    """What a part is of, which parts it replaces, what its files are, and which missions it has.

    `files` has the SHA-256 and the size (bytes) of each table; `done` is None where there is too
    much to list.
    """

    plan_sha256: str
    replaces: tuple[str, ...]
    files: Mapping[str, tuple[str, int]]
    done: Done | None = None


class PartWriter:
    """A part that is being written, a table after the other, `missions` last."""

    def __init__(
        self, folder: Path, part: str, plan_sha256: str, replaces: Sequence[str] = ()
    ) -> None:
        self._folder, self._part = folder, part
        self._record = {"part": part, "plan_sha256": plan_sha256, "replaces": list(replaces)}
        self._files: dict[str, dict[str, Any]] = {}
        self._done: list[Done] = []

    def count(self, rows: pa.Table) -> None:
        """Have the missions of rows in the record; all are to be counted before they are whole."""
        self._done.append(done_in(rows))

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
                record = {**self._record, "files": self._files, **_listing(_united(self._done))}
                write_json(path, sealed(record))


def _listing(done: Done) -> dict[str, Any]:
    """Return which missions a part has, and which of them failed; nothing where that is long.

    >>> _listing(Done(np.array([4, 6, 8, 20]), np.array([False, True, False, False])))
    {'missions': {'step': 2, 'runs': [[4, 3], [20, 1]]}, 'failed': {'step': 1, 'runs': [[6, 1]]}}
    """
    listed = {"missions": _runs(done.numbers), "failed": _runs(done.numbers[done.failed])}
    return listed if sum(len(it["runs"]) for it in listed.values()) <= MOST_RUNS else {}


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


def _united(some: Sequence[Done]) -> Done:
    """Return all missions; one that is there twice counts as it is where it comes first."""
    numbers = np.concatenate([np.zeros(0, np.int64), *(it.numbers for it in some)])
    failed = np.concatenate([np.zeros(0, bool), *(it.failed for it in some)])
    unique, first = np.unique(numbers, return_index=True)
    return Done(unique, failed[first])


def commit(folder: Path, part: str, tables: Mapping[str, pa.Table], plan_sha256: str) -> None:
    """Write a part of each table, `missions` last.

    Raises:
        OSError: when it cannot be written; nothing of it counts then.
    """
    writer = PartWriter(folder, part, plan_sha256)
    for name in TABLES:
        if name in tables:
            if name == MISSIONS:
                writer.count(tables[name])
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
    """Return what a part says of itself.

    Raises:
        DamagedFile: when it says nothing that can be read.
    """
    return _record(folder, part, _stamp(record_path(folder, part)))


@lru_cache(maxsize=MOST_REMEMBERED)
def _record(folder: Path, part: str, _: Stamp) -> PartRecord:
    """Return what the record of a part says, which is read again only when it has changed."""
    path = record_path(folder, part)
    try:
        found = read_json(path)
        files = {name: (str(it["sha256"]), int(it["bytes"])) for name, it in found["files"].items()}
        name, plan, replaces = found["part"], str(found["plan_sha256"]), tuple(found["replaces"])
        check_seal(found)
        done = None
        if SEAL in found and "missions" in found:
            numbers, failed = (_numbers(found[it]) for it in ("missions", "failed"))
            has_failed = np.isin(numbers, failed) if len(failed) else np.zeros(len(numbers), bool)
            done = Done(numbers, has_failed)
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
        for it in entries:
            if it.name.startswith("part-"):
                with suppress(FileNotFoundError):  # removed meanwhile
                    name = it.name.removeprefix("part-").rpartition(".")[0]
                    found[name] = it.stat(follow_symlinks=False)
    return found


def check_part(
    folder: Path, files: Listed, part: str, plan_sha256: str | None = None
) -> PartRecord:
    """Refuse a part that lacks a file, or has one of another size, or is of another plan.

    Returns what its record says.

    Raises:
        DamagedFile: saying what is wrong with which file.
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
    """Refuse a file of a part that has not its checksum; compared again only where it changed.

    Raises:
        DamagedFile: saying what is wrong with it.
    """
    record, path = part_record(folder, part), part_path(folder, table, part)
    expected = record.files.get(table)
    if expected is None and path.exists():
        raise DamagedFile(str(path), "does not belong to the other tables of this part")
    if expected is not None and _sum(path, _stamp(path)) != expected[0]:
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
    with _told_by(folder):
        for name in names:
            if name.startswith("all-"):  # what only merging and compaction write
                replaced |= set(part_record(folder, name).replaces)
    return sorted(names - replaced)


def part_names(folder: Path) -> set[str]:
    """Return the names of all parts that have a row of missions."""
    ending = ".parquet"
    with suppress(OSError):
        names = [it for it in os.listdir(folder / MISSIONS) if it.endswith(ending)]
        return {name[5 : -len(ending)] for name in names if name.startswith("part-")}
    return set()


def plans_of_parts(folder: Path) -> set[str]:
    """Return the fingerprints of the plans that parts are of, as far as they can be read."""
    found = set()
    for part in part_names(folder):
        with suppress(DamagedFile):
            found.add(part_record(folder, part).plan_sha256)
    return found


def part_schema(folder: Path, table: str, part: str) -> pa.Schema:
    """Return the schema of a part of a table.

    Raises:
        CampaignError: when it is damaged.
    """
    with _told_by(folder):
        check_table(folder, table, part)
        return read_schema(part_path(folder, table, part))


def clean_parts(folder: Path) -> None:
    """Remove parts that do not count: replaced ones, and those without a row of missions."""
    kept = set(committed(folder))
    for name in (*TABLES[::-1], CHECKSUMS):
        for path in (folder / name).glob("part-*"):
            if path.stem.removeprefix("part-") not in kept:
                path.unlink(missing_ok=True)


def read_part(
    folder: Path, table: str, part: str, columns: Sequence[str] | None = None
) -> pa.Table | None:
    """Return a part of a table, None where it has none.

    Raises:
        CampaignError: when it is damaged.
    """
    path = part_path(folder, table, part)
    with _told_by(folder):
        check_table(folder, table, part)
        return read_parquet(path, columns, ("mission",)) if path.exists() else None


def part_pieces(folder: Path, table: str, part: str) -> Iterator[pa.Table]:
    """Yield a part of a table in the order of the plan, some thousand rows at a time.

    Raises:
        CampaignError: when it is damaged.
    """
    path = part_path(folder, table, part)
    with _told_by(folder):
        check_table(folder, table, part)
        if not path.exists():
            return
        pieces = read_pieces(path)
        first, second = next(pieces, None), next(pieces, None)
        if first is None:
            return
        if second is None:  # as most are, which are opened once then
            yield in_order(first)
        elif _is_ordered(mission_numbers(read_parquet(path, ("mission",), ("mission",)))):
            yield from (first, second)
            yield from pieces
        else:
            yield in_order(read_parquet(path))


def damaged(folder: Path, error: DamagedFile) -> CampaignError:
    """Return what to tell of a part that cannot be used: its file, why, and what to do."""
    return CampaignError(
        f"{error}; `bindusbl-des resume {folder}` sets it aside and runs its missions again"
    )


def done(folder: Path, plan_sha256: str | None = None) -> Done:
    """Return the missions that have a row.

    Raises:
        CampaignError: when a part is damaged, or belongs to another plan than is asked for.
    """

    def read(parts: Sequence[str]) -> Done:
        files = listed(folder)
        with _told_by(folder):
            records = {part: check_part(folder, files, part, plan_sha256) for part in parts}
        return _united([it.done or _by_rows(folder, part) for part, it in records.items()])

    return _in_peace(folder, read)


def done_of(folder: Path, part: str) -> Done:
    """Return the missions of a part; its rows are read only where its record does not have them.

    Raises:
        CampaignError: when it is damaged.
    """
    with _told_by(folder):
        recorded = part_record(folder, part).done
    return recorded or _by_rows(folder, part)


def _by_rows(folder: Path, part: str) -> Done:
    return _done_by_rows(folder, part, _stamp(part_path(folder, MISSIONS, part)))


@lru_cache(maxsize=MOST_REMEMBERED)
def _done_by_rows(folder: Path, part: str, _: Stamp) -> Done:
    """Return the missions of a part, which is read again only when it has changed."""
    rows = read_part(folder, MISSIONS, part, ("mission", "status"))
    assert rows is not None  # as a part without missions does not count
    return done_in(rows)


def done_in(rows: pa.Table) -> Done:
    """Return the missions of rows."""
    return _united([Done(mission_numbers(rows), has_status(rows, FAILED))])


def has_status(rows: pa.Table, status: str) -> NDArray[np.bool_]:
    """Tell row by row whether the mission has a status, without Arrow's compute library."""
    words = rows["status"].combine_chunks().dictionary_encode()
    same = np.array([*(word == status for word in words.dictionary.to_pylist()), False])
    places = np.nan_to_num(numpy_array(words.indices), nan=len(same) - 1)
    found: NDArray[np.bool_] = same[places.astype(np.int64)]
    return found


def _stamp(path: Path) -> Stamp:
    """Return what tells whether a file has changed; () where it is not there."""
    try:
        return _stamp_of(path.lstat())
    except OSError:
        return ()


def _stamp_of(found: os.stat_result) -> Stamp:
    return found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns


def mission_numbers(rows: pa.Table) -> NDArray[np.int64]:
    """Return the numbers of missions in the plan, row by row."""
    return numpy_array(rows["mission"].combine_chunks())


@contextmanager
def _told_by(folder: Path) -> Iterator[None]:
    """Say of what is damaged in a folder what to do about it."""
    try:
        yield
    except DamagedFile as error:
        raise damaged(folder, error) from None


def _in_peace(folder: Path, read: Callable[[Sequence[str]], Read]) -> Read:
    """Return what was read of the parts that count; again, where they were joined meanwhile."""
    while True:
        parts = committed(folder)
        try:
            return read(parts)
        except CampaignError:
            if committed(folder) == parts:
                raise


def read_table(folder: Path, table: str, columns: Sequence[str] | None = None) -> pa.Table | None:
    """Return a table, or those columns of it, in the order of the plan, each mission once.

    Raises:
        CampaignError: when a part is damaged.
    """
    wanted = ("mission", *columns) if columns else None

    def read(names: Sequence[str]) -> pa.Table | None:
        files, parts = listed(folder), []
        for part in names:
            with _told_by(folder):
                check_part(folder, files, part)
            rows = read_part(folder, table, part, wanted)
            if rows is not None and len(rows):
                parts.append(rows)
        return _each_once(_together(folder, parts), list(map(len, parts))) if parts else None

    return _in_peace(folder, read)


def _each_once(rows: pa.Table, lengths: Sequence[int]) -> pa.Table:
    """Return rows of parts of such lengths in the order of the plan, a mission's of one part."""
    numbers = mission_numbers(rows)
    part = np.repeat(np.arange(len(lengths)), lengths)
    order = None if _is_ordered(numbers) else np.argsort(numbers, kind="stable")
    if order is not None:
        numbers, part = numbers[order], part[order]
    begins = np.flatnonzero(np.diff(numbers, prepend=numbers[0] - 1))
    first = np.repeat(part[begins], np.diff(np.append(begins, len(numbers))))
    kept = part == first
    if order is None and kept.all():
        return rows
    places = np.flatnonzero(kept) if order is None else order[kept]
    return rows.take(arrow(places, pa.int64()))


def _together(folder: Path, parts: Sequence[pa.Table]) -> pa.Table:
    try:
        return pa.concat_tables(parts)
    except pa.ArrowException as error:
        said = (str(error).splitlines() or [""])[0]
        raise CampaignError(f"{folder}: its parts do not fit together ({said})") from None


def in_order(rows: pa.Table) -> pa.Table:
    """Return rows in the order of the plan, those of one mission as they were."""
    numbers = mission_numbers(rows)
    if _is_ordered(numbers):
        return rows
    return rows.take(arrow(np.argsort(numbers, kind="stable"), pa.int64()))


def _is_ordered(numbers: NDArray[np.int64]) -> bool:
    return bool((np.diff(numbers) >= 0).all())  # as parts that were joined are


def metric_schema(table: str) -> pa.Schema:
    """Return the schema of the metrics of a mission or its AUVs, of an event table."""
    return schema("mission" if table == MISSIONS else table)


def labelled(table: pa.Table, labels: Mapping[str, pa.Array]) -> pa.Table:
    """Return a table with columns that say of which mission each row is put before its own."""
    own = [(table.schema.field(n), table.column(n)) for n in table.schema.names if n not in labels]
    fields = [pa.field(name, array.type) for name, array in labels.items()]
    columns = [*labels.values(), *(column for _, column in own)]
    return pa.table(columns, schema=pa.schema([*fields, *(field for field, _ in own)]))


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
    """Give the files of a part names that nobody reads; return that in `missions`."""
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
