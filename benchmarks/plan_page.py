"""How smoothly vessels are moved on the page of a plan: `python benchmarks/plan_page.py [AUVS]`.

A headless Chromium drags a vessel about for some seconds; printed are frames a second, and how long
the page works on one: predicting, shading, writing.
"""

import sys
import tempfile
from pathlib import Path
from shutil import which

import numpy as np
from playwright.sync_api import sync_playwright

from bindusbl_des import Setup, load_scenario
from bindusbl_des.apps.planning.plan_page import chart_of, plan_page
from bindusbl_des.apps.planning.prediction.gathering import inputs_of

# A circle of 40 m about where the first vessel is, a turn a second, for so many ms.
DRAG = """async (lasts) => {
  const { chart } = bindusbl, [x, y] = chart.team.stations[0], times = [];
  chart.frames.length = 0;
  const began = performance.now();
  await new Promise((done) => {
    const step = (now) => {
      times.push(now);
      const angle = (now - began) / 1000 * 2 * Math.PI;
      const place = [x + 40 * Math.cos(angle), y + 40 * Math.sin(angle)];
      chart.change(() => chart.team.move(0, place));
      if (now - began < lasts) requestAnimationFrame(step); else done();
    };
    requestAnimationFrame(step);
  });
  return { times, frames: chart.frames };
}"""


def main() -> None:
    """Print how many frames a second there are while one of four vessels is dragged."""
    auvs = int(sys.argv[1]) if len(sys.argv) > 1 else 10
    for duration in (300, 1200):
        changes = [f"auvs.count={auvs}", "survey.side_m=140", "asvs.count=4"]
        scenario = load_scenario("quickstart", overrides=[*changes, f"duration_s={duration}"])
        page = plan_page({"name": "drag"}, chart_of(Setup(scenario), inputs_of(Setup(scenario))))
        with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
            path = Path(folder, "plan.html")
            path.write_text(page, encoding="utf-8")
            browser = playwright.chromium.launch(
                executable_path=which("chromium"), args=["--no-sandbox"]
            )
            tab = browser.new_page(viewport={"width": 1280, "height": 900})
            tab.goto(path.as_uri())
            tab.evaluate(DRAG, 1000)  # compiles
            found = tab.evaluate(DRAG, 4000)
            browser.close()
        gaps, frames = np.diff(found["times"]), found["frames"]
        print(
            f"{auvs} AUVs, {duration} s: {1000 / gaps.mean():.0f} frames a second "
            f"({1000 / np.quantile(gaps, 0.95):.0f} in the slowest twentieth); "
            f"{np.median(frames):.1f} ms of work a frame, "
            f"{np.quantile(frames, 0.95):.1f} ms in one of 20"
        )


if __name__ == "__main__":
    main()
