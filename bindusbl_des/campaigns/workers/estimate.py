"""What a campaign would cost, from one mission that is run for it."""

import json
import os
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter

from ...core.kept_files import keep
from ...scenario.families import without_plugins
from ..experiments.plan import Plan
from .batches import Batch, run_batch
from .supervisor import batch_of
from .warming import compile_kernels

# The tables of one mission are mostly their own description, which large files hold once: measured
# with 36 columns, of which each takes some 8 bytes a row when there are many.
SHARED_BYTES = 30_000
ROW_BYTES = 400


@dataclass(frozen=True)
class Estimate:
    """Missions of a campaign, and the time (s) and disk (bytes) that they will take."""

    missions: int
    points: int
    seeds: int
    seconds: float
    bytes: int


def estimated(plan: Plan, missions: int, workers: int | None) -> Estimate:
    """Run the first mission of a plan in a temporary folder; return what all would take.

    Shipped parts stand in for plug-ins, which are not loaded.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        keep(plan.files, folder)
        compile_kernels(plan, folder)
        began = perf_counter()
        run_batch(_plain(batch_of(plan, folder, (0,), 0.0)))
        spent = perf_counter() - began
        size = sum(path.stat().st_size for path in folder.glob("*/*.parquet"))
    each = max(size - SHARED_BYTES, ROW_BYTES)
    at_once = max(1, min(workers or os.cpu_count() or 1, missions))
    return Estimate(
        missions,
        len(plan.points),
        len(plan.experiment.seeds),
        spent * missions / at_once,
        SHARED_BYTES + each * missions,
    )


def _plain(batch: Batch) -> Batch:
    """Return a batch whose missions need no plug-in."""
    points = {
        number: replace(point, scenario=json.dumps(without_plugins(json.loads(point.scenario))))
        for number, point in batch.points.items()
    }
    return replace(batch, points=points, plugins=(), own_parts={})
