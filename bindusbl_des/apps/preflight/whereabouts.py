"""Warnings about positions: vehicles outside the survey, out of reach, or idle."""

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING

from ...core.scenario.scenario import Scenario
from ...core.setup import Setup
from ...support.mistakes import Problem
from ...support.wording import timed

if TYPE_CHECKING:
    from ...support.arrays import Floats

# A warning names at most so many vehicles.
MOST_NAMED = 5

# A position less than this (m) beyond the edge of an area is on it: rounding.
ON_THE_EDGE_M = 1e-6

# A path less than this (m) beyond an edge runs along it.
SHORTEST_GAP_M = 0.1

# A path is sampled at no more than so many positions.
MOST_STEPS = 20_000

# Instants at which a track is sampled, for the share of time outside the survey.
LOOKS = 2001


def formation(setup: Setup) -> Iterator[Problem]:
    """Yield ASVs moored by default outside the survey, or so far away that they hear no AUV."""
    scenario = setup.scenario
    asked = scenario.asvs.formation.moored
    if asked is None or not setup.stations_m:
        return
    stations, area = setup.stations_m, setup.area
    beyond = [area.beyond(x, y) for x, y in stations]
    if asked.is_placed or asked.radius_m is not None or len(stations) == 1:
        yield from _unheard(scenario, beyond)
        return
    radius = asked.radius(scenario.acoustics.hf.range_m)
    outside = sum(excess > 1e-9 * radius for excess in beyond)
    if outside:
        edge = f" ({area.side / 2:g} m from the centre)" if area.side else ""
        yield Problem(
            "asvs.formation.radius_m",
            f"is by default hf.range_m + clearance_m = {radius:g} m, which puts {outside} of "
            f"{len(stations)} ASVs outside the survey, up to {max(beyond):.3g} m beyond its edge"
            f"{edge}; set it to have them elsewhere",
            ("asvs.formation.clearance_m", "acoustics.hf.range_m", *shapes(scenario)),
        )


def _unheard(scenario: Scenario, beyond: Sequence[float]) -> Iterator[Problem]:
    """Yield ASVs so far (m) beyond the survey's edge that they hear no AUV in it."""
    reach = scenario.acoustics.hf.range_m
    deaf = [asv for asv, excess in enumerate(beyond) if excess > reach]
    if not deaf or not scenario.acoustics.hf.traits.ends_at_range:
        return
    asked = scenario.asvs.formation
    names = [name for name in ("positions_m", "positions_deg") if getattr(asked, name) is not None]
    farthest = max(beyond[asv] for asv in deaf)
    yield Problem(
        f"asvs.formation.{(*names, 'radius_m')[0]}",
        f"{named('ASV', deaf)} up to {farthest:.4g} m beyond the edge of the survey, HF reaches "
        f"{reach:g} m: no AUV is heard there that is in the survey",
        ("acoustics.hf.range_m", *shapes(scenario)),
    )


def deep(setup: Setup) -> Iterator[Problem]:
    """Yield AUVs deeper than a band reaches: ASVs never hear them, or never reach them."""
    scenario, bands = setup.scenario, setup.scenario.acoustics
    missed = ("hf", bands.hf, "hears them"), ("mf", bands.mf, "reaches them")
    for name, band, words in missed if scenario.protocol.sends_frames else missed[:1]:
        if band.range_metric != "slant" or not band.traits.ends_at_range:
            continue
        deaf = [auv for auv in setup.auvs if auv.depth_m > band.range_m]
        if deaf:
            yield Problem(
                deaf[0].group.key("depth_m"),
                f"{named('AUV', [auv.number for auv in deaf])} deeper than the {name.upper()} "
                f"range, {band.range_m:g} m slant: no ASV at the surface {words}",
                (f"acoustics.{name}.range_m", f"acoustics.{name}.range_metric"),
            )


