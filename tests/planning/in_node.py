"""The predictor of the page, run by Node instead of a browser."""

import json
import shutil
import subprocess
from typing import Any

from bindusbl_des.planning.plan_page import PREDICTOR
from bindusbl_des.report.page import asset

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


def asked(questions: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return what the page predicts: a dict by metric for each {inputs, stations, ...}."""
    assert NODE is not None
    code = "\n".join([BARE, *map(asset, ("base.js", *PREDICTOR)), ASKED])
    done = subprocess.run(
        [NODE, "-e", code], input=json.dumps(questions), capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    answers: list[dict[str, Any]] = json.loads(done.stdout)
    return answers
