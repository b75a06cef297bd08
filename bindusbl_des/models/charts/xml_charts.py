"""Charts in XML: areas and lines in KML and KMZ, tracks, routes and areas in GPX."""

import math
import re
import zipfile
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any
from xml.parsers import expat

from ...support.files import regular, text_of
from ...support.wording import shortened
from .shapes import (
    BadChart,
    Degrees,
    Sample,
    Shape,
    checked,
    position,
    ring,
    unix_time,
)

# XML read as a tree of plain elements, each with its line; what could be an attack is refused.
#
# Entities are declared in a document type, and neither KML nor GPX needs one: without them a file
# costs no more than its length, and reads no other (CWE-776, CWE-611).


LARGEST_FILE = 32_000_000

# A file of a few megabytes can have millions of empty elements, each with its line and its lists.
MOST_ELEMENTS = 400_000

# A declaration of another encoding than UTF-8; many files in Windows-1252 declare UTF-8 or nothing.
OTHER_ENCODING = re.compile(rb"<\?xml[^>]*encoding=.(?!utf-8)", re.IGNORECASE)

# KML nests folders, but not like this; a limit keeps walks over the tree short.
DEEPEST = 60


@dataclass
class Element:
    """An element: its name without namespace, its line, attributes, text and children."""

    name: str
    line: int
    attributes: dict[str, str]
    text: str = ""
    children: list["Element"] = field(default_factory=list)

    def within(self, *names: str) -> Iterator["Element"]:
        """Yield the outermost elements with some names in it, at any depth, in the order of the
        file.
        """
        for child in self.children:
            if child.name in names:
                yield child
            else:
                yield from child.within(*names)

    def child(self, name: str) -> "Element | None":
        """Return its first child with a name."""
        return next((child for child in self.children if child.name == name), None)

    def text_in(self, name: str) -> str:
        """Return the text of its first child with a name, "" if there is none."""
        child = self.child(name)
        return child.text.strip() if child else ""


def read_xml(path: str | Path, root: str) -> Element:
    """Return the root element of an XML file, which must have a name such as `kml`.

    Raises:
        BadChart: naming file, line and remedy.
    """
    try:
        with open(regular(path, LARGEST_FILE), "rb") as file:
            return _tree(file.read(), str(path), root)
    except OSError as error:
        raise BadChart(f"{path}: cannot be read ({error.strerror})") from None


def _tree(raw: bytes, path: str, root: str) -> Element:
    if raw.startswith(b"PK"):
        raise BadChart(f"{path}: is a zip archive; if it is a KMZ, let its name end in .kmz")
    found = _Tree(path).read(raw)
    if found.name != root:
        raise BadChart(f"{path}:{found.line}: begins with <{found.name}>; expected <{root}>")
    return found


class _Tree:
    """Builds the tree of elements from an XML parser's events."""

    def __init__(self, path: str) -> None:
        self.path, self.top, self.open = path, Element("", 0, {}), list[Element]()
        self.count = 0
        # Prefixes are left as they are: many programs use some (xsi, gx) that they do not declare
        self.parser: Any = expat.ParserCreate()
        self.parser.buffer_text = True
        self.parser.StartDoctypeDeclHandler = self._refuse
        self.parser.StartElementHandler = self._begin
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._add

    def read(self, raw: bytes) -> Element:
        self.open = [self.top]
        try:
            self.parser.Parse(raw if OTHER_ENCODING.match(raw) else text_of(raw), True)
        except (expat.ExpatError, LookupError, ValueError) as error:  # BadChart is a ValueError
            if isinstance(error, BadChart):
                raise
            raise BadChart(f"{self.path}: is no XML: {error}") from None
        return self.top.children[0]

    def _refuse(self, *_: object) -> None:
        raise BadChart(
            f"{self.path}:{self.parser.CurrentLineNumber}: declares a document type, which may "
            "hide other files in it; remove the line <!DOCTYPE ...>"
        )

    def _begin(self, name: str, attributes: dict[str, str]) -> None:
        if len(self.open) > DEEPEST:
            raise BadChart(f"{self.path}: is nested deeper than {DEEPEST} levels")
        plain = {key.rpartition(":")[2]: value for key, value in attributes.items()}
        self.count += 1
        if self.count > MOST_ELEMENTS:
            raise BadChart(
                f"{self.path}: has more than {MOST_ELEMENTS:,} elements; leave in it what is needed"
            )
        element = Element(name.rpartition(":")[2], self.parser.CurrentLineNumber, plain)
        self.open[-1].children.append(element)
        self.open.append(element)

    def _end(self, _: str) -> None:
        self.open.pop()

    def _add(self, text: str) -> None:
        self.open[-1].text += text


# KML (OGC 07-147r2): placemarks with points, lines, polygons, "longitude,latitude[,altitude]".


ORDER = "longitude,latitude"
KINDS = {"Point": "point", "LineString": "line", "LinearRing": "line", "Polygon": "polygon"}


def read_kml(path: str | Path) -> list[Shape]:
    """Return the shapes of a KML file in its order.

    Raises:
        BadChart: naming file, line and remedy.
    """
    return _marked(read_xml(path, "kml"), str(path))