def anchors(setup: Setup) -> Iterator[Problem]:
    """Yield what keeps replanned ASVs from being near the AUVs."""
    scenario = setup.scenario
    asked = scenario.asvs.formation.replanned
    if asked is None or not scenario.asvs.count:
        return
    if scenario.protocol.asvs_ping:
        yield Problem(
            "asvs.formation.model",
            f"{asked.choice} goes by what is planned alone: with passive ranging AUVs fix "
            "themselves, and the fleet knows of no fix",
            ("protocol.ranging",),
        )
    flown = [auv for wing in setup.wings if wing.asked.is_flown for auv in wing.members]
    fastest = max([setup.auvs[auv].speed_m_per_s for auv in flown], default=0.0)
    if asked.speed_m_per_s < fastest:
        yield Problem(
            "asvs.formation.speed_m_per_s",
            f"is {asked.speed_m_per_s:g} m/s and AUVs go at {fastest:g} m/s: ASVs fall behind on "
            "every lane",
            ("auvs.speed_m_per_s", "auvs.speeds_m_per_s"),
        )


def shapes(scenario: Scenario) -> list[str]:
    """Return the keys that define the survey's area."""
    return [f"survey.{name}" for name in scenario.survey.shapes]


def routes(setup: Setup) -> Iterator[Problem]:
    """Yield AUVs whose waypoints or held positions lie outside the survey."""
    area = setup.area
    for wing in setup.wings:
        if not wing.asked.PLACES:
            continue
        plans = zip(wing.members, setup.route_of(wing).places, strict=True)
        beyond = {auv: max(area.beyond(x, y) for x, y in plan) for auv, plan in plans}
        outside = {auv: excess for auv, excess in beyond.items() if excess > ON_THE_EDGE_M}
        if outside:
            yield Problem(
                f"{wing.key}.{wing.asked.places_key}",
                f"{named('AUV', list(outside))} outside the survey of {area.words}, up to "
                f"{max(outside.values()):.3g} m beyond its edge; slots are made for sound that "
                "crosses the survey",
                tuple(shapes(setup.scenario)),
            )


# AUVs that wait for a shorter share of a mission than this hardly change its means.
IDLE_SHARE = 0.05
# Lanes longer than a mission by this factor are not all flown, however they are divided.
FAR_TOO_LONG = 1.5


def idle(setup: Setup) -> Iterator[Problem]:
    """Yield how much longer a mission is than its survey: the rest of the time enters its means."""
    scenario, area = setup.scenario, setup.area
    end, ruled = float(scenario.duration_s), [wing.asked.lanes for wing in setup.wings]
    if scenario.ends_with_survey or not any(ruled):
        return
    for wing, lanes in zip(setup.wings, ruled, strict=True):
        if lanes is not None:
            spacing, margin = lanes.lane_spacing_m, lanes.end_margin_m
            inside = area.square_m - (spacing if margin is None else 2 * margin) * area.across
            speed = sum(setup.auvs[auv].speed_m_per_s for auv in wing.members)
            if inside / spacing / speed > FAR_TOO_LONG * end:
                return  # known without planning, which takes time
    try:
        flown = float(setup.survey_end_s)
    except ValueError:
        return  # the survey's end is unknown, or too late
    if end - flown > IDLE_SHARE * end:
        rests = setup.auvs[0].recovery_m is not None
        does = "wait where they are recovered" if rests else "go there and back once more"
        yield Problem(
            "duration_s",
            f"is {timed(end)}, and the survey is flown after {timed(flown)}: in the other "
            f"{timed(end - flown)} AUVs {does}, and all means have that time in them; write "
            f"`duration_s: survey` to end with it",
            ("auvs.route",),
        )


