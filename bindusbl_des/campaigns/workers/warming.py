"""Compiled code made once before the workers start, who find it on the disk then."""

import json
from contextlib import suppress

from ...scenario import Scenario
from ...simulation import simulate
from ..experiments.plan import Plan

# Long enough for a ping to be heard and its fix to be computed.
WARMING_S = 3.0


def compile_kernels(plan: Plan) -> None:
    """Run the beginning of a mission for each combination of vehicles."""
    known: set[str] = set()
    for point in plan.points:
        data = json.loads(point.scenario)
        vehicles = str([data["auvs"]["vehicle"], data["asvs"]["vehicle"]])
        if vehicles in known:
            continue
        known.add(vehicles)
        data["duration_s"] = min(data["duration_s"], WARMING_S)
        data["protocol"]["schedule"] = "one_per_slot"  # one's own might do anything
        with suppress(Exception):  # what is wrong with a mission is told by the mission
            simulate(Scenario.model_validate(data), 0)
