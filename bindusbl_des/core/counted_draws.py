"""Random numbers that are functions of a pair of vehicles and a count: always the same ones,
whoever asks, how often, and in which order.
"""

from math import cos, log, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from .compiled import compiled
from .streams import Purpose, Streams


def pair_keys(streams: Streams, purpose: Purpose, auv: int, asvs: int) -> NDArray[np.uint64]:
    """Return what the luck of an AUV and each ASV is drawn by (asvs,), on a band with a purpose of
    its own: a further ASV leaves the others' as they were.
    """
    return streams.of(purpose, auv).integers(2**64, size=asvs, dtype=np.uint64)


@compiled
def uniform(key: np.uint64, layer: int, cell: int, number: int) -> float:
    """Return a number of a cell of a layer in [0, 1): always the same one, and independent of all
    others.

    Source: G. L. Steele, D. Lea, C. H. Flood, Fast splittable pseudorandom number generators
    (SplitMix64), OOPSLA 2014, its output function taken of a counter, twice.
    """
    gamma = np.uint64(0x9E3779B97F4A7C15)
    state = key
    for word in (np.uint64(cell), np.uint64(64 * layer + number)):
        state = state + gamma * (word + np.uint64(1))
        state = (state ^ (state >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        state = (state ^ (state >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        state = state ^ (state >> np.uint64(31))
    return float(np.int64(state >> np.uint64(11))) * 2.0**-53


@compiled
def normal(key: np.uint64, layer: int, cell: int, number: int) -> float:
    """Return a standard normal number, made of this number of a cell and the next (G. E. P. Box,
    M. E. Muller 1958).
    """
    radius = sqrt(-2.0 * log(1.0 - uniform(key, layer, cell, number)))
    return radius * cos(2.0 * pi * uniform(key, layer, cell, number + 1))