def tired(setup: Setup) -> Iterator[Problem]:
    """Yield AUVs whose mission is longer than their endurance."""
    end, others = (
        float(setup.scenario.duration_s),
        ("duration_s", "auvs.route", "auvs.speed_m_per_s"),
    )
    for group in setup.groups:
        key, can = group.key("endurance_s"), group.endurance_s
        if can is None or end <= can:
            continue
        try:
            every = setup.flown_s if group.route.is_flown else ()
        except ValueError:
            every = ()
        flown = {auv: every[auv] for auv in group.members if every}
        late = [auv for auv, after in flown.items() if after > can]
        if late:
            longest = max(flown.values())
            yield Problem(
                key,
                f"is {timed(can)}, and {named('AUV', late)} through with the lanes after "
                f"{timed(longest)} at the latest: use more AUVs, lanes further apart, or more "
                "speed",
                others,
            )
        elif flown:
            yield Problem(
                key,
                f"is {timed(can)}, and the mission takes {timed(end)}; all lanes are flown after "
                f"{timed(max(flown.values()))}: write `duration_s: survey` to end with them",
                others,
            )
        else:
            yield Problem(key, f"is {timed(can)}, and the mission takes {timed(end)}", others)


def leaving(setup: Setup) -> Iterator[Problem]:
    """Yield AUVs whose paths leave a polygonal survey, for how long and how far."""
    area = setup.area
    if area.is_rectangle or not any(wing.asked.is_flown for wing in setup.wings):
        return
    import numpy as np
    import shapely  # which rectangles do not need

    try:
        plans = setup.plans_that_ship
    except ValueError:
        return  # reported as a mistake
    outside = dict[int, tuple[float, float]]()
    for auv, plan in enumerate(plans):
        if plan is None:
            continue
        count = min(math.ceil(plan.path.length), MOST_STEPS) + 1
        places = plan.path.sample(np.linspace(0.0, plan.path.length, count))[:, :2]
        beyond = shapely.distance(area.shape, shapely.points(places))
        # Turns at the ends of lanes reach beyond an edge by their radius at most.
        if beyond.max() > max(SHORTEST_GAP_M, setup.turning_radii_m[auv]):
            line = shapely.LineString(places)
            out = shapely.length(shapely.difference(line, area.shape))
            outside[auv] = float(out), float(beyond.max())
    if outside:
        is_left = any(wing.asked.lanes and wing.asked.lanes.inside is False for wing in setup.wings)
        lanes = "set auvs.route.inside to have lanes end at its edge, or " * is_left
        yield Problem(
            f"survey.{setup.scenario.survey.shapes[0]}",
            f"{named('AUV', list(outside))} outside the area for "
            f"{sum(length for length, _ in outside.values()):.4g} m of the way once through, up to "
            f"{max(far for _, far in outside.values()):.3g} m beyond its edge, as planned; "
            f"{lanes}widen auvs.route.end_margin_m to turn within it",
            ("auvs.route.lane_heading_deg", "auvs.route.end_margin_m", "auvs.route.lane_spacing_m"),
        )


# An altitude that is left by less than this share of it is kept.
KEPT_SHARE = 0.1


def low(setup: Setup) -> Iterator[Problem]:
    """Yield AUVs whose altitude the bottom is too steep for, by how much, and where."""
    for auv in setup.auvs:
        asked, hull = auv.group.altitude, auv.group.vehicle
        if asked.altitude_m is None:
            continue
        try:
            off, steepest, (x, y) = setup.altitude_left(auv)
        except ValueError:
            return  # reported as a mistake
        if off < KEPT_SHARE * asked.altitude_m:
            continue
        climbs, key = f"{math.degrees(math.atan(steepest)):.3g} deg", auv.group.key("depth")
        if hull.has_dynamics:
            yield Problem(
                f"{key}.altitude_m",
                f"is not kept by AUV{auv.number} where the bottom is steep: at "
                f"{auv.speed_m_per_s:g} m/s {hull} climbs by {climbs}, and it does not look ahead, "
                f"so that it may be some {off:.2g} m too low or too high about x {x:.0f} m, y "
                f"{y:.0f} m; ask for more, for another speed or vehicle, or plan lanes along the "
                "slope",
                (key, auv.group.key("speed_m_per_s")),
            )
        else:
            yield Problem(
                f"{key}.climb_angle_deg",
                f"leaves AUV{auv.number} up to {off:.3g} m higher than altitude_m, at x {x:.0f} m, "
                f"y {y:.0f} m: the bottom is steeper than {climbs}; allow a steeper climb, or plan "
                "lanes along the slope",
                (f"{key}.altitude_m",),
            )


