"""Run one mission: scenario in, tables out."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from ..scenario.scenario import Scenario

if TYPE_CHECKING:
    from ..results.result import Result

# Number of steps at which a mission reports its progress
PROGRESS_STEPS = 200


def simulate(
    scenario: Scenario | str | Path,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    *,
    allow_plugins: bool = False,
) -> "Result":
    """Run one mission of a scenario; return what happened, a table for each kind of event.

    `scenario` may be the path of a scenario file, or the name of one that ships, read as by
    `load_scenario`: plug-ins that it names are loaded with `allow_plugins` only.  `progress` is
    called now and then with the instant (s) of the mission, and changes nothing.

    The mission covers [0, duration): what would happen at its last instant does not, and pings and
    fixes still under way then are recorded as in flight.  The same scenario and seed give the same
    tables.

    Raises:
        ScenarioError: when the scenario file cannot be read or used.
        TypeError: when `scenario` is neither a scenario nor a path.
        ValueError: when the seed is not a whole number >= 0, or the scenario names a schedule or
            track that cannot be used.
    """
    from .mission import Mission  # and with it all that happens in one: half a second

    mission = Mission(scenario, seed, allow_plugins=allow_plugins)
    if progress is not None:
        duration_s = mission.scenario.duration_s
        for step in range(1, PROGRESS_STEPS):
            mission.advance(duration_s * step / PROGRESS_STEPS)
            progress(mission.time)
    result = mission.result()
    mission.env.end()
    return result
