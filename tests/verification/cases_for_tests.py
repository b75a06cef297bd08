"""Scenarios as verdicts are worked out from them."""

from typing import Any

from bindusbl_des import Scenario, Setup
from bindusbl_des.apps.verification.case import Case, bounds_of
from bindusbl_des.apps.verification.rules import most_fixes

__all__ = ["case", "case_of", "most_fixes", "scenario"]


def scenario(**changes: Any) -> Scenario:
    return Scenario.model_validate({"name": "case", "duration_s": 60.0, **changes})


def case_of(asked: Scenario) -> Case:
    return Case(Setup(asked), bounds_of(Setup(asked)))


def case(**changes: Any) -> Case:
    return case_of(scenario(**changes))