def named(kind: str, numbers: Sequence[int]) -> str:
    """Return vehicles by their numbers, with the verb; of many the first few."""
    names = [f"{kind}{number}" for number in numbers[:MOST_NAMED]]
    if len(numbers) > MOST_NAMED:
        return f"{', '.join(names)} and {len(numbers) - MOST_NAMED} more are"
    return f"{', '.join(names)} {'is' if len(numbers) == 1 else 'are'}"


def tracks(setup: Setup) -> Iterator[Problem]:
    """Yield AUVs whose tracks begin late, end early, or leave the survey."""
    scenario = setup.scenario
    files = {
        auv: (wing, number)
        for wing in setup.wings if wing.asked.recording for number, auv in enumerate(wing.members)
    }  # fmt: skip
    if not files:
        return
    import numpy as np  # which other routes do not need

    area, duration = setup.area, scenario.duration_s
    instants = np.linspace(0.0, duration, LOOKS)
    keys = {auv: f"{wing.key}.files.{number}" for auv, (wing, number) in files.items()}
    late: dict[int, float] = {}
    early: dict[int, float] = {}
    away: dict[int, tuple[float, float]] = {}
    for auv, file in files.items():
        try:
            times, places = setup.auv_track(*file)
        except ValueError:
            continue  # reported as a mistake
        late[auv], early[auv] = max(times[0], 0.0), max(duration - times[-1], 0.0)
        ways = [np.interp(instants, times, places[:, axis]) for axis in (0, 1)]
        beyond = np.array([area.beyond(x, y) for x, y in zip(*ways, strict=True)])
        if beyond.max() > 0.0:
            away[auv] = float(beyond.max()), float(np.mean(beyond > 0.0))
    for what, when, still in (("begins late", "first", late), ("ends early", "last", early)):
        stood = {auv: time for auv, time in still.items() if time > 0.0}
        for auv, time in list(stood.items())[:MOST_NAMED]:
            yield Problem(
                keys[auv],
                f"the track of AUV{auv} {what}: it lies still for the {when} {time:.4g} s of "
                f"{duration:g} s ({100 * time / duration:.2g} %){_more(len(stood))}",
                ("duration_s", f"{files[auv][0].key}.time_offset_s"),
            )
    for auv, (excess, share) in list(away.items())[:MOST_NAMED]:
        yield Problem(
            keys[auv],
            f"the track of AUV{auv} leaves the survey of {area.words}, by up to {excess:.3g} m "
            f"and for {100 * share:.2g} % of the mission{_more(len(away))}; slots are made for "
            "sound that crosses the survey",
            tuple(shapes(scenario)),
        )


def ashore(setup: Setup) -> Iterator[Problem]:
    """Yield whose recorded tracks lead over land, or where nobody goes, and for how many metres."""
    if setup.closed is None:
        return
    recorded = setup.scenario.asvs.formation.recording
    told: Sequence[tuple[str, str, Callable[[], tuple[Floats, Floats]]]] = [
        (f"{wing.key}.files.{number}", f"AUV{auv}", partial(setup.auv_track, wing, number))
        for wing in setup.wings if wing.asked.recording for number, auv in enumerate(wing.members)
    ] + [
        (f"asvs.formation.files.{asv}", f"ASV{asv}", partial(setup.asv_track, asv))
        for asv in range(len(recorded.files) if recorded else 0)
    ]  # fmt: skip
    for key, who, track in told:
        try:
            over, begins = setup.closed.along(track()[1][:, :2])
        except ValueError:
            continue  # which is told as a mistake
        if over > 0.0:
            yield Problem(
                key,
                f"the track of {who} leads over land, or where nobody goes, for {over:.4g} m, at "
                f"first {begins:.4g} m after its start; are track and land in the same place?",
                ("survey.land", "survey.keep_out", "survey.area"),
            )


def _more(tracks: int) -> str:
    """Return in words how many of `tracks` are not named."""
    return f", as do {tracks - MOST_NAMED} more" if tracks > MOST_NAMED else ""
