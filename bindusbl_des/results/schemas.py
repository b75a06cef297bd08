"""What the columns of the result tables are: type, unit, meaning and frame."""

import types
from dataclasses import Field, fields
from functools import cache
from typing import Any, get_args, get_type_hints

import pyarrow as pa

from ..records.events import (
    Assignment,
    Broadcast,
    Fix,
    FrameReception,
    GnssFix,
    PeerRange,
    Ping,
    Reception,
    Round,
    Signal,
    SignalReception,
    TrackPoint,
)
from ..records.metrics import WORST_IS_LARGEST, AuvMetrics, Utilisation

ROWS: dict[str, type] = {
    "rounds": Round,
    "pings": Ping,
    "receptions": Reception,
    "broadcasts": Broadcast,
    "frame_receptions": FrameReception,
    "assignments": Assignment,
    "fixes": Fix,
    "gnss_fixes": GnssFix,
    "signals": Signal,
    "signal_receptions": SignalReception,
    "peer_ranges": PeerRange,
    "tracks": TrackPoint,
    "auvs": AuvMetrics,
}
EVENT_TABLES = (
    *("rounds", "pings", "receptions", "broadcasts", "frame_receptions", "assignments"),
    *("fixes", "gnss_fixes", "signals", "signal_receptions", "peer_ranges", "tracks"),
)
# What only missions have in which AUVs carry GNSS (navigation.gnss_fix), vehicles hear each other
# by programs (protocol.access), or AUVs range each other (navigation.peers).
SOMETIMES = ("gnss_fixes", "signals", "signal_receptions", "peer_ranges")
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
