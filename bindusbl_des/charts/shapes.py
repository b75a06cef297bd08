"""What is drawn on a chart: points, lines and polygons in latitude and longitude (WGS-84)."""

import math
from typing import NamedTuple

Degrees = tuple[float, float]

# No survey is longer (deg of latitude, some 1,000 km); a chart in metres seems to be.
LONGEST_DEG = 9.0


class BadChart(ValueError):
    """A file of places cannot be used; the message names file, place in it and remedy."""


class Shape(NamedTuple):
    """A shape of a chart: what it is, what a message calls it, its corners and its holes.

    `kind` is "point", "line" or "polygon"; `corners` are latitude and longitude (deg), of a polygon
    without the first one repeated; `holes` counts the rings within a polygon.
    """

    kind: str
    told: str
    corners: tuple[Degrees, ...]
    holes: int = 0


def position(lat: float, lon: float, place: str, order: str) -> Degrees:
    """Return latitude and longitude (deg) as they were read at a place of a file.

    `order` says how the format writes them, such as "[longitude, latitude]".

    Raises:
        BadChart: when they are none; it says what they seem to be instead.
    """
    if not (math.isfinite(lat) and math.isfinite(lon)):
        raise BadChart(f"{place}: {lat:g}, {lon:g} is no position; give finite numbers")
    if abs(lat) <= 90.0 and abs(lon) <= 180.0:
        return lat, lon
    if abs(lat) <= 180.0 and abs(lon) <= 90.0:
        raise BadChart(
            f"{place}: latitude {lat:.9g} is beyond 90 deg: latitude and longitude are swapped; "
            f"write {order}"
        )
    raise BadChart(
        f"{place}: latitude {lat:.9g}, longitude {lon:.9g} are no degrees (beyond 90 and 180); "
        f"metres, or a projected grid such as UTM? write {order} of WGS-84 in degrees"
    )


def checked(shape: Shape, place: str) -> Shape:
    """Return a line or polygon as it is, unless it is longer than any survey.

    Raises:
        BadChart: as :func:`position`.
    """
    lats = [lat for lat, _ in shape.corners]
    if max(lats) - min(lats) > LONGEST_DEG:
        raise BadChart(
            f"{place}: reaches over {max(lats) - min(lats):.3g} deg of latitude, more than "
            f"{111 * LONGEST_DEG:.0f} km; are these metres? They must be degrees of WGS-84"
        )
    return shape


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
