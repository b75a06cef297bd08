"""What vehicles must agree on with their routes, what they steer by, and currents."""

from collections.abc import Iterator

from ..scenario_keys import ScenarioKeys
from .problem import Problem


def problems(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield vehicles that routes, feedback or currents ask too much of."""
    auvs, asvs, water = scenario.auvs, scenario.asvs, scenario.environment
    route = auvs.route.kind
    if auvs.vehicle.flies_paths and route in ("hold", "track"):
        yield Problem(
            "auvs.vehicle",
            f"{auvs.vehicle} flies paths; with a {route} route use kinematic",
            ("auvs.route.kind",),
        )
    if auvs.feedback == "estimate" and not auvs.vehicle.has_dynamics:
        yield Problem(
            "auvs.feedback",
            f"a {auvs.vehicle} vehicle does not steer; use truth, or vehicle bluerov2 or remus100",
            ("auvs.vehicle",),
        )
    flows = water.current_m_per_s > 0 or water.current_variation_m_per_s > 0
    feels = any(it.has_dynamics or it.own for it in (auvs.vehicle, asvs.vehicle))
    if flows and not feels and scenario.navigation.velocity == "over_ground":
        yield Problem(
            "environment.current_m_per_s",
            "a current moves neither kinematic nor moored vehicles, nor dead reckoning over "
            "ground, as of AUVs with a DVL that sees the bottom; for these set it to 0, they keep "
            "their way over ground, or use a vehicle with dynamics (remus100, bluerov2), which "
            "steers against it; for AUVs whose log measures through the water set "
            "navigation.velocity to through_water",
            ("auvs.vehicle", "asvs.vehicle", "navigation.velocity"),
        )
