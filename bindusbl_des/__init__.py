"""Simulate underwater acoustic networks that keep dead-reckoning AUVs on their way.

>>> from bindusbl_des import Scenario, simulate
>>> result = simulate(Scenario(name="example", duration_s=10.0), seed=1)
>>> len(result.auvs)
3
"""

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .acoustics.channel import Signals
    from .acoustics.loss import range_loss
    from .acoustics.messages import airtime
    from .acoustics.travel_time import travel_time
    from .advice.advising import advise
    from .campaigns.campaign import (
        Campaign,
        CampaignInterrupted,
        CampaignState,
        load_campaign,
    )
    from .campaigns.compare import compare
    from .campaigns.running import resume, sweep
    from .core.mistakes import ScenarioError
    from .geometry.coverage import covered_area, covering_radius
    from .geometry.formation import formation
    from .live.readings import Instruments
    from .mission.mission import AuvStates, Mission, PingUnderWay
    from .mission.simulation import simulate
    from .navigation.dead_reckoning import DeadReckoning, Odometry
    from .navigation.navigators import Navigator
    from .planning.planning import Plan, plan
    from .preflight.limits import limits
    from .preflight.warnings import warnings_of
    from .protocol.anchors.view import AnchorView
    from .protocol.broadcasters import BroadcastView
    from .protocol.network import Network, Turn
    from .protocol.ranging import Slot
    from .protocol.schedules.view import TimedGroups, View
    from .protocol.slots import downlink_slot, uplink_slot
    from .protocol.tdma import broadcast, downlink_free, ping_group, until
    from .recorded.fitting import fit
    from .recorded.reading import read_log
    from .recorded.replaying import replay
    from .results.loading import load_result
    from .results.result import Result
    from .scenario.files.scenario_file import load_scenario
    from .scenario.own_routes import PlanView, WayView
    from .scenario.scenario import Scenario
    from .sea.water import absorption, sound_speed
    from .setup import Setup
    from .usbl.fusion import fuse
    from .usbl.own_instrument import Sounding
    from .verification.verdict import Verdict, verify

# What `reproduce` and `bench` run is in the wheel, or beside the package in a checkout.
if not (Path(__file__).parent / "experiments").is_dir():
    __path__.append(str(Path(__file__).parents[1]))

# Loaded when first asked for, so that `bindusbl-des --help` does not wait for numpy and pyarrow.
_HOMES = {
    "AuvStates": "mission.mission",
    "DeadReckoning": "navigation.dead_reckoning",
    "Navigator": "navigation.navigators",
    "Network": "protocol.network",
    "Odometry": "navigation.dead_reckoning",
    "PingUnderWay": "mission.mission",
    "Turn": "protocol.network",
    "AnchorView": "protocol.anchors.view",
    "BroadcastView": "protocol.broadcasters",
    "Campaign": "campaigns.campaign",
    "CampaignInterrupted": "campaigns.campaign",
    "CampaignState": "campaigns.campaign",
    "advise": "advice.advising",
    "compare": "campaigns.compare",
    "load_campaign": "campaigns.campaign",
    "sweep": "campaigns.running",
    "absorption": "sea.water",
    "airtime": "acoustics.messages",
    "broadcast": "protocol.tdma",
    "warnings_of": "preflight.warnings",
    "covered_area": "geometry.coverage",
    "covering_radius": "geometry.coverage",
    "downlink_free": "protocol.tdma",
    "downlink_slot": "protocol.slots",
    "formation": "geometry.formation",
    "fit": "recorded.fitting",
    "fuse": "usbl.fusion",
    "Instruments": "live.readings",
    "limits": "preflight.limits",
    "load_result": "results.loading",
    "load_scenario": "scenario.files.scenario_file",
    "Mission": "mission.mission",
    "ping_group": "protocol.tdma",
    "plan": "planning.planning",
    "Plan": "planning.planning",
    "range_loss": "acoustics.loss",
    "read_log": "recorded.reading",
    "replay": "recorded.replaying",
    "Result": "results.result",
    "resume": "campaigns.running",
    "Scenario": "scenario.scenario",
    "ScenarioError": "core.mistakes",
    "simulate": "mission.simulation",
    "sound_speed": "sea.water",
    "travel_time": "acoustics.travel_time",
    "until": "protocol.tdma",
    "uplink_slot": "protocol.slots",
    "PlanView": "scenario.own_routes",
    "Setup": "setup",
    "Signals": "acoustics.channel",
    "Slot": "protocol.ranging",
    "Sounding": "usbl.own_instrument",
    "TimedGroups": "protocol.schedules.view",
    "Verdict": "verification.verdict",
    "verify": "verification.verdict",
    "View": "protocol.schedules.view",
    "WayView": "scenario.own_routes",
}

__all__ = [
    "AnchorView",
    "AuvStates",
    "BroadcastView",
    "Campaign",
    "CampaignInterrupted",
    "CampaignState",
    "DeadReckoning",
    "Instruments",
    "Mission",
    "Navigator",
    "Network",
    "Odometry",
    "PingUnderWay",
    "Plan",
    "PlanView",
    "Result",
    "Scenario",
    "ScenarioError",
    "Setup",
    "Signals",
    "Slot",
    "Sounding",
    "TimedGroups",
    "Turn",
    "Verdict",
    "View",
    "WayView",
    "absorption",
    "advise",
    "airtime",
    "broadcast",
    "compare",
    "covered_area",
    "covering_radius",
    "downlink_free",
    "downlink_slot",
    "fit",
    "formation",
    "fuse",
    "limits",
    "load_campaign",
    "load_result",
    "load_scenario",
    "ping_group",
    "plan",
    "range_loss",
    "read_log",
    "replay",
    "resume",
    "simulate",
    "sound_speed",
    "sweep",
    "travel_time",
    "until",
    "uplink_slot",
    "verify",
    "warnings_of",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        from .core.wording import did_you_mean

        hint = did_you_mean(name, __all__)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}{hint}")
    return getattr(import_module(f".{_HOMES[name]}", __name__), name)


def __dir__() -> list[str]:
    return __all__
