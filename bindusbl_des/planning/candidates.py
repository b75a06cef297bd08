"""What may be chosen: teams of ASVs, each a scenario that differs from the user's in some keys;
what they are predicted to be, how wrong that may be, and which of them are worth flying.
"""

import json
import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..advice.stations import Ways
from ..campaigns.experiments.experiment import laid_over
from ..core.arrays import Floats
from ..core.facts import cached_property
from ..core.plain_data import value_at
from ..core.plain_yaml import read_yaml
from ..core.wording import counted, plain
from ..scenario.files import former_keys
from ..scenario.scenario import Scenario
from ..setup import Setup
from .prediction.gathering import inputs_of
from .prediction.inputs import STATED_ERROR, Inputs
from .prediction.predicting import Prediction, predict
from .question import ASV, Question
from .selection.goals import Goal

Keys = Mapping[str, Any]

COUNT, FORMATION, PLACEMENT = "asvs.count", "asvs.formation", "asvs.formation.model"
SCHEDULE, DOWNLINK, REPLY = "protocol.schedule", "protocol.downlink", "protocol.downlink.reply"
SHORTEST_SLOT = "protocol.shortest_downlink_slot_s"


@dataclass(frozen=True, eq=False)
class Candidate:
    """A team: the keys that it sets, the scenario that they make, and what it costs."""

    keys: Keys
    scenario: Scenario
    cost: float

    @cached_property
    def setup(self) -> Setup:
        """The facts of its scenario."""
        return Setup(self.scenario)

    @cached_property
    def stations(self) -> Floats:
        """Where its ASVs keep station (n, 2), m; none where they move."""
        return np.array(self.setup.kept_stations_m).reshape(-1, 2)

    @property
    def moves(self) -> bool:
        """Whether its ASVs move: then nothing is predicted, and it is flown."""
        return not len(self.stations)

    @property
    def is_ring(self) -> bool:
        """Whether its ASVs are moored in a regular formation."""
        asked = self.scenario.asvs.formation.moored
        return asked is not None and not asked.is_placed

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
        if equals:
            data, path = (
                scenario.model_dump(mode="json"),
                former_keys.key_now(key.strip()).split("."),
            )
            if value_at(data, path) == read_yaml(value, item).data:
                total += price
    return total


# By what plans of one size are compared where no goal is predicted.
STANDARD = Goal("position_error_p95_m", below=1.0)


class Predictor:
    """Predictions of scenarios; what all placements of one have in common is worked out once."""

    def __init__(self, goals: Sequence[Goal]) -> None:
        self._goals = goals
        self._inputs: dict[str, Inputs | None] = {}
        self._made: dict[Candidate, Prediction | None] = {}

    def inputs(self, scenario: Scenario) -> Inputs | None:
        """Return what predictions of a scenario are made of; None where it cannot be predicted."""
        setup = Setup.of(scenario)
        data = scenario.model_dump(mode="json")
        data["asvs"] = {**data["asvs"], "count": 0, "formation": None}
        key = json.dumps(data)
        if key not in self._inputs:
            try:
                self._inputs[key] = inputs_of(setup)
            except ValueError:  # a part of somebody's own, of which nothing is known beforehand
                self._inputs[key] = None
        return self._inputs[key]

    def prediction(self, candidate: Candidate) -> Prediction | None:
        """Return the prediction of a candidate; None where there is none."""
        if candidate not in self._made:
            inputs = self.inputs(candidate.scenario)
            if inputs is None or candidate.moves:
                self._made[candidate] = None
            else:
                self._made[candidate] = predict(inputs, candidate.stations)
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


class PredictionDoubt(NamedTuple):
    """By how much predictions may be wrong, as a logarithm of the ratio to what is flown.

    Nine of ten keep to `mostly`, 99 of 100 to `hardly_more`.
    """

    mostly: float
    hardly_more: float


def doubt_of(metric: str) -> PredictionDoubt | None:
    """Return by how much predictions of a metric may be wrong; None where that is not known."""
    known = STATED_ERROR.get(metric)
    return None if known is None else PredictionDoubt(math.log1p(known.p90), math.log1p(known.p99))


def band(goal: Goal, value: float) -> tuple[float, float]:
    """Return between which values nine in ten flown teams lie that are predicted to be `value`; nan
    where that is not known.
    """
    doubt = doubt_of(goal.metric)
    if doubt is None:
        return math.nan, math.nan
    return value * math.exp(-doubt.mostly), value * math.exp(doubt.mostly)


@dataclass(frozen=True)
class LeftOut:
    """Candidates that are not flown, and why."""

    words: str
    candidates: tuple[Candidate, ...]


@dataclass(frozen=True)
class _Range:
    """How far a candidate is from its goals (`excess`, a logarithm): in 99 of 100 from `low` to
    `high`.
    """

    low: float
    high: float


