"""Teams that may be the answer: proposed, priced, predicted, and excluded if they cannot be it.

A team is a scenario that differs from the user's in some keys.  What the user does not vary is
proposed: positions first, for each number of ASVs; then other schedules and downlinks with the best
of these.
"""

import json
import math
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations, product
from typing import Any

import numpy as np

from ...core.scenario import families
from ...core.scenario.files import former_keys
from ...core.scenario.scenario import Scenario
from ...core.setup import Setup
from ...support.arrays import Floats
from ...support.facts import cached_property
from ...support.plain_data import value_at
from ...support.plain_yaml import read_yaml
from ...support.wording import counted, plain
from ..advice.stations import Ways
from ..campaigns.experiments.experiment import laid_over
from .goals import Goal
from .placement import NOWHERE, free_places
from .prediction.gathering import inputs_of
from .prediction.inputs import STATED_ERROR, Inputs
from .prediction.predicting import Prediction, predict
from .question import ASV, COUNTS, Question, counts_of

Keys = Mapping[str, Any]

ASVS, RECORD = "asvs", "record"
COUNT, FORMATION, PLACEMENT = "asvs.count", "asvs.formation", "asvs.formation.model"
RADIUS, ANGLE = f"{FORMATION}.radius_m", f"{FORMATION}.angle_deg"
POSITIONS = f"{FORMATION}.positions_m"
SCHEDULE, DOWNLINK, REPLY = "protocol.schedule", "protocol.downlink", "protocol.downlink.reply"
SHORTEST_SLOT = "protocol.shortest_downlink_slot_s"

# The goal that ranks teams if none of the question's is predicted.
STANDARD = Goal("position_error_p95_m", below=1.0)


