"""What the page of a plan says: metrics with their units, goals, intervals, settings."""

import json
from collections.abc import Mapping
from typing import Any

from ...campaigns.statistics.naming import short_key, written
from ...core.wording import significant
from ...records.metrics import SHARES, name_of, unit_of

Record = Mapping[str, Any]

# Where one asks for a share of the AUVs, and where for a statistic of all of them.
WHOSE = {"worst": "worst AUV", "mean": "mean of the AUVs"}


def units(metric: str) -> dict[str, Any]:
    """Return words, unit and factor (what is shown of a unit of the metric) of a metric.

    >>> units("hf_coverage")
    {'words': 'pings in HF range', 'unit': '%', 'factor': 100.0}
    """
    try:
        words, unit = name_of(metric), unit_of(metric)
    except KeyError:
        return {"words": metric, "unit": "", "factor": 1.0}
    if metric in SHARES:
        return {"words": words, "unit": "%", "factor": 100.0}
    return {"words": words, "unit": "" if unit == "count" else unit, "factor": 1.0}


def bound(goal: Record) -> str:
    """Return the bound of a goal with its unit.

    >>> bound({"metric": "position_error_p95_m", "below": 1.0})
    'below 1.00 m'
    """
    told = units(goal["metric"])
    side = "below" if goal.get("below") is not None else "above"
    return f"{side} {significant(goal[side] * told['factor'])} {told['unit']}".strip()


def goal_told(goal: Record) -> str:
    """Return a goal in words: what, of whom, below what.

    >>> goal_told({"metric": "position_error_p95_m", "below": 1.0, "of": "worst"})
    'Goal: position error, 95 % of the time, of the worst AUV below 1.00 m'
    """
    whose = goal.get("of", "worst")
    who = f"of the {WHOSE[whose]}" if whose in WHOSE else f"of {100 * float(whose):g} % of the AUVs"
    return f"Goal: {units(goal['metric'])['words']}, {who} {bound(goal)}"


def value_of(candidate: Record, part: str, name: str, goal: int) -> float | None:
    """Return one number of a candidate for a goal, None where it has none."""
    values = (candidate.get(part) or {}).get(name) or ()
    return values[goal] if goal < len(values) else None


def parted(candidate: Record, goal: int, factor: float = 1.0) -> tuple[str, str]:
    """Return a simulated mean, and the interval that holds it: "" where it is not known.

    >>> parted({"simulated": {"mean": [0.8], "low": [0.75], "high": [0.85]}}, 0)
    ('0.800', '(0.750 to 0.850)')
    """
    mean, low, high = (value_of(candidate, "simulated", it, goal) for it in ("mean", "low", "high"))
    if mean is None:
        return "-", ""
    if low is None or high is None:
        return significant(mean * factor), ""
    return significant(
        mean * factor
    ), f"({significant(low * factor)} to {significant(high * factor)})"


def interval(candidate: Record, goal: int, factor: float = 1.0) -> str:
    """Return a simulated mean with the interval that holds it, in one text.

    >>> interval({"simulated": {"mean": [0.8], "low": [None], "high": [None]}}, 0)
    '0.800'
    """
    return " ".join(filter(None, parted(candidate, goal, factor)))


def setting(key: str, value: Any) -> str:
    """Return a key and its value as `--set` takes them.

    >>> setting("asvs.formation.positions_m", [[0.0, 40.5]])
    'asvs.formation.positions_m=[[0.0, 40.5]]'
    """
    return f"{key}={value if isinstance(value, str) else json.dumps(value)}"


def named(keys: Record) -> str:
    """Return keys and values for the eye, keys as short as they can be told apart.

    >>> named({"asvs.count": 3, "asvs.formation.radius_m": 47.5})
    'count=3, radius_m=47.5'
    """
    names = list(keys)
    return ", ".join(f"{short_key(key, names)}={written(value)}" for key, value in keys.items())
