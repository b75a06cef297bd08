"""The worst AUV of a fleet: a mission is as good as what its worst-served vehicle got.

The worst value of errors, ages, intervals, latencies and losses is the largest, of coverage, fixes
and rates the smallest (:class:`.events.AuvMetrics` says which).  An AUV that has no value, because
it got no fix, is worse than any that has one.  Of several equally bad the first counts.
"""

from collections.abc import Sequence
from dataclasses import fields

from .events import LARGEST, AuvMetrics

# For each metric that can be bad: whether the largest value is the worst.
WORST_IS_LARGEST = {
    column.name: column.metadata["worst"] == LARGEST
    for column in fields(AuvMetrics)
    if column.metadata["worst"]
}

# What some missions have not at all: where no AUV has it, none is worse for it.
UNDEFINED = ("latency_from_slot_s", "path_error_m", "saturated_share")

Worst = tuple[float | None, int | None]


def worst(metric: str, values: Sequence[float | None]) -> Worst:
    """Return the worst of a fleet's values of a metric, and the number of its AUV.

    The value is None where that AUV has none, both are where nobody's could be told.

    >>> worst("latency_mean_s", [0.8, None, 0.9]), worst("hf_coverage", [0.8, 1.0])
    ((None, 1), (0.8, 0))
    """
    missing = [auv for auv, value in enumerate(values) if value is None]
    if missing:
        is_undefined = metric in UNDEFINED and len(missing) == len(values)
        return None, None if is_undefined else missing[0]
    sign = 1.0 if WORST_IS_LARGEST[metric] else -1.0
    known = [(sign * value, auv) for auv, value in enumerate(values) if value is not None]
    value, auv = max(known, key=lambda it: it[0])
    return sign * value, auv


def worst_of(auvs: Sequence[AuvMetrics]) -> dict[str, float | None]:
    """Return `worst_<metric>` and `worst_<metric>_auv`, the number of that AUV, of a fleet."""
    found: dict[str, float | None] = {}
    for metric in WORST_IS_LARGEST:
        value, auv = worst(metric, [getattr(it, metric) for it in auvs])
        found[f"worst_{metric}"] = value
        found[f"worst_{metric}_auv"] = auv
    return found
