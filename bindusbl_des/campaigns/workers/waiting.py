"""The missions that wait for a worker, those of one point together."""

from collections import deque
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray


class Waiting:
    """Missions by their number in the plan, in order; those handed back come first."""

    def __init__(self, seeds: int) -> None:
        self._seeds = seeds
        self._numbers = np.zeros(0, np.int64)
        self._at = 0
        self._back: deque[int] = deque()

    def __len__(self) -> int:
        return len(self._back) + len(self._numbers) - self._at

    def extend(self, numbers: NDArray[np.int64]) -> None:
        """Add missions behind all others."""
        self._numbers, self._at = np.concatenate([self._numbers[self._at :], numbers]), 0

    def put_back(self, numbers: Iterable[int]) -> None:
        """Add missions before all others."""
        self._back.extendleft(reversed(list(numbers)))

    def take(self, most: int) -> tuple[int, ...]:
        """Return the next missions, at least one; the seeds of a point are not torn needlessly.

        Seeds of one point share its scenario and where its vehicles went, which a worker that runs
        them one after another works out once.

        >>> waiting = Waiting(seeds=4)
        >>> waiting.extend(np.arange(12))
        >>> waiting.take(6), waiting.take(3), waiting.take(6)
        ((0, 1, 2, 3), (4, 5, 6), (7, 8, 9, 10, 11))
        """
        if self._back:
            taken = [self._back.popleft() for _ in range(min(most, len(self._back)))]
            return tuple(taken)
        batch = self._numbers[self._at : self._at + most]
        rest = self._numbers[self._at + most : self._at + most + 1]
        if len(rest) and rest[0] // self._seeds == batch[-1] // self._seeds:
            point = batch // self._seeds
            whole = int(np.searchsorted(point, point[-1]))
            batch = batch[: whole or most]
        self._at += len(batch)
        return tuple(batch.tolist())
