"""What the intervals of a campaign contain: what differs between seeds, and what does not."""

import json
from collections.abc import Iterable

from ..experiments.plan import ExperimentPlan

SD = "navigation.velocity_bias_sd_m_per_s"
DRIFTS = ("percent_of_distance", "m_per_hour")


def in_intervals(plan: ExperimentPlan, points: Iterable[int]) -> str:
    """Return what the intervals over seeds of some points are made of, in sentences, if any.

    An interval over seeds knows only what seeds change.  A velocity bias that is the same for every
    AUV and seed is no chance, however uncertain the inertial system is that it stands for.
    """
    if len(plan.experiment.seeds) < 2:
        return "One seed shows no interval."
    differ = any(key.startswith("navigation") for key in plan.columns)
    chosen = list(points) if differ else [0]
    parts = [json.loads(plan.points[point].scenario)["navigation"] for point in chosen]
    drawn = [part["velocity_bias_sd_m_per_s"] for part in parts]
    fixed = [
        not sd and any(part["velocity_bias_m_per_s"]) for sd, part in zip(drawn, parts, strict=True)
    ]
    said = "Intervals are over seeds: noise, losses and the random walk of dead reckoning"
    if any(part["initial_position_sd_m"] for part in parts):
        said += ", errors of the start"
    if any(part.get(key) for part in parts for key in ("scale_factor_sd", "heading_sd_deg")):
        said += ", scale factors and headings of AUVs"
    sheets = [any((part.get("drift") or {}).get(key) for key in DRIFTS) for part in parts]
    if any(sheets):
        said += ", and the inertial systems as drawn by navigation.drift"
    if all(sheets):
        return f"{said}."
    if all(fixed):
        return (
            f"{said}. The velocity bias is the same for every AUV and seed ({SD} is 0), so the "
            "uncertainty of the inertial system is not in them."
        )
    if any(fixed):
        return (
            f"{said}. Where {SD} is 0, the velocity bias is the same for every AUV and seed, so "
            "the uncertainty of the inertial system is not in them there."
        )
    if any(drawn):
        sizes = sorted({sd for sd in drawn if sd})
        span = f"{sizes[0]:g}" if len(sizes) == 1 else f"{sizes[0]:g} to {sizes[-1]:g}"
        return (
            f"{said}, and the inertial systems: a velocity bias is drawn for each AUV and seed "
            f"({SD} is {span})."
        )
    return f"{said}. There is no velocity bias, neither a constant one nor one that is drawn."
