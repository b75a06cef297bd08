"""Results of reading charts: shapes on Earth, and samples of tracks."""

import math
from datetime import UTC, datetime
from itertools import pairwise
from typing import NamedTuple

from ...support.tables import Unmeasured

# What is drawn on a chart: points, lines and polygons in latitude and longitude (WGS-84).


Degrees = tuple[float, float]

# Longest survey (deg of latitude, some 1,000 km); a chart in metres seems to be longer.
LONGEST_DEG = 9.0


class BadChart(ValueError):
    """A file of places cannot be used; the message names file, place in it and remedy."""


class NoPlace(BadChart, Unmeasured):
    """A row of a file of positions that has none."""


class Shape(NamedTuple):
    """A shape of a chart: what it is, what a message calls it, its corners, its holes, its name.

    `kind` is "point", "line" or "polygon"; `corners` are latitude and longitude (deg), of a polygon
    without the first one repeated; so are `holes`, the rings within a polygon.
    """

    kind: str
    where: str
    corners: tuple[Degrees, ...]
    holes: tuple[tuple[Degrees, ...], ...] = ()
    name: str = ""


def position(lat: float, lon: float, place: str, order: str) -> Degrees:
    """Return latitude and longitude (deg) as read at a place of a file.

    `order` is the format's order, such as "[longitude, latitude]". Longitudes that count to 360, or
    go on beyond 180, are brought into -180 to 180.

    Raises:
        BadChart: when they are no degrees; it says what they seem to be instead.
    """
    if not (math.isfinite(lat) and math.isfinite(lon)):
        raise BadChart(f"{place}: {lat:g}, {lon:g} is no position; give finite numbers")
    if abs(lat) <= 90.0 and abs(lon) <= 180.0:
        return lat, lon
    if abs(lat) <= 90.0 and abs(lon) <= 360.0:
        return lat, math.remainder(lon, 360.0)
    if abs(lat) <= 360.0 and abs(lon) <= 90.0:
        raise BadChart(
            f"{place}: latitude {lat:.9g} is beyond 90 deg: latitude and longitude are swapped; "
            f"write {order}"
        )
    raise BadChart(
        f"{place}: latitude {lat:.9g}, longitude {lon:.9g} are no degrees (beyond 90 and 360); "
        f"metres, or a projected grid such as UTM? write {order} of WGS-84 in degrees, or name "
        "the grid of a GeoJSON file or a shapefile (crs: EPSG:32760)"
    )


def checked(shape: Shape) -> Shape:
    """Return a shape, unless it is longer than any survey, or a line of one position.

    Raises:
        BadChart: as :func:`position`.
    """
    if shape.kind == "line" and len(shape.corners) < 2:
        raise BadChart(f"{shape.where}: needs two positions; it has {len(shape.corners)}")
    first, *_ = shape.corners
    lats = [lat for lat, _ in shape.corners]
    across = math.cos(math.radians(min(map(abs, lats))))
    wide = [abs(math.remainder(lon - first[1], 360.0)) * across for _, lon in shape.corners]
    for reach, what in ((max(lats) - min(lats), "latitude"), (max(wide), "longitude")):
        if reach > LONGEST_DEG:
            raise BadChart(
                f"{shape.where}: reaches over {reach:.3g} deg of {what}, more than "
                f"{111 * LONGEST_DEG:.0f} km; are these metres? They must be degrees of WGS-84"
            )
    return shape


# A line whose ends are within this share of its length encloses an area: drawn or driven by hand,
# its last point is seldom exactly the first.
CLOSED = 0.02


def around(line: Shape) -> Shape | None:
    """Return the area that a line encloses; None if its ends do not meet."""
    corners = line.corners
    if len(corners) < 4:
        return None
    length = sum(_apart(one, following) for one, following in pairwise(corners))
    gap = _apart(corners[0], corners[-1])
    if gap > CLOSED * length:
        return None
    return line._replace(kind="polygon", corners=corners[: -1 if gap == 0.0 else None])


