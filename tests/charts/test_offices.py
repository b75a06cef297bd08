"""Coordinates as offices have them: grids by their codes, charts of GIS, degrees and minutes."""

import json
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands_for_tests import call
from worlds import scenario

from bindusbl_des import Scenario, Setup, load_scenario, simulate

pyogrio = pytest.importorskip("pyogrio")
pyproj = pytest.importorskip("pyproj")
shapely = pytest.importorskip("shapely")

# A concave bay in metres of a grid, about its south-west corner.
BAY = np.array([(0, 0), (1500, 0), (1500, 700), (900, 700), (900, 400), (600, 400), (0, 650)])
# Corners south-west of a bay in grids of both hemispheres, at 180 degrees, and of another datum.
GRIDS = {
    "EPSG:32760": (763_400.0, 5_810_000.0),  # 180 deg lies in the middle of it
    "EPSG:32632": (575_000.0, 6_020_000.0),
    "EPSG:32719": (255_000.0, 6_340_000.0),
    "EPSG:2193": (1_755_000.0, 5_920_000.0),
}
FIRST = next(iter(GRIDS))


def bay(code: str) -> Any:
    """Return the bay in a grid, as shapely's polygon."""
    return shapely.Polygon(BAY + GRIDS[code])


def in_degrees(code: str, shape: Any) -> list[tuple[float, float]]:
    """Return the corners of a polygon in a grid, longitude and latitude (deg)."""
    transformer = pyproj.Transformer.from_crs(code, "EPSG:4326", always_xy=True)
    return [transformer.transform(*corner) for corner in shape.exterior.coords]


def chart(path: Path, code: str | None, shapes: dict[str, Any], column: str = "name") -> Path:
    """Write named shapes as a chart in the format of the path's ending."""
    drivers = {".shp": "ESRI Shapefile", ".gpkg": "GPKG", ".dxf": "DXF", ".geojson": "GeoJSON"}
    options = {"RFC7946": "NO"} if path.suffix == ".geojson" else {}
    pyogrio.raw.write(
        path,
        np.array([shape.wkb for shape in shapes.values()], dtype=object),
        field_data=[np.array(list(shapes), dtype=object)],
        fields=[column],
        crs=code,
        geometry_type=next(iter(shapes.values())).geom_type,
        driver=drivers[path.suffix],
        **options,
    )
    return path


def surveyed(area: Path | None = None, **survey: Any) -> Setup:
    return Setup(scenario(survey={**survey, **({"area": str(area)} if area else {})}))


def refused(**keys: Any) -> str:
    with pytest.raises(ValueError) as told:  # noqa: PT011  # each is told what it says
        scenario(**keys)
    return str(told.value)


@pytest.mark.parametrize("code", GRIDS)
def test_lengths_and_areas_are_those_on_the_ellipsoid(tmp_path: Path, code: str) -> None:
    """Not those of the grid, whose scale differs: pyproj's geodesics, and areas between them."""
    found = surveyed(chart(tmp_path / "bay.gpkg", code, {"bay": bay(code)})).area
    corners = in_degrees(code, bay(code))
    if code == FIRST:
        assert {lon > 0.0 for lon, _ in corners} == {True, False}  # it crosses 180 degrees
    geod = pyproj.Geod(ellps="WGS84")
    lon, lat = zip(*corners, strict=True)
    square_m, around_m = geod.polygon_area_perimeter(lon, lat)
    assert found.square_m == pytest.approx(abs(square_m), rel=1e-6)
    assert found.shape.length == pytest.approx(around_m, rel=1e-7)
    legs = np.hypot(*np.diff([*found.outline, found.outline[0]], axis=0).T)
    expected = geod.line_lengths(lon, lat)
    assert sorted(legs) == pytest.approx(sorted(expected), rel=1e-7)


