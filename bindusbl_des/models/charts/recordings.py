"""Recorded tracks of vehicles: CSV, MCAP and GPX."""

import json
import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...support.arrays import Floats
from ...support.files import regular
from ...support.tables import TableRow, because, left_out, of_file, ordered, read_table, sifted
from ...support.wording import shortened
from .shapes import BadChart, NoPlace, Sample, above_sea, check_seconds, in_sea, position, unix_time
from .xml_charts import read_gpx

# Tracks in CSV files: time_s, then x_m and y_m or lat_deg and lon_deg, and depth_m or z_m.


TIME, NAME = "time_s", "vehicle"
METRES, DEGREES, DEPTHS = ("x_m", "y_m"), ("lat_deg", "lon_deg"), ("depth_m", "z_m")
COLUMNS = "time_s, x_m, y_m, depth_m, or time_s, lat_deg, lon_deg, depth_m"


Reading = Callable[[], Sample]


def read_csv(path: str) -> Iterator[tuple[str, Reading]]:
    """Yield functions that read the samples of a CSV file, each with the vehicle in a column
    `vehicle`.

    Columns may be in any order, beside others; if there are metres, degrees do not count.  The
    table `tracks` of an export is such a file.

    Raises:
        BadChart: naming file, line and remedy; so do the functions.
    """
    table = read_table(path, BadChart)
    columns, in_degrees = _columns(path, table.names)
    for row in table.rows():
        yield row.cells.get(NAME, "").strip(), partial(_sample, row, columns, in_degrees)


def _columns(path: str, header: Sequence[str]) -> tuple[list[str], bool]:
    """Return the columns of time, position and depth, and whether positions are in degrees."""
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


def _sample(row: TableRow, columns: Sequence[str], in_degrees: bool) -> Sample:
    written = [row.cells[name] for name in columns]
    if "-" in written[0][1:-1] and ":" in written[0]:  # a date and a time of day
        written[0] = repr(unix_time(row.where, written[0].strip()))
    try:
        time, first, second, depth = map(float, written)
    except ValueError:
        fault = BadChart if all(map(str.strip, written)) else NoPlace
        raise fault(f"{row.where}: needs a number in each of {', '.join(columns)}") from None
    values = [time, first, second, depth]
    if not all(map(math.isfinite, values)):
        fault = NoPlace if any(map(math.isnan, values)) else BadChart
        raise fault(f"{row.where}: holds a value that is not finite: {values}")
    depth = in_sea(row.where, depth)
    if in_degrees:
        place = position(first, second, row.where, "lat_deg, lon_deg")
        return Sample(row.where, time, place, depth, True)
    return Sample(row.where, time, (first, second), depth, False)


# Tracks in MCAP files: positions on Earth (foxglove.LocationFix), or rows of our own `tracks`.


LOCATION = "foxglove.LocationFix"
REMEDY = (
    "MCAP files are read by the packages mcap and mcap-protobuf-support, which are not installed "
    "here; install them with: python -m pip install 'bindusbl-des[replay]'"
)
ROW = ("time_s", "x_m", "y_m", "z_m")


def read_mcap(path: str) -> Iterator[tuple[str, Reading]]:
    """Yield functions that read the samples of an MCAP file, each with its topic.

    Topics of the schema foxglove.LocationFix are read (as protobuf or JSON; heights are above the
    ellipsoid), and JSON messages with time_s, x_m, y_m and z_m, such as the topics `/AUV0/tracks`
    of an export.  Other topics are ignored.

    Raises:
        BadChart: naming file, message and remedy, or the packages that are missing.
    """
    for message in mcap_messages(path):
        if message.schema == LOCATION:
            yield message.topic, partial(_location, message)
        elif isinstance(message.content, Mapping) and all(name in message.content for name in ROW):
            yield message.topic, partial(_row, message.where, message.content)


class McapMessage(NamedTuple):
    """A message: its place (file and number on its topic), its topic, the name of its schema, its
    log time (s), and its content, or the error in that.
    """

    where: str
    topic: str
    schema: str
    at: float
    content: Any


def mcap_messages(path: str) -> Iterator[McapMessage]:
    """Yield the JSON messages of an MCAP file, and those in protobuf that are positions on Earth.

    Raises:
        BadChart: naming file and remedy, or the packages that are missing.
    """
    try:
        from mcap.reader import make_reader
        from mcap_protobuf.decoder import DecoderFactory
    except ModuleNotFoundError:
        raise BadChart(f"{path}: {REMEDY}") from None
    protobuf, counts = DecoderFactory(), Counter[str]()
    try:
        with open(regular(path), "rb") as file:
            for schema, channel, message in make_reader(file).iter_messages():
                kind, topic, content = schema.name if schema else "", channel.topic, None
                if channel.message_encoding == "json":
                    content = _json(message.data)
                elif kind == LOCATION and channel.message_encoding == "protobuf":
                    decode = protobuf.decoder_for("protobuf", schema)
                    content = decode(message.data) if decode else None
                if content is None:
                    continue
                counts[topic] += 1
                where = f"{path}: message {counts[topic]} on {topic}"
                yield McapMessage(where, topic, kind, message.log_time / 1e9, content)
    except Exception as error:  # of a damaged file the packages raise whatever they come upon
        raise BadChart(
            f"{path}: cannot be read as an MCAP file: {error or type(error).__name__}"
        ) from None


def _json(data: bytes) -> Any:
    try:
        return json.loads(data)
    except ValueError as error:
        return error


