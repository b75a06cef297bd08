"""What is exported can be read again: charts as areas, tables and messages as tracks."""

import json
import shutil
import zipfile
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from campaigns_for_tests import auv, hand_made
from commands_for_tests import call
from shapely import LinearRing, LineString, distance, from_wkb, points
from worlds import scenario

from bindusbl_des import Scenario, Setup, load_result, load_scenario, plan, simulate
from bindusbl_des.core.geometry.geodesy import ned_at_depth

ORIGIN = (54.33, 10.18)
KML = "{http://www.opengis.net/kml/2.2}"
GPX = "{http://www.topografix.com/GPX/1/1}"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a short mission in Kiel fjord, with its exports."""
    folder = tmp_path_factory.mktemp("charts") / "run"
    place = {"lat_deg": ORIGIN[0], "lon_deg": ORIGIN[1]}
    asked = scenario(name="Kiel <Fjord>", duration_s=20.0, environment={"origin": place})
    simulate(asked, seed=3).write(folder)
    for kind in ("geojson", "kml", "csv", "mcap"):
        outcome = call("export", folder, "--to", kind)
        assert outcome.exit_code == 0, outcome.output
    return folder


def shapes_of(chart: Path) -> dict[str, tuple[str, np.ndarray]]:
    """Return what a GeoJSON or KML file draws by its names: kind, and corners (lat, lon) in deg."""
    if chart.suffix == ".geojson":
        features = json.loads(chart.read_text())["features"]
        found = [(it["properties"]["name"], *it["geometry"].values()) for it in features]
    else:
        found = []
        for mark in ElementTree.parse(chart).iter(f"{KML}Placemark"):
            shape = mark[-1]
            corners = [list(map(float, it.split(","))) for it in "".join(shape.itertext()).split()]
            found.append((mark.findtext(f"{KML}name"), shape.tag.removeprefix(KML), corners))
    return {
        name: (kind, np.array(corners).reshape(-1, np.shape(corners)[-1])[:, 1::-1])
        for name, kind, corners in found
    }


def metres(corners: np.ndarray, origin: tuple[float, float] = ORIGIN) -> np.ndarray:
    """Return where corners (lat, lon) in degrees lie (x, y) about an origin."""
    return ned_at_depth(*corners.T, np.zeros(len(corners)), origin)[:, :2]


@pytest.mark.parametrize("ending", ["geojson", "kml"])
def test_a_chart_shows_area_vessels_and_ways(run: Path, ending: str) -> None:
    """To the micrometre where they were."""
    result = load_result(run)
    shapes = shapes_of(run / f"Kiel_Fjord_.{ending}")
    auvs, asvs = result.scenario.auvs.count, result.scenario.asvs.count
    assert len(shapes) == 1 + asvs + 2 * auvs
    tracks = result.tables["tracks"].groupby("vehicle")
    for name, columns in (("AUV1", ["x_m", "y_m"]), ("ASV0", ["x_m", "y_m"])):
        found = metres(shapes[name][1])
        expected = tracks.get_group(name)[columns].to_numpy()[: len(found)]
        np.testing.assert_allclose(found, expected, atol=1e-6)
    assert shapes["ASV0"][0] == "Point"
    assert shapes["AUV1 (estimate)"][0] == "LineString"


@pytest.mark.parametrize("ending", ["geojson", "kml"])
def test_a_way_of_one_place_is_a_point(ending: str, tmp_path: Path) -> None:
    """Lines have two positions or more (RFC 7946, 3.1.4; the same in KML)."""
    place = {"lat_deg": ORIGIN[0], "lon_deg": ORIGIN[1]}
    asked = scenario(duration_s=5.0, environment={"origin": place}, record={"tracks_hz": 0.1})
    simulate(asked, seed=3).write(tmp_path / "run")
    assert call("export", tmp_path / "run", "--to", ending).exit_code == 0
    [chart] = (tmp_path / "run").glob(f"*.{ending}")
    shapes = shapes_of(chart)
    assert {kind for kind, _ in shapes.values()} == {"Polygon", "Point"}
    assert len(shapes) == 1 + asked.asvs.count + 2 * asked.auvs.count


@pytest.mark.parametrize("ending", ["geojson", "kml"])
def test_a_chart_is_the_area_of_another_survey(run: Path, ending: str, tmp_path: Path) -> None:
    (tmp_path / "again.yaml").write_text(
        f"name: again\nsurvey: {{area: {run}/Kiel_Fjord_.{ending}}}\n"
        "environment: {origin: {lat_deg: 54.33, lon_deg: 10.18}}\n"
    )
    asked, again = load_result(run).scenario, load_scenario(tmp_path / "again.yaml")
    np.testing.assert_allclose(Setup(again).area.outline, Setup(asked).area.outline, atol=1e-6)
    # Without the origin it is the centre of the square again.
    alone = load_scenario(tmp_path / "again.yaml", overrides=["environment.origin=null"])
    assert Setup(alone).origin_deg == pytest.approx(ORIGIN, abs=1e-11)


@pytest.mark.parametrize(
    ("file", "track", "vertical"),
    [
        ("csv/tracks.csv", "AUV0", 1e-9),
        ("Kiel_Fjord_.mcap", "/AUV0/tracks", 1e-9),
        ("Kiel_Fjord_.mcap", "/AUV0/location", 1e-6),
    ],
)
def test_what_was_flown_can_be_flown_again(
    run: Path, tmp_path: Path, file: str, track: str, vertical: float
) -> None:
    (tmp_path / "again.yaml").write_text(
        "name: again\nduration_s: 20\n"
        f"auvs: {{count: 1, route: {{kind: track, files: [{run / file}], tracks: [{track}]}}}}\n"
        "environment: {origin: {lat_deg: 54.33, lon_deg: 10.18}}\n"
    )
    tracks = Setup(load_scenario(tmp_path / "again.yaml")).auv_tracks
    flown = load_result(run).tables["tracks"].query("vehicle == 'AUV0'")
    assert tracks is not None
    times, places = tracks[0]
    np.testing.assert_allclose(times, flown.time_s, atol=1e-6)
    np.testing.assert_allclose(places[:, :2], flown[["x_m", "y_m"]], atol=1e-6)
    np.testing.assert_allclose(places[:, 2], flown.z_m, atol=vertical)


def test_far_from_the_origin_depths_are_what_they_were(tmp_path: Path) -> None:
    """At 3, 5 and 10 km, where the survey's plane is 0.7 to 7.8 m above the ellipsoid."""
    reached = [(3e3, 0.0, 10.0), (-3e3, 4e3, 10.0), (6e3, -8e3, 10.0)]
    way = "".join(f"{4000 * n},{x},{y},{z}\n" for n, (x, y, z) in enumerate(reached))
    (tmp_path / "way.csv").write_text(f"time_s,x_m,y_m,depth_m\n{way}")
    asked = scenario(
        name="far",
        duration_s=8000.0,
        auvs={"count": 1, "route": {"kind": "track", "files": [str(tmp_path / "way.csv")]}},
        asvs={"count": 1, "formation": {"positions_m": [[8e3, -6e3]]}},
        environment={"origin": {"lat_deg": ORIGIN[0], "lon_deg": ORIGIN[1]}},
        record={"tracks_hz": 0.01},
    )
    simulate(asked, seed=1).write(tmp_path / "run")
    assert call("export", tmp_path / "run", "--to", "mcap").exit_code == 0
    for track in ("/AUV0/location", "/AUV0/tracks"):
        route = {"kind": "track", "files": [str(tmp_path / "run/far.mcap")], "tracks": [track]}
        tracks = Setup(Scenario.model_validate(
            {**asked.model_dump(exclude_unset=True), "auvs": {"count": 1, "route": route}}
        )).auv_tracks  # fmt: skip
        assert tracks is not None
        times, places = tracks[0]
        np.testing.assert_allclose(places[:, 2], 10.0, atol=1e-6)
        np.testing.assert_allclose(places[times == 4000.0], [reached[1]], atol=1e-6)