@dataclass(frozen=True, eq=False)
class Team:
    """Keys laid over a question's scenario, the resulting scenario, and its cost."""

    question: Question
    keys: Keys
    scenario: Scenario
    cost: float

    @cached_property
    def setup(self) -> Setup:
        """The facts of its scenario."""
        return Setup(self.scenario)

    @cached_property
    def stations(self) -> Floats:
        """The stations (n, 2; m) of its ASVs; empty if they move, or without ASVs."""
        return np.array(self.setup.kept_stations_m).reshape(-1, 2)

    @property
    def predicted_from(self) -> Floats:
        """The stations (n, 2; m) for predictions; without ASVs one that is out of all ranges."""
        return self.stations if self.asvs else np.array(NOWHERE)

    @property
    def moves(self) -> bool:
        """Whether its ASVs move: then it is simulated without a prediction."""
        return self.asvs > 0 and not len(self.stations)

    @property
    def asvs(self) -> int:
        """How many ASVs it has."""
        return self.scenario.asvs.count

    @property
    def is_moored(self) -> bool:
        """Whether its ASVs are moored, in a ring or at given positions."""
        return self.scenario.asvs.formation.moored is not None

    def changed(self, keys: Keys) -> "Team | None":
        """Return the team with further keys; None if they contradict the scenario."""
        return team_of(self.question, {**self.keys, **keys})

    def placed(self, places: Keys) -> "Team | None":
        """Return the team with other formation keys; None if they contradict the scenario."""
        kept = {key: value for key, value in self.keys.items() if not key.startswith(FORMATION)}
        return team_of(self.question, {**kept, **places})

    @cached_property
    def inputs(self) -> Inputs | None:
        """The inputs of its prediction; None if not predictable, or with peers but no ASV."""
        if not self.asvs and self.scenario.has_peers:
            return None
        return inputs_for(self.question, self.scenario)

    @cached_property
    def prediction(self) -> Prediction | None:
        """Its prediction, or None."""
        if self.inputs is None or self.moves:
            return None
        return predict(self.inputs, self.predicted_from)

    @cached_property
    def lost(self) -> list[tuple[int, ...]]:
        """The combinations of its ASVs that may be lost together; none if no ASV is left."""
        number = self.question.lost
        return list(combinations(range(self.asvs), number)) if 0 < number < self.asvs else []

    def losses(self) -> Iterator[Keys]:
        """Yield its keys with each loss: from the start, and from halfway with metrics since
        then.
        """
        halfway = self.scenario.duration_s / 2
        judged = f"{RECORD}.metrics_from_s"
        since = {0.0: {}, halfway: {judged: max(halfway, self.scenario.record.metrics_from_s)}}
        for lost, (at_s, after) in product(self.lost, since.items()):
            kept = [failure.model_dump(mode="json") for failure in self.scenario.asvs.failures
                    if failure.asv not in lost]  # fmt: skip
            failures = [*kept, *({"asv": asv, "at_s": at_s} for asv in lost)]
            yield {**self.keys, f"{ASVS}.failures": failures, **after}

    @cached_property
    def values(self) -> list[float]:
        """The predicted values of the goals, with lost vessels by the worst loss; nan if
        unknown.
        """
        return [self._value(goal) for goal in self.question.goals]

    @cached_property
    def _without(self) -> list[Prediction | None]:
        """The predictions of the team without each combination of lost vessels."""
        if self.inputs is None or self.moves:
            return [None] * len(self.lost)
        inputs, stations = self.inputs, self.stations
        return [
            predict(replace(inputs, noise=inputs.noise.without(lost)), np.delete(stations, lost, 0))
            for lost in self.lost
        ]

    def _value(self, goal: Goal) -> float:
        if not goal.lost or not self.lost:
            return value_of(goal, self.prediction)
        return max((value_of(goal, rest) for rest in self._without), key=partial(excess, goal))

    @cached_property
    def rank(self) -> float:
        """How far the team is predicted to be from its goals: below 0 all are met; less is better.

        The largest `excess` of a goal; if none is predicted, that of the worst AUV's error.
        """
        pairs = zip(self.question.goals, self.values, strict=True)
        known = [excess(goal, value) for goal, value in pairs if value == value]
        return max(known) if known else excess(STANDARD, value_of(STANDARD, self.prediction))

    @cached_property
    def bounds(self) -> tuple[float, float]:
        """The interval of its largest `excess` in 99 of 100 cases; inf if one is unknown."""
        low = high = -math.inf
        for goal, value in zip(self.question.goals, self.values, strict=True):
            error = STATED_ERROR.get(goal.metric)
            if value != value or error is None:
                high = math.inf
                continue
            far, off = excess(goal, value), math.log1p(error.p99)
            low, high = max(low, far - off), max(high, far + off)
        return low, high

    @property
    def words(self) -> str:
        """The number of vessels, their positions, and other chosen values, in words."""
        keys, formation = self.keys, self.scenario.asvs.formation
        places = " in the scenario's places" if self.asvs else ""
        if self.moves:
            places = f" on the move ({formation.choice})"
        elif (positions := keys.get(POSITIONS)) is not None:
            places = " at " + ", ".join(f"({x + 0.0:g}, {y + 0.0:g})" for x, y in positions)
        elif self.asvs == 1 and formation.moored is not None and not formation.moored.is_placed:
            is_there = self.setup.stations_m == (self.setup.area.centroid,)
            places = " in the middle" if is_there else " by the land in the middle"
        elif self.asvs > 1 and (radius := keys.get(RADIUS)) is not None:
            places = f" on a ring of {radius:g} m, the first at {keys.get(ANGLE) or 0:g} deg"
        chosen = [
            f"{key.rpartition('.')[2]} {plain(value)}"
            for key, value in keys.items()
            if key != COUNT and not key.startswith(FORMATION)
        ]
        return (
            f"{counted(self.asvs, 'ASV') if self.asvs else 'no ASV'}{', '.join([places, *chosen])}"
        )


def team_of(question: Question, keys: Keys) -> Team | None:
    """Return the team with these keys; None if they contradict the scenario."""
    try:
        scenario = laid_over(question.experiment.given, {"record.detail": "summary", **keys})
    except ValueError:
        return None
    return Team(question, {COUNT: scenario.asvs.count, **keys}, scenario, _cost(question, scenario))