def _location(logged: McapMessage) -> Sample:
    """Return a position on Earth at its own time, or if it has none at that of the log."""
    where, message, at = logged.where, logged.content, logged.at
    if isinstance(message, ValueError):
        raise BadChart(f"{where}: is no JSON: {message}")
    parts = _of_protobuf(message) if hasattr(message, "HasField") else _of_json(message)
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
    """Return a number as float; None for anything else."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        return None
    try:
        return float(value)
    except OverflowError:  # an integer of hundreds of digits
        return math.inf


# Recorded tracks of vehicles: CSV, GPX and MCAP files, in metres or in degrees.


READERS: Mapping[str, Callable[[str], Iterator[tuple[str, Reading]]]] = {
    ".csv": read_csv,
    ".gpx": read_gpx,
    ".mcap": read_mcap,
}
# Most tracks of a file that a message names
MOST_NAMED = 8


class RecordedTrack(NamedTuple):
    """A recorded track of n samples.

    `times` (n,), s, by any clock, rise strictly; `places` (n, 2) are x and y (m) or, if
    `in_degrees`, latitude and longitude; `depths` (n,), m, are nan where the file has none, and
    below the ellipsoid, not the sea, if `below_ellipsoid`.  `where` (n,) names the place of each
    sample in the file; `left_out` are messages about samples that were left out.
    """

    times: Floats
    places: Floats
    depths: Floats
    in_degrees: bool
    where: tuple[str, ...]
    below_ellipsoid: bool = False
    left_out: tuple[str, ...] = ()

    @property
    def lacks_depths(self) -> bool:
        """Whether the file lacks depths for some samples."""
        return bool(np.isnan(self.depths).any())


@of_file(64)
def read_recording(path: str, which: str = "", surface_m: float = 0.0) -> RecordedTrack:
    """Return a recorded track; `which` names one of several in the file, `surface_m` is the height
    of the water above the sea.

    A track is named by the column `vehicle` of a CSV, the name of a track of a GPX, the topic of
    an MCAP.

    Raises:
        BadChart: naming file, place in it and remedy.
    """
    return _recording(path, _chosen(path, _tracks(path, surface_m), which))


def check_tracks(path: str) -> None:
    """Refuse a file in which there can be no track, whichever of them is meant, wherever the water
    is.

    Raises:
        BadChart: naming file, place in it and remedy.
    """
    tracks = _tracks(path, None)
    if len(tracks) < 2:
        _recording(path, _chosen(path, tracks, ""))


# The samples of a track, and messages about samples that were left out
Samples = tuple[list[Sample], tuple[str, ...]]


def _tracks(path: str, surface_m: float | None) -> dict[str, Samples]:
    """Return the tracks of a file by name, without those of which nothing can be read; `surface_m`
    is the height of the water, None if unknown.

    Raises:
        BadChart: when none can be read.
    """
    read = READERS.get(Path(path).suffix.lower(), read_csv)
    tracks: dict[str, list[Reading]] = {}
    for name, sample in read(path):
        tracks.setdefault(name, []).append(sample)
    found: dict[str, Samples] = {}
    first: ValueError | None = None
    for name, readings in tracks.items():
        try:
            found[name] = sifted(readings, lambda reading: _in_water(reading(), surface_m))
        except ValueError as error:
            first = first or error
    if first is not None and not found:
        raise first
    return found


def _in_water(sample: Sample, surface_m: float | None) -> Sample:
    """Return a sample whose depth is below the water."""
    if not sample.is_height or surface_m is None or math.isnan(sample.depth):
        return sample
    return sample._replace(depth=above_sea(sample.where, -sample.depth - surface_m))


def _chosen(path: str, tracks: dict[str, Samples], which: str) -> Samples:
    if not which and len(tracks) < 2:
        return next(iter(tracks.values()), ([], ()))
    if which in tracks:
        return tracks[which]
    named = ", ".join(map(repr, list(tracks)[:MOST_NAMED]))
    more = f" and {len(tracks) - MOST_NAMED} more" if len(tracks) > MOST_NAMED else ""
    asked = f"no track {shortened(repr(which))}; " if which else ""
    raise BadChart(
        f"{path}: {asked}holds {named or 'no track'}{more}; name one for each AUV in "
        "auvs.route.tracks"
    )


def _recording(path: str, track: Samples) -> RecordedTrack:
    samples, unread = track
    samples, unfixed = _fixed(samples)
    if len(samples) < 2:
        few = f"{path}: has {len(samples)} samples; a track needs at least two"
        raise BadChart(few + because(unread + unfixed))
    where, times = [sample.where for sample in samples], [sample.time for sample in samples]
    rising, others = ordered(where, times, TIME, "s", fault=BadChart)
    numbers = np.array([(sample.time, *sample.place, sample.depth) for sample in samples])[rising]
    if len(rising) < 2:
        raise BadChart(f"{path}: all its samples are of one instant; a track needs two")
    check_seconds(samples[0].where, TIME, float(numbers[0, 0]))
    numbers.setflags(write=False)
    kind = samples[0]
    return RecordedTrack(
        times=numbers[:, 0],
        places=numbers[:, 1:3],
        depths=numbers[:, 3],
        in_degrees=kind.in_degrees,
        where=tuple(where[n] for n in rising),
        below_ellipsoid=kind.below_ellipsoid,
        left_out=unread + unfixed + others,
    )


def _fixed(samples: list[Sample]) -> tuple[list[Sample], tuple[str, ...]]:
    """Return the samples of receivers that had a fix: without one they write position 0, 0."""
    if not samples or not samples[0].in_degrees:
        return samples, ()
    away = sum(max(map(abs, sample.place)) > 1.0 for sample in samples)
    if 2 * away < len(samples):
        return samples, ()
    fixed = [sample for sample in samples if sample.place != (0.0, 0.0)]
    lost = [f"{sample.where} is at 0, 0" for sample in samples if sample.place == (0.0, 0.0)]
    return fixed, left_out(lost, len(samples))
