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
    from .acoustics.channel import Signals as Signals
    from .acoustics.loss import range_loss as range_loss
    from .acoustics.messages import airtime as airtime
    from .acoustics.travel_time import travel_time as travel_time
    from .advice.advising import advise as advise
    from .campaigns.campaign import Campaign as Campaign
    from .campaigns.campaign import CampaignInterrupted as CampaignInterrupted
    from .campaigns.campaign import CampaignState as CampaignState
    from .campaigns.campaign import load_campaign as load_campaign
    from .campaigns.compare import compare as compare
    from .campaigns.running import resume as resume
    from .campaigns.running import sweep as sweep
    from .core.mistakes import ScenarioError as ScenarioError
    from .geometry.coverage import covered_area as covered_area
    from .geometry.coverage import covering_radius as covering_radius
    from .geometry.formation import formation as formation
    from .live.readings import Instruments as Instruments
    from .mission.mission import AuvStates as AuvStates
    from .mission.mission import Mission as Mission
    from .mission.mission import PingUnderWay as PingUnderWay
    from .mission.simulation import simulate as simulate
    from .navigation.dead_reckoning import DeadReckoning as DeadReckoning
    from .navigation.dead_reckoning import Odometry as Odometry
    from .navigation.navigators import Navigator as Navigator
    from .planning.planning import Plan as Plan
    from .planning.planning import plan as plan
    from .preflight.limits import limits as limits
    from .preflight.warnings import warnings_of as warnings_of
    from .protocol.access.hosted import Modem as Modem
    from .protocol.anchors.view import AnchorView as AnchorView
    from .protocol.network import BroadcastView as BroadcastView
    from .protocol.network import Network as Network
    from .protocol.network import Turn as Turn
    from .protocol.ranging import Slot as Slot
    from .protocol.schedules.view import TimedGroups as TimedGroups
    from .protocol.schedules.view import View as View
    from .protocol.slots import downlink_slot as downlink_slot
    from .protocol.slots import uplink_slot as uplink_slot
    from .protocol.tdma import broadcast as broadcast
    from .protocol.tdma import downlink_free as downlink_free
    from .protocol.tdma import ping_group as ping_group
    from .protocol.tdma import until as until
    from .recorded.fitting import fit as fit
    from .recorded.reading import read_log as read_log
    from .recorded.replaying import replay as replay
    from .results.loading import load_result as load_result
    from .results.result import Result as Result
    from .scenario.files.scenario_file import load_scenario as load_scenario
    from .scenario.own_routes import PlanView as PlanView
    from .scenario.own_routes import WayView as WayView
    from .scenario.scenario import Scenario as Scenario
    from .sea.water import absorption as absorption
    from .sea.water import sound_speed as sound_speed
    from .setup import Setup as Setup
    from .usbl.fusion import fuse as fuse
    from .usbl.own_instrument import Sounding as Sounding
    from .verification.verdict import Verdict as Verdict
    from .verification.verdict import verify as verify

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
    "BroadcastView": "protocol.network",
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
    "Modem": "protocol.access.hosted",
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

__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        from .core.wording import did_you_mean

        hint = did_you_mean(name, __all__)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}{hint}")
    return getattr(import_module(f".{_HOMES[name]}", __name__), name)


def __dir__() -> list[str]:
    return __all__
