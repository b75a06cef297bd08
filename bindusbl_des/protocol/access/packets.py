"""When AUVs have something to send: Poisson instants, a process of each AUV's own."""

from collections.abc import Iterator

import numpy as np

from ...core.streams import Purpose, Streams

# Intervals that are drawn at a time.
DRAWN = 64


def poisson(draw: np.random.Generator, mean_s: float) -> Iterator[float]:
    """Yield the instants (s) of a Poisson process from 0 on, with a mean interval (s).

    >>> instants = poisson(np.random.default_rng(0), 2.0)
    >>> [round(next(instants), 2) for _ in range(3)]
    [1.36, 3.4, 3.44]
    """
    time = 0.0
    while True:
        for interval in draw.standard_exponential(DRAWN).tolist():
            time += mean_s * interval
            yield time


def packets_of(streams: Streams, auvs: int, mean_s: float) -> list[Iterator[float]]:
    """Return the instants (s) at which each of so many AUVs has something to send.

    Each has a stream of its own, so that a further AUV leaves those of the others as they were.
    """
    return [poisson(streams.of(Purpose.PACKET, auv), mean_s) for auv in range(auvs)]
