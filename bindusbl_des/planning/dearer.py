"""What more vessels would bring: teams that cost more than the answer, flown a few times."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..campaigns.statistics.intervals import intervals
from .selection.evidence import estimated
from .selection.goals import Floats, Goal
from .selection.selection import Sample, Selection
from .teams.candidates import Candidate

# So many missions of each show about where it is: the first so many where these tell the means of
# all goals to this share of them (half of the 95 % interval), else all.
FIRST, ALL = 4, 8
NARROW = 0.1


def with_dearer(
    selection: Selection, candidates: Sequence[Candidate], goals: Sequence[Goal], sample: Sample
) -> Selection:
    """Return a selection with estimates of the first candidate of each cost that was not flown.

    Candidates of one cost are in the order of their predictions, so that it is the best of them.
    Verdicts stay as they are: nothing is decided by so few missions.
    """
    first: dict[float, int] = {}
    for number, it in enumerate(candidates):
        first.setdefault(it.cost, number)
    shown = [n for n in first.values() if selection.verdicts[n] == "not needed"]
    values = {n: np.empty((0, len(goals))) for n in shown if not selection.missions[n]}
    for seeds in (FIRST, ALL):
        wide = [n for n, its in values.items() if not _is_narrow(its)]
        pairs = [(n, seed) for n in wide for seed in range(len(values[n]), seeds)]
        found = sample(pairs)
        if not wide or len(found) < len(pairs):
            break
        for n, own in zip(wide, np.split(found, len(wide)), strict=True):
            values[n] = np.concatenate([values[n], own])
    estimates, missions = list(selection.estimates), list(selection.missions)
    for n, its in values.items():
        if len(its):
            estimates[n], missions[n] = tuple(map(estimated, its.T)), len(its)
    return replace(selection, estimates=tuple(estimates), missions=tuple(missions))


def _is_narrow(values: Floats) -> bool:
    """Tell whether the means of all goals are known well enough."""
    known = intervals(values.T)
    return bool(np.all(known.half_width <= NARROW * np.abs(known.mean)))
