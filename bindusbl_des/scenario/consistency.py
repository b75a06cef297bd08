"""What the parts of a scenario must agree on; every contradiction is listed, not just the first."""

from collections.abc import Iterator
from importlib.util import find_spec
from itertools import pairwise
from math import dist
from typing import NamedTuple

from ..core.plugins import is_plugin
from ..core.wording import did_you_mean
from ..geometry.lanes import lane_count
from ..presets.airtimes import airtime_table
from .channel_settings import table_mistakes
from .families import parts_of
from .instruments.agreement import contradictions
from .part_settings import shipped_mistakes
from .places.checks import misplaced
from .places.on_earth import origin_of, positioned
from .scenario_keys import ScenarioKeys
from .sections.environment import Environment
from .sections.routes import Lawnmower
from .sections.survey import SHAPES
from .sections.vehicles import Formation
from .survey_area import area_of, lanes_heading

FRAMED_SCHEDULES = ("round_robin", "random")

# A mission larger than this would exhaust the memory of any workstation.
LARGEST_SAMPLES = 5e8
MOST_LANES = 100_000

# The speed of sound (m/s) that is not given
USUAL_SPEED = Environment.model_fields["sound_speed_m_per_s"].default
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
        *(shape := list(_survey(scenario))),
        *_vehicles(scenario),
        *_fleet(scenario),
        *_origin(scenario),
        *_water(scenario),
        *(Problem(*found) for found in misplaced(scenario)),
        *_route(scenario),
        *([] if shape else _lanes(scenario)),
        *_formation(scenario),
        *_parts(scenario),
        *_protocol(scenario),
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


def _survey(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield what is wrong with the shape of the survey."""
    survey, shapes = scenario.survey, scenario.survey.shapes
    if len(shapes) != 1:
        first = shapes[0] if shapes else "side_m"
        yield Problem(
            f"survey.{shapes[1] if shapes else first}",
            f"excludes {first}: either says what the survey is; keep one, and set the other to "
            "null where it comes from elsewhere"
            if shapes
            else f"says of no survey what it is; give one of {', '.join(SHAPES)}",
            tuple(f"survey.{name}" for name in SHAPES),
        )
        return
    if shapes[0] in ("polygon_m", "area") and survey.rotation_deg:
        yield Problem(
            "survey.rotation_deg",
            "turns squares and rectangles; turn the corners of a polygon, and remove it",
            (f"survey.{shapes[0]}",),
        )
    try:
        area_of(scenario)
    except ValueError as error:
        yield Problem(f"survey.{shapes[0]}", str(error))


def _fleet(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield lists of what each AUV has that do not fit the number of AUVs."""
    auvs, survey = scenario.auvs, scenario.survey
    for name, given, what in (
        ("survey.depths_m", survey.depths_m, "depth"),
        ("auvs.speeds_m_per_s", auvs.speeds_m_per_s, "speed"),
        ("auvs.launch_m", auvs.launch_m, "[x, y]"),
        ("auvs.recovery_m", auvs.recovery_m, "[x, y]"),
    ):
        alone = what == "[x, y]" and given is not None and len(given) == 1
        if given is not None and len(given) != auvs.count and not alone:
            yield Problem(
                name,
                f"needs one {what} per AUV{', or one for all' if what == '[x, y]' else ''}: "
                f"{auvs.count} expected, {len(given)} given",
                ("auvs.count",),
            )


def _lanes(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield why the survey cannot be swept in lanes as asked for."""
    auvs, route = scenario.auvs, scenario.auvs.route
    if not isinstance(route, Lawnmower):
        return
    area, shape = area_of(scenario), f"survey.{scenario.survey.shapes[0]}"
    box = area.along(lanes_heading(scenario)).box
    spacing, across = route.lane_spacing_m, box.y_max - box.y_min
    if across / spacing > MOST_LANES:
        yield Problem(
            "auvs.route.lane_spacing_m",
            f"makes {across / spacing:.2g} lanes, more than {MOST_LANES:,}; use a wider spacing",
            (shape, "auvs.route.kind"),
        )
    elif route.division == "equal_length" and lane_count(across, spacing) < auvs.count:
        yield Problem(
            "auvs.route.division",
            f"shares {lane_count(across, spacing)} lanes out among {auvs.count} AUVs, of which "
            f"each needs one; use a spacing of {across / auvs.count:.4g} m or less, fewer AUVs, or "
            "strips",
            ("auvs.route.lane_spacing_m", "auvs.count", shape),
        )
    margin = spacing / 2 if route.end_margin_m is None else route.end_margin_m
    along = box.x_max - box.x_min
    if along - 2 * margin < SHORTEST_WAY:
        yield Problem(
            f"auvs.route.{'lane_spacing_m' if route.end_margin_m is None else 'end_margin_m'}",
            f"leaves no lane: margins of 2 x {margin:g} m fill the "
            f"{'side' if area.side else 'length'} of {along:g} m; use a smaller one",
            (shape, "auvs.route.kind"),
        )
    if not auvs.vehicle.has_dynamics and 2 * auvs.turning_radius_m > area.across:
        yield Problem(
            "auvs.turning_radius_m",
            f"a turn of {auvs.turning_radius_m:g} m radius does not fit a survey of {area.told}; "
            f"use at most {area.across / 2:g}",
            (shape, "auvs.vehicle", "auvs.route.kind"),
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
