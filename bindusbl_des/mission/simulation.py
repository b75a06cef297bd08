"""Run one mission: scenario in, tables out."""

import time
from collections.abc import Callable

import numpy as np
import simpy

from ..protocol.tdma import serve
from ..results.result import Result
from ..results.tables import from_columns, from_rows
from ..scenario.scenario import Scenario
from .build import build_world
from .event_tables import event_tables
from .metrics import auv_metrics, mission_metrics, utilisation
from .world import World

# How often a mission tells how far it is.
PROGRESS_STEPS = 200


def simulate(
    scenario: Scenario, seed: int = 0, progress: Callable[[float], None] | None = None
) -> Result:
    """Run one mission of a scenario; return what happened, a table for each kind of event.

    `progress` is told the instant (s) of the mission now and then, which changes nothing of it.

    The mission covers [0, duration): what would happen at its last instant does not, and pings and
    fixes still under way then are recorded as in flight.  The same scenario and seed give the same
    tables.

    Raises:
        ValueError: when the seed is not a whole number >= 0, or the scenario names a schedule or
            track that cannot be used.
    """
    if isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or seed < 0:
        raise ValueError(f"the seed must be a whole number >= 0, got {seed!r}")
    began = time.perf_counter()
    world = run(scenario, int(seed), progress)
    arrow = {} if scenario.record.detail == "summary" else event_tables(world)
    auvs = auv_metrics(world)
    arrow["auvs"] = from_rows("auvs", auvs)
    mission = mission_metrics(auvs, utilisation(world))
    arrow["mission"] = from_columns("mission", {name: [value] for name, value in mission.items()})
    return Result(scenario, int(seed), arrow, time.perf_counter() - began)


def run(scenario: Scenario, seed: int, progress: Callable[[float], None] | None = None) -> World:
    """Run the event kernel through a mission; return the world as it is at the end."""
    env = simpy.Environment()
    world = build_world(env, scenario, seed)
    env.process(serve(world.network))
    if progress is not None:
        for step in range(1, PROGRESS_STEPS):
            env.run(until=scenario.duration_s * step / PROGRESS_STEPS)
            progress(env.now)
    env.run(until=scenario.duration_s)
    world.network.close(scenario.duration_s)
    world.auv_fleet.reach(scenario.duration_s)
    return world
