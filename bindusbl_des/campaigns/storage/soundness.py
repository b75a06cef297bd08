"""Whether a part of a campaign is whole: every file of it there, readable, of the same batch."""

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pyarrow as pa
import pyarrow.parquet as pq

from ...results.parquet import DamagedFile
from ...results.schemas import EVENT_TABLES, schema

MISSIONS = "missions"

# The missions come last: they commit the part.
TABLES = ("auvs", *EVENT_TABLES, MISSIONS)

# Which plan, part and missions a file is of; and how many rows the fellows of `missions` have.
BATCH, ROWS = b"bindusbl.batch", b"bindusbl.rows"
NAME = re.compile(r"all-[0-9]{4,9}|[0-9]{8,}-[0-9a-f]{8}")

# What begins so is read by nobody: neither here nor by who reads the folder as one table.
ASIDE = "_damaged"

# What says of which mission a row is, and how that went
LABELS = {
    "mission": pa.int64(),
    "mission_id": pa.string(),
    "seed": pa.int64(),
    "point": pa.int64(),
    "status": pa.string(),
    "error": pa.string(),
    "wall_time_s": pa.float64(),
}
MAY_BE_MISSING = ("error",)

# Those that every table has; that of missions has all of them
OF_EVERY_ROW = ("mission", "mission_id", "seed")
NEEDED = {MISSIONS: tuple(LABELS), "auvs": (*OF_EVERY_ROW, "point", "auv")}


def part_path(folder: Path, table: str, part: str) -> Path:
    """Return where a part of a table lies."""
    return folder.joinpath(table, f"part-{part}.parquet")


def described(
    plan_sha256: str, part: str, mission_ids: Sequence[str], rows: Mapping[str, int] | None = None
) -> dict[str, str]:
    """Return the metadata by which a file of a part is known; `rows` for that of `missions`."""
    batch = {"plan": plan_sha256, "part": part, "missions": _digest(mission_ids)}
    told = {BATCH.decode(): json.dumps(batch)}
    return told if rows is None else {**told, ROWS.decode(): json.dumps(rows)}


def _digest(mission_ids: Sequence[str]) -> str:
    return hashlib.sha256("\n".join(mission_ids).encode()).hexdigest()


class Footer(NamedTuple):
    """What a Parquet file says of itself, and of its columns.

    pyarrow's own `metadata.schema` would keep both alive until garbage is collected.
    """

    metadata: pq.FileMetaData
    schema: pa.Schema


def footer_of(path: Path) -> Footer:
    """Return what a Parquet file says of itself.

    Raises:
        DamagedFile: when it cannot be read.
    """
    if not path.is_file() or path.is_symlink():
        raise DamagedFile(str(path), "is no file" if path.exists() else "is missing")
    if not path.stat().st_size:
        raise DamagedFile(str(path), "is damaged (it is empty)")
    try:
        with pq.ParquetFile(path) as file:
            return Footer(file.metadata, file.schema_arrow)
    except (OSError, pa.ArrowException) as error:
        said = (str(error).splitlines() or [""])[0]
        reason = "cannot be read" if isinstance(error, PermissionError) else "is damaged"
        raise DamagedFile(str(path), f"{reason} ({said})") from None


def plan_of(folder: Path, part: str) -> str:
    """Return the fingerprint of the plan that a part belongs to.

    Raises:
        DamagedFile: when it is damaged.
    """
    path = part_path(folder, MISSIONS, part)
    return _batch(path, footer_of(path))[0]


def check_part(folder: Path, part: str, plan_sha256: str | None = None) -> pq.FileMetaData:
    """Return what the missions of a part say of themselves.

    A part that lacks a file, or has one of another part, or of another plan, is refused.

    Raises:
        DamagedFile: saying what is wrong with which file.
    """
    missions = part_path(folder, MISSIONS, part)
    own = footer_of(missions)
    _check_columns(missions, MISSIONS, own)
    plan, name, _ = batch = _batch(missions, own)
    rows = _rows(missions, own)
    if not NAME.fullmatch(part) or name != part:
        raise DamagedFile(str(missions), f"is part {name} under another name")
    if plan_sha256 is not None and plan != plan_sha256:
        raise DamagedFile(str(missions), "belongs to another campaign")
    for table in TABLES[:-1]:
        path = part_path(folder, table, part)
        if table not in rows:
            if path.exists():
                raise DamagedFile(str(path), "does not belong to the other tables of this part")
            continue
        fellow = footer_of(path)
        _check_columns(path, table, fellow)
        if _batch(path, fellow) != batch or fellow.metadata.num_rows != rows[table]:
            raise DamagedFile(str(path), f"does not belong to {missions}")
    return own.metadata


