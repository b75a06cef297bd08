"""A mission, or the team of a plan, as a chart, GeoJSON, KML, KMZ or GPX: the survey area, where
ASVs lie, and where AUVs went.

Lines and rings are cut where they cross 180 degrees: GeoJSON (RFC 7946, 3.1.9) asks for parts of
which none crosses the antimeridian, and for exterior rings that go counter-clockwise (3.1.6).
Positions are longitude and latitude (deg).
"""

import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.sax.saxutils import escape
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

import numpy as np
import shapely

from ...core.geometry.formation import keep_station
from ...core.geometry.geodesy import degrees_text, minutes_text
from ...core.setup import Setup
from ...support.arrays import Floats
from ...support.files import draft_of
from ...support.palette import (
    ALARM_ON_DARK,
    COLOURS_ON_DARK,
    DEPTH_ON_DARK,
    HF_ON_DARK,
    MF_ON_DARK,
    SHORE_ON_DARK,
)

if TYPE_CHECKING:
    from ...core.results.result import Result


# A range is drawn with so many corners; lanes are thinned to lines that are off by no more than a
# chart shows (m).
CORNERS, SHOWN_M = 72, 0.25


Position = tuple[float, float]
Positions = list[Position]
Places = Sequence[Sequence[float]]  # x, y (m)


def counter_clockwise(ring: Positions) -> Positions:
    """Return a closed ring so that its area lies to the left.

    >>> counter_clockwise([(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (0.0, 0.0)])[1]
    (1.0, 1.0)
    """
    is_so = shapely.is_ccw(shapely.linearrings(_unwrapped(ring)))
    return ring if is_so else ring[::-1]


def cut_line(line: Positions) -> list[Positions]:
    """Return a line in the parts that lie between -180 and 180 degrees.

    >>> cut_line([(179.0, 0.0), (-179.0, 2.0)])
    [[(179.0, 0.0), (180.0, 1.0)], [(-180.0, 1.0), (-179.0, 2.0)]]
    """
    parts = [line[:1]]
    for (lon1, lat1), (lon2, lat2) in pairwise(line):
        if abs(lon2 - lon1) > 180.0:  # the shorter way is over the antimeridian
            side = math.copysign(180.0, lon1)
            gone, left = side - lon1, lon2 + side  # to it, and beyond it (deg)
            share = gone / (gone + left) if gone + left else 0.0
            crossing = lat1 + share * (lat2 - lat1)
            if gone or len(parts[-1]) < 2:
                parts[-1].append((side, crossing))
            parts.append([(-side, crossing)])
        parts[-1].append((lon2, lat2))
    return parts


def cut_polygon(rings: Sequence[Positions]) -> list[list[Positions]]:
    """Return a polygon, its outer ring and those of holes, as those of the parts east and west of
    180 degrees: closed rings, outer ones counter-clockwise, those of holes clockwise.

    >>> parts = cut_polygon([[(179., 0.), (-179., 0.), (-179., 1.), (179., 0.)]])
    >>> [[len(ring) for ring in part] for part in parts]
    [[4], [5]]
    """
    along = [_unwrapped([rings[0][0], *ring])[1:] for ring in rings]  # all on the same turn
    if all(abs(lon) <= 180.0 for ring in along for lon, _ in ring):
        return [list(rings)]
    whole, cut = shapely.Polygon(along[0], along[1:]), []
    for turn in (-360.0, 0.0, 360.0):
        part = whole.intersection(shapely.box(turn - 180.0, -90.0, turn + 180.0, 90.0))
        for piece in getattr(part, "geoms", [part]):
            if piece.geom_type == "Polygon" and not piece.is_empty:
                outer, *holes = (
                    counter_clockwise([(lon - turn, lat) for lon, lat in ring.coords])
                    for ring in (piece.exterior, *piece.interiors)
                )
                cut.append([outer, *(hole[::-1] for hole in holes)])
    return cut


