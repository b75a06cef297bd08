"""Maps are charts: north is up and east to the right on pages, figures and in a terminal."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser_for_tests import Open, Opened, without_browser
from commands_for_tests import call
from logs_for_tests import Sea, made_up
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.patches import Polygon
from pages_for_tests import beside
from worlds import scenario

from bindusbl_des import Result, replay, simulate
from bindusbl_des.apps.recorded.drawing import drawn
from bindusbl_des.core.geometry.geodesy import geodetic_from_ned

ORIGIN = (54.33, 10.18)
# A bay that opens to the north, its east side shorter than its west side.
BAY = [(0.0, -60.0), (80.0, -60.0), (80.0, -40.0), (20.0, -40.0), (20.0, 40.0), (50.0, 40.0),
       (50.0, 60.0), (0.0, 60.0)]  # fmt: skip
# A vessel in the middle, one north of it, one east of it.
MIDDLE, NORTH, EAST = [10.0, 0.0], [50.0, 0.0], [10.0, 40.0]
# North, then to starboard: east, then south.
STARBOARD = [[-20.0, 0.0], [20.0, 0.0], [20.0, 30.0], [-20.0, 30.0]]


OUTLINE = "bindusbl.map.mission.outline.map(([x, y]) => bindusbl.map.at(x, y))"


def bay(**changes: Any) -> Any:
    """A minute in the bay, where an AUV turns to starboard twice."""
    keys: dict[str, Any] = {
        "duration_s": 90.0,
        "survey": {"polygon_m": BAY},
        "auvs": {"count": 1, "route": {"kind": "waypoints", "points_m": [STARBOARD]}},
        "asvs": {"count": 3, "formation": {"positions_m": [MIDDLE, NORTH, EAST]}},
        "navigation": {"velocity": "through_water"},
        "environment": {
            "origin": {"lat_deg": ORIGIN[0], "lon_deg": ORIGIN[1]},
            "current_m_per_s": 0.1,
            "current_direction_deg": 90.0,
        },
    }
    return scenario(**(keys | changes))


@pytest.fixture(scope="module")
def result() -> Result:
    """The mission in the bay."""
    return simulate(bay(), 0)


@pytest.fixture(scope="module")
def page(result: Result, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its report."""
    path = tmp_path_factory.mktemp("maps") / "report.html"
    path.write_text(result.report(), encoding="utf-8")
    return path


def is_charted(middle: Any, north: Any, east: Any) -> bool:
    """Tell whether what is north lies straight above on the screen, y downwards, and what is east
    straight to the right.
    """
    (x, y), (nx, ny), (ex, ey) = middle, north, east
    return bool(ny < y - 50 and ex > x + 50 and abs(nx - x) < 5 and abs(ey - y) < 5)


def turning(points: Any) -> float:
    """Return twice the area that points go round, positive clockwise on a screen, y downwards."""
    x, y = np.asarray(points, dtype=float).T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def drawn_at(it: Opened, canvas: str, colours: Sequence[str]) -> list[list[float]]:
    """Return the middles of all that is painted on a canvas in some colours, px."""
    found: list[list[float]] = it.ask(
        f"""(() => {{ const it = document.querySelector({canvas!r}), {{ width, height }} = it;
        const {{ data }} = it.getContext("2d").getImageData(0, 0, width, height);
        return {list(colours)}.map((colour) => {{
            const wanted = parseInt(colour.slice(1), 16), sum = [0, 0, 0];
            for (let i = 0; i < width * height; i++) {{
                const [red, green, blue] = data.subarray(4 * i, 4 * i + 3);
                if ((red << 16 | green << 8 | blue) !== wanted) continue;
                sum[0] += i % width; sum[1] += Math.floor(i / width); sum[2]++;
            }}
            return [sum[0] / sum[2], sum[1] / sum[2]]; }}); }})()"""
    )
    return found


@without_browser
@pytest.mark.parametrize("width", [1280, 390])
def test_vessels_stand_on_the_page_as_on_a_chart(opened: Open, page: Path, width: int) -> None:
    """In a report and beside another run; the survey is as wide and as high as it is."""
    it = opened(page, "light", width)
    vessels = "[0, 1, 2].map((i) => bindusbl.mission.asvAt(i, 0))"
    assert is_charted(*it.ask(f"{vessels}.map(({{ x, y }}) => bindusbl.map.at(x, y))"))
    outline = np.array(it.ask(OUTLINE))
    across = np.ptp(outline, axis=0)
    assert across[0] / across[1] == pytest.approx(120.0 / 80.0)
    assert (outline > 0).all()
    assert (outline[:, 0] < it.ask("bindusbl.map.width")).all()


