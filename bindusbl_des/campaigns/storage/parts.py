"""The tables of a campaign in parts: files that are whole or absent, the missions' row last.

A part has one name in all tables.  It counts from the moment when its file in `missions/` is there;
a file of that name elsewhere without one in `missions/` is what a killed process left.  The record
of a part in `checksums/`, written before that, has the SHA-256 and size of each of its files, the
plan that it is of and the parts that it replaces, so that no row is ever counted twice.  Whoever
reads rows compares the file's checksum first; whoever counts missions compares sizes.  Parts of
earlier versions have no record: they say in Parquet's metadata what they are of.
"""

import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from ...core.files import draft_of, read_json, sync
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
from .folder import CampaignError, write_json

OK, FAILED = "ok", "failed"

MISSIONS, CHECKSUMS = "missions", "checksums"

# The missions come last: they commit the part.
TABLES = ("auvs", *EVENT_TABLES, MISSIONS)

NAME = re.compile(r"all-[0-9]{4,9}|[0-9]{8,}-[0-9a-f]{8}")

# What begins so is read by nobody: neither here nor by who reads the folder as one table.
ASIDE = "_damaged"

# Where parts of earlier versions say which plan and part they are of, and which they replace.
BATCH, REPLACES = b"bindusbl.batch", b"bindusbl.replaces"

# So many parts are remembered: those of a campaign of some days on many machines.
MOST_REMEMBERED = 8192
ARROW_TYPES = {
    "bool": pa.bool_(),
    "int": pa.int64(),
    "float": pa.float64(),
    "text": pa.string(),
    "json": pa.string(),
}

Read = TypeVar("Read")
Stamps = tuple[tuple[int, ...], ...]


def part_path(folder: Path, table: str, part: str) -> Path:
    """Return where a part of a table lies."""
    return folder.joinpath(table, f"part-{part}.parquet")


def record_path(folder: Path, part: str) -> Path:
    """Return where the record of a part lies."""
    return folder.joinpath(CHECKSUMS, f"part-{part}.json")


@dataclass(frozen=True)
class PartRecord:
    """What a part is of, which parts it replaces, and what its files are.

    `files` has the SHA-256 and the size (bytes) of each table; None in parts of earlier versions.
    """

    plan_sha256: str
    replaces: tuple[str, ...]
    files: Mapping[str, tuple[str, int]] | None


class PartWriter:
    """A part that is being written, a table after the other, `missions` last."""

    def __init__(
        self, folder: Path, part: str, plan_sha256: str, replaces: Sequence[str] = ()
    ) -> None:
        self._folder, self._part = folder, part
        self._record = {"part": part, "plan_sha256": plan_sha256, "replaces": list(replaces)}
        self._files: dict[str, dict[str, Any]] = {}

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
                write_json(path, {**self._record, "files": self._files})


def commit(folder: Path, part: str, tables: Mapping[str, pa.Table], plan_sha256: str) -> None:
    """Write a part of each table, `missions` last.

    Raises:
        OSError: when it cannot be written; nothing of it counts then.
    """
    writer = PartWriter(folder, part, plan_sha256)
    for name in TABLES:
        if name in tables:
            with writer.file(name) as file:
                write_parquet(tables[name], name, file, {})


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
    """Make a folder if need be, so that a power cut does not take it and what is synced in it."""
    if not folder.is_dir():
        folder.mkdir(exist_ok=True)
        sync(folder.parent)


def part_record(folder: Path, part: str) -> PartRecord:
    """Return what a part says of itself.

    Raises:
        DamagedFile: when it says nothing that can be read.
    """
    path = record_path(folder, part)
    if not path.exists():
        return _record_in_metadata(folder, part)
    try:
        found = read_json(path)
        files = {name: (str(it["sha256"]), int(it["bytes"])) for name, it in found["files"].items()}
        name, plan, replaces = found["part"], str(found["plan_sha256"]), tuple(found["replaces"])
    except (OSError, AttributeError, KeyError, TypeError, ValueError) as error:
        said = (str(error).splitlines() or [type(error).__name__])[0]
        raise DamagedFile(str(path), f"is damaged ({said})") from None
    if name != part:
        raise DamagedFile(str(path), f"is that of part {name}")
    return PartRecord(plan, replaces, files)


def _record_in_metadata(folder: Path, part: str) -> PartRecord:
    """Return what a part of an earlier version says of itself."""
    path = part_path(folder, MISSIONS, part)
    try:
        metadata = read_schema(path).metadata or {}
        batch = json.loads(metadata[BATCH])
        plan, name = str(batch["plan"]), str(batch["part"])
    except DamagedFile:
        raise
    except (KeyError, TypeError, ValueError, RecursionError):
        raise DamagedFile(str(path), "is no part of a campaign") from None
    if name != part:
        raise DamagedFile(str(path), f"is part {name} under another name")
    return PartRecord(plan, tuple(metadata.get(REPLACES, b"").decode().split(",")), None)