def _unwrapped(line: Positions) -> Positions:
    """Return a line whose longitudes go on beyond 180 degrees."""
    turn, found = 0.0, line[:1]
    for (before, _), (lon, lat) in pairwise(line):
        if abs(lon - before) > 180.0:
            turn += math.copysign(360.0, before)
        found.append((lon + turn, lat))
    return found


# What is drawn of each AUV: its way as it was, and as it was believed to be.
WAYS = {"": ("x_m", "y_m"), " (estimate)": ("estimate_x_m", "estimate_y_m")}

KML = """<?xml version="1.0" encoding="UTF-8"?>
<kml xmlns="http://www.opengis.net/kml/2.2">
<Document><name>{}</name>{}
{}
</Document>
</kml>
"""
KML_SHAPES = {
    "Point": "<Point><coordinates>{}</coordinates></Point>",
    "LineString": "<LineString><coordinates>{}</coordinates></LineString>",
    "Polygon": "<Polygon><outerBoundaryIs><LinearRing><coordinates>{}</coordinates></LinearRing>"
    "</outerBoundaryIs>{}</Polygon>",
}
KML_HOLE = (
    "<innerBoundaryIs><LinearRing><coordinates>{}</coordinates></LinearRing></innerBoundaryIs>"
)


# How KML draws what is on a chart, over the dark sea of a satellite's picture: colour, opacity and
# width (pixels) of its lines, and the folder that it is in.  Areas are outlines, and cover nothing,
# but for land, and water where nobody goes, through which one sees what is there.
AREA, VESSEL, HF, MF, LAND, KEEP_OUT = "area", "vessel", "hf", "mf", "land", "keep_out"
DEPTH = "depth"


class Look(NamedTuple):
    """How a kind of shape is drawn, and in which folder it is."""

    folder: str
    colour: str
    width: float = 2.0
    opacity: float = 1.0
    fill: float = 0.0


LOOKS = {
    AREA: Look("survey", "#ffffff", 2.5),
    DEPTH: Look("depths", DEPTH_ON_DARK, 1.0, 0.7),
    LAND: Look("survey", SHORE_ON_DARK, fill=0.4),
    KEEP_OUT: Look("survey", ALARM_ON_DARK, fill=0.25),
    VESSEL: Look("vessels", "#fee838"),
    HF: Look("HF ranges", HF_ON_DARK),
    MF: Look("MF ranges", MF_ON_DARK, 1.5),
    **{f"auv{n}": Look("AUVs", code, 2.5) for n, code in enumerate(COLOURS_ON_DARK)},
    **{f"estimate{n}": Look("estimates", code, 1.5, 0.7) for n, code in enumerate(COLOURS_ON_DARK)},
}


class Drawn(NamedTuple):
    """A shape of a chart: its kind as GeoJSON and KML call it, its name, and its positions,
    longitude and latitude (deg), of a polygon closed and counter-clockwise; which of LOOKS it has,
    what there is to say about it, and the rings of holes in a polygon, closed and clockwise.
    """

    kind: str
    name: str
    positions: Positions
    look: str = AREA
    about: str = ""
    holes: Sequence[Positions] = ()


def _of_auv(kind: str, number: int) -> str:
    return f"{kind}{number % len(COLOURS_ON_DARK)}"


def write_chart(
    result: "Result", path: Path, kind: str, *, replace: bool = True
) -> Mapping[str, int]:
    """Write a mission as a chart, "geojson", "kml" or "kmz"; return how many shapes of each kind it
    has.

    Raises:
        ValueError: when the scenario is nowhere on Earth.
        FileExistsError: when the file is there, and not to be replaced.
        OSError: when it cannot be written.
    """
    about = f"Mission of seed {result.seed}."
    return _written(result.scenario.name, about, list(drawn(result)), path, kind, replace)


def write_plan(
    setup: Setup,
    path: Path,
    kind: str,
    *,
    about: str = "",
    ways: Sequence[Places] = (),
    replace: bool = True,
) -> Mapping[str, int]:
    """Write vessels, their ranges and the AUVs' lanes as a chart, "geojson", "kml", "kmz" or "gpx";
    errors as :func:`write_chart`.

    `about` is what the plan says, which vessels are told with; `ways` (n, 2), m, are those of
    vessels that move.
    """
    shapes = list(planned(setup, about, ways))
    return _written(setup.scenario.name, about, shapes, path, kind, replace)


