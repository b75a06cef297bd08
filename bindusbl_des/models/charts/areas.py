"""Shapes of charts in any format: the area of a survey, and the routes of vehicles."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import groupby
from math import remainder
from pathlib import Path
from typing import Any, NamedTuple

from ...support.files import read_json
from ...support.tables import of_file
from ...support.wording import counted, described, shortened
from .grid_charts import ENDINGS, read_grid_chart
from .positions import InDegrees, to_degrees
from .shapes import BadChart, Degrees, Shape, around, checked, position, ring
from .vehicle_plans import read_vehicle_plan
from .xml_charts import read_gpx_routes, read_gpx_shapes, read_kml, read_kmz

# GeoJSON (RFC 7946): points, lines and polygons, each position [longitude, latitude].  Files from
# before it may name another system, in which positions are east and north.


ORDER = "[longitude, latitude]"

# Names of WGS-84 with longitude first.
WGS84 = ("CRS84", "EPSG:4326", "EPSG::4326", "OGC:1.3:CRS84")

SINGLE = {"Point": "point", "LineString": "line", "Polygon": "polygon"}


def read_geojson(path: str | Path, crs: str = "") -> list[Shape]:
    """Return the shapes of a GeoJSON file in its order; those of several parts one by one.

    `crs` is the code of its grid, such as EPSG:32760, where the file does not name it.

    Raises:
        BadChart: naming file, feature and remedy.
    """
    try:
        data = read_json(Path(path))
    except OSError as error:
        raise BadChart(f"{path}: cannot be read ({error.strerror})") from None
    except ValueError as error:
        raise BadChart(f"{path}: is no GeoJSON: {error}") from None
    placed = _placing(_crs(data), crs, str(path))
    return [
        shape
        for place, name, geometry in _geometries(data, str(path))
        for shape in _shapes(geometry, place, name, placed)
    ]


# What makes latitude and longitude (deg) of the two numbers at a place of a file
Placing = Callable[[float, float, str], Degrees]


def _placing(named: str, crs: str, path: str) -> Placing:
    """Return the conversion to degrees from the system that a file names, or else from `crs`."""
    if named and crs:
        raise BadChart(f"{path}: names {shortened(named)} itself; remove crs: {shortened(crs)}")
    if (named or crs or WGS84[0]).endswith(WGS84):
        return lambda x, y, place: position(y, x, place, ORDER)
    try:
        grid = to_degrees(named or crs)
    except BadChart as error:
        raise BadChart(f"{path}: {error}") from None
    return partial(_from_grid, grid)


def _from_grid(grid: InDegrees, x: float, y: float, place: str) -> Degrees:
    try:
        return grid([(x, y)])[0]
    except BadChart as error:
        raise BadChart(f"{place}: {error}") from None


def _crs(data: Any) -> str:
    """Return the name of the reference system of a file's positions; "" if it names none."""
    crs = data.get("crs") if isinstance(data, dict) else None
    properties = crs.get("properties") if isinstance(crs, dict) else None
    name = properties.get("name") if isinstance(properties, dict) else None
    return "" if crs is None else str(name)