def _cost(question: Question, scenario: Scenario) -> float:
    """Return the price of all ASVs and of values of keys."""
    total, data = scenario.asvs.count * question.costs[ASV], scenario.model_dump(mode="json")
    for item, price in question.costs.items():
        key, equals, value = item.partition("=")
        path = former_keys.key_now(key.strip()).split(".")
        if equals and value_at(data, path) == read_yaml(value, item).data:
            total += price
    return total


def inputs_for(question: Question, scenario: Scenario) -> Inputs | None:
    """Return the inputs of a scenario's prediction; None if it cannot be predicted.

    Scenarios that differ only in their ASVs' placement share them.
    """
    data = scenario.model_dump(mode="json")
    key = json.dumps({**data, "asvs": {**data["asvs"], "count": 0, "formation": None}})
    if key not in question.inputs:
        try:
            question.inputs[key] = inputs_of(Setup.of(scenario))
        except ValueError:  # not predictable
            question.inputs[key] = None
    return question.inputs[key]


def value_of(goal: Goal, prediction: Prediction | None) -> float:
    """Return the predicted value of a goal; nan if its metric is not predicted."""
    if prediction is None or goal.metric not in Prediction._fields:
        return math.nan
    if goal.of == "worst":
        return prediction.worst(goal.metric)
    return float(goal.of_fleets(getattr(prediction, goal.metric)[None])[0])


def excess(goal: Goal, value: float) -> float:
    """Return by how much a value misses a goal, as a logarithm; below 0 it meets the goal.

    It is the logarithm of value over limit, or of limit over value if more is better.

    >>> excess(Goal("position_error_m", below=2.0), 1.0) < 0 < excess(STANDARD, 2.0)
    True
    """
    if value != value:
        return math.inf
    above, below = (value, goal.limit) if goal.is_below else (goal.limit, value)
    if min(above, below) <= 0:
        return math.inf if above > below else -math.inf
    return math.log(above / below)


def band(goal: Goal, value: float) -> tuple[float, float]:
    """Return the interval that holds nine of ten simulated teams with this predicted value.

    nan if the metric has no stated error.
    """
    error = STATED_ERROR.get(goal.metric)
    if error is None:
        return math.nan, math.nan
    off = math.log1p(error.p90)
    return value * math.exp(-off), value * math.exp(off)


def narrowed(teams: Sequence[Team]) -> tuple[list[Team], list[dict[str, Any]]]:
    """Return the teams to simulate, the cheapest first, and rows of excluded ones.

    Excluded are teams that miss a goal, or are worse than another of the same cost, even with a
    prediction error that one in a hundred exceeds, and teams that lose all vessels.  The best of
    each cost and unpredictable teams stay.
    """
    by_cost: dict[float, list[Team]] = defaultdict(list)
    for team in teams:
        if team.lost or not team.asvs or not team.question.lost:
            by_cost[team.cost].append(team)
    flown, hopeless, outdone = list[Team](), 0, 0
    gone = len(teams) - sum(map(len, by_cost.values()))
    for _, equals in sorted(by_cost.items()):
        best, *others = sorted(equals, key=lambda team: team.rank)
        flown.append(best)
        sure = min(high for _, high in (team.bounds for team in equals))
        for team in others:
            low, _ = team.bounds
            if low > sure:
                outdone += 1
            elif low > 0:
                hopeless += 1
            else:
                flown.append(team)
    worse = "worse than another of the same cost by more than both may be wrong"
    reasons = {"predicted to miss a goal by more than the prediction may be wrong": hopeless,
               f"predicted to be {worse}": outdone,
               "no vessel would be left where so many are lost": gone}  # fmt: skip
    return flown, [
        {"told": f"{counted(count, 'candidate')}: {why}", "count": count}
        for why, count in reasons.items()
        if count
    ]


def ring_keys(question: Question, radius: float, angle: float) -> dict[str, Any]:
    """Return the keys of a regular formation with a radius (m) and an angle (deg)."""
    return {**unplaced(question), RADIUS: radius, ANGLE: angle}


def place_keys(question: Question, places: Floats) -> dict[str, Any]:
    """Return the keys of ASVs at positions (n, 2; m)."""
    undone = _taken_back(question, "model", "radius_m", "positions_deg")
    return {**undone, COUNT: len(places), POSITIONS: places.round(3).tolist()}


