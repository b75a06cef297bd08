"""Positions as texts: in degrees and minutes, and in grids by their EPSG codes.

Nothing here needs numpy, and pyproj only a grid.
"""

import math
import re
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

from ...support.wording import shortened
from .shapes import BadChart, Degrees

EXTRA = "install them with: python -m pip install 'bindusbl-des[gis]'"
MISSING = f"the packages pyproj and pyogrio, which are not installed here; {EXTRA}"

# Sides of latitude and longitude, the positive one first, and how far they go (deg).
NORTHING, EASTING = "NS", "EW"
SIDES = {NORTHING: ("latitude", 90.0), EASTING: ("longitude", 180.0)}
EXAMPLES = {NORTHING: ("-33.857", "33 51.4 S"), EASTING: ("151.209", "151 12.5 E")}

_NUMBER = r"\d+(?:[.,]\d+)?"
# Signs of degrees and, as some programs write them, of minutes and seconds
_DEGREES, _PRIMES = "°º", "'\u2032\u2019"
_ANGLE = re.compile(
    rf"([+-]?)({_NUMBER})(?:\s*[{_DEGREES}:\s-]\s*({_NUMBER})(?:\s*[{_PRIMES}:\s]\s*({_NUMBER}))?)?"
    rf"\s*[{_DEGREES}{_PRIMES}\"\u2033\u201d]*"
)
_GRID = re.compile(r"(EPSG:\d+)[\s,;]+(.+)", re.IGNORECASE)


def angle(text: str, sides: str) -> float:
    """Return a latitude (`sides` NORTHING) or a longitude (EASTING), deg, of its text.

    It is in degrees, degrees and minutes, or degrees, minutes and seconds, with a sign, or with
    the letter of its side before or behind.

    >>> angle("33 51.4 S", NORTHING), angle("E 10°10'48\\"", EASTING), angle("-33.5", NORTHING)
    (-33.85666666666667, 10.18, -33.5)

    Raises:
        BadChart: saying what is wrong, and how to write it.
    """
    what, most = SIDES[sides]
    plain, degrees_and_minutes = EXAMPLES[sides]
    written, side = text.strip(), ""
    for part, rest in ((written[:1], written[1:]), (written[-1:], written[:-1])):
        if part.isalpha() and not side:
            side, written = part.upper(), rest.strip()
    found = _ANGLE.fullmatch(written)
    if found is None or (side and side not in sides) or (side and found[1]):
        raise BadChart(
            f"{shortened(repr(text))} is no {what}; write degrees ({plain}), or degrees and "
            f"minutes ({degrees_and_minutes})"
        )
    parts = [part.replace(",", ".") for part in found.groups()[1:] if part]
    if any("." in part for part in parts[:-1]) or any(float(part) >= 60.0 for part in parts[1:]):
        raise BadChart(
            f"{shortened(repr(text))} is no {what}; minutes and seconds are below 60, and only the "
            f"last part has decimals, as in {degrees_and_minutes}"
        )
    value = sum(float(part) / 60.0**power for power, part in enumerate(parts))
    if value > most:
        raise BadChart(f"{shortened(repr(text))} is beyond {most:g} deg, so no {what}")
    return -value if sides[1] == side or found[1] == "-" else value


def place(text: str) -> Degrees:
    """Return latitude and longitude (deg) of a place's text: an angle with its side each, or a code
    and the two numbers of a grid, east first where they have no letters.

    >>> place("33 51.4 S, 151 12.5 E")
    (-33.85666666666667, 151.20833333333334)

    Raises:
        BadChart: saying what is wrong, and how to write it.
    """
    grid = _GRID.fullmatch(text.strip())
    if grid is not None:
        return to_degrees(grid[1])([_on_grid(text, grid[2])])[0]
    written = text.strip().upper()
    letters = [at for at, letter in enumerate(written) if letter in NORTHING + EASTING]
    if len(letters) != 2:
        raise BadChart(
            f'{shortened(repr(text))} is no place; write "33 51.4 S, 151 12.5 E", or a code and '
            'the numbers of its grid, east first: "EPSG:32756 334368 6252057"'
        )
    at = letters[1] if letters[0] == 0 else letters[0] + 1
    parts = [part.strip(" ,;\t") for part in (written[:at], written[at:])]
    if set(parts[0]) & set(EASTING):
        parts.reverse()
    return angle(parts[0], NORTHING), angle(parts[1], EASTING)


