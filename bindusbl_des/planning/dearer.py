"""What more vessels would bring: teams that cost more than the answer, flown a few times."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from ..campaigns.statistics.intervals import interval
from .selection.goals import Floats, Goal
from .selection.selection import Estimate, Selection
from .teams.candidates import Candidate

# So many missions of each show about where it is.
SEEDS = 8


def with_dearer(
    selection: Selection,
    candidates: Sequence[Candidate],
    goals: Sequence[Goal],
    sample: Callable[[Sequence[tuple[int, int]]], Floats],
) -> Selection:
    """Return a selection with estimates of the first candidate of each cost that was not flown.

    Candidates of one cost are in the order of their predictions, so that it is the best of them.
    Verdicts stay as they are: nothing is decided by so few missions.
    """
    first: dict[float, int] = {}
    for number, it in enumerate(candidates):
        first.setdefault(it.cost, number)
    shown = [n for n in first.values() if selection.verdicts[n] == "not needed"]
    shown = [n for n in shown if not selection.missions[n]]
    values = sample([(n, seed) for seed in range(SEEDS) for n in shown])
    if not shown or len(values) < SEEDS * len(shown):
        return selection
    estimates, missions = list(selection.estimates), list(selection.missions)
    for place, number in enumerate(shown):
        own = values[place :: len(shown)]
        estimates[number] = tuple(_estimate(own[:, goal]) for goal in range(len(goals)))
        missions[number] = SEEDS
    return replace(selection, estimates=tuple(estimates), missions=tuple(missions))


def _estimate(values: Floats) -> Estimate:
    """Return mean and interval of a goal; nan where a mission has no value."""
    found = interval((values if (values == values).all() else values[:0]).tolist())
    return Estimate(found.mean, found.low, found.high, float("nan"))
