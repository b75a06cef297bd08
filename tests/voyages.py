"""Fleets under way, told all at once where to go and how."""

from dataclasses import fields
from typing import Any

import numpy as np

from bindusbl_des.core.geometry.paths import Path, Pose, Segment
from bindusbl_des.core.vehicles.guidance.departure import DeparturePlan, SteeringIntervals
from bindusbl_des.core.vehicles.guidance.guided_fleet import GuidedFleet
from bindusbl_des.core.vehicles.guidance.sensing import SteeringDrift
from bindusbl_des.core.vehicles.reckoning import steady


def way(*parts: tuple[float, float], begin: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Path:
    """Return the path of so many parts, each of a curvature (1/m) and a length (m), that begins at
    x, y (m) with a heading (rad).
    """
    return Path(Pose(*begin), tuple(Segment(*part) for part in parts))


def drift(
    walk: np.ndarray, hz: float = 1.0, bias: tuple[float, float] = (0.0, 0.0),
    in_body: bool = False, through_water: bool = False,
) -> SteeringDrift:  # fmt: skip
    """Return how wrong (m) vehicles' dead reckoning is, by walks (n, k, 2) and a bias (m/s)."""
    return SteeringDrift(steady(walk, hz, bias, in_body), through_water)


def voyage(model: str, overrides: dict[str, float] | None = None, **told: Any) -> GuidedFleet:
    """Return a fleet whose plan and intervals are among what is told."""

    def part(kind: type) -> Any:
        names = [field.name for field in fields(kind) if field.name in told]
        return kind(**{name: told.pop(name) for name in names})

    plan, intervals = part(DeparturePlan), part(SteeringIntervals)
    return GuidedFleet(model, plan, overrides, intervals=intervals, **told)
