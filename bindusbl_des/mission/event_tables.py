"""The event tables of a finished mission: what happened, and where everybody was meanwhile."""

import numpy as np
import pyarrow as pa

from ..acoustics.channel import Receiver
from ..protocol.fix_queue import FixBatch
from ..records.events import OUTCOMES, TrackPoint
from ..records.recorder import Recorder
from ..records.rows import row_type
from ..results.tables import from_numbers, from_rows
from .launch import Array
from .samples import instants, sample, turned
from .world import World

# What tables have beside the buffers of a mission: how loud receptions were, whose measurements
# were fused; and where a vehicle was
LEVELS = np.dtype([("level_db", "f8"), ("margin_db", "f8")])
FUSED = np.dtype([("asvs", "i8")])
TRACK_POINT = row_type(TrackPoint)


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
    told, levels = receiver.levels(rows["snr_db"]), np.empty(len(rows), dtype=LEVELS)
    for name in LEVELS.names or ():
        levels[name] = told[name]
    return from_numbers("receptions", rows, levels)


def _fixes_table(record: Recorder, asvs: int) -> pa.Table:
    rows = record.fixes.rows
    hearers = np.packbits(FixBatch(record, range(len(rows))).hearers(asvs), axis=1)
    groups, group = np.unique(hearers.view(f"V{hearers.shape[1]}")[:, 0], return_inverse=True)
    fused = np.empty(len(rows), dtype=FUSED)
    fused["asvs"] = len(OUTCOMES) + group
    together = np.unpackbits(groups.view(np.uint8).reshape(-1, hearers.shape[1]), axis=1)
    names = [" ".join([f"ASV{asv}" for asv in np.flatnonzero(own)]) for own in together]
    return from_numbers("fixes", rows, fused, words=(*OUTCOMES, *names))


def _tracks_table(world: World) -> pa.Table:
    """Return the tracks of all vehicles at record.tracks_hz, ASVs after AUVs."""
    times = instants(world.scenario.duration_s, world.scenario.record.tracks_hz)
    auvs, asvs = world.auv_fleet.vehicles, world.asv_fleet.vehicles
    shape = len(auvs) + len(asvs), len(times)
    points = np.full(shape, np.array((np.nan,) * 18, dtype=TRACK_POINT) if False else 0, dtype=TRACK_POINT)
    for name in TRACK_POINT.names or ():
        if name != "vehicle": points[name] = np.nan
    points["time_s"], points["vehicle"] = times, np.arange(shape[0])[:, np.newaxis]

    def note(vehicle: int, **values: Array) -> None:
        for name, its_own in values.items():
            points[name][vehicle] = its_own

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
    return from_numbers("tracks", points.ravel(), words=tuple(vehicles))


def _pose(truth: Array) -> dict[str, Array]:
    x, y, z, yaw = truth.T
    return {"x_m": x, "y_m": y, "z_m": z, "yaw_rad": turned(yaw)}
