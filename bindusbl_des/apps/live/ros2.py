"""A bag for ROS 2: readings as its own messages, CDR in one MCAP file, which `ros2 bag` plays.

Positions are east, north, up (REP 103) in the frame `map`, whose origin is x = y = 0 at the
surface.  Sources: REP 103, 105; OMG DDSI-RTPS 2.2, chapter 10 (CDR); mcap.dev, registry (ros2).
"""

import errno
import math
import struct
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime, timedelta
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from foxglove import Channel, Context, Schema
from foxglove.mcap import MCAPWriteOptions

from ...core.geometry.geodesy import enu_covariance, enu_from_ned, enu_yaw
from ...core.records.events import Fix
from ...support.files import draft_of
from ...support.mcap_log import McapLog
from .readings import (
    Compass,
    Earth,
    EstimateReading,
    FixReading,
    Gnss,
    Reading,
    Truth,
    UsblReading,
    earth_of,
)

if TYPE_CHECKING:
    from ...core.results.result import Result

MAP = "map"

# A variance (rad2, m2/s2) of what nobody has measured
UNKNOWN = 1e6

# sensor_msgs/NavSatStatus: a fix by GPS; NavSatFix: covariance known
FIX, GPS, KNOWN = 0, 1, 3

# Definitions as ROS 2 has them, without their comments.
DEFINITIONS = {
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec",
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Quaternion": "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1",
    "geometry_msgs/Pose": "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation",
    "geometry_msgs/PoseWithCovariance": "geometry_msgs/Pose pose\nfloat64[36] covariance",
    "geometry_msgs/PoseWithCovarianceStamped": (
        "std_msgs/Header header\ngeometry_msgs/PoseWithCovariance pose"
    ),
    "geometry_msgs/Twist": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular",
    "geometry_msgs/TwistWithCovariance": "geometry_msgs/Twist twist\nfloat64[36] covariance",
    "geometry_msgs/Transform": (
        "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation"
    ),
    "geometry_msgs/TransformStamped": (
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform"
    ),
    "nav_msgs/Odometry": (
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
        "geometry_msgs/TwistWithCovariance twist"
    ),
    "sensor_msgs/NavSatStatus": (
        "int8 STATUS_NO_FIX=-1\nint8 STATUS_FIX=0\nint8 status\nuint16 SERVICE_GPS=1\n"
        "uint16 service"
    ),
    "sensor_msgs/NavSatFix": (
        "std_msgs/Header header\nsensor_msgs/NavSatStatus status\nfloat64 latitude\n"
        "float64 longitude\nfloat64 altitude\nfloat64[9] position_covariance\n"
        "uint8 COVARIANCE_TYPE_KNOWN=3\nuint8 position_covariance_type"
    ),
    "tf2_msgs/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "rosgraph_msgs/Clock": "builtin_interfaces/Time clock",
}

RULE = "=" * 80


def definition(kind: str) -> str:
    """Return the definition of a message and of all that it consists of, as bags have it."""
    needed, text = [kind], DEFINITIONS[kind]
    for message in needed:
        for name in DEFINITIONS:
            if f"{name} " in DEFINITIONS[message].replace("[]", "") and name not in needed:
                needed.append(name)
    parts = [f"{RULE}\nMSG: {name}\n{DEFINITIONS[name]}" for name in needed[1:]]
    return "\n".join([text, *parts]) + "\n"


# Numbers, as `struct` writes them.
CODES = {"int8": "b", "uint8": "B", "uint16": "H", "int32": "i", "uint32": "I", "float64": "d"}


def cdr(kind: str, value: Any) -> bytes:
    """Return a message, tuples in the order of its definition, in CDR, little-endian: each number
    at a multiple of its size.
    """
    data = bytearray()
    _append(data, kind, value)
    return b"\x00\x01\x00\x00" + bytes(data)  # after the header that says how it is written


def _append(data: bytearray, kind: str, value: Any) -> None:
    """Append a value of a kind: a number, several, a text with a zero at its end, or a message."""
    kind, brackets, count = kind.partition("[")
    if brackets and count == "]":  # of any length, which goes before
        _append(data, "uint32", len(value))
    if kind in CODES:
        numbers = value if brackets else (value,)
        data += bytes(-len(data) % struct.calcsize(CODES[kind]))
        data += struct.pack(f"<{len(numbers)}{CODES[kind]}", *numbers)
    elif kind == "string":
        text = value.encode() + b"\0"
        _append(data, "uint32", len(text))
        data += text
    else:
        for message in value if brackets else (value,):
            for field, part in zip(_fields(kind), message, strict=True):
                _append(data, field, part)


