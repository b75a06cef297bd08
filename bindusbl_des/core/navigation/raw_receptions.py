"""Receptions for a user-defined navigator that wants no fused fixes: a row for each ASV that has
heard a ping, with its measurements and its own position.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from ...support.arrays import Floats
from ..records.events import HEARD
from ..records.rows import NONE, Row, Rows

# Columns, NONE or NaN where there is nothing: numbers of vehicles and pings; instants (s); the
# range, and the path of call and answer (m); the direction (deg), as of receptions; the AUV's
# position by this vessel alone (m) with its covariance (m2); the vessel's own position (m), its
# standard deviation (m), the caller's position (m), the vessel's velocity (m/s) and the range rate
# (m/s); levels (dB).
WHOLE = ("ping", "auv", "asv", "broadcast_by")
COVARIANCE = ("cov_xx_m2", "cov_yy_m2", "cov_zz_m2", "cov_xy_m2", "cov_xz_m2", "cov_yz_m2")
NUMBERS = (
    *("pinged_at_s", "arrived_at_s", "valid_at_s", "delivered_at_s"),
    *("range_m", "range_sd_m", "path_m"),
    *("azimuth_deg", "elevation_deg", "body_azimuth_deg", "body_elevation_deg"),
    *("x_m", "y_m", "z_m", *COVARIANCE),
    *("vessel_x_m", "vessel_y_m", "vessel_z_m", "vessel_sd_m"),
    *("caller_x_m", "caller_y_m", "caller_z_m"),
    *("range_rate_m_per_s", "vessel_x_m_per_s", "vessel_y_m_per_s", "vessel_z_m_per_s"),
    *("snr_db", "level_db", "margin_db"),
)
RAW = np.dtype([*((name, "i8") for name in WHOLE), *((name, "f8") for name in NUMBERS)])

# Columns with the same name in receptions, and others with theirs
SAME = (
    *("arrived_at_s", "azimuth_deg", "elevation_deg", "body_azimuth_deg", "body_elevation_deg"),
    *("range_rate_m_per_s", "ping", "asv"),
)
OF_VESSEL = {
    **{f"vessel_{axis}_m": f"from_{axis}_m" for axis in "xyz"},
    **{f"vessel_{axis}_m_per_s": f"own_{axis}_m_per_s" for axis in "xyz"},
}

Levels = Callable[[Any], dict[str, Any]]


def raw(fix: Row, receptions: Rows, levels: Levels) -> Any:
    """Return the measurements of a fix's ping, a record array (k,), :data:`RAW`; of a GNSS fix its
    position alone, in one row.

    `levels` as of :meth:`..acoustics.channel.Receiver.levels`.
    """
    heard = receptions[fix["first"] : fix["end"]] if fix["first"] != NONE else receptions[:0]
    heard = heard[heard["outcome"] == HEARD]
    told = np.recarray(max(len(heard), 1), RAW)
    for name in WHOLE:
        told[name] = NONE
    for name in NUMBERS:
        told[name] = np.nan
    for name in ("auv", "broadcast_by", "pinged_at_s", "valid_at_s", "delivered_at_s"):
        told[name] = fix[name]
    if not len(heard):
        told["x_m"], told["y_m"] = fix["x_m"], fix["y_m"]
        told["cov_xx_m2"], told["cov_yy_m2"] = fix["sd_x_m"] ** 2, fix["sd_y_m"] ** 2
        told["cov_xy_m2"] = fix["cov_xy_m2"]
        return told
    for name in SAME:
        told[name] = heard[name]
    for name, values in levels(heard["snr_db"]).items():
        told[name] = values
    for name, its_own in OF_VESSEL.items():
        told[name] = np.where(np.isnan(heard["from_x_m"]), np.nan, heard[its_own])
    for axis in "xyz":
        told[f"vessel_{axis}_m_per_s"][np.isnan(heard["range_rate_m_per_s"])] = np.nan
    _note_places(told, heard)
    return told


def _note_places(told: Any, heard: Rows) -> None:
    """Write ranges and positions to `told` (k,), RAW, where `heard` (k,) have measurements."""
    for k in np.flatnonzero(~np.isnan(heard["range_m2"]) & ~np.isnan(heard["from_x_m"])):
        line, row = heard[k], told[k]
        here = np.array([line[f"from_{axis}_m"] for axis in "xyz"])
        ahead = np.array([line[f"ahead_{axis}_m"] for axis in "xyz"])
        row.path_m, row.vessel_sd_m = np.linalg.norm(ahead), np.sqrt(line["from_m2"])
        share = 1.0
        if not np.isnan(line["caller_x_m"]):
            row.caller_x_m, row.caller_y_m, row.caller_z_m = [
                line[f"caller_{axis}_m"] for axis in "xyz"
            ]
            share = 0.5 if line["is_caller"] > 0.0 else np.nan
        row.range_m, row.range_sd_m = share * row.path_m, share * np.sqrt(line["range_m2"])
        row.x_m, row.y_m, row.z_m = here + share * ahead
        spread = _covariance(line, share * ahead, row.range_sd_m**2)
        corners = (0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)
        for name, corner in zip(COVARIANCE, corners, strict=True):
            row[name] = spread[corner]


def _covariance(line: Row, ahead: Floats, range_m2: float) -> Floats:
    """Return the covariance (3, 3), m2, of a position at the offset `ahead` (3,), m, from a vessel,
    whose range has the variance `range_m2`.
    """
    reach = max(float(np.linalg.norm(ahead)), 1e-9)
    along = ahead / reach
    level = float(np.hypot(along[0], along[1]))
    east = np.array((-along[1], along[0], 0.0)) / level if level > 1e-9 else np.array((0, 1.0, 0))
    across = np.column_stack((east, np.cross(along, east)))
    turned = line["level_rad2"] + line["turn_rad2"] * level**2, line["both_rad2"]
    angles = np.array((turned, (line["both_rad2"], line["steep_rad2"])))
    spread = range_m2 * np.outer(along, along) + reach**2 * across @ angles @ across.T
    return np.asarray(spread + line["from_m2"] * np.eye(3))