def unplaced(question: Question) -> dict[str, Any]:
    """Return the keys that unset the scenario's positions, if it has any."""
    return _taken_back(question, "model", "positions_m", "positions_deg")


def _taken_back(question: Question, *names: str) -> dict[str, Any]:
    """Return the keys that unset named values of the scenario's formation, if it has them."""
    asked = question.base.asvs.formation
    given = [name for name in names if getattr(asked, name, None) is not None]
    keys: dict[str, Any] = {f"{FORMATION}.{name}": None for name in given}
    if getattr(asked, "clearance_m", 0.0):
        keys[f"{FORMATION}.clearance_m"] = 0.0
    return keys


# The largest suggested number.
MOST_ASVS = 12


def further(tried: Sequence[Team]) -> str:
    """Return in a sentence how many more ASVs are predicted to suffice; "" if unknown.

    They have the nearest team's other keys, in the regular formation that covers best.
    """
    nearest = min(tried, key=lambda team: team.rank)
    if not nearest.is_moored or nearest.prediction is None:
        return ""
    most = max(team.asvs for team in tried)
    for count in range(most + 1, MOST_ASVS + 1):
        radius, angle = Ways(nearest.scenario).best(count)
        team = nearest.placed({**ring_keys(nearest.question, radius, angle), COUNT: count})
        if team is not None and team.rank < 0:
            return (
                f"{counted(count, 'ASV')} on a ring of {radius:g} m, the first at {angle:g} deg, "
                "are predicted to meet the goal."
            )
    return f"Not even {MOST_ASVS} ASVs are predicted to meet the goal." if most < MOST_ASVS else ""


# Proposed if the user varies no schedule or downlink.
SCHEDULES = tuple(name for name, traits in families.SCHEDULE.traits.items() if traits.is_proposed)
DOWNLINKS = tuple(families.DOWNLINK.traits)

# The most pairs of both to simulate beside the scenario's own, the best predicted ones.
MOST_PROTOCOLS = 3

# The predicted formations of each number of ASVs: radii up to the survey's corner, and angles
# within the formation's symmetry.
RADII, ANGLES = 8, 4
# The most combinations of points and numbers of ASVs; beyond, coverage alone decides formations.
MOST_PREDICTED = 60

# The most ASVs to place; more keep the scenario's positions.
MOST_PLACED = 50


def proposed(question: Question, on_progress: Callable[[str], object]) -> list[Team]:
    """Return all teams of a question: the user's points, each with its proposed variations.

    `on_progress` is called with text on the progress.
    """
    # Direct replies without airtime exist in no modem.
    points = [
        {**point, REPLY: "frame"} if is_instant(question, point) else point
        for point in question.experiment.points
    ]
    widely = len(points) * (1 if question.listed else len(COUNTS)) > MOST_PREDICTED
    found: list[Team] = []
    for number, point in enumerate(points, start=1):
        on_progress(f"proposing teams, {number} of {counted(len(points), 'choice')}")
        found += (_as_listed if question.listed else _about)(question, point, widely)
    unlike = {team.scenario.model_dump_json(): team for team in reversed(found)}
    return list(unlike.values())[::-1]


def is_instant(question: Question, point: Keys) -> bool:
    """Tell whether a point has direct replies without airtime."""
    team = team_of(question, point)
    return team is not None and not team.scenario.protocol.answer.takes_airtime


def _as_listed(question: Question, point: Keys, widely: bool) -> Iterator[Team]:
    """Yield the team of a listed point, and other placements if nothing gives one."""
    team = team_of(question, point)
    if team is None:
        return
    yield team
    if not (_is_placed(point) or question.experiment.given.get("asvs", {}).get("formation")):
        yield from _elsewhere(team, widely)


def _is_placed(point: Keys) -> bool:
    """Tell whether a point gives positions, not only the kind of placement."""
    return any(key.startswith(FORMATION) and key != PLACEMENT for key in point)


