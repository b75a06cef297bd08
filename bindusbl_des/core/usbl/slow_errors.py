"""Slow acoustic errors: a measurement has nearly the error of the one before it.

A share q of the variance of each acoustic error (of range, and of direction: by arrivals at an
array's elements, by bearing and elevation, or by the position that a data sheet states) is a
first-order Gauss-Markov process of the pair of vehicles; the rest is white:

    n = sqrt(1 - q) w + sqrt(q) g,    E g(t) g(t + T) = exp(-T / correlation_s)

so that the error of a single measurement is distributed as without, and only the correlation of
several differs.  Errors of attitude and GNSS are not acoustic.  Source of the process: R. G. Brown,
P. Y. C. Hwang, Introduction to Random Signals and Applied Kalman Filtering, 4th ed., 2012, sec.
4.2.
"""

from math import exp, expm1, inf, sqrt

import numpy as np

from ...support.arrays import Floats
from ...support.compiled import compiled
from ...support.streams import Purpose, Streams, normal, pair_keys
from ..records.rows import Rows
from .array import ELEMENTS

# One slow number of a pair of an AUV and an ASV: its key, the slow share of the variance, the
# correlation time (s), how often it has been drawn, when last (s), and its value.
SLOW = np.dtype(
    [
        ("key", "u8"),
        ("share", "f8"),
        ("correlation_s", "f8"),
        ("drawn", "i8"),
        ("at_s", "f8"),
        ("value", "f8"),
    ]
)

# Number of acoustic numbers at the beginning of a row of noise: elements (or a sheet's), and range
FIRST, RANGE = ELEMENTS + 1, ELEMENTS


def slow_numbers(
    share: float, correlation_s: float, elements: int, streams: Streams, auvs: int, asvs: int
) -> Rows | None:
    """Return the slow numbers of each pair (auvs, asvs, n), :data:`SLOW`; None if the share is 0.

    An array of more than ELEMENTS has one more for each, as in a row of noise.
    """
    if share == 0.0:
        return None
    found = np.zeros((auvs, asvs, FIRST + max(elements - ELEMENTS, 0)), SLOW)
    found["share"], found["correlation_s"], found["at_s"] = share, correlation_s, -inf
    for auv in range(auvs):
        found["key"][auv] = pair_keys(streams, Purpose.SLOW_ERROR, auv, asvs)[:, np.newaxis]
    return found


@compiled
def advance(pair: Rows, time: float) -> None:
    """Advance the slow numbers (n,) of a pair to an instant (s)."""
    for n in range(pair.size):
        slow = pair[n]
        passed = max(time - slow.at_s, 0.0) / slow.correlation_s
        fresh = normal(slow.key, 0, slow.drawn, 2 * n)
        slow.value = exp(-passed) * slow.value + sqrt(-expm1(-2.0 * passed)) * fresh
        slow.drawn += 1
        slow.at_s = max(time, slow.at_s)


@compiled
def blend(noise: Floats, pair: Rows) -> None:
    """Blend the slow numbers of a pair into a row of white noise."""
    for n in range(pair.size):
        slow = pair[n]
        column = n if n < FIRST else noise.size - 1 - n + FIRST  # as `arrival_differences` reads it
        noise[column] = sqrt(1.0 - slow.share) * noise[column] + sqrt(slow.share) * slow.value
