"""Rules for the bottom: no vehicle is planned to go into the ground, or where no chart reaches."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ....support.mistakes import Problem
from ....support.plugins import PluginError
from ..groups import Auv
from ..site import Site
from .land import stations_of
from .vehicles import has_too_many_lanes

if TYPE_CHECKING:
    from ....support.arrays import Floats

KEY = "environment.bathymetry"
DEPTHS = ("survey.depth_m", "survey.depths_m", "auvs.depth.altitude_m", "survey")


def bottom_problems(site: Site) -> Iterator[Problem]:
    """Yield altitudes that cannot be kept, and ways that lead into the ground or off the chart."""
    yield from _altitudes(site)
    navigation = site.scenario.navigation
    if navigation.dvl_range_m is not None:
        key, other = "navigation.dvl_range_m", "navigation.velocity"
        if navigation.velocity == "through_water":
            yield Problem(
                key, "excludes velocity: through_water, which sees no bottom; keep one", (other,)
            )
        if site.scenario.environment.bathymetry is None:
            yield Problem(
                key, f"needs a bottom, and there is none; add {KEY} (a file, or its depth)", (KEY,)
            )
    if site.scenario.environment.bathymetry is None:
        if site.scenario.acoustics.hf.channel.settings.get("bottom_m") == "bathymetry":
            yield Problem(
                "acoustics.hf.channel.bottom_m",
                f"is that of {KEY}, and there is none; add it, or give the depth in m",
                (KEY,),
            )
        return
    try:
        _ = site.area
    except ValueError:
        return  # reported elsewhere
    try:
        _ = site.bottom
    except ValueError as error:
        key, _, message = str(error).partition(": ")
        if key.startswith(KEY):
            yield Problem(key, message, (KEY, "environment.origin", "survey"))
        return
    except PluginError:
        return
    yield from _ways(site)
    yield from _ashore(site)


def _altitudes(site: Site) -> Iterator[Problem]:
    """Yield altitudes of AUVs whose depth is said otherwise, or that have no bottom."""
    survey = site.scenario.survey
    for group in site.groups:
        if group.altitude.altitude_m is None:
            continue
        key = f"{group.key('depth')}.altitude_m"
        if site.scenario.environment.bathymetry is None:
            yield Problem(
                key,
                f"is above a bottom, and there is none; add {KEY} (a file, or its depth in m), or "
                "give survey.depth_m instead",
                (KEY,),
            )
        if survey.depths_m is not None:
            yield Problem(key, "excludes survey.depths_m; keep one of them", ("survey.depths_m",))
        if getattr(group.own, "depth_m", None) is not None:
            yield Problem(key, "excludes depth_m of the group; keep one of them")
        route = group.route
        if route.is_recorded:
            what = "AUVs that repeat a track have its depths"
        elif group.vehicle.own is not None:
            what = "user-defined vehicles say their own depth"
        elif route.surfacing is not None:
            what = "AUVs that surface climb from one depth"
        else:
            continue
        yield Problem(key, f"{what}; remove it", (f"{group.key('route')}.kind",))


def _ways(site: Site) -> Iterator[Problem]:
    """Yield AUVs whose planned way is below the bottom, or leads off the chart, and where."""
    if any(
        has_too_many_lanes(site, wing) or any(wing.asked.miscounted(len(wing.members)))
        for wing in site.wings
    ):
        return  # reported elsewhere
    for auv in site.auvs:
        try:
            way = _way(site, auv)
        except (ValueError, PluginError, OverflowError):
            return  # reported elsewhere
        if way is None:
            continue
        import numpy as np

        floor = site.bottom.below(way)
        kept, group = auv.group.altitude, auv.group
        key = (
            f"{group.key('depth')}.altitude_m"
            if kept.altitude_m is not None
            else group.key("depth_m")
        )
        if key == "survey.depths_m":
            key = f"{key}.{auv.number}"
        if len(unknown := np.flatnonzero(np.isnan(floor))):
            yield Problem(
                f"{KEY}.file" if site.bottom.is_known else KEY,
                f"has no depth where AUV{auv.number} is to go: {_place(way[unknown[0]])} "
                "(no data, or beyond its edge); use a chart that reaches there, or move the survey",
                DEPTHS,
            )
            continue
        into = way[:, 2] - floor
        if (into < 0.0).all():
            continue
        first, worst = int(np.argmax(into >= 0.0)), int(into.argmax())
        if kept.altitude_m is not None:
            yield Problem(
                key,
                f"cannot be kept by AUV{auv.number}: the bottom is {floor[worst]:.3g} m deep at "
                f"{_place(way[worst])}, and the AUV goes no shallower than {kept.shallowest_m:g} m "
                "(shallowest_m); move the survey, or lower that",
                (KEY, "survey"),
            )
            continue
        yield Problem(
            key,
            f"takes AUV{auv.number} into the ground: it is to go at {way[first, 2]:.4g} m where "
            f"the bottom is at {floor[first]:.4g} m, first at {_place(way[first])}, and is "
            f"{into[worst]:.3g} m below it at {_place(way[worst])}; use a depth of less than "
            f"{floor.min():.3g} m, or auvs.depth.altitude_m",
            (KEY, "survey", "auvs.route"),
        )


def _place(place: "Floats") -> str:
    return f"x {place[0]:.0f} m, y {place[1]:.0f} m"


def _way(site: Site, auv: Auv) -> "Floats | None":
    """Return positions (n, 3), m, all along the planned way of an AUV; None of one of its own."""
    import numpy as np

    step, number = site.bottom.step_m, auv.number
    plan, track = site.plans_that_ship[number], site.auv_tracks[number]
    held = site.held_places_m[number]
    if plan is not None:
        tour = site.tour_of(auv, plan)
        along = np.linspace(0.0, tour.length, int(np.clip(tour.length / step, 1, 100_000)) + 1)
        return np.column_stack((tour.sample(along)[:, :2], auv.depth_m - tour.heights(along)))
    if track is not None:
        ways = np.hypot(*np.diff(track[1][:, :2], axis=0).T)
        passed = np.concatenate(([0.0], np.cumsum(ways)))
        along = np.union1d(passed, np.arange(0.0, passed[-1], max(step, passed[-1] / 1e5)))
        return np.column_stack([np.interp(along, passed, axis) for axis in track[1].T])
    if held is not None:
        return np.array([(*held, site.depth_at(auv, held))])
    return None


def _ashore(site: Site) -> Iterator[Problem]:
    """Yield stations where the chart has land."""
    if site.scenario.asvs.formation.moves:
        return
    for key, who, place in stations_of(site):
        depth = float(site.bottom.below([place])[0])
        if depth <= 0.0:
            yield Problem(
                key,
                f"{who} at ({place[0]:g}, {place[1]:g}) m is on land by {KEY}, {-depth:.3g} m "
                "above the water; move it",
                (KEY,),
            )
