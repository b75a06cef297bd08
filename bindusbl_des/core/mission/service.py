"""Metrics of each AUV: how well fixes served it, and the errors of its estimate; compiled."""

from math import nan, sqrt
from typing import NamedTuple

import numpy as np

from ...support.arrays import Floats, Ints
from ...support.compiled import compiled
from ..navigation.fix_update import SURE
from ..records.events import BLOCKED, COLLIDED, DELIVERED, IN_FLIGHT, LOST, OUT_OF_RANGE
from ..records.rows import Row, Rows

# numpy sums up to BLOCK numbers in eight columns, and more by halves.
BLOCK, COLUMNS = 128, 8


@compiled
def total(values: Floats) -> float:
    """Return the sum of numbers, pairwise, so that means agree with numpy's.

    N. J. Higham, The accuracy of floating point summation, SIAM J. Sci. Comput. 14 (1993), 783.
    """
    n, found = values.size, 0.0
    if n < COLUMNS:
        for k in range(n):
            found += values[k]
    elif n <= BLOCK:
        a, b, c, d = values[0], values[1], values[2], values[3]
        e, f, g, h = values[4], values[5], values[6], values[7]
        for k in range(COLUMNS, n - n % COLUMNS, COLUMNS):
            a, b, c, d = a + values[k], b + values[k + 1], c + values[k + 2], d + values[k + 3]
            e, f, g, h = e + values[k + 4], f + values[k + 5], g + values[k + 6], h + values[k + 7]
        found = ((a + b) + (c + d)) + ((e + f) + (g + h))
        for k in range(n - n % COLUMNS, n):
            found += values[k]
    else:
        half = n // 2 - n // 2 % COLUMNS
        found = total(values[:half]) + total(values[half:])
    return found


@compiled
def mean(values: Floats) -> float:
    """Return the mean of numbers; NaN without any."""
    return total(values) / values.size


@compiled
def quantile(rising: Floats, share: float) -> float:
    """Return a quantile of numbers in rising order, linear between two of them; NaN without any."""
    if not rising.size:
        return np.nan
    place = share * (rising.size - 1)
    low = int(place)
    high = min(low + 1, rising.size - 1)
    found: float = rising[low] + (place - low) * (rising[high] - rising[low])
    return found


def quantile_of(values: Floats, share: float) -> float:
    """Return a :func:`quantile` of n > 0 numbers in any order, which is kept.

    Only the two numbers around it are put in their places, which for thousands takes a tenth of the
    time of sorting them all.
    """
    place = share * (values.size - 1)
    low = int(place)
    pair = np.partition(values, (low, min(low + 1, values.size - 1)))[low : low + 2]
    return float(pair[0] + (place - low) * (pair[-1] - pair[0]))


# The quantile of metrics, and its complement
MOST, SELDOM = 0.95, 0.05


class DeliveredFixes(NamedTuple):
    """The fixes of one AUV that were delivered, in the order of fixes: when (s), their ages then,
    and their times since broadcast (s); the errors of all its fixes (m).  Of fixes that its
    navigator accepted, in the order of delivery: when, and when their pings were sent (s).
    """

    at: Floats
    latencies: Floats
    since_broadcast: Floats
    errors: Floats
    taken_at: Floats
    pinged_at: Floats


def note_gnss(metrics: Rows, fixes: Rows, gnss: Rows, duration: float) -> None:
    """Write to each AUV's metrics, (n,), its accepted GNSS fixes and, of these and all others, the
    ages of fixes; `duration` as of :func:`note_service`.
    """
    for auv, metric in enumerate(metrics):
        of_each = [
            rows[(rows["auv"] == auv) & ~np.isnan(rows["correction_m"])] for rows in (fixes, gnss)
        ]
        metric["gnss_fixes"] = len(of_each[1])
        taken = np.concatenate([rows["delivered_at_s"] for rows in of_each])
        pinged = np.concatenate([rows["pinged_at_s"] for rows in of_each])
        order = np.argsort(taken, kind="stable")
        ages = fix_ages(taken[order], pinged[order], duration)
        metric["fix_age_mean_s"], metric["fix_age_p95_s"], metric["fix_age_max_s"] = ages