def read_kmz(path: str | Path) -> list[Shape]:
    """Return the shapes of the first KML in a KMZ file, a zip archive.

    Raises:
        BadChart: naming file, line and remedy.
    """
    try:
        with zipfile.ZipFile(regular(path, LARGEST_FILE)) as archive:
            inside = [name for name in archive.namelist() if name.lower().endswith(".kml")]
            if not inside:
                raise BadChart(f"{path}: holds no .kml; save it anew, or save KML")
            with archive.open(inside[0]) as file:
                raw = file.read(LARGEST_FILE + 1)
    except OSError as error:
        raise BadChart(f"{path}: cannot be read ({error.strerror})") from None
    except (zipfile.BadZipFile, zlib.error, RuntimeError, EOFError) as error:
        what = "is empty" if not Path(path).stat().st_size else f"is no KMZ: {error}"
        raise BadChart(f"{path}: {what}; save it anew, or save KML") from None
    if len(raw) > LARGEST_FILE:
        raise BadChart(f"{path}: {inside[0]} in it is larger than {LARGEST_FILE:,} bytes")
    where = f"{path}: {shortened(inside[0])}"
    return _marked(_tree(raw, where, "kml"), where)


def _marked(root: Element, path: str) -> list[Shape]:
    return [shape for mark in root.within("Placemark") for shape in _shapes(mark, path)]


def _shapes(mark: Element, path: str) -> Iterator[Shape]:
    name = mark.text_in("name")
    for geometry in mark.within(*KINDS):
        place = f"{path}:{geometry.line}: {geometry.name}"
        where = f"{place} ({shortened(repr(name))})" if name else place
        yield checked(_shape(geometry, path, where)._replace(name=name))


def _shape(geometry: Element, path: str, where: str) -> Shape:
    kind = KINDS[geometry.name]
    if kind == "polygon":
        outer = next(geometry.within("outerBoundaryIs"), None)
        if outer is None:
            raise BadChart(f"{where}: needs an outerBoundaryIs with a LinearRing")
        inner = geometry.within("innerBoundaryIs")
        holes = (ring(_positions(hole, path, where), f"{where}: a hole") for hole in inner)
        return Shape(kind, where, ring(_positions(outer, path, where), where), tuple(holes))
    return Shape(kind, where, tuple(_positions(geometry, path, where)))


def _positions(within: Element, path: str, where: str) -> list[Degrees]:
    found = next(within.within("coordinates"), None)
    if found is None or not found.text.strip():
        raise BadChart(f"{where}: has no coordinates")
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


# GPX files (topografix 1.1): tracks of latitude, longitude, UTC time and elevation; outlines.


def read_gpx(path: str) -> Iterator[tuple[str, Callable[[], Sample]]]:
    """Yield functions that read the samples of a GPX file in Unix time, each with its track's name.

    Elevations are heights above the sea, so that depths are negative; a track without a name has
    its number from 0 instead.  The segments of a track follow one another.

    Raises:
        BadChart: naming file, line and remedy.
    """
    root = read_xml(path, "gpx")
    if any(root.within("rte")) and not any(root.within("trk")):
        raise BadChart(
            f"{path}: holds routes, whose points have no times, and no track; routes are flown by "
            "auvs.route.kind: waypoints"
        )
    for number, track in enumerate(root.within("trk")):
        name = track.text_in("name") or str(number)
        for point in track.within("trkpt"):
            yield name, partial(_sample, f"{path}:{point.line}", point)


def read_gpx_shapes(path: str | Path) -> list[Shape]:
    """Return routes, segments of tracks and waypoints as shapes: GPX has no polygons.

    Raises:
        BadChart: naming file, line and remedy.
    """
    root = read_xml(path, "gpx")
    tracks = [_line(path, segment, "trkpt") for segment in root.within("trkseg")]
    points = [(f"{path}:{point.line}: wpt", point) for point in root.within("wpt")]
    marks = [Shape("point", where, (_place(where, point),)) for where, point in points]
    return [*_gpx_routes(path, root), *tracks, *marks]


def read_gpx_routes(path: str | Path) -> list[Shape]:
    """Return the routes (rte) of a GPX file as lines.

    Raises:
        BadChart: naming file, line and remedy; when there are none.
    """
    routes = _gpx_routes(path, read_xml(path, "gpx"))
    if not routes:
        raise BadChart(
            f"{path}: holds no route (rte); tracks with times are flown by auvs.route.kind: track"
        )
    return routes


def _gpx_routes(path: str | Path, root: Element) -> list[Shape]:
    return [_line(path, route, "rtept") for route in root.within("rte")]


def _line(path: str | Path, line: Element, point: str) -> Shape:
    where = f"{path}:{line.line}: {line.name}"
    places = (_place(f"{path}:{place.line}", place) for place in line.within(point))
    return checked(Shape("line", where, tuple(places), name=line.text_in("name")))


def _place(where: str, point: Element) -> Degrees:
    try:
        lat, lon = float(point.attributes["lat"]), float(point.attributes["lon"])
    except (KeyError, ValueError):
        raise BadChart(f"{where}: a {point.name} needs numbers as lat and lon") from None
    return position(lat, lon, where, 'lat="latitude" lon="longitude"')


def _sample(where: str, point: Element) -> Sample:
    place, time = _place(where, point), point.text_in("time")
    if not time:
        raise BadChart(
            f"{where}: has no <time>; a track needs one at each point, a route has none: a route "
            "(rte) is flown by auvs.route.kind: waypoints"
        )
    return Sample(where, unix_time(where, time), place, _depth(where, point), True, is_height=True)


def _depth(where: str, point: Element) -> float:
    text = point.text_in("ele")
    if not text:
        return math.nan
    try:
        height = float(text)
    except ValueError:
        raise BadChart(f"{where}: {text[:40]!r} is no elevation in metres") from None
    if not math.isfinite(height):
        raise BadChart(f"{where}: its height is {height:g}; leave it out if it is unknown")
    return -height
