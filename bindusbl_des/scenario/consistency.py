"""What the parts of a scenario must agree on; every contradiction is listed, not just the first."""

from collections.abc import Iterator
from importlib.util import find_spec
from itertools import pairwise
from math import dist
from typing import NamedTuple

from ..core.plugins import is_plugin
from ..core.wording import did_you_mean
from ..presets.airtimes import airtime_table
from .channel_settings import table_mistakes
from .failing import untenable
from .families import parts_of
from .instruments.agreement import contradictions
from .part_settings import shipped_mistakes
from .places.checks import misplaced
from .places.on_earth import origin_of, positioned
from .protocols.agreement import disagreements
from .scenario_keys import ScenarioKeys
from .sections.anchors import AsvTrack, Follow, Moving, Placed
from .sections.environment import Environment
from .sections.vehicles import Formation
from .survey.agreement import SHORTEST_WAY, unsurveyable

FRAMED_SCHEDULES = ("round_robin", "random")

# A mission larger than this would exhaust the memory of any workstation.
LARGEST_SAMPLES = 5e8

# So many ASVs are placed among so many AUVs in a tenth of a second; twice as many take seconds.
MOST_PLACED, MOST_FOLLOWED = 50, 100

# So many times ASVs may be told where to go; each takes a fifth of a kilobyte.
MOST_ORDERS = 1e6

# The speed of sound (m/s) that is not given
USUAL_SPEED = Environment.model_fields["sound_speed_m_per_s"].default


class Problem(NamedTuple):
    """A contradiction: the key it is told at, what is wrong, and the other keys that lead to it."""

    key: str
    message: str
    others: tuple[str, ...] = ()


def problems(scenario: ScenarioKeys) -> list[Problem]:
    """Return every contradiction: dotted key, rule, value and remedy."""
    return [
        *(Problem(*found) for found in unsurveyable(scenario)),
        *_vehicles(scenario),
        *_origin(scenario),
        *_water(scenario),
        *(Problem(*found) for found in misplaced(scenario)),
        *_route(scenario),
        *_formation(scenario),
        *(Problem(*found) for found in untenable(scenario)),
        *_anchors(scenario),
        *_parts(scenario),
        *(Problem(*found) for found in disagreements(scenario)),
        *_channels(scenario),
        *_messages(scenario),
        *(Problem(*it) for it in contradictions(scenario)),
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


def _water(scenario: ScenarioKeys) -> Iterator[Problem]:
    water = scenario.environment
    key = "temperature_c" if water.ctd is None else "ctd"
    if getattr(water, key) is None:
        return
    if water.ctd is not None and water.temperature_c is not None:
        yield Problem(
            "environment.ctd",
            "says how warm the water is; remove temperature_c, or the cast",
            ("environment.temperature_c",),
        )
    given, whole = water.model_fields_set, set(type(water).model_fields)
    speed = water.sound_speed_m_per_s
    if speed != USUAL_SPEED or ("sound_speed_m_per_s" in given and given != whole):
        yield Problem(
            "environment.sound_speed_m_per_s",
            f"follows from {key}; keep one of them (assumed_sound_speed_m_per_s is what the fleet "
            "takes it for)",
            (f"environment.{key}",),
        )
    if water.sound_speed_law == "teos10":
        yield from _teos10(scenario, key)


def _teos10(scenario: ScenarioKeys, key: str) -> Iterator[Problem]:
    if origin_of(scenario) is None:
        yield Problem(
            "environment.sound_speed_law",
            "teos10 needs to know where that is: set environment.origin, or use mackenzie",
            (f"environment.{key}", "environment.origin"),
        )
    elif find_spec("gsw") is None:
        yield Problem(
            "environment.sound_speed_law",
            "teos10 needs the package gsw (pip install 'bindusbl-des[ocean]'); or use mackenzie",
            (f"environment.{key}",),
        )


def _route(scenario: ScenarioKeys) -> Iterator[Problem]:
    auvs, route = scenario.auvs, scenario.auvs.route
    if route.kind == "hold":
        places = route.positions_deg or route.positions_m
        if len(places) != auvs.count:
            unit, each = ("deg", "[lat, lon]") if route.positions_deg else ("m", "[x, y]")
            yield Problem(
                f"auvs.route.positions_{unit}",
                f"needs one {each} per AUV: {auvs.count} expected, {len(places)} given",
                ("auvs.count", "auvs.route.kind"),
            )
    if route.kind == "track" and route.tracks and len(route.tracks) != auvs.count:
        yield Problem(
            "auvs.route.tracks",
            f"needs one name per AUV: {auvs.count} expected, {len(route.tracks)} given",
            ("auvs.count", "auvs.route.kind"),
        )
    if route.kind == "track" and len(route.files) != auvs.count:
        yield Problem(
            "auvs.route.files",
            f"needs one file per AUV: {auvs.count} expected, {len(route.files)} given",
            ("auvs.count", "auvs.route.kind"),
        )
    if route.kind == "waypoints":
        name = "points_deg" if route.points_deg else "points_m"
        count = len(route.points_deg or route.points_m)
        if count != auvs.count:
            yield Problem(
                f"auvs.route.{name}",
                f"needs one list of points per AUV: {auvs.count} expected, {count} given",
                ("auvs.count", "auvs.route.kind"),
            )
        if route.points_deg and origin_of(scenario) is None:
            return  # which has been told
        for number, points in enumerate(positioned(scenario, route).points_m):
            if len(points) < 2 or any(dist(a, b) < SHORTEST_WAY for a, b in pairwise(points)):
                yield Problem(
                    f"auvs.route.{name}.{number}",
                    f"needs at least two points, those in a row {SHORTEST_WAY:g} m apart or more",
                )


def _formation(scenario: ScenarioKeys) -> Iterator[Problem]:
    formation, count = scenario.asvs.formation, scenario.asvs.count
    if not isinstance(formation, Formation):
        return
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


def _anchors(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield what is wrong with ASVs that move."""
    placement, asvs = scenario.asvs.formation, scenario.asvs
    if not isinstance(placement, Moving):
        return
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


def _channels(scenario: ScenarioKeys) -> Iterator[Problem]:
    for band in ("hf", "mf"):
        channel = getattr(scenario.acoustics, band).channel
        for setting, message in table_mistakes(channel, scenario.survey.deepest):
            yield Problem(
                f"acoustics.{band}.channel.{setting}",
                message,
                ("survey.depth_m", "survey.depths_m"),
            )


def _messages(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield why messages of the downlink cannot be sent, where there are any."""
    mf, protocol = scenario.acoustics.mf, scenario.protocol
    try:
        measured = None if mf.airtimes is None else airtime_table(mf.airtimes).most_bytes
    except ValueError as error:
        yield Problem("acoustics.mf.airtimes", str(error))
        return
    if protocol.is_passive or protocol.downlink == "direct_reply":
        return
    most, key = mf.payload_bytes, "acoustics.mf.payload_bytes"
    if measured is not None:
        if most is not None and most > measured:
            yield Problem(
                key,
                f"{most} B are more than the table of airtimes tells of, which ends at "
                f"{measured} B; use that at most",
                ("acoustics.mf.airtimes", "acoustics.mf.modem"),
            )
        most = min(measured, most or measured)
    needed = mf.header_bytes + mf.fix_bytes
    if most is not None and most < needed:
        yield Problem(
            key,
            f"a message of {most} B holds no fix, which with its header takes header_bytes + "
            f"fix_bytes = {needed} B; make these smaller, or use a modem with larger messages",
            ("acoustics.mf.header_bytes", "acoustics.mf.fix_bytes", "acoustics.mf.modem"),
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