def _written(
    name: str, about: str, shapes: list[Drawn], path: Path, kind: str, replace: bool
) -> Mapping[str, int]:
    with draft_of(path, replace=replace) as draft:
        draft.write_bytes(WRITERS[kind](name, about, shapes).encode())
        if kind == KMZ:
            _pack(draft)
    kinds = [shape.kind for shape in shapes]
    return {kind: kinds.count(kind) for kind in dict.fromkeys(kinds)}


def _pack(draft: Path) -> None:
    """Pack a KML file as KMZ, a zip archive; equal files give equal bytes."""
    text = draft.read_bytes()
    with ZipFile(draft, "w", ZIP_DEFLATED) as archive:
        archive.writestr(ZipInfo("doc.kml"), text, ZIP_DEFLATED)


def drawn(result: "Result") -> Iterator[Drawn]:
    """Yield the survey area, a point for each ASV where it was at first, and the ways of AUVs and
    of ASVs that move: points, too, where a single place is known, as no line has one alone (3.1.4).
    """
    on_earth = earthly(result.setup)
    yield from _survey(result.setup)
    for name, track in result.tables["tracks"].groupby("vehicle", sort=False):
        places = {told: track[list(columns)].to_numpy() for told, columns in WAYS.items()}
        if str(name).startswith("ASV"):
            yield _vessel(str(name), on_earth(places[""][:1].tolist()))
            if not keep_station([places[""]], result.scenario.acoustics.hf.range_m):
                gone = on_earth(places[""].tolist())
                yield Drawn("LineString", f"{name} (way)", gone, VESSEL)
            continue
        kind, number = "LineString" if len(track) > 1 else "Point", int(str(name)[3:])
        for told, way in places.items():
            look = _of_auv("estimate" if told else "auv", number)
            yield Drawn(kind, f"{name}{told}", on_earth(way.tolist()), look)


def _vessel(name: str, positions: Positions, about: str = "") -> Drawn:
    """Return the pin of a vessel, which says where it is."""
    [(lon, lat)] = positions
    said = (degrees_text(lat, lon), minutes_text(lat, lon), about)
    return Drawn("Point", name, positions, VESSEL, "\n".join(filter(None, said)))


def planned(setup: Setup, about: str = "", ways: Sequence[Places] = ()) -> Iterator[Drawn]:
    """Yield the survey area, a point for each ASV that keeps station, rings of its HF and MF range,
    and the lanes that AUVs are to go, thinned to what a chart shows; of ASVs that move where they
    begin, and their `ways` (n, 2), m.
    """
    scenario = setup.scenario
    on_earth = earthly(setup)
    yield from _survey(setup)
    for number, way in enumerate(ways):
        yield _vessel(f"ASV{number}", on_earth(way[:1]), f"It moves; here it begins.\n{about}")
        yield Drawn("LineString", f"ASV{number} (way)", on_earth(way), VESSEL)
    bands = [("HF", HF, setup.horizontal_reach_m)]
    if scenario.protocol.sends_frames:
        bands.append(("MF", MF, setup.horizontal_mf_reach_m))
    for number, place in enumerate(setup.kept_stations_m):
        yield _vessel(f"ASV{number}", on_earth([place]), about)
        for band, look, reach in bands:
            heard = counter_clockwise(on_earth(_within(setup, place, reach).tolist()))
            yield Drawn("Polygon", f"ASV{number} {band} range", heard, look)
    for number, lane in planned_lanes(setup).items():
        look = _of_auv("auv", number)
        yield Drawn("LineString", f"AUV{number} (plan)", on_earth(lane.tolist()), look)


