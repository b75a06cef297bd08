"""Rules for surveys, vehicles, routes, stations and failures."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from math import dist

from ....support.mistakes import Problem
from ...geometry.lanes import SHORTEST_LANE, lane_count
from ..families import AUV
from ..groups import Wing
from ..key_types import Position
from ..sections.placements import Formation
from ..sections.routes import Lawnmower
from ..sections.survey import SHAPES
from ..sections.vehicles import Failure
from ..site import Site

# The most lanes of a survey, and of one with land, where each lane is planned over water.
MOST_LANES, MOST_ROUND_LAND = 100_000, 2_000


def survey_problems(site: Site) -> Iterator[Problem]:
    """Yield why the survey cannot be flown as asked."""
    shape = list(_shape(site))
    yield from shape
    yield from _fleet(site)
    if not shape:
        yield from _lanes(site)


def _shape(site: Site) -> Iterator[Problem]:
    """Yield why the survey has no valid shape."""
    survey, shapes = site.scenario.survey, site.scenario.survey.shapes
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
    if shapes[0] not in ("side_m", "size_m") and survey.rotation_deg:
        yield Problem(
            "survey.rotation_deg",
            "turns squares and rectangles; turn the corners of a polygon, and remove it",
            (f"survey.{shapes[0]}",),
        )
    try:
        _ = site.area
    except ValueError as error:
        key, _, message = str(error).partition(": ")
        if not key.startswith("survey."):
            key, message = f"survey.{shapes[0]}", str(error)
        yield Problem(key, message, ("environment.origin", "survey.land", "survey.keep_out"))


def _fleet(site: Site) -> Iterator[Problem]:
    """Yield lists with an entry per AUV whose length is not the number of AUVs."""
    auvs, survey = site.scenario.auvs, site.scenario.survey
    for key, fleet in (("auvs", auvs), ("asvs", site.scenario.asvs)):
        each = [group.count for group in fleet.groups]
        if each and sum(each) != fleet.count:
            yield Problem(
                f"{key}.count",
                f"is {fleet.count}, and groups are of {' + '.join(map(str, each))} = {sum(each)} "
                f"{key.upper()[:-1]}s; remove it, or have them add up",
                (f"{key}.groups",),
            )
    listed: list[tuple[str, Sequence[object] | None, str, int, str]] = [
        ("survey.depths_m", survey.depths_m, "depth", auvs.count, ""),
        ("auvs.speeds_m_per_s", auvs.speeds_m_per_s, "speed", auvs.count, ""),
        ("auvs.ping_late_s", auvs.ping_late_s, "time", auvs.count, ""),
    ]
    for name, what in (("launch_m", "[x, y]"), ("recovery_m", "[x, y]")):
        listed.append((f"auvs.{name}", getattr(auvs, name), what, auvs.count, ""))
        for number, group in enumerate(auvs.groups):
            key = f"auvs.groups.{number}.{name}"
            listed.append((key, getattr(group, name), what, group.count, " of the group"))
    for name, given, what, count, words in listed:
        alone = what == "[x, y]" and given is not None and len(given) == 1
        if given is not None and len(given) != count and not alone:
            yield Problem(
                name,
                f"needs one {what} per AUV{words}{', or one for all' if what == '[x, y]' else ''}: "
                f"{count} expected, {len(given)} given",
                ("auvs.count", "auvs.groups"),
            )


def _lanes(site: Site) -> Iterator[Problem]:
    """Yield why the survey cannot be swept in lanes as asked."""
    for wing in site.wings:
        if wing.asked.lanes is not None:
            yield from _ruled(site, wing, wing.asked.lanes)


def has_too_many_lanes(site: Site, wing: Wing) -> bool:
    """Tell whether a wing's lanes are more than the program plans."""
    if wing.asked.lanes is None:
        return False
    box = site.area.along(site.lanes_heading_rad(wing)).box
    most = MOST_ROUND_LAND if site.area.closed else MOST_LANES
    return (box.y_max - box.y_min) / wing.asked.lanes.lane_spacing_m > most


