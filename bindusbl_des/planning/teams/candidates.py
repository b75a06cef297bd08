"""What may be chosen: teams of ASVs, each a scenario that differs from the user's in some keys."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...campaigns.experiments.experiment import laid_over
from ...scenario.files.former_keys import key_now
from ...scenario.files.plain_yaml import read_yaml
from ...scenario.planned import asv_stations
from ...scenario.scenario import Scenario
from ...scenario.sections.vehicles import Formation
from ..questions.question import ASV, Question
from ..selection.goals import Floats

Keys = Mapping[str, Any]

COUNT, FORMATION = "asvs.count", "asvs.formation"
SCHEDULE, DOWNLINK, REPLY = "protocol.schedule", "protocol.downlink", "protocol.downlink.reply"


@dataclass(frozen=True, eq=False)
class Candidate:
    """A team: the keys that it sets, the scenario that they make, and what it costs."""

    keys: Keys
    scenario: Scenario
    cost: float

    @cached_property
    def stations(self) -> Floats:
        """Where its ASVs keep station (n, 2), m."""
        return np.array(asv_stations(self.scenario))

    @property
    def is_ring(self) -> bool:
        """Whether its ASVs are moored in a regular formation."""
        asked = self.scenario.asvs.formation
        return isinstance(asked, Formation) and not asked.is_placed

    @property
    def asvs(self) -> int:
        """How many ASVs it has."""
        return self.scenario.asvs.count


def candidate(question: Question, keys: Keys) -> Candidate | None:
    """Return the candidate that sets these keys; None where they contradict the scenario."""
    try:
        scenario = laid_over(question.experiment.given, {"record.detail": "summary", **keys})
    except ValueError:
        return None
    return Candidate({COUNT: scenario.asvs.count, **keys}, scenario, _cost(question, scenario))


def _cost(question: Question, scenario: Scenario) -> float:
    """Return the price of all ASVs, and of what else has one."""
    total = scenario.asvs.count * question.costs[ASV]
    for item, price in question.costs.items():
        key, equals, value = item.partition("=")
        if equals and _value(scenario, key_now(key.strip())) == read_yaml(value, item).data:
            total += price
    return total


def _value(scenario: Scenario, key: str) -> Any:
    """Return the value of a dotted key; None where there is no such key."""
    value: Any = scenario.model_dump(mode="json")
    for part in key.split("."):
        value = value.get(part) if isinstance(value, dict) else None
    return value
