"""Rows of a campaign's tables, checked before they are read; and parts joined in the plan's order.

Joining reads parts forward, with some thousand rows in memory.
"""

import json
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from ....core.results.columns import arrow
from ....core.results.result_folder import read_parquet, read_pieces, read_schema
from ....core.results.schemas import schema
from ....support.arrays import Flags, Ints
from .folder import CampaignError
from .parts import (
    MISSIONS,
    TABLES,
    Done,
    PartWriter,
    check_part,
    check_table,
    clean_parts,
    committed,
    listed,
    mission_numbers,
    part_path,
    part_record,
    told_by,
    united,
)

Read = TypeVar("Read")

# So many parts of a table are apart in memory: a column of few rows takes a kilobyte in each.
MOST_APART = 256


def read_part(
    folder: Path, table: str, part: str, columns: Sequence[str] | None = None
) -> pa.Table | None:
    """Return a part of a table, or None.

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
    """Return the rows of a mission, by its number, from each kept table; None if it has none.

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
    """Return the missions of a part, from its record or else from its rows.

    Raises:
        CampaignError: when it is damaged.
    """
    with told_by(folder):
        recorded = part_record(folder, part).done
    return recorded or _by_rows(folder, part)


def _by_rows(folder: Path, part: str) -> Done:
    rows = read_part(folder, MISSIONS, part, ("mission", "status"))
    assert rows is not None  # as a part without missions does not count
    return Done.in_rows(rows)


def _in_peace(folder: Path, read: Callable[[Sequence[str]], Read]) -> Read:
    """Return what was read from the parts that count; read again if they were joined meanwhile."""
    while True:
        parts = committed(folder)
        try:
            return read(parts)
        except CampaignError:
            if committed(folder) == parts:
                raise


def labelled(table: pa.Table, labels: Mapping[str, pa.Array]) -> pa.Table:
    """Return a table with the columns that identify each row's mission put first."""
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
    """Return the varied keys as columns with a value for each point or mission.

    Values other than numbers and texts are written as JSON.
    """
    columns = {}
    for key, kind in kinds.items():
        values = [values[key] for values in varied]
        if kind == "json":
            values = [None if value is None else json.dumps(value) for value in values]
        columns[key] = arrow(values, ARROW_TYPES[kind])
    return columns


# So many rows are written together, whatever parts they come from: equal campaigns, equal files.
ROWS_IN_GROUP = 10_000

# What a joined table keeps of the metadata of its parts: which table it is.
SCHEMA = b"bindusbl.schema"

Source = tuple[Path, str]


def compact(folder: Path, *, leave_out: Iterable[int] = ()) -> None:
    """Replace the parts of a campaign by one, sorted; equal campaigns get equal tables.

    Raises:
        OSError: when it cannot be written; the parts are then as before.
    """
    parts = committed(folder)
    whole = [name for name in parts if name.startswith("all-")]
    number = 1 + max((int(name.removeprefix("all-")) for name in whole), default=0)
    left_out = set(leave_out)
    if parts != whole or left_out:
        _join([(folder, part) for part in parts], folder, f"all-{number:04d}", left_out, parts)
        clean_parts(folder)


def merge_parts(folders: Sequence[Path], out: Path) -> None:
    """Write the missions of several folders as one part of another, each mission once."""
    sources = [(folder, part) for folder in folders for part in committed(folder)]
    _join(sources, out, "all-0001", set(), [])


def _join(
    sources: Sequence[Source], out: Path, part: str, leave_out: set[int], replaces: Sequence[str]
) -> None:
    if not sources:
        return
    each = [done_of(*source) for source in sources]
    all_ = united(each)
    kept = ~np.isin(all_.numbers, sorted(leave_out))
    whole = Done(all_.numbers[kept], all_.failed[kept])
    taken = _taken(sources, each, kept)
    writer = PartWriter(out, part, part_record(*sources[0]).plan_sha256, whole, replaces)
    for table in TABLES:
        _join_table(table, sources, taken, writer)


