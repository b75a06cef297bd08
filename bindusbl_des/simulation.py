"""Run one mission: scenario in, tables out."""

import time
from collections.abc import Callable

import numpy as np
import pyarrow as pa
import simpy

from .metrics import auv_metrics, mission_metrics, utilisation
from .protocol import serve
from .result import Result
from .samples import instants, sample
from .scenario import Scenario
from .tables import from_columns, from_numbers, from_rows
from .world import World, build_world

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
    env.process(serve(world))
    if progress is not None:
        for step in range(1, PROGRESS_STEPS):
            env.run(until=scenario.duration_s * step / PROGRESS_STEPS)
            progress(env.now)
    env.run(until=scenario.duration_s)
    world.uplink.close(scenario.duration_s)
    world.board.take()  # fixes of pings that were heard but not broadcast any more
    world.auv_fleet.reach(scenario.duration_s)
    return world


def event_tables(world: World) -> dict[str, pa.Table]:
    """Return the event tables of a finished mission."""
    record = world.record
    return {
        "rounds": from_rows("rounds", record.rounds),
        "pings": from_numbers("pings", record.pings.rows),
        "receptions": from_numbers("receptions", record.receptions.rows),
        "broadcasts": from_rows("broadcasts", record.broadcasts),
        "fixes": from_rows("fixes", record.fixes),
        "tracks": tracks_table(world),
    }


def tracks_table(world: World) -> pa.Table:
    """Return the tracks of all vehicles at record.tracks_hz, ASVs after AUVs."""
    scenario = world.scenario
    times = instants(scenario.duration_s, scenario.record.tracks_hz)
    parts = []
    for auv in world.auvs:
        samples = sample(auv, times)
        path_error = auv.vehicle.path_error(times)
        parts.append(
            {
                **_truth(auv.name, times, samples.truth),
                "estimate_x_m": samples.truth[:, 0] + samples.error[:, 0],
                "estimate_y_m": samples.truth[:, 1] + samples.error[:, 1],
                "estimate_z_m": samples.truth[:, 2] + world.depth_noise(auv.index, times),
                "imu_x_m": samples.truth[:, 0] + samples.drift[:, 0],
                "imu_y_m": samples.truth[:, 1] + samples.drift[:, 1],
                "position_error_m": samples.position_error,
                "cross_track_error_m": samples.cross_track_error,
                "path_error_m": path_error if len(path_error) else [None] * len(times),
            }
        )
    for index, vessel in enumerate(world.asv_fleet.vehicles):
        off_station = vessel.path_error(times)
        truth = _truth(f"ASV{index}", times, vessel.sample(times))
        parts.append({**truth, "path_error_m": off_station})
    return pa.concat_tables([from_columns("tracks", part) for part in parts])


def _truth(name: str, times: np.ndarray, truth: np.ndarray) -> dict[str, object]:
    x, y, z, yaw = truth.T
    wrapped = np.pi - np.mod(np.pi - yaw, 2 * np.pi)
    return {
        "time_s": times, "vehicle": [name] * len(times), "x_m": x, "y_m": y, "z_m": z,
        "yaw_rad": wrapped,
    }  # fmt: skip
