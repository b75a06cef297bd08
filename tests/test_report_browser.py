"""Reports in a real browser: they open, play and draw, and ask the network for nothing."""

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from test_report_sweep import BASE, EXPERIMENT

from bindusbl_des import load_scenario, simulate, sweep
from bindusbl_des.report.comparison import comparison_page
from bindusbl_des.report.run_page import run_page
from bindusbl_des.sweep_report import sweep_page

SCENARIOS = Path(__file__).parents[1] / "scenarios"
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
BROWSER = next(filter(None, map(shutil.which, BROWSERS)), None)

pytestmark = pytest.mark.skipif(
    BROWSER is None, reason=f"no browser is installed (looked for {', '.join(BROWSERS)})"
)


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """A headless Chromium."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        yield chromium
        chromium.close()


class Opened:
    """A page in the browser, with what it complained of and asked for."""

    def __init__(self, browser: Any, path: Path, scheme: str, width: int) -> None:
        self.page = browser.new_page(
            viewport={"width": width, "height": 900}, color_scheme=scheme, reduced_motion="reduce"
        )
        self.complaints: list[str] = []
        self.requests: list[str] = []
        self.page.on("console", lambda message: self.complaints.append(message.text))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.goto(path.as_uri())
        self.ask("bindusbl.opened")

    def ask(self, expression: str) -> Any:
        """Return the value of an expression in the page."""
        return self.page.evaluate(expression)

    def painted(self, canvas: str) -> int:
        """Return how many different colours a canvas shows."""
        return int(
            self.ask(
                f"""(() => {{
                    const it = document.querySelector({canvas!r});
                    const data = it.getContext("2d").getImageData(0, 0, it.width, it.height).data;
                    return new Set(new Uint32Array(data.buffer)).size; }})()"""
            )
        )


Open = Callable[..., Opened]


def slide(it: Opened, time: float) -> None:
    """Move the slider as a hand does."""
    slider = "byId('slider')"
    it.ask(f"{slider}.value = {time}; {slider}.dispatchEvent(new Event('input'))")


@pytest.fixture
def opened(browser: Any) -> Iterator[Open]:
    """Open pages; after the test, none of them may have complained or asked for another file."""
    pages: list[tuple[Opened, Path]] = []

    def open_page(path: Path, scheme: str = "light", width: int = 1280) -> Opened:
        pages.append((Opened(browser, path, scheme, width), path))
        return pages[-1][0]

    yield open_page
    for it, path in pages:
        assert it.complaints == []
        assert it.requests == [path.as_uri()]
        it.page.close()


@pytest.fixture(scope="module")
def recovery(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of the paper's recovery mission."""
    path = tmp_path_factory.mktemp("report") / "recovery.html"
    result = simulate(load_scenario(SCENARIOS / "recovery_140m.yaml"), seed=0)
    path.write_text(run_page(result), encoding="utf-8")
    return path


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 400])
def test_a_run_opens(opened: Open, recovery: Path, scheme: str, width: int) -> None:
    """Every plot has data, every canvas is painted, and nothing is wider than the window."""
    it = opened(recovery, scheme, width)
    plots = it.ask("bindusbl.plots")
    named = {"error AUV0", "error AUV1", "error AUV2", "fixes", "fates", "latency", "interval"}
    assert named | {"timeline"} == set(plots)
    assert min(plots.values()) > 10
    for canvas in ("#map", "#closeup", "#timeline", "#gaps", "#fixes-plot canvas"):
        assert it.painted(canvas) > 3, canvas
    assert it.ask("document.documentElement.scrollWidth") <= width
    background = it.ask("getComputedStyle(document.body).backgroundColor")
    assert (background == "rgb(255, 255, 255)") == (scheme == "light")


def test_the_slider_moves_the_vehicles(opened: Open, recovery: Path) -> None:
    """Vehicles are where the tables have them at the time of the slider, and the map changes."""
    it = opened(recovery)
    before, picture = it.ask("bindusbl.vehicles()"), it.ask("byId('map').toDataURL()")
    slide(it, 150)
    after = it.ask("bindusbl.vehicles()")
    assert it.ask("byId('clock').textContent") == "150.0 s"
    assert it.ask("byId('map').toDataURL()") != picture
    tracks = simulate(load_scenario(SCENARIOS / "recovery_140m.yaml"), seed=0).tables["tracks"]
    now = tracks[tracks.time_s == 150.0].set_index("vehicle")
    for old, new in zip(before, after, strict=True):
        assert (old["x"], old["y"]) != (new["x"], new["y"])
        row = now.loc[new["name"]]
        assert (new["x"], new["y"]) == pytest.approx((row.x_m, row.y_m), abs=0.011)
        estimate = (row.estimate_x_m, row.estimate_y_m)
        assert (new["estimateX"], new["estimateY"]) == pytest.approx(estimate, abs=0.021)


def test_the_keyboard_plays(opened: Open, recovery: Path) -> None:
    """Space plays and pauses, arrows step, home and end leap, f and l find fixes and losses."""
    it = opened(recovery)
    keys = it.page.keyboard
    it.page.focus("#slider")
    keys.press("End")
    assert it.ask("bindusbl.playback.now") == 300
    keys.press("Home")
    assert it.ask("bindusbl.playback.now") == 0
    keys.press("ArrowRight")
    assert it.ask("bindusbl.playback.now") > 0
    keys.press("Home")
    keys.press("f")
    first = it.ask("bindusbl.playback.now")
    landed = it.ask("Math.min(...bindusbl.mission.landed.map((times) => times[0]))")
    assert first == pytest.approx(landed, abs=1e-3)
    assert max(auv["fixes"] for auv in it.ask("bindusbl.vehicles()")) == 1
    keys.press("l")
    assert it.ask("bindusbl.playback.now") > first
    keys.press(" ")
    it.ask("new Promise((seen) => bindusbl.playback.onChange((now) => now > 20 && seen()))")
    assert it.ask("byId('play').getAttribute('aria-label')") == "Pause"
    keys.press(" ")
    assert it.ask("bindusbl.playback.playing") is False


