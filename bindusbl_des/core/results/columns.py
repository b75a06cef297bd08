"""Columns of Arrow tables, from numpy and back, without pandas or Arrow's compute library.

`pyarrow.array` loads pandas to check for a Series, and a cast loads the compute library: half a
second in every run and every worker.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray


def arrow(values: NDArray[Any] | Sequence[Any], kind: pa.DataType) -> pa.Array:
    """Return numbers or strings as an Arrow array; None and NaN become null."""
    if kind == pa.string():
        return _strings(list(values))
    numbers, missing = _numbers(values, numpy_type(kind))
    data = np.packbits(numbers, bitorder="little") if kind == pa.bool_() else numbers
    validity = None if missing is None else _validity(missing)
    return pa.Array.from_buffers(kind, len(numbers), [validity, pa.py_buffer(data)])


def _numbers(
    values: NDArray[Any] | Sequence[Any], kind: Any
) -> tuple[NDArray[Any], NDArray[np.bool_] | None]:
    """Return values as an array of a type, and a mask of the missing ones, if any."""
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
    encoded = [b"" if value is None else value.encode() for value in values]
    ends = np.cumsum([0, *map(len, encoded)], dtype=np.int32)
    missing = np.array([value is None for value in values], dtype=np.bool_)
    buffers = [_validity(missing), pa.py_buffer(ends), pa.py_buffer(b"".join(encoded))]
    return pa.Array.from_buffers(pa.string(), len(encoded), buffers)


def spelt(words: Sequence[str], codes: NDArray[np.int64]) -> pa.Array:
    """Return a column of words by their indices (n,) in `words`; -1 is null.

    Words are short and without NUL: for a moment each row is as long as the longest.
    """
    encoded = np.array([*(word.encode() for word in words), b""])  # the last for what is null
    ends = np.zeros(len(codes) + 1, dtype=np.int32)
    np.cumsum(np.char.str_len(encoded)[codes], out=ends[1:])
    letters = encoded[codes].view(np.uint8)
    buffers = [_validity(codes < 0), pa.py_buffer(ends), pa.py_buffer(letters[letters != 0])]
    return pa.Array.from_buffers(pa.string(), len(codes), buffers)


def _validity(missing: NDArray[np.bool_]) -> pa.Buffer | None:
    if not missing.any():
        return None
    return pa.py_buffer(np.packbits(~missing, bitorder="little"))


def numpy_columns(table: pa.Table) -> dict[str, NDArray[Any]]:
    """Return a table's columns as arrays, reversing :func:`arrow`: null is NaN, or None in strings.

    Whole numbers stay whole where none is missing.
    """
    return {field.name: numpy_array(table[field.name].combine_chunks()) for field in table.schema}


def numpy_type(kind: pa.DataType) -> np.dtype[Any]:
    """Return the numpy type of numbers in Arrow, whose names for types are numpy's.

    Arrow's own `to_pandas_dtype` loads pandas in older versions.
    """
    return np.dtype(str(kind))


def numpy_array(array: pa.Array | pa.ChunkedArray) -> NDArray[Any]:
    """Return one column as an array, as :func:`numpy_columns` does."""
    kind = array.type
    if kind == pa.string() or isinstance(array, pa.ChunkedArray) or not len(array):
        values = array.to_pylist()
        return np.array(values, dtype=object if kind == pa.string() else numpy_type(kind))
    validity, numbers = array.buffers()
    section = slice(array.offset, array.offset + len(array))
    plain: NDArray[Any] = np.frombuffer(numbers, dtype=numpy_type(kind))[section]
    if not array.null_count:
        return plain
    known = np.unpackbits(np.frombuffer(validity, dtype=np.uint8), bitorder="little")[section]
    return np.where(known.astype(bool), plain, np.nan)
