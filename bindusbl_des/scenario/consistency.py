"""What the parts of a scenario must agree on; every contradiction is listed, not just the first."""

from collections.abc import Iterator
from itertools import pairwise
from math import dist
from typing import NamedTuple

from ..core.plugins import is_plugin
from ..core.wording import did_you_mean, plain
from .families import parts_of
from .part_choice import PartChoice
from .part_settings import shipped_mistakes
from .scenario_keys import ScenarioKeys
from .sections.usbl import usbl_values
from .sections.vehicles import Formation

FRAMED_SCHEDULES = ("round_robin", "random")

# A mission larger than this would exhaust the memory of any workstation.
LARGEST_SAMPLES = 5e8
MOST_LANES = 100_000

# The greatest distance (m) between two hydrophones of each of hydrophones.ARRAYS
ARRAY_SIZES_M = {"oem5": 0.0799, "cross5": 0.06}

# What the sheet of an inertial system says with one figure, and what these keys say of nothing
REPLACED_BY_DRIFT = {
    "velocity_bias_m_per_s": (0.0, 0.0),
    "velocity_bias_sd_m_per_s": 0.0,
    "velocity_bias_time_constant_s": None,
    "random_walk_m_per_sqrt_s": 0.0,
}

# Shorter lanes and ways (m) are no lanes: a vehicle cannot be said to go along them.
SHORTEST_WAY = 0.001


class Problem(NamedTuple):
    """A contradiction: the key it is told at, what is wrong, and the other keys that lead to it."""

    key: str
    message: str
    others: tuple[str, ...] = ()


def problems(scenario: ScenarioKeys) -> list[Problem]:
    """Return every contradiction: dotted key, rule, value and remedy."""
    return [
        *_vehicles(scenario),
        *_origin(scenario),
        *_route(scenario),
        *_formation(scenario),
        *_parts(scenario),
        *_protocol(scenario),
        *_usbl(scenario),
        *_drift(scenario),
        *_sizes(scenario),
    ]


def _vehicles(scenario: ScenarioKeys) -> Iterator[Problem]:
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
            "ground; set it to 0, use a vehicle with dynamics, or set navigation.velocity to "
            "through_water",
            ("auvs.vehicle", "asvs.vehicle", "navigation.velocity"),
        )


def _origin(scenario: ScenarioKeys) -> Iterator[Problem]:
    given = scenario.environment.origin
    for name, other in (("lat_deg", "lon_deg"), ("lon_deg", "lat_deg")):
        if getattr(given, name) is not None and getattr(given, other) is None:
            yield Problem(
                f"environment.origin.{name}",
                f"needs {other} as well; add it",
                (f"environment.origin.{other}",),
            )


def _route(scenario: ScenarioKeys) -> Iterator[Problem]:
    auvs, route = scenario.auvs, scenario.auvs.route
    if route.kind == "hold" and len(route.positions_m) != auvs.count:
        yield Problem(
            "auvs.route.positions_m",
            f"needs one [x, y] per AUV: {auvs.count} expected, {len(route.positions_m)} given",
            ("auvs.count", "auvs.route.kind"),
        )
    if route.kind == "track" and len(route.files) != auvs.count:
        yield Problem(
            "auvs.route.files",
            f"needs one file per AUV: {auvs.count} expected, {len(route.files)} given",
            ("auvs.count", "auvs.route.kind"),
        )
    if route.kind == "waypoints":
        if len(route.points_m) != auvs.count:
            yield Problem(
                "auvs.route.points_m",
                f"needs one list of points per AUV: {auvs.count} expected, "
                f"{len(route.points_m)} given",
                ("auvs.count", "auvs.route.kind"),
            )
        for number, points in enumerate(route.points_m):
            if len(points) < 2 or any(dist(a, b) < SHORTEST_WAY for a, b in pairwise(points)):
                yield Problem(
                    f"auvs.route.points_m.{number}",
                    f"needs at least two points, those in a row {SHORTEST_WAY:g} m apart or more",
                )
    if route.kind == "lawnmower":
        lanes = scenario.survey.side_m / route.lane_spacing_m
        if lanes > MOST_LANES:
            yield Problem(
                "auvs.route.lane_spacing_m",
                f"makes {lanes:.2g} lanes, more than {MOST_LANES:,}; use a wider spacing",
                ("survey.side_m", "auvs.route.kind"),
            )
        margin = route.lane_spacing_m / 2 if route.end_margin_m is None else route.end_margin_m
        if scenario.survey.side_m - 2 * margin < SHORTEST_WAY:
            yield Problem(
                "auvs.route.end_margin_m"
                if route.end_margin_m is not None
                else "auvs.route.lane_spacing_m",
                f"leaves no lane: margins of 2 x {margin:g} m fill the side of "
                f"{scenario.survey.side_m:g} m; use a smaller one",
                ("survey.side_m", "auvs.route.kind"),
            )
        if not auvs.vehicle.has_dynamics and 2 * auvs.turning_radius_m > scenario.survey.side_m:
            yield Problem(
                "auvs.turning_radius_m",
                f"a turn of {auvs.turning_radius_m:g} m radius does not fit a survey of "
                f"{scenario.survey.side_m:g} m; use at most {scenario.survey.side_m / 2:g}",
                ("survey.side_m", "auvs.vehicle", "auvs.route.kind"),
            )


