"""What is worth knowing of ASVs that fail: failures that never come, and nobody left."""

from collections.abc import Iterator

from ..scenario.agreement.problem import Problem
from ..scenario.failing import alive
from ..scenario.scenario import Scenario


def failing(scenario: Scenario) -> Iterator[Problem]:
    """Yield failures that have no effect, and instants from which no ASV works."""
    given, end = scenario.asvs.failures, float(scenario.duration_s)
    told: set[float] = set()  # several may fail at one instant
    for number, failure in enumerate(given):
        key = f"asvs.failures.{number}.at_s"
        if failure.at_s >= end:
            yield Problem(
                key,
                f"has no effect: the mission ends at {end:g} s, before {failure.at_s:g} s; "
                "remove it",
                ("duration_s",),
            )
        elif failure.at_s not in told and not any(alive(scenario, failure.at_s)):
            told.add(failure.at_s)
            yield Problem(
                key,
                f"leaves no ASV at {failure.at_s:g} s: until one works again nobody begins a "
                "round, and AUVs keep to dead reckoning",
                ("asvs.count",),
            )