def _ruled(site: Site, wing: Wing, route: Lawnmower) -> Iterator[Problem]:
    area, shape, many = site.area, f"survey.{site.scenario.survey.shapes[0]}", len(wing)
    box = area.along(site.lanes_heading_rad(wing)).box
    spacing, across = route.lane_spacing_m, box.y_max - box.y_min
    if has_too_many_lanes(site, wing):
        most = f"{MOST_ROUND_LAND:,} round land" if area.closed else f"{MOST_LANES:,}"
        yield Problem(
            f"{wing.key}.lane_spacing_m",
            f"makes {across / spacing:.2g} lanes, more than {most}; use a wider spacing",
            (shape, f"{wing.key}.kind"),
        )
    elif route.division == "equal_length" and lane_count(across, spacing) < many:
        yield Problem(
            f"{wing.key}.division",
            f"shares {lane_count(across, spacing)} lanes out among {many} AUVs, of which "
            f"each needs one; use a spacing of {across / many:.4g} m or less, fewer AUVs, or "
            "strips",
            (f"{wing.key}.lane_spacing_m", "auvs.count", shape),
        )
    margin = spacing / 2 if route.end_margin_m is None else route.end_margin_m
    along = box.x_max - box.x_min
    if along - 2 * margin < SHORTEST_LANE:
        yield Problem(
            f"{wing.key}.{'lane_spacing_m' if route.end_margin_m is None else 'end_margin_m'}",
            f"leaves no lane: margins of 2 x {margin:g} m fill the "
            f"{'side' if area.side else 'length'} of {along:g} m; use a smaller one",
            (shape, f"{wing.key}.kind"),
        )
    for group in dict.fromkeys(site.auvs[auv].group for auv in wing.members):
        radius, hull = group.turning_radius_m, group.key("vehicle")
        if not group.vehicle.has_dynamics and 2 * radius > area.across:
            yield Problem(
                f"{hull}.turning_radius_m",
                f"a turn of {radius:g} m radius does not fit a survey of {area.words}; "
                f"use at most {area.across / 2:g}",
                (shape, hull, f"{wing.key}.kind"),
            )


def _wind(site: Site) -> Iterator[Problem]:
    """Yield vessels that sail without a wind, and a wind that is given twice."""
    wind = site.scenario.environment.wind
    sails = [vessels for vessels in site.vessels if vessels.vehicle.sails]
    if wind is not None and not sails:
        yield Problem(
            "environment.wind",
            "moves nothing, no vessel sails; remove it, or use asvs.vehicle: sailboat",
            ("asvs.vehicle",),
        )
    if (
        wind is not None
        and wind.file is not None
        and wind.model_fields_set & {"speed_m_per_s", "from_deg"}
    ):
        yield Problem(
            "environment.wind.file",
            "excludes speed_m_per_s and from_deg, which its samples have; keep one of them",
            ("environment.wind.speed_m_per_s", "environment.wind.from_deg"),
        )
    if sails and (wind is None or (wind.file is None and wind.speed_m_per_s == 0.0)):
        yield Problem(
            sails[0].key("asvs.vehicle"),
            f"{sails[0].vehicle} has no wind; set environment.wind.speed_m_per_s (or file), or use "
            "moored",
            ("environment.wind.speed_m_per_s", "environment.wind.file"),
        )


def vehicles_problems(site: Site) -> Iterator[Problem]:
    """Yield vehicles that cannot fly their route or steer by estimates, and idle currents."""
    water, hulls = site.scenario.environment, list[str]()
    steered = AUV.having(lambda traits: traits.has_dynamics)
    for group in site.groups:
        vehicle, hull = group.vehicle, group.key("vehicle")
        route = group.route
        hulls.append(hull)
        if vehicle.is_steered and (route.is_held or route.is_recorded):
            yield Problem(
                hull,
                f"{vehicle} flies paths; with a {route.choice} route use kinematic",
                (f"{group.key('route')}.kind",),
            )
        if group.by_estimate and not vehicle.has_dynamics:
            yield Problem(
                group.key("feedback"),
                f"a {vehicle} vehicle does not steer; use truth, or vehicle {' or '.join(steered)}",
                (hull,),
            )
    for name in ("heading_sd_deg", "drift") if site.scenario.protocol.asvs_ping else ():
        said = {getattr(group.navigation, name): group for group in site.groups}
        if len(said) > 1:
            yield Problem(
                list(said.values())[-1].key(name),
                "is to be the same in all groups with passive ranging, where the compass of an AUV "
                f"turns what its array sees; say it of all AUVs, in navigation.{name}",
                ("protocol.ranging",),
            )
    yield from _wind(site)
    flows = max(water.current_m_per_s, water.current_variation_m_per_s) > 0 or water.has_field
    feels = any(group.vehicle.is_steered for group in site.groups) or not site.keeps_still
    sees_all = site.scenario.navigation.dvl_range_m is None
    is_over = site.scenario.navigation.velocity == "over_ground"
    if flows and not feels and is_over and sees_all:
        yield Problem(
            f"environment.{'current' if water.has_field else 'current_m_per_s'}",
            "a current moves neither kinematic nor moored vehicles, nor dead reckoning over "
            "ground, as of AUVs with a DVL that sees the bottom; for these "
            f"{'leave it out' if water.has_field else 'set it to 0'}, they keep their way over "
            f"ground, or use a vehicle with dynamics ({', '.join(steered)}), which steers against "
            "it; for AUVs whose log measures through the water set navigation.velocity to "
            "through_water",
            (*dict.fromkeys(hulls), "asvs.vehicle", "navigation.velocity"),
        )


