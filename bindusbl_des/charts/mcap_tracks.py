"""Tracks in MCAP files: positions on Earth (foxglove.LocationFix), or rows of our own `tracks`."""

import json
import math
from collections.abc import Iterator, Mapping
from typing import Any

from ..core.regular_files import regular
from .samples import Sample, in_sea
from .shapes import BadChart, position

LOCATION = "foxglove.LocationFix"
REMEDY = (
    "MCAP files are read by the packages mcap and mcap-protobuf-support, which are not installed "
    "here; install them with: python -m pip install 'bindusbl-des[replay]'"
)
ROW = ("time_s", "x_m", "y_m", "z_m")


def read_mcap(path: str) -> Iterator[tuple[str, Sample]]:
    """Yield the samples of an MCAP file, each with the topic that it is on.

    Read are topics of the schema foxglove.LocationFix (as protobuf or JSON; their heights are above
    the ellipsoid), and JSON messages with time_s, x_m, y_m and z_m, such as the topics
    `/AUV0/tracks` of an export.  What else is in the file is passed over.

    Raises:
        BadChart: naming file, message and remedy, or the packages that are missing.
    """
    counts: dict[str, int] = {}
    for topic, kind, at, message in _messages(path):
        counts[topic] = counts.get(topic, 0) + 1
        told = f"{path}: message {counts[topic]} on {topic}"
        if kind == LOCATION:
            yield topic, _location(told, message, at)
        elif isinstance(message, Mapping) and all(name in message for name in ROW):
            yield topic, _row(told, message)


def _messages(path: str) -> Iterator[tuple[str, str, float, Any]]:
    """Yield topic, name of the schema, log time (s) and content of what can be a position."""
    try:
        from mcap.reader import make_reader
        from mcap_protobuf.decoder import DecoderFactory
    except ModuleNotFoundError:
        raise BadChart(f"{path}: {REMEDY}") from None
    protobuf = DecoderFactory()
    try:
        with open(regular(path), "rb") as file:
            for schema, channel, message in make_reader(file).iter_messages():
                kind = schema.name if schema else ""
                at = message.log_time / 1e9
                if channel.message_encoding == "json":
                    yield channel.topic, kind, at, json.loads(message.data)
                elif kind == LOCATION and channel.message_encoding == "protobuf":
                    decode = protobuf.decoder_for("protobuf", schema)
                    if decode is not None:
                        yield channel.topic, kind, at, decode(message.data)
    except Exception as error:  # of a damaged file the packages raise whatever they come upon
        raise BadChart(f"{path}: cannot be read as an MCAP file: {error}") from None


def _location(told: str, message: Any, at: float) -> Sample:
    """Return a position on Earth at its own time, or else that of the log."""
    is_json = not hasattr(message, "HasField")
    parts = _of_json(message) if is_json else _of_protobuf(message)
    lat, lon, height, seconds, nanoseconds = map(_number, parts)
    if lat is None or lon is None:
        raise BadChart(f"{told}: needs numbers as latitude and longitude")
    time = at if seconds is None or nanoseconds is None else seconds + nanoseconds / 1e9
    if not math.isfinite(time):
        raise BadChart(f"{told}: its timestamp is {time:g} s; leave it out, then log_time counts")
    place = position(lat, lon, told, "latitude and longitude of WGS-84")
    depth = math.nan
    if height is not None:
        if not math.isfinite(height):
            raise BadChart(f"{told}: its height is {height:g}; leave it out if it is unknown")
        depth = -height
    return Sample(told, time, place, depth, True, below_ellipsoid=True)


def _of_json(message: Any) -> tuple[Any, ...]:
    """Return latitude, longitude, altitude, and whole seconds and nanoseconds of the time stamp."""
    message = message if isinstance(message, dict) else {}
    stamp = message.get("timestamp")
    parts = stamp if isinstance(stamp, dict) else {}
    place = (message.get(name) for name in ("latitude", "longitude", "altitude"))
    return (*place, parts.get("sec"), parts.get("nsec"))


def _of_protobuf(message: Any) -> tuple[Any, ...]:
    stamp = message.timestamp if message.HasField("timestamp") else None
    parts = (stamp.seconds, stamp.nanos) if stamp is not None else (None, None)
    return (message.latitude, message.longitude, message.altitude, *parts)


def _row(told: str, message: Mapping[str, Any]) -> Sample:
    values = [_number(message[name]) for name in ROW]
    time, x, y, depth = (math.nan if it is None else it for it in values)
    if not math.isfinite(time + x + y + depth):
        raise BadChart(f"{told}: needs a finite number in each of {', '.join(ROW)}")
    return Sample(told, time, (x, y), in_sea(told, depth), False)


def _number(value: object) -> float | None:
    """Return a number as one that is computed with; None for anything else."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        return None
    try:
        return float(value)
    except OverflowError:  # an integer of hundreds of digits
        return math.inf