def test_a_fix_makes_the_estimate_jump(opened: Open, recovery: Path) -> None:
    """Just before a delivery the estimate drifts on; just after, it has moved."""
    it = opened(recovery)
    gap = it.ask(
        """(() => { const m = bindusbl.mission, t = m.landed[0][60];
        const before = m.auvAt(0, t - 1e-3), after = m.auvAt(0, t + 1e-3);
        return [Math.hypot(after.estimateX - before.estimateX, after.estimateY - before.estimateY),
                m.fixes.innovation[m.delivered[0][60]]]; })()"""
    )
    assert gap[0] == pytest.approx(0.9 * gap[1], abs=0.1)


def test_theme_and_layers_can_be_switched(opened: Open, recovery: Path) -> None:
    """The button turns light to dark, plots included; unticking a layer takes it off the map."""
    it = opened(recovery)
    it.page.click("#theme")
    assert it.ask("getComputedStyle(document.body).backgroundColor") == "rgb(15, 22, 29)"
    picture = it.ask("byId('map').toDataURL()")
    it.page.click("#marks input")
    assert it.ask("byId('map').toDataURL()") != picture
    assert min(it.ask("bindusbl.plots").values()) > 10


def test_the_story_leads_to_the_playback(opened: Open, recovery: Path) -> None:
    """A gap named in the text is a link that takes the playback there."""
    it = opened(recovery)
    it.page.click("[data-seek]")
    told = float(it.page.get_attribute("[data-seek]", "data-seek"))
    assert it.ask("bindusbl.playback.now") == pytest.approx(told)


@pytest.mark.parametrize(("scheme", "width"), [("light", 1280), ("dark", 400)])
def test_runs_open_beside_each_other(opened: Open, tmp_path: Path, scheme: str, width: int) -> None:
    """One slider moves the maps of all runs; their errors share a plot."""
    runs = []
    for name in ("failure_140m", "recovery_140m"):
        scenario = load_scenario(SCENARIOS / f"{name}.yaml", overrides=["duration_s=60"])
        runs.append((name, simulate(scenario, seed=0)))
    (tmp_path / "both.html").write_text(comparison_page(runs), encoding="utf-8")
    it = opened(tmp_path / "both.html", scheme, width)
    before = it.ask("[...document.querySelectorAll('.map')].map((map) => map.toDataURL())")
    slide(it, 30)
    after = it.ask("[...document.querySelectorAll('.map')].map((map) => map.toDataURL())")
    assert len(set(before + after)) == 4
    assert min(it.ask("bindusbl.plots").values()) > 10
    it.page.select_option("#whose", "0")
    assert it.ask("bindusbl.plots.errors") == 240
    assert it.ask("document.documentElement.scrollWidth") <= width


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of a campaign."""
    folder = tmp_path_factory.mktemp("sweep")
    (folder / "base.yaml").write_text(BASE)
    (folder / "experiment.yaml").write_text(EXPERIMENT)
    campaign = sweep(folder / "experiment.yaml", folder / "out", workers=1)
    (folder / "sweep.html").write_text(sweep_page(campaign), encoding="utf-8")
    return folder / "sweep.html"


@pytest.mark.parametrize(("scheme", "width"), [("light", 1280), ("dark", 400)])
def test_a_sweep_opens(opened: Open, swept: Path, scheme: str, width: int) -> None:
    """Curves, heatmap and lookup table have data, for any key and metric."""
    it = opened(swept, scheme, width)
    assert it.ask("bindusbl.plots") == {"curves": 6, "heatmap": 6, "lookup": 4}
    first = it.ask("byId('curves').querySelector('canvas').toDataURL()")
    it.page.select_option("#along", label="acoustics.hf.range_m")
    it.page.select_option("#metric", "fixes_delivered")
    assert it.ask("byId('curves').querySelector('canvas').toDataURL()") != first
    assert it.ask("bindusbl.plots.heatmap") == 6
    it.page.select_option("#by", "-1")
    assert it.ask("bindusbl.plots.curves") == 2
    assert it.ask("document.documentElement.scrollWidth") <= width


def test_the_lookup_table_follows_its_threshold(opened: Open, swept: Path) -> None:
    """The fewest ASVs are those whose interval ends below the threshold."""
    it = opened(swept)
    it.page.fill("#threshold", "100")
    answers = it.ask("bindusbl.lookup.answers.map((it) => it.fewest)")
    assert sorted(answers) == ["1", "1", "none of these", "none of these"]
    it.page.fill("#threshold", "0")
    assert set(it.ask("bindusbl.lookup.answers.map((it) => it.fewest)")) == {"none of these"}
    cell = it.ask("bindusbl.sweep.at('position_error_m', 0)")  # one ASV, the first combination
    assert cell["half"] > 0
    for share, fewest in ((0.5, False), (1.01, True)):  # the mean alone is not sure enough
        it.page.fill("#threshold", str(cell["mean"] + share * cell["half"]))
        assert (it.ask("bindusbl.lookup.answers[0].fewest") == "1") is fewest