@cache
def _fields(kind: str) -> list[str]:
    """Return the kinds of a message's fields; its constants are none."""
    return [line.split()[0] for line in DEFINITIONS[kind].split("\n") if "=" not in line]


def _time(nanoseconds: int) -> tuple[int, int]:
    return divmod(nanoseconds, 1_000_000_000)


def _place_with_covariance(
    place: Sequence[float], yaw: float | None, spread: Any, turn: float
) -> Any:
    """Return a PoseWithCovariance: of a place (NED, m), a yaw (rad, None if unknown), and their
    covariance, of the place (3, 3), m2, and of the yaw (rad2).
    """
    covariance = np.zeros((6, 6))
    covariance[:3, :3] = enu_covariance(spread)
    covariance[3:, 3:] = np.diag([turn] * 3)
    pose = enu_from_ned(place).tolist(), quaternion(yaw)
    return pose, covariance.ravel().tolist()


def quaternion(yaw: float | None) -> tuple[float, float, float, float]:
    """Return x, y, z, w of a heading (rad, from north towards east), ENU."""
    half = 0.0 if yaw is None else enu_yaw(yaw) / 2
    return 0.0, 0.0, math.sin(half), math.cos(half)


class RosMessage(NamedTuple):
    """A message: topic, kind, log time (ns) and content, in the order of its definition."""

    topic: str
    kind: str
    at_ns: int
    content: Any


class Speaker:
    """Readings as messages of ROS 2; it remembers the headings of vessels, for `/tf`."""

    def __init__(self) -> None:
        self._yaws: dict[str, float] = {}
        self._clock = -1

    def of(self, reading: Reading, earth: Earth) -> Iterator[RosMessage]:
        """Yield the messages of a reading."""
        now, name = nanoseconds(earth, reading.at_s), reading.vehicle
        if now > self._clock and isinstance(reading, (Gnss, EstimateReading, Truth)):
            self._clock = now
            yield RosMessage("/clock", "rosgraph_msgs/Clock", now, (_time(now),))
        if isinstance(reading, Compass):
            self._yaws[name] = reading.yaw
        elif isinstance(reading, Gnss):
            place, spread = (*reading.place, 0.0), np.diag([reading.sd_m**2] * 3)
            yield from _on_earth(f"/{name}/gnss", now, now, name, place, spread, earth)
            if name.startswith("ASV"):  # an AUV's is that of its navigator
                yield _transform(now, name, place, self._yaws.get(name))
        elif isinstance(reading, UsblReading):
            place, spread = reading.sight.place.tolist(), reading.sight.covariance
            yield _pose(f"/{name}/usbl/{reading.auv}", now, now, place, None, spread, UNKNOWN)
        elif isinstance(reading, FixReading):
            fix = reading.fix
            place, held = (fix.x_m, fix.y_m, fix.z_m), nanoseconds(earth, fix.valid_at_s)
            spread = _covariance(fix)
            yield _pose(f"/{name}/fix", now, held, place, None, spread, UNKNOWN)
            yield from _on_earth(f"/{name}/fix/navsat", now, held, MAP, place, spread, earth)
        elif isinstance(reading, EstimateReading):
            yield _odometry(now, reading)
            yield _transform(now, f"{name}/estimate", reading.place, None)
        elif isinstance(reading, Truth):
            nothing = np.zeros((3, 3))
            yield _pose(f"/truth/{name}", now, now, reading.place, reading.yaw, nothing, 0.0)


def nanoseconds(earth: Earth, at_s: float) -> int:
    """Return an instant of the mission (s) in nanoseconds of UTC since 1970."""
    microseconds = (earth.start - datetime(1970, 1, 1, tzinfo=UTC)) // timedelta(microseconds=1)
    return microseconds * 1000 + round(at_s * 1e9)


def _covariance(fix: Fix) -> Any:
    return np.array([
        [fix.sd_x_m**2, fix.cov_xy_m2, fix.cov_xz_m2],
        [fix.cov_xy_m2, fix.sd_y_m**2, fix.cov_yz_m2],
        [fix.cov_xz_m2, fix.cov_yz_m2, fix.sd_z_m**2],
    ])  # fmt: skip


def _pose(
    topic: str, now: int, held: int, place: Sequence[float], yaw: float | None, spread: Any,
    turn: float,
) -> RosMessage:  # fmt: skip
    content = (_time(held), MAP), _place_with_covariance(place, yaw, spread, turn)
    return RosMessage(topic, "geometry_msgs/PoseWithCovarianceStamped", now, content)


