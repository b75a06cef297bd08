"""Fleets under way, told all at once where to go and how."""

from dataclasses import fields
from typing import Any

from bindusbl_des.vehicles.guidance.departure import DeparturePlan, SteeringIntervals
from bindusbl_des.vehicles.guidance.guided_fleet import GuidedFleet


def voyage(model: str, overrides: dict[str, float] | None = None, **told: Any) -> GuidedFleet:
    """Return a fleet whose plan and intervals are among what is told."""

    def part(kind: type) -> Any:
        names = [field.name for field in fields(kind) if field.name in told]
        return kind(**{name: told.pop(name) for name in names})

    plan, intervals = part(DeparturePlan), part(SteeringIntervals)
    return GuidedFleet(model, plan, overrides, intervals=intervals, **told)
