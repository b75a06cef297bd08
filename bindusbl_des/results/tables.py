"""Result tables: the rows of a mission as Arrow tables whose columns say what they are."""

import types
from collections.abc import Mapping, Sequence
from dataclasses import Field, fields
from functools import cache
from operator import attrgetter
from typing import Any, get_args, get_type_hints

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

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
from .arrow import arrow, named

Floats = NDArray[np.float64]

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


def from_numbers(
    table: str, columns: Rows | Mapping[str, NDArray[Any]], **labels: Sequence[str]
) -> pa.Table:
    """Return the rows of a buffer, all columns numbers, as an Arrow table with names for labels.

    Vehicles and outcomes have theirs; in other columns of text numbers count in `labels`.  NaN
    becomes null, as does NONE in columns of text.
    """
    described = schema(table)
    arrays = []
    for field in described:
        values = columns[field.name]
        if field.type != pa.string():
            arrays.append(arrow(values, field.type))
        elif field.name in VEHICLES:
            most = int(np.max(values, initial=NONE))
            arrays.append(named(values, [f"{VEHICLES[field.name]}{n}" for n in range(most + 1)]))
        else:
            arrays.append(named(values, labels.get(field.name, OUTCOMES)))
    return pa.Table.from_arrays(arrays, schema=described)


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
