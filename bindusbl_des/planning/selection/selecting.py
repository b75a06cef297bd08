"""The least cost at which a candidate meets all goals, and the best candidate of that cost."""

from collections.abc import Callable, Sequence

from .goals import Goal
from .selection import Candidate, Sample, Selection

CONFIDENCE = 0.95
ZONE = 0.05
MOST_SEEDS = 128


def select(
    candidates: Sequence[Candidate],
    sample: Sample,
    goals: Sequence[Goal],
    *,
    confidence: float = CONFIDENCE,
    zone: float = ZONE,
    most_seeds: int = MOST_SEEDS,
    is_over: Callable[[], bool] = lambda: False,
) -> Selection:
    """Return the candidate of the least cost that meets all goals, with the stated confidence.

    `zone` is the share of a goal's limit below which no difference matters.
    """
    raise NotImplementedError
