"""Compiled code made, or loaded from the disk, before the missions that need it."""

import json
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

from ...core.kept_files import placed
from ...mission.simulation import simulate
from ...scenario.families import without_plugins
from ...scenario.scenario import Scenario
from ...scenario.sections.duration import SURVEY
from ..experiments.plan import Plan

# Long enough for a ping to be heard and its fix to be computed.
WARMING_S = 3.0

# The kinds of missions for which this process has its compiled code.
_ready: set[str] = set()


def compile_kernels(plan: Plan, folder: Path) -> None:
    """Make sure that workers find compiled code on the disk for all missions of a plan."""
    for point in plan.points:
        warm(point.scenario, folder)


@lru_cache(maxsize=16)  # the seeds of a point follow one another
def warm(scenario: str, folder: Path) -> None:
    """Run the beginning of a mission, unless one of its kind was run in this process.

    Its files lie in a folder.
    """
    data = placed(json.loads(scenario), folder)
    kind = json.dumps(_kind({**data, "name": "", "asvs": {**data["asvs"], "formation": None}}))
    if kind in _ready:
        return
    _ready.add(kind)
    data = without_plugins(data)  # one's own might do anything
    length = data["duration_s"]
    data["duration_s"] = WARMING_S if length == SURVEY else min(length, WARMING_S)
    data["protocol"]["schedule"] = "one_per_slot"
    with suppress(Exception):  # what is wrong with a mission is told by the mission
        simulate(Scenario.model_validate(data), 0)


def _kind(data: Any) -> Any:
    """Return what missions have in common that need the same code: all but how large numbers are.

    >>> _kind({"gain": 0.9, "sd": 0, "failures": [], "models": ["otter", 2.0]})
    {'gain': True, 'sd': False, 'failures': [], 'models': ['otter', True]}
    """
    if isinstance(data, dict):
        return {key: _kind(value) for key, value in data.items()}
    if isinstance(data, list):
        return [_kind(value) for value in data]
    return data if data is None or isinstance(data, str) else bool(data)
