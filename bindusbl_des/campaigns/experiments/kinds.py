"""Experiment files, plans' files and scenario files, told apart by their keys."""

from typing import Any

from ...scenario.scenario import Scenario

KEYS = ("name", "scenario", "vary", "points", "sample", "seeds", "until_ci", "detail")

# What only a plan's file has
OF_PLANS = ("goal", "candidates", "confidence", "budget_s", "cost")


def is_plan(data: Any) -> bool:
    """Tell whether data are those of a plan's file, right or wrong, and of no other."""
    return isinstance(data, dict) and any(key in data for key in OF_PLANS)


def is_experiment(data: Any) -> bool:
    """Tell whether data are those of an experiment file, right or wrong."""
    return isinstance(data, dict) and any(key in data for key in KEYS if key != "name")


def is_scenario(data: Any) -> bool:
    """Tell whether data are those of a scenario file, right or wrong, and of no experiment."""
    known = isinstance(data, dict) and any(key in data for key in Scenario.model_fields)
    return known and not is_experiment(data)
