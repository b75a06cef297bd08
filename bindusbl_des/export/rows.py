"""The rows of the result tables as JSON messages, for plots: columns and frame as in the tables."""

from collections.abc import Iterator
from operator import itemgetter
from typing import TYPE_CHECKING, Any

from ..results.schemas import schema
from .messages import Message, Messages

if TYPE_CHECKING:
    from ..results.result import Result

# The instant to which a row of each table belongs, and the vehicle on whose topic it goes.
INSTANT = {
    "rounds": "started_at_s",
    "pings": "sent_at_s",
    "receptions": "arrived_at_s",
    "broadcasts": "sent_at_s",
    "frame_receptions": "arrived_at_s",
    "assignments": "starts_at_s",
    "fixes": "pinged_at_s",
    "tracks": "time_s",
}
VEHICLE = {
    "pings": "auv",
    "receptions": "auv",
    "broadcasts": "asv",
    "frame_receptions": "auv",
    "assignments": "auv",
    "fixes": "auv",
    "tracks": "vehicle",
    "auvs": "auv",
}
JSON_TYPES = {"int64": "integer", "double": "number", "string": "string"}


def row_streams(result: "Result") -> Iterator[Messages]:
    """Yield a stream of messages for each table, each in the order of time.

    What has not arrived, or was never sent (twtt), has no instant and is left out.  The metrics of
    the mission and its AUVs come at its end.
    """
    yield from (_events(result, table) for table in INSTANT)
    yield from (_metrics(result, table) for table in ("auvs", "mission"))


def _events(result: "Result", table: str) -> Messages:
    instant = INSTANT[table]
    known = (row for row in result.arrow[table].to_pylist() if row[instant] is not None)
    for row in sorted(known, key=itemgetter(instant)):
        yield Message(row[instant], topic(table, row), _known(row))


def _metrics(result: "Result", table: str) -> Messages:
    for row in result.arrow[table].to_pylist():
        yield Message(result.scenario.duration_s, topic(table, row), _known(row))


def topic(table: str, row: dict[str, Any]) -> str:
    """Return the topic of a row: `/AUV0/fixes`, `/ASV1/broadcasts`, `/rounds`.

    Pings of ASVs (passive) are on theirs.
    """
    vehicle = VEHICLE.get(table)
    if vehicle is None:
        return f"/{table}"
    return f"/{row[vehicle] or row['asv']}/{table}"


def json_schema(table: str) -> dict[str, Any]:
    """Return the JSON Schema of a table's rows; a column that has no value is left out of a row.

    >>> json_schema("fixes")["properties"]["pinged_at_s"]
    {'type': 'number', 'description': 'instant at which that ping was sent (s)'}
    """
    return {
        "title": f"bindusbl.{table}",
        "type": "object",
        "properties": {
            field.name: {"type": JSON_TYPES[str(field.type)], "description": _told(field.metadata)}
            for field in schema(table)
        },
    }


def _told(metadata: dict[bytes, bytes]) -> str:
    unit = metadata[b"unit"].decode()
    return metadata[b"meaning"].decode() + (f" ({unit})" if unit not in ("", "1") else "")


def _known(row: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in row.items() if value is not None}
