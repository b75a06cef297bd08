"""The error of each AUV, predicted without simulation (see docs/planning.md, Predicted error), and
how long it waits for fixes that come with some chance each.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ....core.records.metrics import WORST_IS_LARGEST
from ....support.arrays import Floats
from ....support.compiled import compiled
from .inputs import Inputs
from .mapping import expected_largest, mean_size, quantile, scatter, sizes_of_all, squares
from .march import errors_of, smoothed
from .rounds import Turns, planned_rounds, turns_of
from .sights import SELDOM, fixes, seen

# A wait that is less likely than this to go on is over.
OVER = 1e-5


class Waiting(NamedTuple):
    """What is expected of n AUVs: fixes a second, and the mean, 95 % quantile and maximum over time
    of the time since the ping of the last of them (s), as in table `auvs`, (n,) each.
    """

    rate_hz: Floats
    mean_s: Floats
    p95_s: Floats
    longest_s: Floats


def waiting(turns: Turns, end: float) -> Waiting:
    """Return how long AUVs wait for fixes in a mission that lasts until an `end` (s)."""
    return Waiting(*_waiting(turns.delivered_s, turns.pinged_s, turns.chance, turns.many, end))


@compiled
def _waiting(
    delivered_s: Floats, pinged: Floats, chance: Floats, many: int, end: float
) -> tuple[Floats, Floats, Floats, Floats]:
    count = len(delivered_s)
    rate, mean, p95, longest = np.zeros(count), np.empty(count), np.empty(count), np.empty(count)
    for auv in range(count):
        instants, lags, odds, expected = _of_one(
            delivered_s[auv], pinged[auv], chance[auv], many, end
        )
        rate[auv] = expected / end
        ages, weights = _ages(instants, lags, odds, end)
        mean[auv], p95[auv], longest[auv] = _over_time(ages, weights, end)
    return rate, mean, p95, longest


@compiled
def _of_one(
    delivered_s: Floats, pinged: Floats, chance: Floats, many: int, end: float
) -> tuple[Floats, Floats, Floats, float]:
    """Return when an AUV may be told of a fix (k,), s, how old that is then (k,), s, and how likely
    (k,), and the number of fixes to be expected; of rounds that stand for several, each has its
    instant.
    """
    instants, lags, odds = np.empty((3, many * delivered_s.size))
    count, expected = 0, 0.0
    for turn in range(delivered_s.size):
        if chance[turn] <= 0.0 or delivered_s[turn] >= end:
            continue
        later = delivered_s[turn + 1] if turn + 1 < delivered_s.size else end
        for k in range(many):
            instants[count] = delivered_s[turn] + k * (later - delivered_s[turn]) / many
            lags[count], odds[count] = delivered_s[turn] - pinged[turn], chance[turn]
            expected += chance[turn]
            count += 1
    return instants[:count], lags[:count], odds[:count], expected


@compiled
def _ages(instants: Floats, lags: Floats, odds: Floats, end: float) -> tuple[Floats, Floats]:
    """Return ages (k,), s, at which waits end, and how many of each are to be expected (k,); those
    at which they begin count against them.
    """
    room = 1024
    ages, weights, count = np.empty(room), np.empty(room), 0
    for begin in range(-1, instants.size):
        lag = lags[begin] if begin >= 0 else 0.0
        since = instants[begin] - lag if begin >= 0 else 0.0
        left, k = odds[begin] if begin >= 0 else 1.0, begin + 1
        first = left
        while left > OVER * first:
            ends = instants[k] if k < instants.size else end
            odd = odds[k] if k < instants.size else 1.0
            if count + 1 >= room:
                room *= 2
                more, heavier = np.empty(room), np.empty(room)
                more[:count], heavier[:count] = ages[:count], weights[:count]
                ages, weights = more, heavier
            ages[count], weights[count] = ends - since, left * odd
            ages[count + 1], weights[count + 1] = lag, -left * odd
            count += 2
            left *= 1.0 - odd
            k += 1
    return ages[:count], weights[:count]


@compiled
def _over_time(ages: Floats, weights: Floats, end: float) -> tuple[float, float, float]:
    """Return the mean over time of the age of a fix, its 95 % quantile, and the largest (s).

    An age a is exceeded for the sum of max(age - a, 0) of all waits, as they end less as they
    begin; some wait ends older than a unless none does, each by itself.
    """
    order = np.argsort(-ages, kind="mergesort")
    square = longest = total = number = 0.0
    p95, none = -1.0, 1.0
    for k in range(order.size):
        old, weight = ages[order[k]], weights[order[k]]
        younger = ages[order[k + 1]] if k + 1 < order.size else 0.0
        square += weight * old * old
        total += weight * old
        number += weight
        none *= 1.0 - min(max(weight, 0.0), 1.0)
        longest += (1.0 - none) * (old - younger)
        if p95 < 0.0 and number > OVER:
            age = (total - 0.05 * end) / number
            if age >= younger:
                p95 = age
    return square / (2.0 * end), max(p95, 0.0), longest


class Prediction(NamedTuple):
    """What is expected of each of n AUVs; fields are those of table `auvs`.

    (n,) each but for `error_over_time` (n, k), m, at the instants of the inputs' ways.  Errors over
    single missions scatter about those expected by a share that `varies` (n,).
    """

    hf_coverage: Floats
    fix_rate_hz: Floats
    fix_age_mean_s: Floats
    fix_age_p95_s: Floats
    fix_age_max_s: Floats
    position_error_m: Floats
    position_error_rms_m: Floats
    position_error_p95_m: Floats
    error_over_time: Floats
    varies: Floats

    def worst(self, metric: str) -> float:
        """Return a metric of the worst AUV, as it is expected of single missions.

        Which AUV fares worst is partly luck, so that the largest error of a mission is more than
        that of the AUV of which the largest is expected.
        """
        values = getattr(self, metric)
        if metric.startswith("position_error"):
            return expected_largest(values, self.varies)
        return float(values.max() if WORST_IS_LARGEST[metric] else values.min())


def predict(inputs: Inputs, stations: ArrayLike) -> Prediction:
    """Return what is expected of each AUV with ASVs at `stations` (m, 2), m."""
    asvs = np.asarray(stations, dtype=np.float64)
    sights = seen(inputs, asvs)
    plan = planned_rounds(inputs, sights)
    turns = turns_of(inputs, sights, plan)
    known = smoothed if inputs.navigator.kind.is_smoother else errors_of
    errors = known(inputs, turns, fixes(inputs, sights, inputs.ways.places_m, asvs))
    waits = waiting(turns, inputs.duration_s)
    square, shape = squares(errors.mean, errors.covariance)
    over_time = mean_size(square, shape)
    rounds = 1.0 / plan.period_s
    in_range = sights.heard > SELDOM
    passive = inputs.access.ranging.asvs_ping  # where the pings are those of ASVs
    covered = in_range.mean(axis=2) if passive else in_range.any(axis=2)
    return Prediction(
        (covered * rounds).sum(axis=1) / rounds.sum(),
        *waits,
        over_time.mean(axis=1),
        np.sqrt(square.mean(axis=1)),
        quantile(sizes_of_all(square, shape).reshape(len(square), -1), 0.95),
        over_time,
        scatter(errors, square, over_time),
    )