def _on_grid(text: str, numbers: str) -> tuple[float, float]:
    """Return east and north (m) of the two numbers of a grid."""
    found = re.fullmatch(
        r"([+-]?\d+(?:\.\d+)?)\s*m?\s*([EN]?)[\s,;]+([+-]?\d+(?:\.\d+)?)\s*m?\s*([EN]?)",
        numbers.strip(),
        re.IGNORECASE,
    )
    letters = "" if found is None else (found[2] + found[4]).upper()
    if found is None or letters not in ("", "EN", "NE"):
        raise BadChart(
            f"{shortened(repr(text))} is no place of a grid; write its code and two numbers in "
            'metres, east first: "EPSG:32756 334368 6252057"'
        )
    east, north = float(found[1]), float(found[3])
    return (north, east) if letters == "NE" else (east, north)


# What lies so far (deg) beyond where a grid is used was not meant.
BEYOND_DEG = 10.0

InDegrees = Callable[[Sequence[tuple[float, float]]], list[Degrees]]


@cache
def grid_of(code: str) -> tuple[Any, Any]:
    """Return the coordinate system of a code, and what transforms its places, east and north, to
    longitude and latitude (deg, WGS-84).

    Raises:
        BadChart: when there is no such code, it is of no grid, or pyproj is not installed.
    """
    try:
        from pyproj import CRS, Transformer
        from pyproj.exceptions import CRSError
    except ModuleNotFoundError:
        raise BadChart(f"{code} needs {MISSING}") from None
    try:
        grid = CRS.from_user_input(code)
    except CRSError:
        raise BadChart(
            f"{shortened(code)} is no code of a coordinate system; write such as EPSG:32760 (UTM: "
            "EPSG:326 and the zone north of the equator, EPSG:327 and the zone south of it)"
        ) from None
    if not (grid.is_projected or grid.is_geographic):
        raise BadChart(f"{code} ({grid.name}) is no grid of places on a map; name its map grid")
    return grid, Transformer.from_crs(grid, "EPSG:4326", always_xy=True)


@cache
def to_degrees(code: str) -> InDegrees:
    """Return what turns places of a grid, east and north in its unit, into latitude and longitude
    (deg, WGS-84); `code` is such as EPSG:32760.

    Raises:
        BadChart: when there is no such code, it is of no grid, or pyproj is not installed; so does
            what is returned, of a place that is nowhere in that grid.
    """
    grid, transformer = grid_of(code)
    used = grid.area_of_use

    def in_degrees(places: Sequence[tuple[float, float]]) -> list[Degrees]:
        if grid.is_projected and all(abs(x) <= 180.0 and abs(y) <= 90.0 for x, y in places):
            raise BadChart(
                f"{places[0][0]:.10g}, {places[0][1]:.10g} are degrees, it seems, and {code} "
                f"({grid.name}) is in metres; remove the code, or give that of degrees (EPSG:4326)"
            )
        found = [transformer.transform(x, y) for x, y in places]
        for (x, y), (lon, lat) in zip(places, found, strict=True):
            if not _is_used(used, lat, lon):
                swapped = transformer.transform(y, x)
                remedy = "give another code"
                if _is_used(used, swapped[1], swapped[0]):
                    remedy = "north and east are swapped: write east first"
                raise BadChart(
                    f"{x:.10g}, {y:.10g} is far from where {code} ({grid.name}) is used; {remedy}"
                )
        return [(lat, math.remainder(lon, 360.0)) for lon, lat in found]

    return in_degrees


def _is_used(used: Any, lat: float, lon: float) -> bool:
    """Return whether a position (deg) is roughly within the area for which a grid is made; true if
    that is unknown.
    """
    if not (math.isfinite(lat) and math.isfinite(lon)) or abs(lat) > 90.0:
        return False
    if used is None:
        return True
    wide = (used.east - used.west) % 360.0 or 360.0
    east = (lon - used.west + BEYOND_DEG) % 360.0
    is_along = bool(east <= wide + 2.0 * BEYOND_DEG)
    return is_along and bool(used.south - BEYOND_DEG <= lat <= used.north + BEYOND_DEG)
