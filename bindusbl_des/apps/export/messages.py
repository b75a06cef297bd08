"""What an export tells a viewer, as messages with the instant and the topic they belong to: where
every vehicle is (truth, estimate and dead reckoning apart), where on Earth, and the rows of the
result tables as JSON, for plots, columns and frame as in the tables.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import groupby
from operator import itemgetter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pyarrow as pa
from foxglove.messages import (
    Color,
    FrameTransform,
    FrameTransforms,
    LocationFix,
    LocationFixPositionCovarianceType,
    Quaternion,
    Timestamp,
    Vector3,
)
from numpy.typing import NDArray

from ...core.geometry.geodesy import enu_covariance, enu_from_ned, enu_yaw, geodetic_from_ned
from ...core.results.schemas import schema
from ...support.arrays import Floats

if TYPE_CHECKING:
    from ...core.results.result import Result


# The survey's frame as viewers see it: east, north, up from the centre of the surface.
MAP = "map"


class ViewerMessage(NamedTuple):
    """One message: when (mission time, s), on which topic, and a Foxglove message or a row."""

    at_s: float
    topic: str
    content: Any


Messages = Iterator[ViewerMessage]


def nanoseconds(at_s: float) -> int:
    """Return an instant of the mission in whole nanoseconds; the mission begins at 0.

    >>> nanoseconds(0.1 + 0.2)
    300000000
    """
    return round(at_s * 1e9)


def timestamp(at_s: float) -> Timestamp:
    """Return an instant of the mission as Foxglove writes it."""
    return Timestamp(*divmod(nanoseconds(at_s), 1_000_000_000))


def colour(code: str, opacity: float = 1.0) -> Color:
    """Return a colour such as "#0072B2" as Foxglove writes it."""
    red, green, blue = (int(code[at : at + 2], 16) / 255 for at in (1, 3, 5))
    return Color(r=red, g=green, b=blue, a=opacity)


Row = Mapping[str, Any]

# Rows that are Python objects at once: all of a day's would take several GB.
ROWS_AT_ONCE = 4096


def rows_in_time(table: pa.Table, instant: str) -> Iterator[dict[str, Any]]:
    """Yield the rows of a table in the order of a column of instants; a few are made at once.

    Rows of one instant stay in the table's order; those that have none are left out.
    """
    whole, order = table.combine_chunks(), order_by(table, instant)
    for begin in range(0, len(order), ROWS_AT_ONCE):
        yield from whole.take(order[begin : begin + ROWS_AT_ONCE]).to_pylist()


def order_by(table: pa.Table, column: str) -> NDArray[np.intp]:
    """Return where the rows of a table that have a value of a column stand, in its order."""
    values = table[column].to_numpy()  # nulls are NaN, which come last
    return np.argsort(values, kind="stable")[: len(values) - table[column].null_count]


# What a vehicle's child frames are called, and the columns of `tracks` that place them.
FRAMES = {
    "{}": ("x_m", "y_m", "z_m"),
    "{}/estimate": ("estimate_x_m", "estimate_y_m", "estimate_z_m"),
    "{}/imu": ("imu_x_m", "imu_y_m", "estimate_z_m"),
}


def transforms(result: "Result") -> Messages:
    """Yield, for each instant of `tracks`, the frames of all vehicles in the map.

    A vehicle's own frame has x forward, y to port and z up (ROS REP 103); estimate and dead
    reckoning share the true heading, since only positions drift.
    """
    rows = rows_in_time(result.arrow["tracks"], "time_s")
    for at_s, together in groupby(rows, key=itemgetter("time_s")):
        placed = [transform for row in together for transform in _frames(row)]
        yield ViewerMessage(at_s, "/tf", FrameTransforms(transforms=placed))


def _frames(row: Row) -> list[FrameTransform]:
    return [
        _transform(row, name.format(row["vehicle"]), columns)
        for name, columns in FRAMES.items()
        if all(row[column] is not None for column in columns)
    ]


def _transform(row: Row, name: str, columns: tuple[str, ...]) -> FrameTransform:
    x, y, z = enu_from_ned([row[column] for column in columns])
    half = enu_yaw(row["yaw_rad"]) / 2
    return FrameTransform(
        timestamp=timestamp(row["time_s"]),
        parent_frame_id=MAP,
        child_frame_id=name,
        translation=Vector3(x=x, y=y, z=z),
        rotation=Quaternion(z=math.sin(half), w=math.cos(half)),
    )


# The instant to which a row of each table belongs, and the vehicle on whose topic it goes.
TOPICS = {
    "rounds": ("started_at_s", ""),
    "pings": ("sent_at_s", "auv"),
    "receptions": ("arrived_at_s", "auv"),
    "broadcasts": ("sent_at_s", "asv"),
    "frame_receptions": ("arrived_at_s", "auv"),
    "assignments": ("starts_at_s", "auv"),
    "fixes": ("pinged_at_s", "auv"),
    "gnss_fixes": ("fixed_at_s", "auv"),
    "signals": ("sent_at_s", "sender"),
    "signal_receptions": ("arrived_at_s", "listener"),
    "packets": ("made_at_s", "auv"),
    "auv_frames": ("sent_at_s", "auv"),
    "auv_frame_receptions": ("arrived_at_s", "listener"),
    "peer_ranges": ("heard_at_s", "auv"),
    "modem_lines": ("time_s", "vehicle"),
    "tracks": ("time_s", "vehicle"),
}
# Metrics, which come at the end of the mission.
METRICS = {"auvs": "auv", "mission": ""}
JSON_TYPES = {"int64": "integer", "double": "number", "string": "string"}


def row_streams(result: "Result") -> Iterator[Messages]:
    """Yield a stream of messages for each table, each in the order of time.

    What has not arrived, or was never sent (twtt), has no instant and is left out.  The metrics of
    the mission and its AUVs come at its end.
    """
    for table, (instant, vehicle) in TOPICS.items():
        if table in result.arrow:
            yield _rows(table, vehicle, rows_in_time(result.arrow[table], instant), instant)
    end = result.scenario.duration_s
    for table, vehicle in METRICS.items():
        yield _rows(table, vehicle, result.arrow[table].to_pylist(), at_s=end)


def _rows(
    table: str, vehicle: str, rows: Iterable[Row], instant: str = "", at_s: float = 0.0
) -> Messages:
    """Yield rows, each at its instant or all at one (s), on topics such as `/AUV0/fixes` or
    `/rounds`; pings of ASVs (passive) are on theirs.
    """
    for row in rows:
        whose = f"/{row[vehicle] or row['asv']}" if vehicle else ""
        known = {name: value for name, value in row.items() if value is not None}
        yield ViewerMessage(row[instant] if instant else at_s, f"{whose}/{table}", known)


def json_schema(table: str) -> dict[str, Any]:
    """Return the JSON Schema of a table's rows; a column that has no value is left out of a row.

    >>> json_schema("fixes")["properties"]["pinged_at_s"]
    {'type': 'number', 'description': 'instant at which that ping was sent (s)'}
    """
    return {
        "title": f"bindusbl.{table}",
        "type": "object",
        "properties": {
            field.name: {
                "type": JSON_TYPES[str(field.type)],
                "description": _description(field.metadata),
            }
            for field in schema(table, None)
        },
    }


def _description(metadata: dict[bytes, bytes]) -> str:
    unit = metadata[b"unit"].decode()
    return metadata[b"meaning"].decode() + (f" ({unit})" if unit not in ("", "1") else "")


KNOWN = LocationFixPositionCovarianceType.Known
NAMES = {"{}": "location", "{}/estimate": "location/estimate", "{}/imu": "location/imu"}


def location_streams(result: "Result") -> Iterator[Messages]:
    """Yield the positions of all vehicles and the fixes, WGS-84; none if there is no origin."""
    origin = result.setup.ground
    if origin is not None:
        yield _vehicles(result, origin)
        yield _fixes(result, origin)


def fix_covariance(row: dict[str, Any]) -> Floats:
    """Return the covariance (m2) of a row of `fixes`, in the survey frame (NED)."""
    xy, xz, yz = row["cov_xy_m2"], row["cov_xz_m2"], row["cov_yz_m2"]
    variance = [row[f"sd_{axis}_m"] ** 2 for axis in "xyz"]
    return np.array([[variance[0], xy, xz], [xy, variance[1], yz], [xz, yz, variance[2]]])


def _vehicles(result: "Result", origin: tuple[float, float, float]) -> Messages:
    for row in rows_in_time(result.arrow["tracks"], "time_s"):
        for frame, columns in FRAMES.items():
            place = [row[column] for column in columns]
            if None not in place:
                name, at_s = row["vehicle"], row["time_s"]
                location = _location(place, origin, at_s, frame.format(name))
                yield ViewerMessage(at_s, f"/{name}/{NAMES[frame]}", location)


def _fixes(result: "Result", origin: tuple[float, float, float]) -> Messages:
    for row in rows_in_time(result.arrow["fixes"], "pinged_at_s"):
        name, at_s = row["auv"], row["pinged_at_s"]
        place = [row["x_m"], row["y_m"], row["z_m"]]
        covariance = enu_covariance(fix_covariance(row)).ravel().tolist()
        location = _location(place, origin, at_s, name, covariance)
        yield ViewerMessage(at_s, f"/{name}/location/fix", location)


def _location(
    place: Sequence[float],
    origin: tuple[float, float, float],
    at_s: float,
    frame: str,
    covariance: Sequence[float] | None = None,
) -> LocationFix:
    lat, lon, height = geodetic_from_ned(place, *origin)
    known: dict[str, Any] = {}
    if covariance is not None:
        known = {"position_covariance": list(covariance), "position_covariance_type": KNOWN}
    return LocationFix(
        timestamp=timestamp(at_s),
        frame_id=frame,
        latitude=lat,
        longitude=lon,
        altitude=height,
        **known,
    )
