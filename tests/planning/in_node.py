"""The predictor of the page, run by Node instead of a browser."""

import json
import shutil
import subprocess
from typing import Any

from bindusbl_des.apps.planning.plan_page import PREDICTOR
from bindusbl_des.apps.report.page import asset

NODE = shutil.which("node")
# What base.js asks of a browser as it is read.
BARE = "const window = {}, uPlot = { pxRatio: 1 };"
ASKED = """
const asked = JSON.parse(require("fs").readFileSync(0, "utf8"));
process.stdout.write(JSON.stringify(asked.map(({ inputs, stations, equipment, places }) => {
  const own = equipment ? withEquipment(inputs, equipment) : inputs;
  const found = predict(own, stations);
  found.error_over_time = found.error_over_time.map((it) => [...it]);
  const metrics = Object.keys(found).filter((name) => name !== "error_over_time");
  found.worst = Object.fromEntries(metrics.map((name) => [name, worstOf(name, found)]));
  if (places) found.map = [...errorMap(own, stations, places)];
  return found;
})));
"""


# What a team is moved to: the keys that its command sets, and what is predicted of it.
MOVED = """
const { chart, moved } = JSON.parse(require("fs").readFileSync(0, "utf8"));
const team = new Team(chart);
Object.assign(team, moved);
const found = predict(team.inputs, team.stations);
process.stdout.write(JSON.stringify([team.settings(), worstOf("position_error_m", found)]));
"""


def asked(questions: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return what the page predicts: a dict by metric for each {inputs, stations, ...}."""
    answers: list[dict[str, Any]] = _answer(("base.js", *PREDICTOR), ASKED, questions)
    return answers


def moved(chart: dict[str, Any], **now: float) -> tuple[list[tuple[str, Any]], float]:
    """Return the keys that a page's command sets once sliders were moved, and the worst AUV's error
    that it predicts then.
    """
    keys, worst = _answer(("base.js", *PREDICTOR, "team.js"), MOVED, {"chart": chart, "moved": now})
    return [(key, value) for key, value in keys], worst


def _answer(assets: tuple[str, ...], code: str, question: Any) -> Any:
    assert NODE is not None
    code = "\n".join([BARE, *map(asset, assets), code])
    done = subprocess.run(
        [NODE, "-e", code], input=json.dumps(question), capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)