def _formation(scenario: ScenarioKeys) -> Iterator[Problem]:
    formation, count = scenario.asvs.formation, scenario.asvs.count
    if not isinstance(formation, Formation):
        return
    given = formation.positions_m is not None
    if formation.model is not None and (formation.model == "positions") is not given:
        yield Problem(
            "asvs.formation.model",
            "positions needs positions_m; add it, or use ring"
            if formation.model == "positions"
            else "ring excludes positions_m; remove it, or use positions",
            ("asvs.formation.positions_m",),
        )
    if formation.positions_m is not None:
        if len(formation.positions_m) != count:
            yield Problem(
                "asvs.formation.positions_m",
                f"needs one [x, y] per ASV: {count} expected, {len(formation.positions_m)} given",
                ("asvs.count",),
            )
        if formation.radius_m is not None or formation.clearance_m or formation.angle_deg:
            yield Problem(
                "asvs.formation.positions_m",
                "excludes radius_m, clearance_m and angle_deg; keep one or the other",
                tuple(f"asvs.formation.{key}" for key in ("radius_m", "clearance_m", "angle_deg")),
            )
    elif formation.radius_m is not None and formation.clearance_m:
        yield Problem(
            "asvs.formation.radius_m",
            "excludes clearance_m (R_f = hf.range_m + clearance_m); keep one of them",
            ("asvs.formation.clearance_m",),
        )


def _parts(scenario: ScenarioKeys) -> Iterator[Problem]:
    for family, name in parts_of(scenario):
        if name in family.siblings:
            for setting, message in shipped_mistakes(family, name):
                yield Problem(f"{family.key}.{setting}", message)
        elif not is_plugin(name):
            yield Problem(
                family.key,
                f"{name!r} is no {family.noun}{did_you_mean(name, family.siblings)} (one of "
                f"{', '.join(family.siblings)}, or your own as module:object)",
            )


def _protocol(scenario: ScenarioKeys) -> Iterator[Problem]:
    asv, count = scenario.protocol.broadcaster.settings.get("asv"), scenario.asvs.count
    if scenario.protocol.broadcaster == "fixed" and isinstance(asv, int) and asv >= count:
        yield Problem(
            "protocol.broadcaster.asv",
            f"there is no ASV{asv}: {count} ASVs are numbered from 0; use at most {count - 1}",
            ("asvs.count",),
        )


def _usbl(scenario: ScenarioKeys) -> Iterator[Problem]:
    name, model = scenario.usbl.preset, scenario.usbl.model
    if name is not None and model != PartChoice.read(usbl_values(name)["model"], str):
        yield Problem(
            "usbl.model",
            f"is not that of the preset {name}, which says what an arrival measures; keep one of "
            f"them; got {model.told}",
            ("usbl.preset",),
        )
    size, speed = ARRAY_SIZES_M[scenario.usbl.array], scenario.environment.sound_speed_m_per_s
    for name, meant in (("tdoa_sd_s", "noise"), ("quantum_s", "a quantum")):
        time = getattr(scenario.usbl, name)
        if time * speed > size:
            yield Problem(
                f"usbl.{name}",
                f"{meant} of {time:g} s is {time * speed:.3g} m of sound, more than the "
                f"{1e3 * size:.0f} mm of the array {scenario.usbl.array}: no direction could be "
                f"told; use {0.9 * size / speed:.1e} at most",
                ("usbl.array", "environment.sound_speed_m_per_s"),
            )


def _drift(scenario: ScenarioKeys) -> Iterator[Problem]:
    navigation, drift = scenario.navigation, scenario.navigation.drift
    if not drift.is_stated:
        return
    stated = "percent_of_distance" if drift.m_per_hour is None else "m_per_hour"
    if drift.percent_of_distance is not None and drift.m_per_hour is not None:
        yield Problem(
            "navigation.drift.m_per_hour",
            "is another statement of the same as percent_of_distance; keep one of them",
            ("navigation.drift.percent_of_distance",),
        )
    for name, none in REPLACED_BY_DRIFT.items():
        if (value := getattr(navigation, name)) != none:
            yield Problem(
                f"navigation.{name}",
                f"is replaced by navigation.drift, which says how far dead reckoning goes astray "
                f"in all; remove it or set it to {plain(none)}; got {plain(value)}",
                (f"navigation.drift.{stated}",),
            )


def _sizes(scenario: ScenarioKeys) -> Iterator[Problem]:
    vehicles = scenario.auvs.count + scenario.asvs.count
    for name, rate in (
        ("record.metrics_hz", scenario.record.metrics_hz),
        ("record.tracks_hz", scenario.record.tracks_hz),
        ("navigation.imu_rate_hz", scenario.navigation.imu_rate_hz),
    ):
        samples = scenario.duration_s * rate * vehicles
        if samples > LARGEST_SAMPLES:
            yield Problem(
                name,
                f"{samples:.2g} samples ({scenario.duration_s:g} s x {rate:g} Hz x {vehicles} "
                f"vehicles) exceed {LARGEST_SAMPLES:.0e}; lower rate, duration or fleet",
                ("duration_s", "auvs.count", "asvs.count"),
            )
