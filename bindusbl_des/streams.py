"""Named streams of random numbers: one for each purpose and vehicle.

Streams are independent of each other and of the order in which they are asked for, so that a
further ASV leaves every AUV's drift as it was, and two scenarios with one seed share their noise.
"""

from enum import IntEnum

import numpy as np

# Rows of noise that are drawn at a time.
ROWS = 64


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
    VELOCITY_BIAS = 9
    INITIAL_POSITION = 10
    CALL = 11


class Streams:
    """The random streams of one mission."""

    def __init__(self, seed: int) -> None:
        self.seed = seed

    def of(self, purpose: Purpose, *vehicles: int) -> np.random.Generator:
        """Return the stream of a purpose and its vehicles (AUV, then ASV), always the same one."""
        key = (int(purpose), *vehicles)
        sequence = np.random.SeedSequence(self.seed, spawn_key=key)
        return np.random.Generator(np.random.PCG64(sequence))


class NoiseStore:
    """Rows of noise of every pair of an AUV and an ASV, drawn in blocks from the pair's own stream.

    Single draws are slow, and compiled equations cannot draw: they take row `taken[auv, asv]` of
    block `shelf[auv, asv]` of `blocks` (block, row, column), and have the block refilled when it is
    used up.  What a row holds does not depend on how many rows are taken, nor by whom.
    """

    def __init__(self, streams: Streams, auvs: int, asvs: int, width: int) -> None:
        self._streams = streams
        self._drawn: dict[tuple[int, int], np.random.Generator] = {}
        self.shelf = np.full((auvs, asvs), -1, dtype=np.int64)
        self.taken = np.full((auvs, asvs), ROWS, dtype=np.int64)
        self.blocks = np.empty((2, ROWS, width))

    def refill(self, auv: int, asv: int) -> None:
        """Draw the next rows of a pair."""
        if (auv, asv) not in self._drawn:
            self.shelf[auv, asv] = len(self._drawn)
            self._drawn[auv, asv] = self._streams.of(Purpose.MEASUREMENT, auv, asv)
        shelf = self.shelf[auv, asv]
        if shelf == len(self.blocks):
            self.blocks = np.concatenate((self.blocks, np.empty_like(self.blocks)))
        self._drawn[auv, asv].standard_normal(out=self.blocks[shelf])
        self.taken[auv, asv] = 0
