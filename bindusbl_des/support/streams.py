"""Named streams of random numbers: one for each purpose and vehicle.

Theory of operation
-------------------
A seed, a :class:`Purpose` and the numbers of the vehicles concerned name a stream: they are the
entropy and spawn key of a SeedSequence, whose PCG64 is the stream.  So streams are independent of
each other and of the order in which they are asked for: a further ASV leaves every AUV's drift as
it was, and two scenarios with one seed share their noise.  Numbers of purposes are never reused.

* Noise that is used in order is drawn before anything branches, in whole arrays.
* Noise of measurements is drawn in blocks for each pair of an AUV and an ASV (:class:`NoiseStore`);
  how many rows are taken, and by whom, changes no row.
* Where it is not known who asks first (losses are decided out of order), a number is a function of
  a key, a cell and a count (:func:`uniform`): the same one whoever asks, and how often.
"""

from collections.abc import Callable
from copy import deepcopy
from enum import IntEnum
from math import cos, log, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from .arrays import Floats, Ints, lengthened
from .compiled import compiled

# Rows of noise that are drawn at a time; fewer where so many pairs would hold more than so many.
ROWS, FEWEST_ROWS, MOST_ROWS = 64, 4, 6_400_000

# Rows that are drawn for a pair at first: most pairs of a large fleet need no more.
FIRST_ROWS = 16

# Pairs for which there is room at first.
SHELVES = 16


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
    INSTRUMENT = 12
    RANGING = 13
    FRAME = 14
    OVERHEARD = 15
    BEACON = 20
    MISALIGNMENT = 21
    GNSS = 22
    CLOCK = 23
    OUTLIER = 24
    HEADING = 30
    SCALE_FACTOR = 31
    PACKET = 40
    BACKOFF = 41
    CONTENTION = 45
    SIGNAL = 46
    AUV_FRAME = 47
    DATA = 48
    DATA_LOSS = 49
    BURST = 50
    FRAME_BURST = 51
    SLOW_ERROR = 52
    GNSS_FIX = 53
    RANGE_RATE = 54
    CHANNEL = 55
    GNSS_TELEGRAM = 60
    COMPASS_TELEGRAM = 61
    PEER = 70
    PEER_ARRAY = 71
    MODEM = 72
    WIND = 80


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

    def __init__(
        self, streams: Streams, auvs: int, asvs: int, width: int, further: int = 0
    ) -> None:
        """Have rows of `width` numbers for measuring, and after them `further` ones of a stream of
        their own: of outliers, and of elements that few arrays have.
        """
        self._streams, self._width = streams, width
        self._purposes = [Purpose.MEASUREMENT, Purpose.OUTLIER][: 1 + (further > 0)]
        self._drawn: dict[tuple[int, int], list[np.random.Generator]] = {}
        rows = max(FEWEST_ROWS, min(ROWS, MOST_ROWS // max(auvs * asvs, 1)))
        self.shelf = np.full((auvs, asvs), -1, dtype=np.int64)
        self.taken = np.full((auvs, asvs), rows, dtype=np.int64)
        self.blocks = np.empty((min(auvs * asvs, SHELVES), rows, width + further))
        #: Whom to tell that the blocks are in another array: this store, lest they keep it.
        self.on_grown: Callable[[NoiseStore], None] | None = None

    def is_spent(self, auv: int, asv: int) -> bool:
        """Tell whether a pair has no row left."""
        return bool(self.taken[auv, asv] == self.blocks.shape[1])

    def peek(self, auv: int, asv: int, ahead: int) -> NDArray[np.float64]:
        """Return the row that a pair will take after `ahead` others have been, (columns,); -1 is
        the last one that it has taken.
        """
        if ahead >= 0 and self.is_spent(auv, asv):
            self.refill(auv, asv)
        row, rows = self.taken[auv, asv] + ahead, self.blocks.shape[1]
        if row < rows:
            return np.asarray(self.blocks[self.shelf[auv, asv], row])
        later, widths = row - rows + 1, (self._width, self.blocks.shape[2] - self._width)
        twins = zip(deepcopy(self._drawn[auv, asv]), widths, strict=False)
        return np.concatenate([twin.standard_normal((later, width))[-1] for twin, width in twins])

    def refill_spent(self, auvs: NDArray[np.int64], asvs: NDArray[np.int64]) -> None:
        """Draw the next rows of those pairs, AUVs (k,) and ASVs (k,), that have none left."""
        spent = self.taken[auvs, asvs] == self.blocks.shape[1]
        for auv, asv in set(zip(auvs[spent].tolist(), asvs[spent].tolist(), strict=True)):
            self.refill(auv, asv)

    def refill(self, auv: int, asv: int) -> None:
        """Draw the next rows of a pair; the first few of them go to the end of its block."""
        begin = 0
        if (auv, asv) not in self._drawn:
            begin = max(self.blocks.shape[1] - FIRST_ROWS, 0)
            self.shelf[auv, asv] = len(self._drawn)
            self._drawn[auv, asv] = [
                self._streams.of(purpose, auv, asv) for purpose in self._purposes
            ]
        shelf = self.shelf[auv, asv]
        if shelf == len(self.blocks):
            self.blocks = lengthened(self.blocks, 2 * len(self.blocks))
            if self.on_grown is not None:
                self.on_grown(self)
        block = self.blocks[shelf, begin:]
        parts = block[:, : self._width], block[:, self._width :]
        for stream, part in zip(self._drawn[auv, asv], parts, strict=False):
            part[:] = stream.standard_normal(part.shape)
        self.taken[auv, asv] = begin


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


@compiled
def normals(key: np.uint64, cells: Ints) -> Floats:
    """Return a :func:`normal` number of each of some cells (n,)."""
    found = np.empty(cells.size)
    for k in range(cells.size):
        found[k] = normal(key, 0, cells[k], 0)
    return found