def _within(setup: Setup, place: Position, reach: float) -> Floats:
    """Return the corners (n, 2), m, of what is within a reach (m) of a place, less what land hides
    from there.
    """
    if setup.land is not None:
        return thinned(setup.land.seen(place, reach))
    around = np.append(np.linspace(0.0, 2.0 * np.pi, CORNERS, endpoint=False), 0.0)  # is closed
    return np.column_stack((place[0] + reach * np.cos(around), place[1] + reach * np.sin(around)))


def planned_lanes(setup: Setup) -> dict[int, Floats]:
    """Return the way (n, 2), m, that each AUV that flies a path is to go, by its number, thinned to
    what a chart shows; of one that keeps an altitude with all points at which its depth changes.
    """
    lanes: dict[int, Floats] = {}
    for number, plan in enumerate(setup.plans_that_ship):
        if plan is not None:
            path = plan.path
            if setup.auvs[number].group in setup.follows:
                count = int(np.ceil(path.length / setup.bottom.step_m)) + 1
                lanes[number] = path.sample(np.linspace(0.0, path.length, count))[:, :2]
            else:
                lanes[number] = thinned(path.line())
    return lanes


def thinned(places: Floats) -> Floats:
    """Return the corners (m) of a line (n, 2) from which no place lies further off than a chart
    shows.  Source: Douglas and Peucker (1973), Cartographica 10:112.

    >>> thinned(np.array([[0.0, 0.0], [1.0, 0.1], [2.0, 0.0], [2.0, 5.0]])).tolist()
    [[0.0, 0.0], [2.0, 0.0], [2.0, 5.0]]
    """
    line = shapely.simplify(shapely.LineString(places), SHOWN_M, preserve_topology=False)
    return np.asarray(shapely.get_coordinates(line))


def earthly(setup: Setup) -> Callable[[Iterable[Sequence[float]]], Positions]:
    """Return what places (m) of a scenario are on Earth: longitude and latitude (deg).

    Raises:
        ValueError: when it is nowhere.
    """
    if setup.origin_deg is None:
        setup.on_earth(())  # which says so

    def on_earth(places: Iterable[Sequence[float]]) -> Positions:
        return [(lon, lat) for lat, lon, _ in setup.on_earth(places)]

    return on_earth


def _survey(setup: Setup) -> Iterator[Drawn]:
    """Yield the outline of the survey area, land, water where nobody goes, and depths."""
    on_earth = earthly(setup)
    shown: list[tuple[str, str, Any]] = [("survey area", AREA, ((setup.area.outline,),))]
    for name, look, closed in (
        ("land", LAND, setup.land),
        ("nobody goes here", KEEP_OUT, setup.keep_out),
    ):
        if closed is not None:
            shown.append((name, look, closed.outlines))
    for name, look, polygons in shown:
        for rings in polygons:
            outer, *holes = (counter_clockwise(on_earth([*ring, ring[0]])) for ring in rings)
            yield Drawn("Polygon", name, outer, look, holes=[hole[::-1] for hole in holes])
    for depth, lines in setup.contours:
        for line in lines:
            yield Drawn("LineString", f"{depth:g} m", on_earth(line.tolist()), DEPTH)


def _geojson(name: str, about: str, shapes: list[Drawn]) -> str:
    features = [
        {"type": "Feature", "properties": _properties(shape), "geometry": _geometry(shape)}
        for shape in shapes
    ]
    whole = {"type": "FeatureCollection", "name": name, "description": about, "features": features}
    return json.dumps({key: value for key, value in whole.items() if value != ""}) + "\n"


def _properties(shape: Drawn) -> dict[str, str]:
    return {"name": shape.name, **({"description": shape.about} if shape.about else {})}


def _geometry(shape: Drawn) -> dict[str, object]:
    """Return a geometry of RFC 7946, in parts where it crosses the antimeridian (3.1.9)."""
    if shape.kind == "Point":
        return {"type": shape.kind, "coordinates": shape.positions[0]}
    parts: list[object]
    if shape.kind == "Polygon":
        parts = list(cut_polygon([shape.positions, *shape.holes]))
    else:
        parts = list(cut_line(shape.positions))
    if len(parts) == 1:
        return {"type": shape.kind, "coordinates": parts[0]}
    return {"type": f"Multi{shape.kind}", "coordinates": parts}


