"""The question of a plan: a scenario, what may vary, goals, costs and a confidence.

Plans are read from YAML files, scenarios and options (command line or Python arguments); one error
lists every mistake with its place.
"""

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from math import comb
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

from ...core.scenario.files.scenario_file import Source
from ...core.scenario.scenario import Scenario
from ...support.facts import cached_property
from ...support.mistakes import FilePlace, Mistake, ScenarioError
from ...support.plain_data import Path
from ...support.plain_yaml import Document, read_text, read_yaml
from ...support.shipped import shipped
from ...support.wording import described, did_you_mean
from ..campaigns.experiments.experiment import Experiment, model_version
from ..campaigns.experiments.experiment_file import (
    NO_OPTIONS,
    document_of,
    experiment_in,
    of_scenario_file,
)
from ..campaigns.experiments.experiment_points import is_experiment, is_number, is_plan
from ..campaigns.experiments.options import Options, PythonArguments
from .goals import MOST_LOST, Goal, Of, goal_in, goal_of

if TYPE_CHECKING:
    from .prediction.inputs import Inputs

CONFIDENCE = 0.95
ASV = "asv"  # the key of a vessel's price
UNPRICED = {ASV: 1.0}  # without prices, vessels are counted

# The distance of the first seeds of plans with consecutive seeds, so that missions' seeds differ.
SEEDS_APART = 1000
# The most seeds of a candidate.
MOST_SEEDS = 200


