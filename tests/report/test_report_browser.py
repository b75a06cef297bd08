"""Reports in a real browser: they open, play and draw, and ask the network for nothing."""

import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
import shapely
from browser_for_tests import Open, Opened, without_browser
from campaigns_for_tests import UNSERVED, auv, hand_made
from pages_for_tests import beside
from test_report_sweep import BASE, EXPERIMENT

from bindusbl_des import Result, Scenario, load_scenario, simulate, sweep
from bindusbl_des.support.wording import instant, significant, timed, with_ends, with_half

SCENARIOS = Path(__file__).parents[2] / "scenarios"
pytestmark = without_browser


def slide(it: Opened, time: float) -> None:
    """Move the slider as a hand does."""
    slider = "byId('slider')"
    it.ask(f"{slider}.value = {time}; {slider}.dispatchEvent(new Event('input'))")


@pytest.fixture(scope="module")
def recovery(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of the paper's recovery mission."""
    path = tmp_path_factory.mktemp("report") / "recovery.html"
    result = simulate(load_scenario(SCENARIOS / "recovery_140m.yaml"), seed=0)
    path.write_text(result.report(), encoding="utf-8")
    return path


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 400])
def test_a_run_opens(opened: Open, recovery: Path, scheme: str, width: int) -> None:
    """Every plot has data, every canvas is painted, and nothing is wider than the window."""
    it = opened(recovery, scheme, width)
    plots = it.ask("bindusbl.plots")
    named = {"error AUV0", "error AUV1", "error AUV2", "fixes", "fates", "latency", "interval"}
    named |= {"covered"}
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
                m.fixes.correction[m.delivered[0][60]]]; })()"""
    )
    assert gap[0] == pytest.approx(gap[1], abs=0.1)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_ellipse_of_an_estimate_can_be_hidden(
    opened: Open, recovery: Path, scheme: str
) -> None:
    """It holds what the tracks say, grows while no fix comes, and is a layer of both maps."""
    it = opened(recovery, scheme)
    tracks = simulate(load_scenario(SCENARIOS / "recovery_140m.yaml"), seed=0).tables["tracks"]
    for time in (33.0, 128.0):
        row = tracks.query("vehicle == 'AUV0' and time_s == @time").iloc[0]
        spread = it.ask(f"bindusbl.mission.auvAt(0, {time}).spread")
        expected = [row.estimate_sd_x_m**2, row.estimate_sd_y_m**2, row.estimate_cov_xy_m2]
        assert spread == pytest.approx(expected, abs=0.01 * (expected[0] + expected[1]))
    slide(it, 128.0)
    shown = [it.ask(f"byId('{name}').toDataURL()") for name in ("map", "closeup")]
    it.page.click("#marks label:has-text('95 % ellipse') input")
    hidden = [it.ask(f"byId('{name}').toDataURL()") for name in ("map", "closeup")]
    assert all(a != b for a, b in zip(shown, hidden, strict=True))
    it.page.click("#marks label:has-text('95 % ellipse') input")
    assert [it.ask(f"byId('{name}').toDataURL()") for name in ("map", "closeup")] == shown


def test_keys_are_the_pages_until_the_playback_has_them(opened: Open, recovery: Path) -> None:
    """Space scrolls the page before a click on the playback and after one elsewhere."""
    it = opened(recovery)
    keys = it.page.keyboard

    def state() -> list[Any]:
        return list(it.ask("[bindusbl.playback.playing, bindusbl.playback.now]"))

    keys.press("ArrowRight")
    keys.press("f")
    assert state() == [False, 0]
    keys.press(" ")
    it.until("scrollY > 0")
    assert state() == [False, 0]
    it.page.click("#map", position={"x": 5, "y": 200})
    keys.press("f")
    first = it.ask("bindusbl.playback.now")
    assert first > 0
    keys.press("Control+ArrowRight")
    keys.press("Shift+ArrowRight")
    assert it.ask("bindusbl.playback.now") == first
    it.page.click("#errors-title")
    for key in ("ArrowRight", "f", " "):
        keys.press(key)
    assert state() == [False, first]


def test_keys_go_on_after_a_click_on_a_button(opened: Open, recovery: Path) -> None:
    """Arrows step after a click on the controls; space presses the button, opens the legend."""
    it = opened(recovery)
    keys = it.page.keyboard
    it.page.click("#next")
    first = it.ask("bindusbl.playback.now")
    keys.press("ArrowRight")
    assert it.ask("bindusbl.playback.now") == pytest.approx(2 * first)
    keys.press(" ")  # presses "step forward", and nothing more
    assert it.ask("bindusbl.playback.now") == pytest.approx(3 * first)
    it.page.focus("#legend summary")
    keys.press(" ")
    assert it.ask("[byId('legend').open, bindusbl.playback.playing]") == [False, False]
    it.page.focus("#speed")
    keys.press("ArrowRight")  # the next speed, not the next moment
    assert it.ask("bindusbl.playback.now") == pytest.approx(3 * first)
    it.page.focus("#map")
    before = it.ask("scrollY")
    keys.press("End")
    it.until(f"scrollY > {before}")
    assert it.ask("bindusbl.playback.now") == pytest.approx(3 * first)


def test_the_log_tells_only_what_has_happened(opened: Open, recovery: Path) -> None:
    """What became of a ping is told when it is decided, and a fix by how far it corrects."""
    tables = simulate(load_scenario(SCENARIOS / "recovery_140m.yaml"), seed=0).tables
    pings, fixes = tables["pings"].set_index("ping"), tables["fixes"]
    arrived = tables["receptions"].query("outcome == 'lost'").groupby("ping").arrived_at_s.max()
    airtime = tables["broadcasts"].set_index("sent_at_s").airtime_s
    known = {f"ping {ping}: lost": at + 0.010 for ping, at in arrived.items()}
    for fix in fixes[fixes.outcome == "out_of_range"].itertuples():
        at = fix.broadcast_at_s + airtime[fix.broadcast_at_s]
        known[f"ping {fix.ping}: its fix was sent beyond"] = at
    for ping, at in pings.sent_at_s[pings.in_range_of == 0].items():
        known[f"ping {ping}: out of range"] = at
    it = opened(recovery)
    told = [[time, text] for time, text, *_ in it.ask("bindusbl.log.events")]
    kinds = set()
    for time, text in told:
        words = next((words for words in known if f"{words} " in text), None)
        if words:
            assert time >= known[words] - 1e-3, text
            kinds.add(words.split(": ")[1])
    assert len(kinds) == 3
    first = fixes[fixes.outcome == "delivered"].sort_values("delivered_at_s").iloc[0]
    said = next(text for _, text in told if text.startswith(f"{first.auv} gets a fix"))
    assert said.startswith(f"{first.auv} gets a fix, {first.latency_s:.2f} s old, corrects by")
    assert float(said.split()[-2]) == pytest.approx(first.correction_m, abs=0.006)
    for time, text in told[20:30]:
        slide(it, time - 1e-3)
        assert text not in it.ask("byId('log').textContent")
        slide(it, time + 1e-3)
        assert text in it.ask("byId('log').textContent")


def test_nothing_speaks_while_time_plays_on(opened: Open, recovery: Path) -> None:
    """The one live region is silent in play and tells a pause, a leap, a vehicle to follow."""
    it = opened(recovery)
    live = "output, [aria-live], [role=status], [role=alert], [role=log]"
    assert it.ask(f"[...document.querySelectorAll('{live}')].map((it) => it.id)") == ["said"]
    it.ask(
        """(() => { window.spoken = 0; new MutationObserver((all) => { spoken += all.length; })
        .observe(byId('slider'), { attributeFilter: ['aria-valuetext'] }); })()"""
    )
    it.page.click("#play")
    it.ask("new Promise((seen) => bindusbl.playback.onChange((now) => now > 3 && seen()))")
    assert it.ask("[byId('said').textContent, spoken]") == ["", 0]
    it.page.click("#play")
    assert "Paused at" in it.ask("byId('said').textContent")
    assert it.ask("byId('slider').getAttribute('aria-valuetext')").endswith(" seconds")
    it.page.select_option("#follow", "2")
    assert it.ask("byId('said').textContent") == "Following AUV2"


def test_what_is_out_of_view_is_not_painted_while_time_plays(opened: Open, recovery: Path) -> None:
    """All is painted, and each number that of the instant, as soon as time rests."""
    it = opened(recovery)
    it.ask("byId('playback').scrollIntoView()")
    it.ask(
        """(() => { window.painted = 0; const draw = Timeline.prototype.draw;
        Timeline.prototype.draw = function (...it) { painted++; draw.apply(this, it); }; })()"""
    )
    it.page.click("#play")
    it.ask("new Promise((seen) => bindusbl.playback.onChange((now) => now > 3 && seen()))")
    assert it.ask("painted") == 0
    it.page.click("#play")
    assert it.ask("painted") == 1
    worst = "bindusbl.mission.auvAt(bindusbl.mission.order[0], bindusbl.playback.now)"
    shown = it.ask("document.querySelector('#now tbody td').textContent")
    assert shown == it.ask(f"{worst}.error.toFixed(2)")


def saved(it: Opened, name: str, kind: str = "SVG") -> bytes:
    """Press the button that saves a plot, and return the file."""
    with it.page.expect_download() as download:
        it.page.click(f"[aria-label='Save {name} as {kind}']")
    assert download.value.suggested_filename == f"{name.replace(' ', '_')}.{kind.lower()}"
    return Path(download.value.path()).read_bytes()


SVG = "{http://www.w3.org/2000/svg}"


def polylines(svg: bytes, colours: list[str]) -> list[list[tuple[float, float]]]:
    """Return lines of some colours that are cut at the edges of a plot, as those of series are."""
    found = ElementTree.fromstring(svg).findall(f".//{SVG}g[@clip-path]/{SVG}path[@fill='none']")
    lines = [it.get("d", "") for it in found if it.get("stroke") in colours]
    places = [re.findall(r"(-?[\d.]+) (-?[\d.]+)", it) for it in lines if "A" not in it]  # no dots
    return [[(float(x), float(y)) for x, y in line] for line in places]


def test_plots_are_saved_as_they_are_drawn(opened: Open, recovery: Path) -> None:
    """An SVG has a line for each series that is shown, as high as its values; a CSV has these."""
    it = opened(recovery)
    landed = it.ask("bindusbl.mission.landed.map((times) => times.length)")
    colours = it.ask("colours.series")
    lines = polylines(saved(it, "fixes"), colours[:3])
    assert len(lines) == 3
    heights = [line[0][1] - line[-1][1] for line in lines]  # each begins at no fix
    assert np.array(heights) / heights[0] == pytest.approx(np.array(landed) / landed[0], abs=0.01)
    assert saved(it, "fixes", "PNG")[:8] == b"\x89PNG\r\n\x1a\n"
    rows = saved(it, "fixes", "CSV").decode().splitlines()
    assert rows[0] == '"time","AUV0","AUV1","AUV2"'
    assert [int(number) for number in rows[-1].split(",")[1:]] == landed
    it.page.click("#fixes-plot .u-legend tr:has-text('AUV1') th")
    assert len(polylines(saved(it, "fixes"), colours[:3])) == 2
    assert len(polylines(saved(it, "error AUV0"), [colours[0]])) == 2  # with its envelope
    names = it.ask(
        "[...document.querySelectorAll('.save button[aria-label$=SVG]')].map((it) => it.ariaLabel)"
    )
    assert len(names) == 10
    it.ask("window.save = (text) => { bindusbl.saved = text; }")  # browsers ask after ten files
    for label in names:  # maps, too: well-formed, and nothing is wanting to a number
        it.ask(f"document.querySelector('[aria-label=\"{label}\"]').click()")
        text = it.ask("bindusbl.saved")
        assert len(ElementTree.fromstring(text).findall(f".//{SVG}path")) > 3, label
        assert "NaN" not in text, label
        if label == "Save map as SVG":
            assert all(name in text for name in ("AUV0<", "ASV2<", "north (m)<"))
    # What listens while a picture is saved is gone afterwards.
    own = "Object.keys(byId('map').getContext('2d')).length + (Path2D === PlainPath)"
    assert it.ask(own) == 1


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of twenty AUVs."""
    path = tmp_path_factory.mktemp("report") / "fleet.html"
    changes = ["name=fleet", "auvs.count=20", "survey.side_m=300", "duration_s=30"]
    scenario = load_scenario(SCENARIOS / "recovery_140m.yaml", overrides=changes)
    path.write_text(simulate(scenario, seed=1).report(), encoding="utf-8")
    return path


