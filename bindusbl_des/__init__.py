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
    from .apps.advice.advising import advise as advise
    from .apps.campaigns.campaign import Campaign as Campaign
    from .apps.campaigns.campaign import CampaignInterrupted as CampaignInterrupted
    from .apps.campaigns.campaign import CampaignState as CampaignState
    from .apps.campaigns.campaign import load_campaign as load_campaign
    from .apps.campaigns.compare import compare as compare
    from .apps.campaigns.running import resume as resume
    from .apps.campaigns.running import sweep as sweep
    from .apps.live.readings import Instruments as Instruments
    from .apps.planning.planning import Plan as Plan
    from .apps.planning.planning import plan as plan
    from .apps.preflight.limits import limits as limits
    from .apps.preflight.warnings import warnings_of as warnings_of
    from .apps.recorded.fitting import fit as fit
    from .apps.recorded.reading import read_log as read_log
    from .apps.recorded.replaying import replay as replay
    from .apps.verification.verdict import Verdict as Verdict
    from .apps.verification.verdict import verify as verify
    from .core.acoustics.channel import Signals as Signals
    from .core.acoustics.loss import range_loss as range_loss
    from .core.acoustics.messages import airtime as airtime
    from .core.acoustics.travel_time import travel_time as travel_time
    from .core.geometry.coverage import covered_area as covered_area
    from .core.geometry.coverage import covering_radius as covering_radius
    from .core.geometry.formation import formation as formation
    from .core.mission.mission import AuvStates as AuvStates
    from .core.mission.mission import Mission as Mission
    from .core.mission.mission import PingUnderWay as PingUnderWay
    from .core.mission.simulation import simulate as simulate
    from .core.navigation.dead_reckoning import DeadReckoning as DeadReckoning
    from .core.navigation.dead_reckoning import Odometry as Odometry
    from .core.navigation.navigators import Navigator as Navigator
    from .core.protocol.access.hosted import Modem as Modem
    from .core.protocol.anchors.view import AnchorView as AnchorView
    from .core.protocol.network import BroadcastView as BroadcastView
    from .core.protocol.network import Network as Network
    from .core.protocol.network import Turn as Turn
    from .core.protocol.ranging import Slot as Slot
    from .core.protocol.slots import downlink_slot as downlink_slot
    from .core.protocol.slots import uplink_slot as uplink_slot
    from .core.protocol.tdma import broadcast as broadcast
    from .core.protocol.tdma import downlink_free as downlink_free
    from .core.protocol.tdma import ping_group as ping_group
    from .core.protocol.tdma import until as until
    from .core.protocol.view import TimedGroups as TimedGroups
    from .core.protocol.view import View as View
    from .core.results.loading import load_result as load_result
    from .core.results.result import Result as Result
    from .core.scenario.files.scenario_file import load_scenario as load_scenario
    from .core.scenario.own_routes import PlanView as PlanView
    from .core.scenario.own_routes import WayView as WayView
    from .core.scenario.scenario import Scenario as Scenario
    from .core.sea.water import absorption as absorption
    from .core.sea.water import sound_speed as sound_speed
    from .core.setup import Setup as Setup
    from .core.usbl.fusion import fuse as fuse
    from .core.usbl.own_instrument import Sounding as Sounding
    from .support.mistakes import ScenarioError as ScenarioError

# What `reproduce` and `bench` run is in the wheel, or beside the package in a checkout.
if not (Path(__file__).parent / "experiments").is_dir():
    __path__.append(str(Path(__file__).parents[1]))

# Loaded when first asked for, so that `bindusbl-des --help` does not wait for numpy and pyarrow.
_HOMES = {
    "AuvStates": "core.mission.mission",
    "DeadReckoning": "core.navigation.dead_reckoning",
    "Navigator": "core.navigation.navigators",
    "Network": "core.protocol.network",
    "Odometry": "core.navigation.dead_reckoning",
    "PingUnderWay": "core.mission.mission",
    "Turn": "core.protocol.network",
    "AnchorView": "core.protocol.anchors.view",
    "BroadcastView": "core.protocol.network",
    "Campaign": "apps.campaigns.campaign",
    "CampaignInterrupted": "apps.campaigns.campaign",
    "CampaignState": "apps.campaigns.campaign",
    "advise": "apps.advice.advising",
    "compare": "apps.campaigns.compare",
    "load_campaign": "apps.campaigns.campaign",
    "sweep": "apps.campaigns.running",
    "absorption": "core.sea.water",
    "airtime": "core.acoustics.messages",
    "broadcast": "core.protocol.tdma",
    "warnings_of": "apps.preflight.warnings",
    "covered_area": "core.geometry.coverage",
    "covering_radius": "core.geometry.coverage",
    "downlink_free": "core.protocol.tdma",
    "downlink_slot": "core.protocol.slots",
    "formation": "core.geometry.formation",
    "fit": "apps.recorded.fitting",
    "fuse": "core.usbl.fusion",
    "Instruments": "apps.live.readings",
    "limits": "apps.preflight.limits",
    "load_result": "core.results.loading",
    "load_scenario": "core.scenario.files.scenario_file",
    "Mission": "core.mission.mission",
    "Modem": "core.protocol.access.hosted",
    "ping_group": "core.protocol.tdma",
    "plan": "apps.planning.planning",
    "Plan": "apps.planning.planning",
    "range_loss": "core.acoustics.loss",
    "read_log": "apps.recorded.reading",
    "replay": "apps.recorded.replaying",
    "Result": "core.results.result",
    "resume": "apps.campaigns.running",
    "Scenario": "core.scenario.scenario",
    "ScenarioError": "support.mistakes",
    "simulate": "core.mission.simulation",
    "sound_speed": "core.sea.water",
    "travel_time": "core.acoustics.travel_time",
    "until": "core.protocol.tdma",
    "uplink_slot": "core.protocol.slots",
    "PlanView": "core.scenario.own_routes",
    "Setup": "core.setup",
    "Signals": "core.acoustics.channel",
    "Slot": "core.protocol.ranging",
    "Sounding": "core.usbl.own_instrument",
    "TimedGroups": "core.protocol.view",
    "Verdict": "apps.verification.verdict",
    "verify": "apps.verification.verdict",
    "View": "core.protocol.view",
    "WayView": "core.scenario.own_routes",
}

__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        from .support.wording import did_you_mean

        hint = did_you_mean(name, __all__)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}{hint}")
    return getattr(import_module(f".{_HOMES[name]}", __name__), name)


def __dir__() -> list[str]:
    return __all__
