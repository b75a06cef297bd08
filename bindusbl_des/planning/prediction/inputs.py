"""What a prediction is made of: plain numbers and arrays, worked out once for many placements.

Where the ASVs are is not among them: :func:`.predicting.predict` takes that beside them, so that a
placement can be tried in milliseconds.  :meth:`Inputs.plain` is all that another program needs to
predict the same, in whatever language.
"""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ...scenario.scenario import Scenario
from .gathering import (
    access_of,
    approximations,
    fix_noise,
    hf_chances,
    mf_chances,
    navigator_of,
    slots_of,
    systematic_errors_of,
    ways_of,
)
from .parts import (
    AccessPlan,
    Chances,
    FixNoise,
    PlannedWays,
    PredictedNavigator,
    SlotLengths,
    SystematicErrors,
)


@dataclass(frozen=True)
class Inputs:
    """All that a prediction is made of but for the stations of the ASVs.

    `approximations` are sentences on what the prediction leaves out of the scenario.
    """

    duration_s: float
    ways: PlannedWays
    hf: Chances
    mf: Chances
    noise: FixNoise
    systematic: SystematicErrors
    slots: SlotLengths
    access: AccessPlan
    navigator: PredictedNavigator
    approximations: tuple[str, ...] = ()

    def plain(self) -> dict[str, Any]:
        """Return the same as plain data, as JSON can have it: nested names, lists and numbers."""
        return {name: _plain(value) for name, value in asdict(self).items()}


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _plain(own) for name, own in value.items() if not isinstance(own, type)}
    if isinstance(value, list | tuple):
        return [_plain(own) for own in value]
    return value.tolist() if isinstance(value, np.ndarray) else value


def inputs_of(scenario: Scenario) -> Inputs:
    """Return what the prediction of a scenario is made of.

    What does not depend on the placement of the ASVs is worked out once for all that differ in it.

    Raises:
        ValueError: when the route cannot be flown, the file of a channel cannot be read, or AUVs
            ping as they like, in no rounds, or come up to fix by GNSS.
    """
    if scenario.protocol.random_access:
        raise ValueError(
            f"protocol.schedule: {scenario.protocol.schedule} has no rounds to predict errors by; "
            "simulate it, or use a schedule with slots"
        )
    route, has_gnss = scenario.auvs.route, scenario.navigation.gnss_fix is not None
    if has_gnss and route.surfacing is not None:
        raise ValueError(
            "navigation.gnss_fix: what AUVs gain that come up to fix is not predicted; simulate it"
        )
    return Inputs(
        float(scenario.duration_s),
        ways_of(scenario),
        hf_chances(scenario),
        mf_chances(scenario),
        fix_noise(scenario),
        systematic_errors_of(scenario),
        slots_of(scenario),
        access_of(scenario),
        navigator_of(scenario),
        tuple(approximations(scenario)),
    )