def _geometries(data: Any, place: str, name: str = "") -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Yield each geometry with its place for messages, and its name."""
    kind = data.get("type") if isinstance(data, dict) else None
    if kind == "FeatureCollection":
        for number, feature in enumerate(_listed(data, "features", place)):
            name = _name(feature)
            told = f" ({shortened(repr(name))})" if name else ""
            yield from _geometries(feature, f"{place}: feature {number}{told}", name)
    elif kind == "Feature":
        if data.get("geometry") is not None:
            yield from _geometries(data["geometry"], place, name or _name(data))
    elif kind == "GeometryCollection":
        for number, part in enumerate(_listed(data, "geometries", place)):
            yield from _geometries(part, f"{place}: part {number}", name)
    elif isinstance(kind, str) and kind.removeprefix("Multi") in SINGLE:
        yield place, name, data
    else:
        met = f"type {shortened(repr(kind))}" if isinstance(data, dict) else described(data)
        raise BadChart(
            f"{place}: is no GeoJSON object ({met}); it needs a type such as FeatureCollection, "
            "Feature or Polygon"
        )


def _name(feature: Any) -> str:
    properties = feature.get("properties") if isinstance(feature, dict) else None
    name = properties.get("name") if isinstance(properties, dict) else None
    return name if isinstance(name, str) else ""


def _listed(data: dict[str, Any], key: str, place: str) -> list[Any]:
    found = data.get(key)
    if not isinstance(found, list):
        raise BadChart(f"{place}: needs a list of {key}; got {described(found)}")
    return found


def _shapes(geometry: dict[str, Any], place: str, name: str, placed: Placing) -> Iterator[Shape]:
    kind, given = geometry["type"], _listed(geometry, "coordinates", place)
    single = SINGLE[kind.removeprefix("Multi")]
    for part in given if kind.startswith("Multi") else [given]:
        if part != []:  # which is no geometry (RFC 7946, 3.1)
            yield checked(_shape(single, part, place, placed)._replace(name=name))


def _shape(kind: str, given: Any, place: str, placed: Placing) -> Shape:
    if kind == "point":
        return Shape(kind, place, (_position(given, place, placed),))
    if kind == "line":
        corners = _positions(given, place, placed)
        if len(corners) < 2:
            raise BadChart(f"{place}: a LineString needs two positions; it has {len(corners)}")
        return Shape(kind, place, tuple(corners))
    if not isinstance(given, list):
        raise BadChart(f"{place}: a Polygon needs a list of rings; got {described(given)}")
    outer, *holes = [
        ring(_positions(corners, place, placed), f"{place}: hole {number}" if number else place)
        for number, corners in enumerate(given)
    ]
    return Shape(kind, place, outer, tuple(holes))


def _positions(given: Any, place: str, placed: Placing) -> list[Degrees]:
    if not isinstance(given, list):
        raise BadChart(f"{place}: needs a list of positions; got {described(given)}")
    return [
        _position(point, f"{place}: position {number}", placed)
        for number, point in enumerate(given)
    ]


def _position(given: Any, place: str, placed: Placing) -> Degrees:
    numbers = isinstance(given, list) and len(given) >= 2
    if not numbers or not all(type(number) in (int, float) for number in given[:2]):
        raise BadChart(f"{place}: needs two numbers {ORDER}; got {shortened(repr(given))}")
    try:
        x, y = map(float, given[:2])
    except OverflowError:
        raise BadChart(f"{place}: has a number beyond all others; write degrees {ORDER}") from None
    return placed(x, y, place)


# Shapes of a chart in whichever format: polygons are areas, lines are ways.


# Formats that have no grids: their positions are in degrees of WGS-84.
IN_DEGREES: Mapping[str, Callable[[str | Path], list[Shape]]] = {
    ".kml": read_kml,
    ".kmz": read_kmz,
    ".gpx": read_gpx_shapes,
    ".plan": read_vehicle_plan,
}
READERS: Mapping[str, Callable[[str | Path, str], list[Shape]]] = {
    ".geojson": read_geojson,
    ".json": read_geojson,
    **dict.fromkeys(ENDINGS, read_grid_chart),
}


def read_shapes(path: str | Path, crs: str = "") -> list[Shape]:
    """Return the shapes of a chart in its order; its name tells its format.

    `crs` is the code of its grid, such as EPSG:32760, where the file does not name it.

    Raises:
        BadChart: naming file, place in it and remedy.
    """
    ending = Path(path).suffix.lower()
    if ending in IN_DEGREES:
        if crs:
            raise BadChart(f"{path}: is in degrees, as every {ending} is; remove crs: {crs}")
        return IN_DEGREES[ending](path)
    if ending not in READERS:
        known = ", ".join((*READERS, *IN_DEGREES))
        raise BadChart(f"{path}: is no chart by its name; use {known}")
    return READERS[ending](path, crs)


# Of several shapes so many are named.
MOST_NAMED = 4
# So far (deg) from the line between its neighbours lies no corner that was drawn: 0.1 mm.
ON_THE_CUT_DEG = 1e-9


def read_polygons(path: str | Path, crs: str = "") -> list[Shape]:
    """Return the polygons of a chart; where there is none, the lines that end where they begin.

    Raises:
        BadChart: naming file, place in it and remedy; when there are none.
    """
    shapes = read_shapes(path, crs)
    areas = _joined([shape for shape in shapes if shape.kind == "polygon"])
    areas = areas or [area for shape in shapes if shape.kind == "line" and (area := around(shape))]
    if not areas:
        is_open = any(shape.kind == "line" for shape in shapes)
        raise BadChart(
            f"{path}: holds no polygon ({_counted(shapes)}); draw the area"
            + ", and end it where it begins" * is_open
        )
    return areas


def _counted(shapes: list[Shape]) -> str:
    kinds = [shape.kind for shape in shapes]
    return ", ".join(counted(kinds.count(kind), kind) for kind in dict.fromkeys(kinds)) or "nothing"


def read_area(path: str, crs: str = "", name: str = "") -> tuple[Degrees, ...]:
    """Return the corners of :func:`read_rings`, whatever holes they have in them."""
    return read_rings(path, crs, name)[0]


# A polygon: its corners, and those of each hole in it, latitude and longitude (deg).
RingsDeg = tuple[tuple[Degrees, ...], ...]


@of_file(64)
def read_rings(path: str, crs: str = "", name: str = "") -> RingsDeg:
    """Return the only polygon in a chart, or the one with a `name`, with its holes; a polygon
    without a name has its number from 0 instead.

    Without any polygon it is the only line that ends where it begins.  Points and other lines do
    not count.

    Raises:
        BadChart: naming file, place in it and remedy.
    """
    area = _chosen(path, read_polygons(path, crs), name)
    return area.corners, *area.holes


@of_file(64)
def read_land(path: str, crs: str = "") -> tuple[RingsDeg, ...]:
    """Return all polygons in a chart, with their holes; errors are those of :func:`read_rings`."""
    return tuple((shape.corners, *shape.holes) for shape in read_polygons(path, crs))


def polygon_names(path: str, crs: str = "") -> list[str]:
    """Return the names of all polygons in a chart; errors are those of :func:`read_rings`."""
    return _names(read_polygons(path, crs))


def _names(areas: list[Shape]) -> list[str]:
    return [area.name or str(number) for number, area in enumerate(areas)]


def _chosen(path: str, areas: list[Shape], name: str) -> Shape:
    if len(areas) == 1 and not name:
        return areas[0]
    names = _names(areas)
    found = [area for area, own in zip(areas, names, strict=True) if own == name]
    if len(found) == 1:
        return found[0]
    more = f" and {len(areas) - MOST_NAMED} more" * (len(areas) > MOST_NAMED)
    listed = "; ".join(map(repr, map(shortened, names[:MOST_NAMED]))) + more
    if not name:
        raise BadChart(
            f"{path}: holds {len(areas)} polygons ({listed}); name the one to be surveyed in "
            "survey.area_name, or sweep over their names for a survey of each"
        )
    raise BadChart(
        f"{path}: holds {len(found) or 'no'} polygon{'s' * (len(found) > 1)} of the name "
        f"{shortened(repr(name))}; there is {listed}"
    )


class DrawnRoute(NamedTuple):
    """A line of a chart that is a route: its name, and its points, latitude and longitude (deg)."""

    name: str
    points: tuple[Degrees, ...]


@of_file(64)
def read_routes(path: str, crs: str = "") -> tuple[DrawnRoute, ...]:
    """Return the lines of a chart as routes, in its order: routes (rte) of GPX, LineStrings of KML
    and GeoJSON, missions of QGroundControl; consecutive points at one position are merged.

    Raises:
        BadChart: naming file, place in it and remedy; when there are none.
    """
    is_gpx = Path(path).suffix.lower() == ".gpx"  # whose tracks are no ways to be gone
    shapes = read_gpx_routes(path) if is_gpx and not crs else read_shapes(path, crs)
    lines = [shape for shape in shapes if shape.kind == "line"]
    if not lines:
        raise BadChart(
            f"{path}: holds no line ({_counted(shapes)}); draw the way of each AUV as a line"
        )
    return tuple(
        DrawnRoute(line.name, tuple(place for place, _ in groupby(line.corners))) for line in lines
    )


def named_route(routes: Sequence[DrawnRoute], name: str) -> DrawnRoute:
    """Return the route with a name.

    Raises:
        BadChart: when there is none, or several; naming those that there are.
    """
    found = [route for route in routes if route.name == name]
    if len(found) == 1:
        return found[0]
    listed = ", ".join(repr(shortened(route.name)) for route in routes[:MOST_NAMED])
    more = f" and {len(routes) - MOST_NAMED} more" * (len(routes) > MOST_NAMED)
    said = f"{len(found)} lines of the files are" if found else "no line of the files is"
    raise BadChart(f"{said} named {shortened(repr(name))}; there is {listed}{more}")


def _joined(areas: list[Shape]) -> list[Shape]:
    """Return polygons, the parts of one that was cut at 180 degrees (RFC 7946, 3.1.9) joined."""
    cut = [
        area
        for area in areas
        if not area.holes and any(abs(lon) == 180.0 for _, lon in area.corners)
    ]
    if len(cut) < 2 or len(cut) != len(areas) or len({area.where for area in cut}) > 1:
        return areas
    import shapely  # which other charts do not need

    # As [longitude, latitude], those of the west beyond 180; the ends of the cut are no corners.
    parts = [shapely.Polygon([(lon % 360.0, lat) for lat, lon in area.corners]) for area in cut]
    whole = shapely.unary_union(parts).simplify(ON_THE_CUT_DEG)
    if whole.geom_type != "Polygon":
        return areas
    corners = whole.exterior.coords[:-1]
    return [cut[0]._replace(corners=tuple((lat, remainder(lon, 360.0)) for lon, lat in corners))]
