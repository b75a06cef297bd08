"""How often receptions of a log are lost, and for how long: the chain that makes them likeliest.

Each pair is a two-state chain, continuous in time (:mod:`...core.acoustics.bursts`): of two
receptions t apart the second is lost with the probability p + (1 - p) k after a lost one, and
p (1 - k) after a heard one, k = e^(-t / ((1 - p) burst_s)).  The share lost p is that of receptions
over about the same range, lest what far ones have in common be taken for bursts.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ...support.arrays import Flags, Floats
from .log import Receptions

# Shares are those of so many stretches of range at most, in each of which so many were lost.
MOST_STRETCHES, FEWEST_LOST = 8, 30
# Means that are tried: from a tenth of the shortest time between two receptions on, by this factor
SHORTEST, FACTOR = 0.1, 1.02
# A mean belongs to the 95 % interval if its log-likelihood is so much less than the best (Wilks
# 1938: half of the 95 % quantile of chi-squared with one degree of freedom).
WITHIN = 1.92
# So far (logarithm) the odds of being lost may be from those counted; the golden section.
MOST_OFF, GOLDEN = 1.5, (5.0**0.5 - 1.0) / 2.0
# Outages that are rarer with one mean are told of.
RARE = 0.01


class Outage(NamedTuple):
    """The longest outage: how many receptions in a row were lost, over how long (s), and how often
    as long a one is met in such a log, were there but the one mean.
    """

    lost: int
    lasted_s: float
    chance: float

    @property
    def is_rare(self) -> bool:
        """Whether one mean does not explain it."""
        return self.chance < RARE


class Losses(NamedTuple):
    """How many receptions there are, and the share lost; the mean time that losses last (s), with
    its 95 % interval, None where nothing tells them from losses one by one; the longest outage.
    """

    receptions: int
    share: float
    burst_s: float | None
    interval_s: tuple[float, float]
    longest: Outage | None


class _Steps(NamedTuple):
    """From one reception of a pair to the next (n,): time between (s), the share lost at the range
    of the second, and whether the first and the second were lost.
    """

    apart: Floats
    share: Floats
    before: Flags
    after: Flags


def losses_of(receptions: Receptions | None) -> Losses | None:
    """Return what the receptions of a log tell of losses; None where it has none.

    That losses come in bursts is one number more, which the log must bear out: it must make n
    receptions more likely by a factor of the root of n.
    Source: G. Schwarz, Estimating the dimension of a model, Annals of Statistics 6(2), 1978.
    """
    if receptions is None or not len(receptions.times):
        return None
    count, share = len(receptions.times), float(receptions.is_lost.mean())
    steps = _steps(receptions)
    alone = Losses(count, share, None, (0.0, 0.0), None)
    if not len(steps.apart) or share in (0.0, 1.0):
        return alone
    shortest, longest = float(steps.apart.min()), float(np.ptp(receptions.times))
    numbers = int(np.log(max(longest / (SHORTEST * shortest), 1.0)) / np.log(FACTOR))
    tried = SHORTEST * shortest * FACTOR ** np.arange(1 + numbers)
    best = int(np.argmax([_log_likelihood(steps, burst) for burst in tried]))
    likely = {best: _profile(steps, float(tried[best]))}
    for step in (-1, 1):  # the ends of the interval, and what is better still on the way
        number = best + step
        while 0 <= number < len(tried):
            likely[number] = _profile(steps, float(tried[number]))
            if likely[number] < max(likely.values()) - WITHIN:
                break
            number += step
    best = max(likely, key=lambda number: likely[number])
    if likely[best] - _profile(steps, 0.0) < 0.5 * np.log(count):
        return alone
    within = [tried[number] for number, value in likely.items() if value >= likely[best] - WITHIN]
    burst_s = float(tried[best])
    interval = float(min(within) / FACTOR**0.5), float(max(within) * FACTOR**0.5)
    return Losses(count, share, burst_s, interval, _longest(receptions, steps, burst_s))


def _profile(steps: _Steps, burst_s: float) -> float:
    """Return the log-likelihood of a mean where all shares are as they are likeliest with it: those
    counted are uncertain, the more so the longer losses last.

    The odds of all shares have one factor in common, sought by golden sections.
    Source: J. Kiefer, Sequential minimax search for a maximum, Proceedings of the AMS 4(3), 1953.
    """

    def score(place: float) -> tuple[float, float]:
        odds = float(np.exp(place)) * steps.share / (1.0 - steps.share)
        return _log_likelihood(steps._replace(share=odds / (1.0 + odds)), burst_s), place

    low, high = -MOST_OFF, MOST_OFF
    left, right = score(high - GOLDEN * (high - low)), score(low + GOLDEN * (high - low))
    best = max(left, right)
    while high - low > 1e-2:
        if left[0] > right[0]:
            high, right = right[1], left
            left = score(high - GOLDEN * (high - low))
        else:
            low, left = left[1], right
            right = score(low + GOLDEN * (high - low))
        best = max(best, left, right)
    return best[0]


def _log_likelihood(steps: _Steps, burst_s: float) -> float:
    chance = _lost(steps, burst_s)
    return float(np.log(np.where(steps.after, chance, 1.0 - chance)).sum())


def _lost(steps: _Steps, burst_s: float) -> Floats:
    """Return how likely each second reception is lost, by the first; losses last for burst_s."""
    rest = 1.0 - steps.share
    kept = np.exp(-steps.apart / (rest * burst_s)) if burst_s > 0.0 else np.zeros(len(rest))
    found: Floats = np.where(
        steps.before, steps.share + rest * kept, steps.share * (1.0 - kept)
    ).clip(1e-12, 1.0 - 1e-12)
    return found


def _steps(receptions: Receptions) -> _Steps:
    shares = _shares(receptions)
    parts = []
    for rows in _pairs(receptions):
        times, is_lost = receptions.times[rows], receptions.is_lost[rows]
        later = np.diff(times) > 0.0  # what comes twice at an instant tells nothing
        own = np.diff(times), shares[rows][1:], is_lost[:-1], is_lost[1:]
        parts.append([column[later] for column in own])
    return _Steps(*(np.concatenate(pieces) for pieces in zip(*parts, strict=True)))


def _pairs(receptions: Receptions) -> Iterator[np.ndarray]:
    """Yield the receptions of each pair, in order, by their rows."""
    for pair in np.unique(receptions.pairs):
        yield np.flatnonzero(receptions.pairs == pair)


def _shares(receptions: Receptions) -> Floats:
    """Return for each reception (n,) the share lost of those over about the same range."""
    is_lost, ranges = receptions.is_lost, receptions.ranges
    count = int(is_lost.sum()) // FEWEST_LOST
    stretches = min(MOST_STRETCHES, count) if np.isfinite(ranges).all() else 1
    order = np.argsort(ranges, kind="stable")
    found = np.empty(len(is_lost))
    for rows in np.array_split(order, max(stretches, 1)):
        # of none lost, or all, not quite none or all: half of one more
        found[rows] = (is_lost[rows].sum() + 0.5) / (len(rows) + 1.0)
    return found


def _longest(receptions: Receptions, steps: _Steps, burst_s: float) -> Outage | None:
    """Return the longest outage, and how rare it is with one mean."""
    runs = [run for rows in _pairs(receptions) for run in _runs(receptions, rows)]
    goes_on = float(_lost(steps, burst_s)[steps.before].mean()) if steps.before.any() else 0.0
    most = max((count for count, _ in runs), default=0)
    if most < 2:
        return None
    lasted = max(seconds for count, seconds in runs if count == most)
    return Outage(most, lasted, float(1.0 - (1.0 - goes_on ** (most - 1)) ** len(runs)))


def _runs(receptions: Receptions, rows: np.ndarray) -> Iterator[tuple[int, float]]:
    """Yield the receptions of a pair that were lost in a row: how many, and over how long (s)."""
    is_lost, times = receptions.is_lost[rows], receptions.times[rows]
    edges = np.flatnonzero(np.diff(np.concatenate(([False], is_lost, [False])).astype(int)))
    for begin, end in edges.reshape(-1, 2).tolist():
        yield end - begin, float(times[end - 1] - times[begin])
