"""Areas in GeoJSON and KML files: what is read, and what is refused with a remedy."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bindusbl_des.models.charts.areas import read_area, read_geojson
from bindusbl_des.models.charts.xml_charts import read_kml

# Four corners in Kiel fjord, [longitude, latitude], and closed.
RING = [[10.18, 54.33], [10.185, 54.33], [10.185, 54.332], [10.18, 54.332], [10.18, 54.33]]
CORNERS = ((54.33, 10.18), (54.33, 10.185), (54.332, 10.185), (54.332, 10.18))
POLYGON: dict[str, Any] = {"type": "Polygon", "coordinates": [RING]}
POINT = {"type": "Point", "coordinates": [10.18, 54.33]}

KML = """<?xml version="1.0" encoding="UTF-8"?>
<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:gx="http://www.google.com/kml/ext/2.2">
<Document><name>Plan</name>
<Folder>
<Placemark><name>Pier</name><Point><coordinates>10.18,54.33,0</coordinates></Point></Placemark>
<Placemark><name>Area</name><Polygon><tessellate>1</tessellate>
<outerBoundaryIs><LinearRing><coordinates>
  {corners}
</coordinates></LinearRing></outerBoundaryIs>{inner}
</Polygon></Placemark>
</Folder></Document></kml>
"""
GPX = """<gpx xmlns="http://www.topografix.com/GPX/1/1"><wpt lat="54.33" lon="10.18"/>
<{0}>{1}</{0}></gpx>
"""
KML_CORNERS = " ".join(f"{lon},{lat},0" for lon, lat in RING)


def feature(geometry: Any, **properties: Any) -> dict[str, Any]:
    return {"type": "Feature", "geometry": geometry, "properties": properties}


def collection(*features: Any) -> dict[str, Any]:
    return {"type": "FeatureCollection", "features": list(features)}


def written(folder: Path, data: Any, name: str = "area.geojson") -> Path:
    path = folder / name
    path.write_text(data if isinstance(data, str) else json.dumps(data), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "data",
    [
        POLYGON,
        feature(POLYGON),
        collection(feature(POLYGON, name="area"), feature(POINT, name="pier"), feature(None)),
        {"type": "GeometryCollection", "geometries": [POLYGON, POINT]},
        {"type": "MultiPolygon", "coordinates": [[RING]]},
        {
            **POLYGON,
            "crs": {"type": "name", "properties": {"name": "urn:ogc:def:crs:OGC:1.3:CRS84"}},
        },
        {**POLYGON, "coordinates": [[[*corner, -12.0] for corner in RING]]},
    ],
)
def test_the_polygon_of_a_geojson_file_is_the_area(tmp_path: Path, data: Any) -> None:
    """Longitude comes first there, latitude here; altitudes and what is no polygon do not count."""
    assert read_area(written(tmp_path, data)) == CORNERS


@pytest.mark.parametrize("middle", [10.0, 179.9999, 180.0, -179.9999])
def test_a_gpx_area_may_lie_on_the_line_of_180_degrees(tmp_path: Path, middle: float) -> None:
    """What ends some metres from its begin is an area, and a line across is none."""
    loop = [(50.0, 5e-5), (50.0, 0.01), (50.01, 0.01), (50.01, -0.01), (50.0, -0.01), (50.0, -1e-4)]
    zigzag = [(10.0 + k // 2 * 0.01, 0.01 * (1 if k % 4 in (1, 2) else -1)) for k in range(8)]

    def is_area(places: list[tuple[float, float]]) -> bool:
        text = "".join(
            f'<rtept lat="{lat}" lon="{(lon + middle + 180.0) % 360.0 - 180.0}"/>'
            for lat, lon in places
        )
        path = written(tmp_path, GPX.format("rte", text), "area.gpx")
        return said(read_area, path) == str(path)

    assert (is_area(loop), is_area(zigzag)) == (True, False)


@pytest.mark.parametrize(("line", "point"), [("rte", "rtept"), ("trkseg", "trkpt")])
@pytest.mark.parametrize("gap", [0.0, 0.00005])
def test_a_line_of_a_gpx_file_that_ends_where_it_began_is_the_area(
    tmp_path: Path, line: str, point: str, gap: float
) -> None:
    """Drawn by hand it need not meet its first point; an open one is refused with the remedy."""
    ends = (54.33 + gap, 10.18)

    def gpx(*corners: tuple[float, float]) -> Path:
        text = "".join(f'<{point} lat="{lat}" lon="{lon}"/>' for lat, lon in corners)
        return written(tmp_path, GPX.format(line, text), "area.gpx")

    assert read_area(gpx(*CORNERS, ends)) == (*CORNERS, *([ends] if gap else []))
    told = said(read_area, gpx(*CORNERS))
    assert "holds no polygon (1 line, 1 point); draw the area, and end it where it begins" in told
    assert f"area.gpx:2: {line}: needs two positions" in said(read_area, gpx(ends))
    assert "needs numbers as lat and lon" in said(read_area, gpx(*CORNERS, ("north", 1)))  # type: ignore[arg-type]


def test_the_polygon_of_a_kml_file_is_the_area(tmp_path: Path) -> None:
    text = KML.format(corners=KML_CORNERS, inner="")
    assert read_area(written(tmp_path, text, "area.kml")) == CORNERS
    # Old files have another namespace, hand-made ones none.
    bare = text.replace(' xmlns="http://www.opengis.net/kml/2.2"', "")
    assert read_area(written(tmp_path, bare, "bare.kml")) == CORNERS


def test_points_and_lines_are_read_as_well(tmp_path: Path) -> None:
    lines = {"type": "MultiLineString", "coordinates": [RING[:2], RING[2:4]]}
    shapes = read_geojson(written(tmp_path, collection(feature(POINT), feature(lines))))
    assert [(it.kind, it.corners) for it in shapes] == [
        ("point", CORNERS[:1]),
        ("line", CORNERS[:2]),
        ("line", CORNERS[2:]),
    ]
    kml = read_kml(written(tmp_path, KML.format(corners=KML_CORNERS, inner=""), "a.kml"))
    assert [it.kind for it in kml] == ["point", "polygon"]
    assert kml[0].where == f"{tmp_path}/a.kml:5: Point ('Pier')"


SWAPPED = [[lat, lon] for lon, lat in [[140.0 + x, y] for x, y in RING]]
METRES = [[0, 0], [500, 0], [500, 300], [0, 300], [0, 0]]
SMALL_METRES = [[-70, -50], [70, -50], [70, 50], [-70, 50], [-70, -50]]


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ("{", r"area.geojson: is no GeoJSON: Expecting property name"),
        ("[1, 2]", r"is no GeoJSON object \(a list\)"),
        (
            {"type": "Polygone"},
            r"is no GeoJSON object \(type 'Polygone'\); it needs a type such as",
        ),
        (
            collection(feature(POINT), feature(POINT)),
            r"holds no polygon \(2 points\); draw the area",
        ),
        (collection(), r"holds no polygon \(nothing\)"),
        (
            collection(feature(POLYGON, name="a"), feature(POLYGON)),
            r"holds 2 polygons \('a'; '1'\); name the one to be surveyed in survey.area_name",
        ),
        (
            feature({"type": "Polygon", "coordinates": [SWAPPED]}),
            r"position 0: latitude 150.18 is beyond 90 deg: latitude and longitude are swapped; "
            r"write \[longitude, latitude\]",
        ),
        (
            {"type": "Polygon", "coordinates": [METRES]},
            r"position 1: latitude 0, longitude 500 are no degrees .* metres, or a projected grid",
        ),
        (
            {"type": "Polygon", "coordinates": [SMALL_METRES]},
            r"reaches over 100 deg of latitude, more than 999 km; are these metres\?",
        ),
        (
            {"type": "Polygon", "coordinates": [RING[:-1]]},
            r"its ring is not closed; repeat its first position at its end",
        ),
        (
            {"type": "Polygon", "coordinates": [RING[:3]]},
            r"its ring has 3 positions; a polygon needs",
        ),
        ({"type": "Polygon", "coordinates": []}, r"holds no polygon \(nothing\)"),
        ({"type": "Polygon", "coordinates": [7]}, r"needs a list of positions; got 7"),
        ({"type": "Polygon"}, r"needs a list of coordinates; got nothing"),
        (
            {"type": "Polygon", "coordinates": [[["10,18", "54,33"]] * 4]},
            r"position 0: needs two numbers \[longitude, latitude\]; got \['10,18', '54,33'\]",
        ),
        ({"type": "Polygon", "coordinates": [[[True, False]] * 4]}, r"needs two numbers"),
        ('{"type": "Point", "coordinates": [1e999, 2]}', r"2, inf is no position"),
        ({"type": "Point", "coordinates": [1, 10**400]}, r"has a number beyond all others"),
        ({"type": "LineString", "coordinates": [[1, 2]]}, r"a LineString needs two positions"),
        (
            {**POLYGON, "crs": {"type": "name", "properties": {"name": "EPSG:32632"}}},
            r"10.18, 54.33 are degrees, it seems, and EPSG:32632 \(WGS 84 / UTM zone 32N\) is in",
        ),
        ("[" * 10**5, r"is no GeoJSON: it is nested too deeply"),
    ],
)
def test_what_is_no_area_is_told_with_its_place_and_a_remedy(
    tmp_path: Path, data: Any, said: str
) -> None:
    path = written(tmp_path, data)
    with pytest.raises(ValueError, match=said) as told:
        read_area(path)
    assert str(told.value).startswith(str(path))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<kml>", r"is no XML: no element found: line 1, column 5"),
        ("<gpx></gpx>", r"area.kml:1: begins with <gpx>; expected <kml>"),
        ("PK\x03\x04", r"is a zip archive; if it is a KMZ, let its name end in .kmz"),
        ("<kml/>", r"holds no polygon \(nothing\)"),
        (
            '<!DOCTYPE kml [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]><kml>&b;</kml>',
            r"area.kml:1: declares a document type",
        ),
        (
            '<!DOCTYPE kml SYSTEM "file:///etc/hostname"><kml/>',
            r"declares a document type, which may hide other files",
        ),
        ("<kml>" + "<a>" * 200, r"is nested deeper than 60 levels"),
        (
            KML.format(corners="54.33,100.18 " * 4, inner=""),
            r"area.kml:7: latitude 100.18 is beyond",
        ),
        (
            KML.format(corners="10.18, 54.33 " * 4, inner=""),
            r"kml:7: '10.18,' is no position; write",
        ),
        (KML.format(corners="", inner=""), r"kml:6: Polygon \('Area'\): has no coordinates"),
        (
            KML.format(corners=KML_CORNERS, inner="<innerBoundaryIs/>"),
            r"kml:6: Polygon \('Area'\): has no coordinates",
        ),
        (KML.replace("outerBoundaryIs", "outside"), r"needs an outerBoundaryIs"),
    ],
)
def test_kml_that_is_none_is_told_with_its_line(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        read_area(written(tmp_path, text, "area.kml"))


def test_files_that_are_none_are_told(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"gone.kml: cannot be read \(No such file or directory\)"):
        read_area(tmp_path / "gone.kml")
    with pytest.raises(ValueError, match=r"area.txt: is no chart by its name; use .geojson, .json"):
        read_area(written(tmp_path, POLYGON, "area.txt"))


def test_a_file_that_has_changed_is_read_again(tmp_path: Path) -> None:
    path = written(tmp_path, POLYGON)
    read_area(path)
    written(tmp_path, {"type": "Polygon", "coordinates": [[*RING[1:], RING[1]]]})
    assert read_area(path) == (*CORNERS[1:], CORNERS[0])


def said(read: Callable[[Any], object], path: Path) -> str:
    """Return what is said of a file, its name if it can be read."""
    try:
        read(path)
    except ValueError as error:
        return str(error)
    return str(path)


JSON = st.recursive(
    st.none() | st.booleans() | st.floats(allow_nan=False) | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=5)
        | st.dictionaries(
            st.sampled_from(["type", "features", "geometry", "geometries", "coordinates", "crs"]),
            inner | st.sampled_from(["Feature", "FeatureCollection", "Polygon", "MultiPoint"]),
            max_size=4,
        )
    ),
    max_leaves=30,
)


@given(JSON)
def test_whatever_stands_in_a_json_file_nothing_but_a_bad_chart_is_raised(
    tmp_path_factory: pytest.TempPathFactory, data: Any
) -> None:
    path = written(tmp_path_factory.getbasetemp(), data)
    assert said(read_geojson, path).startswith(str(path))


@given(st.lists(st.sampled_from([*"<>/&;,= \n0159.-", "kml", "Placemark", "Polygon", "Point"])))
def test_whatever_stands_in_a_kml_file_nothing_but_a_bad_chart_is_raised(
    tmp_path_factory: pytest.TempPathFactory, words: list[str]
) -> None:
    path = tmp_path_factory.getbasetemp() / "any.kml"
    for text in ("".join(words), f"<kml><Placemark><Point><coordinates>{''.join(words)}"):
        path.write_text(text)
        assert said(read_kml, path).startswith(str(path))
