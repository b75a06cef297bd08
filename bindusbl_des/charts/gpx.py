"""Tracks in GPX files (topografix 1.1): points of latitude, longitude, UTC time and elevation."""

import math
from collections.abc import Iterator
from datetime import UTC, datetime

from .samples import Sample, above_sea
from .shapes import BadChart, position
from .xml_file import Element, read_xml


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


def _sample(told: str, point: Element) -> Sample:
    try:
        lat, lon = float(point.attributes["lat"]), float(point.attributes["lon"])
    except (KeyError, ValueError):
        raise BadChart(f"{told}: a trkpt needs numbers as lat and lon") from None
    place = position(lat, lon, told, 'lat="latitude" lon="longitude"')
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
