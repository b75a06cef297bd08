"""Charts in any grid: shapefile, GeoPackage, DXF, by GDAL (pyogrio)."""

import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from ...support.files import regular
from ...support.kept_files import members
from ...support.wording import shortened
from .positions import MISSING, to_degrees
from .shapes import BadChart, Degrees, Shape, checked

# How the names of files end that GDAL reads here; a zip archive holds a shapefile.
ENDINGS = (".shp", ".shz", ".zip", ".gpkg", ".dxf")
# What a shapefile needs beside it.
NEEDED = ".shx"
# A chart of a coast may have more than are of use here.
MOST_FEATURES = 100_000

# Columns that hold the name of a feature, in this order, whichever way they are written.
NAMES = ("name", "label", "title", "layer")
KINDS = {"Point": "point", "LineString": "line", "LinearRing": "line", "Polygon": "polygon"}


def read_grid_chart(path: str | Path, crs: str = "") -> list[Shape]:
    """Return the shapes of a shapefile, GeoPackage or DXF file, layer by layer.

    `crs` is the code of its grid, such as EPSG:32760, where the file does not name it.

    Raises:
        BadChart: naming file, feature and remedy, or the packages that are missing.
    """
    try:
        regular(str(path))
    except OSError as error:
        raise BadChart(f"{path}: cannot be read ({error.strerror})") from None
    present = {member.suffix.lower() for member in members(Path(path))}
    if ".shp" in present and NEEDED not in present:
        raise BadChart(
            f"{path}: needs {Path(path).stem}{NEEDED} beside it: a shapefile is several files, "
            "with .dbf (names) and .prj (its grid); copy them all, or zip them together"
        )
    try:
        import pyogrio
        import shapely
        from pyogrio.errors import DataLayerError, DataSourceError
        from pyogrio.raw import read
    except ModuleNotFoundError:
        raise BadChart(f"{path}: needs {MISSING}") from None
    shapes: list[Shape] = []
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of heights, measures and fields, which are not used
            for layer, _ in pyogrio.list_layers(path):
                told, _, geometries, fields = read(
                    path, layer=layer, force_2d=True, max_features=MOST_FEATURES
                )
                placed = _placing(str(path), told["crs"] or "", crs)
                names = _names(told["fields"], fields)
                for number, raw in enumerate(geometries):
                    if raw is None:
                        continue
                    name = names(number)
                    where = f"{path}: {layer} {number}{f' ({shortened(repr(name))})' * bool(name)}"
                    for part in _parts(shapely.from_wkb(raw)):
                        shape = _shape(part, where, name, placed)
                        shapes += [checked(shape)] if shape.corners else []
    except (DataLayerError, DataSourceError, shapely.errors.ShapelyError) as error:
        raise BadChart(f"{path}: cannot be read as a chart: {shortened(str(error))}") from None
    return shapes


Placing = Callable[[Any, str], tuple[Degrees, ...]]


def _placing(path: str, named: str, crs: str) -> Placing:
    """Return the conversion of a file's coordinates to latitudes and longitudes (deg)."""
    if named and crs:
        raise BadChart(f"{path}: names {shortened(named)} itself; remove crs: {shortened(crs)}")
    if not named and not crs:
        raise BadChart(
            f"{path}: names no grid (a shapefile does in .prj, DXF never); give its code, "
            "crs: EPSG:32760"
        )
    try:
        grid = to_degrees(named or crs)
    except BadChart as error:
        raise BadChart(f"{path}: {error}") from None

    def placed(line: Any, where: str) -> tuple[Degrees, ...]:
        try:
            return tuple(grid([(x, y) for x, y, *_ in line.coords]))
        except BadChart as error:
            raise BadChart(f"{where}: {error}") from None

    return placed


def _names(columns: Any, fields: Any) -> Callable[[int], str]:
    """Return a function from a feature's number to its name; "" where no column has it."""
    known = [str(column).lower() for column in columns]
    column = next((known.index(name) for name in NAMES if name in known), None)

    def name(number: int) -> str:
        value = "" if column is None else fields[column][number]
        return value if isinstance(value, str) else ""

    return name


def _parts(geometry: Any) -> Iterator[Any]:
    """Yield points, lines and polygons of a geometry one by one."""
    if hasattr(geometry, "geoms"):
        for part in geometry.geoms:
            yield from _parts(part)
    elif geometry.geom_type in KINDS and not geometry.is_empty:
        yield geometry


def _shape(geometry: Any, where: str, name: str, placed: Placing) -> Shape:
    kind = KINDS[geometry.geom_type]
    if kind != "polygon":
        return Shape(kind, where, placed(geometry, where), name=name)
    rings = (geometry.exterior, *geometry.interiors)
    outer, *holes = [placed(ring, where)[:-1] for ring in rings]
    return Shape(kind, where, outer, tuple(holes), name)
