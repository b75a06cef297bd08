"""The count: how many published numbers each joint reading meets, and what that is worth."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import comb
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..experiments.measured import Measured
from ..experiments.running import Runs
from ..published import Published, published
from ..verdicts import REPRODUCED
from .factors import FACTORS
from .foretelling import Foretelling, is_put_in
from .readings import Reading, readings

if TYPE_CHECKING:
    import pandas as pd

# Two readings are told apart when chance alone would share out their differences so unevenly, or
# more, with less than this probability.
PROBABILITY = 0.05

# How often the choices are shuffled to see what chance alone would meet, and by which seed
SHUFFLES, SEED = 1000, 1

Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Switch:
    """A choice that the best reading does not make: numbers met with it, and at best with it.

    `alone` counts when nothing else is changed, `best` when all else is chosen anew.
    """

    factor: str
    choice: str
    alone: int
    best: int


@dataclass(frozen=True)
class Chance:
    """How many numbers the best reading would foretell if the numbers had none in common.

    `low` to `high` holds 90 % of the shuffles; `share` of them reach what the best does foretell.
    """

    mean: float
    low: int
    high: int
    share: float


class Tally:
    """Which published numbers each joint reading meets.

    `met` and `gaps` are (readings, numbers): whether the verdict is *reproduced*, and how far the
    measured number is from the published one, as a share of it (see :func:`gap`).  `put_in` marks
    numbers that a reading takes from the paper: it meets them, and explains nothing by that.  The
    readings are all there are, in the order of :func:`.readings.readings`.
    """

    def __init__(
        self, rows: Sequence[Published], met: Flags, gaps: NDArray[np.float64], put_in: Flags
    ) -> None:
        self.rows, self.met, self.gaps, self.put_in = tuple(rows), met, gaps, put_in
        self.readings = tuple(readings())

    @cached_property
    def free(self) -> Flags:
        """The numbers (n,) that no reading puts in."""
        return np.asarray(~self.put_in.any(axis=0))

    @cached_property
    def counts(self) -> NDArray[np.int64]:
        """How many numbers each reading meets (readings,)."""
        return np.asarray(self.met.sum(axis=1))

    @cached_property
    def foretold(self) -> NDArray[np.int64]:
        """How many of the numbers that no reading puts in each meets (readings,)."""
        return np.asarray(self.met[:, self.free].sum(axis=1))

    @cached_property
    def deviations(self) -> NDArray[np.float64]:
        """The sum of all gaps of each reading (readings,)."""
        return np.asarray(self.gaps.sum(axis=1))

    @cached_property
    def ranks(self) -> list[int]:
        """The readings from the best on: most numbers met, then the least sum of gaps."""
        return [int(n) for n in np.lexsort((self.deviations, -self.counts))]

    @property
    def best(self) -> Reading:
        """The reading that meets most."""
        return self.readings[self.ranks[0]]

    @property
    def best_foretold(self) -> Reading:
        """The reading that meets most of the numbers that no reading puts in."""
        order = np.lexsort((self.gaps[:, self.free].sum(axis=1), -self.foretold))
        return self.readings[int(order[0])]

    def place(self, reading: Reading) -> int:
        """Return where a reading stands in the arrays."""
        return self.readings.index(reading)

    def switches(self) -> Iterator[Switch]:
        """Yield, for every choice that the best reading does not make, what it would meet."""
        for factor in FACTORS:
            for choice in factor.choices:
                if choice not in self.best.words:
                    alone = self.counts[self.place(self.best.switched(choice))]
                    with_it = [choice in reading.words for reading in self.readings]
                    best = self.counts[with_it].max()
                    yield Switch(factor.name, choice, int(alone), int(best))

    def rivals(self) -> list[Reading]:
        """Return the readings that chance may have put behind the best (sign test).

        Of the numbers that only one of two readings meets, a fair coin would give each half.  Only
        numbers that no reading puts in are counted, as though each were won or lost on its own.
        """
        best, rest = self.met[self.ranks[0]][self.free], self.met[:, self.free]
        won, lost = (best & ~rest).sum(axis=1), (~best & rest).sum(axis=1)
        return [
            self.readings[n]
            for n in self.ranks[1:]
            if sign_test(int(won[n]), int(lost[n])) >= PROBABILITY
        ]

    @cached_property
    def by_chance(self) -> Chance:
        """What the best reading would foretell if each number favoured choices of its own.

        For each number the choices of every factor are shuffled: it stays as easy to meet, and as
        dependent on each factor, but has nothing in common with the others.  Only numbers that no
        reading puts in are counted.
        """
        sizes = [len(factor.choices) for factor in FACTORS]
        grids = [numbers.reshape(sizes) for numbers in self.met[:, self.free].T.astype(np.int8)]
        rng = np.random.default_rng(SEED)
        highest = [
            sum(grid[np.ix_(*map(rng.permutation, sizes))] for grid in grids).max()
            for _ in range(SHUFFLES)
        ]
        low, high = np.quantile(highest, (0.05, 0.95), method="nearest")
        reached = np.mean(np.array(highest) >= self.foretold.max())
        return Chance(float(np.mean(highest)), int(low), int(high), float(reached))


def tally(runs: Runs) -> Tally:
    """Return the count over the campaigns of all joint readings."""
    foretelling, rows = Foretelling(runs), published()
    found = [[foretelling.measured(row, it) for row in rows] for it in readings()]
    return Tally(
        rows,
        np.array([[it.verdict == REPRODUCED for it in line] for line in found]),
        np.array([[gap(it) for it in line] for line in found]),
        np.array([[is_put_in(row, it) for row in rows] for it in readings()]),
    )


def ranking(counted: Tally) -> "pd.DataFrame":
    """Return a row per reading, from the best: its choices, what it meets, and each number."""
    import pandas as pd

    order = counted.ranks
    head = {
        "reading": [counted.readings[n].name for n in order],
        **{
            factor.name: [getattr(counted.readings[n], factor.name) for n in order]
            for factor in FACTORS
        },
        "met": counted.counts[order],
        "put_in": counted.put_in[order].sum(axis=1),
        "foretold": counted.foretold[order],
        "off_by": counted.deviations[order],
    }
    numbers = {
        f"{row.case}: {row.auv} {row.quantity}": counted.met[order, number]
        for number, row in enumerate(counted.rows)
    }
    return pd.DataFrame({**head, **numbers})


def gap(it: Measured) -> float:
    """Return |measured - published| as a share of the published number.

    A bound that is kept leaves no gap; where 0 was published it is the measured number itself.
    """
    if it.claim != "equals" and it.verdict == REPRODUCED:
        return 0.0
    deviation = it.deviation()
    return abs(it.prediction.mean if deviation is None else deviation)


def sign_test(won: int, lost: int) -> float:
    """Return how probable it is that a fair coin falls as unevenly, either way.

    >>> sign_test(6, 0), sign_test(3, 2), sign_test(0, 0)
    (0.03125, 1.0, 1.0)
    """
    throws, fewer = won + lost, min(won, lost)
    tail = sum(comb(throws, k) for k in range(fewer + 1)) / 2.0**throws
    return min(1.0, 2 * tail)