def kmz(path: Path, corners: list[tuple[float, float]]) -> Path:
    places = " ".join(f"{lon},{lat}" for lon, lat in corners)
    ring = f"<LinearRing><coordinates>{places}</coordinates></LinearRing>"
    mark = f"<Polygon><outerBoundaryIs>{ring}</outerBoundaryIs></Polygon>"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("files/photo.png", b"")
        archive.writestr("doc.kml", f"<kml><Placemark><name>bay</name>{mark}</Placemark></kml>")
    return path


def vehicle_plan(path: Path, corners: list[tuple[float, float]]) -> Path:
    """Write a plan of QGroundControl with a survey, as its guide describes it."""
    places = [[lat, lon] for lon, lat in corners[:-1]]
    item = {
        **{"type": "ComplexItem", "complexItemType": "survey", "polygon": places, "angle": 0},
        "TransectStyleComplexItem": {"VisualTransectPoints": places[:2], "Items": []},
    }
    mission = {"version": 2, "items": [item], "plannedHomePosition": [*places[0], 0]}
    plan = {"fileType": "Plan", "version": 1, "groundStation": "QGroundControl", "mission": mission}
    path.write_text(json.dumps(plan))
    return path


def zipped(folder: Path) -> Path:
    chart(folder / "bay.shp", FIRST, {"bay": bay(FIRST)})
    with zipfile.ZipFile(folder / "office.zip", "w") as archive:
        for file in folder.glob("bay.*"):
            archive.write(file, file.name)
            file.unlink()
    return folder / "office.zip"


MAKERS: dict[str, Callable[[Path], tuple[Path, dict[str, str]]]] = {
    "shp": lambda at: (chart(at / "bay.shp", FIRST, {"bay": bay(FIRST)}), {}),
    "zip": lambda at: (zipped(at), {}),
    "gpkg": lambda at: (chart(at / "bay.gpkg", FIRST, {"bay": bay(FIRST)}), {}),
    "dxf": lambda at: (
        chart(at / "bay.dxf", None, {"SURVEY": bay(FIRST).exterior}, "Layer"),
        {"crs": FIRST},
    ),
    "geojson": lambda at: (chart(at / "bay.geojson", FIRST, {"bay": bay(FIRST)}), {}),
    "kmz": lambda at: (kmz(at / "bay.kmz", in_degrees(FIRST, bay(FIRST))), {}),
    "plan": lambda at: (vehicle_plan(at / "bay.plan", in_degrees(FIRST, bay(FIRST))), {}),
}


@pytest.mark.filterwarnings("ignore:'crs' was not provided")
@pytest.mark.parametrize("kind", MAKERS)
def test_the_area_is_the_same_in_every_format(tmp_path: Path, kind: str) -> None:
    file, more = MAKERS[kind](tmp_path)
    found, expected = (
        surveyed(file, **more).area,
        surveyed(polygon_deg=[[lat, lon] for lon, lat in in_degrees(FIRST, bay(FIRST))[:-1]]).area,
    )
    off = shapely.hausdorff_distance(found.shape, expected.shape)
    assert off < 0.01  # a DXF has as many digits as it was written with


def test_a_run_keeps_a_shapefile_whole(tmp_path: Path) -> None:
    """Its folder has what lies beside the .shp as well, and is moved elsewhere with it; another
    grid beside it is another area.
    """
    file = chart(tmp_path / "bay.shp", FIRST, {"bay": bay(FIRST)})
    asked = {"area": str(file)}
    mission = scenario(duration_s=2.0, survey=asked)
    folder = simulate(mission, 0).write(tmp_path / "run")
    area = Setup(mission).area.square_m
    for left in tmp_path.glob("bay.*"):
        left.unlink()
    folder = shutil.move(folder, tmp_path / "elsewhere")
    [kept] = (tmp_path / "elsewhere" / "charts").iterdir()
    assert kept.suffix == ".shz"
    again = load_scenario(Path(folder) / "scenario.yaml")
    assert Setup(again).area.square_m == area
    assert call("validate", Path(folder) / "scenario.yaml").exit_code == 0
    shifted = chart(tmp_path / "bay.shp", "EPSG:32759", {"bay": bay(FIRST)})
    assert Setup(scenario(duration_s=2.0, survey={"area": str(shifted)})).origin_deg != (
        Setup(again).origin_deg
    )


