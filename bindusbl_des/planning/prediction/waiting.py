"""How long AUVs wait for fixes that come with some chance each."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import compiled
from .rounds import Turns

Floats = NDArray[np.float64]

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
    return Waiting(*_waiting(turns.told_s, turns.pinged_s, turns.chance, turns.many, end))


@compiled
def _waiting(
    told: Floats, pinged: Floats, chance: Floats, many: int, end: float
) -> tuple[Floats, Floats, Floats, Floats]:
    count = len(told)
    rate, mean, p95, longest = np.zeros(count), np.empty(count), np.empty(count), np.empty(count)
    for auv in range(count):
        instants, lags, odds, fixes = _of_one(told[auv], pinged[auv], chance[auv], many, end)
        rate[auv] = fixes / end
        ages, weights = _ages(instants, lags, odds, end)
        mean[auv], p95[auv], longest[auv] = _over_time(ages, weights, end)
    return rate, mean, p95, longest


@compiled
def _of_one(
    told: Floats, pinged: Floats, chance: Floats, many: int, end: float
) -> tuple[Floats, Floats, Floats, float]:
    """Return when an AUV may be told of a fix (k,), s, how old that is then (k,), s, and how likely
    (k,), and the number of fixes to be expected; of rounds that stand for several, each has its
    instant.
    """
    instants, lags, odds = np.empty((3, many * told.size))
    count, fixes = 0, 0.0
    for turn in range(told.size):
        if chance[turn] <= 0.0 or told[turn] >= end:
            continue
        later = told[turn + 1] if turn + 1 < told.size else end
        for k in range(many):
            instants[count] = told[turn] + k * (later - told[turn]) / many
            lags[count], odds[count] = told[turn] - pinged[turn], chance[turn]
            fixes += chance[turn]
            count += 1
    return instants[:count], lags[:count], odds[:count], fixes


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
