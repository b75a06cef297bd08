"""Run one mission: scenario in, tables out."""

from collections.abc import Callable

from ..results.result import Result
from ..scenario.scenario import Scenario
from .mission import Mission

# How often a mission tells how far it is.
PROGRESS_STEPS = 200


def simulate(
    scenario: Scenario, seed: int = 0, progress: Callable[[float], None] | None = None
) -> Result:
    """Run one mission of a scenario; return what happened, a table for each kind of event.

    `progress` is told the instant (s) of the mission now and then, which changes nothing of it.

    The mission covers [0, duration): what would happen at its last instant does not, and pings and
    fixes still under way then are recorded as in flight.  The same scenario and seed give the same
    tables.

    Raises:
        ValueError: when the seed is not a whole number >= 0, or the scenario names a schedule or
            track that cannot be used.
    """
    mission = Mission(scenario, seed)
    if progress is not None:
        for step in range(1, PROGRESS_STEPS):
            mission.advance(scenario.duration_s * step / PROGRESS_STEPS)
            progress(mission.time)
    return mission.result()