def note_service(metrics: Rows, fixes: Rows, duration: float, slot: float) -> None:
    """Write to each AUV's metrics, (n,) :class:`.metrics.AuvMetrics`, the outcomes of its fixes.

    `duration` is the mission's (s), `slot` the length of uplink slots (s), NaN where fixes do not
    wait for their ends.
    """
    order = np.argsort(fixes["auv"], kind="stable")
    ends = np.cumsum(np.bincount(fixes["auv"], minlength=len(metrics)))
    _note_service(metrics, fixes, order, ends, duration, slot)


@compiled
def _note_service(
    metrics: Rows, fixes: Rows, order: Ints, ends: Ints, duration: float, slot: float
) -> None:
    """`order` are rows of fixes, AUV by AUV, each AUV's up to its number in `ends`."""
    begin, scratch = 0, np.empty((7, order.size + 1))
    for auv in range(len(metrics)):
        metric, own = metrics[auv], order[begin : ends[auv]]
        delivered = _count(metric, fixes, own, scratch)
        n = delivered.at.size
        metric.fix_rate_hz = n / duration
        metric.fix_error_rms_m = sqrt(_sum_of_squares(delivered.errors) / own.size)
        metric.latency_from_broadcast_s = mean(delivered.since_broadcast)
        _note_intervals(metric, delivered.at, scratch[4])
        ages = fix_ages(delivered.taken_at, delivered.pinged_at, duration)
        metric.fix_age_mean_s, metric.fix_age_p95_s, metric.fix_age_max_s = ages
        _note_latencies(metric, delivered.latencies, slot, scratch[4])
        begin = ends[auv]


@compiled
def _count(metric: Row, fixes: Rows, own: Ints, scratch: Floats) -> DeliveredFixes:
    """Write the numbers of an AUV's fixes, rows `own`, by outcome; return times and errors."""
    metric.fixes, metric.fixes_out_of_range, metric.fixes_lost = own.size, 0, 0
    metric.fixes_in_flight = 0
    n = judged = taken = 0
    for k in range(own.size):
        fix = fixes[own[k]]
        scratch[3, k] = fix.error_m
        if fix.outcome == DELIVERED:
            scratch[0, n], scratch[1, n] = fix.delivered_at_s, fix.latency_s
            scratch[2, n] = fix.delivered_at_s - fix.broadcast_at_s
            scratch[4, judged] = fix.nis
            judged += fix.nis == fix.nis
            n += 1
            if fix.correction_m == fix.correction_m:
                place = taken
                while place > 0 and scratch[5, place - 1] > fix.delivered_at_s:
                    scratch[5, place] = scratch[5, place - 1]
                    scratch[6, place] = scratch[6, place - 1]
                    place -= 1
                scratch[5, place], scratch[6, place] = fix.delivered_at_s, fix.pinged_at_s
                taken += 1
        metric.fixes_out_of_range += fix.outcome in (OUT_OF_RANGE, BLOCKED)
        metric.fixes_lost += fix.outcome == LOST or fix.outcome == COLLIDED
        metric.fixes_in_flight += fix.outcome == IN_FLIGHT
    metric.fixes_delivered, metric.nis = n, mean(scratch[4, :judged])
    metric.fixes_refused = n - taken
    return DeliveredFixes(
        scratch[0, :n], scratch[1, :n], scratch[2, :n], scratch[3, : own.size],
        scratch[5, :taken], scratch[6, :taken],
    )  # fmt: skip


@compiled
def _note_intervals(metric: Row, delivered: Floats, intervals: Floats) -> None:
    """Write the times between deliveries (s), which are sorted; `intervals` is scratch."""
    delivered.sort()
    for k in range(delivered.size - 1):
        intervals[k] = delivered[k + 1] - delivered[k]
    intervals = intervals[: max(delivered.size - 1, 0)]
    metric.interval_mean_s = mean(intervals)
    intervals.sort()
    metric.interval_p95_s = quantile(intervals, MOST)
    metric.interval_max_s = intervals[-1] if intervals.size else nan


