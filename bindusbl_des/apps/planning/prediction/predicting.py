"""The predicted metrics of each AUV: errors, and ages of fixes that come with some probability."""

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

# A smaller probability that a wait goes on counts as its end.
OVER = 1e-5


class Waiting(NamedTuple):
    """Fixes per second, and the age (s) of the last fix over time: mean, 95 % quantile, maximum.

    Each is (n,) for n AUVs, as in table `auvs`.
    """

    rate_hz: Floats
    mean_s: Floats
    p95_s: Floats
    longest_s: Floats


def waiting(turns: Turns, end: float) -> Waiting:
    """Return the rates and ages of fixes in a mission of `end` seconds."""
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
    """Return an AUV's possible deliveries: instants, ages then (s), probabilities, (k,) each, and
    the expected number of fixes.

    A round that stands for several is spread over their instants.
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
    """Return ages (k,; s) at which waits end, with their expected numbers (k,).

    Ages at which waits begin have negative numbers.
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
    """Return the age of a fix over time (s): mean, 95 % quantile, and expected maximum.

    The time above an age a is the sum of max(age - a, 0) over the ends of waits, less that over
    their beginnings.  The waits are taken as independent for the maximum.
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
    """The expected metrics (n,) of n AUVs, named as in table `auvs`.

    `error_over_time` (n, k; m) is at the instants of the inputs' paths.  `varies` (n,) is the
    relative standard deviation of an AUV's error between missions.
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
        """Return the expected metric of a mission's worst AUV.

        Chance decides in part which AUV is the worst, so that the largest error of a mission
        exceeds the largest expected error.
        """
        values = getattr(self, metric)
        if metric.startswith("position_error"):
            return expected_largest(values, self.varies)
        return float(values.max() if WORST_IS_LARGEST[metric] else values.min())


def predict(inputs: Inputs, stations: ArrayLike) -> Prediction:
    """Return the expected metrics of each AUV with ASVs at `stations` (m, 2; m)."""
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
    passive = inputs.access.ranging.asvs_ping
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
