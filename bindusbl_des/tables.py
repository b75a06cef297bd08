"""Result tables: the rows of a mission as Arrow tables whose columns say what they are."""

import types
from collections.abc import Mapping, Sequence
from dataclasses import Field, fields
from functools import cache
from math import isnan
from operator import attrgetter
from typing import Any, get_args, get_type_hints

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from .compiled import compiled
from .events import (
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

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Ends = NDArray[np.int32]
Bytes = NDArray[np.uint8]

ROWS: dict[str, type] = {
    "rounds": Round,
    "pings": Ping,
    "receptions": Reception,
    "broadcasts": Broadcast,
    "fixes": Fix,
    "tracks": TrackPoint,
    "auvs": AuvMetrics,
}
EVENT_TABLES = ("rounds", "pings", "receptions", "broadcasts", "fixes", "tracks")
TABLES = (*ROWS, "mission")

# Columns that hold a vehicle's number in the record and its name in the table.
VEHICLES = {"auv": "AUV", "asv": "ASV", "broadcast_by": "ASV"}

SURVEY_FRAME = "survey: x along the lanes, y across, z down, origin at the centre of the surface"
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
        means = [c for c in fields(AuvMetrics)[1:] if c.name not in own]
        return pa.schema(
            [_described(c, pa.float64(), "fleet mean of: ") for c in means]
            + [_described(c, _arrow_type(Utilisation, c.name)) for c in own.values()]
        )
    row = ROWS[table]
    return pa.schema([_described(c, _arrow_type(row, c.name)) for c in fields(row)])


def _described(column: "Field[Any]", kind: pa.DataType, prefix: str = "") -> pa.Field:
    return _field(column.name, kind, column.metadata["unit"], prefix + column.metadata["meaning"])


def from_rows(table: str, rows: Sequence[Any]) -> pa.Table:
    """Return the rows of an event table as an Arrow table; vehicle numbers become names."""
    described = schema(table)
    arrays = []
    for field in described:
        values = list(map(attrgetter(field.name), rows))
        if field.name in VEHICLES:
            prefix = VEHICLES[field.name]
            names = {n: None if n is None else f"{prefix}{n}" for n in set(values)}
            values = [names[n] for n in values]
        arrays.append(arrow(values, field.type))
    return pa.Table.from_arrays(arrays, schema=described)


def from_numbers(table: str, rows: Floats, **labels: Sequence[str]) -> pa.Table:
    """Return the rows of a ledger, all columns numbers, as an Arrow table with names for labels.

    Vehicles and outcomes have theirs; in other columns of text numbers count in `labels`.
    """
    described = schema(table)
    arrays = []
    for field, values in zip(described, rows.T, strict=True):
        if field.type != pa.string():
            arrays.append(arrow(values, field.type))
        elif field.name in VEHICLES:
            most = int(np.fmax.reduce(values, initial=-1))
            arrays.append(_named(values, [f"{VEHICLES[field.name]}{n}" for n in range(most + 1)]))
        else:
            arrays.append(_named(values, labels.get(field.name, OUTCOMES)))
    return pa.Table.from_arrays(arrays, schema=described)


def _named(values: Floats, names: Sequence[str]) -> pa.Array:
    """Return the names that numbers count in, as Arrow strings; NaN becomes null.

    Not by casting Arrow's own dictionaries, which takes a tenth of a second to load.
    """
    letters = np.array([name.encode() for name in names] or [b"-"])
    width = letters.dtype.itemsize
    ends = np.zeros(len(values) + 1, dtype=np.int32)
    text = np.empty(len(values) * width, dtype=np.uint8)
    spelt = letters.view(np.uint8).reshape(-1, width)
    length = _spell(values, spelt, np.array(list(map(len, names)), dtype=np.int64), ends, text)
    return _string_array(np.isnan(values), ends, text[:length])


@compiled
def _spell(values: Floats, spelt: Bytes, lengths: Ints, ends: Ends, text: Bytes) -> int:
    """Write names one after the other, and where each ends; return how long the text is."""
    length = 0
    for k in range(values.size):
        if not isnan(values[k]):
            name = int(values[k])
            for letter in range(lengths[name]):
                text[length + letter] = spelt[name, letter]
            length += lengths[name]
        ends[k + 1] = length
    return length


def arrow(values: NDArray[Any] | Sequence[Any], kind: pa.DataType) -> pa.Array:
    """Return numbers or strings as an Arrow array; None and NaN become null.

    Not by `pyarrow.array`, which loads pandas to see whether it was given a Series: a third of a
    second in every run and every worker.
    """
    if kind == pa.string():
        return _strings(list(values))
    numbers, missing = _numbers(values, kind.to_pandas_dtype())
    data = np.packbits(numbers, bitorder="little") if kind == pa.bool_() else numbers
    validity = None if missing is None else _validity(missing)
    return pa.Array.from_buffers(kind, len(numbers), [validity, pa.py_buffer(data)])


def _numbers(
    values: NDArray[Any] | Sequence[Any], kind: Any
) -> tuple[NDArray[Any], NDArray[np.bool_] | None]:
    """Return values as an array of a kind, and which of them are missing if any is."""
    missing = None
    if np.issubdtype(kind, np.floating):
        values = np.array(values, dtype=np.float64)  # None becomes NaN
    elif not isinstance(values, np.ndarray) and None in values:
        missing = np.array([value is None for value in values])
        values = [0 if value is None else value for value in values]
    elif not isinstance(values, np.ndarray):
        values = np.array(values, dtype=kind)  # whole numbers of any size
    if isinstance(values, np.ndarray) and values.dtype.kind == "f" and np.isnan(values).any():
        missing = np.isnan(values)
        values = np.where(missing, 0, values)
    return np.ascontiguousarray(values, dtype=kind), missing


def _strings(values: Sequence[str | None]) -> pa.Array:
    letters = {value: b"" if value is None else value.encode() for value in set(values)}
    encoded = [letters[value] for value in values]
    ends = np.cumsum([0, *map(len, encoded)], dtype=np.int32)
    missing = np.zeros(len(values), dtype=bool)
    if None in letters:
        missing[:] = [value is None for value in values]
    return _string_array(missing, ends, b"".join(encoded))


def _string_array(missing: NDArray[np.bool_], ends: Ends, text: bytes | Bytes) -> pa.Array:
    """Return strings that follow each other in a text, each up to its end."""
    buffers = [_validity(missing), pa.py_buffer(ends), pa.py_buffer(text)]
    return pa.Array.from_buffers(pa.string(), len(missing), buffers)


def _validity(missing: NDArray[np.bool_]) -> pa.Buffer | None:
    if not missing.any():
        return None
    return pa.py_buffer(np.packbits(~missing, bitorder="little"))


def numpy_columns(table: pa.Table) -> dict[str, NDArray[Any]]:
    """Return the columns of a table, in reverse of :func:`arrow`: null is NaN, or None in strings.

    Whole numbers stay whole where none is missing.  Without pandas, for the same reason.
    """
    return {
        field.name: _numpy(table[field.name].combine_chunks(), field.type) for field in table.schema
    }


def _numpy(array: pa.Array | pa.ChunkedArray, kind: pa.DataType) -> NDArray[Any]:
    if kind == pa.string() or isinstance(array, pa.ChunkedArray) or not len(array):
        values = array.to_pylist()
        return np.array(values, dtype=object if kind == pa.string() else kind.to_pandas_dtype())
    validity, numbers = array.buffers()
    section = slice(array.offset, array.offset + len(array))
    plain: NDArray[Any] = np.frombuffer(numbers, dtype=kind.to_pandas_dtype())[section]
    if not array.null_count:
        return plain
    known = np.unpackbits(np.frombuffer(validity, dtype=np.uint8), bitorder="little")[section]
    return np.where(known.astype(bool), plain, np.nan)


def from_columns(table: str, columns: Mapping[str, Any]) -> pa.Table:
    """Return columns (sequences or arrays) as an Arrow table; a missing column is all null."""
    described = schema(table)
    length = len(next(iter(columns.values())))
    arrays = [
        arrow(columns[field.name], field.type)
        if field.name in columns
        else pa.nulls(length, field.type)
        for field in described
    ]
    return pa.Table.from_arrays(arrays, schema=described)


def write_parquet(table: pa.Table, name: str, path: Any, origin: Mapping[str, str]) -> None:
    """Write one table as Parquet (zstd); `origin` (scenario hash, seed) goes into its metadata."""
    metadata = {"bindusbl.schema": f"{name}/{SCHEMA_VERSION}", **origin}
    pq.write_table(
        table.replace_schema_metadata(metadata),
        path,
        compression="zstd",
        use_dictionary=[f.name for f in table.schema if f.type == pa.string()],
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
