"""Which ASVs of a scenario fail, and when; the whole fleet knows of it at once."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from .scenario_keys import ScenarioKeys
from .sections.failures import Failure

if TYPE_CHECKING:
    from ..vehicles.failures import Failures


def failures_of(scenario: ScenarioKeys) -> "Failures | None":
    """Return the failures of a scenario's ASVs; None where none fails."""
    given = scenario.asvs.failures
    if not given:
        return None
    import numpy as np  # which validating a scenario does not wait for

    from ..vehicles.failures import Failures

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


def no_such_asv(asv: int, count: int) -> str:
    """Return that there is no such ASV among so many.

    >>> no_such_asv(1, 1)
    'there is no ASV1: the only one is ASV0'
    """
    which = "the only one is ASV0" if count == 1 else f"the last is ASV{count - 1}"
    return f"there is no ASV{asv}: {which}"


def untenable(scenario: ScenarioKeys) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """Yield failures that cannot be: their key, why not, and the other keys that lead to it."""
    count, given = scenario.asvs.count, scenario.asvs.failures
    for number, failure in enumerate(given):
        key = f"asvs.failures.{number}"
        if failure.asv >= count:
            yield f"{key}.asv", no_such_asv(failure.asv, count), ("asvs.count",)
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
