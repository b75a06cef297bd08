"""The page of the workbench in a real browser, by mouse, by keyboard, at random."""

import random
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from browser_for_tests import browser, without_browser
from workbench_for_tests import SURVEY, Server, started

from bindusbl_des import load_scenario

__all__ = ["browser"]

pytestmark = without_browser

Open = Callable[..., Any]


# The vessels lie far from the survey.
FAR = SURVEY.replace("[[-30, 0], [30, 0]]", "[[200, -150], [230, -150]]")


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("desk") / "cove.yaml"
    file.write_text(FAR)
    return file


@pytest.fixture(scope="module")
def server(survey: Path) -> Iterator[Server]:
    with started(survey) as found:
        yield found


@pytest.fixture
def opened(browser: Any, server: Server, survey: Path) -> Iterator[Open]:
    """Open the page; afterwards none may have complained, or asked for anything elsewhere."""
    if survey.read_text() != FAR:
        survey.write_text(FAR)
    pages, complaints, asked = [], list[str](), list[str]()

    def open_page(width: int = 1366, scheme: str = "light") -> Any:
        page = browser.new_page(viewport={"width": width, "height": 860}, color_scheme=scheme)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("console", lambda message: complaints.append(message.text))
        page.on("request", lambda request: asked.append(request.url))
        page.set_default_timeout(400_000)
        page.goto(server.address)
        settled(page, survey, lambda it: it.asvs.count == 2)
        pages.append(page)
        return page

    yield open_page
    assert complaints == []
    for page in pages:
        page.close()
    own = (server.address, server.address.replace("http", "ws"), "data:", "about:")
    assert [url for url in asked if not url.startswith(own)] == []


def worst(page: Any) -> float:
    """Return the predicted error of the worst AUV (m) that the page tells."""
    return float(page.inner_text("#auvs tbody tr:last-child td"))


def until(page: Any, holds: Callable[[], bool]) -> None:
    """Wait until something holds."""
    for _ in range(8000):  # once equations are compiled
        if holds():
            return
        page.wait_for_timeout(50)
    raise AssertionError(page.inner_text("#worst"))


def settled(page: Any, survey: Path, holds: Callable[[Any], bool]) -> None:
    """Wait until the file has what was done, and the page what is predicted of it."""
    for _ in range(8000):  # once equations are compiled
        text = page.input_value("#yaml")
        if text == survey.read_text() and holds(load_scenario(survey)):
            page.wait_for_selector("#worst:not(.stale)")
            page.wait_for_selector("#auvs tbody tr", state="attached")
            return
        page.wait_for_timeout(50)
    raise AssertionError(text)


def test_a_survey_is_drawn_moved_and_flown(opened: Open, survey: Path) -> None:
    """Draw it, drag a vessel to it, see the error fall, simulate, and find all of it again."""
    page = opened()
    page.click("#draw-area")
    box = page.locator("#map").bounding_box()

    def at(x: float, y: float) -> tuple[float, float]:
        return box["x"] + box["width"] * x, box["y"] + box["height"] * y

    corners = ((0.45, 0.5), (0.8, 0.5), (0.8, 0.9), (0.45, 0.9), (0.45, 0.5))
    for place in corners:
        page.mouse.click(*at(*place))
        page.wait_for_timeout(60)
    settled(page, survey, lambda it: it.survey.polygon_m and len(it.survey.polygon_m) == 4)
    before = worst(page)
    vessel = page.locator(".vessel").first.bounding_box()
    page.mouse.move(vessel["x"] + 14, vessel["y"] + 14)
    page.mouse.down()
    for step in range(1, 11):
        share = step / 10
        x, y = at(0.6, 0.7)
        page.mouse.move(vessel["x"] + 14 + share * (x - vessel["x"] - 14),
                        vessel["y"] + 14 + share * (y - vessel["y"] - 14))  # fmt: skip
        page.wait_for_timeout(30)
    until(page, lambda: worst(page) < 0.7 * before)  # while it is dragged
    page.mouse.up()
    settled(page, survey, lambda it: it.asvs.formation.positions_m[0] != (200, -150))
    assert worst(page) < 0.7 * before
    page.click("[data-tab=simulate]")
    page.fill("#seeds", "4")
    page.click("#simulate button")
    page.wait_for_selector("[data-job='1'][data-status=complete]")
    page.reload()
    page.wait_for_selector("#auvs tbody tr")
    assert page.input_value("#yaml") == survey.read_text()
    page.click("[data-tab=simulate]")
    page.click("text=▶ worst seed")  # on the chart, at once
    until(page, lambda: float(page.inner_text("#clock").partition(" ")[0]) > 5.0)
    page.locator("#play").press("Space")
    page.locator("#play[aria-label=Play]").wait_for()
    now = page.inner_text("#clock")
    page.click("#next-fix")
    assert page.inner_text("#clock") != now
    assert "gets a fix" in page.inner_text("#log li:first-child")
    assert not page.is_visible(".vessel >> nth=0")
    page.click("#play-page")  # its own page, with the inspector
    page.frame_locator("#page").locator("#play[aria-label=Play]").wait_for()
    page.click("#frame-back")
    page.click("#play-end")
    assert page.is_visible(".vessel >> nth=0")
    page.click("#undo")
    settled(page, survey, lambda it: it.asvs.formation.positions_m[0] == (200, -150))


