"""Teams that may be the answer: proposed, priced, predicted, and left out where they cannot be it.

A team is a scenario that differs from the user's in some keys.  What the user does not vary is
proposed: places first, for each number of ASVs by themselves; other schedules and downlinks are
then tried with the best of these.
"""

import json
import math
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
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

# By what teams are compared where no goal is predicted.
STANDARD = Goal("position_error_p95_m", below=1.0)


@dataclass(frozen=True, eq=False)
class Team:
    """Keys laid over a question's scenario, the scenario that they make, and what it costs."""

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
        """Where its ASVs keep station (n, 2), m; none where they move, or there is none."""
        return np.array(self.setup.kept_stations_m).reshape(-1, 2)

    @property
    def predicted_from(self) -> Floats:
        """The stations (n, 2), m, that predictions are made with: of a team without any ASV one
        that is out of all ranges.
        """
        return self.stations if self.asvs else np.array(NOWHERE)

    @property
    def moves(self) -> bool:
        """Whether its ASVs move: then nothing is predicted, and it is flown."""
        return self.asvs > 0 and not len(self.stations)

    @property
    def asvs(self) -> int:
        """How many ASVs it has."""
        return self.scenario.asvs.count

    @property
    def is_moored(self) -> bool:
        """Whether its ASVs are moored, in a ring or at places."""
        return self.scenario.asvs.formation.moored is not None

    def changed(self, keys: Keys) -> "Team | None":
        """Return it with other keys; None where they contradict the scenario."""
        return team_of(self.question, {**self.keys, **keys})

    def placed(self, places: Keys) -> "Team | None":
        """Return it with keys that put it elsewhere; None where they contradict the scenario."""
        kept = {key: value for key, value in self.keys.items() if not key.startswith(FORMATION)}
        return team_of(self.question, {**kept, **places})

    @cached_property
    def inputs(self) -> Inputs | None:
        """What its prediction is made of; None where it cannot be predicted, as of AUVs that have
        each other alone.
        """
        if not self.asvs and self.scenario.has_peers:
            return None
        return inputs_for(self.question, self.scenario)

    @cached_property
    def prediction(self) -> Prediction | None:
        """What is predicted of it; None where nothing is."""
        if self.inputs is None or self.moves:
            return None
        return predict(self.inputs, self.predicted_from)

    @cached_property
    def lost(self) -> list[tuple[int, ...]]:
        """Which of its ASVs may be lost together, by the question; none where that is none."""
        number = self.question.lost
        return list(combinations(range(self.asvs), number)) if 0 < number < self.asvs else []

    def losses(self) -> Iterator[Keys]:
        """Yield the keys of it with each loss: from the start on, and halfway, judged from then."""
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
        """The goals' values as predicted, with vessels lost the worst of each loss from the start
        on; nan where a metric is not.
        """
        return [self._value(goal) for goal in self.question.goals]

    @cached_property
    def _without(self) -> list[Prediction | None]:
        """What is predicted of it without each of the vessels that may be lost."""
        if self.inputs is None or self.moves:
            return [None] * len(self.lost)
        rests = (np.delete(self.stations, lost, axis=0) for lost in self.lost)
        return [predict(self.inputs, rest) for rest in rests]

    def _value(self, goal: Goal) -> float:
        if not goal.lost or not self.lost:
            return value_of(goal, self.prediction)
        return max((value_of(goal, rest) for rest in self._without), key=partial(excess, goal))

    @cached_property
    def rank(self) -> float:
        """How far it is predicted to be from its goals: below 0 all are met; the less the better.

        The largest `excess` of a goal; where none is predicted, that of the worst AUV's error.
        """
        pairs = zip(self.question.goals, self.values, strict=True)
        known = [excess(goal, value) for goal, value in pairs if value == value]
        return max(known) if known else excess(STANDARD, value_of(STANDARD, self.prediction))

    @cached_property
    def bounds(self) -> tuple[float, float]:
        """Between which two its largest `excess` lies in 99 of 100; inf where one is unknown."""
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
        """How many vessels, where, and what else is chosen."""
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
    """Return the team that sets these keys; None where they contradict the scenario."""
    try:
        scenario = laid_over(question.experiment.given, {"record.detail": "summary", **keys})
    except ValueError:
        return None
    return Team(question, {COUNT: scenario.asvs.count, **keys}, scenario, _cost(question, scenario))


