"""Where AUVs are going to be: what is planned for them, at even instants."""

from functools import lru_cache
from typing import Any

import numpy as np

from ....preflight.limits.planned_ways import planned_vehicles
from ....scenario.planned import route_of
from ....scenario.scenario import Scenario
from ..parts import Ways

# Instants so far apart (s), but for missions that would have fewer, or more, than these.
STEP_S, FEWEST, MOST = 2.5, 121, 361


class _Plan:
    """What decides the ways of a scenario's AUVs: placements of ASVs do not."""

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        water = scenario.environment.origin, route_of(scenario)
        self.key: tuple[Any, ...] = (scenario.survey, scenario.auvs, scenario.duration_s, *water)

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Plan) and self.key == other.key


def ways_of(scenario: Scenario) -> Ways:
    """Return where the AUVs of a scenario are going to be, if they keep to their plans.

    Those with dynamics are taken for vehicles without, at the speed that they are to go.

    Raises:
        ValueError: when the route cannot be flown.
    """
    return _ways(_Plan(scenario))


@lru_cache(maxsize=32)
def _ways(plan: _Plan) -> Ways:
    scenario = plan.scenario
    count = min(max(round(scenario.duration_s / STEP_S) + 1, FEWEST), MOST)
    times = np.linspace(0.0, scenario.duration_s, count)
    vehicles = planned_vehicles(scenario)
    return Ways(
        times,
        np.stack([vehicle.sample(times)[:, :2] for vehicle in vehicles]),
        np.stack([vehicle.heading_integral(times) for vehicle in vehicles]),
        np.array([scenario.survey.depth(auv) for auv in range(len(vehicles))]),
    )