def test_a_setting_is_tried_while_its_slider_moves(opened: Open, survey: Path) -> None:
    """What a longer range means is predicted before it is kept; so does the goal say."""
    page = opened()
    page.click("[data-tab=keys]")
    slider = page.locator("input[aria-label^='acoustics.hf.range_m']")
    before, radius = (
        page.inner_text("#worst"),
        page.locator("#map path.hf").first.bounding_box()["width"],
    )
    page.evaluate(
        """() => { const it = document.querySelector("input[aria-label^='acoustics.hf.range_m']");
                   it.value = 198; it.dispatchEvent(new Event("input", {bubbles: true})); }"""
    )
    until(page, lambda: page.inner_text("#worst") != before)  # some pings are heard now
    assert "a fix with 0 %" in before
    assert "a fix with 0 %" not in page.inner_text("#worst")
    assert survey.read_text() == FAR
    assert page.locator("#map path.hf").first.bounding_box()["width"] > 1.5 * radius
    slider.fill("200")  # and lets it go
    settled(page, survey, lambda it: it.acoustics.hf.range_m == 200)
    assert "a fix with 0 %" not in page.inner_text("#worst")
    page.click("[data-tab=plan]")
    page.fill("#below", "90")
    page.press("#below", "Tab")
    until(page, lambda: "below 90.0 m" in page.inner_text("#predicted"))
    assert page.inner_text("#predicted").endswith(" met")


def test_land_is_drawn_and_erased(opened: Open, survey: Path) -> None:
    """A click for each corner; what is erased is there again when that is undone."""
    page = opened()
    box = page.locator("#map").bounding_box()
    page.click("#draw-land")
    for x, y in ((0.3, 0.3), (0.4, 0.3), (0.4, 0.4), (0.3, 0.3)):
        page.mouse.click(box["x"] + box["width"] * x, box["y"] + box["height"] * y)
        page.wait_for_timeout(60)
    settled(page, survey, lambda drawn: drawn.survey.land and len(drawn.survey.land[0]) == 3)
    assert page.locator("#map .land").count() == 1
    page.click("#erase")
    page.locator("#map .land").click(force=True, position={"x": 70, "y": 15})
    settled(page, survey, lambda drawn: drawn.survey.land is None)
    assert page.locator("#map .land").count() == 0
    page.click("#undo")
    settled(page, survey, lambda drawn: drawn.survey.land)
    page.click("[data-tab=vehicles]")
    page.click("[aria-label='Remove land 1']")
    settled(page, survey, lambda drawn: drawn.survey.land is None)


