"""Rules for land: no vehicle lies or goes on land or in a keep-out."""

from collections.abc import Iterator

from ....support.mistakes import Problem
from ....support.plugins import PluginError
from ...geometry.area import Point
from ..site import Site
from .vehicles import has_too_many_lanes

# A path that is on land for no longer than this (m) only touches it.
TOUCHES_M = 1e-3


def land_problems(site: Site) -> Iterator[Problem]:
    """Yield vehicles that lie or go on land or in a keep-out.

    Nothing is yielded where the land itself is invalid, which `survey_problems` reports.
    """
    survey = site.scenario.survey
    if survey.land is None and survey.keep_out is None and len(survey.charted("area")[:1]) == 0:
        return
    try:
        if site.closed is None:
            return
        _ = site.area
    except ValueError:
        return
    yield from _places(site)
    yield from _ways(site)


def _places(site: Site) -> Iterator[Problem]:
    """Yield positions on land where vehicles lie, start or end."""
    formation = site.scenario.asvs.formation
    kept: list[tuple[str, str, Point]] = []
    if not formation.moves:
        kept += stations_of(site)
    for number, place in enumerate(getattr(formation, "start_m", None) or ()):
        kept.append((f"asvs.formation.start_m.{number}", f"ASV{number}", place))
    for number, auv in enumerate(site.auvs):
        for name in ("launch_m", "recovery_m"):
            if (place := getattr(auv, name)) is not None:
                kept.append((f"{auv.group.key(name)}", f"AUV{number}", place))
    for wing in site.wings:
        if wing.asked.is_held:
            try:
                places = site.route_of(wing).places
            except (ValueError, PluginError):  # no position on Earth, reported elsewhere
                continue
            key = f"{wing.key}.{wing.asked.places_key}"
            for number, ((place,), auv_number) in enumerate(
                zip(places, wing.members, strict=False)
            ):
                kept.append((f"{key}.{number}", f"AUV{auv_number}", place))
    for key, who, (x, y) in kept:
        if closed := ashore(site, (x, y)):
            yield Problem(key, f"{who} at ({x:g}, {y:g}) m is {closed}; move it", _LAND)


_LAND = ("survey.land", "survey.keep_out", "survey.area")


def stations_of(site: Site) -> list[tuple[str, str, Point]]:
    """Return the stations of vessels that keep them: key, name and place (m) of each."""
    formation = site.scenario.asvs.formation
    try:
        stations = site.stations_m
    except (ValueError, PluginError):  # reported elsewhere, or when the mission begins
        return []
    names = ("positions_m", "positions_deg", "radius_m")
    name = next(
        (name for name in names[:2] if getattr(formation, name, None) is not None), names[2]
    )
    return [
        (
            f"asvs.formation.{name}" + f".{asv}" * (name != "radius_m"),
            f"ASV{asv}",
            place,
        )
        for asv, place in enumerate(stations)
    ]


def ashore(site: Site, place: Point) -> str:
    """Return in words how far a position (m) is from open water; "" on open water."""
    for land, where in ((site.land, "on land"), (site.closed, "where nobody goes (keep_out)")):
        if land is not None and (inside := land.ashore(*place)) > 0.0:
            return f"{where}, {inside:.3g} m from open water"
    return ""


def _ways(site: Site) -> Iterator[Problem]:
    """Yield planned paths of AUVs that lead over land, with the first point on land."""
    closed = site.closed
    if closed is None or not any(wing.asked.is_flown for wing in site.wings):
        return
    if any(
        has_too_many_lanes(site, wing) or any(wing.asked.miscounted(len(wing.members)))
        for wing in site.wings
    ):
        return  # reported elsewhere
    try:
        plans = site.plans_that_ship
    except (ValueError, PluginError):
        return  # reported elsewhere
    for wing in site.wings:
        for number, auv in enumerate(wing.members):
            ends = (place for place in site.auvs[auv][-2:] if place is not None)
            if (plan := plans[auv]) is None or any(ashore(site, end) for end in ends):
                continue  # of which the place is reported
            over, begins = closed.along(plan.path.line())
            if over > TOUCHES_M:
                key = (
                    f"{wing.key}.{wing.asked.places_key}.{number}"
                    if wing.asked.PLACES
                    else wing.key
                )
                x, y, _ = plan.path.at(begins)
                yield Problem(
                    key,
                    f"the way of AUV{auv} leads over land, or where nobody goes, for {over:.4g} m, "
                    f"at first from ({x:.4g}, {y:.4g}) m on, {begins:.4g} m after its start; move "
                    "its points, or let it turn more tightly",
                    _LAND,
                )
