"""Tables of a mission: the recorded rows as Arrow tables, with unit and meaning of each column."""

from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from operator import attrgetter
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from ...support.arrays import Ints
from ..records.events import WORDS
from ..records.rows import NONE, Rows
from .columns import spelt
from .schemas import VEHICLES, schema

WORD = 8  # bytes of a number
FLOAT, TEXT = str(pa.float64()), str(pa.string())

# Rows converted at a time, so that memory does not hold the tracks of a large fleet twice.
BLOCK = 65_536

Columns = Mapping[str, NDArray[Any]]


def from_numbers(
    table: str, rows: Rows, own: Columns | None = None, words: Sequence[str] = WORDS
) -> pa.Table:
    """Return recorded rows, all numbers, as an Arrow table.

    `own` has columns that the rows lack.  A vehicle's number becomes its name; a number in any
    other text column is an index in `words`.  NaN and NONE become null.
    """
    batches = []
    for begin in range(0, max(len(rows), 1), BLOCK):
        block = slice(begin, begin + BLOCK)
        beside = {name: column[block] for name, column in (own or {}).items()}
        batches.append(_batch(table, rows[block], beside, words))
    return pa.Table.from_batches(batches)


def _batch(table: str, rows: Rows, own: Columns, words: Sequence[str]) -> pa.RecordBatch:
    """Return one batch of the rows of :func:`from_numbers`."""
    count, kinds = len(rows), _kinds(table)
    recorded: Any = np.ascontiguousarray(rows).view(np.int64)
    recorded = recorded.reshape(count, rows.dtype.itemsize // WORD)
    places, lacking = _places(table, rows.dtype)
    numbers: Ints = recorded.T[places]  # a copy: the buffer is reused
    for place, name in lacking:
        numbers[place] = own[name].view(np.int64)
    known = ~np.isnan(numbers.view(np.float64))  # NONE has the bits of a NaN, too
    buffers = [pa.py_buffer(np.packbits(known, bitorder="little")), pa.py_buffer(numbers)]
    floats = pa.Array.from_buffers(pa.float64(), numbers.size, buffers)
    wholes = pa.Array.from_buffers(pa.int64(), numbers.size, buffers)
    arrays = [
        (floats if kind == FLOAT else wholes).slice(place * count, count)
        for place, kind in enumerate(kinds.values())
    ]
    text = _spelt(numbers[list(_texts(table))], _texts(table).values(), words)
    for k, place in enumerate(_texts(table)):
        arrays[place] = text.slice(k * count, count)
    return pa.RecordBatch.from_arrays(arrays, schema=schema(table))


def _spelt(codes: Ints, prefixes: Iterable[str], words: Sequence[str]) -> pa.Array:
    """Return text columns, one after the other, from numbers (k, n).

    Numbers are indices in `words`, or, in a column with a prefix, of vehicles, whose names begin
    with it.
    """
    known, vehicles = list(words), range(codes.max(initial=NONE) + 1)
    begins = {"": 0}
    for prefix in sorted(set(prefixes) - {""}):
        begins[prefix] = len(known)
        known += [f"{prefix}{number}" for number in vehicles]
    begin = np.array([begins[prefix] for prefix in prefixes], dtype=np.int64)[:, np.newaxis]
    return spelt(known, np.where(codes == NONE, NONE, begin + codes).reshape(-1))


def from_rows(table: str, rows: Sequence[Any]) -> pa.Table:
    """Return rows, objects with a table's columns, as an Arrow table; None becomes null.

    Vehicles are numbers.
    """
    numbers, words = _numbered(table, list(map(attrgetter(*_kinds(table)), rows)))
    return from_numbers(table, numbers, words=words)


def from_row(table: str, row: Mapping[str, Any]) -> pa.Table:
    """Return the one row of a table as :func:`from_rows` does; a missing column is null."""
    numbers, words = _numbered(table, [tuple(map(row.get, _kinds(table)))])
    return from_numbers(table, numbers, words=words)


def numbers_of(table: str, rows: Sequence[Any]) -> Rows:
    """Return rows of a table without words as numbers, as :func:`from_numbers` takes them."""
    return _numbered(table, list(map(attrgetter(*_kinds(table)), rows)))[0]


def _numbered(table: str, rows: Sequence[tuple[Any, ...]]) -> tuple[Rows, list[str]]:
    """Return rows as numbers, and the words of text columns in the order of their first use."""
    words, texts = dict[str, int](), _texts(table)
    columns: list[Sequence[Any]] = list(zip(*rows, strict=True))
    for place, kind in enumerate(_kinds(table).values() if rows else ()):
        if texts.get(place) == "":
            columns[place] = [
                NONE if word is None else words.setdefault(word, len(words))
                for word in columns[place]
            ]
        elif kind != FLOAT and None in columns[place]:
            columns[place] = [NONE if value is None else value for value in columns[place]]
    return np.array(list(zip(*columns, strict=True)), _row_type(table)), list(words)


@cache
def _kinds(table: str) -> dict[str, str]:
    """Return the types of a table's columns, by their names."""
    return {field.name: str(field.type) for field in schema(table)}


@cache
def _row_type(table: str) -> np.dtype[np.void]:
    """Return the record type of a table's rows, in which names and words are numbers."""
    kinds = _kinds(table).items()
    return np.dtype([(name, "f8" if kind == FLOAT else "i8") for name, kind in kinds])


@cache
def _places(table: str, recorded: np.dtype[np.void]) -> tuple[Ints, list[tuple[int, str]]]:
    """Return the offset, in words, of each column in a recorded row; and the columns it lacks."""
    offsets = {name: offset for name, (_, offset, *_) in (recorded.fields or {}).items()}
    lacking = [(place, name) for place, name in enumerate(_kinds(table)) if name not in offsets]
    return np.array([offsets.get(name, 0) // WORD for name in _kinds(table)]), lacking


@cache
def _texts(table: str) -> dict[int, str]:
    """Return the text columns by index, with the prefix of a vehicle's name, or "" for words."""
    return {
        place: VEHICLES.get(name, "AUV" if name.endswith("_auv") else "")
        for place, (name, kind) in enumerate(_kinds(table).items())
        if kind == TEXT
    }
