"""What a prediction leaves out of a scenario, in words."""

from collections.abc import Iterator

from ....core.plugins import is_plugin
from ....core.wording import plain
from ....scenario.channel_settings import burst_s
from ....scenario.declared import schedule_of
from ....scenario.families import plugins_of
from ....scenario.part_choice import PartChoice
from ....scenario.scenario import Scenario
from ....scenario.telling import tells_slots


def approximations(scenario: Scenario) -> Iterator[str]:
    """Yield sentences on what of a scenario is predicted by something else, or left out."""
    for key, name in plugins_of(scenario).items():
        if key not in ("asvs.formation", "auvs.route"):
            yield f"{key} {name} is taken for the part that ships with the program."
    if taken := schedule_of(scenario).approximation:
        yield f"{scenario.protocol.schedule} {taken}"
    if scenario.auvs.vehicle.has_dynamics:
        yield "AUVs are taken to follow their plans exactly, whatever moves them."
    if scenario.asvs.vehicle.has_dynamics or is_plugin(str(scenario.asvs.vehicle)):
        yield "ASVs are taken to keep their stations exactly."
    if scenario.asvs.failures:
        yield "ASVs that fail are taken to serve all the time."
    if tells_slots(scenario):
        yield "AUVs are taken to know their slots: in no round does one miss the frame that tells."
    if scenario.protocol.positions != "truth" or tells_slots(scenario):
        yield "The schedule is taken to know where AUVs are: it may believe in fewer conflicts."
    lasting = [it for it in map(burst_s, _channels(scenario)) if it is not None]
    if lasting:
        yield (
            f"Losses that last {plain(max(lasting))} s are taken to come one by one: times without "
            "a fix, and errors, may be several times those predicted."
        )
    if scenario.usbl.outlier_share:
        yield "Outliers of the fixes are left out."
    if (
        scenario.acoustics.mf.payload_bytes is not None
        and scenario.acoustics.mf.overfull != "split"
    ):
        yield "No fix waits for a later broadcast, however full the first is."


def _channels(scenario: Scenario) -> tuple[PartChoice, PartChoice]:
    return scenario.acoustics.hf.channel, scenario.acoustics.mf.channel
