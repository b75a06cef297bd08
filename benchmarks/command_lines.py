"""How long whole commands take, from the start of Python to the last file."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import bindusbl_des

from .timing import clocked, peak_memory_mb, spread

PACKAGE = Path(bindusbl_des.__file__).resolve().parent

# The paper's baseline (section Baseline Validation): conventional USBL, four AUVs under one ASV.
BASELINE: dict[str, Any] = {
    "name": "baseline_60m",
    "survey": {"side_m": 60},
    "auvs": {
        "count": 4,
        "vehicle": {"model": "kinematic", "turning_radius_m": 3},
        "route": {"end_margin_m": 5},
    },
    "asvs": {"count": 1},
    "acoustics": {"hf": {"range_m": 100}, "mf": {"range_m": 200}},
    "protocol": {
        "schedule": "round_robin",
        "downlink": {"model": "direct_reply", "reply": "instant"},
        "tick_rate_hz": 30,
    },
    "navigation": {"filter": {"model": "fixed_gain", "delay_compensation": "none"}},
}

# A sweep over the paper's survey sizes and fleets: 192 points, each with 30 seeds.
SIDES_M = (60, 100, 140)
AUVS = range(3, 11)
ASVS = range(1, 5)
ANGLES_DEG = (0, 30)
SEEDS = 30
PLANNED = len(SIDES_M) * len(AUVS) * len(ASVS) * len(ANGLES_DEG) * SEEDS
SWEPT: dict[str, Any] = {
    "name": "swept",
    "acoustics": {"loss": {"combine": "clamp_first"}},
    "protocol": {"tick_rate_hz": 30},
    "navigation": {"filter": {"model": "fixed_gain", "delay_compensation": "none"}},
}

# What a program begins with.
IMPORTED = "from bindusbl_des import Scenario, simulate"

# Every 17th of the 192 points: 12 of them, of all sizes, since 17 divides none of the counts.
STRIDE = 17
WORKERS = 2


def commands(quick: bool, whole_sweep: bool = False) -> dict[str, Any]:
    """Return how long (ms) whole commands take on a warm cache, and what a sweep achieves.

    Only a part of the sweep is run unless it is to be the `whole_sweep`.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "baseline.yaml").write_text(json.dumps(BASELINE))  # JSON is YAML
        times = 2 if quick else 7
        advised = ["run", str(folder / "baseline.yaml"), "--advice", "--out", str(folder / "a")]
        run_python(["-c", IMPORTED])
        imports = [clocked(lambda: run_python(["-c", IMPORTED])) for _ in range(times)]
        return {
            "import_ms": spread(imports),
            "help_ms": _repeated([["--help"]] * times),
            "validate_ms": _repeated([["validate", str(folder / "baseline.yaml")]] * times),
            "run_ms": _repeated(
                [["run", str(folder / "baseline.yaml"), "--out", str(folder / f"run{number}")]
                 for number in range(times)]
            ),
            "advice_ms": spread([clocked(partial(call, advised))]),
            "sweep": _sweep(folder, quick, 1 if whole_sweep else STRIDE),
        }  # fmt: skip


def _repeated(calls: Sequence[list[str]]) -> dict[str, Any]:
    """Return the times (ms) of some calls; one more before them loads what is cached."""
    call([*calls[0][:-1], calls[0][-1] + "-warm"] if "--out" in calls[0] else calls[0])
    return spread([clocked(partial(call, words)) for words in calls])


def call(words: Sequence[str]) -> None:
    """Run `bindusbl-des` as a user does, in an interpreter of its own.

    Raises:
        RuntimeError: when the command fails, with what it said.
    """
    run_python(["-m", "bindusbl_des.cli", *words])


def run_python(words: Sequence[str]) -> None:
    """Run Python with this package; it keeps bytecode, as an installed package has it.

    Raises:
        RuntimeError: when it fails, with what it said.
    """
    path = os.pathsep.join(filter(None, (str(PACKAGE.parent), os.environ.get("PYTHONPATH"))))
    kept = {key: it for key, it in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    kept.setdefault("PYTHONPYCACHEPREFIX", str(Path(tempfile.gettempdir()) / "bindusbl-bytecode"))
    done = subprocess.run(
        [sys.executable, *words],
        capture_output=True, text=True, env={**kept, "PYTHONPATH": path},
    )  # fmt: skip
    if done.returncode:
        raise RuntimeError(f"python {' '.join(words)} failed: {done.stderr.strip()}")


def sweep_points() -> list[dict[str, Any]]:
    """Return all points of the sweep, dotted key -> value."""
    return [
        {
            "survey.side_m": side,
            "auvs.count": auvs,
            "asvs.count": asvs,
            "asvs.formation.angle_deg": angle,
        }
        for side, auvs, asvs, angle in product(SIDES_M, AUVS, ASVS, ANGLES_DEG)
    ]


def _sweep(folder: Path, quick: bool, stride: int) -> dict[str, Any]:
    """Return what every `stride`-th point of the sweep takes, and all in proportion."""
    points = sweep_points()[:: stride * (6 if quick else 1)]
    seeds = 3 if quick else SEEDS
    (folder / "swept.yaml").write_text(json.dumps(SWEPT))
    experiment = {"scenario": "swept.yaml", "points": points, "seeds": seeds, "detail": "summary"}
    (folder / "sweep.yaml").write_text(json.dumps(experiment))
    words = ["sweep", str(folder / "sweep.yaml"), "--workers", str(WORKERS), "--out"]
    took = clocked(lambda: call([*words, str(folder / "swept")]))
    missions = len(points) * seeds
    return {
        "missions": missions,
        "workers": WORKERS,
        "wall_s": took.wall,
        "processor_s": took.processor,
        "missions_per_s": missions / took.wall,
        "peak_memory_mb": peak_memory_mb(of_children=True),
        "planned_missions": PLANNED,
        "planned_s": took.wall * PLANNED / missions,
        "planned_processor_s": took.processor * PLANNED / missions,
    }
