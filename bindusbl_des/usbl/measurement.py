"""What the ASVs that heard a ping make of it together: one fix, and how sure they are of it."""

from math import hypot, isnan, sqrt

import numpy as np

from ..core.compiled import compiled
from ..records.events import HEARD
from ..records.rows import Row
from ..vehicles.motion import Floats, Motion, where
from .fusion import fuse_pair
from .instrument import Instrument, clocked, placed, sighted
from .sheet import path_sd
from .sights import note_sight
from .two_way import Heard, seeming, travelled, two_way


@compiled
def measured(
    heard: Heard, asvs: Motion, instrument: Instrument, strayed: Floats | None
) -> tuple[Floats, Floats]:
    """Return the fix (3,), m, of a ping and its covariance (3, 3), m2, fused over its hearers.

    `strayed` as of :class:`..protocol.hf.reception.Extras`.
    """
    ping = heard.ping
    if strayed is not None:  # noqa: SIM102 - else the two ways are not even compiled
        if not isnan(ping.call_time_s):
            return two_way(heard, asvs, instrument, strayed[ping.auv])
    levels = instrument.levels
    estimate, covariance, first = np.zeros(3), np.zeros((3, 3)), True
    for row in range(len(heard.receptions)):
        it = heard.receptions[row]
        if it.outcome != HEARD:
            continue
        x, y, z, yaw = where(asvs, it.asv, it.arrived_at_s)
        vessel = x, y, z
        noise = heard.noise[row]
        unit, believed = sighted(
            seeming(ping, vessel, it), vessel, yaw, it.snr_db, noise, instrument
        )
        reach = levels.sound_speed_m_per_s * clocked(travelled(it), noise, instrument)
        fix, spread = placed(
            vessel, unit, believed, reach, path_sd(reach, levels), it.snr_db, noise, instrument
        )
        note_sight(it, fix, unit, reach, spread, instrument)
        if first:
            estimate, covariance, first = fix, spread, False
        else:
            estimate, covariance = fuse_pair(estimate, covariance, fix, spread)
    return estimate, covariance


@compiled
def note(row: Row, ping: Row, estimate: Floats, covariance: Floats) -> None:
    """Write what has been measured of a ping to the row of its fix."""
    row.x_m, row.y_m, row.z_m = estimate[0], estimate[1], estimate[2]
    row.sd_x_m = sqrt(max(covariance[0, 0], 0.0))
    row.sd_y_m = sqrt(max(covariance[1, 1], 0.0))
    row.sd_z_m = sqrt(max(covariance[2, 2], 0.0))
    row.cov_xy_m2, row.cov_xz_m2 = covariance[0, 1], covariance[0, 2]
    row.cov_yz_m2 = covariance[1, 2]
    row.error_m = hypot(estimate[0] - ping.x_m, estimate[1] - ping.y_m)
