"""When a point needs no further seeds: its confidence intervals are narrow enough.

Points are looked at when fixed numbers of their seeds have rows, whoever ran them and in whatever
order, so that a campaign ends with the same missions on any number of workers.
"""

import numpy as np

from ..experiments.experiment import checkpoints
from ..experiments.plan import ExperimentPlan
from .intervals import interval
from .outcomes import Outcomes


def seeds_wanted(plan: ExperimentPlan, found: Outcomes) -> list[int]:
    """Return how many of its seeds each point needs as far as is known."""
    return [_wanted(plan, found, point) for point in range(len(plan.points))]


def _wanted(plan: ExperimentPlan, found: Outcomes, point: int) -> int:
    most = len(plan.experiment.seeds)
    stop = most
    for stop in checkpoints(most):
        rows = _rows(plan, found, point, stop)
        if rows.stop - rows.start < stop or _is_settled(plan, found, rows):
            break
    return stop


def _rows(plan: ExperimentPlan, found: Outcomes, point: int, count: int) -> slice:
    start = point * len(plan.experiment.seeds)
    first, end = np.searchsorted(found.mission, (start, start + count))
    return slice(int(first), int(end))


def _is_settled(plan: ExperimentPlan, found: Outcomes, rows: slice) -> bool:
    """Tell whether all intervals are narrow enough; what always fails is not tried for ever."""
    well = found.ok[rows]
    return not well.any() or is_narrow(plan, found, rows)


def is_narrow(plan: ExperimentPlan, found: Outcomes, rows: slice) -> bool:
    """Tell whether the intervals of some missions are as narrow as was asked."""
    for target in plan.experiment.until_ci:
        known = interval(found.metrics[target.metric][rows][found.ok[rows]].tolist())
        if not known.half_width <= target.half_width(known.mean):  # so that nan is not enough
            return False
    return True


def wide_points(plan: ExperimentPlan, found: Outcomes) -> list[int]:
    """Return the points whose intervals are wider than was asked."""
    wanted = seeds_wanted(plan, found)
    return [
        point
        for point, count in enumerate(wanted)
        if not is_narrow(plan, found, _rows(plan, found, point, count))
    ]
