"""What may be chosen: teams of ASVs, each a scenario that differs from the user's in some keys;
what they are predicted to be, and how wrong that may be.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ...campaigns.experiments.experiment import laid_over
from ...scenario.files.former_keys import key_now
from ...scenario.files.plain_yaml import read_yaml
from ...scenario.planned import asv_stations
from ...scenario.scenario import Scenario
from ...scenario.sections.vehicles import Formation
from ..prediction.inputs import Inputs, inputs_of
from ..prediction.parts import STATED_ERROR
from ..prediction.predicting import Prediction, predict
from ..question import ASV, Question
from ..selection.goals import Floats, Goal

# What may be chosen: teams of ASVs, each a scenario that differs from the user's in some keys.


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


# What candidates are predicted to be, and how wrong that may be.


# By what plans of one size are compared where no goal is predicted.
STANDARD = Goal("position_error_p95_m", below=1.0)


class Foresight:
    """Predictions of scenarios; what all placements of one have in common is worked out once."""

    def __init__(self, goals: Sequence[Goal]) -> None:
        self._goals = goals
        self._inputs: dict[str, Inputs | None] = {}
        self._made: dict[Candidate, Prediction | None] = {}

    def inputs(self, scenario: Scenario) -> Inputs | None:
        """Return what predictions of a scenario are made of; None where it cannot be predicted."""
        data = scenario.model_dump(mode="json")
        data["asvs"] = {**data["asvs"], "count": 0, "formation": None}
        key = json.dumps(data)
        if key not in self._inputs:
            try:
                self._inputs[key] = inputs_of(scenario)
            except ValueError:  # a part of somebody's own, of which nothing is known beforehand
                self._inputs[key] = None
        return self._inputs[key]

    def prediction(self, candidate: Candidate) -> Prediction | None:
        """Return the prediction of a candidate; None where there is none."""
        if candidate not in self._made:
            inputs = self.inputs(candidate.scenario)
            self._made[candidate] = None if inputs is None else predict(inputs, candidate.stations)
        return self._made[candidate]

    def values(self, candidate: Candidate) -> Floats:
        """Return the goals' values (g,) as predicted; nan where a metric is not."""
        prediction = self.prediction(candidate)
        return np.array([value_of(goal, prediction) for goal in self._goals])

    def rank(self, candidate: Candidate) -> float:
        """Return how far a candidate is from its goals: below 0 all are met; the less the better.

        It is the largest of the goals' logarithms of value over limit, or of limit over value where
        more is better.  Where no goal is predicted, that of the worst AUV's error.
        """
        values = self.values(candidate)
        known = [
            excess(goal, value)
            for goal, value in zip(self._goals, values.tolist(), strict=True)
            if value == value
        ]
        if known:
            return max(known)
        return excess(STANDARD, value_of(STANDARD, self.prediction(candidate)))


def value_of(goal: Goal, prediction: Prediction | None) -> float:
    """Return a goal's value as predicted; nan where its metric is not."""
    if prediction is None or goal.metric not in Prediction._fields:
        return math.nan
    if goal.of == "worst":
        return prediction.worst(goal.metric)
    return float(goal.of_fleets(getattr(prediction, goal.metric)[None])[0])


def excess(goal: Goal, value: float) -> float:
    """Return by how much a value misses a goal, as a logarithm; below 0 it does not.

    >>> excess(Goal("position_error_m", below=2.0), 1.0) < 0 < excess(STANDARD, 2.0)
    True
    """
    if value != value:
        return math.inf
    ratio = (value, goal.limit) if goal.is_below else (goal.limit, value)
    if min(ratio) <= 0:
        return math.inf if ratio[0] > ratio[1] else -math.inf
    return math.log(ratio[0] / ratio[1])


class Doubt(NamedTuple):
    """By how much predictions may be wrong, as a logarithm of the ratio to what is flown.

    Nine of ten keep to `mostly`, 99 of 100 to `hardly_more`.
    """

    mostly: float
    hardly_more: float


def doubt_of(metric: str) -> Doubt | None:
    """Return by how much predictions of a metric may be wrong; None where that is not known."""
    known = STATED_ERROR.get(metric)
    return None if known is None else Doubt(math.log1p(known.p90), math.log1p(known.p99))


def band(goal: Goal, value: float) -> tuple[float, float]:
    """Return between which values nine in ten flown teams lie that are predicted to be `value`; nan
    where that is not known.
    """
    doubt = doubt_of(goal.metric)
    if doubt is None:
        return math.nan, math.nan
    return value * math.exp(-doubt.mostly), value * math.exp(doubt.mostly)
