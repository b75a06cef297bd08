"""How many functions a first mission has to compile, so that one can tell how long it will take."""

from ..scenario.instruments.lasting_kinds import told_of
from ..scenario.scenario import Scenario

# Counted in first missions of each kind; within a tenth of it, equal shares take equal times.
ALWAYS, OF_A_HULL, OF_LASTING_ERRORS = 194, 89, 50
OF_RANGING, OF_FILTER = {"twtt": 27, "passive": -37}, {"smoother": 14}


def functions_to_compile(scenario: Scenario) -> int:
    """Return about how many functions a mission has compiled if nothing is on the disk yet."""
    hulls = {it.model for it in (scenario.auvs.vehicle, scenario.asvs.vehicle) if it.has_dynamics}
    return (
        ALWAYS
        + OF_A_HULL * bool(hulls)
        + OF_LASTING_ERRORS * bool(told_of(scenario))
        + OF_RANGING.get("twtt" if scenario.protocol.calls else str(scenario.protocol.ranging), 0)
        + OF_FILTER.get(str(scenario.navigation.filter), 0)
    )
