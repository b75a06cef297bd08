"""GPX files (topografix 1.1): tracks of latitude, longitude, UTC time and elevation; outlines."""

import math
from collections.abc import Iterator
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path

from .samples import Sample, above_sea
from .shapes import BadChart, Degrees, Shape, checked, position
from .xml_file import Element, read_xml

# A line whose ends are this near each other, as a share of its length, goes around an area: drawn
# or driven by hand, its last point is seldom the first.
CLOSED = 0.02


def read_gpx(path: str) -> Iterator[tuple[str, Sample]]:
    """Yield the samples of a GPX file in Unix time, each with the name of its track.

    Elevations are heights above the sea, so that depths are negative; a track without a name has
    its number from 0 for one.  The segments of a track follow one another.

    Raises:
        BadChart: naming file, line and remedy.
    """
    for number, track in enumerate(read_xml(path, "gpx").within("trk")):
        name = track.said("name") or str(number)
        for point in track.within("trkpt"):
            yield name, _sample(f"{path}:{point.line}", point)


def read_gpx_shapes(path: str | Path) -> list[Shape]:
    """Return routes, segments of tracks and waypoints as shapes; what ends where it began is a
    polygon: GPX has no others.

    Raises:
        BadChart: naming file, line and remedy.
    """
    root = read_xml(path, "gpx")
    lines = [_outline(path, it, "rtept") for it in root.within("rte")]
    lines += [_outline(path, it, "trkpt") for it in root.within("trkseg")]
    points = [(f"{path}:{it.line}: wpt", it) for it in root.within("wpt")]
    return [*lines, *(Shape("point", told, (_place(told, it),)) for told, it in points)]


def _outline(path: str | Path, line: Element, name: str) -> Shape:
    told = f"{path}:{line.line}: {line.name}"
    corners = tuple(_place(f"{path}:{it.line}", it) for it in line.within(name))
    if len(corners) < 2:
        raise BadChart(f"{told}: needs two positions; it has {len(corners)}")
    around = sum(_apart(one, next_) for one, next_ in pairwise(corners))
    gap = _apart(corners[0], corners[-1])
    if len(corners) < 4 or gap > CLOSED * around:
        return checked(Shape("line", told, corners), told)
    return checked(Shape("polygon", told, corners[: -1 if gap == 0.0 else None]), told)


def _apart(one: Degrees, other: Degrees) -> float:
    """Return how far apart two places are (deg of latitude), for comparing."""
    return math.hypot(other[0] - one[0], (other[1] - one[1]) * math.cos(math.radians(one[0])))


def _place(told: str, point: Element) -> Degrees:
    try:
        lat, lon = float(point.attributes["lat"]), float(point.attributes["lon"])
    except (KeyError, ValueError):
        raise BadChart(f"{told}: a {point.name} needs numbers as lat and lon") from None
    return position(lat, lon, told, 'lat="latitude" lon="longitude"')


def _sample(told: str, point: Element) -> Sample:
    place = _place(told, point)
    return Sample(told, _unix(told, point.said("time")), place, _depth(told, point), True)


def _unix(told: str, text: str) -> float:
    """Return an instant of ISO 8601 as Unix time (s); it is UTC unless it says otherwise."""
    if not text:
        raise BadChart(f"{told}: has no <time>; a track needs one at each point, a route has none")
    try:
        instant = datetime.fromisoformat(text)
        return (instant if instant.tzinfo else instant.replace(tzinfo=UTC)).timestamp()
    except (ValueError, OverflowError):
        raise BadChart(
            f"{told}: {text[:40]!r} is no time; write it as 2026-11-22T14:55:00.250Z"
        ) from None


def _depth(told: str, point: Element) -> float:
    text = point.said("ele")
    if not text:
        return math.nan
    try:
        return above_sea(told, float(text))
    except ValueError as error:
        if isinstance(error, BadChart):
            raise
        raise BadChart(f"{told}: {text[:40]!r} is no elevation in metres") from None
