"""The values of goals in the rows of missions."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .selection.goals import Floats, Goal

AUVS, MISSIONS = "auvs", "missions"


def wanted(goals: Sequence[Goal]) -> dict[str, list[str]]:
    """Return the columns that goals are judged by, of AUVs and of missions.

    >>> wanted([Goal("position_error_m", below=1.0), Goal("area_covered_share", above=0.9)])
    {'auvs': ['position_error_m'], 'missions': ['area_covered_share']}
    """
    columns = {table: [it.metric for it in goals if it.is_of_auvs == (table == AUVS)]
               for table in (AUVS, MISSIONS)}  # fmt: skip
    return {table: list(dict.fromkeys(names)) for table, names in columns.items()}


def values(goals: Sequence[Goal], rows: Sequence[Mapping[str, Any]]) -> Floats:
    """Return the goals' values (k, g) of k missions; nan where one failed or has none."""
    found = [[_value(goal, row) for goal in goals] for row in rows]
    return np.array(found, float).reshape(len(rows), len(goals))


def _value(goal: Goal, row: Mapping[str, Any]) -> float:
    if not row:
        return np.nan
    if goal.is_of_auvs:
        return float(goal.of_fleets(np.array([row[f"{AUVS}.{goal.metric}"]], float))[0])
    value = row[goal.metric]
    return np.nan if value is None else float(value)
