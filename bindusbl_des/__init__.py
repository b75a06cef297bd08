"""Simulate underwater acoustic networks that keep dead-reckoning AUVs on their way.

>>> from bindusbl_des import Scenario, simulate
>>> result = simulate(Scenario(name="example", duration_s=10.0), seed=1)
>>> len(result.auvs)
3
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .advice.advising import advise
    from .campaigns.campaign import Campaign, load_campaign
    from .campaigns.compare import compare
    from .campaigns.running import sweep
    from .coverage import covered_area, covering_radius
    from .formations import formation
    from .fusion import fuse
    from .light_time import travel_time
    from .loading import load_result
    from .loss import range_loss
    from .result import Result
    from .scenario import Scenario
    from .scenario_file import ScenarioError, load_scenario
    from .simulation import simulate
    from .slots import airtime, downlink_slot, uplink_slot
    from .water import absorption, sound_speed
    from .worth_knowing import cautions

# Loaded when first asked for, so that `bindusbl-des --help` does not wait for numpy and pyarrow.
_HOMES = {
    "Campaign": "campaigns.campaign",
    "advise": "advice.advising",
    "compare": "campaigns.compare",
    "load_campaign": "campaigns.campaign",
    "sweep": "campaigns.running",
    "absorption": "water",
    "airtime": "slots",
    "cautions": "worth_knowing",
    "covered_area": "coverage",
    "covering_radius": "coverage",
    "downlink_slot": "slots",
    "formation": "formations",
    "fuse": "fusion",
    "load_result": "loading",
    "load_scenario": "scenario_file",
    "range_loss": "loss",
    "Result": "result",
    "Scenario": "scenario",
    "ScenarioError": "scenario_file",
    "simulate": "simulation",
    "sound_speed": "water",
    "travel_time": "light_time",
    "uplink_slot": "slots",
}

__all__ = [
    "Campaign",
    "Result",
    "Scenario",
    "ScenarioError",
    "absorption",
    "advise",
    "airtime",
    "cautions",
    "compare",
    "covered_area",
    "covering_radius",
    "downlink_slot",
    "formation",
    "fuse",
    "load_campaign",
    "load_result",
    "load_scenario",
    "range_loss",
    "simulate",
    "sound_speed",
    "sweep",
    "travel_time",
    "uplink_slot",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_HOMES[name]}", __name__), name)


def __dir__() -> list[str]:
    return __all__