def _on_earth(
    topic: str, now: int, held: int, frame: str, place: Sequence[float], spread: Any, earth: Earth
) -> Iterator[RosMessage]:
    """Yield a place as NavSatFix, if the scenario is on Earth."""
    if earth.origin is not None:
        status, covariance = (FIX, GPS), enu_covariance(spread).ravel().tolist()
        content = (_time(held), frame), status, *earth.geodetic(place), covariance, KNOWN
        yield RosMessage(topic, "sensor_msgs/NavSatFix", now, content)


def _odometry(now: int, reading: EstimateReading) -> RosMessage:
    """Return where an AUV believes to be; its heading and velocity are not told."""
    (xx, xy), (_, yy) = reading.covariance
    spread = np.array([[xx, xy, 0.0], [xy, yy, 0.0], [0.0, 0.0, reading.depth_sd_m**2]])
    pose = _place_with_covariance(reading.place, None, spread, UNKNOWN)
    twist = ((0.0,) * 3, (0.0,) * 3), np.diag([UNKNOWN] * 6).ravel().tolist()
    content = (_time(now), MAP), f"{reading.vehicle}/estimate", pose, twist
    return RosMessage(f"/{reading.vehicle}/odometry", "nav_msgs/Odometry", now, content)


def _transform(now: int, frame: str, place: Sequence[float], yaw: float | None) -> RosMessage:
    moved = enu_from_ned(place).tolist(), quaternion(yaw)
    content = ([((_time(now), MAP), frame, moved)],)
    return RosMessage("/tf", "tf2_msgs/TFMessage", now, content)


class Bag:
    """A bag that is being written; encoder and sink of a session."""

    clients = 0

    def __init__(self, name: str, path: Path, *, replace: bool) -> None:
        """Begin a bag.

        Raises:
            OSError: when it cannot be written, or is there and not to be replaced.
        """
        if path.exists() and not replace:
            raise FileExistsError(errno.EEXIST, "File exists", str(path))
        with path.open("wb"):  # what is wrong with it is told as of any file
            pass
        self.name, self._speaker = name, Speaker()
        self._log = McapLog(path, MCAPWriteOptions(profile="ros2"), apart_ns=0)
        self.close, self.counts = self._log.close, self._log.counts

    def __call__(self, reading: Reading, earth: Earth) -> Sequence[bytes]:
        """Write what ROS 2 has words for."""
        for topic, kind, now, content in self._speaker.of(reading, earth):
            self._log.write(topic, now, cdr(kind, content), partial(_channel, kind))
        return ()

    def send(self, telegram: bytes) -> None:
        """Write nothing: all is written as it is read."""


def _channel(kind: str, topic: str, context: Context) -> Channel:
    text = definition(kind).encode()
    schema = Schema(name=kind.replace("/", "/msg/"), encoding="ros2msg", data=text)
    return Channel(topic, schema=schema, message_encoding="cdr", context=context)


def write_bag(result: "Result", path: Path, *, replace: bool = True) -> Mapping[str, int]:
    """Write the fixes that AUVs were given, their estimates and the truth (on `/truth/...`) of a
    mission as a bag, whose time begins at 0; return how many messages are on each topic.

    Raises:
        FileExistsError: when the file is there, and not to be replaced.
        OSError: when it cannot be written.
    """
    earth = earth_of(result.setup, datetime(1970, 1, 1, tzinfo=UTC))
    with draft_of(path, replace=replace) as draft:
        bag = Bag("ros2bag", draft, replace=True)
        try:
            for reading in sorted(_of_tables(result), key=lambda reading: reading.at_s):
                bag(reading, earth)
        finally:
            bag.close()
    return bag.counts


def _of_tables(result: "Result") -> Iterator[Reading]:
    """Yield the readings that tables keep."""
    depth_sd = result.scenario.navigation.depth_sd_m
    for row in result.arrow["tracks"].to_pylist():
        at_s, name = row["time_s"], row["vehicle"]
        yield Truth(at_s, name, (row["x_m"], row["y_m"], row["z_m"]), row["yaw_rad"])
        if row["estimate_x_m"] is not None:
            place = row["estimate_x_m"], row["estimate_y_m"], row["estimate_z_m"]
            xx, yy = row["estimate_sd_x_m"] ** 2, row["estimate_sd_y_m"] ** 2
            xy = row["estimate_cov_xy_m2"]
            yield EstimateReading(at_s, name, place, ((xx, xy), (xy, yy)), depth_sd)
    for row in result.arrow["fixes"].to_pylist():
        if row["outcome"] == "delivered":
            yield FixReading(row["delivered_at_s"], row["auv"], Fix(**row))
