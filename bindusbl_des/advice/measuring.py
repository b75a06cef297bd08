"""What chosen changes are worth, on seeds that had no part in choosing them."""

from collections.abc import Sequence
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from ..campaigns.statistics.intervals import CONFIDENCE, student
from ..results.effects import HARMS, HELPS, NEGLIGIBLE, NO_EFFECT, Effect, Harm
from .changes import Change
from .choosing import WORTHWHILE
from .trials import AS_IT_IS, OutOfMissions, Trial, Trials

Floats = NDArray[np.float64]

# No more changes than a reader compares, and no more seeds than intervals need to be narrow.
MOST_CHANGES, MOST_SEEDS = 6, 20
# Whether fixes do harm shows at once, or it is little.
SEEDS_OF_NONE = 6
# Rather fewer changes than fewer seeds for each: Student's t is wide for few.
SEEDS_EACH, SEEDS_OF_TWO, FEWEST_SEEDS = 5, 4, 3


def measured(
    trials: Trials, chosen: Sequence[Change], first_seed: int
) -> tuple[list[Change], list[int]]:
    """Fly the most promising of the chosen changes on fresh seeds; return which, and the seeds.

    How many depends on the missions there are, never on a result, so that none can end the trials.
    """
    waiting, seeds = list(chosen[:MOST_CHANGES]), list[int]()
    count = len(waiting)
    while count > 1 and _more(trials, waiting[:count], 0) < _enough(count):
        count -= 1
    now, waiting = waiting[:count], waiting[count:]
    more = _enough(count)
    with suppress(OutOfMissions):
        while more:
            fresh = [first_seed + len(seeds) + k for k in range(more)]
            seeds += fresh
            _fly(trials, [AS_IT_IS, *now], fresh)
            while waiting and _enough(len(now) + 1) <= len(seeds) <= trials.left:
                now.append(waiting.pop(0))
                _fly(trials, now[-1:], seeds)
            more = _more(trials, now, len(seeds))
            if waiting:  # further changes before further seeds
                more = min(more, max(1, _enough(len(now) + 1) - len(seeds)))
    return now, seeds


def _fly(trials: Trials, changes: Sequence[Change], seeds: Sequence[int]) -> None:
    for change in changes:
        with suppress(ValueError):  # it cannot be flown at one of the seeds
            for seed in seeds:
                trials.fly(change, seed)


def _more(trials: Trials, chosen: Sequence[Change], flown: int) -> int:
    """Return at how many more seeds all changes can be flown with the missions that are left."""
    most = MOST_SEEDS if chosen else SEEDS_OF_NONE
    return max(0, min(most - flown, trials.left // (1 + len(chosen))))


def _enough(changes: int) -> int:
    return {0: FEWEST_SEEDS, 1: FEWEST_SEEDS, 2: SEEDS_OF_TWO}.get(changes, SEEDS_EACH)


def effect(change: Change, differences: Floats, error: float, together: int) -> Effect:
    """Return what differences (m) of the worst AUV's error, `error` m as it is, say of a change.

    The interval is one of so many that hold `together` with 95 %.
    """
    mean, low, high = interval(differences, together)
    if high < 0:
        verdict = HELPS if -mean >= WORTHWHILE * error else NEGLIGIBLE
    else:
        verdict = HARMS if low > 0 else NO_EFFECT
    return Effect(
        change.kind, change.words, change.lines, mean, low, high, len(differences), verdict
    )


def may_harm(missions: Sequence[Trial]) -> bool:
    """Tell whether fixes raise any AUV's mean error over these missions, be it by chance."""
    with_fixes, without = np.mean([mission.own for mission in missions], axis=0).T
    return bool(np.any(with_fixes > without))


def harms(missions: Sequence[Trial], together: int = 1) -> list[Harm]:
    """Return the AUVs whose error fixes raise, the worst first.

    What is said of the whole fleet is one of so many statements that hold `together` with 95 %.
    """
    if len(missions) < FEWEST_SEEDS:
        return []
    own = np.stack([mission.own for mission in missions])
    found = []
    for auv in range(own.shape[1]):
        with_fixes, without = own[:, auv].T
        mean, low, high = interval(with_fixes - without, own.shape[1] * together)
        means = float(with_fixes.mean()), float(without.mean())
        if low > 0 and mean > WORTHWHILE * means[1]:
            found.append(Harm(f"AUV{auv}", *means, mean, low, high, len(own)))
    return sorted(found, key=lambda it: -it.mean_m)


def interval(differences: Floats, together: int) -> tuple[float, float, float]:
    """Return the mean of differences and its interval, one of so many that hold `together`."""
    count, mean = len(differences), float(differences.mean())
    width = student(count - 1, 1 - (1 - CONFIDENCE) / together)
    half = width * float(differences.std(ddof=1)) / count**0.5
    return mean, mean - half, mean + half
