"""Routes that are drawn on charts: what of them is flown, and how near to them."""

import json
import math
import zipfile
from itertools import pairwise
from pathlib import Path as FilePath

import numpy as np
import pytest
from commands_for_tests import call
from hypothesis import given
from hypothesis import strategies as st

from bindusbl_des import Setup, load_scenario, simulate
from bindusbl_des.apps.export.chart_files import write_plan
from bindusbl_des.core.geometry.drawn_routes import along_route
from bindusbl_des.core.geometry.paths import Path

Points = list[tuple[float, float]]

PLAN = """name: bay
duration_s: survey
environment: {origin: {lat_deg: 54.33, lon_deg: 10.16}}
survey: {side_m: 140, depth_m: 8, swath_m: 10}
auvs: {count: 1}
"""


def off(path: Path, points: Points) -> float:
    """Return how far (m) the farthest of some points is from a path."""
    looks = path.sample(np.linspace(0.0, path.length, 20_000))[:, :2]
    return max(float(np.hypot(*(looks - point).T).min()) for point in points)


def legs_of(points: Points) -> float:
    return sum(math.dist(one, other) for one, other in pairwise(points))


@pytest.mark.parametrize("change", [{}, {"auvs.vehicle": "remus100"}, {"auvs.route.turns": "bulb"}])
def test_the_lanes_of_a_plan_are_flown_from_its_gpx(
    change: dict[str, str], tmp_path: FilePath
) -> None:
    """They are as long as planned, less what a chart leaves out of turns, and where they were.
    (Over each point, with a circle where it cannot turn, they took 2.3 times as long.)
    """
    (tmp_path / "plan.yaml").write_text(PLAN)
    planned = load_scenario(
        tmp_path / "plan.yaml", overrides=[f"{key}={value}" for key, value in change.items()]
    )
    write_plan(Setup(planned), tmp_path / "plan.gpx", "gpx")
    route = "auvs.route={kind: waypoints, files: [plan.gpx]}"
    vehicle = [f"{key}={value}" for key, value in change.items() if key == "auvs.vehicle"]
    drawn = load_scenario(tmp_path / "plan.yaml", overrides=[route, *vehicle])
    for before, after in zip(Setup(planned).plans, Setup(drawn).plans, strict=True):
        assert 0.98 < after.path.length / before.path.length < 1.001
        looks = before.path.sample(np.linspace(0.0, before.path.length, 400))[:, :2]
        radius = max(1.0 / abs(it.curvature) for it in after.path.segments if it.curvature)
        assert off(after.path, [tuple(it) for it in looks.tolist()]) < 0.12 * radius + 0.3


def test_vessels_on_the_move_are_no_routes_of_auvs(tmp_path: FilePath) -> None:
    """Their ways are tracks in GPX, so that a plan's own file can be flown."""
    (tmp_path / "plan.yaml").write_text(PLAN)
    planned = Setup(load_scenario(tmp_path / "plan.yaml"))
    ways = [[[0.0, 0.0], [50.0, 9.0]], [[9.0, 0.0], [70.0, 9.0]]]
    write_plan(planned, tmp_path / "plan.gpx", "gpx", ways=ways)
    text = (tmp_path / "plan.gpx").read_text()
    assert "<trk><name>ASV1 (way)</name>" in text
    option = "auvs.route={kind: waypoints, files: [plan.gpx]}"
    drawn = Setup(load_scenario(tmp_path / "plan.yaml", overrides=[option]))
    assert drawn.plans[0].path.length == pytest.approx(planned.plans[0].path.length, rel=0.02)


