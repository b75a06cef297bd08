"""How soon the workbench predicts what a drag means: `python benchmarks/drags.py`.

A window asks as a page does while a vessel is dragged, one question at a time; it prints the median
and the 95 % quantile (ms) of what that takes, with numbers of AUVs and ASVs.
"""

import json
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from websockets.sync.client import ClientConnection, connect

SCENARIO = """\
name: drags
duration_s: 300
survey: {{side_m: 300, depth_m: 12}}
auvs: {{count: {auvs}}}
asvs: {{count: {asvs}, formation: {{positions_m: {stations}}}}}
acoustics: {{hf: {{range_m: 150}}, mf: {{range_m: 300}}}}
"""
FLEETS = ((3, 3), (10, 6))
ASKED = 200


def main() -> None:
    """Print what drags of each fleet take."""
    for auvs, asvs in FLEETS:
        took = 1e3 * drags(auvs, asvs)
        print(
            f"({auvs}, {asvs}): median {np.median(took):.0f} ms, p95 {np.quantile(took, 0.95):.0f}"
        )


def drags(auvs: int, asvs: int) -> NDArray[np.float64]:
    """Return what each of many questions of a drag takes (s)."""
    rng = np.random.default_rng(0)
    places = rng.uniform(-140.0, 140.0, (asvs, 2)).round(1).tolist()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "drags.yaml"
        file.write_text(SCENARIO.format(auvs=auvs, asvs=asvs, stations=json.dumps(places)))
        command = [sys.executable, "-m", "bindusbl_des", "workbench", str(file), "--no-browser"]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert process.stdout is not None
        found = re.search(r"http://(\S+)", process.stdout.readline())
        assert found is not None
        host = found[1].partition("/")[0]
        try:
            how: dict[str, Any] = {"origin": f"http://{host}", "max_size": None, "proxy": None}
            with connect(f"ws://{found[1]}talk", **how) as socket:
                while json.loads(socket.recv())["is"] != "forecast":
                    pass
                took = [_asked(socket, number, places, rng) for number in range(ASKED)]
        finally:
            process.terminate()
            process.wait()
    return np.array(took)


def _asked(
    socket: ClientConnection, number: int, places: list[Any], rng: np.random.Generator
) -> float:
    """Return what one question takes (s)."""
    places[0] = rng.uniform(-140.0, 140.0, 2).tolist()
    began = time.perf_counter()
    socket.send(json.dumps({"do": "try", "id": number, "stations": places}))
    while True:
        told = json.loads(socket.recv())
        if told["is"] == "tried" and told["id"] == number:
            return time.perf_counter() - began


if __name__ == "__main__":
    main()
