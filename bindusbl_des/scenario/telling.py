"""Whether AUVs have to be told their slots, and what the fleet then knows of where they are."""

from ..scenario.declared import knowledge_named
from .scenario_keys import ScenarioKeys


def tells_slots(scenario: ScenarioKeys) -> bool:
    """Tell whether AUVs are told their slots: where they have some, nobody calls them, and not all
    know at once.
    """
    protocol = scenario.protocol
    is_called = protocol.asvs_ping or protocol.calls
    by_frames = knowledge_named(protocol.knowledge).by_frames
    return by_frames and not is_called and not protocol.random_access


def positions_of(scenario: ScenarioKeys) -> str:
    """Return by what the fleet knows where its AUVs are: never by the truth if it is told of them
    by fixes alone.
    """
    positions = str(scenario.protocol.positions)
    return "carried_forward" if positions == "truth" and tells_slots(scenario) else positions
