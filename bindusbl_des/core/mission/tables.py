"""The event tables of a finished mission, its tracks, and violations of its schedule."""

from collections.abc import Iterator
from functools import lru_cache
from math import hypot, nan, pi, sqrt

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from ...support.arrays import Floats
from ...support.compiled import compiled, inlined
from ..protocol.network import hearers
from ..records.events import (
    BLOCKED,
    DOPPLER,
    FAILED,
    FAILED_MEANWHILE,
    NONE,
    OUT_OF_RANGE,
    UNANSWERED,
    WORDS,
    TrackPoint,
)
from ..records.rows import Recorder, Row, Rows, row_type
from ..results.columns import arrow
from ..results.schemas import schema
from ..results.tables import from_numbers, from_rows
from ..results.violations import Violation, Violations
from .metrics import calls_destroyed, destroyed, frames_destroyed
from .sensor_errors import lasting_errors, pressure_errors
from .trajectories import beside, instants
from .world import World

# Reasons of receptions without a loss probability in their table
NO_CHANCE = (OUT_OF_RANGE, BLOCKED, FAILED, FAILED_MEANWHILE, UNANSWERED, DOPPLER)

TRACK_POINT = row_type(TrackPoint)

# A vehicle's own sounds that drown what it hears, by the reason on record
OWN = {
    "own_ping": "a ping of its own",
    "own_frame": "a frame of its own",
    "own_packet": "data of its own",
}


def event_tables(world: World) -> dict[str, pa.Table]:
    """Return the event tables of a finished mission; none with `record.detail: summary`."""
    scenario, record = world.setup.scenario, world.record
    if scenario.record.detail == "summary":
        return {}
    pings, frames = record.pings.rows, _with_land(world, record.frame_receptions.rows)
    if world.setup.frame_channel is None:  # the disc, which land has asked as well
        frames["loss_probability"] = nan
    tables = {
        "rounds": from_rows("rounds", record.rounds),
        "pings": from_numbers("pings", _with_land(world, pings, "call", "call_why")),
        "receptions": _receptions_table(world),
        "broadcasts": from_numbers("broadcasts", world.broadcasts),
        "frame_receptions": from_numbers("frame_receptions", frames),
        "assignments": from_rows("assignments", record.assignments),
        "fixes": _fixes_table(record, len(world.asv_fleet), scenario.protocol.exchanges),
    }
    if scenario.navigation.gnss_fix is not None:
        rows = record.gnss_fixes.rows
        named = {"gnss_fix": "fix", "fixed_at_s": "delivered_at_s", "sd_m": "sd_x_m"}
        columns = {name: rows[own] for name, own in named.items()}
        tables["gnss_fixes"] = from_numbers("gnss_fixes", rows, columns)
    if scenario.has_signals:
        tables["signals"] = from_rows("signals", record.signals)
        heard = record.signal_receptions.rows
        tables["signal_receptions"] = _heard_by(world, "signal_receptions", heard)
    if scenario.traffic is not None:
        tables["packets"] = from_rows("packets", record.packets)
    if scenario.protocol.sends_auv_frames:
        tables["auv_frames"] = from_rows("auv_frames", record.auv_frames)
        met = record.auv_frame_receptions
        tables["auv_frame_receptions"] = _heard_by(world, "auv_frame_receptions", met)
    if scenario.has_peers:
        tables["peer_ranges"] = from_rows("peer_ranges", record.peer_ranges)
    if scenario.modems is not None:
        tables["modem_lines"] = from_rows("modem_lines", record.modem_lines)
    return {**tables, "tracks": from_numbers("tracks", track_points(world), words=_names(world))}


def _receptions_table(world: World) -> pa.Table:
    """Return the table of receptions, with levels and systematic errors."""
    record, network = world.record, world.network
    rows = record.receptions.rows
    levels = network.uplink.receiver.levels(rows["snr_db"])
    errors = lasting_errors(world.setup, network.outcomes.systematic, rows, record.pings.rows)
    chance = np.where(np.isin(rows["why"], NO_CHANCE), np.nan, rows["loss"])
    told = {**levels, **errors, "loss_probability": chance}
    unanswered = rows["why"] == UNANSWERED  # whose outcome is that of the call
    unanswered &= record.pings.rows["call_why"][rows["ping"]] == BLOCKED
    return from_numbers("receptions", _with_land(world, rows, also=unanswered), told)


def _with_land(
    world: World, rows: Rows, outcome: str = "outcome", why: str = "why",
    also: NDArray[np.bool_] | None = None,
) -> Rows:  # fmt: skip
    """Return rows in which what land kept away, or is blocked `also` (n,), is told from what was
    too far; to the mission both are out of range.  It had no chance that could be told.
    """
    if world.setup.land is None:
        return rows
    rows, blocked = rows.copy(), rows[why] == BLOCKED
    rows[outcome][blocked] = BLOCKED
    if "loss_probability" in (rows.dtype.names or ()):
        rows["loss_probability"][blocked] = nan
    if also is not None:
        rows[outcome][also] = BLOCKED
    return rows


