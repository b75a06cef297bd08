"""Which ASVs have failed when.

A failure holds from its instant on, and to the instant from which its ASV works again, that one
excluded.  The whole fleet knows of it at once.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .scenario_keys import ScenarioKeys
from .sections.failures import Failure

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


class Failures(NamedTuple):
    """The failures of a mission, (k,) each: whose, and from when until when (s).

    `count` is how many ASVs there are.
    """

    count: int
    asvs: NDArray[np.intp]
    begin_s: Floats
    end_s: Floats

    def alive(self, time: float) -> Flags:
        """Return which ASVs work at an instant (s), shape (count,)."""
        working = np.ones(self.count, dtype=np.bool_)
        working[self.asvs[(self.begin_s <= time) & (time < self.end_s)]] = False
        return working

    def meet(self, asvs: ArrayLike, begins_s: ArrayLike, ends_s: ArrayLike) -> tuple[Flags, Flags]:
        """Tell of spans of time at ASVs, (n,) each, which begin during a failure, and which are cut
        by one that comes later: two of (n,).  A failure at the end of a span cuts nothing of it.
        """
        whose, begins, ends = (np.asarray(it)[..., None] for it in (asvs, begins_s, ends_s))
        same = whose == self.asvs
        failed = same & (self.begin_s <= begins) & (begins < self.end_s)
        cut = same & (begins < self.begin_s) & (self.begin_s < ends)
        late: Flags = cut.any(axis=-1) & ~failed.any(axis=-1)
        return failed.any(axis=-1), late

    def next_change(self, time: float) -> float:
        """Return when (s) after an instant the next ASV fails or works again; infinite if none."""
        changes = np.concatenate((self.begin_s, self.end_s))
        later = changes[changes > time]
        return float(later.min()) if len(later) else np.inf


def failures_of(scenario: ScenarioKeys) -> Failures | None:
    """Return the failures of a scenario; None where no ASV fails."""
    given = scenario.asvs.failures
    if not given:
        return None
    return Failures(
        scenario.asvs.count,
        np.array([it.asv for it in given], dtype=np.intp),
        np.array([it.at_s for it in given]),
        np.array([np.inf if it.until_s is None else it.until_s for it in given]),
    )


def alive(scenario: ScenarioKeys, time: float) -> tuple[bool, ...]:
    """Return which ASVs of a scenario work at an instant (s), in the order of their numbers."""
    failed = {it.asv for it in scenario.asvs.failures if it.lasts(time)}
    return tuple(asv not in failed for asv in range(scenario.asvs.count))


def untenable(scenario: ScenarioKeys) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """Yield failures that cannot be: their key, why not, and the other keys that lead to it."""
    count, given = scenario.asvs.count, scenario.asvs.failures
    for number, failure in enumerate(given):
        key = f"asvs.failures.{number}"
        if failure.asv >= count:
            told = f"there is no ASV{failure.asv}: {count} ASVs are numbered from 0; use at most "
            yield f"{key}.asv", f"{told}{count - 1}", ("asvs.count",)
        if failure.until_s is not None and failure.until_s <= failure.at_s:
            told = f"must be later than at_s, which is {failure.at_s:g} s; got {failure.until_s:g}"
            yield f"{key}.until_s", told, (f"{key}.at_s",)
        for other in range(number):
            if given[other].asv == failure.asv and _meet(given[other], failure):
                told = f"fails while it has failed already (failure {other}); make one of both"
                yield f"{key}.at_s", f"ASV{failure.asv} {told}", (f"asvs.failures.{other}",)


def _meet(one: Failure, other: Failure) -> bool:
    first, second = sorted((one, other), key=lambda it: it.at_s)
    return first.lasts(second.at_s)
