"""Result tables: the rows of a mission as Arrow tables whose columns say what they are."""

from collections.abc import Mapping, Sequence
from functools import cache, lru_cache
from operator import attrgetter
from typing import Any

import numpy as np
import pyarrow as pa

from ..records.events import OUTCOMES
from ..records.rows import NONE, Rows
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
from .schemas import VEHICLES, never_null, schema


def from_rows(table: str, rows: Sequence[Any]) -> pa.Table:
    """Return the rows of a table, objects with its columns, as an Arrow table; None becomes null.

    Vehicles are numbers.
    """
    if not rows:
        return _nothing(table)
    numbers, words = _numbered(table, list(map(attrgetter(*schema(table).names), rows)))
    return from_numbers(table, numbers, words=words)


@cache
def _nothing(table: str) -> pa.Table:
    return from_numbers(table, np.empty(0, dtype=_numbers(table)))


def numbers_of(table: str, rows: Sequence[Any]) -> Rows:
    """Return the rows of a table without words as :func:`from_numbers` takes them."""
    return _numbered(table, list(map(attrgetter(*schema(table).names), rows)))[0]


def from_row(table: str, row: Mapping[str, Any]) -> pa.Table:
    """Return the one row of a table without words as :func:`from_rows` does; a missing column is
    null.
    """
    kind, counted = _numbers(table), _counted(table)
    values = [row.get(name) for name in kind.names or ()]
    for place in counted:
        if values[place] is None:
            values[place] = NONE
    return from_numbers(table, np.array([tuple(values)], dtype=kind))


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
