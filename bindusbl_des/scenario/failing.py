"""Which ASVs of a scenario fail, and when; the whole fleet knows of it at once."""

from typing import TYPE_CHECKING

from .scenario_keys import ScenarioKeys

if TYPE_CHECKING:
    from ..vehicles.fleet import Failures


def failures_of(scenario: ScenarioKeys) -> "Failures | None":
    """Return the failures of a scenario's ASVs; None where none fails."""
    given = scenario.asvs.failures
    if not given:
        return None
    import numpy as np  # which validating a scenario does not wait for

    from ..vehicles.fleet import Failures

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
