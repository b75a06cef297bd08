"""The one polygon of a chart: the area of sea to be surveyed."""

import os
from collections.abc import Callable, Mapping
from functools import lru_cache
from pathlib import Path

from ..core.wording import counted
from .geojson import read_geojson
from .gpx import read_gpx_shapes
from .kml import read_kml
from .shapes import BadChart, Degrees, Shape

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


def read_area(path: str | Path) -> tuple[Degrees, ...]:
    """Return the corners, latitude and longitude (deg), of the only polygon in a chart.

    Points and lines beside it are no area and do not count.

    Raises:
        BadChart: naming file, place in it and remedy.
    """
    try:
        found = os.stat(path)
    except OSError as error:
        raise BadChart(f"{path}: cannot be read ({error.strerror})") from None
    return _read(str(path), found.st_mtime_ns, found.st_size)


@lru_cache(maxsize=64)
def _read(path: str, _changed_at: int, _size: int) -> tuple[Degrees, ...]:
    """Return the polygon of a file; one that has not changed since is not read again."""
    read = READERS.get(Path(path).suffix.lower())
    if read is None:
        raise BadChart(f"{path}: is no chart by its name; use {', '.join(READERS)}")
    shapes = read(path)
    areas = _joined([shape for shape in shapes if shape.kind == "polygon"])
    if not areas:
        kinds = [shape.kind for shape in shapes]
        there = [counted(kinds.count(it), it) for it in dict.fromkeys(kinds)]
        raise BadChart(
            f"{path}: holds no polygon ({', '.join(there) or 'nothing'}); draw the area"
            + ", and end it where it begins" * ("line" in kinds)
        )
    if len(areas) > 1:
        named = "; ".join(
            shape.told.removeprefix(f"{path}:").strip() for shape in areas[:MOST_NAMED]
        )
        raise BadChart(
            f"{path}: holds {len(areas)} polygons ({named}); leave the one to be surveyed"
        )
    if areas[0].holes:
        raise BadChart(
            f"{areas[0].told}: has {counted(areas[0].holes, 'hole')}; an area has none: draw it "
            "without, lanes cross what lies within"
        )
    return areas[0].corners


def _joined(areas: list[Shape]) -> list[Shape]:
    """Return polygons, the parts of one that was cut at 180 degrees (RFC 7946, 3.1.9) as one."""
    cut = [it for it in areas if not it.holes and any(abs(lon) == 180.0 for _, lon in it.corners)]
    if len(cut) < 2 or len(cut) != len(areas) or len({it.told for it in cut}) > 1:
        return areas
    import shapely  # which other charts do not need

    # As [longitude, latitude], those of the west beyond 180; the ends of the cut are no corners.
    parts = [shapely.Polygon([(lon % 360.0, lat) for lat, lon in it.corners]) for it in cut]
    whole = shapely.unary_union(parts).simplify(ON_THE_CUT_DEG)
    if whole.geom_type != "Polygon":
        return areas
    corners = whole.exterior.coords[:-1]
    return [Shape("polygon", cut[0].told, tuple((lat, _wrapped(lon)) for lon, lat in corners))]


def _wrapped(lon: float) -> float:
    return lon - 360.0 if lon > 180.0 else lon
