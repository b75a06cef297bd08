"""Take the picture of the workbench again: `python docs/figures/workbench.py`.

It shows the bay with an island of the manual, its fairway, and a plan that was asked for in the
form.  Needs Chromium and the extra `dev`.
"""

import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from io import BytesIO
from pathlib import Path

from make import BROWSERS, FOLDER
from PIL import Image
from playwright.sync_api import sync_playwright

PAGE = FOLDER.parent / "tutorial_island.md"
SIZE = {"width": 1366, "height": 860}
# What is asked for (m): a plan that is settled within minutes
BELOW = "6"
PATIENCE_MS = 1_200_000


def main() -> None:
    """Write workbench.webp beside this file."""
    with tempfile.TemporaryDirectory() as folder:
        scenario = island(Path(folder))
        command = [sys.executable, "-m", "bindusbl_des", "workbench", str(scenario), "--no-browser"]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert process.stdout is not None
        try:
            photograph(process.stdout.readline().split()[-1])
        finally:
            process.terminate()
            process.wait()


def island(folder: Path) -> Path:
    """Write the files of the manual's bay into a folder, and return its scenario."""
    page = PAGE.read_text()
    (chart,) = re.findall(r'^```xml title="island.kml"\n(.*?)^```', page, re.M | re.S)
    with zipfile.ZipFile(folder / "island.kmz", "w") as kmz:
        kmz.writestr("doc.kml", chart)
    (scenario,) = re.findall(r"^```yaml\n# island.yaml\n(.*?)^```", page, re.M | re.S)
    file = folder / "island.yaml"
    file.write_text(scenario)
    return file


def photograph(address: str) -> None:
    """Ask for a plan in the page, and take its picture once it is answered."""
    browser_of_this_machine = next(filter(None, map(shutil.which, BROWSERS)), None)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=browser_of_this_machine, args=["--no-sandbox"]
        )
        page = browser.new_page(viewport=SIZE, color_scheme="light")
        page.set_default_timeout(PATIENCE_MS)
        page.goto(address)
        page.wait_for_selector("#auvs tbody tr", state="attached")
        page.click("[data-tab=plan]")
        for name, value in (("below", BELOW), ("least", "2"), ("most", "2")):
            page.fill(f"#{name}", value)
        page.press("#below", "Tab")
        page.click("#plan > button")
        page.wait_for_selector("#planned [data-status=complete]")
        page.evaluate("byId('file').textContent = 'island.yaml'")
        page.wait_for_timeout(500)
        taken = page.screenshot()
        browser.close()
    Image.open(BytesIO(taken)).save(FOLDER / "workbench.webp", quality=82)


if __name__ == "__main__":
    main()
