"""What the columns of the result tables are: type, unit, meaning and frame.

Columns of Arrow tables, from numpy and back, without pandas or Arrow's compute library.

`pyarrow.array` loads pandas to see whether it was given a Series, a cast loads the compute library:
half a second in every run and every worker.

Tables as pandas frames: each is made when it is first asked for, and kept.
"""

import types
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import Field, fields
from functools import cache
from typing import TYPE_CHECKING, Any, get_args, get_type_hints

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from ..core.wording import did_you_mean
from ..records.events import (
    Assignment,
    Broadcast,
    Fix,
    FrameReception,
    GnssFix,
    Ping,
    Reception,
    Round,
    TrackPoint,
)
from ..records.metrics import WORST_IS_LARGEST, AuvMetrics, Utilisation


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
    words = dict[str, int]()
    codes = [-1 if value is None else words.setdefault(value, len(words)) for value in values]
    return spelt(list(words), np.array(codes, dtype=np.int64))


def spelt(words: Sequence[str], codes: NDArray[np.int64]) -> pa.Array:
    """Return words by their numbers, one in each row; -1 is null."""
    encoded = [*(word.encode() for word in words), b""]  # the last for what is null
    lengths = np.array([len(word) for word in encoded])
    own = lengths[codes]
    ends = np.concatenate(([0], np.cumsum(own)))
    begins = (np.cumsum(lengths) - lengths)[codes]
    letters = np.frombuffer(b"".join(encoded), dtype=np.uint8)
    each = letters[np.repeat(begins - ends[:-1], own) + np.arange(ends[-1])]
    buffers = [_validity(codes < 0), pa.py_buffer(ends.astype(np.int32)), pa.py_buffer(each)]
    return pa.Array.from_buffers(pa.string(), len(codes), buffers)


def _validity(missing: NDArray[np.bool_]) -> pa.Buffer | None:
    if not missing.any():
        return None
    return pa.py_buffer(np.packbits(~missing, bitorder="little"))


def numpy_columns(table: pa.Table) -> dict[str, NDArray[Any]]:
    """Return the columns of a table, in reverse of :func:`arrow`: null is NaN, or None in strings.

    Whole numbers stay whole where none is missing.  Without pandas, for the same reason.
    """
    return {field.name: numpy_array(table[field.name].combine_chunks()) for field in table.schema}


def numpy_type(kind: pa.DataType) -> np.dtype[Any]:
    """Return the numpy type of numbers, which Arrow calls as numpy does.

    Its own answer, `to_pandas_dtype`, loads pandas in older versions.
    """
    return np.dtype(str(kind))


def numpy_array(array: pa.Array | pa.ChunkedArray) -> NDArray[Any]:
    """Return one column as :func:`numpy_columns` does."""
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


ROWS: dict[str, type] = {
    "rounds": Round,
    "pings": Ping,
    "receptions": Reception,
    "broadcasts": Broadcast,
    "frame_receptions": FrameReception,
    "assignments": Assignment,
    "fixes": Fix,
    "gnss_fixes": GnssFix,
    "tracks": TrackPoint,
    "auvs": AuvMetrics,
}
EVENT_TABLES = (
    *("rounds", "pings", "receptions", "broadcasts", "frame_receptions", "assignments"),
    *("fixes", "gnss_fixes", "tracks"),
)
# What only missions have in which AUVs carry GNSS (navigation.gnss_fix).
BY_GNSS = "gnss_fixes"
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


if TYPE_CHECKING:
    import pandas as pd


class PandasTables(Mapping[str, "pd.DataFrame"]):
    """Arrow tables by name, as pandas frames.

    Who asks for metrics alone does not wait for all receptions to be turned into a frame.
    """

    def __init__(self, arrow: Mapping[str, pa.Table]) -> None:
        self._arrow = arrow
        self._made: dict[str, pd.DataFrame] = {}

    def __getitem__(self, name: str) -> "pd.DataFrame":
        if name not in self._arrow:
            meant = did_you_mean(name, self) or f"; there are {', '.join(self)}"
            raise KeyError(f"no table {name!r}{meant}")
        if name not in self._made:
            self._made[name] = self._arrow[name].to_pandas()
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrow)

    def __len__(self) -> int:
        return len(self._arrow)

    def __repr__(self) -> str:
        return f"<pandas tables {', '.join(self)}>"