def test_a_mission_flies_them_and_its_folder_keeps_the_file(
    tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As many lanes are flown as with the plan's own keys, and the folder's scenario can be flown
    again where the file is no more.
    """
    monkeypatch.chdir(tmp_path)
    FilePath("plan.yaml").write_text(PLAN.replace("140", "60"))
    planned = load_scenario("plan.yaml")
    write_plan(Setup(planned), FilePath("plan.gpx"), "gpx")
    option = "auvs.route={kind: waypoints, files: [plan.gpx]}"
    done = call("run", "plan.yaml", "--set", option, "--no-advice", "--out", "flown")
    assert done.exit_code == 0, done.output
    FilePath("plan.gpx").unlink()
    again = simulate(load_scenario("flown/scenario.yaml"), seed=0)
    swept = simulate(planned, seed=0).tables["mission"].area_covered_share
    assert again.tables["mission"].area_covered_share.item() == pytest.approx(
        swept.item(), rel=0.02
    )


# Two ways in Kiel fjord, latitude and longitude (deg), and charts that have them as lines
WAYS = {
    "north": [(54.3305, 10.16), (54.3305, 10.161), (54.331, 10.161)],
    "south": [(54.33, 10.16), (54.33, 10.161)],
}


def lon_lat(way: list[tuple[float, float]], sign: str = " ") -> str:
    return sign.join(f"{lon},{lat}" for lat, lon in way)


def as_kml() -> str:
    marks = [
        f"<Placemark><name>{name}</name><LineString><coordinates>{lon_lat(way)}</coordinates>"
        "</LineString></Placemark>"
        for name, way in WAYS.items()
    ]
    area = lon_lat([(54.32, 10.15), (54.34, 10.15), (54.34, 10.17), (54.32, 10.15)])
    ring = f"<LinearRing><coordinates>{area}</coordinates></LinearRing>"
    polygon = f"<Polygon><outerBoundaryIs>{ring}</outerBoundaryIs></Polygon>"
    return f"<kml><Placemark>{polygon}</Placemark>{''.join(marks)}</kml>"


def as_geojson() -> str:
    lines = [[[lon, lat] for lat, lon in way] for way in WAYS.values()]
    features = [
        {"type": "Feature", "properties": {"name": name}, "geometry": geometry}
        for name, geometry in (
            (name, {"type": "LineString", "coordinates": line})
            for name, line in zip(WAYS, lines, strict=True)
        )
    ]
    return json.dumps({"type": "FeatureCollection", "features": features})


def as_plan(way: list[tuple[float, float]]) -> str:
    """Return a plan of QGroundControl: way points, the last leg as the transect of a survey."""
    *first, begin, end = way
    items = [
        {"type": "SimpleItem", "command": 178, "params": [1, 1.5, -1, 0, 0, 0, 0]},  # a speed
        *(
            {"type": "SimpleItem", "command": 16, "params": [0, 0, 0, None, lat, lon, -8]}
            for lat, lon in first
        ),
        {
            "type": "ComplexItem",
            "complexItemType": "CorridorScan",
            "TransectStyleComplexItem": {"Items": [], "VisualTransectPoints": [begin, end]},
        },
    ]
    return json.dumps({"fileType": "Plan", "version": 1, "mission": {"version": 2, "items": items}})


def test_lines_of_any_chart_are_ways(tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each format says the same, in its order or by names; areas beside them are none."""
    monkeypatch.chdir(tmp_path)
    FilePath("plan.yaml").write_text(PLAN.replace("count: 1", "count: 2"))
    FilePath("ways.kml").write_text(as_kml())
    with zipfile.ZipFile("ways.kmz", "w") as archive:
        archive.writestr("doc.kml", as_kml())
    FilePath("ways.geojson").write_text(as_geojson())
    for name, way in WAYS.items():
        FilePath(f"{name}.plan").write_text(as_plan(way))
    names = [f"<rte><name>{name}</name>{rte(*way)}</rte>" for name, way in WAYS.items()]
    FilePath("ways.gpx").write_text(f"<gpx>{''.join(names)}<trk/></gpx>")

    def lengths(files: str, more: str = "") -> list[float]:
        option = f"auvs.route={{kind: waypoints, files: {files}{more}}}"
        plans = Setup(load_scenario("plan.yaml", overrides=[option])).plans
        return [plan.path.length for plan in plans]

    expected = lengths("[ways.gpx]")
    assert expected[1] == pytest.approx(65.1, abs=0.1)
    for files in ("[ways.kml]", "[ways.kmz]", "[ways.geojson]", "[north.plan, south.plan]"):
        assert lengths(files) == pytest.approx(expected, abs=1e-6)
        assert lengths(files, ", routes: [south, north]") == pytest.approx(expected[::-1], abs=1e-6)
    option = "auvs.route={kind: waypoints, files: [ways.kml], routes: [south, west]}"
    told = call("validate", "plan.yaml", "--set", option).output
    assert "no line of the files is named 'west'; there is 'north', 'south'" in told


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.plan", "{}", 'is no plan of QGroundControl: it needs "fileType": "Plan"'),
        ("a.plan", '{"fileType": "Plan"}', "its mission needs a list of items; got nothing"),
        (
            "a.plan",
            '{"fileType": "Plan", "mission": {"items": []}}',
            "holds no line (nothing); draw the way of each AUV as a line",
        ),
        (
            "a.plan",
            '{"fileType": "Plan", "mission": {"items": [{"command": 16, "params": [1]}]}}',
            "a.plan: item 0: needs seven params; got [1]",
        ),
        ("a.kml", "<kml/>", "a.kml: holds no line (nothing)"),
        ("a.geojson", '{"type": "Point", "coordinates": [1, 2]}', "holds no line (1 point)"),
    ],
)
def test_charts_without_ways_are_told(
    name: str, text: str, words: str, tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    FilePath("plan.yaml").write_text(PLAN)
    FilePath(name).write_text(text)
    option = f"auvs.route={{kind: waypoints, files: [{name}]}}"
    told = call("validate", "plan.yaml", "--set", option)
    assert told.exit_code == 2
    assert words in told.output


def test_vehicles_come_to_a_route_and_leave_it(tmp_path: FilePath) -> None:
    """From where they are launched to where they are recovered; the route is their one lane."""
    (tmp_path / "plan.yaml").write_text(PLAN)
    write_plan(Setup(load_scenario(tmp_path / "plan.yaml")), tmp_path / "plan.gpx", "gpx")
    ends = [[-90.0, -80.0]]
    options = [
        "auvs.route={kind: waypoints, files: [plan.gpx]}",
        f"auvs.launch_m={ends}",
        f"auvs.recovery_m={ends}",
    ]
    alone = Setup(load_scenario(tmp_path / "plan.yaml", overrides=options[:1])).plans
    for plan, own in zip(
        Setup(load_scenario(tmp_path / "plan.yaml", overrides=options)).plans, alone, strict=True
    ):
        assert [plan.path.start.x, plan.path.start.y] == ends[0]
        assert [plan.path.end.x, plan.path.end.y] == pytest.approx(ends[0])
        ((first, last),) = plan.lanes
        assert last - first == pytest.approx(own.path.length)
        assert plan.path.sample(np.array([first]))[0, :2] == pytest.approx(
            [own.path.start.x, own.path.start.y]
        )


def lanes(spacing: float) -> Points:
    """Return six lanes of 100 m as on a plotter: their ends alone."""
    return [
        (x, spacing * k) for k in range(6) for x in ((0.0, 100.0) if k % 2 == 0 else (100.0, 0.0))
    ]


def test_corners_with_room_are_turned_inside_and_others_by_dubins_curves() -> None:
    """Between lanes 10 m apart are half circles of 5 m: each corner is 10 - 5 pi / 2 m shorter.
    Where they are 5 m apart the vehicle swings out and goes over their ends.
    """
    path = along_route(lanes(10.0), 5.0)
    assert path.length == pytest.approx(legs_of(lanes(10.0)) - 10.0 * (10.0 - 2.5 * math.pi))
    assert off(path, lanes(10.0)) == pytest.approx(5.0 * (math.sqrt(2.0) - 1.0), abs=0.01)
    narrow = along_route(lanes(5.0), 5.0)
    assert off(narrow, lanes(5.0)) < 0.51
    assert narrow.length < 1.25 * legs_of(lanes(5.0))


def test_a_curve_of_many_points_is_flown_without_circles() -> None:
    angles = np.linspace(0.0, 1.9 * np.pi, 60)
    ring = [(40.0 * math.cos(a), 40.0 * math.sin(a)) for a in angles]
    path = along_route(ring, 5.0)
    assert path.length == pytest.approx(legs_of(ring), rel=0.01)
    assert off(path, ring) < 0.52


@given(
    st.lists(st.tuples(st.integers(-30, 30), st.integers(-30, 30)), min_size=2, max_size=9),
    st.floats(0.5, 12.0),
)
def test_any_route_is_a_path_that_turns_no_tighter_and_passes_each_point(
    corners: list[tuple[int, int]], radius: float
) -> None:
    """From its first point to its last; corners are cut by 0.42 radii where they are right angles,
    and by less than what a turn about leaves.
    """
    points = [(5.0 * x, 5.0 * y) for x, y in dict.fromkeys(corners)]
    if len(points) < 2:
        return
    path = along_route(points, radius)
    assert all(abs(it.curvature) * radius <= 1.0 + 1e-9 for it in path.segments)
    assert [path.start.x, path.start.y] == pytest.approx(points[0])
    assert [path.end.x, path.end.y] == pytest.approx(points[-1], abs=1e-6)
    assert path.length <= legs_of(points) + 4.0 * math.pi * radius * len(points)


GPX = """<gpx version="1.0" xmlns="http://www.topografix.com/GPX/1/0">
<rte><name>a</name>{}</rte><rte>{}</rte></gpx>
"""


def rte(*points: tuple[float, float]) -> str:
    return "".join(f'<rtept lat="{lat}" lon="{lon}"><ele>0</ele></rtept>' for lat, lon in points)


def test_what_is_wrong_with_routes_is_told_at_their_key(
    tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    FilePath("plan.yaml").write_text(PLAN)
    ways = rte((54.33, 10.16), (54.3301, 10.16)), rte((54.33, 10.161), (54.33, 10.161))
    FilePath("r.gpx").write_text(GPX.format(*ways))
    FilePath("t.gpx").write_text("<gpx><trk/></gpx>")
    FilePath("far.gpx").write_text(GPX.format(rte((4.33, 10.16), (4.331, 10.16)), ways[0]))

    def told(files: str, count: int = 2, kind: str = "waypoints", more: str = "") -> str:
        route = f"auvs.route={{kind: {kind}, files: {files}{more}}}"
        done = call("validate", "plan.yaml", "--set", f"auvs.count={count}", "--set", route)
        assert done.exit_code == 2
        return done.output

    assert "files: needs one line per AUV: 3 expected, 2 given" in told("[r.gpx]", 3)
    assert "auvs.route.files.1: needs at least two points, those in a row" in told("[r.gpx]")
    assert "t.gpx: holds no route (rte); tracks with times are flown by" in told("[t.gpx]", 1)
    assert "auvs.route.files: no such file" in told("[gone.gpx]").replace("files.0", "files")
    assert "latitude 4.33, longitude 10.16 is 5,370 km from environment.origin" in told("[far.gpx]")
    both = told("[r.gpx]", more=", points_m: [[[0, 0], [9, 9]], [[0, 0], [9, 9]]]")
    assert "gives points beside files; keep one of them" in both
    track = told("[r.gpx, r.gpx]", kind="track")
    assert "r.gpx: holds routes, whose points have no times, and no track; routes are flown by" in (
        track
    )
