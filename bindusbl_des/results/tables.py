"""Result tables: the rows of a mission as Arrow tables whose columns say what they are."""

import types
from collections.abc import Mapping, Sequence
from dataclasses import Field, fields
from functools import cache, lru_cache
from operator import attrgetter
from typing import Any, get_args, get_type_hints

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from ..records.events import (
    OUTCOMES,
    AuvMetrics,
    Broadcast,
    Fix,
    Ping,
    Reception,
    Round,
    TrackPoint,
    Utilisation,
)
from ..records.frames import Assignment, FrameReception
from ..records.rows import NONE, Rows
from ..records.worst import WORST_IS_LARGEST
from .batches import (
    COLUMN,
    FLOATS,
    NUMBERED,
    WHOLES,
    WHOLES_OR_NULL,
    WORD,
    WORDS,
    Batch,
    Message,
    Words,
    message_of,
    words_of,
)

ROWS: dict[str, type] = {
    "rounds": Round,
    "pings": Ping,
    "receptions": Reception,
    "broadcasts": Broadcast,
    "frame_receptions": FrameReception,
    "assignments": Assignment,
    "fixes": Fix,
    "tracks": TrackPoint,
    "auvs": AuvMetrics,
}
EVENT_TABLES = (
    *("rounds", "pings", "receptions", "broadcasts", "frame_receptions", "assignments"),
    *("fixes", "tracks"),
)
TABLES = (*ROWS, "mission")

# Columns that hold a vehicle's number in the record and its name in the table.
VEHICLES = {"auv": "AUV", "asv": "ASV", "broadcast_by": "ASV", "called_by": "ASV", "told_by": "ASV"}

SURVEY_FRAME = "survey: x north, y east, z down from the surface, origin as in the scenario"
SCHEMA_VERSION = 1

ARROW_TYPES = {int: pa.int64(), float: pa.float64(), str: pa.string()}


def _arrow_type(row: type, name: str) -> pa.DataType:
    if name in VEHICLES:
        return pa.string()
    hint = get_type_hints(row)[name]
    if isinstance(hint, types.UnionType):
        hint = next(arg for arg in get_args(hint) if arg is not type(None))
    return ARROW_TYPES[hint]


def _field(name: str, kind: pa.DataType, unit: str, meaning: str) -> pa.Field:
    metadata = {"unit": unit, "meaning": meaning}
    if name.endswith(("x_m", "y_m", "z_m", "_m2", "yaw_rad")):
        metadata["frame"] = SURVEY_FRAME
    return pa.field(name, kind, metadata=metadata)


@cache
def schema(table: str) -> pa.Schema:
    """Return the Arrow schema of a table, each field with unit, meaning and frame."""
    if table == "mission":
        own = {column.name: column for column in fields(Utilisation)}
        metrics = fields(AuvMetrics)[1:]
        return pa.schema(
            [_described(c, pa.float64(), "fleet mean of: ") for c in metrics if c.name not in own]
            + [_described(c, _arrow_type(Utilisation, c.name)) for c in own.values()]
            + [field for c in metrics if c.name in WORST_IS_LARGEST for field in _worst(c)]
        )
    row = ROWS[table]
    return pa.schema([_described(c, _arrow_type(row, c.name)) for c in fields(row)])


def _described(column: "Field[Any]", kind: pa.DataType, prefix: str = "") -> pa.Field:
    return _field(column.name, kind, column.metadata["unit"], prefix + column.metadata["meaning"])


def _worst(column: "Field[Any]") -> tuple[pa.Field, pa.Field]:
    """Return the two columns of a metric's worst AUV."""
    name, unit, meaning = column.name, column.metadata["unit"], column.metadata["meaning"]
    which = "null where the AUV named beside it has none"
    return (
        _field(f"worst_{name}", pa.float64(), unit, f"the worst AUV's: {meaning}; {which}"),
        _field(f"worst_{name}_auv", pa.string(), "", f"AUV with the worst {name}"),
    )


@cache
def never_null(table: str) -> frozenset[str]:
    """Return the columns of a table that have a value in every row."""
    hints = get_type_hints(ROWS.get(table, Utilisation))
    return frozenset(name for name, hint in hints.items() if not isinstance(hint, types.UnionType))


def mission_numbers() -> list[str]:
    """Return the metrics of a mission that are numbers: all but the names of AUVs."""
    return [field.name for field in schema("mission") if field.type != pa.string()]


def from_rows(table: str, rows: Sequence[Any]) -> pa.Table:
    """Return the rows of a table, objects with its columns, as an Arrow table; None becomes null.

    Vehicles are numbers.
    """
    numbers, words = _numbered(table, list(map(attrgetter(*schema(table).names), rows)))
    return from_numbers(table, numbers, words=words)


def numbers_of(table: str, rows: Sequence[Any]) -> Rows:
    """Return the rows of a table without words as :func:`from_numbers` takes them."""
    return _numbered(table, list(map(attrgetter(*schema(table).names), rows)))[0]


