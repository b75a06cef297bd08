"""Recorded tracks of vehicles: CSV, MCAP and GPX."""

import csv
import json
import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..core.arrays import Floats
from ..core.files import regular
from ..core.wording import shortened
from .shapes import BadChart, Sample, in_sea, position
from .xml_charts import read_gpx

# Tracks in CSV files: time_s, then x_m and y_m or lat_deg and lon_deg, and depth_m or z_m.


TIME, NAME = "time_s", "vehicle"
METRES, DEGREES, DEPTHS = ("x_m", "y_m"), ("lat_deg", "lon_deg"), ("depth_m", "z_m")
COLUMNS = "time_s, x_m, y_m, depth_m, or time_s, lat_deg, lon_deg, depth_m"


def read_csv(path: str) -> Iterator[tuple[str, Sample]]:
    """Yield the samples of a CSV file, each with the vehicle that a column `vehicle` names.

    Columns may stand in any order, and others beside them; where there are metres, degrees do not
    count.  The table `tracks` of an export is such a file.

    Raises:
        BadChart: naming file, line and remedy.
    """
    try:
        with open(regular(path), newline="", encoding="utf-8-sig") as file:
            rows = list(csv.reader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise BadChart(f"{path}: cannot be read as a CSV file: {error}") from None
    header = [name.strip() for name in rows[0]] if rows else []
    columns, in_degrees = _columns(path, header)
    places = [header.index(name) for name in columns]
    named = header.index(NAME) if NAME in header else None
    for number, row in enumerate(rows[1:], 2):
        if row:
            sample = _sample(f"{path}:{number}", row, places, columns, in_degrees)
            yield row[named].strip() if named is not None else "", sample


def _columns(path: str, header: Sequence[str]) -> tuple[list[str], bool]:
    """Return the columns of time, place and depth, and whether places are in degrees."""
    depth = next((name for name in DEPTHS if name in header), DEPTHS[0])
    metres, degrees = [TIME, *METRES, depth], [TIME, *DEGREES, depth]
    in_degrees = any(name in header for name in DEGREES) and not all(
        name in header for name in METRES
    )
    columns = degrees if in_degrees else metres
    missing = [name for name in columns if name not in header]
    if missing:
        raise BadChart(f"{path}:1: column {', '.join(missing)} missing; the header needs {COLUMNS}")
    return columns, in_degrees


def _sample(
    where: str, row: Sequence[str], places: Sequence[int], columns: Sequence[str], in_degrees: bool
) -> Sample:
    try:
        time, first, second, depth = (float(row[place]) for place in places)
    except (ValueError, IndexError):
        raise BadChart(f"{where}: needs a number in each of {', '.join(columns)}") from None
    if not all(math.isfinite(value) for value in (time, first, second, depth)):
        values = [time, first, second, depth]
        raise BadChart(f"{where}: holds a value that is not finite: {values}")
    depth = in_sea(where, depth)
    if in_degrees:
        return Sample(where, time, position(first, second, where, "lat_deg, lon_deg"), depth, True)
    return Sample(where, time, (first, second), depth, False)


# Tracks in MCAP files: positions on Earth (foxglove.LocationFix), or rows of our own `tracks`.


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
        where = f"{path}: message {counts[topic]} on {topic}"
        if kind == LOCATION:
            yield topic, _location(where, message, at)
        elif isinstance(message, Mapping) and all(name in message for name in ROW):
            yield topic, _row(where, message)


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
        raise BadChart(
            f"{path}: cannot be read as an MCAP file: {error or type(error).__name__}"
        ) from None


def _location(where: str, message: Any, at: float) -> Sample:
    """Return a position on Earth at its own time, or else that of the log."""
    is_json = not hasattr(message, "HasField")
    parts = _of_json(message) if is_json else _of_protobuf(message)
    lat, lon, height, seconds, nanoseconds = map(_number, parts)
    if lat is None or lon is None:
        raise BadChart(f"{where}: needs numbers as latitude and longitude")
    time = at if seconds is None or nanoseconds is None else seconds + nanoseconds / 1e9
    if not math.isfinite(time):
        raise BadChart(f"{where}: its timestamp is {time:g} s; leave it out, then log_time counts")
    place = position(lat, lon, where, "latitude and longitude of WGS-84")
    depth = math.nan
    if height is not None:
        if not math.isfinite(height):
            raise BadChart(f"{where}: its height is {height:g}; leave it out if it is unknown")
        depth = -height
    return Sample(where, time, place, depth, True, below_ellipsoid=True)


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


def _row(where: str, message: Mapping[str, Any]) -> Sample:
    values = [_number(message[name]) for name in ROW]
    time, x, y, depth = (math.nan if value is None else value for value in values)
    if not math.isfinite(time + x + y + depth):
        raise BadChart(f"{where}: needs a finite number in each of {', '.join(ROW)}")
    return Sample(where, time, (x, y), in_sea(where, depth), False)


def _number(value: object) -> float | None:
    """Return a number as one that is computed with; None for anything else."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        return None
    try:
        return float(value)
    except OverflowError:  # an integer of hundreds of digits
        return math.inf


# Recorded tracks of vehicles: CSV, GPX and MCAP files, in metres or in degrees.


READERS: Mapping[str, Callable[[str], Iterator[tuple[str, Sample]]]] = {
    ".csv": read_csv,
    ".gpx": read_gpx,
    ".mcap": read_mcap,
}
# Of the tracks in a file so many are named.
MOST_NAMED = 8


class RecordedTrack(NamedTuple):
    """A recorded track of n samples.

    `times` (n,), s, by whatever clock, rise strictly; `places` (n, 2) are x and y (m) or, if
    `in_degrees`, latitude and longitude; `depths` (n,), m, are nan where the file says none, and
    below the ellipsoid, not the sea, if `below_ellipsoid`.  `where` (n,) names the place of each
    sample in the file.
    """

    times: Floats
    places: Floats
    depths: Floats
    in_degrees: bool
    where: tuple[str, ...]
    below_ellipsoid: bool = False

    @property
    def lacks_depths(self) -> bool:
        """Whether the file does not say how deep some of it is."""
        return bool(np.isnan(self.depths).any())


def read_recording(path: str | Path, which: str = "") -> RecordedTrack:
    """Return a recorded track; `which` names one of several in the file.

    A track is named by the column `vehicle` of a CSV, the name of a track of a GPX, the topic of
    an MCAP.

    Raises:
        BadChart: naming file, place in it and remedy.
    """
    try:
        found = os.stat(path)
    except OSError as error:
        raise BadChart(f"{path}: cannot be read as a track: {error}") from None
    return _read(str(path), which, found.st_mtime_ns, found.st_size)


@lru_cache(maxsize=64)
def _read(path: str, which: str, _changed_at: int, _size: int) -> RecordedTrack:
    """Return what is in a file; one that has not changed since is not read again."""
    return _recording(path, _chosen(path, _tracks(path), which))


def check_tracks(path: str) -> None:
    """Refuse a file in which there can be no track, whichever of them is meant.

    Raises:
        BadChart: naming file, place in it and remedy.
    """
    tracks = _tracks(path)
    if len(tracks) < 2:
        _recording(path, _chosen(path, tracks, ""))


def _tracks(path: str) -> dict[str, list[Sample]]:
    read = READERS.get(Path(path).suffix.lower(), read_csv)
    tracks: dict[str, list[Sample]] = {}
    for name, sample in read(path):
        tracks.setdefault(name, []).append(sample)
    return tracks


def _chosen(path: str, tracks: dict[str, list[Sample]], which: str) -> list[Sample]:
    if not which and len(tracks) < 2:
        return next(iter(tracks.values()), [])
    if which in tracks:
        return tracks[which]
    named = ", ".join(map(repr, list(tracks)[:MOST_NAMED]))
    more = f" and {len(tracks) - MOST_NAMED} more" if len(tracks) > MOST_NAMED else ""
    asked = f"no track {shortened(repr(which))}; " if which else ""
    raise BadChart(
        f"{path}: {asked}holds {named or 'no track'}{more}; name one for each AUV in "
        "auvs.route.tracks"
    )


def _recording(path: str, samples: list[Sample]) -> RecordedTrack:
    if len(samples) < 2:
        raise BadChart(f"{path}: has {len(samples)} samples; a track needs at least two")
    numbers = np.array([(sample.time, *sample.place, sample.depth) for sample in samples])
    stuck = np.flatnonzero(np.diff(numbers[:, 0]) <= 0.0)
    if len(stuck):
        first = int(stuck[0])
        raise BadChart(
            f"{samples[first + 1].where}: time_s must increase, but this sample "
            f"({numbers[first + 1, 0]:.15g} s) does not follow {numbers[first, 0]:.15g} s"
        )
    numbers.setflags(write=False)
    where = tuple(sample.where for sample in samples)
    kind = samples[0]
    return RecordedTrack(
        times=numbers[:, 0],
        places=numbers[:, 1:3],
        depths=numbers[:, 3],
        in_degrees=kind.in_degrees,
        where=where,
        below_ellipsoid=kind.below_ellipsoid,
    )
