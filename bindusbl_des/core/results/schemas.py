"""The columns of the result tables: type, unit, meaning and frame of each."""

import types
from collections.abc import Callable, Collection, Mapping
from dataclasses import Field, fields
from functools import cache
from operator import attrgetter
from typing import Any, get_args, get_type_hints

import pyarrow as pa

from ..records.events import (
    Assignment,
    AuvFrame,
    AuvFrameReception,
    Broadcast,
    Fix,
    FixService,
    FrameReception,
    GnssFix,
    ModemLine,
    Packet,
    PeerRange,
    Ping,
    Reception,
    Round,
    Signal,
    SignalReception,
    TrackPoint,
)
from ..records.metrics import WORST_IS_LARGEST, AuvMetrics, Utilisation
from ..scenario.scenario import Scenario

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
    "packets": Packet,
    "auv_frames": AuvFrame,
    "auv_frame_receptions": AuvFrameReception,
    "peer_ranges": PeerRange,
    "modem_lines": ModemLine,
    "tracks": TrackPoint,
    "auvs": AuvMetrics,
}
EVENT_TABLES = (
    *("rounds", "pings", "receptions", "broadcasts", "frame_receptions", "assignments"),
    *("fixes", "gnss_fixes", "signals", "signal_receptions", "auv_frames", "auv_frame_receptions"),
    *("packets", "peer_ranges", "modem_lines", "tracks"),
)
# Tables that only some missions have, and which ones.
SOMETIMES: Mapping[str, Callable[[Scenario], bool]] = {
    "gnss_fixes": lambda scenario: scenario.navigation.gnss_fix is not None,
    "signals": attrgetter("has_signals"),
    "signal_receptions": attrgetter("has_signals"),
    "packets": lambda scenario: scenario.traffic is not None,
    "auv_frames": attrgetter("protocol.sends_auv_frames"),
    "auv_frame_receptions": attrgetter("protocol.sends_auv_frames"),
    "peer_ranges": attrgetter("has_peers"),
    "modem_lines": lambda scenario: scenario.modems is not None,
}
# Columns that only missions with acknowledged, repeated or relayed frames have.
FURTHER: dict[str, type] = {"fixes": FixService}
TABLES = (*ROWS, "mission")

# Columns that hold a vehicle's number in the record and its name in the table.
VEHICLES = {
    "auv": "AUV",
    **dict.fromkeys(("asv", "broadcast_by", "called_by", "told_by", "delivered_to"), "ASV"),
}

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


def schema(table: str, columns: Collection[str] | None = ()) -> pa.Schema:
    """Return the Arrow schema of a table, each field with unit, meaning and frame.

    Of the columns that only some missions have, it has those in `columns`; all if that is None.
    """
    row = FURTHER.get(table)
    if row is None or (columns is not None and not columns):
        return _schema(table)
    more = [_described(c, _arrow_type(row, c.name)) for c in fields(row)]
    return pa.schema(
        [*_schema(table), *(field for field in more if columns is None or field.name in columns)]
    )


@cache
def _schema(table: str) -> pa.Schema:
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
    """Return two fields of a metric: the worst AUV's value, and that AUV's name."""
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
    """Return the numeric metrics of a mission: all columns but the names of AUVs."""
    return [field.name for field in schema("mission") if field.type != pa.string()]


def data_dictionary() -> dict[str, dict[str, dict[str, str]]]:
    """Return type, unit, meaning and frame of every column of every table."""
    return {
        table: {
            field.name: {
                "type": str(field.type),
                **{k.decode(): v.decode() for k, v in (field.metadata or {}).items()},
            }
            for field in schema(table, None)
        }
        for table in TABLES
    }