def _kml(name: str, about: str, shapes: list[Drawn]) -> str:
    """Return KML 2.2: areas as outlines, lanes in the colours of their AUVs, vessels as pins."""
    looks = dict.fromkeys(shape.look for shape in shapes)
    folders: dict[str, list[str]] = {}
    for shape in shapes:
        folders.setdefault(LOOKS[shape.look].folder, []).append(_placemark(shape))
    marks = [*map(_style, looks)]
    for folder, inside in folders.items():
        marks += [f"<Folder><name>{folder}</name>", *inside, "</Folder>"]
    return KML.format(escape(name), _said("description", about), "\n".join(marks))


def _said(tag: str, text: str) -> str:
    return f"<{tag}>{escape(text)}</{tag}>" if text else ""


def _placemark(shape: Drawn) -> str:
    outer, *holes = (
        " ".join(f"{lon!r},{lat!r}" for lon, lat in line)
        for line in (shape.positions, *shape.holes)
    )
    drawn_so = KML_SHAPES[shape.kind].format(outer, "".join(map(KML_HOLE.format, holes)))
    told = _said("name", shape.name) + _said("description", shape.about)
    return f"<Placemark>{told}<styleUrl>#{shape.look}</styleUrl>{drawn_so}</Placemark>"


def _style(name: str) -> str:
    """Return how KML draws a look: its colours are opacity, blue, green and red, and without a
    style polygons are filled with opaque white.
    """
    look = LOOKS[name]
    red, green, blue = (look.colour[at : at + 2] for at in (1, 3, 5))
    code, inside = (
        f"<color>{round(255 * opacity):02x}{blue}{green}{red}</color>"
        for opacity in (look.opacity, look.fill)
    )
    filled = inside if look.fill else "<fill>0</fill>"
    return (
        f'<Style id="{name}"><IconStyle>{code}</IconStyle>'
        f"<LineStyle>{code}<width>{look.width:g}</width></LineStyle>"
        f"<PolyStyle>{filled}</PolyStyle></Style>"
    )


def _gpx(name: str, about: str, shapes: list[Drawn]) -> str:
    """Return GPX 1.1: way points, of lines routes, of areas tracks, as it knows no polygon."""
    order = {"Point": 0, "LineString": 1, "Polygon": 2}  # as its schema asks
    marks = []
    for feature in sorted(shapes, key=lambda shape: (order[shape.kind], shape.look == VESSEL)):
        is_way = feature.kind == "LineString" and feature.look == VESSEL  # of a vessel: no route
        whole, part, at = GPX_SHAPES["Polygon" if is_way else feature.kind]
        marked, *holes = (
            "".join(f'<{at} lat="{lat!r}" lon="{lon!r}"' + "/>" for lon, lat in line)
            for line in (feature.positions, *feature.holes)
        )
        if feature.kind == "Point":
            told = _said("name", feature.name) + _said("desc", feature.about)
            marks.append(marked.replace("/>", f">{told}</{at}>"))
            continue
        lines = (marked, *holes)
        inner = "".join(f"<{part}>{line}</{part}>" for line in lines) if part else marked
        marks.append(f"<{whole}><name>{escape(feature.name)}</name>{inner}</{whole}>")
    return GPX.format(escape(name), _said("desc", about), "\n".join(marks))


GPX = """<?xml version="1.0" encoding="UTF-8"?>
<gpx version="1.1" creator="bindusbl-des" xmlns="http://www.topografix.com/GPX/1/1">
<metadata><name>{}</name>{}</metadata>
{}
</gpx>
"""
GPX_SHAPES = {
    "Point": ("", "", "wpt"),
    "LineString": ("rte", "", "rtept"),
    "Polygon": ("trk", "trkseg", "trkpt"),
}

# What is KML in a zip archive
KMZ = "kmz"

WRITERS: Mapping[str, Callable[[str, str, list[Drawn]], str]] = {
    "geojson": _geojson,
    "kml": _kml,
    KMZ: _kml,
    "gpx": _gpx,
}
