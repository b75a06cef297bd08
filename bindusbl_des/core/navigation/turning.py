"""Fixes expanded about an estimated position: their covariance lies across the line of sight to it.

A direction is less precise than a range, so a fix is uncertain across the line from its ASV. Taken
about the measured direction, that covariance has the fix's own error: a filter that weighs fixes by
it puts each too near to its ASV, by up to r tr(A), A the covariance of the direction (rad2), and
all of them alike, which no number of fixes averages out.  So each measurement is expanded about the
AUV's estimate, whose error is independent of the measurement's.

An AUV that knows its direction better than the array measures it compares range and direction with
its expectation, to second order in its own error (Y. Bar-Shalom, X. R. Li, T. Kirubarajan,
Estimation with Applications to Tracking and Navigation, 2001, sec. 10.3).  Any other takes the
measured position, lengthened by 1 + tr(A) / 2 so that it has no bias, with its covariance across
the estimated direction (S. Bordonaro, P. Willett, Y. Bar-Shalom, Decorrelated unbiased converted
measurement Kalman filter, IEEE Trans.  AES 50(2), 2014; the bias: D. Lerro, Y. Bar-Shalom, Tracking
with debiased consistent converted measurements versus EKF, IEEE Trans.  AES 29(3), 1993).

Measurements of several arrays are fused there: the minimum-variance linear estimate.
"""

from math import atan2, hypot, isnan, sqrt
from typing import NamedTuple

import numpy as np

from ...support.arrays import Floats
from ...support.compiled import compiled, inlined
from ..records.events import HEARD
from ..records.rows import Row, Rows
from .fix_update import SURE, Said

# Variance (m2) below that of any instrument, added so that exact values divide nothing by 0.
EXACT = 1e-8

Vector = tuple[float, float, float]

# A position nearer (m) is at the array, and has no direction.
AT_THE_ARRAY = 1e-3


class PingBelief(NamedTuple):
    """An AUV's estimate as it pinged: x, y, z (m), and the covariance of all states, x and y first
    (m2); as it heard the call that it answers, if any, x, y, z (m), and the variance (m2) along any
    direction of the displacement in between; the variance (m2) along x and y together that errors
    in `common` add to a fix.
    """

    place: Vector
    spread: Floats
    called: Vector
    moved: float
    common: float = 0.0


@compiled
def turned(receptions: Rows, table: Said, own: PingBelief) -> tuple[Said, bool]:
    """Return the receptions of a ping as a fix expanded about an AUV's estimate, and whether it is
    a range and a direction, in which errors in common are linear, rather than a position.  `table`
    is the fix as in its table, which is returned where the measurements are not known, or where the
    estimate has no direction: at an array, or at a caller.

    The fourth unknown is the error (m) of the call's estimated path, which all hearers of the
    answer have in common: by the displacement in between and the caller's own position.
    """
    both, count, polar = np.zeros((5, 4)), 0, False
    known, off = both[:4], both[4]
    for row in range(len(receptions)):
        reception = receptions[row]
        if reception.outcome == HEARD:
            if isnan(reception.range_m2) or _is_beside(reception, own):
                return table, False
            polar = _add(reception, own, known, off)
            if count == 0 and not isnan(reception.caller_x_m):
                known[3, 3] += 1.0 / (own.moved + reception.from_m2 + EXACT)
            count += 1
    if count == 0:
        return table, False
    largest = known[0, 0] + known[1, 1] + known[2, 2]
    if known[3, 3] > 0.0:
        _leave_out(known, off, 3)
    _leave_out(known, off, 2)  # the depth, which filters do not use
    xx, yy, xy = known[0, 0], known[1, 1], known[0, 1]
    determinant = xx * yy - xy * xy
    if not determinant > SURE * (xx + yy) * largest > 0.0:  # lost in rounding
        return table, False
    noise = yy / determinant, xx / determinant, -xy / determinant
    x, y = noise[0] * off[0] + noise[2] * off[1], noise[2] * off[0] + noise[1] * off[1]
    return Said(own.place[0] + x, own.place[1] + y, noise), polar and count == 1


@inlined
def _is_beside(reception: Row, own: PingBelief) -> bool:
    """Return whether an AUV's estimate is at an array, or no farther from the caller than its own
    uncertainty: neither has a direction.
    """
    (x, y, z), spread = own.place, own.spread
    x, y, z = x - reception.from_x_m, y - reception.from_y_m, z - reception.from_z_m
    if x * x + y * y + z * z <= AT_THE_ARRAY**2:
        return True
    if isnan(reception.caller_x_m):
        return False
    x, y, z = own.called
    x, y, z = x - reception.caller_x_m, y - reception.caller_y_m, z - reception.caller_z_m
    return bool(
        x * x + y * y + z * z
        <= spread[0, 0] + spread[1, 1] + 2.0 * reception.from_m2 + AT_THE_ARRAY**2
    )