def _apart(one: Degrees, other: Degrees) -> float:
    """Return the distance of two positions (deg of latitude), for comparisons."""
    east = math.remainder(other[1] - one[1], 360.0)  # the shorter arc, across 180 deg as well
    return math.hypot(other[0] - one[0], east * math.cos(math.radians(one[0])))


def ring(corners: list[Degrees], place: str) -> tuple[Degrees, ...]:
    """Return the corners of a closed ring, the first not repeated.

    Raises:
        BadChart: when it is not closed, or has fewer than three corners.
    """
    if len(corners) < 4:
        raise BadChart(
            f"{place}: its ring has {len(corners)} positions; a polygon needs three corners and "
            "the first again"
        )
    if corners[0] != corners[-1]:
        raise BadChart(f"{place}: its ring is not closed; repeat its first position at its end")
    return tuple(corners[:-1])


# One sample of a recorded track.


class Sample(NamedTuple):
    """A sample: its line, time (s), x and y (m) or latitude and longitude (deg), and depth (m).

    The depth is nan where the file says none.  It is below the water; or below the sea, wherever
    the water is, if it `is_height`; or, if `below_ellipsoid`, below the ellipsoid of WGS-84, which
    falls away from the survey's plane with the distance.
    """

    where: str
    time: float
    place: Degrees
    depth: float
    in_degrees: bool
    below_ellipsoid: bool = False
    is_height: bool = False


# Latest instant of a mission (s of Unix time), the year 5000; milliseconds are soon beyond it.
LATEST_S = 1e11
PARTS = ("milliseconds", "microseconds", "nanoseconds")


def check_seconds(where: str, name: str, time: float) -> None:
    """Refuse an instant that seems to be in fractions of a second.

    Raises:
        BadChart: naming them.
    """
    if abs(time) > LATEST_S:
        unit = min(int(math.log10(abs(time) / LATEST_S) // 3), len(PARTS) - 1)
        raise BadChart(
            f"{where}: {name} is {time:.15g}, later than any mission; times look like "
            f"{PARTS[unit]}: divide them by {10 ** (3 * unit + 3):,}"
        )


def unix_time(where: str, text: str) -> float:
    """Return an instant of ISO 8601 as Unix time (s); UTC unless it says otherwise.

    Raises:
        BadChart: when it is not one.
    """
    try:
        instant = datetime.fromisoformat(text)
        return (instant if instant.tzinfo else instant.replace(tzinfo=UTC)).timestamp()
    except (ValueError, OverflowError):
        raise BadChart(
            f"{where}: {text[:40]!r} is no time; write it as 2026-11-22T14:55:00.250Z"
        ) from None


def above_sea(where: str, height: float) -> float:
    """Return the depth (m) of a height above the water, which may be a little above, as waves are.

    Raises:
        BadChart: when it is far above: heights by GNSS are above the ellipsoid, not above the sea.
    """
    if not math.isfinite(height):
        raise BadChart(f"{where}: its height is {height:g}; leave it out if it is unknown")
    if height > HIGHEST:
        raise BadChart(
            f"{where}: is {height:.4g} m above the sea; heights must be negative below it. Remove "
            "them from the file to have the AUV at survey.depth_m, or give the height of a lake or "
            "river (environment.surface_m)"
        )
    return -height


def in_sea(where: str, depth: float) -> float:
    """Return a depth (m), which may be slightly above the sea, by waves.

    Raises:
        BadChart: when it is far above: a column of heights, or one that counts upwards.
    """
    if depth < -HIGHEST:
        raise BadChart(
            f"{where}: a depth of {depth:.4g} m is above the sea; depths must be positive below "
            "it. Turn the sign of the column if it holds heights"
        )
    return depth


# Highest wave (m); a larger height is that of a receiver ashore, or above an ellipsoid.
HIGHEST = 5.0