def narrowed(
    candidates: Sequence[Candidate], predictor: Predictor, goals: Sequence[Goal]
) -> tuple[list[Candidate], list[LeftOut]]:
    """Return the candidates to fly, the cheapest first, and those that are left out, with reasons.

    Left out is what misses a goal even if it is predicted as wrongly as one in a hundred is, and
    what is worse than another of the same cost even if both are.  The best of each cost is flown in
    any case, and so is what cannot be predicted.
    """
    ranges = {team: _range(team, predictor, goals) for team in candidates}
    by_cost: dict[float, list[Candidate]] = defaultdict(list)
    for team in candidates:
        by_cost[team.cost].append(team)
    flown: list[Candidate] = []
    hopeless: list[Candidate] = []
    outdone: list[Candidate] = []
    for _, equals in sorted(by_cost.items()):
        ranked = sorted(equals, key=predictor.rank)
        sure = min(ranges[equal].high for equal in equals)
        for team in ranked:
            if team is ranked[0]:
                flown.append(team)
            elif ranges[team].low > sure:
                outdone.append(team)
            elif ranges[team].low > 0:
                hopeless.append(team)
            else:
                flown.append(team)
    return flown, [
        *_left_out(hopeless, "predicted to miss a goal by more than the prediction may be wrong"),
        *_left_out(
            outdone,
            "predicted to be worse than another of the same cost by more than both may be wrong",
        ),
    ]


def _left_out(candidates: Iterable[Candidate], why: str) -> list[LeftOut]:
    found = tuple(candidates)
    return [LeftOut(f"{counted(len(found), 'candidate')}: {why}", found)] if found else []


def _range(candidate: Candidate, predictor: Predictor, goals: Sequence[Goal]) -> _Range:
    """Return how far a candidate may be from its goals; infinitely wide where one is unknown."""
    low, high = -math.inf, -math.inf
    for goal, value in zip(goals, predictor.values(candidate).tolist(), strict=True):
        doubt = doubt_of(goal.metric)
        if value != value or doubt is None:
            high = math.inf
            continue
        far = excess(goal, value)
        low, high = max(low, far - doubt.hardly_more), max(high, far + doubt.hardly_more)
    return _Range(low, high)


def ring_keys(question: Question, radius: float, angle: float) -> dict[str, Any]:
    """Return the keys of a regular formation of a radius (m) and an angle (deg)."""
    ring = {f"{FORMATION}.radius_m": radius, f"{FORMATION}.angle_deg": angle}
    return {**_taken_back(question, "model", "positions_m", "positions_deg"), **ring}


def place_keys(question: Question, places: Floats) -> dict[str, Any]:
    """Return the keys of ASVs at places (n, 2), m."""
    positions = {COUNT: len(places), f"{FORMATION}.positions_m": places.round(3).tolist()}
    return {**_taken_back(question, "model", "radius_m", "positions_deg"), **positions}


def unplaced(question: Question) -> dict[str, Any]:
    """Return the keys that take back the positions of the scenario, where it gives any."""
    return _taken_back(question, "model", "positions_m", "positions_deg")


def placed(question: Question, keys: Keys, places: dict[str, Any]) -> Candidate | None:
    """Return a team whose keys put it somewhere else; None where that is no scenario."""
    kept = {key: value for key, value in keys.items() if not key.startswith(FORMATION)}
    return candidate(question, {**kept, **places})


def _taken_back(question: Question, *names: str) -> dict[str, Any]:
    """Return the keys that undo what the scenario says of its formation, where it says that."""
    asked = question.base.asvs.formation
    given = [name for name in names if getattr(asked, name, None) is not None]
    keys: dict[str, Any] = {f"{FORMATION}.{name}": None for name in given}
    if getattr(asked, "clearance_m", 0.0):
        keys[f"{FORMATION}.clearance_m"] = 0.0
    return keys


# Nobody is asked to send more.
MOST_ASVS = 12


def further(question: Question, tried: Sequence[Candidate], predictor: Predictor) -> str:
    """Return in a sentence how many more ASVs are predicted to be enough; empty if that is unknown.

    They are those of the nearest team, in the regular formation that covers best.
    """
    nearest = min(tried, key=predictor.rank)
    if nearest.scenario.asvs.formation.moored is None:
        return ""
    if predictor.prediction(nearest) is None:
        return ""
    most = max(team.asvs for team in tried)
    for count in range(most + 1, MOST_ASVS + 1):
        radius, angle = Ways(nearest.scenario).best(count)
        ring = ring_keys(question, radius, angle)
        team = placed(question, {**nearest.keys, COUNT: count}, ring)
        if team is not None and predictor.rank(team) < 0:
            return (
                f"{counted(count, 'ASV')} on a ring of {radius:g} m, the first at {angle:g} deg, "
                "are predicted to meet the goal."
            )
    return f"Not even {MOST_ASVS} ASVs are predicted to meet the goal." if most < MOST_ASVS else ""


def team_text(candidate: Candidate) -> str:
    """Return a team in words: how many vessels, where, and what else is chosen."""
    keys = candidate.keys
    names = ("radius_m", "angle_deg", "positions_m")
    radius, angle, positions = (keys.get(f"{FORMATION}.{name}") for name in names)
    places = " in the scenario's places"
    if candidate.moves:
        places = f" on the move ({candidate.scenario.asvs.formation.choice})"
    elif positions is not None:
        places = " at " + ", ".join(f"({x + 0.0:g}, {y + 0.0:g})" for x, y in positions)
    elif candidate.asvs == 1:
        places = " in the middle" if candidate.is_ring else places
    elif radius is not None:
        places = f" on a ring of {radius:g} m, the first at {angle or 0:g} deg"
    others = {
        key: value for key, value in keys.items() if key != COUNT and not key.startswith(FORMATION)
    }
    chosen = ", ".join(f"{key.rpartition('.')[2]} {plain(value)}" for key, value in others.items())
    return f"{counted(candidate.asvs, 'ASV')}{places}{f', {chosen}' if chosen else ''}"