@without_browser
def test_what_is_painted_is_on_a_chart(opened: Open, tmp_path: Path) -> None:
    """Hulls of AUVs that hold their places, in their colours, beside two runs as in one."""
    held = {"kind": "hold", "positions_m": [MIDDLE, NORTH, EAST]}
    still = simulate(bay(auvs={"count": 3, "route": held}, duration_s=5.0), 0)
    (tmp_path / "report.html").write_text(still.report(), encoding="utf-8")
    (tmp_path / "both.html").write_text(beside(("one", still), ("two", still)), encoding="utf-8")
    for name, canvas in (("report.html", "#map"), ("both.html", ".map")):
        it = opened(tmp_path / name)
        places = drawn_at(it, canvas, it.ask("colours.series.slice(0, 3)"))
        assert is_charted(*places), (name, places)


@without_browser
def test_headings_and_ellipses_are_on_a_chart(opened: Open, page: Path) -> None:
    """A hull points where the AUV goes; an ellipse is long, and leans, as its covariance is."""
    it = opened(page)
    it.ask("""void (window.shown = (draw) => {
        const canvas = Object.assign(document.createElement("canvas"), { width: 100, height: 100 });
        const context = canvas.getContext("2d"), map = Object.create(SeaMap.prototype);
        Object.assign(map, { width: 100, height: 100, view: { x: 0, y: 0, scale: 1 } });
        draw(map, context);
        const { data } = context.getImageData(0, 0, 100, 100), places = [];
        for (let i = 0; i < 10000; i++) if (data[4 * i + 3] > 100) {
            places.push([i % 100 - 49.5, Math.floor(i / 100) - 49.5]);
        }
        return places; })""")
    for yaw_deg, (right, down) in ((0, (0, -1)), (90, (1, 0)), (180, (0, 1)), (-90, (-1, 0))):
        hull = it.ask(f"shown((map, it) => map.hull(it, 50, 50, {np.radians(yaw_deg)}, 'black'))")
        nose = max(hull, key=lambda place: float(np.hypot(*place)))
        assert nose[0] * right + nose[1] * down > 7, yaw_deg
    for (xx, yy, xy), leaning in (((400, 25, 0), 0), ((100, 100, 80), -1), ((100, 100, -80), 1)):
        spread = f"[{xx}, {yy}, {xy}]"
        oval = f"shown((map, it) => map.ellipse(it, 0, 0, {spread}, 1, 'black', {{ fill: 1 }}))"
        sides = np.cov(np.array(it.ask(oval)).T)
        if leaning:  # both north and east, or north and west: on a screen y goes down
            assert np.sign(sides[0, 1]) == leaning
            assert abs(sides[0, 1]) / sides[0, 0] == pytest.approx(0.8, abs=0.05)
        else:
            assert sides[1, 1] > 10 * sides[0, 0]


@without_browser
def test_a_turn_to_starboard_is_clockwise(opened: Open, page: Path) -> None:
    """As planned, and as flown."""
    it = opened(page)
    for way in ("bindusbl.mission.auvs[0].plan", "bindusbl.mission.auvs[0]"):
        drawn_way = it.ask(f"Array.from({way}.x, (x, i) => bindusbl.map.at(x, {way}.y[i]))")
        assert turning(drawn_way) > 1000


@without_browser
def test_a_page_is_the_chart_that_is_exported(
    opened: Open, result: Result, page: Path, tmp_path: Path
) -> None:
    """To the right is what has a greater longitude in the KML, up what has a greater latitude; and
    the place under the cursor is told with the latitude and longitude that are exported.
    """
    words = ("--to", "geojson", "--out", tmp_path / "bay.geojson")
    assert call("export", result.write(tmp_path / "run"), *words).exit_code == 0
    shapes = {}
    for feature in json.loads((tmp_path / "bay.geojson").read_text())["features"]:
        corners = np.array(feature["geometry"]["coordinates"])
        flat = corners.reshape(-1, corners.shape[-1])
        shapes[feature["properties"]["name"]] = flat[:, 1::-1]
    tracks = result.tables["tracks"].groupby("vehicle")
    it = opened(page)
    for name in ("AUV0", "ASV1", "ASV2"):
        lat, lon = np.array(shapes[name]).T
        places = tracks.get_group(name)[["x_m", "y_m"]].to_numpy()[: len(lat)].tolist()
        right, down = np.array(it.ask(f"{places}.map(([x, y]) => bindusbl.map.at(x, y))")).T
        if name == "AUV0":
            assert np.corrcoef(lon, right)[0, 1] > 0.999999
            assert np.corrcoef(lat, down)[0, 1] < -0.999999
        told = np.array(it.ask(f"{places}.map((it) => onEarth(it, bindusbl.map.mission.origin))"))
        np.testing.assert_allclose(told, np.column_stack((lat, lon)), atol=1e-9, rtol=0)
    area = np.array(shapes["survey area"])[:, ::-1] * (1.0, -1.0)
    assert turning(it.ask(OUTLINE)) > 0
    assert turning(area) < 0  # counter-clockwise, whichever way round the survey was given
    for place, origin in (([3e4, -4e4], (-33.9, 151.3)), ([-500.0, 9e3], (78.2, -179.99))):
        found = it.ask(f"onEarth({place}, {list(origin)})")
        assert found == pytest.approx(geodetic_from_ned([*place, 0.0], *origin)[:2], abs=1e-8)


