"""Named streams of random numbers: one for each purpose and vehicle.

Streams are independent of each other and of the order in which they are asked for, so that a
further ASV leaves every AUV's drift as it was, and two scenarios with one seed share their noise.
"""

from collections.abc import Iterator
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray


class Purpose(IntEnum):
    """What a stream is for; the numbers keep old seeds meaning what they did: never reuse one."""

    DRIFT = 1
    DEPTH = 2
    MEASUREMENT = 3
    LOSS = 4
    SCHEDULE = 5
    BROADCASTER = 6
    CURRENT = 7
    STATION = 8


class Streams:
    """The random streams of one mission."""

    def __init__(self, seed: int) -> None:
        self.seed = seed

    def of(self, purpose: Purpose, *vehicles: int) -> np.random.Generator:
        """Return the stream of a purpose and its vehicles (AUV, then ASV), always the same one."""
        key = (int(purpose), *vehicles)
        sequence = np.random.SeedSequence(self.seed, spawn_key=key)
        return np.random.Generator(np.random.PCG64(sequence))


class Draws:
    """Rows of noise from one stream, drawn in blocks because single draws are slow.

    What a row holds does not depend on how many rows are taken.
    """

    def __init__(self, stream: np.random.Generator, width: int, block: int = 64) -> None:
        self._stream = stream
        self._shape = (block, width)
        self._rows: Iterator[NDArray[np.float64]] = iter(())

    def normal(self) -> NDArray[np.float64]:
        """Return the next row of standard normal numbers, shape (width,)."""
        row = next(self._rows, None)
        if row is None:
            self._rows = iter(self._stream.standard_normal(self._shape))
            row = next(self._rows)
        return row
