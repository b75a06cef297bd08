"""What the placement of ASVs must agree on: where they are, or how they move."""

from collections.abc import Iterator

from ..scenario_keys import ScenarioKeys
from ..sections.anchors import AsvTrack, Follow, Moving, Placed
from ..sections.vehicles import Formation
from .problem import Problem

# So many ASVs are placed among so many AUVs in a tenth of a second; twice as many take seconds.
MOST_PLACED, MOST_FOLLOWED = 50, 100

# So many times ASVs may be told where to go; each takes a fifth of a kilobyte.
MOST_ORDERS = 1e6


def problems(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield what is wrong with ASVs that keep their places, or that move."""
    placement = scenario.asvs.formation
    if isinstance(placement, Formation):
        yield from _still(placement, scenario.asvs.count)
    elif isinstance(placement, Moving):
        yield from _moving(placement, scenario)


def _still(formation: Formation, count: int) -> Iterator[Problem]:
    degrees = formation.positions_deg
    name, each = ("positions_m", "[x, y]") if degrees is None else ("positions_deg", "[lat, lon]")
    places = formation.positions_m if degrees is None else degrees
    if formation.model is not None and (formation.model == "positions") is (places is None):
        yield Problem(
            "asvs.formation.model",
            f"positions needs {name}; add it, or use ring"
            if formation.model == "positions"
            else f"ring excludes {name}; remove it, or use positions",
            (f"asvs.formation.{name}",),
        )
    if places is not None:
        if len(places) != count:
            yield Problem(
                f"asvs.formation.{name}",
                f"needs one {each} per ASV: {count} expected, {len(places)} given",
                ("asvs.count",),
            )
        if formation.radius_m is not None or formation.clearance_m or formation.angle_deg:
            yield Problem(
                f"asvs.formation.{name}",
                "excludes radius_m, clearance_m and angle_deg; keep one or the other",
                tuple(f"asvs.formation.{key}" for key in ("radius_m", "clearance_m", "angle_deg")),
            )
    elif formation.radius_m is not None and formation.clearance_m:
        yield Problem(
            "asvs.formation.radius_m",
            "excludes clearance_m (R_f = hf.range_m + clearance_m); keep one of them",
            ("asvs.formation.clearance_m",),
        )


def _moving(placement: Moving, scenario: ScenarioKeys) -> Iterator[Problem]:
    asvs = scenario.asvs
    if asvs.vehicle.model != "moored":
        yield Problem(
            "asvs.vehicle",
            f"{asvs.vehicle} keeps a station, and {placement.MODEL} moves ASVs along straight "
            "lines; use vehicle moored, or a ring or positions",
            ("asvs.formation.model",),
        )
    lists = ("files", "tracks") if isinstance(placement, AsvTrack) else ("start_m",)
    for name in lists:
        given = getattr(placement, name)
        if len(given or ()) != asvs.count and (given or name == "files"):
            each = {"files": "file", "tracks": "name", "start_m": "[x, y]"}[name]
            yield Problem(
                f"asvs.formation.{name}",
                f"needs one {each} per ASV: {asvs.count} expected, {len(given or ())} given",
                ("asvs.count", "asvs.formation.model"),
            )
    if isinstance(placement, Placed) and asvs.count > MOST_PLACED:
        yield Problem(
            "asvs.count",
            f"{placement.MODEL} places at most {MOST_PLACED} ASVs; got {asvs.count}; use fewer, or "
            "a ring or positions",
            ("asvs.formation.model",),
        )
    if isinstance(placement, Follow) and scenario.auvs.count > MOST_FOLLOWED:
        yield Problem(
            "auvs.count",
            f"at most {MOST_FOLLOWED} AUVs can be followed; got {scenario.auvs.count}; use assign",
            ("asvs.formation.model",),
        )
    if isinstance(placement, Placed):
        orders = asvs.count * scenario.duration_s / placement.replan_s
        if orders > MOST_ORDERS:
            yield Problem(
                "asvs.formation.replan_s",
                f"{orders:.2g} orders ({asvs.count} ASVs, each {placement.replan_s:g} s for "
                f"{scenario.duration_s:g} s) exceed {MOST_ORDERS:.0e}; raise it",
                ("duration_s", "asvs.count"),
            )
