"""When candidates are looked at, and how far from a limit a mean must lie for a verdict.

Who looks often, at many, is wrong often: each look at each candidate is one more chance to be
misled.  Looks are therefore at numbers of seeds that were fixed before, and the risk that is left
by the confidence is shared among three mistakes, and of each among the occasions of making it
(Bonferroni's inequality, which seeds that are paired cannot break):

* a candidate that misses a goal is chosen: among all candidates and their looks;
* the right candidate, one and unknown, drops out as missing a goal: among its looks and goals, not
  among candidates, since nobody minds what happens to others;
* it is outdone by one that is worse: among those that could do so, and their looks.
"""

from dataclasses import dataclass
from functools import cache
from math import inf

from ...campaigns.experiments.precision import checkpoints
from ...campaigns.statistics.intervals import student

# At so few seeds candidates may only drop out, which skewed errors do not make riskier.
FEW_SEEDS = (4, 6)

# Where each candidate is told by itself: the seeds of looks, and the share of the risk that each
# takes.  Little is spent early, so that the last look is hardly stricter than a single one would be
# (O'Brien and Fleming 1979, Biometrics 35:549; Lan and DeMets 1983, Biometrika 70:659).
SPENT = {8: 0.1, 16: 0.1, 32: 0.8}


@dataclass(frozen=True)
class Look:
    """A number of seeds, and so many standard errors from a limit to be sure of each verdict.

    `met` is None, and `outdone` infinite, where such a verdict would be premature.
    """

    seeds: int
    met: float | None
    missed: float
    outdone: float


@cache
def looks(most_seeds: int, confidence: float, candidates: int, goals: int) -> tuple[Look, ...]:
    """Return all looks at a candidate, by number of seeds.

    >>> [look.seeds for look in looks(20, 0.95, 12, 1)]
    [4, 6, 8, 12, 16, 20]
    """
    judged = list(checkpoints(most_seeds))
    risk = (1 - confidence) / 3
    missed = risk / ((len(FEW_SEEDS) + len(judged)) * goals)
    met = risk / (len(judged) * candidates)
    outdone = risk / (len(judged) * max(candidates - 1, 1))
    few = [Look(seeds, None, _errors(seeds, missed), inf) for seeds in FEW_SEEDS]
    risks = (met, missed, outdone)
    return (*few, *(Look(seeds, *(_errors(seeds, it) for it in risks)) for seeds in judged))


@cache
def looks_at_each(confidence: float, goals: int) -> tuple[Look, ...]:
    """Return looks at candidates of which each is told by itself whether it meets the goals.

    The confidence is that of each, over all its looks, and two-sided as that of an interval: half
    of the risk is that of telling that it meets them, half that it misses one.

    >>> [(look.seeds, round(look.met, 2)) for look in looks_at_each(0.95, 1)]
    [(8, 4.03), (16, 3.29), (32, 2.14)]
    """
    risk = (1 - confidence) / 2
    shares = {seeds: share * risk for seeds, share in SPENT.items()}
    return tuple(
        Look(seeds, _errors(seeds, share), _errors(seeds, share / goals), inf)
        for seeds, share in shares.items()
    )


def _errors(seeds: int, risk: float) -> float:
    """Return how many standard errors a mean is off at most, but for a risk (one-sided)."""
    return student(seeds - 1, 1 - 2 * risk)
