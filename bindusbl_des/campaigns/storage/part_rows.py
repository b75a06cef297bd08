"""Rows of a campaign's tables, of one part or of all that count: none is read unchecked."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pyarrow as pa

from ...core.arrays import Ints
from ...results.columns import arrow
from ...results.result_folder import read_parquet, read_pieces, read_schema
from ...results.schemas import schema
from .done import Done, done_in, mission_numbers, united
from .folder import CampaignError
from .parts import (
    MISSIONS,
    MOST_REMEMBERED,
    TABLES,
    Stamp,
    check_part,
    check_table,
    committed,
    listed,
    part_path,
    part_record,
    stamp,
    told_by,
)

Read = TypeVar("Read")

# So many parts of a table are apart in memory: a column of few rows takes a kilobyte in each.
MOST_APART = 256


def read_part(
    folder: Path, table: str, part: str, columns: Sequence[str] | None = None
) -> pa.Table | None:
    """Return a part of a table, None where it has none.

    Raises:
        CampaignError: when it is damaged.
    """
    path = part_path(folder, table, part)
    with told_by(folder):
        check_table(folder, table, part)
        return read_parquet(path, columns, ("mission",)) if path.exists() else None


def part_pieces(folder: Path, table: str, part: str) -> Iterator[pa.Table]:
    """Yield a part of a table in the order of the plan, some thousand rows at a time.

    Raises:
        CampaignError: when it is damaged.
    """
    path = part_path(folder, table, part)
    with told_by(folder):
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


def part_schema(folder: Path, table: str, part: str) -> pa.Schema:
    """Return the schema of a part of a table.

    Raises:
        CampaignError: when it is damaged.
    """
    with told_by(folder):
        check_table(folder, table, part)
        return read_schema(part_path(folder, table, part))


def read_table(folder: Path, table: str, columns: Sequence[str] | None = None) -> pa.Table | None:
    """Return a table, or those columns of it, in the order of the plan, each mission once.

    Raises:
        CampaignError: when a part is damaged.
    """
    wanted = ("mission", *columns) if columns else None

    def read(names: Sequence[str]) -> pa.Table | None:
        files, lengths = listed(folder), []
        parts, joined = list[pa.Table](), list[pa.Table]()
        for part in names:
            with told_by(folder):
                check_part(folder, files, part)
            rows = read_part(folder, table, part, wanted)
            if rows is not None and len(rows):
                parts.append(rows)
                lengths.append(len(rows))
            if len(parts) == MOST_APART:
                joined.append(_together(folder, parts).combine_chunks())
                parts.clear()
        return _each_once(_together(folder, [*joined, *parts]), lengths) if lengths else None

    return _in_peace(folder, read)


def of_mission(folder: Path, mission: int) -> dict[str, pa.Table] | None:
    """Return the rows of a mission by its number, of each table that was kept; None where it has
    none.

    Raises:
        CampaignError: when its part is damaged.
    """

    def read(parts: Sequence[str]) -> dict[str, pa.Table] | None:
        files = listed(folder)
        for part in parts:
            if mission not in done_of(folder, part).numbers:
                continue
            with told_by(folder):
                check_part(folder, files, part)
            found = {table: read_part(folder, table, part) for table in TABLES}
            return {
                name: _rows_of(rows, mission) for name, rows in found.items() if rows is not None
            }
        return None

    return _in_peace(folder, read)


def _rows_of(rows: pa.Table, mission: int) -> pa.Table:
    ordered = in_order(rows)
    begin, end = np.searchsorted(mission_numbers(ordered), (mission, mission + 1)).tolist()
    return ordered.slice(begin, end - begin)


def of_schema(rows: pa.Table, table: str) -> pa.Table:
    """Return rows of a campaign's table as the mission had them."""
    known = schema(table, rows.column_names)
    columns = [(rows[field.name], field.type) for field in known]  # varied, it may be another type
    whole = [own if own.type == kind else own.cast(kind) for own, kind in columns]
    return pa.Table.from_arrays(whole, schema=known)


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


def _is_ordered(numbers: Ints) -> bool:
    return bool((np.diff(numbers) >= 0).all())  # as parts that were joined are


def done(folder: Path, plan_sha256: str | None = None) -> Done:
    """Return the missions that have a row.

    Raises:
        CampaignError: when a part is damaged, or belongs to another plan than is asked for.
    """

    def read(parts: Sequence[str]) -> Done:
        files = listed(folder)
        with told_by(folder):
            records = {part: check_part(folder, files, part, plan_sha256) for part in parts}
        return united([record.done or _by_rows(folder, part) for part, record in records.items()])

    return _in_peace(folder, read)


def done_of(folder: Path, part: str) -> Done:
    """Return the missions of a part; its rows are read only where its record does not have them.

    Raises:
        CampaignError: when it is damaged.
    """
    with told_by(folder):
        recorded = part_record(folder, part).done
    return recorded or _by_rows(folder, part)


def _by_rows(folder: Path, part: str) -> Done:
    return _done_by_rows(folder, part, stamp(part_path(folder, MISSIONS, part)))


@lru_cache(maxsize=MOST_REMEMBERED)
def _done_by_rows(folder: Path, part: str, _: Stamp) -> Done:
    """Return the missions of a part, which is read again only when it has changed."""
    rows = read_part(folder, MISSIONS, part, ("mission", "status"))
    assert rows is not None  # as a part without missions does not count
    return done_in(rows)


def _in_peace(folder: Path, read: Callable[[Sequence[str]], Read]) -> Read:
    """Return what was read of the parts that count; again, where they were joined meanwhile."""
    while True:
        parts = committed(folder)
        try:
            return read(parts)
        except CampaignError:
            if committed(folder) == parts:
                raise


def labelled(table: pa.Table, labels: Mapping[str, pa.Array]) -> pa.Table:
    """Return a table with columns that say of which mission each row is put before its own."""
    own = [(table.schema.field(n), table.column(n)) for n in table.schema.names if n not in labels]
    fields = [pa.field(name, array.type) for name, array in labels.items()]
    columns = [*labels.values(), *(column for _, column in own)]
    return pa.table(columns, schema=pa.schema([*fields, *(field for field, _ in own)]))


ARROW_TYPES = {
    "bool": pa.bool_(),
    "int": pa.int64(),
    "float": pa.float64(),
    "text": pa.string(),
    "json": pa.string(),
}


def varied_columns(
    kinds: Mapping[str, str], varied: Sequence[Mapping[str, Any]]
) -> dict[str, pa.Array]:
    """Return varied keys, by their kinds, as columns with a value for each of some points or
    missions; what is no number or text is written as JSON.
    """
    columns = {}
    for key, kind in kinds.items():
        values = [values[key] for values in varied]
        if kind == "json":
            values = [None if value is None else json.dumps(value) for value in values]
        columns[key] = arrow(values, ARROW_TYPES[kind])
    return columns