def _taken(sources: Sequence[Source], each: Sequence[Done], kept: Flags) -> dict[Source, Ints]:
    """Return which missions come from which part: each from the first that has it."""
    numbers, first = np.unique(np.concatenate([own.numbers for own in each]), return_index=True)
    of = np.repeat(np.arange(len(each)), list(map(len, each)))[first][kept]
    order = np.argsort(of, kind="stable")
    shares = np.split(numbers[kept][order], np.searchsorted(of[order], np.arange(1, len(each))))
    return {source: share for source, share in zip(sources, shares, strict=True) if len(share)}


def _at(source: Source, table: str) -> tuple[Path, str, str]:
    return source[0], table, source[1]


def _join_table(
    table: str, sources: Sequence[Source], taken: Mapping[Source, Ints], writer: PartWriter
) -> None:
    """Write a table of the joined part, if any of the parts has it."""
    first = next((s for s in sources if part_path(*_at(s, table)).exists()), None)
    if first is None:
        return
    kind = part_schema(*_at(first, table))
    kind = kind.with_metadata({SCHEMA: (kind.metadata or {}).get(SCHEMA, b"")})
    with writer.file(table) as file, pq.ParquetWriter(file, kind, compression="zstd") as rows_of:
        is_empty = True
        for rows in _grouped(_pieces(table, taken)):
            rows_of.write_table(rows.cast(kind), row_group_size=ROWS_IN_GROUP)
            is_empty = False
        if is_empty:  # pyarrow 18 reads no file without a group of rows
            rows_of.write_table(kind.empty_table())


def _grouped(pieces: Iterable[pa.Table]) -> Iterator[pa.Table]:
    """Yield pieces put together and cut to groups of equal length."""
    waiting: list[pa.Table] = []
    count = 0
    for rows in pieces:
        waiting.append(rows)
        count += len(rows)
        while count >= ROWS_IN_GROUP:
            together = pa.concat_tables(waiting)
            yield together.slice(0, ROWS_IN_GROUP)
            waiting, count = [together.slice(ROWS_IN_GROUP)], count - ROWS_IN_GROUP
    if count:
        yield pa.concat_tables(waiting)


def _pieces(table: str, taken: Mapping[Source, Ints]) -> Iterator[pa.Table]:
    """Yield the rows of the missions in their order, each from the part that it is taken from.

    Of all parts that are open, that one goes on whose rows in memory end first; a part is opened
    when its first mission is reached, so that parts that follow one another are not held together.
    """
    closed = deque(sorted(taken, key=lambda source: taken[source][0]))
    parts: list[_Forward] = []
    while parts or closed:
        while closed and (not parts or taken[closed[0]][0] <= min(part.last for part in parts)):
            source = closed.popleft()
            part = _Forward(_at(source, table), taken[source])
            if part.rest:
                parts.append(part)
        if parts:
            last = min(part.last for part in parts)
            rows = [piece for part in parts for piece in part.until(last)]
            yield in_order(pa.concat_tables(rows))
        parts = [part for part in parts if part.rest]


class _Forward:
    """The rows of missions taken from a part of a table, first to last.

    `rest` is the unread piece in memory, or None.
    """

    def __init__(self, at: tuple[Path, str, str], taken: Ints) -> None:
        self._pieces = part_pieces(*at)
        self._taken = taken
        self.rest = next(self._pieces, None)

    @property
    def last(self) -> int:
        """Return the number of the last mission of the piece in memory."""
        return int(mission_numbers(self.rest)[-1])

    def until(self, last: int) -> Iterator[pa.Table]:
        """Yield the rows that have not been yielded yet, of missions up to a number."""
        while self.rest is not None:
            numbers = mission_numbers(self.rest)
            cut = int(np.searchsorted(numbers, last, side="right"))
            is_taken = np.isin(numbers[:cut], self._taken)
            yield self.rest.slice(0, cut).filter(arrow(is_taken, pa.bool_()))
            if cut < len(numbers):
                self.rest = self.rest.slice(cut)
                return
            self.rest = next(self._pieces, None)
