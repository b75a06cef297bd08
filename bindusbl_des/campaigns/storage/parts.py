"""The tables of a campaign in parts: files that are whole or absent, the missions' row last.

A part has one name in all tables.  It counts from the moment when its file in `missions/` is there;
a file of that name elsewhere without one in `missions/` is what a killed process left.  A part that
replaces others names them in its metadata, so that no row is ever counted twice.  Each file says in
its metadata which part of which plan it belongs to, that in `missions/` how many rows the others
have (`soundness`).
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from ...core.durable import draft_of, sync
from ...results.arrow import arrow, numpy_array
from ...results.parquet import DamagedFile, read_parquet, write_parquet
from ...results.schemas import schema
from .folder import CampaignError
from .soundness import MISSIONS, TABLES, check_part, described, footer_of, part_path

OK, FAILED = "ok", "failed"

# So many parts are remembered: those of a campaign of some days on many machines.
MOST_REMEMBERED = 8192
REPLACES = b"bindusbl.replaces"
ARROW_TYPES = {
    "bool": pa.bool_(),
    "int": pa.int64(),
    "float": pa.float64(),
    "text": pa.string(),
    "json": pa.string(),
}

Read = TypeVar("Read")
Stamps = tuple[tuple[int, ...], ...]


def commit(folder: Path, part: str, tables: Mapping[str, pa.Table], plan_sha256: str) -> None:
    """Write a part of each table, `missions` last.

    Raises:
        OSError: when it cannot be written; nothing of it counts then.
    """
    ids = tables[MISSIONS]["mission_id"].to_pylist()
    rows = {name: len(table) for name, table in tables.items() if name != MISSIONS}
    for name in TABLES:
        if name in tables:
            belonging = described(plan_sha256, part, ids, rows if name == MISSIONS else None)
            with whole_file(part_path(folder, name, part)) as file:
                write_parquet(tables[name], name, file, belonging)


@contextmanager
def whole_file(path: Path) -> Iterator[Any]:
    """Yield a file to be written that appears under its name only when it is whole, on the disk.

    Raises:
        OSError: when it cannot be written.
    """
    if not path.parent.is_dir():
        path.parent.mkdir(exist_ok=True)
        sync(path.parent.parent)
    with draft_of(path) as draft, open(draft, "wb") as file:
        yield file


def committed(folder: Path) -> list[str]:
    """Return the names of the parts that count, sorted.

    Raises:
        CampaignError: when one is damaged that may replace others.
    """
    names = part_names(folder)
    return sorted(names - _replaced(folder, names))


def part_names(folder: Path) -> set[str]:
    """Return the names of all parts that have a row of missions."""
    return {path.stem.removeprefix("part-") for path in (folder / MISSIONS).glob("part-*.parquet")}


def _replaced(folder: Path, names: Iterable[str]) -> set[str]:
    replaced: set[str] = set()
    for name in names:
        if name.startswith("all-"):  # what only merging and compaction write
            metadata = part_schema(folder, MISSIONS, name).metadata or {}
            replaced |= set(metadata.get(REPLACES, b"").decode().split(","))
    return replaced


def part_schema(folder: Path, table: str, part: str) -> pa.Schema:
    """Return the schema of a part of a table, with its metadata.

    Raises:
        CampaignError: when it is damaged.
    """
    try:
        return footer_of(part_path(folder, table, part)).schema
    except DamagedFile as error:
        raise damaged(folder, error) from None


def clean_parts(folder: Path) -> None:
    """Remove parts that do not count: replaced ones, and those without a row of missions."""
    kept = set(committed(folder))
    for name in TABLES[::-1]:
        for path in (folder / name).glob("part-*.parquet"):
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
    if not path.exists():
        return None
    with _told_by(folder):
        return read_parquet(path, columns, ("mission",))


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
    footer, path = _check(folder, part, plan_sha256), part_path(folder, MISSIONS, part)
    with _told_by(folder):
        rows = read_parquet(path, ("mission", "status"), ("mission",), footer)
    return Done(_numbers(rows), np.array(rows["status"].to_pylist(), dtype=str) == FAILED)


def _stamps(folder: Path, part: str) -> Stamps:
    """Return what tells whether any file of a part has changed."""
    return tuple(_stamp(part_path(folder, table, part)) for table in TABLES)


def _stamp(path: Path) -> tuple[int, ...]:
    try:
        found = path.lstat()
    except OSError:
        return ()
    return found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns


def _numbers(rows: pa.Table) -> NDArray[np.int64]:
    """Return the numbers of missions in the plan, row by row."""
    return numpy_array(rows["mission"].combine_chunks())


def _check(folder: Path, part: str, plan_sha256: str | None = None) -> pq.FileMetaData:
    with _told_by(folder):
        return check_part(folder, part, plan_sha256)


@lru_cache(maxsize=MOST_REMEMBERED)
def _check_once(folder: Path, part: str, _: Stamps) -> None:
    """Check a part, which is done again only when a file of it has changed."""
    _check(folder, part)


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
            _check_once(folder, part, _stamps(folder, part))
            rows = read_part(folder, table, part, wanted)
            if rows is None or not len(rows):
                continue
            numbers = _numbers(rows)
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
    numbers = _numbers(rows)
    if (np.diff(numbers) >= 0).all():  # as parts that were joined are
        return rows
    return rows.take(arrow(np.argsort(numbers, kind="stable"), pa.int64()))


def metric_schema(table: str) -> pa.Schema:
    """Return the schema of the metrics of a mission or its AUVs, of an event table."""
    return schema("mission" if table == MISSIONS else table)


def labelled(table: pa.Table, labels: Mapping[str, pa.Array]) -> pa.Table:
    """Return a table with columns that say of which mission each row is put before its own."""
    own = [(table.schema.field(n), table.column(n)) for n in table.schema.names if n not in labels]
    fields = [pa.field(name, array.type) for name, array in labels.items()]
    columns = [*labels.values(), *(column for _, column in own)]
    return pa.table(columns, schema=pa.schema([*fields, *(field for field, _ in own)]))
