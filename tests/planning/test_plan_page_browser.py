"""The page of a plan in a real browser: teams on the chart, candidates, pictures, paper."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from browser_for_tests import Open, Opened, without_browser
from plans_for_tests import attacked, base, chart_of, drawn, moored, plan_page, record

from bindusbl_des import Setup

pytestmark = without_browser

MAP = "bindusbl.chart.map"


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of a small plan."""
    path = tmp_path_factory.mktemp("plan") / "plan.html"
    path.write_text(plan_page(record(), drawn()), encoding="utf-8")
    return path


def shade_at(it: Opened, place: Sequence[float]) -> list[float]:
    """Return the colour of the map at a place (m)."""
    red: list[float] = it.ask(f"""(() => {{
        const map = bindusbl.chart.map, [x, y] = map.at(...{list(place)});
        const ratio = map.paths.width / map.width, copy = make("canvas", {{ width: 1, height: 1 }});
        const sheet = copy.getContext("2d", {{ willReadFrequently: true }});
        sheet.drawImage(map.paths, -Math.round(x * ratio), -Math.round(y * ratio));
        return Array.from(sheet.getImageData(0, 0, 1, 1).data);
    }})()""")
    return red


def cell(chart: dict[str, Any], which: Any) -> list[float]:
    """Return the middle (m) of the cell of the first team's shade that is worst, or best."""
    shade = next(iter(chart["forecasts"].values()))["shade"]
    values = np.array([np.nan if it is None else it for it in shade["values"]])
    south, west, north, east = shade["box"]
    column, row = divmod(int(which(values)), shade["across"])
    columns = len(values) // shade["across"]
    return [
        south + (row + 0.5) * (north - south) / shade["across"],
        west + (column + 0.5) * (east - west) / columns,
    ]


@pytest.mark.parametrize(("scheme", "width"), [("light", 1280), ("dark", 390)])
def test_a_plan_opens(opened: Open, page: Path, scheme: str, width: int) -> None:
    """The answer is on the chart, all is painted, and nothing is wider than the window."""
    it = opened(page, scheme, width)
    assert it.painted("#map") > 30
    assert it.ask("bindusbl.plots.pareto") == len(record()["candidates"])
    assert len(it.page.query_selector_all(".dot.simulated")) == 6 + 3  # and the key
    assert it.ask("document.documentElement.scrollWidth") <= width
    answer = record()["candidates"][record()["chosen"]]
    stations = it.ask(f"{MAP}.mission.asvs.map(({{ x, y }}) => [x[0], y[0]])")
    assert stations == pytest.approx(np.array(answer["stations"]), abs=0.005)
    (told,) = [one for one in it.page.query_selector_all(".drawn") if one.is_visible()]
    assert "in 3 missions" in told.inner_text()
    assert told.get_attribute("data-team") == str(record()["chosen"])


def test_the_chart_of_a_plan_is_one(opened: Open, tmp_path: Path) -> None:
    """North is up and east to the right, of vessels, outline and shades alike: a bay opens to the
    north, with one vessel in its north-western corner.
    """
    bay = "[[0,-60],[80,-60],[80,-40],[20,-40],[20,40],[50,40],[50,60],[0,60]]"
    asked = base(1, changes=["survey.side_m=null", f"survey.polygon_m={bay}",
                             "acoustics.hf.range_m=30"])  # fmt: skip
    path = tmp_path / "plan.html"
    chart = drawn(moored([[70, -50]], asked))
    path.write_text(plan_page(record(), chart), encoding="utf-8")
    it = opened(path)
    (x, y), *corners = it.ask(
        f"[[70, -50], [0, -60], [80, -60], [0, 60]].map((place) => {MAP}.at(...place))"
    )
    (west, south), (_, north), (east, _) = corners
    assert (north < y < south, west < x < east) == (True, True)
    worst, best = (cell(chart, which) for which in (np.nanargmax, np.nanargmin))
    assert sum(shade_at(it, worst)[:3]) < sum(shade_at(it, best)[:3]) - 60  # dark is bad
    assert shade_at(it, [61, 3]) == shade_at(it, [69, 31])  # beyond the survey: the sea


def test_cells_at_a_slanting_or_concave_edge_are_shaded(opened: Open, tmp_path: Path) -> None:
    """Each cell of which some part is in the survey, and nothing beyond."""
    bay = [[0, -60], [80, -50], [30, -20], [15, 20], [50, 45], [10, 60]]
    asked = base(1, changes=["survey.side_m=null", f"survey.polygon_m={bay}"])
    path = tmp_path / "plan.html"
    path.write_text(plan_page(record(), drawn(asked)), encoding="utf-8")
    it = opened(path)
    sea = shade_at(it, [61, 31])
    for inside in ([1.5, -58.5], [78, -50.2], [15.5, 19], [47, 45.5], [11, 59]):
        assert shade_at(it, inside) != sea, inside
    assert shade_at(it, [44, 3]) == sea


