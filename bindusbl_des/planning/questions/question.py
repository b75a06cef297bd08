"""What a plan is asked: which team is the least that meets the goals, and how sure to be."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from ...campaigns.experiments.experiment import Experiment
from ...campaigns.experiments.plan import model_version
from ...scenario.scenario import Scenario
from ..selection.goals import Goal

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