def test_the_table_of_now_shows_whom_one_follows(opened: Open, fleet: Path) -> None:
    """The row of the AUV in the close-up is marked and in sight; a click on another follows it."""
    it = opened(fleet)
    rows = "[...document.querySelectorAll('#now .followed')].map((row) => row.cells[0].innerText)"
    box = "byId('now').getBoundingClientRect()"
    row = "document.querySelector('#now .followed').getBoundingClientRect()"
    for number in (19, 0, 13):
        it.page.select_option("#follow", str(number))
        assert it.ask(rows) == [f"AUV{number}"]
        assert it.ask(f"{row}.top >= {box}.top && {row}.bottom <= {box}.bottom + 1")
    it.page.click("#now button >> nth=12")  # the worst stands first
    auv = it.ask("bindusbl.mission.order[12]")
    assert it.ask(rows) == [f"AUV{auv}"]
    assert it.ask("[bindusbl.closeup.auv, byId('follow').value]") == [auv, f"{auv}"]
    pressed = it.page.locator("#now [aria-pressed=true]")
    assert pressed.all_inner_texts() == [f"AUV{auv}"]


OVERFULL = """[...document.querySelectorAll('#auvs .scroll')]
    .filter((it) => it.scrollWidth > it.clientWidth).length"""


def test_the_table_of_auvs_fits(opened: Open, fleet: Path) -> None:
    """At every width, also of a window that is dragged, no column of any AUV is out of sight."""
    it = opened(fleet, width=320)
    for width in (320, 360, 768, 1280, 1920):
        it.page.set_viewport_size({"width": width, "height": 900})
        assert it.ask("innerWidth") == width
        assert it.ask(OVERFULL) == 0, width
        assert it.ask("document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_pages_print_light_and_whole(opened: Open, fleet: Path, scheme: str) -> None:
    """On paper a page is light, not wider than A4, its bars keep their colours; then as before."""
    light = opened(fleet, "light").ask("colours.series[0]")
    it = opened(fleet, scheme)
    it.page.emulate_media(media="print")
    it.until("onPaper()")
    assert it.ask("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert it.ask("[colours.paper, colours.series[0]]") == ["#ffffff", light]
    a4 = 186 / 25.4 * 96  # what its margins leave, in CSS pixels
    widest = "Math.max(...[...document.querySelectorAll('main *')].map((it) => it.scrollWidth))"
    assert it.ask(widest) <= a4
    assert it.ask(OVERFULL) == 0
    assert it.ask("byId('map').width / byId('map').clientWidth") == pytest.approx(3, abs=0.01)
    adjust = "getComputedStyle(document.querySelector('.bar span')).printColorAdjust"
    assert it.ask(adjust) == "exact"
    for hidden in (".strip", "#play", "#theme", "#marks input"):
        assert not it.page.locator(hidden).first.is_visible()
    for shown in ("#map", "#closeup", "#now table", "#clock", "#fates-plot"):
        assert it.page.is_visible(shown)
    it.page.emulate_media(media="screen")
    it.until("!onPaper()")
    assert it.ask("document.documentElement.dataset.theme") == scheme
    assert it.page.is_visible("#play")


def test_a_phone_scrolls_past_the_map(browser: Any, recovery: Path) -> None:
    """One finger on the map scrolls the page; two zoom the map and leave the page where it is."""
    page = browser.new_page(viewport={"width": 400, "height": 800}, has_touch=True, is_mobile=True)
    page.goto(recovery.as_uri())
    page.evaluate("bindusbl.opened")
    page.evaluate("byId('map').scrollIntoView({ block: 'center' })")
    box, touch = page.locator("#map").bounding_box(), page.context.new_cdp_session(page)
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    before, view = page.evaluate("scrollY"), page.evaluate("bindusbl.map.view")

    def drag(paths: list[list[tuple[float, float]]]) -> None:
        for step, places in enumerate(zip(*paths, strict=True)):
            fingers = [{"x": x, "y": y, "id": finger} for finger, (x, y) in enumerate(places)]
            kind = "touchMove" if step else "touchStart"
            touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": fingers})
            page.wait_for_timeout(16)
        touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        come_to_rest()

    def come_to_rest() -> None:
        before = -1
        while (now := page.evaluate("scrollY")) != before:  # a page that was flung goes on
            before = now
            page.wait_for_timeout(300)

    drag([[(x, y - 15 * step) for step in range(10)]])
    assert page.evaluate("scrollY") > before + 50
    assert page.evaluate("bindusbl.map.view") == view
    page.evaluate("byId('map').scrollIntoView({ block: 'center' })")
    come_to_rest()
    before = page.evaluate("scrollY")
    drag([[(x + side * (30 + 10 * step), y) for step in range(6)] for side in (-1, 1)])
    assert page.evaluate("bindusbl.map.view.scale") > 1.5 * view["scale"]
    assert page.evaluate("scrollY") == before
    page.close()


def test_the_wheel_is_the_pages(opened: Open, recovery: Path) -> None:
    """Over the map the wheel scrolls the page, also once ctrl and wheel have zoomed the map."""
    it = opened(recovery)
    it.ask("byId('map').scrollIntoView({ block: 'center' })")
    it.page.hover("#map")
    before, scale = it.ask("[scrollY, bindusbl.map.view.scale]")
    it.page.keyboard.down("Control")
    it.page.mouse.wheel(0, -200)
    it.page.keyboard.up("Control")
    it.until(f"bindusbl.map.view.scale > 1.2 * {scale}")
    it.page.mouse.wheel(0, 200)
    it.until(f"scrollY > {before}")


def test_numbers_of_pages_have_no_exponents(opened: Open, recovery: Path) -> None:
    """Lengths of the timeline are plain numbers, and the page writes numbers as figures do."""
    it = opened(recovery)
    for value in (231.4, 5.3e-15, 0.05349, 12345.6, 2.6e-6, -1.26, 0.0):
        assert it.ask(f"significant({value}, 2)") == significant(value, 2)
    for mean, half in ((0.9224, 0.0351), (264.43, 0.013), (5.0, 0.0), (0.5, 2e-8), (0.35, 14.2)):
        assert it.ask(f"withHalf({mean}, {half})") == list(with_half(mean, half))
    for ends in ((0.785, 0.764, 0.806), (0.785, 0.78462, 0.78538), (1.0, 1.0, 1.0), (0.0, -1, 1)):
        assert it.ask(f"withEnds({', '.join(map(str, ends))})") == list(with_ends(*ends))
    for value in (231.42, 599.9, 600.0, 13529.0, 86399.0, 1.5e5):
        assert it.ask(f"timed({value}, 1)") == timed(value, 1)
        for end, rest in ((300.0, ""), (7200.0, "bindusbl.long = true, ")):
            assert it.ask(f"({rest}instant({value}, 0))") == instant(value, end)
        assert it.ask("(bindusbl.long = false, instant(3.25, 1))") in ("3.3 s", "3.2 s")
    assert it.ask("(bindusbl.long = true, instant(4000.26, 1))") == "1:06:40.3"
    assert it.ask("instants(null, [0, 600, 1200])") == ["0:00", "0:10", "0:20"]
    assert it.ask("instants(null, [60, 90])") == ["0:01:00", "0:01:30"]
    options = it.ask(
        """(() => { byId("window").replaceChildren(); Timeline.prototype.choices.call({
            mission: { duration: 4000, round: 29 }, sheet: { paint() {} } });
            return [...byId("window").options].map((it) => it.text); })()"""
    )
    assert options == ["58 s", "232 s", "0:15 h", "whole mission"]


def test_fixes_in_frames_that_collided_are_not_delivered(opened: Open, tmp_path: Path) -> None:
    """Answers that meet at an AUV: the page has as many fixes as the table."""
    plan = {"auvs.count": 4, "duration_s": 60, "protocol.downlink": "direct_reply"}
    overrides = [f"{key}={value}" for key, value in plan.items()] + [
        "protocol.downlink.reply=frame"
    ]
    result = simulate(load_scenario(SCENARIOS / "recovery_140m.yaml", overrides=overrides), seed=0)
    outcomes = result.tables["fixes"].outcome
    assert (outcomes == "collided").sum() > 10
    (tmp_path / "met.html").write_text(result.report(), encoding="utf-8")
    it = opened(tmp_path / "met.html")
    assert it.ask("bindusbl.mission.deliveredOrder.length") == (outcomes == "delivered").sum()


def test_fronts_of_sound_end_at_land(opened: Open, tmp_path: Path) -> None:
    """As far as shapely has the way free, in each direction; and no front is drawn beyond."""
    isle, spit = shapely.box(20, -40, 40, 30), shapely.box(-60, 35, 60, 45)
    land = [shapely.get_coordinates(it)[:-1].tolist() for it in (isle, spit)]
    held = {"count": 1, "route": {"kind": "hold", "positions_m": [[5.0, 3.0]]}}
    given = {"survey": {"size_m": [200.0, 200.0], "land": land}, "auvs": held, "asvs": {"count": 1}}
    result = simulate(Scenario.model_validate({"name": "isle", "duration_s": 8.0, **given}), seed=0)
    (tmp_path / "isle.html").write_text(result.report(), encoding="utf-8")
    it = opened(tmp_path / "isle.html")
    ways = it.ask("bindusbl.map.waysFrom(5, 3).map((way) => Math.min(way, 1e4))")
    turns = np.radians(np.arange(360))
    ends = np.column_stack((5 + 1e4 * np.cos(turns), 3 + 1e4 * np.sin(turns)))
    lines = shapely.linestrings([[(5, 3), end] for end in ends])
    met = shapely.intersection(lines, shapely.union(isle, spit))
    free = np.where(shapely.is_empty(met), 1e4, shapely.distance(met, shapely.Point(5, 3)))
    assert ways == pytest.approx(free, rel=1e-6)
    drawn = it.ask(
        """(() => {
            const drawn = [], context = byId("map").getContext("2d"), { map } = bindusbl;
            const keep = (...at) => drawn.push(map.placeAt(...at));
            Object.assign(context, { moveTo: keep, lineTo: keep });
            map.front(context, 5, 3, 50, "black", {});
            return drawn; })()"""
    )
    off = np.subtract(drawn, (5, 3))
    assert np.hypot(*off.T) == pytest.approx(50.0)
    hidden = free[np.round(np.degrees(np.arctan2(*off.T[::-1]))).astype(int) % 360] < 50.0
    assert 100 < len(off) < 300
    assert hidden.mean() < 0.1  # at the ends of what is drawn a step is cut in halves


def test_calls_are_drawn(opened: Open, tmp_path: Path) -> None:
    """Two-way ranging: calls on map and timeline, and in words where nobody answers."""
    plan = {"asvs.count": 1, "duration_s": 60, "protocol.ranging": "twtt"}
    overrides = [f"{key}={value}" for key, value in plan.items()]
    result = simulate(load_scenario(SCENARIOS / "recovery_140m.yaml", overrides=overrides), seed=0)
    (tmp_path / "twtt.html").write_text(result.report(), encoding="utf-8")
    it = opened(tmp_path / "twtt.html")
    it.ask(
        """(() => {
            bindusbl.drawn = bindusbl.rings = 0;
            const { call } = Timeline.prototype, { ring } = SeaMap.prototype;
            Timeline.prototype.call = function (...all) { bindusbl.drawn++, call.apply(this, all) };
            SeaMap.prototype.ring = function (...all) {
                bindusbl.rings += all[5]?.dash?.join() === "3,3";
                ring.apply(this, all);
            }; })()"""
    )
    slide(it, 30)
    it.until("bindusbl.drawn > 5 && bindusbl.rings > 0")
    silent = result.tables["pings"].query("call != 'heard'")
    assert len(silent) > 10
    words = it.ask("bindusbl.log.events.map((it) => it[1])")
    assert sum("no answer" in it for it in words) == len(silent)
    assert "calls, which AUVs answer by a ping" in it.ask("byId('timeline-legend').textContent")


def test_histograms_hold_every_value(opened: Open, recovery: Path) -> None:
    """They end where nearly all values do; what lies beyond is in the last bar."""
    it = opened(recovery)
    for values in ([0.8] * 19 + [230.0], [0.8, 0.9, 1.1], [0.0] * 20 + [5.0], [3.0]):
        top = 1.2 * float(np.quantile(values, 0.9)) or 1.0
        it.ask(
            f"""(() => {{
                const make = Plot.prototype.make;
                Plot.prototype.make = function () {{ make.call(this); bindusbl.bars = this.data; }};
                histogram("tried", byId("latency-plot"), {values}, "fixes", {top});
                Plot.prototype.make = make; }})()"""
        )
        middles, heights = it.ask("bindusbl.bars")
        assert sum(heights) == len(values)
        assert middles[-1] == pytest.approx(top, rel=0.05)
        assert heights[-1] >= sum(value > top for value in values)


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
    (tmp_path / "both.html").write_text(beside(*runs), encoding="utf-8")
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
def runs() -> list[tuple[str, Result]]:
    """Two missions of a minute that differ in how many ASVs they have."""
    names, changes = ("failure_140m", "recovery_140m"), ["duration_s=60"]
    return [(it, simulate(load_scenario(SCENARIOS / f"{it}.yaml", overrides=changes), seed=0))
            for it in names]  # fmt: skip


def test_the_other_run_is_a_ghost(
    opened: Open, tmp_path: Path, runs: list[tuple[str, Result]]
) -> None:
    """Each map has the AUVs of the other run where these believed to be, until it is unticked."""
    (tmp_path / "both.html").write_text(beside(*runs), encoding="utf-8")
    it = opened(tmp_path / "both.html", width=390)
    assert it.ask("[...document.querySelectorAll('.named .scroll')]"
                  ".every((it) => it.scrollWidth <= it.clientWidth)")  # fmt: skip
    slide(it, 40)
    for here, (_, other) in enumerate(reversed(runs)):
        seen = it.ask(
            f"""(() => {{
                const map = bindusbl.maps[{here}], {{ hull }} = map, seen = [];
                map.hull = (_, x, y, yaw, colour) => colour === colours.soft && seen.push([x, y]);
                map.sheet.paint();
                map.hull = hull;
                return seen.map((at) => map.placeAt(...at)); }})()"""
        )
        tracks = other.tables["tracks"].query("time_s == 40.0 and vehicle.str.startswith('AUV')")
        expected = tracks[["estimate_x_m", "estimate_y_m"]].to_numpy()
        assert np.array(seen) == pytest.approx(expected, abs=0.03)
    shown = it.ask("bindusbl.maps[0].sheet.canvas.toDataURL()")
    it.page.click("text=with the ghost of B >> input")
    assert it.ask("bindusbl.maps[0].sheet.canvas.toDataURL()") != shown


def test_a_drag_selects_in_both_runs(
    opened: Open, tmp_path: Path, runs: list[tuple[str, Result]]
) -> None:
    """Across the plot of errors: all plots show that interval, and the maps its paths alone."""
    (tmp_path / "both.html").write_text(beside(*runs), encoding="utf-8")
    it = opened(tmp_path / "both.html")
    it.page.locator("#error-plot").scroll_into_view_if_needed()
    box = it.page.locator("#error-plot .u-over").bounding_box()
    assert box is not None
    y, mouse = box["y"] + box["height"] / 2, it.page.mouse
    mouse.move(box["x"] + 0.25 * box["width"], y)
    mouse.down()
    for step in range(1, 6):
        mouse.move(box["x"] + (0.25 + 0.05 * step) * box["width"], y)
    mouse.up()
    it.until("bindusbl.playback.span !== null")
    span = it.ask("bindusbl.playback.span")
    assert span == pytest.approx([15, 30], abs=0.5)
    assert it.ask("bindusbl.maps.map((map) => map.span)") == [span, span]


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of a campaign."""
    folder = tmp_path_factory.mktemp("sweep")
    (folder / "base.yaml").write_text(BASE)
    (folder / "experiment.yaml").write_text(EXPERIMENT)
    campaign = sweep(folder / "experiment.yaml", folder / "out", workers=1)
    (folder / "sweep.html").write_text(campaign.report(), encoding="utf-8")
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


def test_curves_name_their_ends_beside_the_plot(opened: Open, swept: Path) -> None:
    """The labels begin to the right of the plot, where no line strikes them through."""
    it = opened(swept, width=390)
    told = it.ask(
        """(() => {
            const { plot } = bindusbl.view.plot, { left, width } = plot.bbox, told = [];
            const edge = left + width;
            plot.ctx.fillText = (text, x) => told.push([plot.ctx.textAlign, x - edge]);
            endLabels(plot, bindusbl.sweep.keys[bindusbl.view.by].labels);
            return told; })()"""
    )
    assert {align for align, _ in told} == {"left"}
    assert all(beyond > 0 for _, beyond in told)


def test_what_curves_are_is_said_whole_or_by_both_its_ends(opened: Open, swept: Path) -> None:
    """Two names that begin alike are told apart where a phone has no room for them."""
    labels = ["pipelined_round", "pipelined_group"]
    said = """(() => {
        const { plot } = bindusbl.view.plot, said = [];
        plot.ctx.fillText = (text) => said.push(text);
        endLabels(plot, %s);
        return [said, labelRoom(%s, 1000), labelRoom(%s, 390)]; })()"""
    narrow, wide_px, narrow_px = opened(swept, width=390).ask(said.replace("%s", str(labels)))
    assert len(set(narrow)) == 2
    assert all("…" in text for text in narrow)
    assert narrow_px < 100 < wide_px < 250
    fits = """(() => {
        const { ctx } = bindusbl.view.plot.plot;
        ctx.font = "600 11px system-ui, sans-serif";
        return fitting(ctx, "pipelined_round", labelRoom(["pipelined_round"], 1000) - 16); })()"""
    assert opened(swept, width=1000).ask(fits) == "pipelined_round"


def test_names_without_room_along_an_axis_have_letters(opened: Open, swept: Path) -> None:
    """Told in the caption; those that have room stand there themselves."""
    said = """(() => {
        const names = %s, asked = [{ key: "k", short: "k", values: null }];
        byId("curves").replaceChildren();
        const cells = [names.map((_, i) => [i, { mean: i, half: 1, count: 2, whole: 2 }])];
        Object.assign(bindusbl.view, { plot: null, along: 0, by: -1 });
        Object.assign(bindusbl.sweep, { keys: asked });
        bindusbl.view.curves("worst_position_error_m", cells, ["all"], names);
        const [shown] = bindusbl.view.plot.options().axes;
        return [shown.values(), byId("curves-caption").textContent]; })()"""
    long = ["kalman", *(f"my_very_long_module_of_navigators:Weighing{k}" for k in range(3))]
    values, caption = opened(swept, width=1000).ask(said.replace("%s", str(long)))
    assert values == ["A", "B", "C", "D"]
    assert caption.endswith(f"A: {long[0]}, B: {long[1]}, C: {long[2]}, D: {long[3]}")
    short = ["kalman", "fixed_gain"]
    values, caption = opened(swept, width=1000).ask(said.replace("%s", str(short)))
    assert values == short
    assert "A:" not in caption


def test_a_sweep_of_one_point_shows_its_missions(opened: Open, tmp_path: Path) -> None:
    """Each by its seed, with their mean and its interval; there is no map of one cell."""
    given = load_scenario("quickstart", overrides=["duration_s=5"])
    campaign = sweep(given, seeds=[3, 4, 8], workers=1, out=tmp_path / "one")
    path = tmp_path / "one.html"
    path.write_text(campaign.report(), encoding="utf-8")
    it = opened(path)
    assert not it.page.locator("#heat-figure").is_visible()
    for metric in ("worst_position_error_m", "position_error_p95_m"):
        it.page.select_option("#metric", metric)
        errors = campaign.missions[metric].to_numpy()
        xs, each, mean, low, high = it.ask("bindusbl.view.plot.data")
        assert len(xs) == 3
        assert each == pytest.approx(errors.tolist(), rel=1e-5)
        half = 4.302653 * errors.std(ddof=1) / 3**0.5  # Student's t, two degrees of freedom
        assert mean[0] == pytest.approx(errors.mean(), rel=1e-5)
        assert [low[0], high[0]] == pytest.approx([mean[0] - half, mean[0] + half], abs=1e-5)
    assert it.ask("bindusbl.view.plot.options().series[0].value(null, 2)") == "8"
    assert it.painted("#curves canvas") > 5


def test_curves_and_maps_of_a_sweep_are_saved(opened: Open, swept: Path) -> None:
    """An SVG of the curves has a line for each row, and names it; a CSV of the map its means."""
    it = opened(swept)
    svg = saved(it, "curves")
    assert len(polylines(svg, it.ask("colours.series.slice(0, 2)"))) == 2
    words = [text.text for text in ElementTree.fromstring(svg).iter(f"{SVG}text")]
    assert {"range_m 40", "range_m 80"} <= set(words)
    rows = [row.split(",") for row in saved(it, "heatmap", "CSV").decode().splitlines()]
    assert rows[0] == ['""', '"1"', '"2"', '"3"']
    assert float(rows[1][1]) == it.ask("bindusbl.sweep.at(byId('metric').value, 0).mean")


def test_the_lookup_table_follows_its_threshold(opened: Open, swept: Path) -> None:
    """The fewest ASVs are those whose interval ends below the threshold."""
    it = opened(swept)
    it.page.fill("#threshold", "100")
    answers = it.ask("bindusbl.lookup.fewest")
    assert sorted(answers, key=str) == ["1", "1", None, None]
    shown = it.page.locator("#lookup .answer:visible").all_inner_texts()
    assert [told for told in shown if told != "1"] == ["more than 3"] * 2
    it.page.fill("#threshold", "0")
    assert set(it.ask("bindusbl.lookup.fewest")) == {None}
    assert not it.page.locator("#lookup .sure:visible").count()
    assert "worst AUV's position error, 95 % of the time (m), below 0" in it.page.inner_text(
        "#asked"
    )
    for metric in ("worst_position_error_p95_m", "position_error_m"):  # the first unless asked
        if metric == "position_error_m":
            it.page.select_option("#lookup-metric", metric)
        cell = it.ask(f"bindusbl.sweep.at('{metric}', 0)")  # one ASV, the first combination
        assert cell["half"] > 0
        for share, fewest in ((0.5, False), (1.01, True)):  # the mean alone is not sure enough
            it.page.fill("#threshold", str(cell["mean"] + share * cell["half"]))
            assert (it.ask("bindusbl.lookup.fewest[0]") == "1") is fewest
            marked = it.page.locator("#lookup tbody tr:visible td").first.get_attribute("class")
            assert marked == ("sure fewest" if fewest else "near")


def test_a_sweep_shows_whom_it_leaves_alone(
    opened: Open, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A mean of 0.8 m does not tick a fleet in which AUV0 has 1.5 m; missing values are counted."""

    def fleet(scenario: Scenario, seed: int) -> list[dict[str, float | None]]:
        if scenario.asvs.count == 2:
            return [auv(1.5 + 0.01 * seed), auv(0.45), auv(0.45)]
        return [auv(0.4) | UNSERVED if seed else auv(0.4), auv(0.3 + 0.01 * seed), auv(0.3)]

    hand_made(monkeypatch, fleet)
    (tmp_path / "base.yaml").write_text(BASE)
    campaign = sweep(tmp_path / "base.yaml", tmp_path / "c", vary={"asvs.count": [2, 3]}, seeds=4)
    page = tmp_path / "sweep.html"
    page.write_text(campaign.report(), encoding="utf-8")
    it = opened(page)
    fewest = "bindusbl.lookup.fewest[0]"
    assert it.ask(fewest) == "3"
    it.page.select_option("#lookup-metric", "worst_position_error_m")
    assert it.ask(fewest) == "3"
    assert "\nAUV0\n" in it.page.inner_text("#lookup")
    it.page.select_option("#lookup-metric", "position_error_m")
    assert it.ask(fewest) == "2"
    assert "an AUV without a fix in 3/4" in it.page.inner_text("#lookup")
    it.page.select_option("#metric", "latency_mean_s")
    assert it.ask("bindusbl.sweep.at('latency_mean_s', 1)")["whole"] == 1
    assert "1/4" in it.page.inner_text("#heat")
    assert "n of m missions have a value for every AUV" in it.page.inner_text("#meaning")
    assert "No fix at point 1 (asvs.count=3): AUV0 in 3 of 4 seeds." in it.page.inner_text("#story")


def test_the_survey_can_be_shaded(opened: Open, recovery: Path) -> None:
    """By what is to be expected of fixes there, with a ramp that says what its ends are."""
    it = opened(recovery)
    before = it.ask("byId('map').toDataURL()")
    shades = {before}
    for field, unit in (("chance", "100 %"), ("age", "s or more"), ("error", "m or more")):
        it.page.select_option("#field", field)
        shades.add(it.ask("byId('map').toDataURL()"))
        assert unit in it.page.inner_text("#field-scale")
        values = it.ask(f"Array.from(bindusbl.mission.fields.{field}).filter(Number.isFinite)")
        assert len(values) > 1000
    assert len(shades) == 4
    it.page.select_option("#field", "")
    assert it.ask("byId('map').toDataURL()") == before
    assert it.page.inner_text("#field-scale") == ""


@pytest.mark.parametrize(
    ("changes", "there", "absent"),
    [
        (["protocol.ranging=passive"], ["HF range", "fixes"], ["MF range", "no ASV", "broadcasts"]),
        (["acoustics.hf.channel=sonar"], ["the protocol plans with"], ["no ASV in range"]),
        (
            ["protocol.downlink=direct_reply", "protocol.downlink.reply=instant"],
            ["answers and fixes"],
            ["MF range", "broadcasts"],
        ),
    ],
)
def test_legends_name_what_there_is(
    opened: Open, tmp_path: Path, changes: list[str], there: list[str], absent: list[str]
) -> None:
    """No band that nothing is sent on, and no range for a channel that cuts nothing at one."""
    changes = [*changes, "duration_s=20"]
    path = tmp_path / "run.html"
    path.write_text(simulate(load_scenario("quickstart", overrides=changes), 1).report())
    told = opened(path).page.inner_text("#marks")
    assert all(words in told for words in there), told
    assert not any(words in told for words in absent), told


def test_a_page_without_javascript_has_its_tables(browser: Any, recovery: Path) -> None:
    """Scripts are off: a notice, the answer and tables; nothing that would need scripts."""
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(recovery.as_uri())
    assert page.locator("noscript p").is_visible()
    assert page.locator(".verdict").nth(1).is_visible()
    assert page.locator("#auvs table").first.is_visible()
    for hidden in ("#map", ".controls >> nth=0", "#theme", "#error-plots", "#timeline"):
        assert not page.locator(hidden).is_visible()
    context.close()


def test_a_sweep_without_javascript_has_its_points(browser: Any, swept: Path) -> None:
    """Scripts are off: a notice, what was found and a row for each point; no empty frames."""
    context = browser.new_context(java_script_enabled=False, viewport={"width": 390, "height": 844})
    page = context.new_page()
    page.goto(swept.as_uri())
    assert page.locator("noscript p").is_visible()
    assert page.locator("#story .verdict").is_visible()
    assert page.locator("#points table").is_visible()
    rows = page.locator("#points tbody tr").all_inner_texts()
    assert [row.split()[:2] for row in rows[:2]] == [["0", "1"], ["1", "1"]]
    assert len(rows) == 12
    shades = page.locator("#heat td").evaluate_all(
        "(cells) => cells.map((cell) => [parseFloat(cell.textContent), cell.className])"
    )
    known = sorted((value, int(look[5:])) for value, look in shades if look != "none")
    assert [look for _, look in known] == sorted((look for _, look in known), reverse=True)
    assert (known[0][1], known[-1][1], len(known), len(shades)) == (10, 0, 6, 12)  # dark is bad
    assert page.locator("#lookup table:visible").count() == 1
    assert "below 1" in page.inner_text("#asked")
    for hidden in ("#grid select", "#curves", "#threshold", "#theme"):
        assert not page.locator(hidden).first.is_visible()
    context.close()


def test_two_runs_without_javascript_show_no_empty_headings(browser: Any, tmp_path: Path) -> None:
    """Scripts are off: the tables that compare are there, the frames of plots are not."""
    run = simulate(load_scenario("quickstart", overrides=["duration_s=10"]), 1)
    (tmp_path / "both.html").write_text(beside(("one", run), ("two", run)))
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto((tmp_path / "both.html").as_uri())
    assert page.get_by_text("The worst AUV of each").is_visible()
    assert not page.get_by_text("Delivered fixes", exact=True).is_visible()
    context.close()


def test_names_are_not_cut_at_the_edge_of_the_map(opened: Open, recovery: Path) -> None:
    """An AUV beside the right edge has its whole name on the map."""
    it = opened(recovery, width=390)
    left, long, width = it.ask(
        """(() => {
            const { map } = bindusbl, context = map.sheet.canvas.getContext("2d");
            let told;
            map.at = () => [map.width - 5, 100];
            map.labelled = [];
            map.label = (_, words, x) => { told = [x, context.measureText(words).width]; };
            context.font = "600 12px system-ui, sans-serif";
            map.drawAuv(context, 0);
            return [...told, map.width]; })()"""
    )
    assert width - 60 < left < width - long


def test_names_in_the_close_up_keep_apart(opened: Open, recovery: Path) -> None:
    """Wherever truth, estimate and fix lie to one another, no name covers another."""
    it = opened(recovery)
    places = it.ask(
        """(() => {
            const { closeup } = bindusbl, all = [];
            const context = closeup.map.sheet.canvas.getContext("2d");
            for (let x = -60; x <= 60; x += 12) for (let y = -40; y <= 40; y += 8) {
                for (const [u, v] of [[0, 0], [50, 5], [-30, 12]]) {
                    closeup.named = [];
                    closeup.name(context, "truth", 100, 100, "red");
                    closeup.name(context, "estimate", 100 + x, 100 + y, "red");
                    closeup.name(context, "last fix", 100 + u, 100 + v, "red");
                    all.push(closeup.named);
                } }
            return all; })()"""
    )
    for named in places:
        for i, (left, right, base) in enumerate(named):
            for begin, end, other in named[:i]:
                assert right < begin or end < left or abs(base - other) >= 13
    slide(it, 100)
    assert len(it.ask("bindusbl.closeup.named")) == 3


def test_the_answer_is_on_the_first_screen_of_a_phone(opened: Open, recovery: Path) -> None:
    """The sentence and the tiles of the worst AUV; playback follows that AUV."""
    it = opened(recovery, width=390)
    assert it.ask("document.querySelector('.tiles').getBoundingClientRect().bottom") < 844
    worst = it.ask("document.querySelector('.verdict').textContent.split(' ')[0]")
    assert it.ask("bindusbl.mission.auvs[bindusbl.closeup.auv].name") == worst
    assert it.ask("document.querySelector('#error-plots [role=img]').ariaLabel").split()[3] == worst


def test_dark_is_bad(opened: Open, recovery: Path) -> None:
    """Of every field: what is worse is darker."""
    it = opened(recovery)
    light = "shadeOf({}, {}).reduce((sum, part) => sum + part, 0)"
    assert it.ask(light.format(1, "true")) < it.ask(light.format(0, "true"))  # a large error
    assert it.ask(light.format(0, "false")) < it.ask(light.format(1, "false"))  # a small chance
