"""Ping groups of a round: how many a schedule makes, and how few any could."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...protocol.bounds import (
    EXACT_UP_TO,
    clique_number,
    fewest_groups,
    most_heard,
    reuse_bound,
)
from ...protocol.conflicts import dsatur_groups, greedy_groups
from ...scenario.declared import Schedule
from .sights import Flags, Floats

Ints = NDArray[np.int64]

# How many ping groups there are of what is heard, by how they come about.
COLOURINGS: Mapping[str, Callable[[Flags], int]] = {
    "first_fit": lambda heard: len(greedy_groups(heard)),
    "saturation": lambda heard: len(dsatur_groups(heard)),
    "each": len,
}


@dataclass(frozen=True)
class Groups:
    """Ping groups of a round, means over instants.

    Those that the schedule makes (None: only it knows); between what the fewest lie that are free
    of conflicts, equal where the chromatic number is known; the clique number (None: not worked
    out); the most AUVs that one ASV hears; how many AUVs that are heard share a slot, at most.
    """

    made: float | None
    fewest: tuple[float, float]
    clique: float | None
    most_heard: float
    reuse: float

    @property
    def is_exact(self) -> bool:
        """Whether the fewest groups are known at every instant."""
        return self.fewest[0] == self.fewest[1]


def groups_of(schedule: Schedule, heard: Flags) -> Groups:
    """Return the ping groups of rounds that begin with so much in HF range, (k, n, m)."""
    made = groups_made(schedule, heard)
    small = heard.shape[1] <= EXACT_UP_TO
    return Groups(
        None if made is None else float(made.mean()),
        (
            float(each(heard, lambda now: fewest_groups(now)[0]).mean()),
            float(each(heard, lambda now: fewest_groups(now)[1]).mean()),
        ),
        float(each(heard, lambda now: clique_number(now) or 0).mean()) if small else None,
        float(each(heard, most_heard).mean()),
        float(each(heard, reuse_bound).mean()),
    )


def groups_made(schedule: Schedule, heard: Flags) -> Ints | None:
    """Return how many ping groups a schedule makes of what is in range (k, n, m), at each instant
    (k,); None where only the schedule knows.
    """
    if schedule.framed:
        return np.ones(len(heard), dtype=np.int64)
    if not schedule.has_exact_groups:
        return None
    return each(heard, COLOURINGS[schedule.groups]).astype(np.int64)


def each(heard: Flags, of: Callable[[Flags], float]) -> Floats:
    """Return a number of what is in range (k, n, m) at each instant, (k,): of equal ones once."""
    kept: dict[bytes, float] = {}
    found = np.empty(len(heard))
    for instant, now in enumerate(heard):
        key = now.tobytes()
        if key not in kept:
            kept[key] = of(now)
        found[instant] = kept[key]
    return found