def _check_columns(path: Path, table: str, footer: Footer) -> None:
    """Refuse a file without columns, or with those of other types, or with a row of no mission."""
    metadata, found = footer
    names, types = set(found.names), _types(table)
    for name in NEEDED.get(table, OF_EVERY_ROW):
        if name not in names:
            raise DamagedFile(str(path), f"has no column {name}")
    for place, field in enumerate(found):
        kind = types.get(field.name, field.type)
        if field.type != kind:
            raise DamagedFile(str(path), f"has {field.type} in its column {field.name}, not {kind}")
        if field.name in LABELS and field.name not in MAY_BE_MISSING:
            for group in range(metadata.num_row_groups):
                rows = metadata.row_group(group)
                known = rows.column(place).statistics
                if rows.num_rows and (known is None or known.null_count):
                    raise DamagedFile(str(path), f"lacks values in its column {field.name}")


@cache
def _types(table: str) -> dict[str, pa.DataType]:
    """Return the types of a part's columns that have one."""
    described = schema("mission" if table == MISSIONS else table)
    return LABELS | {field.name: field.type for field in described}


def _batch(path: Path, footer: Footer) -> tuple[str, str, str]:
    """Return the plan, part and missions that a file says it is of."""
    try:
        batch = json.loads(footer.schema.metadata[BATCH])
        return str(batch["plan"]), str(batch["part"]), str(batch["missions"])
    except (KeyError, TypeError, ValueError, RecursionError):
        raise DamagedFile(str(path), "is no part of a campaign") from None


def _rows(path: Path, footer: Footer) -> dict[str, int]:
    try:
        counts = json.loads(footer.schema.metadata[ROWS])
        return {str(table): int(count) for table, count in counts.items()}
    except (AttributeError, KeyError, TypeError, ValueError, RecursionError):
        raise DamagedFile(str(path), "is no part of a campaign's missions") from None


def set_aside(folder: Path, plan_sha256: str) -> list[str]:
    """Read all parts of a campaign; rename the files of damaged ones so that they do not count.

    Returns a line for each damaged part.

    Raises:
        OSError: when a file cannot be renamed.
    """
    told = []
    for path in sorted((folder / MISSIONS).glob("part-*.parquet")):
        part = path.stem.removeprefix("part-")
        try:
            check_part(folder, part, plan_sha256)
            _read_through(folder, part)
        except DamagedFile as error:
            aside = _rename(folder, part)
            told.append(f"{error}; set aside as {aside}, its missions are run again")
    return told


def _read_through(folder: Path, part: str) -> None:
    """Read every page of a part's files, which checks their sums, a few rows at a time."""
    for table in TABLES:
        path = part_path(folder, table, part)
        if not path.exists():
            continue
        try:
            with pq.ParquetFile(path, page_checksum_verification=True) as file:
                for _ in file.iter_batches():
                    pass
        except (OSError, pa.ArrowException) as error:
            said = (str(error).splitlines() or [""])[0]
            raise DamagedFile(str(path), f"is damaged ({said})") from None
    path = part_path(folder, MISSIONS, part)
    try:
        with pq.ParquetFile(path) as file:
            digest = _digest(file.read(["mission_id"])["mission_id"].to_pylist())
    except (KeyError, TypeError, pa.ArrowException):
        raise DamagedFile(str(path), "has no column mission_id") from None
    if _batch(path, footer_of(path))[2] != digest:
        raise DamagedFile(str(path), "holds other missions than it says")


def _rename(folder: Path, part: str) -> Path:
    """Give the files of a part names that nobody reads; return that in `missions`."""
    number = 1
    while any(_aside(folder, table, part, number).exists() for table in TABLES):
        number += 1
    for table in TABLES[::-1]:  # the missions first: without them the others do not count
        path = part_path(folder, table, part)
        if path.exists() or path.is_symlink():
            path.rename(_aside(folder, table, part, number))
    return _aside(folder, MISSIONS, part, number)


def _aside(folder: Path, table: str, part: str, number: int) -> Path:
    path = part_path(folder, table, part)
    return path.with_name(f"{ASIDE}{'' if number == 1 else f'-{number}'}-{path.name}")