@pytest.mark.parametrize(("width", "scheme"), [(1366, "dark"), (390, "light")])
def test_the_keyboard_is_enough(opened: Open, survey: Path, width: int, scheme: str) -> None:
    """On any window: vessels are reached with tab and moved by keys; nothing is cut off."""
    page = opened(width, scheme)
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    page.locator("#map").focus()
    for _ in range(60):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.classList.contains('vessel')"):
            break
    name = page.evaluate("document.activeElement.getAttribute('aria-label')")
    assert name.startswith("ASV")
    number = int(name[3])
    before = load_scenario(survey).asvs.formation.positions_m[number]
    page.keyboard.press("Shift+ArrowDown")
    page.keyboard.press("ArrowRight")

    def moved(it: Any) -> bool:
        (x, y), (x_before, y_before) = it.asvs.formation.positions_m[number], before
        return bool(x < x_before and y > y_before)

    settled(page, survey, moved)
    page.locator("[role=tab]").first.focus()
    page.keyboard.press("ArrowRight")
    assert page.evaluate("document.activeElement.dataset.tab") == "vehicles"
    page.click(f"text=remove >> nth={number}")
    settled(page, survey, lambda it: it.asvs.count == 1)


# Drops a file of some text on the page.
DROP = """([name, text]) => { const data = new DataTransfer();
    data.items.add(new File([text], name));
    const how = {dataTransfer: data, bubbles: true, cancelable: true};
    dispatchEvent(new DragEvent("drop", how)); }"""
# How many dropped files the server has taken, or refused.
KEPT = """performance.getEntriesByType("resource")
    .filter(({ name }) => name.includes("/drop?")).length"""
# What the page says; it asks for what is answered after all that it asked before.
ASKED = """(bindusbl.bench.ask("nothing"), document.querySelector("#said").textContent)"""
DROPPED = {
    "a.kml": "<kml/>",
    "b.geojson": "{}",
    "c.gpx": "no XML",
    "d.csv": "time_s\n1",
    "e.mcap": "",
    "odometry.csv": "time_s,x_m\n0,0",
    "<img src=x onerror=alert(1)>.kml": "<kml></kml>",
    "f.yaml": "name: f\nduration_s: 20",
}


@pytest.mark.parametrize("acts", [100, pytest.param(1000, marks=pytest.mark.slow)])
def test_nothing_breaks_at_random(opened: Open, survey: Path, acts: int) -> None:
    """Clicks, drags, keys and drops leave no script error, and a scenario that is one."""
    page, draw = opened(), random.Random(acts)
    for number in range(acts):
        if number % 20 == 0:
            tab = draw.choice(["vehicles", "keys", "simulate", "plan"])
            page.evaluate(f"bindusbl.bench.tab('{tab}')")
            name = draw.choice(sorted(DROPPED))
            page.evaluate(DROP, [name, DROPPED[name]])
        x, y = draw.uniform(5, 1360), draw.uniform(60, 850)
        act = draw.random()
        if act < 0.6:
            page.mouse.click(x, y)
        elif act < 0.8:
            page.mouse.move(x, y)
            page.mouse.down()
            page.mouse.move(x + draw.uniform(-200, 200), y + draw.uniform(-200, 200), steps=3)
            page.mouse.up()
        else:
            page.keyboard.press(draw.choice(["Tab", "Escape", "ArrowUp", "Delete", "Control+z"]))
    until(page, lambda: page.evaluate(KEPT) == acts // 20)
    page.wait_for_timeout(500)
    until(page, lambda: "nothing to do" in page.evaluate(ASKED))
    survey.write_text(FAR)
    page.reload()
    settled(page, survey, lambda it: it.name == "cove")
    for job in page.evaluate("bindusbl.bench.jobs.filter((job) => job.status === 'running')"):
        page.evaluate(f"bindusbl.bench.ask('stop', {{job: {job['number']}}})")


@pytest.mark.slow
def test_reloads_and_windows_cost_no_memory(browser: Any, opened: Open, server: Server) -> None:
    """After 50 reloads, and as many windows, the server is as large as after some."""
    page, sizes = opened(), []
    for number in range(50):
        page.reload()
        page.wait_for_selector("#auvs tbody tr", state="attached")
        other = browser.new_page()
        other.goto(server.address)
        other.wait_for_selector("#auvs tbody tr", state="attached")
        other.close()
        if number % 10 == 9:
            status = Path(f"/proc/{server.process.pid}/status").read_text()
            sizes.append(int(status.partition("VmRSS:")[2].split()[0]))
    assert sizes[-1] < 1.05 * sizes[0], sizes
