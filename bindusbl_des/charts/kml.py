"""KML (OGC 07-147r2): placemarks with points, lines, polygons, "longitude,latitude[,altitude]"."""

from collections.abc import Iterator
from pathlib import Path

from ..core.wording import shortened
from .shapes import BadChart, Degrees, Shape, checked, position, ring
from .xml_file import Element, read_xml

ORDER = "longitude,latitude"
KINDS = {"Point": "point", "LineString": "line", "Polygon": "polygon"}


def read_kml(path: str | Path) -> list[Shape]:
    """Return the shapes of a KML file in its order.

    Raises:
        BadChart: naming file, line and remedy.
    """
    root = read_xml(path, "kml")
    return [shape for mark in root.within("Placemark") for shape in _shapes(mark, str(path))]


def _shapes(mark: Element, path: str) -> Iterator[Shape]:
    name = mark.said("name")
    for geometry in mark.within(*KINDS):
        place = f"{path}:{geometry.line}: {geometry.name}"
        told = f"{place} ({shortened(repr(name))})" if name else place
        yield checked(_shape(geometry, path, told), told)


def _shape(geometry: Element, path: str, told: str) -> Shape:
    kind = KINDS[geometry.name]
    if kind == "polygon":
        outer = next(geometry.within("outerBoundaryIs"), None)
        if outer is None:
            raise BadChart(f"{told}: needs an outerBoundaryIs with a LinearRing")
        holes = len(list(geometry.within("innerBoundaryIs")))
        return Shape(kind, told, ring(_positions(outer, path, told), told), holes)
    corners = tuple(_positions(geometry, path, told))
    if len(corners) < 2 and kind == "line":
        raise BadChart(f"{told}: needs two positions; it has {len(corners)}")
    return Shape(kind, told, corners)


def _positions(within: Element, path: str, told: str) -> list[Degrees]:
    found = next(within.within("coordinates"), None)
    if found is None or not found.text.strip():
        raise BadChart(f"{told}: has no coordinates")
    return [_position(text, f"{path}:{found.line}") for text in found.text.split()]


def _position(text: str, place: str) -> Degrees:
    parts = text.split(",")
    try:
        lon, lat = float(parts[0]), float(parts[1])
    except (ValueError, IndexError):
        raise BadChart(
            f"{place}: {shortened(repr(text))} is no position; write {ORDER} without a blank "
            "between them, such as 10.18,54.33"
        ) from None
    return position(lat, lon, place, ORDER)
