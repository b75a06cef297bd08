"""Whether AUVs have to be told their slots, and what the fleet then knows of where they are."""

from .families import is_random
from .scenario_keys import ScenarioKeys


def tells_slots(scenario: ScenarioKeys) -> bool:
    """Tell whether AUVs are told their slots: where they have some, nobody calls them, and not all
    know at once.
    """
    protocol = scenario.protocol
    is_called = protocol.is_passive or protocol.calls
    return protocol.knowledge == "broadcast" and not is_called and not is_random(scenario)


def positions_of(scenario: ScenarioKeys) -> str:
    """Return by what the fleet knows where its AUVs are: never by the truth if it is told of them
    by fixes alone.
    """
    positions = str(scenario.protocol.positions)
    return "carried_forward" if positions == "truth" and tells_slots(scenario) else positions
