"""The event tables of a finished mission: what happened, and where everybody was meanwhile."""

import numpy as np
import pyarrow as pa

from ..protocol.fix_queue import FixBatch
from ..records.columns import (
    CROSS_TRACK_ERROR,
    DEPTH,
    ESTIMATE,
    ESTIMATE_SPREAD,
    FUSED,
    IMU,
    PATH_ERROR,
    POSITION_ERROR,
    TIME,
    TRACK_COLUMNS,
    TRUTH,
    VEHICLE,
    YAW,
)
from ..records.recorder import Recorder
from ..results.tables import from_numbers, from_rows
from .samples import instants, sample, turned
from .world import World


def event_tables(world: World) -> dict[str, pa.Table]:
    """Return the event tables of a finished mission."""
    record = world.record
    return {
        "rounds": from_rows("rounds", record.rounds),
        "pings": from_numbers("pings", record.pings.rows[:, : record.pings.told]),
        "receptions": from_numbers("receptions", record.receptions.rows),
        "broadcasts": from_rows("broadcasts", record.broadcasts),
        "fixes": _fixes_table(record, len(world.asv_fleet)),
        "tracks": _tracks_table(world),
    }


def _fixes_table(record: Recorder, asvs: int) -> pa.Table:
    rows = record.fixes.rows[:, : record.fixes.told].copy()
    hearers = FixBatch(record, range(len(rows))).hearers(asvs)
    number: dict[bytes, int] = {}
    rows[:, FUSED] = [number.setdefault(own.tobytes(), len(number)) for own in hearers]
    together = [np.flatnonzero(np.frombuffer(own, dtype=np.bool_)) for own in number]
    names = [" ".join([f"ASV{asv}" for asv in own]) for own in together]
    return from_numbers("fixes", rows, asvs=names)


def _tracks_table(world: World) -> pa.Table:
    """Return the tracks of all vehicles at record.tracks_hz, ASVs after AUVs."""
    times = instants(world.scenario.duration_s, world.scenario.record.tracks_hz)
    auvs, asvs = world.auv_fleet.vehicles, world.asv_fleet.vehicles
    columns = np.full((TRACK_COLUMNS, len(auvs) + len(asvs), len(times)), np.nan)
    rows = columns.transpose(1, 2, 0)
    rows[:, :, TIME] = times
    rows[:, :, VEHICLE] = np.arange(len(rows))[:, None]
    for vehicle, track in zip((*auvs, *asvs), rows, strict=True):
        off_path = vehicle.path_error(times)
        if len(off_path):
            track[:, PATH_ERROR] = off_path
    for vessel, track in zip(asvs, rows[len(auvs) :], strict=True):
        track[:, TRUTH : YAW + 1] = vessel.sample(times)
    for auv, track in enumerate(rows[: len(auvs)]):
        samples = sample(world, auv, times)
        track[:, TRUTH : YAW + 1] = truth = samples.truth
        track[:, ESTIMATE:DEPTH] = samples.estimate
        track[:, DEPTH] = truth[:, 2] + world.depth_noise(auv, times)
        track[:, IMU : IMU + 2] = samples.odometry.position
        track[:, POSITION_ERROR] = samples.position_error
        track[:, CROSS_TRACK_ERROR] = samples.cross_track_error
        xx, yy, xy = world.navigator.covariance(auv, samples.odometry).T
        spread = np.sqrt(np.maximum(xx, 0.0)), np.sqrt(np.maximum(yy, 0.0)), xy
        track[:, ESTIMATE_SPREAD : ESTIMATE_SPREAD + 3] = np.stack(spread, axis=1)
    rows[:, :, YAW] = turned(rows[:, :, YAW])
    names = [f"AUV{auv}" for auv in range(len(auvs))] + [f"ASV{asv}" for asv in range(len(asvs))]
    return from_numbers("tracks", columns.reshape(TRACK_COLUMNS, -1).T, vehicle=names)