@without_browser
def test_the_cursor_and_the_current_are_told(opened: Open, page: Path) -> None:
    """What is written on the map: axes, scale, current; under the mouse metres and degrees."""
    it = opened(page)
    it.ask("""(() => { window.written = [];
        const fill = CanvasRenderingContext2D.prototype.fillText;
        CanvasRenderingContext2D.prototype.fillText = function (text, ...at) {
            written.push(text); fill.call(this, text, ...at); }; })()""")
    it.page.locator("#map").scroll_into_view_if_needed()
    x, y = it.ask("(() => { bindusbl.map.drawn = ''; return bindusbl.map.at(30, -50); })()")
    it.page.locator("#map").hover(position={"x": x, "y": y})
    it.until("bindusbl.map.cursor")
    written = it.ask("written")
    assert {"east (m)", "north (m)", "N", "20 m", "current 0.10 m/s"} <= set(written)
    lat, lon, _ = geodetic_from_ned([30.0, -50.0, 0.0], *ORIGIN)
    (degrees,) = {text for text in written if "° N" in text}
    assert [float(it.split("°")[0]) for it in degrees.split(", ")] == pytest.approx(
        [lat, lon], abs=2e-5
    )
    (metres,) = {text for text in written if text.startswith("north ") and "east" in text}
    assert metres[:9] in ("north 30.", "north 29.")


def screen(axes: Axes, points: Any) -> np.ndarray:
    """Return where points of axes are on a screen, px, y downwards."""
    axes.figure.canvas.draw()  # type: ignore[union-attr]
    found: np.ndarray = axes.transData.transform(np.asarray(points, dtype=float)) * (1.0, -1.0)
    return found


@pytest.mark.parametrize("kind", ["trajectory", "coverage"])
def test_figures_are_charts(result: Result, kind: str) -> None:
    """Vessels and survey lie as at sea, and a turn to starboard is clockwise."""
    axes = result.plot(kind).axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("east (m)", "north (m)")
    rings = (them for them in axes.collections if isinstance(them, PatchCollection))
    around = (path.get_extents() for them in rings for path in them.get_paths())
    middles = {((box.x0 + box.x1) / 2, (box.y0 + box.y1) / 2): None for box in around}
    assert is_charted(*screen(axes, list(middles)))
    survey = next(patch for patch in axes.patches if isinstance(patch, Polygon))
    assert turning(screen(axes, survey.get_xy())) > 0
    assert {"N", "current\n0.1 m/s"} <= {text.get_text() for text in axes.texts}
    if kind == "trajectory":
        flown = next(it for it in axes.collections if it.get_label() == "true")
        assert isinstance(flown, LineCollection)
        assert turning(screen(axes, flown.get_segments()[0])) > 1000


def test_the_chance_of_a_fix_is_shaded_on_a_chart() -> None:
    """Around a vessel in the north-west of the bay, and nowhere else."""
    near = {"positions_m": [[70.0, -50.0]]}
    mission = bay(asvs={"count": 1, "formation": near}, acoustics={"hf": {"range_m": 20.0}})
    (image,) = simulate(mission, 0).plot("coverage").axes[0].images
    shades = np.asarray(image.get_array())
    rows, columns = np.nonzero(shades > 0.5)  # from the south, from the west
    assert shades.shape[1] / shades.shape[0] == pytest.approx(120.0 / 80.0, rel=0.05)
    assert rows.mean() == pytest.approx(shades.shape[0] * 69.0 / 80.0, rel=0.1)
    assert columns.mean() == pytest.approx(shades.shape[1] * 11.0 / 120.0, rel=0.3)


def test_a_replay_is_a_chart() -> None:
    """Beacons and ways of a log of one's own lie as at sea."""
    log, _ = made_up(Sea(), count=60)
    axes = drawn(replay(log)).axes[0]
    assert axes.get_xlabel() == "east (m)"
    beacons = next(line for line in axes.lines if line.get_label() == "beacon").get_xydata()
    assert beacons == pytest.approx(log.beacons.places[:, 1::-1])


def test_a_map_in_the_terminal_is_a_chart(tmp_path: Path) -> None:
    """North is up and east to the right, and the bay opens upwards."""
    (tmp_path / "bay.yaml").write_text(
        f"name: bay\nsurvey: {{polygon_m: {json.dumps(BAY)}}}\n"
        f"asvs: {{count: 3, formation: {{positions_m: {[MIDDLE, NORTH, EAST]}}}}}\n"
        "auvs: {count: 1}\nacoustics: {hf: {range_m: 20}}\n"
    )
    told = call("coverage", tmp_path / "bay.yaml")
    assert told.exit_code == 0, told.stderr
    lines = told.stdout.partition("to the right:\n")[2].splitlines()
    places = {
        mark: (line.index(mark), row)
        for row, line in enumerate(lines)
        for mark in "02"
        if mark in line
    }
    assert places["0"][1] == places["2"][1]
    assert places["2"][0] > places["0"][0]
    assert lines[0].rstrip() == "." * 8  # the west side reaches further north
    assert len(lines) == 16
