"""The tables of a campaign in parts: files that are whole or absent, the missions' row last.

A part has one name in all tables.  It counts from the moment when its file in `missions/` is there;
a file of that name elsewhere without one in `missions/` is what a killed process left.  A part that
replaces others names them in its metadata, so that no row is ever counted twice.
"""

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from numpy.typing import NDArray

from ...arrow_columns import arrow
from ...parquet_reading import DamagedFile, read_parquet
from ...tables import EVENT_TABLES, schema, write_parquet
from .folder import CampaignError

MISSIONS = "missions"
OK, FAILED = "ok", "failed"

# The missions come last: they commit the part.
TABLES = ("auvs", *EVENT_TABLES, MISSIONS)
REPLACES = b"bindusbl.replaces"
ARROW_TYPES = {
    "bool": pa.bool_(),
    "int": pa.int64(),
    "float": pa.float64(),
    "text": pa.string(),
    "json": pa.string(),
}


def part_path(folder: Path, table: str, part: str) -> Path:
    """Return where a part of a table lies."""
    return folder / table / f"part-{part}.parquet"


def commit(
    folder: Path, part: str, tables: Mapping[str, pa.Table], replaces: Sequence[str] = ()
) -> None:
    """Write a part of each table, `missions` last.

    Raises:
        OSError: when it cannot be written; nothing of it counts then.
    """
    for name in TABLES:
        if name in tables:
            (folder / name).mkdir(exist_ok=True)
            with Draft(part_path(folder, name, part)) as file:
                write_parquet(tables[name], name, file, {REPLACES.decode(): ",".join(replaces)})


class Draft:
    """A file that appears under its name only when it is whole and on the disk."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._draft = path.with_name(f".{path.name}.tmp")

    def __enter__(self) -> Any:
        self._file = open(self._draft, "wb")
        return self._file

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        try:
            if kind is None:
                self._file.flush()
                os.fsync(self._file.fileno())
            self._file.close()
            if kind is None:
                os.replace(self._draft, self._path)
        finally:
            self._draft.unlink(missing_ok=True)


def committed(folder: Path) -> list[str]:
    """Return the names of the parts that count, sorted."""
    names = {path.stem.removeprefix("part-") for path in (folder / MISSIONS).glob("part-*.parquet")}
    return sorted(names - _replaced(folder, names))


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
    path = part_path(folder, table, part)
    try:
        return pq.read_schema(path)
    except (OSError, pa.ArrowException) as error:
        reason = f"is damaged ({(str(error).splitlines() or [''])[0]})"
        raise damaged(folder, part, DamagedFile(str(path), reason)) from None


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
    try:
        return read_parquet(path, columns, ("mission",))
    except DamagedFile as error:
        raise damaged(folder, part, error) from None


def damaged(folder: Path, part: str, error: DamagedFile) -> CampaignError:
    """Return what to tell of a part that cannot be read: its file, why, and what to do."""
    return CampaignError(
        f"{error}; delete {part_path(folder, MISSIONS, part)}, then `bindusbl-des resume {folder}` "
        "runs its missions again"
    )


@dataclass(frozen=True)
class Done:
    """Missions that have a row: their numbers in the plan, ascending, and which of them failed."""

    numbers: NDArray[np.int64]
    failed: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.numbers)


def done(folder: Path) -> Done:
    """Return the missions that have a row.

    Raises:
        CampaignError: when a part is damaged.
    """
    numbers, failed = [np.zeros(0, np.int64)], [np.zeros(0, bool)]
    for part in committed(folder):
        rows = read_part(folder, MISSIONS, part, ("mission", "status"))
        if rows is not None:
            numbers.append(rows["mission"].to_numpy())
            failed.append(pc.equal(rows["status"], FAILED).to_numpy())
            _check_companion(folder, part, whole=bool(failed[-1].all()))
    unique, first = np.unique(np.concatenate(numbers), return_index=True)
    return Done(unique, np.concatenate(failed)[first])


def _check_companion(folder: Path, part: str, *, whole: bool) -> None:
    """Refuse a part of missions of which not the `whole` failed without a sound table of AUVs."""
    path = part_path(folder, "auvs", part)
    if path.exists():
        part_schema(folder, "auvs", part)
    elif not whole:
        raise damaged(folder, part, DamagedFile(str(path), "is missing"))


def read_table(folder: Path, table: str, columns: Sequence[str] | None = None) -> pa.Table | None:
    """Return a table, or those columns of it, in the order of the plan, each mission once."""
    wanted = ("mission", *columns) if columns else None
    parts, seen = [], set[int]()
    for part in committed(folder):
        rows = read_part(folder, table, part, wanted)
        if rows is None or not len(rows):
            continue
        numbers = set(rows["mission"].to_pylist())
        if numbers & seen:
            rows = rows.filter(
                arrow([n not in seen for n in rows["mission"].to_pylist()], pa.bool_())
            )
        seen |= numbers
        parts.append(rows)
    return in_order(pa.concat_tables(parts)) if parts else None


def in_order(rows: pa.Table) -> pa.Table:
    """Return rows in the order of the plan, those of one mission as they were."""
    return rows.take(np.argsort(rows["mission"].to_numpy(), kind="stable"))


def metric_schema(table: str) -> pa.Schema:
    """Return the schema of the metrics of a mission or its AUVs, of an event table."""
    return schema("mission" if table == MISSIONS else table)


def labelled(table: pa.Table, labels: Mapping[str, pa.Array]) -> pa.Table:
    """Return a table with columns that say of which mission each row is put before its own."""
    own = [(table.schema.field(n), table.column(n)) for n in table.schema.names if n not in labels]
    fields = [pa.field(name, array.type) for name, array in labels.items()]
    columns = [*labels.values(), *(column for _, column in own)]
    return pa.table(columns, schema=pa.schema([*fields, *(field for field, _ in own)]))