@pytest.fixture(scope="module")
def pacific(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Return the GeoJSON of a mission off Taveuni, Fiji, on both sides of 180 degrees."""
    folder = tmp_path_factory.mktemp("pacific") / "run"
    eastwards = {"kind": "waypoints", "points_m": [[[0.0, -20.0], [5.0, 20.0]]]}
    asked = scenario(
        name="Taveuni",
        duration_s=60.0,
        auvs={"count": 1, "route": eastwards},
        environment={"origin": {"lat_deg": -16.8, "lon_deg": 180.0}},
    )
    simulate(asked, 1).write(folder)
    call("export", folder, "--to", "geojson")
    read: dict[str, Any] = json.loads((folder / "Taveuni.geojson").read_text())
    return {**read, "path": folder / "Taveuni.geojson"}


def test_what_crosses_the_antimeridian_is_cut_there(pacific: dict[str, Any]) -> None:
    """RFC 7946, 3.1.9: no part of a line or polygon crosses it, and the parts meet on it."""
    kinds = [it["geometry"]["type"] for it in pacific["features"]]
    assert {"MultiPolygon", "MultiLineString"} <= set(kinds)
    for feature in pacific["features"]:
        kind, parts = feature["geometry"]["type"], feature["geometry"]["coordinates"]
        if kind == "Point":
            continue
        polygons = {"LineString": [[parts]], "Polygon": [parts], "MultiLineString": [parts]}
        lines = [line for polygon in polygons.get(kind, parts) for line in polygon]
        for line in lines:
            assert np.abs(np.diff(np.array(line)[:, 0])).max(initial=0.0) < 180.0
        if kind == "MultiLineString":
            for (_, end), (begin, _) in pairwise((it[0], it[-1]) for it in lines):
                assert (abs(end[0]), end[1]) == (180.0, begin[1])
                assert begin[0] == -end[0]


def test_an_area_that_was_cut_is_read_as_one(pacific: dict[str, Any]) -> None:
    place = {"origin": {"lat_deg": -16.8, "lon_deg": 180.0}}
    again = scenario(survey={"area": str(pacific["path"])}, environment=place)
    outline, found = (np.array(Setup(it).area.outline) for it in (scenario(), again))
    assert len(found) == len(outline)
    for corner in outline:
        assert np.hypot(*(found - corner).T).min() < 1e-6


def test_rings_go_counter_clockwise(run: Path, pacific: dict[str, Any]) -> None:
    """RFC 7946, 3.1.6: with longitude to the right and latitude up."""
    kiel = json.loads((run / "Kiel_Fjord_.geojson").read_text())
    rings = [kiel["features"][0]["geometry"]["coordinates"]]
    rings += pacific["features"][0]["geometry"]["coordinates"]
    assert len(rings) == 3
    assert all(LinearRing(polygon[0]).is_ccw for polygon in rings)


def test_exports_are_no_strangers_in_a_folder(run: Path) -> None:
    """A run may be written over them; a mission that is nowhere has no chart."""
    load_result(run).write(run, force=True)
    assert not (run / "Kiel_Fjord_.kml").exists()
    nowhere = simulate(scenario(name="nowhere", duration_s=2.0), 0).write(run.parent / "nowhere")
    outcome = call("export", nowhere, "--to", "kml")
    assert outcome.exit_code == 2
    assert "has no environment.origin, so it is nowhere on Earth; set" in outcome.output
    assert json.loads((nowhere / "run.json").read_text())["status"] == "complete"


@pytest.fixture(scope="module")
def team(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a plan in Greenwich, whose missions all come to 0.5 m."""
    folder, origin = tmp_path_factory.mktemp("plan"), {"lat_deg": ORIGIN[0], "lon_deg": 0.0}
    with pytest.MonkeyPatch.context() as patch:
        hand_made(patch, lambda asked, _: [auv(0.5)] * asked.auvs.count)
        asked = scenario(name="bay", environment={"origin": origin}, asvs={"count": 2})
        goal, teams = (
            {"position_error_m": 1.0},
            {"asvs.count": [2], "asvs.formation.angle_deg": [0]},
        )
        plan(asked, folder / "plan", below=goal, vary=teams)
    for kind in ("geojson", "kml", "kmz", "gpx", "qgc", "pdf"):
        assert call("export", folder / "plan", "--to", kind).exit_code == 0
    return folder / "plan"


@pytest.mark.parametrize("kind", ["geojson", "kml"])
def test_the_team_of_a_plan_is_a_chart(team: Path, kind: str) -> None:
    """Vessels where they lie, ranges around them, lanes thinned and yet where AUVs are to go."""
    shapes, setup = shapes_of(team / f"plan.{kind}"), Setup(load_scenario(team / "best.yaml"))
    kinds = [kind for kind, _ in shapes.values()]
    counts = {kind: kinds.count(kind) for kind in kinds}
    assert counts == {"Polygon": 1 + 2 * 2, "Point": 2, "LineString": setup.scenario.auvs.count}
    origin = (ORIGIN[0], 0.0)
    corners = shapes["ASV1 HF range"][1]
    assert tuple(corners[0]) == tuple(corners[-1])  # cos and sin of a whole turn are not, quite
    ring = metres(corners, origin) - np.array(setup.stations_m)[1]
    np.testing.assert_allclose(np.hypot(*ring.T), setup.horizontal_reach_m, atol=1e-5)
    lane, path = metres(shapes["AUV0 (plan)"][1], origin), setup.plans[0].path
    way = path.sample(np.linspace(0.0, path.length, 4001))[:, :2]
    assert len(lane) < 0.1 * path.length
    off = distance(LineString(lane), points(way))
    assert off.max() <= 0.3  # what a chart shows, and half a step


def look_of(document: ElementTree.Element, mark: ElementTree.Element) -> ElementTree.Element:
    """Return the style that a placemark names, which has to be there."""
    [style] = [it for it in document if f"#{it.get('id')}" == mark.findtext(f"{KML}styleUrl")]
    return style


def test_kml_covers_nothing_and_tells_auvs_apart(team: Path) -> None:
    """Areas and ranges are outlines, since KML's own default fills them with opaque white; each AUV
    has a colour of its own; vessels are pins with place and goal.
    """
    [document] = ElementTree.parse(team / "plan.kml").getroot()
    marks = list(document.iter(f"{KML}Placemark"))
    lines = {}
    for mark in marks:
        style, name = look_of(document, mark), mark.findtext(f"{KML}name") or ""
        if mark.find(f"{KML}Polygon") is not None:
            assert style.findtext(f"{KML}PolyStyle/{KML}fill") == "0"
        lines[name] = style.findtext(f"{KML}LineStyle/{KML}color") or ""
    assert len({lines[f"AUV{number} (plan)"] for number in range(3)}) == 3
    assert len({lines["survey area"], lines["ASV0 HF range"], lines["ASV0 MF range"]}) == 3
    folders = [it.findtext(f"{KML}name") for it in document.iter(f"{KML}Folder")]
    assert folders == ["survey", "vessels", "HF ranges", "MF ranges", "AUVs"]
    [pin] = [mark for mark in marks if mark.findtext(f"{KML}name") == "ASV1"]
    told = (pin.findtext(f"{KML}description") or "").splitlines()
    lon, lat = map(float, (pin.findtext(f"{KML}Point/{KML}coordinates") or "").split(","))
    assert told[0] == f"{lat:.6f} N, {abs(lon):.6f} {'E' if lon > 0 else 'W'}"
    degrees, minutes = told[1].split(" N, ")[0].rstrip("'").split(" ")
    assert int(degrees) + float(minutes) / 60.0 == pytest.approx(lat, abs=1e-6)
    assert told[2] == document.findtext(f"{KML}description")
    assert "at most 1 m, with 95 % confidence" in told[2]
    gpx = ElementTree.parse(team / "plan.gpx").getroot()
    tags = [it.tag.rpartition("}")[2] for it in gpx]
    assert tags == ["metadata", *["wpt"] * 2, *["rte"] * 3, *["trk"] * 5]
    [waypoint] = [it for it in gpx if it.findtext(f"{GPX}name") == "ASV1"]
    assert (waypoint.findtext(f"{GPX}desc") or "").splitlines() == told
    geojson = json.loads((team / "plan.geojson").read_text())
    [feature] = [it for it in geojson["features"] if it["properties"]["name"] == "ASV1"]
    assert feature["properties"]["description"].splitlines() == told


def test_what_was_believed_has_the_colour_of_its_auv(run: Path, tmp_path: Path) -> None:
    """Paler than the way that was gone, on charts of missions as well."""
    call("export", run, "--to", "kml", "--out", tmp_path / "run.kml", "--force")
    [document] = ElementTree.parse(tmp_path / "run.kml").getroot()
    colours = {
        mark.findtext(f"{KML}name"): look_of(document, mark).findtext(f"{KML}LineStyle/{KML}color")
        for mark in document.iter(f"{KML}Placemark")
    }
    true, believed = colours["AUV1"], colours["AUV1 (estimate)"]
    assert true is not None
    assert believed is not None
    assert true[2:] == believed[2:] != (colours["AUV0"] or "")[2:]
    assert int(believed[:2], 16) < int(true[:2], 16)


def test_a_kmz_is_the_kml_and_gdal_reads_it(team: Path) -> None:
    """With names and places; a plan that is made anew may replace all that was exported."""
    pyogrio = pytest.importorskip("pyogrio")
    with zipfile.ZipFile(team / "plan.kmz") as archive:
        assert archive.namelist() == ["doc.kml"]
        assert archive.read("doc.kml") == (team / "plan.kml").read_bytes()
    layers = [str(name) for name, _ in pyogrio.list_layers(team / "plan.kmz")]
    assert layers == ["survey", "vessels", "HF ranges", "MF ranges", "AUVs"]
    told, _, places, fields = pyogrio.raw.read(team / "plan.kmz", layer="vessels")
    names = fields[list(told["fields"]).index("Name")]
    assert list(names) == ["ASV0", "ASV1"]
    marks = shapes_of(team / "plan.geojson")
    for name, raw in zip(names, places, strict=True):
        assert from_wkb(raw).coords[0][1::-1] == pytest.approx(marks[name][1][0], abs=1e-9)


def test_gpx_of_a_plan_is_what_plotters_read(team: Path) -> None:
    """Way points, routes of AUVs, and outlines as tracks, by gpxpy."""
    gpxpy = pytest.importorskip("gpxpy")
    read = gpxpy.parse((team / "plan.gpx").read_text())
    assert [point.name for point in read.waypoints] == ["ASV0", "ASV1"]
    assert [route.name for route in read.routes] == [f"AUV{n} (plan)" for n in range(3)]
    assert len(read.tracks) == 5
    lane = shapes_of(team / "plan.geojson")["AUV1 (plan)"][1]
    way = [(point.latitude, point.longitude) for point in read.routes[1].points]
    np.testing.assert_allclose(way, lane, atol=1e-12)


def test_each_vehicle_has_a_plan_for_qgroundcontrol(team: Path) -> None:
    """Of the form that its developer guide states: lanes at their depth, vessels that stay."""
    files = sorted(path.name for path in (team / "qgc").iterdir())
    assert files == ["ASV0.plan", "ASV1.plan", "AUV0.plan", "AUV1.plan", "AUV2.plan"]
    setup = Setup(load_scenario(team / "best.yaml"))
    lanes = shapes_of(team / "plan.geojson")
    for name in files:
        plan = json.loads((team / "qgc" / name).read_text())
        assert (plan["fileType"], plan["version"], plan["groundStation"]) == (
            *("Plan", 1, "QGroundControl"),
        )
        assert plan["geoFence"] == {"circles": [], "polygons": [], "version": 2}
        assert plan["rallyPoints"] == {"points": [], "version": 2}
        mission = plan["mission"]
        assert sorted(mission) == [
            *("cruiseSpeed", "firmwareType", "globalPlanAltitudeMode", "hoverSpeed", "items"),
            *("plannedHomePosition", "vehicleType", "version"),
        ]
        assert mission["version"] == 2
        assert [item["doJumpId"] for item in mission["items"]] == list(
            range(1, len(mission["items"]) + 1)
        )
        assert all(len(item["params"]) == 7 for item in mission["items"])
        places = [item["params"][4:] for item in mission["items"] if item["frame"] == 3]
        assert mission["plannedHomePosition"][:2] == places[0][:2]
        if name.startswith("AUV"):
            assert mission["items"][0]["command"] == 178
            assert mission["items"][0]["params"][1] == setup.scenario.auvs.speed_m_per_s
            assert {place[2] for place in places} == {-setup.scenario.survey.depth_m}
            way = lanes[f"{name.removesuffix('.plan')} (plan)"][1]
            assert [place[:2] for place in places] == way.tolist()
        else:
            assert [item["command"] for item in mission["items"]] == [17]
            pin = lanes[name.removesuffix(".plan")][1][0]
            assert places == [[*pin, 0.0]]


def test_plans_over_a_slope_have_the_depth_of_each_point(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """6 m above a plane that is 30 + x tan 5 deg deep; its lines of equal depth are shown."""
    hand_made(monkeypatch, lambda asked, _: [auv(0.5)] * asked.auvs.count)
    origin = {"lat_deg": ORIGIN[0], "lon_deg": 0.0}
    slope = {"origin": origin, "bathymetry": {"depth_m": 30.0, "slope_deg": 5.0}}
    asked = scenario(
        name="bay", environment=slope, asvs={"count": 2}, auvs={"depth": {"altitude_m": 6.0}}
    )
    teams = {"asvs.count": [2], "asvs.formation.angle_deg": [0]}
    plan(asked, tmp_path / "plan", below={"position_error_m": 1.0}, vary=teams)
    for kind in ("qgc", "geojson"):
        assert call("export", tmp_path / "plan", "--to", kind).exit_code == 0
    items = json.loads((tmp_path / "plan" / "qgc" / "AUV0.plan").read_text())["mission"]["items"]
    places = np.array([item["params"][4:] for item in items if item["frame"] == 3])
    x, _ = metres(places[:, :2], (ORIGIN[0], 0.0)).T
    assert -places[:, 2] == pytest.approx(24.0 + x * np.tan(np.radians(5.0)), abs=1e-3)
    assert np.ptp(places[:, 2]) > 5.0
    assert "30 m" in shapes_of(tmp_path / "plan" / "plan.geojson")


@pytest.mark.parametrize("files", ["plan.kml", "plan.kmz", "plan.geojson", "plan.gpx", "qgc"])
def test_what_a_plan_exports_is_read_back(team: Path, files: str) -> None:
    """As lanes of its AUVs, in each format, as long as they were but for the corners."""
    names = [team / files] if files != "qgc" else [team / files / f"AUV{n}.plan" for n in range(3)]
    best = load_scenario(team / "best.yaml")
    route = {"kind": "waypoints", "files": [str(name) for name in names]}
    data = best.model_dump(mode="json", exclude_unset=True)
    again = Setup(Scenario.model_validate({**data, "auvs": {"route": route}}))
    lengths = [plan.path.length for plan in again.plans]
    assert lengths == pytest.approx([plan.path.length for plan in Setup(best).plans], rel=0.02)


def test_the_sheet_of_a_plan_is_for_its_skipper(team: Path) -> None:
    """One page: places in degrees and minutes, the goal in plain words, and no keys."""
    pypdf = pytest.importorskip("pypdf")
    [page] = pypdf.PdfReader(team / "plan.pdf").pages
    assert [round(float(side) / 72, 1) for side in page.mediabox[2:]] == [8.3, 11.7]
    text = page.extract_text()
    record = json.loads((team / "plan.json").read_text())
    places = record["candidates"][record["chosen"]]["places"]
    assert len(places) == 2
    for place in places:
        north, east = (
            f"{int(abs(angle)):0{digits}d} {60 * (abs(angle) % 1):07.4f}'"
            for angle, digits in ((place["lat_deg"], 2), (place["lon_deg"], 3))
        )
        assert f"{place['asv']} {north} N, {east} {'EW'[place['lon_deg'] < 0]}" in text
    assert "2 vessels: mean position error 0.500 m" in text
    assert "Goal for the worst AUV: mean position error below 1.00 m" in text
    assert "ASV1 lost" in text or "ASV0 lost" in text
    assert not [word for word in text.split() if "_" in word]


def test_sheets_and_vehicle_plans_are_of_plans(run: Path, team: Path) -> None:
    """A run has none, and a folder that holds other things is kept."""
    for kind in ("qgc", "pdf"):
        outcome = call("export", run, "--to", kind)
        assert outcome.exit_code == 2
        assert f"is no plan; {kind} is for the vessels and lanes of one" in outcome.output
    (team / "qgc" / "mine.txt").write_text("kept")
    outcome = call("export", team, "--to", "qgc", "--force")
    (team / "qgc" / "mine.txt").unlink()
    assert outcome.exit_code == 2
    assert "holds mine.txt, which no export wrote, so it is not replaced" in outcome.output
    assert call("export", team, "--to", "qgc", "--force").exit_code == 0


def test_a_long_doubt_stays_in_its_column(team: Path, tmp_path: Path) -> None:
    """It goes on in the next line, and does not run into the numbers beside it."""
    pypdf = pytest.importorskip("pypdf")
    folder = tmp_path / "long"
    shutil.copytree(team, folder)
    record = json.loads((folder / "plan.json").read_text())
    words = "drift wanders over " + " and ".join(f"{n}33 m, not {n}000" for n in range(1, 7))
    record["sensitivity"][0]["told"] = words
    (folder / "plan.json").write_text(json.dumps(record))
    assert call("export", folder, "--to", "pdf", "--force").exit_code == 0
    [page] = pypdf.PdfReader(folder / "plan.pdf").pages
    lines = page.extract_text().splitlines()
    first = next(n for n, line in enumerate(lines) if line.startswith("drift wanders over 133 m"))
    assert "333" not in lines[first]
    assert words not in "\n".join(lines)
    told = " ".join(lines).replace("  ", " ")
    assert all(f"{n}33" in told and f"{n}000" in told for n in range(1, 7))
