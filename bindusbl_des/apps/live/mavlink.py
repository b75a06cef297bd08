"""What an AUV's autopilot is given: delivered fixes as MAVLink's GPS_INPUT, or as MAVProxy's JSON.

A message of MAVLink 2 is written and read as its serialisation guide says: fields by size, zeros at
the end left out, a checksum (CRC-16/MCRF4XX) with the message's extra byte.  Sources:
mavlink.io/en/guide/serialization.html; common.xml; MAVProxy's module GPSInput (UDP port 25100).
"""

import json
import math
import struct
from binascii import crc_hqx
from bisect import bisect_right
from collections import Counter
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime, timedelta
from typing import Any, NamedTuple

from .nmea import HDOP, SATELLITES
from .readings import Earth, EstimateReading, FixReading, Gnss, Reading

# Number, extra byte of the checksum and layout of each message that is spoken or understood.
GPS_INPUT, GPS_INPUT_EXTRA, GPS_INPUT_LAYOUT = 232, 151, struct.Struct("<QIii9fHHBBBH")
ATTITUDE, GLOBAL_POSITION_INT = 30, 33
UNDERSTOOD = {
    ATTITUDE: (39, struct.Struct("<I6f")),
    GLOBAL_POSITION_INT: (104, struct.Struct("<I4i3hH")),
}

MAGIC, MAGIC_1 = 0xFD, 0xFE  # MAVLink 2, and 1
HEADS = {MAGIC: 10, MAGIC_1: 6}  # bytes before the payload
COMPONENT = 220  # MAV_COMP_ID_GPS

# GPS time began, and is ahead of UTC by a second more from each of these days (year, month) on.
# Source: IERS Bulletin C, which up to June 2026 tells of no other.
GPS_BEGAN, WEEK_S = datetime(1980, 1, 6, tzinfo=UTC), 604_800
LEAPS = [
    datetime(year, month, 1, tzinfo=UTC)
    for year, month in (
        *((1981, 7), (1982, 7), (1983, 7), (1985, 7), (1988, 1), (1990, 1), (1991, 1), (1992, 7)),
        *((1993, 7), (1994, 7), (1996, 1), (1997, 7), (1999, 1), (2006, 1), (2009, 1), (2012, 7)),
        *((2015, 7), (2017, 1)),
    )
]

# Each byte with its bits in the other order.
MIRRORED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))

# Velocities and their accuracy are not known.
IGNORED, VERTICAL_ACCURACY = 8 | 16 | 32, 128

NO_FIX, FIX_3D = 0, 3

# An autopilot gives up GPS when nothing has come for so long (s): ArduPilot's GPS_TIMEOUT_MS.
STALE_S = 4.0


class GpsInput(NamedTuple):
    """The fields of GPS_INPUT, in the order in which they are sent; its time of week is that of the
    ping, at which the fix holds.
    """

    time_usec: int
    time_week_ms: int
    lat: int
    lon: int
    alt: float
    hdop: float
    vdop: float
    vn: float
    ve: float
    vd: float
    speed_accuracy: float
    horiz_accuracy: float
    vert_accuracy: float
    ignore_flags: int
    time_week: int
    gps_id: int
    fix_type: int
    satellites_visible: int
    yaw: int


NOTHING = GpsInput(
    0, 0, 0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, IGNORED, 0, 0, NO_FIX, 0, 0
)


class GpsInputs:
    """GPS inputs of AUVs: each fix as it is delivered; once that is stale, each second none."""

    def __init__(self) -> None:
        self._last: dict[str, float] = {}

    def of(self, reading: Reading, earth: Earth) -> GpsInput | None:
        """Return what a reading gives the autopilot of its AUV, if anything."""
        given = None
        if isinstance(reading, FixReading):
            fix, across = reading.fix, math.hypot(reading.fix.sd_x_m, reading.fix.sd_y_m)
            given = _fix((fix.x_m, fix.y_m, fix.z_m), fix.valid_at_s, across, earth)
            given = given._replace(alt=earth.surface_m - fix.z_m, vert_accuracy=fix.sd_z_m)
        elif isinstance(reading, Gnss) and reading.vehicle.startswith("AUV"):
            given = _fix(reading.place, reading.at_s, math.sqrt(2.0) * reading.sd_m, earth)
            flags = IGNORED | VERTICAL_ACCURACY
            given = given._replace(alt=earth.surface_m, ignore_flags=flags)
        elif isinstance(reading, EstimateReading):
            last = self._last.get(reading.vehicle, -math.inf)
            given = NOTHING if reading.at_s - last > STALE_S else None
        if given is None:
            return None
        if given is not NOTHING:
            self._last[reading.vehicle] = reading.at_s
        return given._replace(time_usec=_microseconds(earth.utc(reading.at_s)))


