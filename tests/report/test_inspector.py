"""What became of a ping, asked for on the page of a run: in a browser."""

import json
import re
from pathlib import Path

import pytest
from browser_for_tests import Open, without_browser
from explain_for_tests import chain_of_ping

from bindusbl_des import Result, load_scenario, simulate

pytestmark = without_browser

TOLD = "byId('inspector').innerText"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Result, Path]:
    """A short mission in which pings are lost and fixes come from too far away, and its page."""
    result = simulate(load_scenario("recovery_140m", overrides=["duration_s=60"]), seed=0)
    path = tmp_path_factory.mktemp("inspected") / "report.html"
    path.write_text(result.report(), encoding="utf-8")
    return result, path


def test_the_inspector_tells_what_explain_tells(opened: Open, run: tuple[Result, Path]) -> None:
    """Of each ping: which fix, who decodes it and who does not, which frame, how late."""
    result, page = run
    it = opened(page)
    for ping in range(0, len(result.tables["pings"]), 7):
        told = chain_of_ping(result, ping).text()
        said = it.ask(f"bindusbl.inspector.show({ping}); {TOLD}")
        for pattern in (
            r"Ping \d+ of AUV\d",
            r"fix \d+, delivered [\d.]+ s after the ping",
            r"ASV\d (?:decodes it|loses it|hears pings mixed|is too far away)",
            r"Fix \d+ is made",
            r"broadcasts it among \d+ fixes",
        ):
            plain = " ".join(told.split()).replace("+-", "±")
            shown = set(re.findall(pattern, " ".join(said.split())))
            assert shown == set(re.findall(pattern, plain)), (ping, pattern)
        assert f"--ping {ping}" in said
        places = [re.findall(r"x (-?[\d.]+) \S+ ([\d.]+), y", it) for it in (told, said)]
        assert len(places[0]) == len(places[1])
        for one, other in zip(*places, strict=True):  # the page has millimetres
            assert [*map(float, one)] == pytest.approx([*map(float, other)], abs=0.0101)


def test_an_address_is_kept(opened: Open, run: tuple[Result, Path]) -> None:
    """By reload and the back button; it opens the page at its instant with its ping."""
    it = opened(run[1])
    it.ask("bindusbl.inspector.show(30)")
    first = it.ask("location.hash")
    time = it.ask("bindusbl.playback.now")
    assert re.fullmatch(r"#t=[\d.]+&ping=30", first)
    it.page.click("#next-lost")
    lost = it.ask("bindusbl.mission.pings.id[bindusbl.inspector.ping]")
    assert f"Ping {lost} of AUV" in it.ask(TOLD)  # whose it was
    it.page.go_back()
    it.until("location.hash === " + json.dumps(first))
    assert "Ping 30 of AUV" in it.ask(TOLD)
    it.page.reload()
    it.ask("bindusbl.opened")
    assert it.ask("location.hash") == first
    assert it.ask("bindusbl.playback.now") == pytest.approx(time, abs=1e-3)
    assert "Ping 30 of AUV" in it.ask(TOLD)
    it.requests[:] = it.requests[:1]  # the same file, asked for again


def test_a_click_asks_for_a_vehicle_or_a_line(opened: Open, run: tuple[Result, Path]) -> None:
    """An AUV on the map: its last ping, and it is followed; a line of the log: its ping."""
    it = opened(run[1])
    it.ask("bindusbl.playback.seek(40)")
    x, y = it.ask("bindusbl.map.at(...Object.values(bindusbl.mission.auvAt(2, 40)).slice(0, 2))")
    it.page.click("#map", position={"x": x, "y": y})
    assert "of AUV2" in it.ask(TOLD)
    assert it.ask("bindusbl.closeup.auv") == 2
    it.page.locator("#log li").nth(1).click()
    assert f"Ping {it.ask('bindusbl.log.list.children[1].dataset.ping')} of" in it.ask(TOLD)


def test_a_plot_is_saved(opened: Open, run: tuple[Result, Path]) -> None:
    """As numbers and as a picture."""
    it = opened(run[1])
    with it.page.expect_download() as numbers:
        it.page.click("#error-plots .save button >> text=CSV")
    lines = Path(numbers.value.path()).read_text().splitlines()
    assert lines[0].startswith('"time","AUV')
    assert len(lines) == 1 + it.ask("bindusbl.mission.time.length")
    with it.page.expect_download() as picture:
        it.page.click("#error-plots .save button >> text=PNG")
    assert Path(picture.value.path()).read_bytes()[:4] == b"\x89PNG"


def test_a_drag_across_a_plot_selects_everywhere(opened: Open, run: tuple[Result, Path]) -> None:
    """Plots of time zoom, the map has the paths of that time, the log all that happened then."""
    it = opened(run[1])
    it.page.locator("#error-plots .u-over").first.scroll_into_view_if_needed()
    box = it.page.locator("#error-plots .u-over").first.bounding_box()
    at = [box["x"] + share * box["width"] for share in (0.25, 0.5)]
    painted = it.ask("byId('map').toDataURL()")
    it.page.mouse.move(at[0], box["y"] + 40)
    it.page.mouse.down()
    it.page.mouse.move(at[1], box["y"] + 40, steps=4)
    it.page.mouse.up()
    it.until("bindusbl.playback.span !== null")
    start, end = it.ask("bindusbl.playback.span")
    assert [start, end] == pytest.approx([15, 30], abs=0.5)
    assert it.ask("bindusbl.map.span") == [start, end]
    assert it.ask("bindusbl.playback.now") == end
    shown = it.ask("[...byId('log').children].map((line) => +line.textContent.split(' ')[0])")
    known = it.ask("Array.from(bindusbl.log.times)")
    assert len(shown) == sum(start < time <= end for time in known) > 6
    assert it.ask("byId('map').toDataURL()") != painted
    it.page.mouse.dblclick(at[0], box["y"] + 40)
    it.until("bindusbl.playback.span === null && bindusbl.map.span === null")
    assert it.ask("byId('log').children.length") == 6
