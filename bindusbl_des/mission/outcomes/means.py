"""Sums, order and quantiles of numbers, in compiled code and for it.

Compiled sums of numba's are not pairwise, and so not those of numpy; its sort takes three times as
long to compile as the heap here (1.5 and 0.5 s of processor time) and, of hundreds, as long to run.
"""

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import compiled

Floats = NDArray[np.float64]

# numpy adds up to so many numbers in eight columns, and more by halves.
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
def sort(values: Floats) -> None:
    """Put numbers into rising order, in their place, by a heap."""
    for first in range(values.size // 2 - 1, -1, -1):
        _sink(values, first, values.size)
    for end in range(values.size - 1, 0, -1):
        values[0], values[end] = values[end], values[0]
        _sink(values, 0, end)


@compiled
def _sink(heap: Floats, place: int, end: int) -> None:
    """Let a number sink below all that are larger, in a heap of the first `end`."""
    below = 2 * place + 1
    while below < end:
        if below + 1 < end and heap[below + 1] > heap[below]:
            below += 1
        if not heap[below] > heap[place]:
            break
        heap[place], heap[below] = heap[below], heap[place]
        place, below = below, 2 * below + 1


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
    """Return a :func:`quantile` of n > 0 numbers in any order, in which they remain.

    Only the two that it lies between are put in their places, which of thousands takes a tenth of
    the time of sorting them all.
    """
    place = share * (values.size - 1)
    low = int(place)
    pair = np.partition(values, (low, min(low + 1, values.size - 1)))[low : low + 2]
    return float(pair[0] + (place - low) * (pair[-1] - pair[0]))