def _cost(question: Question, scenario: Scenario) -> float:
    """Return the price of all ASVs, and of what else has one."""
    total, data = scenario.asvs.count * question.costs[ASV], scenario.model_dump(mode="json")
    for item, price in question.costs.items():
        key, equals, value = item.partition("=")
        path = former_keys.key_now(key.strip()).split(".")
        if equals and value_at(data, path) == read_yaml(value, item).data:
            total += price
    return total


def inputs_for(question: Question, scenario: Scenario) -> Inputs | None:
    """Return what predictions of a scenario are made of; None where it cannot be predicted.

    All that differ in their places alone have the same.
    """
    data = scenario.model_dump(mode="json")
    key = json.dumps({**data, "asvs": {**data["asvs"], "count": 0, "formation": None}})
    if key not in question.inputs:
        try:
            question.inputs[key] = inputs_of(Setup.of(scenario))
        except ValueError:  # a user-defined part, of which nothing is known beforehand
            question.inputs[key] = None
    return question.inputs[key]


def value_of(goal: Goal, prediction: Prediction | None) -> float:
    """Return a goal's value as predicted; nan where its metric is not."""
    if prediction is None or goal.metric not in Prediction._fields:
        return math.nan
    if goal.of == "worst":
        return prediction.worst(goal.metric)
    return float(goal.of_fleets(getattr(prediction, goal.metric)[None])[0])


def excess(goal: Goal, value: float) -> float:
    """Return by how much a value misses a goal, as a logarithm; below 0 it does not.

    It is that of the value over the limit, or of the limit over the value where more is better.

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
    """Return between which values nine in ten flown teams lie that are predicted to be `value`; nan
    where that is not known.
    """
    error = STATED_ERROR.get(goal.metric)
    if error is None:
        return math.nan, math.nan
    off = math.log1p(error.p90)
    return value * math.exp(-off), value * math.exp(off)


def narrowed(teams: Sequence[Team]) -> tuple[list[Team], list[dict[str, Any]]]:
    """Return the teams to fly, the cheapest first, and why how many are left out.

    Left out is what misses a goal even if it is predicted as wrongly as one in a hundred is, and
    what is worse than another of the same cost even if both are.  The best of each cost is flown in
    any case, and so is what cannot be predicted.  Teams of which no vessel would be left are not.
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
    """Return the keys of a regular formation of a radius (m) and an angle (deg)."""
    return {**unplaced(question), RADIUS: radius, ANGLE: angle}


def place_keys(question: Question, places: Floats) -> dict[str, Any]:
    """Return the keys of ASVs at places (n, 2), m."""
    undone = _taken_back(question, "model", "radius_m", "positions_deg")
    return {**undone, COUNT: len(places), POSITIONS: places.round(3).tolist()}


def unplaced(question: Question) -> dict[str, Any]:
    """Return the keys that take back the positions of the scenario, where it gives any."""
    return _taken_back(question, "model", "positions_m", "positions_deg")


def _taken_back(question: Question, *names: str) -> dict[str, Any]:
    """Return the keys that undo what the scenario says of its formation, where it says that."""
    asked = question.base.asvs.formation
    given = [name for name in names if getattr(asked, name, None) is not None]
    keys: dict[str, Any] = {f"{FORMATION}.{name}": None for name in given}
    if getattr(asked, "clearance_m", 0.0):
        keys[f"{FORMATION}.clearance_m"] = 0.0
    return keys


# More are not suggested.
MOST_ASVS = 12


