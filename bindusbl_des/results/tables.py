"""Tables of a mission: what was recorded, as Arrow tables whose columns say what they are."""

from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from operator import attrgetter
from typing import Any

import numpy as np
import pyarrow as pa

from ..core.arrays import Ints
from ..records.events import OUTCOMES
from ..records.rows import NONE, Rows
from .columns import spelt
from .schemas import VEHICLES, schema

WORD = 8  # bytes of a number

# So many rows become columns at a time: of large fleets the tracks are all there twice otherwise.
BLOCK = 65_536


def from_numbers(table: str, *parts: Rows, words: Sequence[str] = OUTCOMES) -> pa.Table:
    """Return the rows of one or two buffers side by side, of numbers, as an Arrow table.

    Vehicles have their names; in other columns of text numbers count in `words`.  NaN and NONE
    become null.
    """
    batches = [
        _batch(table, [part[begin : begin + BLOCK] for part in parts], words)
        for begin in range(0, max(len(parts[0]), 1), BLOCK)
    ]
    return pa.Table.from_batches(batches)


def _batch(table: str, parts: Sequence[Rows], words: Sequence[str]) -> pa.RecordBatch:
    """Return rows as :func:`from_numbers` does, as one batch."""
    rows, columns = len(parts[0]), dict[str, pa.Array]()
    numbers = {name: its_own for part in parts for name, *its_own in _columns(part)}
    for prefix, names in _texts(table).items():  # all at once: most tables are short
        codes = np.concatenate([numbers[name][0] for name in names])
        vehicles = range(codes.max(initial=NONE) + 1)
        text = spelt([f"{prefix}{number}" for number in vehicles] if prefix else words, codes)
        columns |= {name: text.slice(k * rows, rows) for k, name in enumerate(names)}
    for name, kind in _kinds(table).items():
        if name not in columns:
            its_own, known = numbers[name]
            columns[name] = pa.Array.from_buffers(kind, rows, [known, pa.py_buffer(its_own)])
    arrays = [columns[name] for name in _kinds(table)]
    return pa.RecordBatch.from_arrays(arrays, schema=schema(table))


def _columns(part: Rows) -> Iterator[tuple[str, Ints, pa.Buffer | None]]:
    """Yield the fields of records: name, numbers (n,) seen as whole ones, and the bits of those
    that are known, None where all are.
    """
    words: Any = np.ascontiguousarray(part).view(np.int64)
    numbers = words.reshape(len(part), part.dtype.itemsize // WORD).T.copy()  # the buffer is reused
    known = ~np.isnan(numbers.view(np.float64))  # NONE has the bits of a NaN, too
    bits = np.packbits(known, axis=1, bitorder="little")
    complete: list[bool] = np.logical_and.reduce(known, axis=1).tolist()
    for name, (_, offset, *_) in (part.dtype.fields or {}).items():
        k = offset // WORD
        yield name, numbers[k], None if complete[k] else pa.py_buffer(bits[k])


def from_rows(table: str, rows: Sequence[Any]) -> pa.Table:
    """Return the rows of a table, objects with its columns, as an Arrow table; None becomes null.

    Vehicles are numbers.
    """
    numbers, words = _numbered(table, list(map(attrgetter(*_kinds(table)), rows)))
    return from_numbers(table, numbers, words=words)


def from_row(table: str, row: Mapping[str, Any]) -> pa.Table:
    """Return the one row of a table as :func:`from_rows` does; a missing column is null."""
    numbers, words = _numbered(table, [tuple(row.get(name) for name in _kinds(table))])
    return from_numbers(table, numbers, words=words)


def numbers_of(table: str, rows: Sequence[Any]) -> Rows:
    """Return the rows of a table without words as :func:`from_numbers` takes them."""
    return _numbered(table, list(map(attrgetter(*_kinds(table)), rows)))[0]


def _numbered(table: str, rows: Sequence[tuple[Any, ...]]) -> tuple[Rows, list[str]]:
    """Return rows as numbers, and the words that some of these count in, as they come up."""
    words, kinds, counted = dict[str, int](), _kinds(table), _texts(table).get("", ())
    numbers = np.empty(
        len(rows), [(name, "f8" if kind == pa.float64() else "i8") for name, kind in kinds.items()]
    )
    for (name, kind), column in zip(kinds.items(), zip(*rows, strict=True), strict=bool(rows)):
        if name in counted:
            codes = [
                NONE if value is None else words.setdefault(value, len(words)) for value in column
            ]
            numbers[name] = codes
        elif kind == pa.float64():
            numbers[name] = column
        else:
            numbers[name] = [NONE if value is None else value for value in column]
    return numbers, list(words)


@cache
def _kinds(table: str) -> dict[str, pa.DataType]:
    """Return the types of a table's columns."""
    return {field.name: field.type for field in schema(table)}


@cache
def _texts(table: str) -> dict[str, list[str]]:
    """Return the columns of text by what their vehicles' names begin with; by "" those of words."""
    texts = dict[str, list[str]]()
    for name, kind in _kinds(table).items():
        if kind == pa.string():
            prefix = VEHICLES.get(name, "AUV" if name.endswith("_auv") else "")
            texts.setdefault(prefix, []).append(name)
    return texts
