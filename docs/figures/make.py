"""Make the pictures of the README and the manual again: `python docs/figures/make.py`.

They show the pages and figures of this version, for scenarios that pin all that matters: the report
of the recovery mission as `run` writes it (without advice, which takes time of the machine's), its
playback at an instant, one round of it, the figure of a sweep, the map of the survey that the page
on surveys describes, the answer of the second tutorial, and the chart of a plan.  Needs Chromium
and the extra `dev`.
"""

import re
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml
from PIL import Image
from playwright.sync_api import sync_playwright

from bindusbl_des import Result, Scenario, load_scenario, plan, simulate, sweep

FOLDER = Path(__file__).parent
SCENARIO = FOLDER.parents[1] / "scenarios" / "recovery_140m.yaml"
BROWSERS = ("chromium", "chromium-browser", "google-chrome")

# Instant (s) of the playback that is shown: AUV0 has been without fixes for a quarter of a minute.
SHOWN_AT = 128.0

# Size of the window (CSS px), and what is left above and below what is cut out of it
WIDTH, HEIGHT, MARGIN = 1000, 1000, 8

# A round in which each AUV is heard and each fix delivered
SHOWN_ROUND = 40

# Of the drawing of a mission, and of a round, whose marks are small
DPI, ROUND_DPI = 100, 140

# Colours of a picture, so that it loads quickly
COLOURS = 256


def main() -> None:
    """Write report, playback, round, basin, bay and plan.png and sweep.svg beside this file."""
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "report.html"
        recovery = simulate(SCENARIO, seed=0)
        recovery.report(page)
        photograph(page)
    one_round = recovery.plot("round", number=SHOWN_ROUND)
    one_round.savefig(FOLDER / "round.png", dpi=ROUND_DPI)
    varied = {"asvs.formation.angle_deg": range(0, 121, 10), "asvs.count": [2, 3, 4]}
    campaign = sweep(SCENARIO, vary=varied, seeds=8)
    campaign.plot(
        "curves", FOLDER / "sweep.svg", x="asvs.formation.angle_deg", series="asvs.count", width=6.0
    )
    basin = simulate(described("surveys.md", "basin.yaml"), seed=0)
    basin.plot("trajectory").savefig(FOLDER / "basin.png", dpi=DPI)
    with tempfile.TemporaryDirectory() as folder:
        bay(Path(folder)).plot("trajectory").savefig(FOLDER / "bay.png", dpi=DPI)
    with tempfile.TemporaryDirectory() as folder:
        plan(SCENARIO, folder, below={"position_error_m": 1.0}, force=True)
        photograph_plan(Path(folder) / "plan.html")
    for path in FOLDER.glob("*.png"):
        # The chart of a plan is of many shades, the others of few colours, some of them rare.
        method = Image.Quantize.MEDIANCUT if path.stem == "plan" else Image.Quantize.MAXCOVERAGE
        with Image.open(path) as picture:
            few = picture.convert("RGB").quantize(COLOURS, method)
        few.save(path, optimize=True)


def bay(folder: Path) -> Result:
    """Return the mission that the tutorial of a real plan ends with; its files go to a folder."""
    page = (FOLDER.parent / "tutorial_real_plan.md").read_text()
    for name, text in re.findall(r'^```\w+ title="([\w.]+)"\n(.*?)^```', page, re.M | re.S):
        (folder / name).write_text(text)
    (scenario,) = re.findall(r"^```yaml\n# bay.yaml\n(.*?)^```", page, re.M | re.S)
    (folder / "bay.yaml").write_text(scenario)
    return simulate(load_scenario(folder / "bay.yaml"), seed=0)


def described(page: str, name: str) -> Scenario:
    """Return the scenario that a page of the manual gives as a file of that name."""
    text = (FOLDER.parent / page).read_text()
    block = next(it for it in text.split("```yaml\n") if it.startswith(f"# {name}\n"))
    return Scenario.model_validate(yaml.safe_load(block.partition("```")[0]))


def photograph(report: Path) -> None:
    """Take the pictures of a run's report: its beginning, and its playback."""
    with opened(report) as page:
        cut(page, "header", ".cards > :nth-child(2)", FOLDER / "report.png")
        slider = "byId('slider')"
        page.evaluate(f"{slider}.value = {SHOWN_AT}; {slider}.dispatchEvent(new Event('input'))")
        page.wait_for_timeout(200)
        cut(page, "#playback", "#legend", FOLDER / "playback.png", below=0)


def photograph_plan(path: Path) -> None:
    """Take the picture of a plan's page: the chart with the answer on it, and each AUV."""
    with opened(path) as page:
        page.wait_for_timeout(200)
        cut(page, "#chart .controls", "#field-scale", FOLDER / "plan.png")


@contextmanager
def opened(path: Path) -> Iterator[Any]:
    """Open a page in the browser of this machine, ready to be photographed."""
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
        page.goto(path.as_uri())
        page.evaluate("bindusbl.opened")
        yield page
        browser.close()


def cut(page: Any, first: str, last: str, path: Path, below: int = MARGIN) -> None:
    """Take a picture of a page from the top of one element to the bottom of another, and so much
    below it (CSS px).
    """
    top, bottom = (page.locator(it).first.bounding_box() for it in (first, last))
    y = max(0.0, top["y"] - MARGIN)
    height = bottom["y"] + bottom["height"] + below - y
    page.screenshot(
        path=path, full_page=True, clip={"x": 0, "y": y, "width": WIDTH, "height": height}
    )


if __name__ == "__main__":
    main()