@inlined
def _leave_out(known: Floats, off: Floats, last: int) -> None:
    """Eliminate the unknown `last` from an information matrix and vector of all up to it."""
    for i in range(last):
        share = known[i, last] / known[last, last]
        off[i] -= share * off[last]
        for j in range(last):
            known[i, j] -= share * known[last, j]


class Axes(NamedTuple):
    """The line of sight from an array to an AUV's estimate: unit vectors along it (s), horizontal
    across it (e; its z is 0), and across both (d); its length (m), and its horizontal share.
    """

    s: Vector
    e: tuple[float, float]
    d: Vector
    reach: float
    level: float


@inlined
def _axes(reception: Row, place: Vector) -> Axes:
    x, y, z = (
        place[0] - reception.from_x_m,
        place[1] - reception.from_y_m,
        place[2] - reception.from_z_m,
    )
    reach = sqrt(x * x + y * y + z * z)
    x, y, z = x / reach, y / reach, z / reach
    level, ex, ey = sqrt(x * x + y * y), 0.0, 1.0
    if level > 1e-9:
        ex, ey = -y / level, x / level
    return Axes((x, y, z), (ex, ey), (-z * ey, z * ex, x * ey - y * ex), reach, level)


class Unsure(NamedTuple):
    """The covariance of an AUV's position relative to an array, along s, e, d of :class:`Axes`:
    variances and covariances (m2).
    """

    ss: float
    ee: float
    dd: float
    ed: float
    se: float
    sd: float


@inlined
def _unsure(axes: Axes, spread: Floats, vague: float) -> Unsure:
    """Rotate the covariance of x and y; add the variance `vague` (m2) of the array's position."""
    (x, y, _), (ex, ey), (dx, dy, _) = axes.s, axes.e, axes.d
    xx, yy, xy = spread[0, 0], spread[1, 1], spread[0, 1]
    return Unsure(
        vague + x * x * xx + y * y * yy + 2.0 * x * y * xy,
        vague + ex * ex * xx + ey * ey * yy + 2.0 * ex * ey * xy,
        vague + dx * dx * xx + dy * dy * yy + 2.0 * dx * dy * xy,
        ex * dx * xx + ey * dy * yy + (ex * dy + ey * dx) * xy,
        x * ex * xx + y * ey * yy + (x * ey + y * ex) * xy,
        x * dx * xx + y * dy * yy + (x * dy + y * dx) * xy,
    )


@inlined
def _less_the_call(
    reception: Row, own: PingBelief, measured: float, s: Vector, range_m2: float
) -> tuple[float, Vector, float]:
    """Return a `measured` two-way path (m) less the call's path, to second order; its gradient by
    the AUV's position; and its variance (m2), `range_m2` and the call's.  `s` is the line of sight.
    """
    spread, vague = own.spread, reception.from_m2
    x, y = own.called[0] - reception.caller_x_m, own.called[1] - reception.caller_y_m
    z = own.called[2] - reception.caller_z_m
    way = sqrt(x * x + y * y + z * z)
    x, y, z = x / way, y / way, z / way
    xx, yy, xy = spread[0, 0], spread[1, 1], spread[0, 1]
    across_m2 = xx + yy - (x * x * xx + y * y * yy + 2.0 * x * y * xy) + 2.0 * vague
    gx, gy, gz = s[0] + x, s[1] + y, s[2] + z
    range_m2 += 0.5 * (across_m2 / way) ** 2
    if reception.is_caller > 0.0:  # one error of both ends
        range_m2 += vague * (gx * gx + gy * gy + gz * gz - 2.0)
    return measured - (way + 0.5 * across_m2 / way), (gx, gy, gz), range_m2