def _fix(place: Sequence[float], held_at_s: float, accuracy_m: float, earth: Earth) -> GpsInput:
    """Return a fix of a place (m) that held at an instant (s), with its accuracy across."""
    lat, lon, _ = earth.geodetic(place)
    week, week_ms = _gps_time(earth.utc(held_at_s))
    return NOTHING._replace(
        time_week=week,
        time_week_ms=week_ms,
        lat=round(lat * 1e7),
        lon=round(lon * 1e7),
        hdop=HDOP,
        vdop=HDOP,
        horiz_accuracy=accuracy_m,
        fix_type=FIX_3D,
        satellites_visible=SATELLITES,
    )


def _microseconds(when: datetime) -> int:
    return (when - datetime(1970, 1, 1, tzinfo=UTC)) // timedelta(microseconds=1)


def _gps_time(when: datetime) -> tuple[int, int]:
    """Return the GPS week of an instant (UTC), and the milliseconds in it.

    >>> _gps_time(datetime(2026, 6, 1, 8, 0, tzinfo=UTC))
    (2421, 115218000)
    """
    ahead = timedelta(seconds=bisect_right(LEAPS, when))
    milliseconds = round((when - GPS_BEGAN + ahead) / timedelta(milliseconds=1))
    return divmod(milliseconds, WEEK_S * 1000)


class Mavlink:
    """GPS_INPUT of each AUV: AUV0 is system 1."""

    def __init__(self) -> None:
        self._inputs, self._sent = GpsInputs(), Counter[int]()

    def __call__(self, reading: Reading, earth: Earth) -> Sequence[bytes]:
        given = self._inputs.of(reading, earth)
        if given is None:
            return ()
        system = int(reading.vehicle.removeprefix("AUV")) + 1
        self._sent[system] += 1
        payload = GPS_INPUT_LAYOUT.pack(*given)
        return [frame(self._sent[system] % 256, system, GPS_INPUT, GPS_INPUT_EXTRA, payload)]


def mavproxy() -> Any:
    """Return what encodes GPS inputs as lines of JSON, as MAVProxy's GPSInput reads them."""
    inputs = GpsInputs()

    def encoded(reading: Reading, earth: Earth) -> Sequence[bytes]:
        given = inputs.of(reading, earth)
        return () if given is None else [json.dumps(given._asdict()).encode() + b"\n"]

    return encoded


def frame(number: int, system: int, message: int, extra: int, payload: bytes) -> bytes:
    """Return a message of MAVLink 2."""
    payload = payload[:1] + payload[1:].rstrip(b"\0")
    header = bytes([len(payload), 0, 0, number, system, COMPONENT]) + message.to_bytes(3, "little")
    return bytes([MAGIC]) + header + payload + _checksum(header + payload + bytes([extra]))


def _checksum(data: bytes) -> bytes:
    """Return the checksum of a message, little-endian.

    >>> _checksum(b"123456789").hex()
    '916f'
    """
    # Python's takes the bits of each byte in the other order
    return crc_hqx(data.translate(MIRRORED), 0xFFFF).to_bytes(2, "big").translate(MIRRORED)


class MavlinkMessage(NamedTuple):
    """A message that is understood: who sent it (system), its number, and its fields."""

    system: int
    number: int
    fields: tuple[Any, ...]


def messages(data: bytes) -> Iterator[MavlinkMessage | None]:
    """Yield the messages in a datagram that are understood, None for one that is damaged; what is
    no message, or none of these, is passed.

    Only what has the right checksum is believed to be as long as it says: a message may begin at
    any byte of all else.
    """
    over = 0
    for at, byte in enumerate(data):
        head = HEADS.get(byte, 0)
        if not head or at < over or at + head > len(data):
            continue
        if _number(data[at : at + head], head) not in UNDERSTOOD:
            continue
        end = at + head + data[at + 1] + 2
        found = _message(data[at:end], head) if end <= len(data) else None
        yield found
        over = end if found else over


def _number(text: bytes, head: int) -> int:
    return int.from_bytes(text[7:10], "little") if head == 10 else text[5]


def _message(text: bytes, head: int) -> MavlinkMessage | None:
    number = _number(text, head)
    extra, layout = UNDERSTOOD[number]
    if _checksum(text[1:-2] + bytes([extra])) != text[-2:]:
        return None
    payload = text[head:-2].ljust(layout.size, b"\0")[: layout.size]
    return MavlinkMessage(text[5] if head == 10 else text[3], number, layout.unpack(payload))