def test_one_of_several_polygons_is_named(tmp_path: Path) -> None:
    north = shapely.affinity.translate(bay(FIRST), 0.0, 2000.0)
    file = chart(tmp_path / "bays.gpkg", FIRST, {"north": north, "south": bay(FIRST)}, "Name")
    lat = [surveyed(file, area_name=name).origin_deg for name in ("north", "south")]
    assert lat[0] is not None
    assert lat[1] is not None
    assert lat[0][0] - lat[1][0] == pytest.approx(2000.0 / 111e3, rel=0.01)
    said = refused(survey={"area": str(file)})
    assert "bays.gpkg: holds 2 polygons ('north'; 'south'); name the one" in said
    said = refused(survey={"area": str(file), "area_name": "west"})
    assert "holds no polygon of the name 'west'; there is 'north'; 'south'" in said


def test_what_offices_forget_is_told(tmp_path: Path) -> None:
    """With file, place and remedy."""
    whole = {"bay": bay(FIRST)}
    file = chart(tmp_path / "bay.shp", FIRST, whole)
    (tmp_path / "bay.prj").unlink()
    assert "bay.shp: names no grid" in refused(survey={"area": str(file)})
    assert "crs: EPSG:32760" in refused(survey={"area": str(file)})
    assert surveyed(file, crs=FIRST).area.square_m > 700_000
    (tmp_path / "bay.shx").unlink()
    assert "bay.shp: needs bay.shx beside it" in refused(survey={"area": str(file)})
    file = chart(tmp_path / "bay.gpkg", FIRST, whole)
    said = refused(survey={"area": str(file), "crs": "EPSG:2193"})
    assert "bay.gpkg: names EPSG:32760 itself; remove crs: EPSG:2193" in said
    (tmp_path / "junk.gpkg").write_bytes(b"junk")
    assert "junk.gpkg: cannot be read as a chart" in refused(
        survey={"area": str(tmp_path / "junk.gpkg")}
    )
    (tmp_path / "empty.kmz").write_bytes(b"")
    assert "empty.kmz: is empty; save it anew" in refused(
        survey={"area": str(tmp_path / "empty.kmz")}
    )
    with zipfile.ZipFile(tmp_path / "nothing.kmz", "w") as archive:
        archive.writestr("readme.txt", "")
    assert "nothing.kmz: holds no .kml" in refused(survey={"area": str(tmp_path / "nothing.kmz")})
    damaged = kmz(tmp_path / "damaged.kmz", in_degrees(FIRST, bay(FIRST)))
    damaged.write_bytes(damaged.read_bytes()[:60])
    assert "damaged.kmz: is no KMZ" in refused(survey={"area": str(damaged)})
    bare = tmp_path / "grid.geojson"
    ring = [list(corner) for corner in bay(FIRST).exterior.coords]
    bare.write_text(json.dumps({"type": "Polygon", "coordinates": [ring]}))
    assert "projected grid such as UTM?" in refused(survey={"area": str(bare)})
    said = refused(survey={"area": str(bare), "crs": "EPSG:99999"})
    assert "EPSG:99999 is no code of a coordinate system; write such as EPSG:32760" in said
    swapped = [[y, x] for x, y in ring]
    bare.write_text(json.dumps({"type": "Polygon", "coordinates": [swapped]}))
    said = refused(survey={"area": str(bare), "crs": FIRST})
    assert "grid.geojson: position 0: 5810000, 763400 is far from where EPSG:32760" in said
    assert "north and east are swapped: write east first" in said