@dataclass(frozen=True)
class Question:
    """A scenario, what may be changed of it, and the goals.

    `experiment` is the scenario with the points that the user varies; if `listed`, the plan
    proposes nothing beside these points but positions that they leave open.  `costs` are of one ASV
    (``asv``) and of values of keys (``acoustics.mf.range_m=200``).  A run of the plan stops after
    `budget_s` (s) or `budget_missions`; None: only when it is settled.
    """

    experiment: Experiment
    goals: tuple[Goal, ...]
    source: str = ""
    listed: bool = False
    confidence: float = CONFIDENCE
    budget_s: float | None = None
    budget_missions: int | None = None
    costs: Mapping[str, float] = field(default_factory=lambda: dict(UNPRICED))
    seed: int = 0
    # The inputs of its scenarios' predictions, once computed; None: not predictable
    inputs: dict[str, "Inputs | None"] = field(default_factory=dict, compare=False, repr=False)

    @property
    def name(self) -> str:
        """The name of the plan."""
        return self.experiment.name

    @cached_property
    def base(self) -> Scenario:
        """The scenario before any change."""
        return self.experiment.base()

    @property
    def whole_goals(self) -> tuple[Goal, ...]:
        """The goals without lost vessels."""
        return tuple(goal for goal in self.goals if not goal.lost)

    @property
    def lost(self) -> int:
        """How many vessels, whichever, may be lost."""
        return max(goal.lost for goal in self.goals)

    def seeds(self) -> range:
        """Return the seeds of the missions that may be flown."""
        first = self.seed * SEEDS_APART
        return range(first, first + MOST_SEEDS)

    def record(self) -> dict[str, Any]:
        """Return all that decides the settled answer, as plain data."""
        given = self.experiment.record()
        return {
            "name": self.name,
            "scenario": given["scenario_as_given"],
            "varied": given["points"],
            "listed": self.listed,
            "goal": [goal.record() for goal in self.goals],
            "confidence": self.confidence,
            "costs": dict(self.costs),
            "seed": self.seed,
            "model_version": model_version(),
        }

    def fingerprint(self) -> str:
        """Return the sha256 of the question; equal questions have equal answers."""
        return hashlib.sha256(json.dumps(self.record(), sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True)
class Asking:
    """Settings laid over a plan's file or a scenario; None and () change nothing.

    `of` replaces whose metric the goals judge, also in the file; `numbers` replaces the file's
    numbers by their keys (`NUMBERS`).
    """

    goals: tuple[Goal, ...] = ()
    of: Of | None = None
    options: Options | PythonArguments = NO_OPTIONS
    numbers: Mapping[str, Any] = field(default_factory=dict)
    allow_plugins: bool = False


def goals_of_options(below: Sequence[str], above: Sequence[str], of: Of | None) -> tuple[Goal, ...]:
    """Return the goals of the options `--below` and `--above`, each ``METRIC=VALUE``.

    Raises:
        ScenarioError: listing the invalid ones.
    """
    return _all_of(
        (f"--{name} {text}", partial(goal_of, text, name == "below", of or "worst"))
        for name, texts in (("below", below), ("above", above))
        for text in texts
    )


def goals_of_arguments(
    below: Mapping[str, Any] | None, above: Mapping[str, Any] | None, of: Of | None
) -> tuple[Goal, ...]:
    """Return the goals from metrics with their limits.

    Raises:
        TypeError: when an argument is no mapping.
        ScenarioError: listing the invalid goals.
    """
    sides = {"below": below, "above": above}
    for name, limits in sides.items():
        if limits is not None and not isinstance(limits, Mapping):
            example = "{'position_error_p95_m': 1.0}"
            raise TypeError(f"{name} needs a mapping such as {example}; got {described(limits)}")
    return _all_of(
        (
            f"{name}={{{metric!r}: {limit!r}}}",
            partial(goal_in, {"metric": metric, name: limit, "of": of or "worst"}),
        )
        for name, limits in sides.items()
        for metric, limit in (limits or {}).items()
    )


def _all_of(asked: Iterable[tuple[str, Callable[[], Goal]]]) -> tuple[Goal, ...]:
    goals, mistakes = [], []
    for place, read in asked:
        try:
            goals.append(read())
        except ValueError as error:
            mistakes.append(Mistake.at(FilePlace(place), "goal", without_key(error)))
    if mistakes:
        raise ScenarioError(mistakes)
    return tuple(goals)


def without_key(error: ValueError) -> str:
    """Return a goal's error without the key at its beginning, which its place names.

    >>> without_key(ValueError("goal: no metric 'x'"))
    "no metric 'x'"
    """
    return str(error).partition(": ")[2] or str(error)


KEYS = (
    *("name", "scenario", "goal", "candidates", "confidence", "budget_s", "budget_missions"),
    *("cost", "seed", "survive"),
)
# The most points, and the most ASVs in all of them: each is predicted before any is simulated.
MOST_POINTS = 500
MOST_ASVS = 5000
# The most losses of vessels with which each mission of a team is repeated
MOST_LOSSES = 100

FORM = "{metric: position_error_p95_m, below: 1}"

# The default, least and largest value of each number; whole if these are.
NUMBERS = {
    "confidence": (CONFIDENCE, 0.5, 0.9999),
    "budget_s": (None, 1.0, 1e7),
    "budget_missions": (None, 1, 10**9),
    "seed": (0, 0, 10**12),
    "survive": (0, 0, MOST_LOST),
}

# Proposed numbers of ASVs, if the user varies none
COUNTS = range(1, 7)


def read_plan(given: str | FilePath | Scenario, asking: Asking) -> Question:
    """Read a plan's file, or a scenario to which `asking` adds the question.

    Raises:
        ScenarioError: listing every mistake.
        TypeError: when `given` is neither a path nor a scenario.
    """
    document, source = _document(given, asking.options.overrides)
    goals, costs = _goals(document, asking), _costs(document)
    numbers = {name: _number(document, name, asking.numbers.get(name)) for name in NUMBERS}
    survive = numbers.pop("survive")
    goals = _surviving(document, goals, survive)
    inner = _experiment_document(document)
    allow = asking.allow_plugins
    try:
        experiment = experiment_in(inner, asking.options, source, allow_plugins=allow)
    except ScenarioError as error:
        raise ScenarioError(map(_as_candidates, error.mistakes)) from None
    points = len(experiment.points)
    counts = (point.get("asvs.count") for point in experiment.points)
    asvs = sum(count if isinstance(count, int) else 1 for count in counts)
    if points > MOST_POINTS or asvs > MOST_ASVS:
        problem = (
            f"make {points:,} teams with {asvs:,} ASVs before any is proposed; a plan compares "
            f"{MOST_POINTS} with {MOST_ASVS:,} at most, since each is predicted; narrow the ranges "
            "or give them a step (4:40:4)"
        )
        _note(document, ("candidates",), problem)
        raise ScenarioError(document.mistakes)
    listed = isinstance(document.data.get("candidates"), list)
    lost = max(goal.lost for goal in goals)
    most = _most_vessels(experiment, listed) if lost else 0
    asked = asking.numbers.get("survive")
    place = None if asked is None else FilePlace(f"--survive {asked}")
    ways, problem = comb(most, lost), ""
    if 0 < most <= lost:
        problem = (
            f"leaves no vessel where {lost} of them are lost: {most} are the most that may be "
            f"chosen; ask for {most - 1} at most, or vary asvs.count beyond {lost}"
        )
    elif ways > MOST_LOSSES:
        problem = (
            f"makes {ways:,} losses of {lost} of {most} vessels, each flown with each mission; a "
            f"plan flies {MOST_LOSSES} at most; ask for fewer, or vary fewer vessels"
        )
    if problem:
        _note(document, ("survive" if survive else "goal",), problem, place)
        raise ScenarioError(document.mistakes)
    return Question(
        experiment=experiment,
        goals=goals,
        source="" if isinstance(given, Scenario) or asking.options.overrides else _named(document),
        listed=listed,
        costs=costs,
        **numbers,
    )


def counts_of(point: Mapping[str, Any], scenario: Scenario, listed: bool) -> Sequence[int]:
    """Return the numbers of ASVs to choose from at a point, which makes a valid scenario."""
    formation = scenario.asvs.formation
    named = ("asvs.count", "asvs.formation", "asvs.formation.positions_m")
    is_fixed = any(key in point for key in named) or not (formation.moored or formation.moves)
    is_fixed |= bool(scenario.asvs.groups)  # whose vessels they are
    return (scenario.asvs.count,) if listed or is_fixed else _counts(scenario)


def _counts(scenario: Scenario) -> Sequence[int]:
    """Return the proposed numbers of ASVs, with 0 if the scenario has none."""
    return COUNTS if scenario.asvs.count else range(COUNTS.stop)


def _most_vessels(experiment: Experiment, listed: bool) -> int:
    """Return the largest number of ASVs to choose from."""
    return max(
        max(counts_of(point, experiment.scenario(number), listed))
        for number, point in enumerate(experiment.points)
    )


def _surviving(document: Document, goals: tuple[Goal, ...], lost: int) -> tuple[Goal, ...]:
    """Return the goals without losses, then the same and the file's own with `lost` vessels."""
    whole = tuple(goal for goal in goals if not goal.lost)
    own = tuple(goal for goal in goals if goal.lost)
    if own and not whole:
        _note(document, ("goal",), "needs one of the whole team as well, without lost; add it")
    asked = (*own, *(replace(goal, lost=lost) for goal in whole)) if lost else own
    if len({goal.lost for goal in asked}) > 1:
        problem = "needs one number of lost vessels for all goals, also that of survive; keep one"
        _note(document, ("goal",), problem)
    return (*whole, *asked)


def _named(document: Document) -> str:
    """Return the scenario's file relative to here, or its shipped name; "" for a pipe."""
    name = str(document.data["scenario"])
    named = FilePath(document.file).parent / name
    return str(named) if named.is_file() else name if name in shipped("scenarios") else ""


def _document(
    given: str | FilePath | Scenario, overrides: tuple[str, ...]
) -> tuple[Document, Source | None]:
    if isinstance(given, Scenario):
        return document_of(given)
    if not isinstance(given, str | FilePath):
        needs = "a plan needs a Scenario, or the path of a scenario or plan file"
        raise TypeError(f"{needs}; got {described(given)}")
    path = FilePath(given)
    text = read_text(path)
    document = read_yaml(text, str(path))
    data = document.data
    if not is_plan(data) and not is_experiment(data):  # read it as a scenario
        return of_scenario_file(path, text, data, overrides)
    for key in document.data:
        if key not in KEYS:
            hint = did_you_mean(key, KEYS) or f"; the keys are {', '.join(KEYS)}"
            document.report(document.keys[(key,)], (key,), f"unknown key{hint}")
    return document, None


def _experiment_document(document: Document) -> Document:
    """Return the experiment within a plan's document: its scenario and what it varies."""
    listed = isinstance(document.data.get("candidates"), list)
    names = {"name": "name", "scenario": "scenario", "candidates": "points" if listed else "vary"}
    data = {new: document.data[key] for key, new in names.items() if key in document.data}

    def moved(places: Mapping[Path, FilePlace]) -> dict[Path, FilePlace]:
        return {(names.get(str(path[0]), path[0]), *path[1:]) if path else path: place
                for path, place in places.items()}  # fmt: skip

    return replace(document, data=data, keys=moved(document.keys), values=moved(document.values))


def _as_candidates(mistake: Mistake) -> Mistake:
    """Return a mistake with the key of its section in a plan's file."""
    section, dot, rest = mistake.key.partition(".")
    if section in ("vary", "points") and not mistake.file.startswith("--"):
        return replace(mistake, key=f"candidates{dot}{rest}")
    return mistake


def _note(document: Document, path: Path, message: str, place: FilePlace | None = None) -> None:
    known = document.values
    found = place or known.get(path) or known.get(path[:1]) or FilePlace(document.file, 1, 1)
    document.report(found, path, message)


def _goals(document: Document, asking: Asking) -> tuple[Goal, ...]:
    """Return the goals of `asking`, or else those of the file."""
    if asking.goals:
        return asking.goals
    if "goal" not in document.data:
        remedy = f"add it, such as `goal: {FORM}`, or ask for --below METRIC=VALUE"
        _note(document, ("goal",), f"missing; {remedy}")
        return ()
    written = document.data["goal"]
    several = isinstance(written, list) and written
    goals: list[Goal] = []
    for number, goal in enumerate(written if several else [written]):
        path: Path = ("goal", number) if several else ("goal",)
        if isinstance(goal, dict) and asking.of is not None:
            goal = {**goal, "of": asking.of}
        try:
            goals.append(goal_in(goal))
        except ValueError as error:
            _note(document, path, without_key(error))
    return tuple(goals)


def _number(document: Document, key: str, asked: float | None) -> Any:
    """Return a number of `asking`, or else of the file, or else its default."""
    default, low, high = NUMBERS[key]
    if asked is None and key not in document.data:
        return default
    value = document.data[key] if asked is None else asked
    whole = isinstance(low, int)
    fits = isinstance(value, int) and not isinstance(value, bool) if whole else is_number(value)
    if fits and low <= value <= high:
        return value if whole else float(value)
    place = None if asked is None else FilePlace(f"--{key.replace('_', '-')} {value}")
    bounds = f"a whole number >= {low} and <= {high}" if whole else (
        f"a number >= {low:g} and <= {high:g}"
    )  # fmt: skip
    _note(document, (key,), f"needs {bounds}; got {described(value)}", place)
    return default


def _costs(document: Document) -> dict[str, float]:
    """Return the prices of one ASV and of values of keys."""
    given = document.data.get("cost", {})
    if not isinstance(given, dict):
        needs = "needs {asv: price, KEY=VALUE: price, ...}"
        _note(document, ("cost",), f"{needs}; got {described(given)}")
        return dict(UNPRICED)
    for key, price in given.items():
        path: Path = ("cost", key)
        if key != ASV and "=" not in key:
            remedy = f"write {ASV}, or KEY=VALUE such as acoustics.mf.range_m=200"
            _note(document, path, f"no such cost; {remedy}", document.keys.get(path))
        if not is_number(price) or price < 0 or (key == ASV and price == 0):
            _note(document, path, f"needs a price > 0; got {described(price)}")
    return {**UNPRICED, **{key: float(price) for key, price in given.items() if is_number(price)}}
