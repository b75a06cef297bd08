"""Make the pictures of the README and the manual again: `python docs/figures/make.py`.

They show the pages and figures of this version, for scenarios that pin all that matters: the report
of the recovery mission as `run` writes it (without advice, which takes time of the machine's), its
playback at an instant, the figure of a sweep, and the map of the survey that the page on surveys
describes.  Needs Chromium and the extra `dev`.
"""

import shutil
import tempfile
from pathlib import Path
from typing import Any

import yaml
from playwright.sync_api import sync_playwright

from bindusbl_des import Scenario, simulate, sweep

FOLDER = Path(__file__).parent
SCENARIO = FOLDER.parents[1] / "scenarios" / "recovery_140m.yaml"
BROWSERS = ("chromium", "chromium-browser", "google-chrome")

# Instant (s) of the playback that is shown: AUV0 has been without fixes for a quarter of a minute.
SHOWN_AT = 128.0

# Size of the window (CSS px), and what is left above and below what is cut out of it
WIDTH, HEIGHT, MARGIN = 1000, 1000, 8


def main() -> None:
    """Write report.png, playback.png, sweep.svg and basin.png beside this file."""
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "report.html"
        simulate(SCENARIO, seed=0).report(page)
        photograph(page)
    varied = {"asvs.formation.angle_deg": range(0, 121, 10), "asvs.count": [2, 3, 4]}
    campaign = sweep(SCENARIO, vary=varied, seeds=8)
    campaign.plot(
        "curves", FOLDER / "sweep.svg", x="asvs.formation.angle_deg", series="asvs.count", width=6.0
    )

    simulate(described("surveys.md", "basin.yaml"), seed=0).plot(
        "trajectory", FOLDER / "basin.png", width=3.2
    )


def described(page: str, name: str) -> Scenario:
    """Return the scenario that a page of the manual gives as a file of that name."""
    text = (FOLDER.parent / page).read_text()
    block = next(it for it in text.split("```yaml\n") if it.startswith(f"# {name}\n"))
    return Scenario.model_validate(yaml.safe_load(block.partition("```")[0]))


def photograph(report: Path) -> None:
    """Take the pictures of a run's report: its beginning, and its playback."""
    browser_of_this_machine = next(filter(None, map(shutil.which, BROWSERS)), None)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=browser_of_this_machine, args=["--no-sandbox"]
        )
        page = browser.new_page(
            viewport={"width": WIDTH, "height": HEIGHT},
            color_scheme="light",
            reduced_motion="reduce",
        )
        page.goto(report.as_uri())
        page.evaluate("bindusbl.opened")
        cut(page, "header", ".cards > :nth-child(2)", FOLDER / "report.png")
        slider = "byId('slider')"
        page.evaluate(f"{slider}.value = {SHOWN_AT}; {slider}.dispatchEvent(new Event('input'))")
        page.wait_for_timeout(200)
        cut(page, "#playback", "#legend", FOLDER / "playback.png")
        browser.close()


def cut(page: Any, first: str, last: str, path: Path) -> None:
    """Take a picture of a page from the top of one element to the bottom of another."""
    top, bottom = (page.locator(it).first.bounding_box() for it in (first, last))
    y = max(0.0, top["y"] - MARGIN)
    height = bottom["y"] + bottom["height"] + MARGIN - y
    page.screenshot(
        path=path, full_page=True, clip={"x": 0, "y": y, "width": WIDTH, "height": height}
    )


if __name__ == "__main__":
    main()