@compiled
def _add(reception: Row, own: PingBelief, known: Floats, off: Floats) -> bool:
    """Add the information (4, 4), 1/m2, of a reception to `known`, and with its innovation to `off`
    (4,); return whether it was compared as a range and a direction.

    They are J^T W J and J^T W r, with the innovation r along s, e and d of :class:`Axes`, the
    inverse W of its covariance, and the derivatives J of s, e and d by x, y, z and the call's path.
    """
    axes = _axes(reception, own.place)
    (sx, sy, sz), (ex, ey), (dx, dy, dz), reach, level = axes
    square, vague = reach * reach, reception.from_m2
    ss, ee, dd, ed, se, sd = _unsure(axes, own.spread, vague)
    mx, my, mz = reception.ahead_x_m, reception.ahead_y_m, reception.ahead_z_m
    measured, range_m2, calls = sqrt(mx * mx + my * my + mz * mz), reception.range_m2 + vague, 0.0
    gx, gy, gz = sx, sy, sz
    if not isnan(reception.caller_x_m):
        calls, whole = 1.0, measured
        measured, (gx, gy, gz), range_m2 = _less_the_call(reception, own, whole, axes.s, range_m2)
        shorter = measured / max(whole, AT_THE_ARRAY)
        mx, my, mz = shorter * mx, shorter * my, shorter * mz
    off_s, off_e = sx * mx + sy * my + sz * mz, ex * mx + ey * my
    off_d = dx * mx + dy * my + dz * mz - 0.5 * reach * level * sz * reception.turn_rad2
    # variances of the direction (rad2) along e and d, and their covariance
    e_rad2, d_rad2 = (
        reception.level_rad2 + reception.turn_rad2 * level * level,
        reception.steep_rad2,
    )
    both_rad2 = reception.both_rad2
    # near the vertical the horizontal direction is uncertain: it mixes both variances
    swapped = min(ee / max(square * level * level, EXACT), 0.5)
    e_rad2, d_rad2 = e_rad2 + swapped * (d_rad2 - e_rad2), d_rad2 + swapped * (e_rad2 - d_rad2)
    e_m2, d_m2, both_m2 = square * e_rad2 + vague, square * d_rad2 + vague, square * both_rad2
    # the AUV knows the direction better than the array measures it
    polar = bool(ee + dd < square * (e_rad2 + d_rad2) + own.common)
    if polar:
        across = hypot(off_e, off_d)
        turn = atan2(across, off_s) * reach / across if across > 0.0 else 1.0
        off_s = measured - reach - 0.5 * (ee + dd) / reach
        off_e, off_d = turn * off_e + se / reach, turn * off_d + sd / reach
        range_m2 += 0.5 * (ee * ee + dd * dd + 2.0 * ed * ed) / square
        e_m2, d_m2 = e_m2 + (ee * ss + se * se) / square, d_m2 + (dd * ss + sd * sd) / square
        both_m2 += (ed * ss + se * sd) / square
    else:
        longer = 1.0 + 0.5 * (e_rad2 + d_rad2)
        off_s, off_e, off_d = longer * off_s - reach, longer * off_e, longer * off_d
        curved = e_rad2 * e_rad2 + d_rad2 * d_rad2 + 2.0 * both_rad2 * both_rad2
        range_m2 += 0.5 * square * curved + e_rad2 * ee + d_rad2 * dd + 2.0 * both_rad2 * ed
    e_m2, d_m2 = e_m2 + EXACT, d_m2 + EXACT
    determinant = e_m2 * d_m2 - both_m2 * both_m2
    w_s = 1.0 / (range_m2 + EXACT)
    w_e, w_d, w_both = d_m2 / determinant, e_m2 / determinant, -both_m2 / determinant
    by_s, by_e, by_d = w_s * off_s, w_e * off_e + w_both * off_d, w_both * off_e + w_d * off_d
    off[0] += by_s * gx + by_e * ex + by_d * dx
    off[1] += by_s * gy + by_e * ey + by_d * dy
    off[2] += by_s * gz + by_d * dz
    off[3] += by_s * calls
    known[0, 0] += w_s * gx * gx + w_e * ex * ex + w_d * dx * dx + 2.0 * w_both * ex * dx
    known[1, 1] += w_s * gy * gy + w_e * ey * ey + w_d * dy * dy + 2.0 * w_both * ey * dy
    known[2, 2] += w_s * gz * gz + w_d * dz * dz
    known[0, 1] += w_s * gx * gy + w_e * ex * ey + w_d * dx * dy + w_both * (ex * dy + ey * dx)
    known[0, 2] += w_s * gx * gz + w_d * dx * dz + w_both * ex * dz
    known[1, 2] += w_s * gy * gz + w_d * dy * dz + w_both * ey * dz
    known[0, 3] += w_s * gx * calls
    known[1, 3] += w_s * gy * calls
    known[2, 3] += w_s * gz * calls
    known[3, 3] += w_s * calls
    known[1, 0], known[2, 0], known[2, 1] = known[0, 1], known[0, 2], known[1, 2]
    known[3, 0], known[3, 1], known[3, 2] = known[0, 3], known[1, 3], known[2, 3]
    return polar
