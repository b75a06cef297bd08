"""What became of the fixes of each AUV, and how late they were."""

from math import nan, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import compiled, entry
from ...records.events import COLLIDED, DELIVERED, IN_FLIGHT, LOST, OUT_OF_RANGE
from ...records.rows import Row, Rows
from .means import mean, quantile, sort, total

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Quantiles are told of so much of the time, and of so many fixes; what is left of that.
MOST, SELDOM = 0.95, 0.05


class Delivered(NamedTuple):
    """The fixes of one AUV that reached it: when (s), how old they were then, and how long after
    their broadcast (s), in the order of fixes; and how wrong all of its fixes were (m).
    """

    at: Floats
    latencies: Floats
    since_broadcast: Floats
    errors: Floats


def note_service(metrics: Rows, fixes: Rows, duration: float, slot: float) -> None:
    """Write to each AUV's metrics, (n,) :class:`.metrics.AuvMetrics`, what became of its fixes.

    `duration` is that of the mission, `slot` that of uplink slots (s), NaN where fixes do not wait
    for their ends.
    """
    order = np.argsort(fixes["auv"], kind="stable")
    ends = np.cumsum(np.bincount(fixes["auv"], minlength=len(metrics)))
    _note_service(metrics, fixes, order, ends, duration, slot)


@entry
def _note_service(
    metrics: Rows, fixes: Rows, order: Ints, ends: Ints, duration: float, slot: float
) -> None:
    """The fixes of one AUV after the other are the rows `order`, up to the `ends` of each."""
    begin, scratch = 0, np.empty((5, order.size + 1))
    for auv in range(len(metrics)):
        metric, own = metrics[auv], order[begin : ends[auv]]
        delivered = _count(metric, fixes, own, scratch)
        n = delivered.at.size
        metric.fix_rate_hz = n / duration
        metric.fix_error_rms_m = sqrt(_sum_of_squares(delivered.errors) / own.size)
        metric.latency_from_broadcast_s = mean(delivered.since_broadcast)
        _note_waits(metric, delivered.at, duration, scratch[4])
        _note_latencies(metric, delivered.latencies, slot, scratch[4])
        begin = ends[auv]


@compiled
def _count(metric: Row, fixes: Rows, own: Ints, scratch: Floats) -> Delivered:
    """Note how many of the `own` fixes came to what; return what tells how late they were."""
    metric.fixes, metric.fixes_out_of_range, metric.fixes_lost = own.size, 0, 0
    metric.fixes_in_flight, metric.fixes_refused = 0, 0
    n = judged = 0
    for k in range(own.size):
        fix = fixes[own[k]]
        scratch[3, k] = fix.error_m
        if fix.outcome == DELIVERED:
            scratch[0, n], scratch[1, n] = fix.delivered_at_s, fix.latency_s
            scratch[2, n] = fix.delivered_at_s - fix.broadcast_at_s
            scratch[4, judged] = fix.nis
            judged += fix.nis == fix.nis
            metric.fixes_refused += fix.correction_m != fix.correction_m
            n += 1
        metric.fixes_out_of_range += fix.outcome == OUT_OF_RANGE
        metric.fixes_lost += fix.outcome == LOST or fix.outcome == COLLIDED
        metric.fixes_in_flight += fix.outcome == IN_FLIGHT
    metric.fixes_delivered, metric.nis = n, mean(scratch[4, :judged])
    return Delivered(scratch[0, :n], scratch[1, :n], scratch[2, :n], scratch[3, : own.size])


@compiled
def _note_waits(metric: Row, delivered: Floats, end: float, waits: Floats) -> None:
    """Note the times between deliveries, at instants (s) of any order, and the age of the last fix;
    `waits` are written over.
    """
    sort(delivered)
    for k in range(delivered.size - 1):
        waits[k] = delivered[k + 1] - delivered[k]
    intervals = waits[: max(delivered.size - 1, 0)]
    metric.interval_mean_s = mean(intervals)
    sort(intervals)
    metric.interval_p95_s = quantile(intervals, MOST)
    metric.interval_max_s = intervals[-1] if intervals.size else nan
    ages = fix_ages(delivered, end, waits[: delivered.size + 1])
    metric.fix_age_mean_s, metric.fix_age_p95_s, metric.fix_age_max_s = ages


@compiled
def fix_ages(delivered: Floats, end: float, waits: Floats) -> tuple[float, float, float]:
    """Return mean, 95 % quantile and maximum over time of the age of the last fix (s).

    The age grows from 0 at the start and at each of the n instants `delivered`, which rise, up to
    the `end`: waits before the first fix and after the last count like any other.  These `waits`
    (n + 1,), s, are written.

    >>> fix_ages(np.array([10.0]), 20.0, np.empty(2))
    (5.0, 9.5, 10.0)
    """
    _write_waits(waits, delivered, end)
    average = _sum_of_squares(waits) / (2 * end)
    _write_waits(waits, delivered, end)
    sort(waits)
    # an age a is exceeded for sum(max(wait - a, 0)); the k longest waits exceed the quantile
    exceeded = oldest = 0.0
    for k in range(1, waits.size + 1):
        exceeded += waits[-k]
        oldest = (exceeded - SELDOM * end) / k
        if k == waits.size or oldest >= waits[-k - 1]:
            break
    return average, oldest, waits[-1]


@compiled
def _write_waits(waits: Floats, delivered: Floats, end: float) -> None:
    """Write the times (s) from the start to the first of some instants, to the next, to the end."""
    begun = 0.0
    for k in range(delivered.size):
        waits[k] = delivered[k] - begun
        begun = delivered[k]
    waits[-1] = end - begun


@compiled
def _sum_of_squares(values: Floats) -> float:
    """Return the sum of squares, which are written in the place of the values."""
    for k in range(values.size):
        values[k] *= values[k]
    return total(values)


@compiled
def _note_latencies(metric: Row, latencies: Floats, slot: float, since_slot: Floats) -> None:
    """Note how old fixes were when they were delivered (s), and how long their slot was over then;
    these are written.
    """
    n = latencies.size
    for k in range(n):
        since_slot[k] = latencies[k] - slot
    metric.latency_from_slot_s = mean(since_slot[:n])
    metric.latency_mean_s = mean(latencies)
    sort(latencies)
    metric.latency_p95_s = quantile(latencies, MOST)
    metric.latency_max_s = latencies[-1] if n else nan
