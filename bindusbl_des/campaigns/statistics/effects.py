"""How much each varied key matters: a campaign's error at its best and its worst value."""

import numpy as np

from ..experiments.plan import Plan
from .findings import ERROR
from .intervals import intervals
from .naming import written
from .outcomes import Outcomes

# A key with more different values than this share of the points was sampled: none comes twice.
SAMPLED = 0.5


def key_effects(plan: Plan, found: Outcomes) -> list[str]:
    """Return of each key between which means over the others the worst AUV's error lies.

    Keys that matter most come first.  Values are compared over the same points of the other keys:
    points without a mission that went well are left out at all values, and counted.
    """
    error = intervals(found.by_seed(ERROR, len(plan.points))).mean
    effects = [it for key in plan.columns if (it := _effect(plan, key, error)) is not None]
    return [said for _, said in sorted(effects, key=lambda it: -it[0])]


def _effect(plan: Plan, key: str, error: np.ndarray) -> tuple[float, str] | None:
    """Return how far apart the means at the values of a key are, and that in words."""
    values = list(dict.fromkeys(written(point.varied[key]) for point in plan.points))
    if len(values) < 2 or len(values) > SAMPLED * len(plan.points):
        return None
    rows: dict[str, np.ndarray] = {}
    for point, mean in zip(plan.points, error.tolist(), strict=True):
        held = repr([it for it in point.varied.items() if it[0] != key])
        row = rows.setdefault(held, np.full(len(values), np.nan))
        row[values.index(written(point.varied[key]))] = mean
    table = np.array(list(rows.values()))
    seen = ~np.isnan(table).all(axis=0)  # values at which every mission fails tell nothing
    table = table[:, seen]
    whole = ~np.isnan(table).any(axis=1)
    if table.shape[1] < 2 or not whole.any():
        return None
    names = [value for value, is_seen in zip(values, seen, strict=True) if is_seen]
    means = table[whole].mean(axis=0)
    low, high = int(np.argmin(means)), int(np.argmax(means))
    left = int((~whole).sum())
    rest = f" (without {left} of {len(table)} combinations that lack a value)" * bool(left)
    return float(means[high] - means[low]), (
        f"{key}: {means[low]:.2f} m at {names[low]}, {means[high]:.2f} m at {names[high]}{rest}"
    )