ORIGIN = ("environment.origin.lat_deg", "environment.origin.lon_deg")


def places_problems(site: Site) -> Iterator[Problem]:
    """Yield positions in degrees that have no origin, are given twice, or lie too far away."""
    given, corners = list(_in_degrees(site)), site.scenario.survey.corners_deg
    origin = site.origin_deg
    if origin is not None:
        key = f"survey.{site.scenario.survey.shapes[-1]}"
        yield from _far([(key, corner) for corner in corners], origin)
    for key, other, is_double, positions in given:
        section = key.rpartition(".")[0]
        if is_double:
            yield Problem(key, f"excludes {other}; keep one of them", (f"{section}.{other}",))
        if origin is None:
            message = "needs environment.origin.lat_deg and lon_deg, where x = y = 0"
            yield Problem(key, f"{message}; add them", ORIGIN)
        else:
            yield from _far(positions, origin)


def _in_degrees(
    site: Site,
) -> Iterator[tuple[str, str, bool, list[tuple[str, Position]]]]:
    """Yield each key in degrees, the key in metres beside it, whether both are given, and entries.

    An entry is a position with the key of its own.
    """
    formation = site.scenario.asvs.formation
    for wing in site.wings:
        if not (route := wing.asked).positions:
            continue
        key, listed = f"{wing.key}.{route.places_key}", []
        for auv, given in enumerate(route.positions):
            own = f"{key}.{auv}"
            listed += [(own, given[0])] if route.is_held else _keyed(own, given)
        yield key, f"{route.PLACES}_m", bool(route.places), listed
    stations = getattr(formation, "positions_deg", None)
    if stations is not None:
        key = "asvs.formation.positions_deg"
        is_double = getattr(formation, "positions_m", None) is not None
        yield key, "positions_m", is_double, _keyed(key, stations)


def _keyed(key: str, positions: Sequence[Position]) -> list[tuple[str, Position]]:
    """Return positions with the key of each, numbered from 0."""
    return [(f"{key}.{number}", position) for number, position in enumerate(positions)]


def _far(positions: list[tuple[str, Position]], origin: Position) -> Iterator[Problem]:
    """Yield the first position that is too far from the origin, if there is one."""
    from ...geometry.geodesy import far_apart_m
    from ...vehicles.tracks import FARTHEST, too_far

    if not positions:
        return
    lat, lon = zip(*(position for _, position in positions), strict=True)
    is_far = far_apart_m(lat, lon, origin) > FARTHEST
    if is_far.any():
        place, position = positions[int(is_far.argmax())]
        yield Problem(place, too_far(position, origin), ORIGIN)


def route_problems(site: Site) -> Iterator[Problem]:
    """Yield routes that do not fit the number of AUVs, lack points, or surface with dynamics."""
    for wing in site.wings:
        route, whose = wing.asked, "AUV that has no other" if wing.is_partial else "AUV"
        whose = whose if wing.key == "auvs.route" else "AUV of the group"
        for name, each, given in route.miscounted(len(wing)):
            yield Problem(
                f"{wing.key}.{name}",
                f"needs one {each} per {whose}: {len(wing)} expected, {given} given",
                ("auvs.count", "auvs.groups", f"{wing.key}.kind", f"{wing.key}.files"),
            )
        groups = dict.fromkeys(site.auvs[auv].group for auv in wing.members)
        steered = [group for group in groups if group.vehicle.is_steered]
        if route.surfacing is not None and steered:
            yield Problem(
                f"{wing.key}.surface_every_s",
                f"is for AUVs without dynamics: the equations of {steered[0].vehicle} know no "
                "surface, and its autopilot would take it above that; use vehicle: kinematic",
                (steered[0].key("vehicle"),),
            )
        if not route.is_flown or (route.positions and site.origin_deg is None):
            continue  # reported elsewhere
        for auv, points in enumerate(site.route_of(wing).places):
            if len(points) < 2 or any(dist(a, b) < SHORTEST_LANE for a, b in pairwise(points)):
                yield Problem(
                    f"{wing.key}.{route.places_key}.{auv}",
                    f"needs at least two points, those in a row {SHORTEST_LANE:g} m apart or more",
                )


# The most ASVs of a replanned placement: these take 0.1 s to place, twice as many take seconds.
MOST_PLACED = 50

# The most orders to ASVs in a mission; each takes 0.2 kB of memory.
MOST_ORDERS = 1e6


