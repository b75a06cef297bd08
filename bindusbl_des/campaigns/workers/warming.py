"""Compiled code made, or loaded from the disk, before the missions that need it."""

import json
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

from ...core.kept_files import placed
from ...mission.simulation import simulate
from ...scenario.families import without_plugins
from ...scenario.scenario import Scenario
from ...scenario.sections.duration import SURVEY
from ..experiments.plan import Plan

# Long enough for a ping to be heard and its fix to be computed.
WARMING_S = 3.0

# The vehicles for which this process has its compiled code.
_ready: set[str] = set()


def compile_kernels(plan: Plan, folder: Path) -> None:
    """Make sure that workers find compiled code on the disk for all vehicles of a plan."""
    for point in plan.points:
        warm(point.scenario, folder)


@lru_cache(maxsize=16)  # the seeds of a point follow one another
def warm(scenario: str, folder: Path) -> None:
    """Run the beginning of a mission, unless one with its vehicles was run in this process.

    Its files lie in a folder.
    """
    data = placed(json.loads(scenario), folder)
    vehicles = str([data["auvs"]["vehicle"], data["asvs"]["vehicle"]])
    if vehicles in _ready:
        return
    _ready.add(vehicles)
    data = without_plugins(data)  # one's own might do anything
    length = data["duration_s"]
    data["duration_s"] = WARMING_S if length == SURVEY else min(length, WARMING_S)
    data["protocol"]["schedule"] = "one_per_slot"
    with suppress(Exception):  # what is wrong with a mission is told by the mission
        simulate(Scenario.model_validate(data), 0)
