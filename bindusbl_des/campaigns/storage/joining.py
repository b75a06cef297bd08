"""Parts put together in the order of the plan, a few hundred missions in memory at a time."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from functools import lru_cache
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from ...arrow_columns import arrow
from .parts import (
    MISSIONS,
    REPLACES,
    TABLES,
    Draft,
    clean_parts,
    committed,
    in_order,
    part_path,
    part_schema,
    read_part,
)

MISSIONS_AT_A_TIME = 500

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
    owners: dict[int, Source] = {}
    for source in sources:
        rows = read_part(*_at(source, MISSIONS), columns=("mission",))
        for number in rows["mission"].to_pylist() if rows is not None else ():
            owners.setdefault(number, source)
    order = sorted(set(owners) - leave_out)
    for table in TABLES:
        _join_table(table, sources, owners, order, part_path(out, table, part), replaces)


def _at(source: Source, table: str) -> tuple[Path, str, str]:
    return source[0], table, source[1]


def _join_table(
    table: str,
    sources: Sequence[Source],
    owners: Mapping[int, Source],
    order: Sequence[int],
    path: Path,
    replaces: Sequence[str],
) -> None:
    first = next((s for s in sources if part_path(*_at(s, table)).exists()), None)
    if first is None:
        return
    described = part_schema(*_at(first, table))
    metadata = {**(described.metadata or {}), REPLACES: ",".join(replaces).encode()}
    described = described.with_metadata(metadata)
    path.parent.mkdir(exist_ok=True)
    with ExitStack() as stack:
        file = stack.enter_context(Draft(path))
        writer = stack.enter_context(pq.ParquetWriter(file, described, compression="zstd"))
        for rows in _chunks(table, owners, order):
            writer.write_table(rows.cast(described))


def _chunks(table: str, owners: Mapping[int, Source], order: Sequence[int]) -> Iterator[pa.Table]:
    # Neighbouring chunks share their parts, which are read again only when others came between.
    read = lru_cache(maxsize=4)(lambda source: read_part(*_at(source, table)))
    for start in range(0, len(order), MISSIONS_AT_A_TIME):
        numbers = order[start : start + MISSIONS_AT_A_TIME]
        wanted: dict[Source, list[int]] = {}
        for number in numbers:
            wanted.setdefault(owners[number], []).append(number)
        pieces = []
        for source, mine in wanted.items():
            rows = read(source)
            if rows is not None:
                pieces.append(rows.filter(pc.is_in(rows["mission"], arrow(mine, pa.int64()))))
        if pieces:
            yield in_order(pa.concat_tables(pieces))