def formation_problems(site: Site) -> Iterator[Problem]:
    """Yield contradictions about stations of ASVs, or about ASVs that move."""
    placement = site.scenario.asvs.formation
    for group in site.vessels if not placement.moves else ():
        if group.speed_m_per_s is not None:
            yield Problem(
                f"asvs.groups.{group.number}.speed_m_per_s",
                f"is for ASVs that move, and those of {placement.choice} keep their stations; "
                "remove it, or choose a placement that moves, such as follow",
                ("asvs.formation.model",),
            )
    if not site.scenario.asvs.count:
        return
    if placement.moored is not None:
        yield from _still(placement.moored, site.scenario.asvs.count)
    elif placement.moves:
        yield from _moving(site)


def _still(formation: Formation, count: int) -> Iterator[Problem]:
    degrees = formation.positions_deg
    name, each = ("positions_m", "[x, y]") if degrees is None else ("positions_deg", "[lat, lon]")
    places = formation.positions_m if degrees is None else degrees
    misnamed = formation.misnamed(name)
    if misnamed:
        yield Problem("asvs.formation.model", misnamed, (f"asvs.formation.{name}",))
    if places is not None:
        if len(places) != count:
            yield Problem(
                f"asvs.formation.{name}",
                f"needs one {each} per ASV: {count} expected, {len(places)} given; or have them "
                "placed by `asvs.formation: {model: ring}` (--set 'asvs.formation={model: ring}')",
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


def _moving(site: Site) -> Iterator[Problem]:
    asvs, placement = site.scenario.asvs, site.scenario.asvs.formation
    for group in site.vessels:
        if group.vehicle.is_steered:
            yield Problem(
                group.key("asvs.vehicle"),
                f"{group.vehicle} keeps a station, and {placement.choice} moves ASVs along "
                "straight lines; use vehicle moored, or a ring or positions",
                ("asvs.formation.model",),
            )
    for name, each, given in placement.miscounted(asvs.count):
        yield Problem(
            f"asvs.formation.{name}",
            f"needs one {each} per ASV: {asvs.count} expected, {given} given",
            ("asvs.count", "asvs.formation.model"),
        )
    placed = placement.replanned
    if placed is None:
        return
    if asvs.count > MOST_PLACED:
        yield Problem(
            "asvs.count",
            f"{placement.choice} places at most {MOST_PLACED} ASVs; got {asvs.count}; use fewer, "
            "or a ring or positions",
            ("asvs.formation.model",),
        )
    if placed.MOST_AUVS is not None and site.scenario.auvs.count > placed.MOST_AUVS:
        yield Problem(
            "auvs.count",
            f"at most {placed.MOST_AUVS} AUVs can be followed; got {site.scenario.auvs.count}; use "
            "assign",
            ("asvs.formation.model",),
        )
    orders = asvs.count * site.scenario.duration_s / placed.replan_s
    if orders > MOST_ORDERS:
        yield Problem(
            "asvs.formation.replan_s",
            f"{orders:.2g} orders ({asvs.count} ASVs, each {placed.replan_s:g} s for "
            f"{site.scenario.duration_s:g} s) exceed {MOST_ORDERS:.0e}; raise it",
            ("duration_s", "asvs.count"),
        )


def no_such_asv(asv: int, count: int) -> str:
    """Return the message that an ASV does not exist among `count` ASVs.

    >>> no_such_asv(1, 1)
    'there is no ASV1: the only one is ASV0'
    """
    which = "the only one is ASV0" if count == 1 else f"the last is ASV{count - 1}"
    which = which if count else "asvs.count is 0"
    return f"there is no ASV{asv}: {which}"


def failures_problems(site: Site) -> Iterator[Problem]:
    """Yield failures of ASVs that do not exist, end before they begin, or overlap."""
    count, given = site.scenario.asvs.count, site.scenario.asvs.failures
    for number, failure in enumerate(given):
        key = f"asvs.failures.{number}"
        if failure.asv >= count:
            yield Problem(f"{key}.asv", no_such_asv(failure.asv, count), ("asvs.count",))
        if failure.until_s is not None and failure.until_s <= failure.at_s:
            problem = (
                f"must be later than at_s, which is {failure.at_s:g} s; got {failure.until_s:g}"
            )
            yield Problem(f"{key}.until_s", problem, (f"{key}.at_s",))
        for other in range(number):
            if given[other].asv == failure.asv and _meet(given[other], failure):
                yield Problem(
                    f"{key}.at_s",
                    f"ASV{failure.asv} fails while it has failed already (failure {other}); make "
                    "one of both",
                    (f"asvs.failures.{other}",),
                )


def _meet(one: Failure, other: Failure) -> bool:
    first, second = sorted((one, other), key=lambda failure: failure.at_s)
    return first.lasts(second.at_s)