def from_columns(table: str, columns: Mapping[str, Sequence[Any]]) -> pa.Table:
    """Return columns of equal length as :func:`from_rows` does; a missing column is all null."""
    nothing = [None] * len(next(iter(columns.values())))
    named = (columns.get(name, nothing) for name in schema(table).names)
    numbers, words = _numbered(table, list(zip(*named, strict=True)))
    return from_numbers(table, numbers, words=words)


def _numbered(table: str, rows: Sequence[tuple[Any, ...]]) -> tuple[Rows, tuple[str, ...]]:
    """Return rows as numbers, and the words that some of these count in, as they come up."""
    words, counted = dict[str, int](), _counted(table)
    numbers = np.empty(len(rows), dtype=_numbers(table))
    names = (numbers.dtype.names or ()) if rows else ()
    for place, (name, column) in enumerate(zip(names, zip(*rows, strict=True), strict=True)):
        if counted.get(place) == WORDS:
            numbers[name] = [
                NONE if it is None else words.setdefault(it, len(words)) for it in column
            ]
        elif place in counted:
            numbers[name] = [NONE if it is None else it for it in column]
        else:
            numbers[name] = column
    return numbers, tuple(words)


@cache
def _numbers(table: str) -> np.dtype[np.void]:
    """Return the record of a row whose words and names are numbers."""
    kinds = ("f8" if field.type == pa.float64() else "i8" for field in schema(table))
    return np.dtype(list(zip(schema(table).names, kinds, strict=True)))


@cache
def _counted(table: str) -> dict[int, int]:
    """Return the places of columns that hold words, WORDS, or no whole number in some rows."""
    found = {}
    for place, field in enumerate(schema(table)):
        if field.type == pa.string() and not _prefix(field.name):
            found[place] = WORDS
        elif field.type != pa.float64() and field.name not in never_null(table):
            found[place] = WHOLES_OR_NULL
    return found


def from_numbers(table: str, *parts: Rows, words: tuple[str, ...] = OUTCOMES) -> pa.Table:
    """Return the rows of one or two buffers side by side, of numbers, as an Arrow table.

    Vehicles have their names; in other columns of text numbers count in `words`.  NaN becomes null,
    as does NONE where there may be no name or whole number.
    """
    dtypes = tuple([part.dtype for part in parts])
    under_way = begun(table, len(parts[0]), *dtypes, words=words)
    under_way.write(*parts)
    return under_way.table()


def begun(
    table: str, rows: int, *dtypes: np.dtype[np.void], words: tuple[str, ...] = OUTCOMES
) -> Batch:
    """Return room for the rows of a table, to be written as :func:`from_numbers` has them."""
    described, message = _described_as(table)
    return Batch(described, message, _columns(table, dtypes), _spelt(words), rows)


@cache
def _described_as(table: str) -> tuple[pa.Schema, Message]:
    return schema(table), message_of(schema(table))


@lru_cache(maxsize=8)
def _spelt(words: tuple[str, ...]) -> Words:
    return words_of(("AUV", "ASV", *words))


@cache
def _columns(table: str, parts: tuple[np.dtype[np.void], ...]) -> Rows:
    """Return where the columns of a table are in the records of its parts (:data:`COLUMN`)."""
    columns = np.empty(len(schema(table)), dtype=COLUMN)
    for column, field in zip(columns, schema(table), strict=True):
        part = next(k for k, of in enumerate(parts) if field.name in (of.names or ()))
        found = parts[part].fields
        assert found is not None  # as it has names
        column["part"], column["place"] = part, found[field.name][1] // WORD
        prefix = _prefix(field.name)
        if field.type == pa.string():
            column["kind"] = NUMBERED if prefix else WORDS
            column["word"] = int(prefix == "ASV") if prefix else 2  # behind the prefixes
        elif field.type == pa.float64():
            column["kind"] = FLOATS
        else:
            column["kind"] = WHOLES if field.name in never_null(table) else WHOLES_OR_NULL
    return columns


def _prefix(column: str) -> str:
    """Return what the names of a column's vehicles begin with; empty where it has none."""
    return VEHICLES.get(column, "AUV" if column.endswith("_auv") else "")


def write_parquet(table: pa.Table, name: str, path: Any, origin: Mapping[str, str]) -> None:
    """Write one table as Parquet (zstd); `origin` (scenario hash, seed) goes into its metadata."""
    metadata = {"bindusbl.schema": f"{name}/{SCHEMA_VERSION}", **origin}
    pq.write_table(
        table.replace_schema_metadata(metadata),
        path,
        compression="zstd",
        use_dictionary=[f.name for f in table.schema if f.type == pa.string()],
        write_page_checksum=True,  # so that damage is found, not read
    )


def data_dictionary() -> dict[str, dict[str, dict[str, str]]]:
    """Return type, unit, meaning and frame of every column of every table."""
    return {
        table: {
            field.name: {
                "type": str(field.type),
                **{k.decode(): v.decode() for k, v in (field.metadata or {}).items()},
            }
            for field in schema(table)
        }
        for table in TABLES
    }
