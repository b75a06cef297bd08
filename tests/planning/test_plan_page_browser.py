"""The page of a plan in a real browser: vessels are moved, and predicted as Python predicts."""

import copy
import re
import shlex
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from browser_for_tests import Open, Opened, without_browser
from plans_for_tests import (
    Inputs,
    attacked,
    base,
    chart_of,
    error_map,
    inputs_of,
    plan_page,
    predict,
    record,
)
from shapely import LineString, Point, Polygon, box

from bindusbl_des import Scenario, Setup, load_scenario
from bindusbl_des.apps.planning.prediction.predicting import Prediction

pytestmark = without_browser

METRICS = (
    "hf_coverage",
    "fix_rate_hz",
    "fix_age_max_s",
    "position_error_m",
    "position_error_p95_m",
)
STATIONS = "bindusbl.chart.team.stations"
ASV0 = "#vessels .vessel >> nth=0"


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of a small plan."""
    path = tmp_path_factory.mktemp("plan") / "plan.html"
    scenario = base()
    path.write_text(
        plan_page(record(), chart_of(Setup(scenario), inputs_of(Setup(scenario)))), encoding="utf-8"
    )
    return path


def settled(it: Opened) -> None:
    """Wait until what was moved last is predicted and shaded."""
    it.until("bindusbl.chart.waiting === null && bindusbl.chart.resting === null")


def agrees(it: Opened, scenario: Scenario) -> None:
    """Check that all numbers of the chart are what Python predicts for the vessels on it."""
    settled(it)
    inputs, stations = inputs_of(Setup(scenario)), np.array(it.ask(STATIONS))
    found = predict(inputs, stations)
    for metric in METRICS:
        shown = it.ask(f"Array.from(bindusbl.chart.predicted.{metric})")
        assert shown == pytest.approx(getattr(found, metric).tolist(), rel=1e-6), metric
    worst = it.ask("worstOf('position_error_p95_m', bindusbl.chart.predicted)")
    assert worst == pytest.approx(found.worst("position_error_p95_m"), rel=1e-6)
    places = it.ask("bindusbl.chart.grids.fine.places")[::97]
    field = it.ask("Array.from(bindusbl.chart.field)")[::97]
    passing = [as_it_passes(place, inputs, found) for place in places]
    assert field == pytest.approx(passing, rel=1e-6)
    it.page.select_option("#shade", "dwells")
    field = it.ask("Array.from(bindusbl.chart.field)")[::97]
    assert field == pytest.approx(error_map(inputs, stations, places).error_m.tolist(), rel=1e-6)
    assert "an AUV that dwells at a place" in it.page.inner_text("#field-scale")
    it.page.select_option("#shade", "lanes")
    assert "the AUV that passes nearest" in it.page.inner_text("#field-scale")


def as_it_passes(place: list[float], inputs: Inputs, found: Prediction) -> float:
    """Return the predicted error of the AUV whose way comes nearest to a place, as it does."""
    least, error = np.inf, np.nan
    for way, own in zip(inputs.ways.places_m, found.error_over_time, strict=True):
        line = LineString(way)
        if (away := line.distance(Point(place))) < least:
            least, along = away, line.project(Point(place))
            gone = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(way, axis=0).T))))
            error = float(np.interp(along, gone, own))
    return error


def drag(it: Opened, right: float, down: float) -> None:
    """Take the first vessel by hand and let it go so many pixels further."""
    it.page.locator("#map").scroll_into_view_if_needed()
    box = it.page.locator(ASV0).bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    mouse = it.page.mouse
    mouse.move(x, y)
    mouse.down()
    for step in range(1, 6):
        mouse.move(x + right * step / 5, y + down * step / 5)
    mouse.up()


@pytest.mark.parametrize(("scheme", "width"), [("light", 1280), ("dark", 390)])
def test_a_plan_opens(opened: Open, page: Path, scheme: str, width: int) -> None:
    """The answer is on the chart, all is painted, and nothing is wider than the window."""
    it = opened(page, scheme, width)
    assert it.painted("#map") > 30
    assert it.ask("bindusbl.plots.pareto") == len(record()["candidates"])
    assert len(it.page.query_selector_all(".dot.simulated")) == 6 + 3  # and the key
    assert it.ask("document.documentElement.scrollWidth") <= width
    answer = record()["candidates"][record()["chosen"]]
    assert it.ask(STATIONS) == [
        [pytest.approx(x, abs=0.005), pytest.approx(y, abs=0.005)] for x, y in answer["stations"]
    ]
    assert "Simulated in 3 missions" in it.page.inner_text("#simulated")
    agrees(it, base())


def test_a_dragged_vessel_is_predicted_at_once(opened: Open, page: Path) -> None:
    """Coverage and error of each AUV are what Python predicts for where the vessel was let go."""
    it = opened(page)
    before, told = it.ask(STATIONS), it.page.inner_text("#worst")
    scale = it.ask("bindusbl.chart.map.view.scale")
    drag(it, 90, 60)
    settled(it)
    after = it.ask(STATIONS)
    assert after[0] == pytest.approx(
        [before[0][0] - 60 / scale, before[0][1] + 90 / scale], abs=0.02
    )
    assert after[1:] == before[1:]
    assert it.page.inner_text("#worst") != told
    assert "Not simulated" in it.page.inner_text("#simulated")
    agrees(it, base())


def test_a_finger_drags_a_vessel_and_scrolls_beside_it(browser: Any, page: Path) -> None:
    """On a vessel one finger moves it and not the page; on the sea it scrolls the page."""
    tab = browser.new_page(viewport={"width": 390, "height": 800}, has_touch=True, is_mobile=True)
    tab.goto(page.as_uri())
    touch = tab.context.new_cdp_session(tab)
    tab.evaluate("byId('map').scrollIntoView({ block: 'center' })")
    tab.wait_for_timeout(300)

    def swipe(x: float, y: float) -> None:
        for step in range(8):
            kind = "touchMove" if step else "touchStart"
            points = [{"x": x, "y": y - 10 * step, "id": 0}]
            touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
            tab.wait_for_timeout(16)
        touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        tab.wait_for_timeout(500)

    before, scrolled = tab.evaluate(STATIONS), tab.evaluate("scrollY")
    box = tab.locator(ASV0).bounding_box()
    swipe(box["x"] + 22, box["y"] + 22)
    after = tab.evaluate(STATIONS)
    assert after[0][0] - before[0][0] == pytest.approx(
        70 / tab.evaluate("bindusbl.chart.map.view.scale"), rel=0.2
    )
    assert tab.evaluate("scrollY") == scrolled
    chart = tab.locator("#map").bounding_box()
    swipe(chart["x"] + chart["width"] - 12, chart["y"] + chart["height"] / 2)
    assert tab.evaluate(STATIONS) == after
    assert tab.evaluate("scrollY") > scrolled + 40
    tab.close()


def test_keys_move_vessels(opened: Open, page: Path) -> None:
    """Tab reaches each vessel; arrows move it, with shift further; delete takes it away."""
    it = opened(page)
    keys, before = it.page.keyboard, it.ask(STATIONS)
    it.page.focus("#map")
    keys.press("Tab")
    assert it.ask("document.activeElement.getAttribute('aria-label')").startswith("ASV0, at north ")
    step = it.ask("bindusbl.chart.map.step(false)")
    keys.press("ArrowRight")
    keys.press("ArrowUp")
    keys.press("Shift+ArrowLeft")
    settled(it)
    far = it.ask("bindusbl.chart.map.step(true)")
    assert far > step
    x, y = before[0]
    assert it.ask(STATIONS)[0] == pytest.approx([x + step, y + step - far])
    agrees(it, base())
    keys.press("Tab")
    keys.press("Delete")
    settled(it)
    assert len(it.ask(STATIONS)) == len(before) - 1
    assert it.ask("document.activeElement.className") == "vessel"
    while len(it.ask(STATIONS)) > 1:
        keys.press("Delete")
    keys.press("Delete")
    assert len(it.ask(STATIONS)) == 1  # the last one stays


def test_the_chart_of_a_plan_is_one(opened: Open, tmp_path: Path) -> None:
    """North is up and east to the right, of vessels, outline and shades alike: a bay opens to the
    north, with one vessel in its north-western corner.
    """
    bay = "[[0,-60],[80,-60],[80,-40],[20,-40],[20,40],[50,40],[50,60],[0,60]]"
    asked = base(1, changes=["survey.side_m=null", f"survey.polygon_m={bay}", "asvs.count=1",
                             "asvs.formation={positions_m: [[70, -50]]}"])  # fmt: skip
    path = tmp_path / "plan.html"
    path.write_text(
        plan_page(record(), chart_of(Setup(asked), inputs_of(Setup(asked)))), encoding="utf-8"
    )
    it = opened(path)
    it.page.select_option("#team", "")
    it.page.select_option("#shade", "dwells")
    settled(it)
    width, height, red = it.ask("""(() => {
        const { width, height } = bindusbl.chart.map.shades, each = { length: width * height };
        const sheet = bindusbl.chart.map.shades.getContext("2d");
        const { data } = sheet.getImageData(0, 0, width, height);
        return [width, height, Array.from(each, (_, i) => data[4 * i + 3] ? data[4 * i] : NaN)];
    })()""")
    shades = np.array(red, dtype=float).reshape(height, width)
    assert width / height == pytest.approx(120.0 / 80.0, rel=0.05)
    row, column = np.unravel_index(np.nanargmax(shades), shades.shape)  # dark is bad
    assert (row < height / 3, column < width / 4) == (True, True)
    (x, y), *corners = it.ask(
        "[[70, -50], [0, -60], [80, -60], [0, 60]].map((it) => bindusbl.chart.map.at(...it))"
    )
    (west, south), (_, north), (east, _) = corners
    assert (north < y < south, west < x < east) == (True, True)
    told = it.ask("document.querySelector('.vessel').getAttribute('aria-label')")
    assert told == "ASV0, at north 70.0 m, east -50.0 m"


@pytest.mark.parametrize("kind", ["lanes", "dwells"])
def test_cells_at_a_slanting_or_concave_edge_are_shaded(
    opened: Open, tmp_path: Path, kind: str
) -> None:
    """Each cell of which some part is in the survey."""
    bay = [(0.0, -60.0), (80.0, -50.0), (30.0, -20.0), (15.0, 20.0), (50.0, 45.0), (10.0, 60.0)]
    corners = [list(corner) for corner in bay]
    asked = base(1, changes=["survey.side_m=null", f"survey.polygon_m={corners}", "asvs.count=1"])
    path = tmp_path / "plan.html"
    path.write_text(
        plan_page(record(), chart_of(Setup(asked), inputs_of(Setup(asked)))), encoding="utf-8"
    )
    it = opened(path)
    it.page.select_option("#shade", kind)
    settled(it)
    down, across, seen = it.ask("""(() => {
        const { shades } = bindusbl.chart.map, { width, height } = shades;
        const { data } = shades.getContext("2d").getImageData(0, 0, width, height);
        return [width, height, Array.from(data).filter((_, i) => i % 4 === 3)];
    })()""")
    south, west, north, east = it.ask("bindusbl.chart.grids.fine.box")
    hatched = {tuple(cell) for cell in it.ask("bindusbl.chart.map.unknown")}
    tall, wide = (north - south) / across, (east - west) / down
    for row, column in np.ndindex(across, down):
        x, y = south + (across - 1 - row) * tall, west + column * wide
        if Polygon(bay).intersection(box(x, y, x + tall, y + wide)).area > 0.0:
            assert seen[row * down + column] or (row, column) in hatched


def test_an_answer_that_moves_is_drawn_as_it_went(opened: Open, tmp_path: Path) -> None:
    """Its way, what missions came to, and the verdict on it: nothing is predicted, and no vessel of
    the scenario's stands in its place.  Of a team whose ways are not there the page says so.
    """
    given, chart = copy.deepcopy(record()), chart_of(Setup(base()), inputs_of(Setup(base())))
    chosen, other = given["chosen"], given["runners_up"][0]
    for number in (chosen, other):
        given["candidates"][number] |= {"stations": [], "keys": {"asvs.formation.model": "follow"}}
    given["candidates"][chosen]["verdict"] = "met"
    ways = {
        "seed": 4,
        "asvs": [{"asv": "ASV0", "places_m": [[0.0, 0.0], [30.0, 10.0], [5.0, 40.0]]}],
    }
    for own in (base(), base(changes=["asvs.formation={model: follow}"])):
        chart = chart_of(Setup(own), inputs_of(Setup(own)), (), {chosen: ways})
        path = tmp_path / "plan.html"
        path.write_text(plan_page(given, chart), encoding="utf-8")
        it = opened(path)
        told = it.page.inner_text("#worst")
        assert "Simulated in 3 missions" in told
        assert "below 1.00 m: ✓ met" in told
        assert "warning" not in (it.page.get_attribute("#worst", "class") or "")
        assert "mission of seed 4" in it.page.inner_text("#simulated")
        assert it.ask("bindusbl.chart.map.mission.asvs") == [{"x": [0, 30, 5], "y": [0, 10, 40]}]
        assert it.ask("document.querySelectorAll('.vessel').length") == 0
        assert it.painted("#map") > 30
        for hidden in ("#auvs", "#sliders", "#emitted"):
            assert not it.page.locator(hidden).is_visible()
        it.page.click(f".candidates button:has-text('candidate {other + 1}')")
        assert "those of this team are not drawn" in it.page.inner_text("#simulated")
        at_rest = next(n for n, it in enumerate(given["candidates"]) if it["stations"])
        it.ask(f"bindusbl.chart.show({at_rest})")
        assert "predicted" in it.page.inner_text("#worst")
        assert it.page.locator("#sliders").is_visible()
        assert it.ask("document.querySelectorAll('.vessel').length") > 0


def slide(it: Opened, name: str, value: float) -> None:
    """Set a slider as a hand does."""
    it.page.locator(f".slider:has-text('{name}') input").evaluate(
        "(it, value) => { it.value = value; it.dispatchEvent(new Event('input')); }", value
    )


def test_sliders_and_buttons_change_the_team(opened: Open, page: Path) -> None:
    """Number, radius, angle, ranges and navigator; each as Python predicts it."""
    it = opened(page)
    slide(it, "vessels", 3)
    slide(it, "radius", 40)
    slide(it, "angle", 30)
    agrees(it, base())
    places = np.array(it.ask(STATIONS))
    assert np.hypot(*places.T) == pytest.approx(40, abs=0.01)
    assert np.degrees(np.arctan2(places[0, 1], places[0, 0])) == pytest.approx(30, abs=0.02)
    it.page.click("#add")
    settled(it)
    assert len(it.ask(STATIONS)) == 4
    it.page.click("#remove")
    settled(it)
    assert len(it.ask(STATIONS)) == 3
    slide(it, "MF range", 120)
    it.page.select_option("#sliders select", "fixed_gain")
    slide(it, "gain", 0.5)
    changes = [
        "acoustics.mf.range_m=120",
        "navigation.filter=fixed_gain",
        "navigation.filter.gain=0.5",
    ]
    inputs = inputs_of(
        Setup(
            load_scenario(
                "quickstart",
                overrides=["auvs.count=3", "duration_s=120", "survey.side_m=140", *changes],
            )
        )
    )
    settled(it)
    shown = it.ask("Array.from(bindusbl.chart.predicted.position_error_p95_m)")
    found = predict(inputs, it.ask(STATIONS))
    assert shown == pytest.approx(found.position_error_p95_m.tolist(), rel=1e-6)


def test_what_is_on_the_chart_can_be_run(opened: Open, page: Path, tmp_path: Path) -> None:
    """The line to copy holds the places, the ranges and what the candidate sets, and is valid."""
    it = opened(page)
    drag(it, 30, -20)
    slide(it, "HF range", 66)
    settled(it)
    words = shlex.split(it.page.inner_text("#run"))
    assert words[:3] == ["bindusbl-des", "run", "quick start.yaml"]
    changes = [words[place + 1] for place, word in enumerate(words) if word == "--set"]
    scenario = load_scenario("quickstart", overrides=changes)
    assert [list(it) for it in scenario.asvs.formation.positions_m or ()] == it.ask(STATIONS)
    assert scenario.acoustics.hf.range_m == 66
    told = it.page.inner_text("#positions")
    assert re.fullmatch(r"asvs\.formation\.positions_m: \[\[.*\]\]", told)


def test_candidates_are_shown_on_the_chart(opened: Open, page: Path) -> None:
    """By a click on a dot or a row, or by arrows and Enter in the plot."""
    it = opened(page)
    candidates = record()["candidates"]

    def on_chart() -> int:
        return int(it.ask("bindusbl.chart.shown"))

    it.page.locator(f"[data-candidate='{record()['runners_up'][0]}']").click()
    assert on_chart() == record()["runners_up"][0]
    it.page.locator("#pareto [tabindex='0']").focus()
    it.page.keyboard.press("ArrowRight")
    it.page.keyboard.press("Enter")
    other = on_chart()
    assert other != record()["runners_up"][0]
    assert candidates[other]["simulated"]
    it.page.click(f".candidates button:has-text('candidate {record()['chosen'] + 1}')")
    assert on_chart() == record()["chosen"]
    assert it.ask("document.querySelectorAll('#pareto .shown').length") == 1
    it.page.select_option("#team", "")
    assert it.ask("bindusbl.chart.shown") is None


def test_candidates_and_chart_are_saved(opened: Open, page: Path) -> None:
    """As SVG with the looks of the page: a mark for each candidate, shades and vessels."""
    it = opened(page)
    settled(it)
    svg = "{http://www.w3.org/2000/svg}"

    def saved(name: str) -> ElementTree.Element:
        with it.page.expect_download() as download:
            it.page.click(f"[aria-label='Save {name} as SVG']")
        return ElementTree.parse(download.value.path()).getroot()

    marks = [mark for mark in saved("candidates").iter() if mark.get("class") == "mark"]
    assert len(marks) == it.ask("bindusbl.plots.pareto")
    assert all((mark.get("fill") or "").startswith("rgb(") for mark in marks)
    chart = saved("chart")
    assert len(chart.findall(f".//{svg}image")) == 1  # the shades
    told = {text.text for text in chart.iter(f"{svg}text")}
    assert {"ASV0", "AUV0", "AUV2"} <= told


def test_a_plan_without_javascript_has_no_empty_frames(browser: Any, page: Path) -> None:
    """Scripts are off: the answer and the tables of candidates, no chart and no room for a plot."""
    context = browser.new_context(java_script_enabled=False)
    tab = context.new_page()
    tab.goto(page.as_uri())
    for shown in ("noscript p", "#answer .verdict", ".candidates table", "#sensitivity table"):
        assert tab.locator(shown).first.is_visible()
    for hidden in ("#chart", "#pareto", "#theme", ".controls"):
        assert not tab.locator(hidden).first.is_visible()
    context.close()


def test_a_plan_prints_light_and_whole(opened: Open, page: Path) -> None:
    """On paper the page is light, not wider than A4, and holds all tables."""
    it = opened(page, "dark")
    it.page.emulate_media(media="print")
    it.until("document.documentElement.classList.contains('paper')")
    assert it.ask("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert it.ask("document.querySelector('main').scrollWidth") <= 690
    it.page.emulate_media(media="screen")
    it.until("!document.documentElement.classList.contains('paper')")


def test_a_drag_is_smooth_enough(opened: Open, tmp_path: Path) -> None:
    """With 10 AUVs predicting and painting take less than a frame of 30 a second, at the median."""
    scenario = base(auvs=10)
    path = tmp_path / "plan.html"
    path.write_text(
        plan_page(record(), chart_of(Setup(scenario), inputs_of(Setup(scenario)))), encoding="utf-8"
    )
    it = opened(path)
    it.ask("bindusbl.chart.frames.length = 0")
    for _ in range(6):
        drag(it, 20, 10)
    frames = it.ask("bindusbl.chart.frames")
    assert len(frames) > 10
    assert float(np.median(frames)) < 33.0


@pytest.mark.parametrize("kind", ["empty", "null", "attacked", "still"])
def test_any_record_opens(opened: Open, tmp_path: Path, kind: str) -> None:
    """An empty one, one without an answer, one full of scripts, and one without inputs."""
    records: dict[str, dict[str, Any]] = {
        "empty": {},
        "null": {**record(), "answer": None, "chosen": None},
        "attacked": attacked(record()),
        "still": record(),
    }
    chart = None if kind == "still" else chart_of(Setup(base()), inputs_of(Setup(base())))
    path = tmp_path / "plan.html"
    path.write_text(plan_page(records[kind], chart), encoding="utf-8")
    it = opened(path)
    assert it.ask("bindusbl.ready") is True
    assert it.ask("window.owned") is None
    assert bool(it.ask("bindusbl.chart")) == (kind != "still")
    if kind == "attacked":
        assert "window.owned = 1" in it.ask("document.body.innerText")


def test_a_candidate_brings_its_own_ways(opened: Open, tmp_path: Path) -> None:
    """One in which AUVs go faster is predicted, and drawn, as they go then."""
    faster = base(changes=["auvs.speed_m_per_s=1.2"])
    number = record()["runners_up"][0]
    inputs = [inputs_of(Setup(base()))] * len(record()["candidates"])
    inputs[number] = inputs_of(Setup(faster))
    path = tmp_path / "plan.html"
    path.write_text(
        plan_page(record(), chart_of(Setup(base()), inputs[0], inputs)), encoding="utf-8"
    )
    it = opened(path)
    before = it.ask("bindusbl.chart.map.mission.auvs[0].x.at(-1)")
    it.page.locator(f"[data-candidate='{number}']").click()
    after = it.ask("bindusbl.chart.map.mission.auvs[0].x.at(-1)")
    assert after == pytest.approx(inputs[number].ways.places_m[0, -1, 0])
    assert after != before
    agrees(it, faster)