def test_an_answer_that_moves_is_drawn_as_it_went(opened: Open, tmp_path: Path) -> None:
    """Its way in a mission, and what missions came to: nothing is predicted."""
    chosen, other = record()["chosen"], record()["runners_up"][0]
    ways = {
        "seed": 4,
        "asvs": [{"asv": "ASV0", "places_m": [[0.0, 0.0], [30.0, 10.0], [5.0, 40.0]]}],
    }
    moving = Setup(base(changes=["asvs.formation={model: follow}"]))
    rest = Setup(moored(record()["candidates"][other]["stations"]))
    path = tmp_path / "plan.html"
    chart = chart_of({chosen: moving, other: rest}, {chosen: ways})
    path.write_text(plan_page(record(), chart), encoding="utf-8")
    it = opened(path)
    told = f".drawn[data-team='{chosen}']"
    assert "in 3 missions" in it.page.inner_text(told)
    assert "mission of seed 4" in it.page.inner_text(told)
    assert it.ask(f"{MAP}.mission.asvs[0].x") == [0, 30, 5]
    assert it.page.inner_text("#field-scale") == ""
    assert it.painted("#map") > 30
    it.page.click(f".candidates button:has-text('candidate {other + 1}')")
    assert not it.page.is_visible(told)
    assert it.page.is_visible(f".drawn[data-team='{other}'] table")
    assert "Shades" in it.page.inner_text("#field-scale")


def test_candidates_are_shown_on_the_chart(opened: Open, page: Path) -> None:
    """By a click on a dot or a row, by arrows and Enter in the plot, or by name."""
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
    it.page.select_option("#team", str(other))
    assert on_chart() == other
    unflown = next(n for n, one in enumerate(candidates) if not one["simulated"])
    it.ask(f"bindusbl.pareto.choose({unflown})")  # which is not drawn
    assert on_chart() == other


def test_candidates_and_chart_are_saved(opened: Open, page: Path) -> None:
    """As SVG with the looks of the page: a mark for each candidate, shades and vessels."""
    it = opened(page)
    svg = "{http://www.w3.org/2000/svg}"

    def saved(name: str) -> ElementTree.Element:
        with it.page.expect_download() as download:
            it.page.click(f"[aria-label='Save {name} as SVG']")
        return ElementTree.parse(download.value.path()).getroot()

    marks = [mark for mark in saved("candidates").iter() if mark.get("class") == "mark"]
    assert len(marks) == it.ask("bindusbl.plots.pareto")
    assert all((mark.get("fill") or "").startswith("rgb(") for mark in marks)
    chart = saved("chart")
    assert len(list(chart.iter(f"{svg}path"))) > 10
    told = {text.text for text in chart.iter(f"{svg}text")}
    assert {"ASV0", "AUV0", "AUV2"} <= told


def test_a_plan_without_javascript_has_no_empty_frames(browser: Any, page: Path) -> None:
    """Scripts are off: the answer and the tables of candidates, no chart and no room for a plot."""
    context = browser.new_context(java_script_enabled=False)
    tab = context.new_page()
    tab.goto(page.as_uri())
    for shown in (
        "noscript p",
        "#answer .verdict",
        ".drawn:not([hidden]) table",
        ".candidates table",
        "#sensitivity table",
    ):
        assert tab.locator(shown).first.is_visible()
    for hidden in ("#map", "#pareto", "#theme", ".controls"):
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


@pytest.mark.parametrize("kind", ["empty", "null", "attacked", "still"])
def test_any_record_opens(opened: Open, tmp_path: Path, kind: str) -> None:
    """An empty one, one without an answer, one full of scripts, and one without teams."""
    records: dict[str, dict[str, Any]] = {
        "empty": {},
        "null": {**record(), "answer": None, "chosen": None},
        "attacked": attacked(record()),
        "still": record(),
    }
    chart = None if kind == "still" else drawn()
    path = tmp_path / "plan.html"
    path.write_text(plan_page(records[kind], chart), encoding="utf-8")
    it = opened(path)
    assert it.ask("bindusbl.ready") is True
    assert it.ask("window.owned") is None
    assert bool(it.ask("bindusbl.chart")) == (kind not in ("empty", "still"))
    if kind == "attacked":
        assert "window.owned = 1" in it.ask("document.body.innerText")