def further(tried: Sequence[Team]) -> str:
    """Return in a sentence how many more ASVs are predicted to be enough; empty if that is unknown.

    They are those of the nearest team, in the regular formation that covers best.
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


# Proposed where the user varies nothing of the kind.
SCHEDULES = tuple(name for name, traits in families.SCHEDULE.traits.items() if traits.is_proposed)
DOWNLINKS = tuple(families.DOWNLINK.traits)

# Of all pairs of these so many at most are flown beside the scenario's own: those predicted to be
# best.
MOST_PROTOCOLS = 3

# Regular formations of one number of ASVs that are predicted: radii up to the survey's corner, and
# angles between two that look alike.
RADII, ANGLES = 8, 4
# Of so many numbers of ASVs at so many points these are predicted; of more, coverage alone decides.
MOST_PREDICTED = 60

# More ASVs than these stay where their scenario has them.
MOST_PLACED = 50


def proposed(question: Question, on_progress: Callable[[str], object]) -> list[Team]:
    """Return all teams of a question: the user's points, each with what is proposed to go with it;
    `on_progress` is called with how far that is.
    """
    # Direct replies take airtime: without, no modem can give them.
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
    """Tell whether the user asks for direct replies without airtime."""
    team = team_of(question, point)
    return team is not None and not team.scenario.protocol.answer.takes_airtime


def _as_listed(question: Question, point: Keys, widely: bool) -> Iterator[Team]:
    """Yield a whole point as it was listed, and its vessels elsewhere where nothing says where they
    are to be, neither the point nor the scenario.
    """
    team = team_of(question, point)
    if team is None:
        return
    yield team
    if not (_is_placed(point) or question.experiment.given.get("asvs", {}).get("formation")):
        yield from _elsewhere(team, widely)


def _is_placed(point: Keys) -> bool:
    """Tell whether a point says where vessels are to be, more than by the kind of placement."""
    return any(key.startswith(FORMATION) and key != PLACEMENT for key in point)


def _about(question: Question, point: Keys, widely: bool) -> Iterator[Team]:
    """Yield the teams of one point."""
    base = team_of(question, point)
    if base is None:
        return
    counts = counts_of(point, base.scenario, question.listed)
    for count in [{COUNT: count} for count in counts] if len(counts) > 1 else [{}]:
        # positions for another number of ASVs: they have to be placed anew
        team = team_of(question, {**point, **count}) or team_of(
            question, {**point, **count, **unplaced(question)}
        )
        if team is None:
            continue
        # Where only the kind of placement varies, each is placed as well as if it were not named.
        places = [team] if _is_placed(point) else [team, *_elsewhere(team, widely)]
        yield from places
        if not team.asvs:  # no round is to be planned
            continue
        best = min(places, key=lambda team: team.rank)
        others = [best.changed(protocol) for protocol in _protocols(base.setup, point)]
        ranked = sorted(filter(None, others), key=lambda team: team.rank)[:MOST_PROTOCOLS]
        yield from _unlike([best, *ranked])


def _elsewhere(team: Team, widely: bool) -> Iterator[Team]:
    """Yield the best regular formations of a team, for coverage and for what is predicted, and the
    places that cover most.
    """
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
    """Yield all but the first of teams that differ in their protocols alone, without those whose
    schedule is predicted to change nothing: where no two AUVs ever ping together, it has nothing
    to choose.
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
    """Yield the schedules and downlinks to try besides those of the scenario, and downlink slots
    that are no longer than their frames and guards; not where the user names both of the first.
    """
    scenario = setup.scenario
    protocol = scenario.protocol
    if protocol.asvs_ping:  # no AUV is scheduled or told
        return
    own = protocol.schedule, protocol.downlink
    is_alone = scenario.auvs.count == 1
    schedules = own[:1] if SCHEDULE in point or is_alone else dict.fromkeys((own[0], *SCHEDULES))
    downlinks = own[1:] if DOWNLINK in point else dict.fromkeys((own[1], *DOWNLINKS))
    # Unless it is asked for, a downlink slot lasts ten times what sound takes across the survey.
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