def check_part(folder: Path, part: str, plan_sha256: str | None = None) -> None:
    """Refuse a part that lacks a file, or has one of another size, or is of another plan.

    Raises:
        DamagedFile: saying what is wrong with which file.
    """
    missions = part_path(folder, MISSIONS, part)
    if not NAME.fullmatch(part):
        raise DamagedFile(str(missions), "has a name that no part has")
    record = part_record(folder, part)
    if plan_sha256 is not None and record.plan_sha256 != plan_sha256:
        raise DamagedFile(str(missions), "belongs to another campaign")
    if record.files is None:
        return
    for table in TABLES:
        path, expected = part_path(folder, table, part), record.files.get(table)
        if path.is_symlink() or (path.exists() and not path.is_file()):
            raise DamagedFile(str(path), "is no file")
        if expected is None and path.exists():
            raise DamagedFile(str(path), "does not belong to the other tables of this part")
        if expected is not None and not path.exists():
            raise DamagedFile(str(path), "is missing")
        if expected is not None and path.stat().st_size != expected[1]:
            raise DamagedFile(str(path), f"is damaged (it should have {expected[1]:,} bytes)")


def check_table(folder: Path, table: str, part: str) -> None:
    """Refuse a file of a part that has not its checksum; compared again only where it changed.

    Raises:
        DamagedFile: saying what is wrong with it.
    """
    record, path = part_record(folder, part), part_path(folder, table, part)
    if record.files is None:
        return
    expected = record.files.get(table)
    if expected is None and path.exists():
        raise DamagedFile(str(path), "does not belong to the other tables of this part")
    if expected is not None and _sum(path, _stamp(path)) != expected[0]:
        raise DamagedFile(
            str(path), f"is damaged or was edited (its SHA-256 is not that in {CHECKSUMS}/)"
        )


@lru_cache(maxsize=MOST_REMEMBERED)
def _sum(path: Path, _: tuple[int, ...]) -> str:
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
    return {path.stem.removeprefix("part-") for path in (folder / MISSIONS).glob("part-*.parquet")}


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
        if _is_ordered(mission_numbers(read_parquet(path, ("mission",), ("mission",)))):
            yield from read_pieces(path)
        else:
            yield in_order(read_parquet(path))


def damaged(folder: Path, error: DamagedFile) -> CampaignError:
    """Return what to tell of a part that cannot be used: its file, why, and what to do."""
    return CampaignError(
        f"{error}; `bindusbl-des resume {folder}` sets it aside and runs its missions again"
    )


@dataclass(frozen=True)
class Done:
    """Missions that have a row: their numbers in the plan, ascending, and which of them failed."""

    numbers: NDArray[np.int64]
    failed: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.numbers)


def done(folder: Path, plan_sha256: str | None = None) -> Done:
    """Return the missions that have a row.

    Raises:
        CampaignError: when a part is damaged, or belongs to another plan than is asked for.
    """

    def read(parts: Sequence[str]) -> Done:
        found = [_done_in(folder, part, plan_sha256, _stamps(folder, part)) for part in parts]
        numbers = np.concatenate([np.zeros(0, np.int64), *(it.numbers for it in found)])
        failed = np.concatenate([np.zeros(0, bool), *(it.failed for it in found)])
        unique, first = np.unique(numbers, return_index=True)
        return Done(unique, failed[first])

    return _in_peace(folder, read)


@lru_cache(maxsize=MOST_REMEMBERED)
def _done_in(folder: Path, part: str, plan_sha256: str | None, _: Stamps) -> Done:
    """Return the missions of a part, which is read again only when a file of it has changed."""
    with _told_by(folder):
        check_part(folder, part, plan_sha256)
    rows = read_part(folder, MISSIONS, part, ("mission", "status"))
    assert rows is not None  # as a part without missions does not count
    return Done(mission_numbers(rows), np.array(rows["status"].to_pylist(), dtype=str) == FAILED)


def _stamps(folder: Path, part: str) -> Stamps:
    """Return what tells whether any file of a part has changed."""
    paths = [part_path(folder, table, part) for table in TABLES]
    return tuple(map(_stamp, [*paths, record_path(folder, part)]))


def _stamp(path: Path) -> tuple[int, ...]:
    try:
        found = path.lstat()
    except OSError:
        return ()
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
        parts, seen = [], set[int]()
        for part in names:
            with _told_by(folder):
                check_part(folder, part)
            rows = read_part(folder, table, part, wanted)
            if rows is None or not len(rows):
                continue
            numbers = mission_numbers(rows)
            missions = np.unique(numbers).tolist()
            if not seen.isdisjoint(missions):
                rows = rows.filter(arrow([n not in seen for n in numbers.tolist()], pa.bool_()))
            seen.update(missions)
            parts.append(rows)
        return in_order(_together(folder, parts)) if parts else None

    return _in_peace(folder, read)


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
    told = []
    for path in sorted((folder / MISSIONS).glob("part-*.parquet")):
        part = path.stem.removeprefix("part-")
        try:
            check_part(folder, part, plan_sha256)
            _compare(folder, part)
        except DamagedFile as error:
            aside = _rename(folder, part)
            told.append(f"{error}; set aside as {aside}, its missions are run again")
    return told


def _compare(folder: Path, part: str) -> None:
    """Compare the checksums of all files of a part; read through those that have none."""
    for table in TABLES:
        check_table(folder, table, part)
    if part_record(folder, part).files is not None:
        return
    for path in (part_path(folder, table, part) for table in TABLES):
        try:
            if path.exists():
                with open(path, "rb") as file:
                    for _ in pq.ParquetFile(file, page_checksum_verification=True).iter_batches():
                        pass
        except (OSError, pa.ArrowException) as error:
            said = (str(error).splitlines() or [""])[0]
            raise DamagedFile(str(path), f"is damaged ({said})") from None


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
