"""A bag for ROS 2: readings as its own messages, CDR in one MCAP file, which `ros2 bag` plays.

Positions are east, north, up (REP 103) in the frame `map`, whose origin is x = y = 0 at the
surface.  Sources: REP 103, 105; OMG DDSI-RTPS 2.2, chapter 10 (CDR); mcap.dev, registry (ros2).
"""

import errno
import math
import struct
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import foxglove
import numpy as np
from foxglove import Channel, Context, Schema
from foxglove.mcap import MCAPWriteOptions

from ..core.files import draft_of
from ..geometry.geodesy import enu_covariance, enu_from_ned, enu_yaw
from ..records.events import Fix
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
    from ..results.result import Result

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


class Cdr:
    """A message in CDR, little-endian: each number at a multiple of its size."""

    def __init__(self) -> None:
        self._data = bytearray()

    def put(self, code: str, *values: float) -> "Cdr":
        """Append numbers of a kind of `struct`."""
        size = struct.calcsize(code)
        self._data += bytes(-len(self._data) % size)
        self._data += struct.pack(f"<{len(values)}{code}", *values)
        return self

    def text(self, text: str) -> "Cdr":
        """Append a text: its length with a zero at the end, then both."""
        encoded = text.encode() + b"\0"
        self.put("I", len(encoded))
        self._data += encoded
        return self

    def time(self, nanoseconds: int) -> "Cdr":
        seconds, rest = divmod(nanoseconds, 1_000_000_000)
        return self.put("i", seconds).put("I", rest)

    def header(self, nanoseconds: int, frame: str = MAP) -> "Cdr":
        return self.time(nanoseconds).text(frame)

    def pose(self, place: Sequence[float], yaw: float | None, spread: Any, turn: float) -> "Cdr":
        """Append a PoseWithCovariance: a place (NED, m), a yaw (rad, None if unknown), and their
        covariance: of the place (3, 3), m2, and of the yaw (rad2).
        """
        self.put("d", *enu_from_ned(place).tolist(), *quaternion(yaw))
        covariance = np.zeros((6, 6))
        covariance[:3, :3] = enu_covariance(spread)
        covariance[3:, 3:] = np.diag([turn] * 3)
        return self.put("d", *covariance.ravel().tolist())

    @property
    def data(self) -> bytes:
        """The message, after the header that says how it is written."""
        return b"\x00\x01\x00\x00" + bytes(self._data)


def quaternion(yaw: float | None) -> tuple[float, float, float, float]:
    """Return x, y, z, w of a heading (rad, from north towards east), ENU."""
    half = 0.0 if yaw is None else enu_yaw(yaw) / 2
    return 0.0, 0.0, math.sin(half), math.cos(half)


class RosMessage(NamedTuple):
    """A message: topic, kind, log time (ns) and content."""

    topic: str
    kind: str
    at_ns: int
    data: bytes


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
            yield RosMessage("/clock", "rosgraph_msgs/Clock", now, Cdr().time(now).data)
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
    text = Cdr().header(held).pose(place, yaw, spread, turn)
    return RosMessage(topic, "geometry_msgs/PoseWithCovarianceStamped", now, text.data)


def _on_earth(
    topic: str, now: int, held: int, frame: str, place: Sequence[float], spread: Any, earth: Earth
) -> Iterator[RosMessage]:
    """Yield a place as NavSatFix, if the scenario is on Earth."""
    if earth.origin is not None:
        text = Cdr().header(held, frame).put("b", FIX).put("H", GPS)
        text.put("d", *earth.geodetic(place)).put("d", *enu_covariance(spread).ravel().tolist())
        yield RosMessage(topic, "sensor_msgs/NavSatFix", now, text.put("B", KNOWN).data)


def _odometry(now: int, reading: EstimateReading) -> RosMessage:
    """Return where an AUV believes to be; its heading and velocity are not told."""
    (xx, xy), (_, yy) = reading.covariance
    spread = np.array([[xx, xy, 0.0], [xy, yy, 0.0], [0.0, 0.0, reading.depth_sd_m**2]])
    text = Cdr().header(now).text(f"{reading.vehicle}/estimate")
    text.pose(reading.place, None, spread, UNKNOWN)
    text.put("d", *[0.0] * 6).put("d", *np.diag([UNKNOWN] * 6).ravel().tolist())
    return RosMessage(f"/{reading.vehicle}/odometry", "nav_msgs/Odometry", now, text.data)


def _transform(now: int, frame: str, place: Sequence[float], yaw: float | None) -> RosMessage:
    text = Cdr().put("I", 1).header(now).text(frame)
    text.put("d", *enu_from_ned(place).tolist(), *quaternion(yaw))
    return RosMessage("/tf", "tf2_msgs/TFMessage", now, text.data)


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
        self.name, self._speaker, self._context = name, Speaker(), Context()
        self._channels: dict[str, Channel] = {}
        self._latest: dict[str, int] = {}
        #: How many messages are on each topic.
        self.counts: Counter[str] = Counter()
        with path.open("wb"):  # what is wrong with it is told as of any file
            pass
        self._file: Any = foxglove.open_mcap(
            path,
            allow_overwrite=True,
            context=self._context,
            writer_options=MCAPWriteOptions(profile="ros2"),
        )

    def __call__(self, reading: Reading, earth: Earth) -> Sequence[bytes]:
        """Write what ROS 2 has words for."""
        for topic, kind, now, data in self._speaker.of(reading, earth):
            if topic not in self._channels:
                text = definition(kind).encode()
                schema = Schema(name=kind.replace("/", "/msg/"), encoding="ros2msg", data=text)
                self._channels[topic] = Channel(
                    topic, schema=schema, message_encoding="cdr", context=self._context
                )
            self._latest[topic] = max(now, self._latest.get(topic, 0))
            self.counts[topic] += 1
            self._channels[topic].log(data, log_time=self._latest[topic])
        return ()

    def send(self, telegram: bytes) -> None:
        """Write nothing: all is written as it is read."""

    def close(self) -> None:
        """End the bag, so that it can be played.

        Raises:
            OSError: when the disk is full.
        """
        for channel in self._channels.values():
            channel.close()
        self._channels = {}
        done, self._file = self._file, None
        if done is not None:
            try:
                done.close()
            except RuntimeError as error:
                raise OSError(errno.EIO, f"is the disk full? {error}") from error


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
