"""What replays came to, as tables (the logs, their tracks, their sights and their beacons), and
what each column is.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from math import degrees, nan
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from ...core.records.events import column
from ...core.results.columns import arrow
from ...core.results.result_folder import CSV_DICTIONARY, columns, write_parquet
from .losses import Losses, losses_of
from .replaying import Replay, mean_nis, outlier_share, rms_between


@dataclass
class LogRow:
    """One log."""

    log: str = column("", "name of the log")
    rows: int = column("1", "instants of the odometry")
    distance_m: float = column("m", "way gone by the odometry")
    duration_s: float = column("s", "time from the first to the last instant")
    has_clock: bool = column("", "false where time is the distance at a nominal speed")
    ranges: int = column("1", "ranges")
    fixes: int = column("1", "fixes")
    receptions: int = column("1", "receptions of which it is known whether they were lost")
    lost_share: float = column("1", "share of these that were lost")
    burst_s: float = column("s", "mean time that losses last; null where they come one by one")
    longest_outage_s: float = column("s", "longest time in which receptions of a pair were lost")
    outage_chance: float = column("1", "how likely one as long is, were there but that mean")
    start_x_m: float = column("m", "x of the start")
    start_y_m: float = column("m", "y of the start")
    start_heading_deg: float = column("deg", "heading at the start, from x towards y")
    start_loss: float = column("1", "mean loss of a range with the start that was found")
    rival_loss: float = column("1", "the same with the best start elsewhere")
    range_sd_m: float = column("m", "standard deviation of a range that is no outlier")
    outlier_share: float = column("1", "share of outliers by the stated noise")
    outlier_sd_m: float = column("m", "standard deviation of their further error")
    random_walk_m_per_sqrt_s: float = column("m/sqrt(s)", "random walk of dead reckoning")
    filter_nis: float = column("1", "mean normalised innovation squared of what is no outlier")
    filter_outlier_share: float = column("1", "share of sights that the filter takes for outliers")
    smoother_outlier_share: float = column("1", "share that the smoother takes for outliers")
    filter_to_smoother_m: float = column("m", "RMS distance of the filter from the smoother")
    reckoned_to_reference_m: float = column(
        "m", "RMS distance of dead reckoning, from the same start, from GTSAM's robust optimum"
    )
    filter_to_reference_m: float = column("m", "RMS distance of the filter from it")
    smoother_to_reference_m: float = column("m", "RMS distance of the smoother from it")


@dataclass
class TrackRow:
    """One instant of a log."""

    log: str = column("", "name of the log")
    time_s: float = column("s", "time since the first instant")
    reckoned_x_m: float = column("m", "x by odometry alone, from the start")
    reckoned_y_m: float = column("m", "y by odometry alone")
    filter_x_m: float = column("m", "x by the filter, from the sights so far")
    filter_y_m: float = column("m", "y by the filter")
    filter_sd_x_m: float = column("m", "standard deviation of x")
    filter_sd_y_m: float = column("m", "standard deviation of y")
    filter_cov_xy_m2: float = column("m2", "covariance of the two")
    smoother_x_m: float = column("m", "x by the smoother, from all sights")
    smoother_y_m: float = column("m", "y by the smoother")
    smoother_sd_x_m: float = column("m", "standard deviation of x")
    smoother_sd_y_m: float = column("m", "standard deviation of y")
    smoother_cov_xy_m2: float = column("m2", "covariance of the two")
    reference_x_m: float = column("m", "x of GTSAM's robust optimum; no truth")
    reference_y_m: float = column("m", "y of it")
    reference_sd_m: float = column("m", "root of the trace of its covariance, by the log's noise")


@dataclass
class SightRow:
    """One range or fix of a log."""

    log: str = column("", "name of the log")
    time_s: float = column("s", "instant at which it holds")
    beacon: str = column("", "the beacon of a range; null for a fix")
    range_m: float = column("m", "the range measured; null for a fix")
    innovation_m: float = column(
        "m",
        "how much longer it was than the filter expected; of a fix how far off it was, along the "
        "axis of which it is surest",
    )
    nis: float = column("1", "its normalised square, if it is no outlier")
    inlier: float = column("1", "probability by the filter that it is no outlier")
    taken: bool = column("", "whether the filter took it in")
    residual_m: float = column("m", "how much longer it was than it is from where the smoother is")
    residual_inlier: float = column("1", "probability by the smoother that it is no outlier")


@dataclass
class BeaconRow:
    """A surveyed beacon of a recorded log, and the residuals of its ranges."""

    log: str = column("", "name of the log")
    beacon: str = column("", "name of the beacon")
    x_m: float = column("m", "surveyed x")
    y_m: float = column("m", "surveyed y")
    z_m: float = column("m", "surveyed depth")
    ranges: int = column("1", "ranges to it")
    residual_median_m: float = column("m", "median of their residuals by the smoother")
    residual_spread_m: float = column("m", "1.4826 x median absolute deviation of these residuals")


ROWS = {"logs": LogRow, "tracks": TrackRow, "sights": SightRow, "beacons": BeaconRow}


TYPES = {int: pa.int64(), float: pa.float64(), str: pa.string(), bool: pa.bool_()}
FRAME = "that of the log's beacons"
# 1.4826 times the median of absolute deviations is the standard deviation of Gaussian noise.
TO_SD = 1.4826
LOST_COLUMNS = ("lost_share", "burst_s", "longest_outage_s", "outage_chance")


def tables(replays: Sequence[Replay]) -> dict[str, pa.Table]:
    """Return the tables of replays by name, a column for each field of their rows."""
    made = {"logs": _log, "tracks": _track, "sights": _sights, "beacons": _beacons}
    return {
        name: pa.concat_tables([_table(ROWS[name], make(replay)) for replay in replays])
        for name, make in made.items()
    }


def objection(folder: Path) -> str | None:
    """Return why force must not replace a folder; None for an earlier replay, or an empty one."""
    found = list(folder.iterdir()) if folder.is_dir() else [folder]
    ours = {CSV_DICTIONARY, *(f"{name}.{end}" for name in ROWS for end in ("parquet", "csv"))}
    foreign = sorted(path.name for path in found if path.name not in ours and path.suffix != ".png")
    if folder.is_dir() and not foreign:
        return None
    return f"holds {foreign[0]}, which no replay wrote, so it is not replaced"


def write_tables(found: Mapping[str, pa.Table], folder: Path) -> None:
    """Write tables into a folder that is there, as Parquet and as CSV, and what columns mean."""
    from pyarrow import csv

    for name, table in found.items():
        write_parquet(table, f"replay.{name}", folder / f"{name}.parquet", {})
        csv.write_csv(table, folder / f"{name}.csv")
    csv.write_csv(columns(found), folder / CSV_DICTIONARY)


def _table(row: type, values: Mapping[str, Any]) -> pa.Table:
    described = [
        pa.field(
            field.name,
            TYPES[field.type],  # type: ignore[index]  # the stubs let it be a string
            metadata={"unit": field.metadata["unit"], "meaning": field.metadata["meaning"]}
            | ({"frame": FRAME} if field.name.endswith(("x_m", "y_m", "z_m")) else {}),
        )
        for field in fields(row)
    ]
    arrays = [arrow(values[field.name], field.type) for field in described]
    return pa.Table.from_arrays(arrays, schema=pa.schema(described))


def _log(replay: Replay) -> dict[str, Any]:
    log, start, noise = replay.log, replay.start, replay.noise
    reference = None if replay.reference is None else replay.reference.places
    own, later = replay.filter.at(log.times), replay.smoother.at(log.times)

    def apart(places: Any) -> float:
        return nan if reference is None else rms_between(places, reference)

    rival = nan if start is None else start.rival_loss
    row = {
        "log": log.name,
        "rows": len(log.times),
        "distance_m": log.distance,
        "duration_s": float(log.times[-1]),
        "has_clock": log.has_clock,
        "ranges": len(log.ranges.times),
        "fixes": len(log.fixes.times),
        **_lost(losses_of(log.receptions)),
        "start_x_m": float(log.places[0, 0]),
        "start_y_m": float(log.places[0, 1]),
        "start_heading_deg": degrees(log.yaws[0]),
        "start_loss": nan if start is None else start.loss,
        "rival_loss": rival if np.isfinite(rival) else nan,
        "range_sd_m": noise.range_sd if log.has_ranges else nan,
        "outlier_share": noise.outlier_share,
        "outlier_sd_m": noise.outlier_sd,
        "random_walk_m_per_sqrt_s": noise.random_walk,
        "filter_nis": mean_nis(replay.filter),
        "filter_outlier_share": outlier_share(replay.filter),
        "smoother_outlier_share": outlier_share(replay.smoother),
        "filter_to_smoother_m": rms_between(own, later),
        "reckoned_to_reference_m": apart(log.places),
        "filter_to_reference_m": apart(own),
        "smoother_to_reference_m": apart(later),
    }
    return {name: [value] for name, value in row.items()}


def _lost(losses: Losses | None) -> dict[str, Any]:
    """Return the columns of receptions."""
    if losses is None:
        return {"receptions": 0, **dict.fromkeys(LOST_COLUMNS, nan)}
    burst_s = nan if losses.burst_s is None else losses.burst_s
    longest = losses.longest
    outage = (nan, nan) if longest is None else (longest.lasted_s, longest.chance)
    values = (losses.share, burst_s, *outage)
    return {"receptions": losses.receptions, **dict(zip(LOST_COLUMNS, values, strict=True))}


def _track(replay: Replay) -> dict[str, Any]:
    log, reference = replay.log, replay.reference
    out: dict[str, Any] = {"log": [log.name] * len(log.times), "time_s": log.times}
    out["reckoned_x_m"], out["reckoned_y_m"] = log.places.T
    for name, track in (("filter", replay.filter), ("smoother", replay.smoother)):
        rows = np.searchsorted(track.times, log.times)
        out[f"{name}_x_m"], out[f"{name}_y_m"] = track.places[rows].T
        xx, yy, xy = track.covariances[rows].T
        # what is known may round below 0
        sds = (np.sqrt(np.maximum(variance, 0.0)) for variance in (xx, yy))
        out[f"{name}_sd_x_m"], out[f"{name}_sd_y_m"] = sds
        out[f"{name}_cov_xy_m2"] = xy
    nothing = np.full(len(log.times), nan)
    places = np.column_stack((nothing, nothing)) if reference is None else reference.places
    out["reference_x_m"], out["reference_y_m"] = places.T
    out["reference_sd_m"] = nothing if reference is None else reference.sds
    return out


def _sights(replay: Replay) -> dict[str, Any]:
    log, seen, later = replay.log, replay.filter.seen, replay.smoother.seen
    names, metres = _sighted(replay)
    times = np.sort(np.concatenate((log.ranges.times, log.fixes.times)), kind="stable")
    return {
        "log": [log.name] * len(seen),
        "time_s": times,
        "beacon": names,
        "range_m": metres,
        "innovation_m": seen["off_m"],
        "nis": seen["nis"],
        "inlier": seen["inlier"],
        "taken": seen["taken"],
        "residual_m": later["off_m"],
        "residual_inlier": later["inlier"],
    }


def _sighted(replay: Replay) -> tuple[list[str | None], Any]:
    """Return the beacon and the range (m) of each sight, in the order in which they were seen."""
    ranges, fixes = replay.log.ranges, len(replay.log.fixes.times)
    order = np.argsort(np.concatenate((ranges.times, replay.log.fixes.times)), kind="stable")
    names = [replay.log.beacons.names[number] for number in ranges.beacons] + [None] * fixes
    metres = np.concatenate((ranges.metres, np.full(fixes, nan)))
    return [names[k] for k in order], metres[order]


def _beacons(replay: Replay) -> dict[str, Any]:
    log = replay.log
    residuals, names = replay.smoother.seen["off_m"], np.array(_sighted(replay)[0], dtype=object)
    off = [residuals[names == name] for name in log.beacons.names]
    middle = [float(np.median(own)) if len(own) else nan for own in off]
    spread = [
        TO_SD * float(np.median(np.abs(own - at))) if len(own) else nan
        for own, at in zip(off, middle, strict=True)
    ]
    x, y, z = log.beacons.places.T
    return {
        "log": [log.name] * len(off),
        "beacon": list(log.beacons.names),
        "x_m": x,
        "y_m": y,
        "z_m": z,
        "ranges": [len(own) for own in off],
        "residual_median_m": middle,
        "residual_spread_m": spread,
    }
