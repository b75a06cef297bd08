"""What the ASVs that heard a ping make of it together: one fix, and how sure they are of it.

A ping sent on time is ranged by its one way.  The answer to a call is ranged by the whole way of
both; ASVs share their clock, GNSS time, and what they measured.
"""

from math import isnan

import numpy as np

from ..core.compiled import compiled
from ..records.columns import (
    ARRIVED_AT,
    AT_ASV,
    CALL_TIME,
    CALLED_AT,
    CALLED_BY,
    OUTCOME,
    PING_X,
    PING_Z,
    TRAVEL_TIME,
)
from ..records.events import HEARD
from ..vehicles.motion import Floats, Ints, where
from .fusion import fuse_pair, fuse_shared
from .instrument import clocked, locate, placed, sighted
from .round_trip import dated, own_range


@compiled
def measured(
    ping: Floats, heard: Ints, receptions: Floats, first: int, noise: Floats, asv_table: Floats,
    asv_first: Ints, asv_step: float, array: Floats, metric: Floats, levels: Floats, strayed: float,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Return the fix (3,), m, of a ping and its covariance (3, 3), m2, fused over its hearers.

    `heard` are the receptions that were decoded; `noise` has a row of standard normal numbers for
    each reception of the ping from `first` on; `strayed` (m2) as of :func:`.reception.decide`.
    """
    if not isnan(ping[CALLED_AT]):
        return _two_way(
            ping, heard, receptions, first, noise, asv_table, asv_first, asv_step, array, metric,
            levels, strayed,
        )  # fmt: skip
    source = ping[PING_X : PING_Z + 1]
    estimate, covariance = np.zeros(3), np.zeros((3, 3))
    for row in heard:
        it = receptions[row]
        x, y, z, yaw = where(asv_table, asv_first, asv_step, int(it[AT_ASV]), it[ARRIVED_AT])
        fix, spread = locate(
            source, np.array((x, y, z)), yaw, it[TRAVEL_TIME], noise[row - first], array, metric,
            levels,
        )  # fmt: skip
        if row == heard[0]:
            estimate, covariance = fix, spread
        else:
            estimate, covariance = fuse_pair(estimate, covariance, fix, spread)
    return estimate, covariance


@compiled
def _two_way(
    ping: Floats, heard: Ints, receptions: Floats, first: int, noise: Floats, asv_table: Floats,
    asv_first: Ints, asv_step: float, array: Floats, metric: Floats, levels: Floats, strayed: float,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Measure the answer to a call; arguments as of :func:`measured`.

    One ASV finds its range by itself, the caller if it heard the answer.  That tells when the AUV
    answered, and with it the range of all others, whose errors contain that of the first (eq. rtt;
    the turnaround is known and removed).
    """
    caller, reference = int(ping[CALLED_BY]), heard[0]
    astray = np.zeros(3)  # the caller's GNSS error, which lasts for as long as call and answer
    for row in range(first, first + len(noise)):
        if receptions[row, AT_ASV] == caller:
            astray = levels[6] * noise[row - first, 9:12]
            if receptions[row, OUTCOME] == HEARD:
                reference = row
    state, spread, call_way = _by_itself(
        ping, receptions[reference], noise[reference - first], astray, asv_table, asv_first,
        asv_step, array, metric, levels, strayed,
    )  # fmt: skip
    for row in heard:
        if row != reference:
            vessel, unit, believed, path = _seen(
                ping, receptions[row], noise[row - first], asv_table, asv_first, asv_step, array,
                metric, levels,
            )  # fmt: skip
            fix, other = placed(
                vessel, unit, believed, max(path - call_way, 0.0), levels[5], noise[row - first],
                metric, levels,
            )  # fmt: skip
            state, spread = fuse_shared(state, spread, fix, other, unit)
    return state[:3].copy(), spread[:3, :3].copy()


@compiled
def _seen(
    ping: Floats, it: Floats, noise: Floats, asv_table: Floats, asv_first: Ints, asv_step: float,
    array: Floats, metric: Floats, levels: Floats,
) -> tuple[Floats, Floats, Floats, float]:  # fmt: skip
    """Return where an ASV is at a reception (m), the direction and the attitude that it believes
    in, and the length (m) of the way of call and answer that it measures.
    """
    x, y, z, yaw = where(asv_table, asv_first, asv_step, int(it[AT_ASV]), it[ARRIVED_AT])
    vessel = np.array((x, y, z))
    unit, believed = sighted(ping[PING_X : PING_Z + 1], vessel, yaw, noise, array, metric, levels)
    path = levels[0] * clocked(ping[CALL_TIME] + it[TRAVEL_TIME], noise, levels)
    return vessel, unit, believed, path


@compiled
def _by_itself(
    ping: Floats, it: Floats, noise: Floats, astray: Floats, asv_table: Floats, asv_first: Ints,
    asv_step: float, array: Floats, metric: Floats, levels: Floats, strayed: float,
) -> tuple[Floats, Floats, float]:  # fmt: skip
    """Locate an AUV by one reception of its answer; return what :func:`.fusion.fuse_shared` takes
    as an estimate and its covariance, and the length (m) of the call's way.
    """
    vessel, unit, believed, path = _seen(
        ping, it, noise, asv_table, asv_first, asv_step, array, metric, levels
    )
    x, y, z, _ = where(asv_table, asv_first, asv_step, int(ping[CALLED_BY]), ping[CALLED_AT])
    baseline, gnss, other_gnss = np.array((x, y, z)) - vessel, levels[6] ** 2, 0.0
    if it[AT_ASV] != ping[CALLED_BY]:
        baseline, other_gnss = baseline + astray - levels[6] * noise[9:12], gnss
    reach, share, bearing, lean, doubt = own_range(path, baseline, unit)
    fix, covariance = placed(vessel, unit, believed, reach, 0.0, noise, metric, levels)
    state = np.zeros(4)
    state[:3] = fix
    limit = (baseline[0] ** 2 + baseline[1] ** 2 + baseline[2] ** 2) / 6  # two places on a line
    level = bearing[0] ** 2 + bearing[1] ** 2  # AUVs go level
    spread = dated(
        covariance, unit, share, bearing, lean, doubt, limit, levels[5] ** 2, level * strayed, gnss,
        other_gnss,
    )  # fmt: skip
    return state, spread, path - reach
