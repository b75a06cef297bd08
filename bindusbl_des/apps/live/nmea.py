"""NMEA 0183 sentences: what a vessel's GNSS, compass and USBL send, and what AUVs believe.

`$PSIMSSB` is that of Kongsberg's HPR and HiPAP, as EIVA's NaviPac reads it: cartesian, vessel head
up, so that x is to starboard and y forward.  Sources: NMEA 0183 4.10; EIVA, "The Kongsberg NMEA
format $PSIMSSB"; Tritech MicronNav manual 0656-SOM-00001, 7.2.10.
"""

import math
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from functools import reduce
from operator import xor

from .readings import Compass, Earth, EstimateReading, Gnss, Reading, UsblReading

KNOTS = 3600.0 / 1852.0  # in a m/s

# GGA: a fix of GNSS, or an estimate; what receivers write that nothing here depends on.
GNSS_FIX, ESTIMATED, SATELLITES, HDOP = 1, 6, 12, 0.9


def sentence(*fields: object) -> str:
    """Return a sentence with its checksum.

    >>> sentence("GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,").strip()
    '$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47'
    """
    text = ",".join(map(str, fields))
    return f"${text}*{checksum(text.encode('ascii')):02X}\r\n"


def checksum(text: bytes) -> int:
    """Return the exclusive or of all bytes between `$` and `*`."""
    return reduce(xor, text, 0)


def sentences(reading: Reading, earth: Earth) -> Iterator[str]:
    """Yield the sentences of a reading, at a place on Earth; none of what NMEA has no words for."""
    when = _to_the_hundredth(earth.utc(reading.at_s))
    time = f"{when:%H%M%S}.{when.microsecond // 10_000:02d}"
    if isinstance(reading, Gnss):
        lat, lon, _ = earth.geodetic(reading.place)
        yield _gga(time, lat, lon, GNSS_FIX, SATELLITES, earth.surface_m)
        speed, course = _over_ground(reading.velocity)
        where = f"{_latitude(lat)},{_longitude(lon)}"
        yield sentence("GPRMC", time, "A", where, speed, course, f"{when:%d%m%y}", "", "", "A")
        yield sentence("GPZDA", time, f"{when:%d,%m,%Y}", "00", "00")
    elif isinstance(reading, Compass):
        yield sentence("GPHDT", f"{_degrees(reading.yaw):.2f}", "T")
    elif isinstance(reading, UsblReading):
        yield _psimssb(time, reading)
    elif isinstance(reading, EstimateReading):
        lat, lon, _ = earth.geodetic(reading.place)
        yield _gga(time, lat, lon, ESTIMATED, 0, earth.surface_m - reading.place[2])


def _gga(time: str, lat: float, lon: float, quality: int, used: int, height: float) -> str:
    where = f"{_latitude(lat)},{_longitude(lon)}"
    sight = f"{quality},{used:02d},{HDOP}"
    return sentence("GPGGA", time, where, sight, f"{height:.2f}", "M", "0.0", "M", "", "")


def _psimssb(time: str, reading: UsblReading) -> str:
    starboard, forward, below = head_up(reading)
    beacon = f"B{int(reading.auv.removeprefix('AUV')) + 1:02d}"
    covariance = reading.sight.covariance
    accuracy = math.sqrt(max(covariance[0, 0] + covariance[1, 1], 0.0))
    place = f"{starboard:.3f},{forward:.3f},{below:.3f}"
    return sentence(
        "PSIMSSB", time, beacon, "A", "", "C", "H", "M", place, f"{accuracy:.3f}", "N", "", ""
    )


def head_up(reading: UsblReading) -> tuple[float, float, float]:
    """Return how far (m) to starboard, forward and below of itself a vessel has found an AUV."""
    sight = reading.sight
    x, y, z = (float(sight.place[axis]) - sight.own[axis] for axis in range(3))
    cosine, sine = math.cos(sight.yaw), math.sin(sight.yaw)
    return cosine * y - sine * x, cosine * x + sine * y, z


def _to_the_hundredth(when: datetime) -> datetime:
    """Return an instant in UTC, rounded to the last digit that sentences have of it.

    >>> _to_the_hundredth(datetime(2026, 12, 31, 23, 59, 59, 996_000, tzinfo=UTC)).year
    2027
    """
    rounded = when.astimezone(UTC) + timedelta(microseconds=5_000)
    return rounded.replace(microsecond=rounded.microsecond // 10_000 * 10_000)


def _over_ground(velocity: tuple[float, float] | None) -> tuple[str, str]:
    """Return speed (knots) and course (deg) over ground; of who rests there is no course."""
    if velocity is None:
        return "", ""
    speed = math.hypot(*velocity) * KNOTS
    course = round(math.degrees(math.atan2(velocity[1], velocity[0])), 1) % 360.0
    return f"{speed:.2f}", f"{course:.1f}" if speed >= 0.05 else ""


def _degrees(yaw: float) -> float:
    """Return a heading (rad) in [0, 360) degrees, as it is once it is rounded to 0.01."""
    return round(math.degrees(yaw) % 360.0, 2) % 360.0


def _latitude(lat: float) -> str:
    """Return a latitude as sentences have it.

    >>> _latitude(-54.5), _longitude(179.9999999999)
    ('5430.000000,S', '18000.000000,E')
    """
    degrees, minutes = _minutes(lat)
    return f"{degrees:02d}{minutes:09.6f},{'S' if lat < 0 else 'N'}"


def _longitude(lon: float) -> str:
    degrees, minutes = _minutes(lon)
    return f"{degrees:03d}{minutes:09.6f},{'W' if lon < 0 else 'E'}"


def _minutes(angle: float) -> tuple[int, float]:
    """Return whole degrees and minutes, which are rounded together: never 60 minutes."""
    millionths = round(abs(angle) * 60e6)
    degrees, rest = divmod(millionths, 60_000_000)
    return degrees, rest / 1e6
