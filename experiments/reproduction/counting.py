"""How many published numbers each joint reading meets, and how many it would meet by chance."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import comb
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import measuring
from .campaigns import ANGLE, SPEED, Runs
from .numbers import (
    REPRODUCED,
    Limit,
    Measured,
    Prediction,
    Published,
    Reason,
    chosen,
    per_seed,
    predicted,
    published,
)
from .readings import FACTORS, SWEEPS, Reading, readings

if TYPE_CHECKING:
    import pandas as pd

# What each published number becomes under a joint reading.


BASELINE, SWEEP = ("sec:baseline",), ("sec:sweep", "con")

SERVED = Reason(
    "E28",
    "errors depend on when an AUV is in range, and so on starts and turns that are never stated",
)
ACROSS = Reason("E7, E8", "the published errors are not those across the track")
LOSSES = Reason("E3", "the paper's loss law takes 7-15 % of the pings; 298.2 fixes lack 0.6 %")
LATE = Reason("E23", "an answer at the ping's end comes 10 ms later, before ticks round it up")
LOT = Reason("E26", "shares by lot differ from run to run")

Where = tuple[tuple[str, Any], ...]


@dataclass(frozen=True)
class Question:
    """Where a reading looks for a number: rows of a campaign's table, and what of them."""

    row: Published
    campaign: str
    where: Where
    column: str


class Foretelling:
    """The campaigns of joint readings, asked for numbers; what was asked before is remembered."""

    def __init__(self, runs: Runs) -> None:
        self._runs = runs
        self._frames: dict[tuple[str, Where], pd.DataFrame] = {}
        self._known: dict[Question, Prediction] = {}

    def measured(self, row: Published, reading: Reading) -> Measured:
        """Return a published number with what it becomes under a reading."""
        question = asked(row, reading)
        if question not in self._known:
            self._known[question] = self._answer(question)
        found, claim = self._known[question], measuring.claim_of(row)
        return Measured(
            row, reading.name, found, _reason(row, reading), (), claim, _limit(row, reading)
        )

    def _answer(self, question: Question) -> Prediction:
        row, rows = question.row, self._rows(question.campaign, question.where)
        if row.source in BASELINE:
            return predicted(measuring.values(row, rows), measuring.BASELINE_RUNS)
        if row.source in SWEEP:
            return measuring.over_cells(row, rows, question.column)
        values = per_seed(rows, question.column, {"auv": row.auv})
        return predicted(values, measuring.RUNS_OF_THE_PAPER)

    def _rows(self, campaign: str, where: Where) -> "pd.DataFrame":
        if (campaign, where) not in self._frames:
            run = self._runs[campaign]
            table = run.missions if campaign in SWEEPS.values() else run.auvs
            self._frames[campaign, where] = chosen(table, dict(where))
        return self._frames[campaign, where]


def asked(row: Published, reading: Reading) -> Question:
    """Return where a reading looks for a number."""
    if row.source in BASELINE:
        return Question(row, "baseline", tuple(reading.baseline.items()), row.quantity)
    where = reading.missions
    if row.source in SWEEP:
        column = measuring.column_of(row, reading)
        return Question(row, SWEEPS[reading.sweep], tuple(where.items()), column)
    where[SPEED] = reading.speed_of(row.auv)
    column = reading.metric if row.quantity == "cte" else measuring.COLUMNS[row.quantity]
    if row.asvs == "2":
        where[ANGLE] = float(row.angle_deg)
        return Question(row, "two_asvs", tuple(where.items()), column)
    where["asvs.count"] = int(row.asvs)
    return Question(row, "table_1", tuple(where.items()), column)


def is_put_in(row: Published, reading: Reading) -> bool:
    """Tell whether a reading takes a number from the paper, so that it cannot explain it."""
    return row.quantity == "distance" and reading.speed == "published_speeds"


def _limit(row: Published, reading: Reading) -> Limit | None:
    if row.quantity == "cte" and reading.error == "cross_track":
        return measuring.across_track_limit()
    return measuring.limit_of(row)


def _reason(row: Published, reading: Reading) -> Reason:
    """Return why a number may differ under a reading."""
    if row.source in BASELINE:
        return _baseline_reason(row, reading)
    if row.quantity == "latency_max":
        return measuring.LATENCY
    if row.quantity.startswith("cte"):
        return ACROSS if reading.error == "cross_track" else SERVED
    return measuring.reason(row)


def _baseline_reason(row: Published, reading: Reading) -> Reason:
    if row.quantity.startswith("latency"):
        return LATE if reading.reply == "ping_end" else measuring.AIRTIME
    lossless = reading.baseline["acoustics.loss.combine"] == "off"
    if row.quantity == "fix_share":
        return measuring.LOT if lossless and reading.turns == "in_turn" else LOT
    return measuring.PINGS if lossless else LOSSES


# The count: how many published numbers each joint reading meets, and what that is worth.


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