@compiled
def fix_ages(taken: Floats, pinged: Floats, end: float) -> tuple[float, float, float]:
    """Return mean, 95 % quantile and maximum over time of the age of an AUV's newest fix (s).

    Age is the time since the ping of the newest accepted fix, since the start before the first;
    fixes were `taken` at n rising instants (s), of pings at other instants (s).  Age grows up to
    the `end` (s): waits before the first fix and after the last count like any other.

    >>> fix_ages(np.array([10.0]), np.array([9.0]), 20.0)
    (5.5, 10.0, 11.0)
    """
    count, newest, begun, squares = taken.size + 1, 0.0, 0.0, 0.0
    ages, lowest = np.empty(count), np.empty(count)  # as each wait ends, and as it begins
    for k in range(count):
        ends = taken[k] if k < taken.size else end
        ages[k], lowest[k] = ends - newest, begun - newest
        squares += (ends - begun) * (ages[k] + lowest[k])
        begun = ends
        if k < taken.size:
            newest = max(newest, pinged[k])
    ages.sort()
    lowest.sort()
    # an age a is exceeded for sum(max(ages - a, 0)) - sum(max(lowest - a, 0)), linear in pieces
    age, exceeded, waits, above, low = ages[-1], 0.0, 0, count - 1, count - 1
    while above >= 0 or low >= 0:
        is_end = above >= 0 and (low < 0 or ages[above] >= lowest[low])
        lower = ages[above] if is_end else lowest[low]
        if waits > 0 and exceeded + waits * (age - lower) >= SELDOM * end:
            break
        exceeded, age = exceeded + waits * (age - lower), lower
        if is_end:
            waits, above = waits + 1, above - 1
        else:
            waits, low = waits - 1, low - 1
    oldest = age - (SELDOM * end - exceeded) / waits if waits > 0 else age
    return squares / (2.0 * end), oldest, ages[-1]


@compiled
def _sum_of_squares(values: Floats) -> float:
    """Return the sum of squares, which replace the values."""
    for k in range(values.size):
        values[k] *= values[k]
    return total(values)


@compiled
def _note_latencies(metric: Row, latencies: Floats, slot: float, since_slot: Floats) -> None:
    """Write the latencies of fixes (s), whose order is changed, and their times since the end of
    their slot; `since_slot` is scratch.
    """
    n = latencies.size
    for k in range(n):
        since_slot[k] = latencies[k] - slot
    metric.latency_from_slot_s = mean(since_slot[:n])
    metric.latency_mean_s = mean(latencies)
    latencies.sort()
    metric.latency_p95_s = quantile(latencies, MOST)
    metric.latency_max_s = latencies[-1] if n else nan


@compiled
def note_errors(
    metrics: Rows, errors: Floats, lines: Floats, reckoned: Floats, estimate: Floats, sure: Floats
) -> None:
    """Write to the one row of metrics the errors (n,), m, of an estimate (n, 2), m, along a motion
    (:class:`..vehicles.fleet.VehicleTrack`), and of dead reckoning (n, 2), m; `sure` (n, 3), m2, is
    the covariance xx, yy, xy of the estimate.
    """
    metric, n = metrics[0], len(lines)
    total = square = largest = sideways = alone = 0.0
    for k in range(n):
        x, y = estimate[k, 0] - lines[k, 0], estimate[k, 1] - lines[k, 1]
        drift_x, drift_y = reckoned[k, 0] - lines[k, 0], reckoned[k, 1] - lines[k, 1]
        errors[k] = sqrt(x * x + y * y)
        total += errors[k]
        square += x * x + y * y
        largest = max(largest, errors[k])
        sideways += abs(lines[k, 6] * y - lines[k, 7] * x)
        alone += sqrt(drift_x * drift_x + drift_y * drift_y)
    metric.position_error_m, metric.position_error_rms_m = total / n, sqrt(square / n)
    metric.position_error_max_m, metric.cross_track_error_m = largest, sideways / n
    metric.imu_error_m, metric.fix_benefit_m = alone / n, alone / n - total / n
    # the time mean of e' P^-1 e, without instants at which P is singular, as at first
    normalised, known = np.empty(len(sure)), 0
    for k in range(len(sure)):
        xx, yy, xy = sure[k, 0], sure[k, 1], sure[k, 2]
        x, y = estimate[k, 0] - lines[k, 0], estimate[k, 1] - lines[k, 1]
        determinant = xx * yy - xy * xy
        if determinant > SURE * ((xx + yy) * (xx + yy)):
            weighed = yy * (x * x) - 2 * xy * x * y + xx * (y * y)
            normalised[known] = weighed / determinant
            known += 1
    metric.nees = mean(normalised[:known])
