"""Areas of a survey from charts: GeoJSON, KML and GPX."""

from collections.abc import Callable, Iterator, Mapping
from math import remainder
from pathlib import Path
from typing import Any

from ...support.files import read_json
from ...support.tables import of_file
from ...support.wording import counted, described, shortened
from .shapes import BadChart, Degrees, Shape, around, checked, position, ring
from .xml_charts import read_gpx_shapes, read_kml

# GeoJSON (RFC 7946): points, lines and polygons, each position [longitude, latitude].


ORDER = "[longitude, latitude]"

# Names of WGS-84 with longitude first; files from before RFC 7946 may say it.
WGS84 = ("CRS84", "EPSG:4326", "EPSG::4326", "OGC:1.3:CRS84")

SINGLE = {"Point": "point", "LineString": "line", "Polygon": "polygon"}


def read_geojson(path: str | Path) -> list[Shape]:
    """Return the shapes of a GeoJSON file in its order; those of several parts one by one.

    Raises:
        BadChart: naming file, feature and remedy.
    """
    try:
        data = read_json(Path(path))
    except OSError as error:
        raise BadChart(f"{path}: cannot be read ({error.strerror})") from None
    except ValueError as error:
        raise BadChart(f"{path}: is no GeoJSON: {error}") from None
    _check_crs(data, str(path))
    return [
        shape
        for place, geometry in _geometries(data, str(path))
        for shape in _shapes(geometry, place)
    ]


def _check_crs(data: Any, place: str) -> None:
    crs = data.get("crs") if isinstance(data, dict) else None
    properties = crs.get("properties") if isinstance(crs, dict) else None
    name = properties.get("name") if isinstance(properties, dict) else None
    if crs is not None and not str(name).endswith(WGS84):
        raise BadChart(
            f"{place}: its coordinate system is {shortened(str(name))}; save it in WGS-84 "
            "(EPSG:4326), longitude and latitude in degrees"
        )


def _geometries(data: Any, place: str) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield each geometry with what a message calls it."""
    kind = data.get("type") if isinstance(data, dict) else None
    if kind == "FeatureCollection":
        for number, feature in enumerate(_listed(data, "features", place)):
            yield from _geometries(feature, f"{place}: feature {number}{_name(feature)}")
    elif kind == "Feature":
        if data.get("geometry") is not None:
            yield from _geometries(data["geometry"], place)
    elif kind == "GeometryCollection":
        for number, part in enumerate(_listed(data, "geometries", place)):
            yield from _geometries(part, f"{place}: part {number}")
    elif isinstance(kind, str) and kind.removeprefix("Multi") in SINGLE:
        yield place, data
    else:
        met = f"type {shortened(repr(kind))}" if isinstance(data, dict) else described(data)
        raise BadChart(
            f"{place}: is no GeoJSON object ({met}); it needs a type such as FeatureCollection, "
            "Feature or Polygon"
        )


def _name(feature: Any) -> str:
    properties = feature.get("properties") if isinstance(feature, dict) else None
    name = properties.get("name") if isinstance(properties, dict) else None
    return f" ({shortened(repr(name))})" if isinstance(name, str) and name else ""


def _listed(data: dict[str, Any], key: str, place: str) -> list[Any]:
    found = data.get(key)
    if not isinstance(found, list):
        raise BadChart(f"{place}: needs a list of {key}; got {described(found)}")
    return found


def _shapes(geometry: dict[str, Any], place: str) -> Iterator[Shape]:
    kind, given = geometry["type"], _listed(geometry, "coordinates", place)
    single = SINGLE[kind.removeprefix("Multi")]
    for part in given if kind.startswith("Multi") else [given]:
        if part != []:  # which is no geometry (RFC 7946, 3.1)
            yield checked(_shape(single, part, place))


def _shape(kind: str, given: Any, place: str) -> Shape:
    if kind == "point":
        return Shape(kind, place, (_position(given, place),))
    if kind == "line":
        corners = _positions(given, place)
        if len(corners) < 2:
            raise BadChart(f"{place}: a LineString needs two positions; it has {len(corners)}")
        return Shape(kind, place, tuple(corners))
    if not isinstance(given, list):
        raise BadChart(f"{place}: a Polygon needs a list of rings; got {described(given)}")
    outer = ring(_positions(given[0], place), place)
    return Shape(kind, place, outer, len(given) - 1)


def _positions(given: Any, place: str) -> list[Degrees]:
    if not isinstance(given, list):
        raise BadChart(f"{place}: needs a list of positions; got {described(given)}")
    return [_position(point, f"{place}: position {number}") for number, point in enumerate(given)]


def _position(given: Any, place: str) -> Degrees:
    numbers = isinstance(given, list) and len(given) >= 2
    if not numbers or not all(type(number) in (int, float) for number in given[:2]):
        raise BadChart(f"{place}: needs two numbers {ORDER}; got {shortened(repr(given))}")
    try:
        longitude, latitude = map(float, given[:2])
    except OverflowError:
        raise BadChart(f"{place}: has a number beyond all others; write degrees {ORDER}") from None
    return position(latitude, longitude, place, ORDER)


# The one polygon of a chart: the area of sea to be surveyed.


READERS: Mapping[str, Callable[[str | Path], list[Shape]]] = {
    ".geojson": read_geojson,
    ".json": read_geojson,
    ".kml": read_kml,
    ".gpx": read_gpx_shapes,
}
# Of several polygons so many are named.
MOST_NAMED = 4
# So far (deg) from the line between its neighbours lies no corner that was drawn: 0.1 mm.
ON_THE_CUT_DEG = 1e-9


@of_file(64)
def read_area(path: str) -> tuple[Degrees, ...]:
    """Return the corners, latitude and longitude (deg), of the only polygon in a chart.

    Where there is none it is the only line that ends where it begins.  Points and other lines are
    no area and do not count.

    Raises:
        BadChart: naming file, place in it and remedy.
    """
    read = READERS.get(Path(path).suffix.lower())
    if read is None:
        raise BadChart(f"{path}: is no chart by its name; use {', '.join(READERS)}")
    shapes = read(path)
    areas = _joined([shape for shape in shapes if shape.kind == "polygon"])
    areas = areas or [area for shape in shapes if shape.kind == "line" and (area := around(shape))]
    if not areas:
        kinds = [shape.kind for shape in shapes]
        there = [counted(kinds.count(kind), kind) for kind in dict.fromkeys(kinds)]
        raise BadChart(
            f"{path}: holds no polygon ({', '.join(there) or 'nothing'}); draw the area"
            + ", and end it where it begins" * ("line" in kinds)
        )
    if len(areas) > 1:
        named = "; ".join(
            shape.where.removeprefix(f"{path}:").strip() for shape in areas[:MOST_NAMED]
        )
        raise BadChart(
            f"{path}: holds {len(areas)} polygons ({named}); leave the one to be surveyed"
        )
    if areas[0].holes:
        raise BadChart(
            f"{areas[0].where}: has {counted(areas[0].holes, 'hole')}; an area has none: draw it "
            "without, lanes cross what lies within"
        )
    return areas[0].corners


def _joined(areas: list[Shape]) -> list[Shape]:
    """Return polygons, the parts of one that was cut at 180 degrees (RFC 7946, 3.1.9) as one."""
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
    return [
        Shape("polygon", cut[0].where, tuple((lat, remainder(lon, 360.0)) for lon, lat in corners))
    ]
