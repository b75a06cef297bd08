"""The event tables of a finished mission: what happened, and where everybody was meanwhile."""

from dataclasses import fields

import numpy as np
import pyarrow as pa

from ..acoustics.channel import Receiver
from ..protocol.fix_queue import FixBatch
from ..records.events import TrackPoint
from ..records.recorder import Recorder
from ..results.tables import from_numbers, from_rows
from .launch import Array
from .samples import instants, sample, turned
from .world import World


def event_tables(world: World) -> dict[str, pa.Table]:
    """Return the event tables of a finished mission."""
    record = world.record
    return {
        "rounds": from_rows("rounds", record.rounds),
        "pings": from_numbers("pings", record.pings.rows),
        "receptions": _receptions_table(record, world.network.uplink.receiver),
        "broadcasts": from_rows("broadcasts", record.broadcasts),
        "frame_receptions": from_numbers("frame_receptions", record.frame_receptions.rows),
        "assignments": from_rows("assignments", record.assignments),
        "fixes": _fixes_table(record, len(world.asv_fleet)),
        "tracks": _tracks_table(world),
    }


def _receptions_table(record: Recorder, receiver: Receiver) -> pa.Table:
    rows = record.receptions.rows
    columns = {name: rows[name] for name in rows.dtype.names or ()}
    return from_numbers("receptions", columns | receiver.levels(rows["snr_db"]))


def _fixes_table(record: Recorder, asvs: int) -> pa.Table:
    rows = record.fixes.rows
    hearers = FixBatch(record, range(len(rows))).hearers(asvs)
    number: dict[bytes, int] = {}
    fused = np.array([number.setdefault(own.tobytes(), len(number)) for own in hearers], dtype=int)
    together = [np.flatnonzero(np.frombuffer(own, dtype=np.bool_)) for own in number]
    names = [" ".join([f"ASV{asv}" for asv in own]) for own in together]
    columns = {name: rows[name] for name in rows.dtype.names or ()}
    return from_numbers("fixes", {**columns, "asvs": fused}, asvs=names)


def _tracks_table(world: World) -> pa.Table:
    """Return the tracks of all vehicles at record.tracks_hz, ASVs after AUVs."""
    times = instants(world.scenario.duration_s, world.scenario.record.tracks_hz)
    auvs, asvs = world.auv_fleet.vehicles, world.asv_fleet.vehicles
    shape = len(auvs) + len(asvs), len(times)
    columns: dict[str, Array] = {it.name: np.full(shape, np.nan) for it in fields(TrackPoint)}
    columns["time_s"][:] = times

    def note(vehicle: int, **values: Array) -> None:
        for name, its_own in values.items():
            columns[name][vehicle] = its_own

    for number, vehicle in enumerate((*auvs, *asvs)):
        off_path = vehicle.path_error(times)
        if len(off_path):
            note(number, path_error_m=off_path)
    for number, vessel in enumerate(asvs, len(auvs)):
        note(number, **_pose(vessel.sample(times)))
    for auv in range(len(auvs)):
        if world.swept is not None:
            note(auv, swept_m2=world.swept.area(times, auv))
        samples = sample(world, auv, times)
        xx, yy, xy = world.navigator.covariance(auv, samples.odometry).T
        note(
            auv,
            **_pose(samples.truth),
            estimate_x_m=samples.estimate[:, 0],
            estimate_y_m=samples.estimate[:, 1],
            estimate_z_m=samples.truth[:, 2] + world.depth_noise(auv, times),
            imu_x_m=samples.odometry.position[:, 0],
            imu_y_m=samples.odometry.position[:, 1],
            position_error_m=samples.position_error,
            cross_track_error_m=samples.cross_track_error,
            estimate_sd_x_m=np.sqrt(np.maximum(xx, 0.0)),
            estimate_sd_y_m=np.sqrt(np.maximum(yy, 0.0)),
            estimate_cov_xy_m2=xy,
        )
    vehicles = [f"AUV{auv}" for auv in range(len(auvs))] + [f"ASV{asv}" for asv in range(len(asvs))]
    numbers = np.arange(len(vehicles)).repeat(len(times))
    flat = {name: values.ravel() for name, values in columns.items()}
    return from_numbers("tracks", {**flat, "vehicle": numbers}, vehicle=vehicles)


def _pose(truth: Array) -> dict[str, Array]:
    x, y, z, yaw = truth.T
    return {"x_m": x, "y_m": y, "z_m": z, "yaw_rad": turned(yaw)}