def _about(question: Question, point: Keys, widely: bool) -> Iterator[Team]:
    """Yield the teams of one point."""
    base = team_of(question, point)
    if base is None:
        return
    counts = counts_of(point, base.scenario, question.listed)
    for count in [{COUNT: count} for count in counts] if len(counts) > 1 else [{}]:
        # positions of another number of ASVs do not fit, and are unset
        team = team_of(question, {**point, **count}) or team_of(
            question, {**point, **count, **unplaced(question)}
        )
        if team is None:
            continue
        # A kind of placement without positions still gets proposed ones.
        places = [team] if _is_placed(point) else [team, *_elsewhere(team, widely)]
        yield from places
        if not team.asvs:  # without ASVs there are no rounds
            continue
        best = min(places, key=lambda team: team.rank)
        others = [best.changed(protocol) for protocol in _protocols(base.setup, point)]
        ranked = sorted(filter(None, others), key=lambda team: team.rank)[:MOST_PROTOCOLS]
        yield from _unlike([best, *ranked])


def _elsewhere(team: Team, widely: bool) -> Iterator[Team]:
    """Yield a team's best rings, by coverage and prediction, and the positions that cover most."""
    if not team.is_moored or not 0 < team.asvs <= MOST_PLACED:
        return
    question, area, inputs = team.question, team.setup.area, team.inputs
    if team.asvs > 1:
        ring = team.placed(ring_keys(question, *Ways(team.scenario).best(team.asvs)))
        yield from filter(None, [ring])
    if widely or inputs is None:
        return
    if team.asvs > 1:
        corner = max(math.dist(area.centroid, place) for place in area.outline)
        radii = [float(f"{corner * k / RADII:.3g}") for k in range(1, RADII + 1)]
        angles = [round(360 * k / team.asvs / ANGLES, 1) for k in range(ANGLES)]
        rings = (team.placed(ring_keys(question, *ring)) for ring in product(radii, angles))
        yield from sorted(filter(None, rings), key=lambda team: team.rank)[:1]
    places = free_places(team.setup, team.asvs, "coverage", inputs)
    yield from filter(None, [team.placed(place_keys(question, places))])


def _unlike(teams: Sequence[Team]) -> Iterator[Team]:
    """Yield teams that differ only in protocols, without the first and those of equal predictions.

    A schedule changes nothing, for instance, if no two AUVs may ever share a slot.
    """
    known = set[tuple[str, bytes]]()
    for number, team in enumerate(teams):
        if team.prediction is not None:
            arrays = b"".join(array.tobytes() for array in team.prediction)
            found = str(team.scenario.protocol.downlink), arrays
            if found in known:
                continue
            known.add(found)
        if number:
            yield team


def _protocols(setup: Setup, point: Keys) -> Iterator[dict[str, Any]]:
    """Yield keys of other schedules and downlinks, and of downlink slots as short as their frames.

    Nothing if the user names both.
    """
    scenario = setup.scenario
    protocol = scenario.protocol
    if protocol.asvs_ping:  # with passive ranging no AUV pings
        return
    own = protocol.schedule, protocol.downlink
    is_alone = scenario.auvs.count == 1
    schedules = own[:1] if SCHEDULE in point or is_alone else dict.fromkeys((own[0], *SCHEDULES))
    downlinks = own[1:] if DOWNLINK in point else dict.fromkeys((own[1], *DOWNLINKS))
    # A downlink slot by default lasts ten times the travel time across the survey.
    is_named = {SCHEDULE, DOWNLINK} <= point.keys() or SHORTEST_SLOT in point
    is_named |= protocol.shortest_downlink_slot_s is not None
    waits = not is_named and (
        setup.slots.shortest_downlink > setup.slots.frame_slot(scenario.auvs.count)
    )
    for schedule, downlink in product(schedules, downlinks):
        changed = {SCHEDULE: (schedule, own[0]), DOWNLINK: (downlink, own[1])}
        keys = {key: new for key, (new, old) in changed.items() if new != old}
        yield from [keys] if keys else []
        if waits and not families.DOWNLINK.declared(downlink).replies:
            yield {**keys, SHORTEST_SLOT: 0.0}
