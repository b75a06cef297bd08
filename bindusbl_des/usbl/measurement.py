"""What the ASVs that heard a ping make of it together: one fix, and how sure they are of it.

A ping sent on time is ranged by its one way.  The answer to a call is ranged by the whole way of
both; ASVs share their clock, GNSS time, and what they measured.
"""

from math import hypot, isnan, sqrt
from typing import NamedTuple

import numpy as np

from ..core.compiled import compiled
from ..records.events import HEARD
from ..records.rows import Row, Rows
from ..vehicles.motion import Floats, Ints, Motion, where
from .fusion import fuse_pair, fuse_shared
from .instrument import Instrument, clocked, locate, placed, sighted
from .round_trip import PathErrors, dated, own_range


class Sighting(NamedTuple):
    """What an ASV measures of an answer: where it is (m), the direction and the attitude that it
    believes in (:func:`.instrument.sighted`), and the length (m) of the way of call and answer.
    """

    vessel: Floats
    unit: Floats
    believed: Floats
    path: float


@compiled
def measured(
    ping: Row, heard: Ints, receptions: Rows, noise: Floats, asvs: Motion,
    instrument: Instrument, strayed: Floats | None,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Return the fix (3,), m, of a ping and its covariance (3, 3), m2, fused over its hearers.

    `receptions` (n,) and `noise` (n, NOISE_WIDTH), standard normal numbers, belong together;
    `heard` are the receptions that were decoded; `strayed` as of :func:`.reception.settle`.
    """
    if strayed is not None:  # noqa: SIM102 - else the two ways are not even compiled
        if not isnan(ping.called_at_s):
            return _two_way(ping, heard, receptions, noise, asvs, instrument, strayed[ping.auv])
    source = np.array((ping.x_m, ping.y_m, ping.z_m))
    estimate, covariance = np.zeros(3), np.zeros((3, 3))
    for row in heard:
        it = receptions[row]
        x, y, z, yaw = where(asvs, it.asv, it.arrived_at_s)
        fix, spread = locate(
            source, np.array((x, y, z)), yaw, it.travel_time_s, noise[row], instrument
        )
        if row == heard[0]:
            estimate, covariance = fix, spread
        else:
            estimate, covariance = fuse_pair(estimate, covariance, fix, spread)
    return estimate, covariance


@compiled
def _two_way(
    ping: Row, heard: Ints, receptions: Rows, noise: Floats, asvs: Motion,
    instrument: Instrument, strayed: float,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Measure the answer to a call; arguments as of :func:`measured`.

    One ASV finds its range by itself, the caller if it heard the answer.  That tells when the AUV
    answered, and with it the range of all others, whose errors contain that of the first (eq. rtt;
    the turnaround is known and removed).
    """
    reference = heard[0]
    astray = np.zeros(3)  # the caller's GNSS error, which lasts for as long as call and answer
    for row in range(len(receptions)):
        if receptions[row].asv == ping.called_by:
            astray = instrument.levels.gnss_sd_m * noise[row, 9:12]
            if receptions[row].outcome == HEARD:
                reference = row
    state, spread, call_way = _by_itself(
        ping, receptions[reference], noise[reference], astray, asvs, instrument, strayed
    )
    for row in heard:
        if row != reference:
            seen = _seen(ping, receptions[row], noise[row], asvs, instrument)
            fix, other = placed(
                seen.vessel, seen.unit, seen.believed, max(seen.path - call_way, 0.0),
                instrument.levels.range_sd_m, noise[row], instrument,
            )  # fmt: skip
            state, spread = fuse_shared(state, spread, fix, other, seen.unit)
    return state[:3].copy(), spread[:3, :3].copy()


@compiled
def _seen(ping: Row, it: Row, noise: Floats, asvs: Motion, instrument: Instrument) -> Sighting:
    """Return what an ASV measures of a reception of an answer."""
    x, y, z, yaw = where(asvs, it.asv, it.arrived_at_s)
    vessel, source = np.array((x, y, z)), np.array((ping.x_m, ping.y_m, ping.z_m))
    unit, believed = sighted(source, vessel, yaw, noise, instrument)
    under_way = clocked(ping.call_time_s + it.travel_time_s, noise, instrument)
    return Sighting(vessel, unit, believed, instrument.levels.sound_speed_m_per_s * under_way)


@compiled
def _by_itself(
    ping: Row, it: Row, noise: Floats, astray: Floats, asvs: Motion, instrument: Instrument,
    strayed: float,
) -> tuple[Floats, Floats, float]:  # fmt: skip
    """Locate an AUV by one reception of its answer; return what :func:`.fusion.fuse_shared` takes
    as an estimate and its covariance, and the length (m) of the call's way.
    """
    seen, levels = _seen(ping, it, noise, asvs, instrument), instrument.levels
    x, y, z, _ = where(asvs, ping.called_by, ping.called_at_s)
    baseline = np.array((x, y, z)) - seen.vessel
    gnss, other_gnss = levels.gnss_sd_m**2, 0.0
    if it.asv != ping.called_by:
        baseline, other_gnss = baseline + astray - levels.gnss_sd_m * noise[9:12], gnss
    own = own_range(seen.path, baseline, seen.unit)
    fix, covariance = placed(
        seen.vessel, seen.unit, seen.believed, own.reach, 0.0, noise, instrument
    )
    state = np.zeros(4)
    state[:3] = fix
    limit = (baseline[0] ** 2 + baseline[1] ** 2 + baseline[2] ** 2) / 6  # two places on a line
    level = own.bearing[0] ** 2 + own.bearing[1] ** 2  # AUVs go level
    errors = PathErrors(levels.range_sd_m**2, level * strayed, gnss, other_gnss)
    return state, dated(covariance, seen.unit, own, limit, errors), seen.path - own.reach


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
