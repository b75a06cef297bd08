"""A mission as a chart, GeoJSON or KML: the survey area, where ASVs lie, and where AUVs went."""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple
from xml.sax.saxutils import escape

from ..core.files import write_text
from ..geometry.formation import keep_station
from ..geometry.geodesy import geodetic_from_ned
from ..scenario.on_earth import origin_of
from ..scenario.survey_area import area_of
from .antimeridian import Positions, counter_clockwise, cut_line, cut_ring

if TYPE_CHECKING:
    from ..results.result import Result

# What is drawn of each AUV: its way as it was, and as it was believed to be.
WAYS = {"": ("x_m", "y_m"), " (estimate)": ("estimate_x_m", "estimate_y_m")}

KML = """<?xml version="1.0" encoding="UTF-8"?>
<kml xmlns="http://www.opengis.net/kml/2.2">
<Document><name>{}</name>
{}
</Document>
</kml>
"""
KML_SHAPES = {
    "Point": "<Point><coordinates>{}</coordinates></Point>",
    "LineString": "<LineString><coordinates>{}</coordinates></LineString>",
    "Polygon": "<Polygon><outerBoundaryIs><LinearRing><coordinates>{}</coordinates></LinearRing>"
    "</outerBoundaryIs></Polygon>",
}


class Drawn(NamedTuple):
    """A shape of a chart: its kind as GeoJSON and KML call it, its name, and its positions,
    longitude and latitude (deg), of a polygon closed and counter-clockwise.
    """

    kind: str
    name: str
    positions: Positions


def write_chart(
    result: "Result", path: Path, kind: str, *, replace: bool = True
) -> Mapping[str, int]:
    """Write a mission as a chart, "geojson" or "kml"; return how many shapes of each kind it has.

    Raises:
        ValueError: when the scenario is nowhere on Earth.
        FileExistsError: when the file is there, and not to be replaced.
        OSError: when it cannot be written.
    """
    shapes = list(drawn(result))
    write_text(path, WRITERS[kind](result.scenario.name, shapes), replace=replace)
    kinds = [shape.kind for shape in shapes]
    return {it: kinds.count(it) for it in dict.fromkeys(kinds)}


def drawn(result: "Result") -> Iterator[Drawn]:
    """Yield the survey area, a point for each ASV where it was at first, and the ways of AUVs and
    of ASVs that move.
    """
    origin = origin_of(result.scenario)
    if origin is None:
        raise ValueError("the scenario has no environment.origin, so it is nowhere on Earth")

    def on_earth(places: Iterable[Sequence[float]]) -> Positions:
        found = (geodetic_from_ned((*place, 0.0), *origin) for place in places)
        return [(lon, lat) for lat, lon, _ in found]

    outline = area_of(result.scenario).outline
    yield Drawn("Polygon", "survey area", counter_clockwise(on_earth([*outline, outline[0]])))
    for name, track in result.tables["tracks"].groupby("vehicle", sort=False):
        places = {told: track[list(columns)].to_numpy() for told, columns in WAYS.items()}
        if str(name).startswith("ASV"):
            yield Drawn("Point", str(name), on_earth(places[""][:1].tolist()))
            if not keep_station([places[""]], result.scenario.acoustics.hf.range_m):
                yield Drawn("LineString", f"{name} (way)", on_earth(places[""].tolist()))
            continue
        for told, way in places.items():
            yield Drawn("LineString", f"{name}{told}", on_earth(way.tolist()))


def _geojson(name: str, shapes: list[Drawn]) -> str:
    features = [
        {"type": "Feature", "properties": {"name": it.name}, "geometry": _geometry(it)}
        for it in shapes
    ]
    return json.dumps({"type": "FeatureCollection", "name": name, "features": features}) + "\n"


def _geometry(shape: Drawn) -> dict[str, object]:
    """Return a geometry of RFC 7946, in parts where it crosses the antimeridian (3.1.9)."""
    if shape.kind == "Point":
        return {"type": shape.kind, "coordinates": shape.positions[0]}
    parts: list[object]
    if shape.kind == "Polygon":
        parts = [[ring] for ring in cut_ring(shape.positions)]
    else:
        parts = list(cut_line(shape.positions))
    if len(parts) == 1:
        return {"type": shape.kind, "coordinates": parts[0]}
    return {"type": f"Multi{shape.kind}", "coordinates": parts}


def _kml(name: str, shapes: list[Drawn]) -> str:
    marks = []
    for it in shapes:
        shape = KML_SHAPES[it.kind].format(
            " ".join(f"{lon!r},{lat!r}" for lon, lat in it.positions)
        )
        marks.append(f"<Placemark><name>{escape(it.name)}</name>{shape}</Placemark>")
    return KML.format(escape(name), "\n".join(marks))


WRITERS: Mapping[str, Callable[[str, list[Drawn]], str]] = {"geojson": _geojson, "kml": _kml}