def test_a_mistake_in_a_file_has_its_line(tmp_path: Path) -> None:
    text = (
        "name: bay\nsurvey:\n  crs: EPSG:1\n  area: bay.geojson\nasvs:\n  count: 1\n  formation:\n"
    )
    text += '    positions_deg: ["33 51.4 S, 151 72.5 E"]\n'
    (tmp_path / "bay.geojson").write_text(
        json.dumps({"type": "Polygon", "coordinates": [[[0, 0], [9, 0], [9, 9], [0, 0]]]})
    )
    (tmp_path / "bay.yaml").write_text(text)
    told = call("validate", tmp_path / "bay.yaml")
    assert told.exit_code == 2
    assert "bay.yaml:4:9: survey.area: " in told.output
    assert "EPSG:1 is no code of a coordinate system" in told.output
    assert "bay.yaml:8:21: asvs.formation.positions_deg.0: '151 72.5 E' is no" in told.output
    assert not [path for path in tmp_path.iterdir() if path.suffix not in (".yaml", ".geojson")]


SYDNEY = (-33.0 - 51.4 / 60.0, 151.0 + 12.5 / 60.0)


@pytest.mark.parametrize(
    "written",
    [
        ["33 51.4 S", "151 12.5 E"],
        "33 51.4 S, 151 12.5 E",
        "S 33 51.4 E 151 12.5",
        "151°12'30\" E 33°51'24\" S",
        ["33-51.4S", 151.0 + 12.5 / 60.0],
        "33 51,4 S; 151 12,5 E",
        "EPSG:32756 334255.758 6252292.328",
        "EPSG:32756 6252292.328 N, 334255.758 E",
    ],
)
def test_a_place_is_written_as_offices_do(written: Any) -> None:
    """Wherever degrees may stand: the vessel is where it would be with numbers."""

    def mission(place: Any) -> Scenario:
        origin = {"lat_deg": "33 51.0 S", "lon_deg": "151 12.0 E"}
        return scenario(
            environment={"origin": origin},
            asvs={"count": 1, "formation": {"positions_deg": [place]}},
        )

    expected = Setup(mission(list(SYDNEY))).stations_m
    assert Setup(mission(written)).stations_m[0] == pytest.approx(expected[0], abs=0.01)
    assert mission(written) == Scenario.model_validate(mission(written).model_dump(mode="json"))


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ("33 51.4 S", "is no place; write"),
        ("33 61.4 S, 151 12.5 E", "minutes and seconds are below 60"),
        ("33.5 51.4 S, 151 12.5 E", "only the last part has decimals"),
        ("93 51.4 S, 151 12.5 E", "is beyond 90 deg, so no latitude"),
        ("-33 51.4 S, 151 12.5 E", "is no latitude; write degrees"),
        ("33 51.4 S, 151 12.5 S", "is no longitude; write degrees"),
        ("EPSG:32756 334368", "is no place of a grid"),
        ("EPSG:32756 6252057 334368", "north and east are swapped"),
        ("EPSG:5703 1 2", "is no grid of places on a map"),
        (["north", 151.0], "'north' is no latitude"),
    ],
)
def test_what_is_no_place_is_told(place: Any, words: str) -> None:
    origin = {"lat_deg": -33.85, "lon_deg": 151.2}
    formation = {"positions_deg": [place]}
    said = refused(environment={"origin": origin}, asvs={"count": 1, "formation": formation})
    assert "asvs.formation.positions_deg.0" in said
    assert words in said


def test_grids_need_their_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the extra the message says how to install it."""
    monkeypatch.setitem(__import__("sys").modules, "pyproj", None)
    said = refused(
        environment={"origin": {"lat_deg": 0.0, "lon_deg": 0.0}},
        asvs={"count": 1, "formation": {"positions_deg": ["EPSG:32631 1 2"]}},
    )
    assert "python -m pip install 'bindusbl-des[gis]'" in said
