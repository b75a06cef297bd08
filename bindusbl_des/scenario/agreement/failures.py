"""What failures of ASVs must agree on: there is such an ASV, and it fails once at a time."""

from collections.abc import Iterator

from ..scenario_keys import ScenarioKeys
from ..sections.failures import Failure
from .problem import Problem


def no_such_asv(asv: int, count: int) -> str:
    """Return that there is no such ASV among so many.

    >>> no_such_asv(1, 1)
    'there is no ASV1: the only one is ASV0'
    """
    which = "the only one is ASV0" if count == 1 else f"the last is ASV{count - 1}"
    return f"there is no ASV{asv}: {which}"


def problems(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield failures that cannot be."""
    count, given = scenario.asvs.count, scenario.asvs.failures
    for number, failure in enumerate(given):
        key = f"asvs.failures.{number}"
        if failure.asv >= count:
            yield Problem(f"{key}.asv", no_such_asv(failure.asv, count), ("asvs.count",))
        if failure.until_s is not None and failure.until_s <= failure.at_s:
            told = f"must be later than at_s, which is {failure.at_s:g} s; got {failure.until_s:g}"
            yield Problem(f"{key}.until_s", told, (f"{key}.at_s",))
        for other in range(number):
            if given[other].asv == failure.asv and _meet(given[other], failure):
                yield Problem(
                    f"{key}.at_s",
                    f"ASV{failure.asv} fails while it has failed already (failure {other}); make "
                    "one of both",
                    (f"asvs.failures.{other}",),
                )


def _meet(one: Failure, other: Failure) -> bool:
    first, second = sorted((one, other), key=lambda it: it.at_s)
    return first.lasts(second.at_s)
