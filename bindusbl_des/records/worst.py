"""The worst AUV of a fleet: a mission is as good as what its worst-served vehicle got.

The worst value of errors, ages, intervals, latencies and losses is the largest, of coverage, fixes
and rates the smallest (:class:`.metrics.AuvMetrics` says which).  An AUV that has no value, because
it got no fix, is worse than any that has one.  Of several equally bad the first counts.
"""

import math

import numpy as np

from .metrics import WORST_IS_LARGEST
from .rows import Rows

# What some missions have not at all: where no AUV has it, none is worse for it.
UNDEFINED = ("latency_from_slot_s", "path_error_m", "saturated_share")


def worst_of(auvs: Rows) -> dict[str, float | None]:
    """Return `worst_<metric>` of a fleet and `worst_<metric>_auv`, the number of that AUV.

    `auvs` (n,) has the metrics of each, NaN for none.  A value is None where that AUV has none,
    both are where nobody's could be told.
    """
    names = list(WORST_IS_LARGEST)
    values = np.array([auvs[name] for name in names], dtype=np.float64)
    missing = np.isnan(values)
    badness = np.where(missing, np.inf, np.where(_LARGEST, values, -values))
    which: list[int] = badness.argmax(axis=1).tolist()
    nobody: list[bool] = np.logical_and.reduce(missing, axis=1).tolist()
    found: dict[str, float | None] = {}
    for name, its_own, auv, none in zip(names, values, which, nobody, strict=True):
        value = float(its_own[auv])
        found[f"worst_{name}"] = None if math.isnan(value) else value
        found[f"worst_{name}_auv"] = None if none and name in UNDEFINED else auv
    return found


_LARGEST = np.array(list(WORST_IS_LARGEST.values()))[:, np.newaxis]
