"""What a plan is asked: which team is the least that meets the goals, and how sure to be.

What is asked of a plan besides its file: options of the command line, or arguments of Python.
"""

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any

from ...campaigns.experiments.experiment import Experiment
from ...campaigns.experiments.experiment_file import NO_OPTIONS
from ...campaigns.experiments.options import Options, PythonArguments
from ...campaigns.experiments.plan import model_version
from ...core.wording import described
from ...scenario.files.mistakes import Mistake, Place, ScenarioError
from ...scenario.scenario import Scenario
from ..selection.goals import Goal, Of, goal_of, goals_in

CONFIDENCE = 0.95
ASV = "asv"  # whose price is that of one vessel

# Seeds of one plan begin here for each of its own seed, so that those of two plans differ.
SEEDS_APART = 1000
# No candidate is flown with more seeds than this.
MOST_SEEDS = 200


@dataclass(frozen=True)
class Question:
    """A scenario, what may be changed of it, and the goals.

    `experiment` is the scenario with the points that the user varies; `listed` tells that these
    points are all there is to choose from, and nothing is to be proposed besides.  `costs` are of
    one ASV (``asv``) and of what a key is set to (``acoustics.mf.range_m=200``).  What is flown in
    one go is cut off after `budget_s` (s) or `budget_missions`; None: not before it is settled.
    """

    experiment: Experiment
    goals: tuple[Goal, ...]
    source: str = ""
    listed: bool = False
    confidence: float = CONFIDENCE
    budget_s: float | None = None
    budget_missions: int | None = None
    costs: Mapping[str, float] = field(default_factory=lambda: {ASV: 1.0})
    seed: int = 0

    @property
    def name(self) -> str:
        """What the plan is called."""
        return self.experiment.name

    @cached_property
    def base(self) -> Scenario:
        """The scenario before anything of it is changed."""
        return self.experiment.base()

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
        """Return the sha256 of what is asked; equal questions have equal answers."""
        return hashlib.sha256(json.dumps(self.record(), sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True)
class Asking:
    """What is laid over a plan's file, or asked of a scenario; None and () leave it as it is.

    `of` is whose metrics the goals are of, also those of the file.
    """

    goals: tuple[Goal, ...] = ()
    of: Of | None = None
    options: Options | PythonArguments = NO_OPTIONS
    confidence: float | None = None
    budget_s: float | None = None
    budget_missions: int | None = None
    seed: int | None = None
    allow_plugins: bool = False


def goals_of_options(below: Sequence[str], above: Sequence[str], of: Of | None) -> tuple[Goal, ...]:
    """Return the goals of the options `--below` and `--above`, each ``METRIC=VALUE``.

    Raises:
        ScenarioError: listing those that are none.
    """

    def read() -> Iterator[tuple[str, Callable[[], Any]]]:
        for name, texts in (("below", below), ("above", above)):
            for text in texts:
                yield f"--{name} {text}", partial(goal_of, text, name == "below", of or "worst")

    return _all_of(read())


def goals_of_arguments(
    below: Mapping[str, Any] | None, above: Mapping[str, Any] | None, of: Of | None
) -> tuple[Goal, ...]:
    """Return the goals of metrics with their limits.

    Raises:
        TypeError: when these are no mappings.
        ScenarioError: listing those that are no goals.
    """
    for name, limits in (("below", below), ("above", above)):
        if limits is not None and not isinstance(limits, Mapping):
            example = "{'position_error_p95_m': 1.0}"
            raise TypeError(f"{name} needs a mapping such as {example}; got {described(limits)}")

    def read() -> Iterator[tuple[str, Callable[[], Any]]]:
        for name, limits in (("below", below), ("above", above)):
            for metric, limit in (limits or {}).items():
                written = {"metric": metric, name: limit, "of": of or "worst"}
                yield f"{name}={{{metric!r}: {limit!r}}}", partial(goals_in, written)

    return _all_of(read())


def _all_of(asked: Iterator[tuple[str, Callable[[], Any]]]) -> tuple[Goal, ...]:
    goals: list[Goal] = []
    mistakes = []
    for place, read in asked:
        try:
            found = read()
            goals += [found] if isinstance(found, Goal) else found
        except ValueError as error:
            mistakes.append(Mistake.at(Place(place), "goal", without_key(error)))
    if mistakes:
        raise ScenarioError(mistakes)
    return tuple(goals)


def without_key(error: ValueError) -> str:
    """Return what is wrong with a goal, without the key at its beginning, which its place tells.

    >>> without_key(ValueError("goal: no metric 'x'"))
    "no metric 'x'"
    """
    return str(error).partition(": ")[2] or str(error)
