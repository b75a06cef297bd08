"""What is selected from, and what is said of it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

from ...core.arrays import Floats

# Return the goals' values (k, goals) of k missions, each of a candidate's and a seed's number from
# 0.  nan: that mission failed, or had no value, and does not meet the goal.  Where the budget is
# used up it may return those of the first of them only.
Sample = Callable[[Sequence[tuple[int, int]]], Floats]

# met: all goals.  not met: one is missed.  needs more missions: neither is shown, or they are met
# by less than would matter; it is not chosen.  outdone: it was open when another of its cost met
# the goals, and is better than that by less than would matter, if at all.  not needed: it costs
# more than the answer.  not flown: the budget was used up before.
Verdict = Literal["met", "not met", "needs more missions", "outdone", "not needed", "not flown"]


@dataclass(frozen=True)
class Choice:
    """What may be chosen: its cost, in any unit, and what its goals are predicted to be.

    A prediction decides which cost is tried first and nothing else; nan is not known.
    """

    cost: float
    prior: Sequence[float] | None = None


@dataclass(frozen=True)
class Estimate:
    """A goal's mean over the missions of a candidate, and how sure it is; nan where none is.

    `low` and `high` are the ends of its 95 % interval by itself (Student's t, two-sided, as
    everywhere).  `bound` is the end, on the side of the goal, that holds for all candidates and
    looks together: it must keep the goal.  `missed` is the share of those missions that do not.
    """

    mean: float
    low: float
    high: float
    bound: float
    missed: float = float("nan")


@dataclass(frozen=True)
class Selection:
    """The candidate chosen (None: none meets the goals), and what was found of each.

    `estimates` are those of each candidate's goals, over its first `missions` seeds.  `is_settled`
    is whether the answer holds with the stated confidence; else `why` tells what is missing.
    """

    answer: int | None
    verdicts: tuple[Verdict, ...]
    estimates: tuple[tuple[Estimate, ...], ...]
    missions: tuple[int, ...]
    is_settled: bool
    why: str