def _fixes_table(record: Recorder, asvs: int, exchanges: bool) -> pa.Table:
    rows = record.fixes.rows
    heard = np.zeros((len(rows), max(-(-asvs // 64), 1) * 64), dtype=np.bool_)
    heard[:, :asvs] = hearers(record, range(len(rows)), asvs)
    packed = np.packbits(heard, axis=1)
    together = np.uint64 if asvs <= 64 else f"V{packed.shape[1]}"  # which is slower to compare
    groups, group = np.unique(packed.view(together)[:, 0], return_inverse=True)
    names = [_together(own.tobytes()) for own in groups]
    table = from_numbers("fixes", rows, {"asvs": len(WORDS) + group}, (*WORDS, *names))
    for field in list(schema("fixes", None))[table.num_columns :] if exchanges else ():
        values = [getattr(service, field.name) for service in record.services]
        table = table.append_column(field, arrow(values, field.type))
    return table


def _heard_by(world: World, table: str, rows: Rows) -> pa.Table:
    """Return a table of receptions at any vehicle, with its name."""
    whose = {"listener": len(WORDS) + rows["vehicle"]}
    return from_numbers(table, _with_land(world, rows), whose, (*WORDS, *_names(world)))


def _names(world: World) -> list[str]:
    """Return the names of all vehicles, AUVs first."""
    auvs, asvs = range(len(world.auv_fleet)), range(len(world.asv_fleet))
    return [*(f"AUV{auv}" for auv in auvs), *(f"ASV{asv}" for asv in asvs)]


@lru_cache(maxsize=1024)
def _together(packed: bytes) -> str:
    """Return the names of ASVs whose bits are set."""
    bits = np.unpackbits(np.frombuffer(packed, dtype=np.uint8))
    return " ".join([f"ASV{asv}" for asv in np.flatnonzero(bits)])


def track_points(world: World) -> Rows:
    """Return the tracks of all vehicles at record.tracks_hz, AUVs first, vehicle by vehicle, (n,)
    :data:`TRACK_POINT`.
    """
    times = instants(world.setup.scenario.duration_s, world.setup.scenario.record.tracks_hz)
    auvs, asvs, ways = world.auv_fleet, world.asv_fleet, world.trajectories
    tracks = np.empty((len(auvs) + len(asvs), len(times)), dtype=TRACK_POINT)
    tracks["vehicle"] = np.arange(len(tracks))[:, np.newaxis]
    for auv in range(len(auvs)):
        points = tracks[auv]
        points["path_error_m"], points["swept_m2"] = ways.beside_m[auv], ways.swept_m2[auv]
        points["altitude_m"] = ways.altitude_m[auv]
        found = world.sample(auv, times)
        sure = world.navigator.covariance(auv, found.odometry)
        depth_error = pressure_errors(world.setup, world.streams, auv, times)
        _note_points(points, *found.way, found.odometry.position, found.estimate, sure, depth_error)
    off_station = beside(asvs.vehicles, times)
    for asv in range(len(asvs)):
        points = tracks[len(auvs) + asv]
        points["path_error_m"], points["swept_m2"] = off_station[asv], nan
        points["altitude_m"] = nan
        _note_truth(points, *asvs.ways.of(asv, times))
    return tracks.reshape(-1)


@compiled
def _note_points(
    points: Rows, times: Floats, lines: Floats, reckoned: Floats, estimate: Floats, sure: Floats,
    depth_error: Floats,
) -> None:  # fmt: skip
    """Write an AUV's true motion (:class:`..vehicles.fleet.VehicleTrack`) and its estimates.

    `reckoned` and `estimate` (n, 2), m; covariances `sure`: xx, yy, xy (n, 3), m2.
    """
    for k in range(times.size):
        point = points[k]
        _place(point, times[k], lines, k)
        point.estimate_x_m, point.estimate_y_m = estimate[k, 0], estimate[k, 1]
        point.estimate_z_m = lines[k, 2] + depth_error[k]
        point.imu_x_m, point.imu_y_m = reckoned[k, 0], reckoned[k, 1]
        x, y = estimate[k, 0] - lines[k, 0], estimate[k, 1] - lines[k, 1]
        point.position_error_m = hypot(x, y)
        point.cross_track_error_m = lines[k, 6] * y - lines[k, 7] * x
        point.estimate_sd_x_m = sqrt(max(sure[k, 0], 0.0))
        point.estimate_sd_y_m = sqrt(max(sure[k, 1], 0.0))
        point.estimate_cov_xy_m2 = sure[k, 2]


@compiled
def _note_truth(points: Rows, times: Floats, lines: Floats) -> None:
    """Write an ASV's true motion; it estimates nothing."""
    for k in range(times.size):
        point = points[k]
        _place(point, times[k], lines, k)
        point.estimate_x_m = point.estimate_y_m = point.estimate_z_m = nan
        point.imu_x_m = point.imu_y_m = nan
        point.position_error_m = point.cross_track_error_m = nan
        point.estimate_sd_x_m = point.estimate_sd_y_m = point.estimate_cov_xy_m2 = nan


@inlined
def _place(point: Row, time: float, lines: Floats, k: int) -> None:
    """Write the instant and the true pose in line k of a motion, yaw in (-pi, pi]."""
    point.time_s = time
    point.x_m, point.y_m, point.z_m = lines[k, 0], lines[k, 1], lines[k, 2]
    turned = pi - lines[k, 3]
    if not 0.0 <= turned < 2 * pi:
        turned %= 2 * pi
    point.yaw_rad = pi - turned


def violations_of(world: World) -> Violations | None:
    """Return the violations of a mission's schedule; None with random access, which has none.

    They are receptions of pings, calls and frames destroyed by other signals, which the metrics
    `collisions` and `frame_collisions` count.
    """
    if world.setup.scenario.protocol.random_access:
        return None
    record = world.record
    heard, calls, frames = destroyed(record), calls_destroyed(record), frames_destroyed(record)
    count = len(heard) + len(calls) + len(frames)
    firsts = [*_ping(world, heard), *_call(world, calls), *_frame(world, frames)]
    return Violations(count, min(firsts, key=lambda violation: violation.at_s, default=None))


def _ping(world: World, receptions: Rows) -> Iterator[Violation]:
    """Yield the violation by the destroyed ping that arrived first."""
    if not len(receptions):
        return
    reception = receptions[np.argmin(receptions["arrived_at_s"])]
    ping = world.record.pings.rows[reception["ping"]]
    passive = world.setup.scenario.protocol.asvs_ping
    sender, receiver = f"AUV{ping['auv']}", f"ASV{reception['asv']}"
    if passive:
        sender, receiver = f"ASV{ping['asv']}", f"AUV{reception['auv']}"
    others = tuple(_strongest(world, reception))
    yield Violation(
        "ping", float(reception["arrived_at_s"]), sender, receiver, int(ping["round"]),
        int(ping["slot"]), others,
    )  # fmt: skip


def _strongest(world: World, line: Row) -> Iterator[str]:
    """Yield the sender, in words, of the strongest signal that destroyed a ping or frame."""
    why, by = WORDS[line["why"]], int(line["overlapped_by"])
    if why in OWN:
        yield OWN[why]
    elif why == "ping":
        ping = world.record.pings.rows[by]
        yield f"that of AUV{ping['auv']}" if ping["asv"] == NONE else f"that of ASV{ping['asv']}"
    elif why == "frame":
        yield f"that of ASV{world.record.broadcasts[by].asv}"
    elif why == "packet":
        yield f"data of AUV{world.record.packets[by].auv}"
    elif why == "auv_frame":
        yield f"that of AUV{world.record.auv_frames[by].auv}"
    elif why == "call":
        yield f"a call of ASV{by}"


def _call(world: World, destroyed: Rows) -> Iterator[Violation]:
    """Yield the violation by the first call that was destroyed at its AUV; rows are its pings."""
    if not len(destroyed):
        return
    pings = world.record.pings.rows
    call = destroyed[np.argmin(destroyed["called_at_s"])]
    same = (pings["called_at_s"] == call["called_at_s"]) & (pings["called_by"] != call["called_by"])
    others = tuple(f"that of ASV{asv}" for asv in np.unique(pings["called_by"][same]))
    if (why := WORDS[call["call_why"]]) != "call":
        others = (OWN.get(why, f"a {why.removeprefix('own_')}"),)
    yield Violation(
        "call", float(call["called_at_s"]), f"ASV{call['called_by']}", f"AUV{call['auv']}",
        int(call["round"]), int(call["slot"]), others,
    )  # fmt: skip


def _frame(world: World, frames: Rows) -> Iterator[Violation]:
    """Yield the violation by the first frame that was destroyed at an AUV."""
    if not len(frames):
        return
    frame = frames[np.argmin(frames["broadcast"])]
    sent = world.record.broadcasts[int(frame["broadcast"])]
    yield Violation(
        "frame", sent.sent_at_s, f"ASV{sent.asv}", f"AUV{frame['auv']}", sent.round, None,
        tuple(_strongest(world, frame)),
    )  # fmt: skip
