"""Toy problems of which the answer is known: candidates with true means, drawn at random."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bindusbl_des.apps.planning.goals import Goal
from bindusbl_des.apps.planning.selecting import Choice

__all__ = [
    "SEEDS",
    "ZONE",
    "Choice",
    "Floats",
    "Goal",
    "Toy",
    "_noise",
    "toy",
]  # fmt: skip

Floats = NDArray[np.float64]
SEEDS = 128
ZONE = 0.05


@dataclass
class Toy:
    """Candidates whose goals are met by known margins (shares of the limits, negative: missed)."""

    candidates: list[Choice]
    goals: list[Goal]
    margins: Floats  # (candidates, goals)
    values: Floats  # (candidates, seeds, goals)
    has_values: NDArray[np.bool_]  # (candidates,): whether all missions have
    flown: int = 0

    def sample(self, pairs: Sequence[tuple[int, int]]) -> Floats:
        self.flown += len(pairs)
        candidates, seeds = np.array(pairs).T
        return self.values[candidates, seeds]

    def is_right(self, answer: int | None, zone: float = ZONE) -> bool:
        """Tell whether an answer is right, but for differences that do not matter."""
        well = self.has_values & (self.margins >= zone).all(axis=1)
        if answer is None:
            return not well.any()
        if not self.has_values[answer] or (self.margins[answer] < 0).any():
            return False
        costs = np.array([it.cost for it in self.candidates])
        better = self.margins[:, 0] > self.margins[answer, 0] + zone
        beaten = (costs < costs[answer]) | ((costs == costs[answer]) & better)
        return not (well & beaten).any()


def toy(rng: np.random.Generator, skewness: float = 0.0) -> Toy:
    """Draw a problem: costs in groups, unequal spreads, seeds that are paired, one or two goals.

    Some margins are within the zone, some equal; in some problems nobody meets the goals, in some
    a candidate has missions without a value.
    """
    count, goals = int(rng.integers(3, 13)), int(rng.integers(1, 3))
    above = rng.random() < 0.3
    goal = [Goal("hf_coverage", above=0.8) if above else Goal("position_error_p95_m", below=2.0)]
    goal += [Goal("fix_age_p95_s", below=30.0)] * (goals - 1)
    steps = [-1.5, -0.4, -0.15, -0.06, -0.02, 0.02, 0.08, 0.15, 0.3, 0.6]
    margins = rng.choice(steps, (count, goals)) + rng.choice([0.0, 0.01], (count, goals))
    if rng.random() < 0.2:
        margins[:, 0] = -np.abs(margins[:, 0])
    limits = np.array([it.limit for it in goal])
    signs = np.array([1.0 if it.is_below else -1.0 for it in goal])
    spread = limits * rng.uniform(0.02, 0.25, (count, 1, goals))
    shared = rng.uniform(0, 0.9)
    noise = np.sqrt(shared) * _noise(rng, (1, SEEDS, goals), skewness)
    noise = noise + np.sqrt(1 - shared) * _noise(rng, (count, SEEDS, goals), skewness)
    values = limits * (1 - signs * margins[:, None, :]) + signs * spread * noise
    fails = (rng.random(count) < 0.1)[:, None] & (rng.random((count, SEEDS)) < 0.5)
    values[fails] = np.nan
    costs = np.sort(rng.integers(1, 5, count)).astype(float)
    candidates = [Choice(float(cost)) for cost in costs]
    return Toy(candidates, goal, margins, values, ~fails.any(axis=1))


def _noise(rng: np.random.Generator, shape: tuple[int, ...], skewness: float) -> Floats:
    """Return noise of mean 0 and standard deviation 1: normal, or of a gamma distribution."""
    if not skewness:
        return rng.standard_normal(shape)
    root = 2 / skewness
    return (rng.gamma(root**2, 1, shape) - root**2) / root
