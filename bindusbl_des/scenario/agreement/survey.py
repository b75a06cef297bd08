"""What the keys of a survey must agree on: one shape, lanes that fit it, an item for each AUV."""

from collections.abc import Iterator

from ...geometry.lanes import lane_count
from ..scenario_keys import ScenarioKeys
from ..sections.routes import Lawnmower
from ..sections.survey import SHAPES
from ..survey_area import area_of, lanes_heading
from .problem import Problem

MOST_LANES = 100_000

# Shorter lanes and ways (m) are no lanes: a vehicle cannot be said to go along them.
SHORTEST_WAY = 0.001


def problems(scenario: ScenarioKeys) -> Iterator[Problem]:
    """Yield why a survey cannot be flown as asked for."""
    shape = list(_shape(scenario))
    yield from shape
    yield from _fleet(scenario)
    if not shape:
        yield from _lanes(scenario)


def _shape(scenario: ScenarioKeys) -> Iterator[Problem]:
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
        ("auvs.ping_late_s", auvs.ping_late_s, "time"),
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
            "auvs.vehicle.turning_radius_m",
            f"a turn of {auvs.turning_radius_m:g} m radius does not fit a survey of {area.told}; "
            f"use at most {area.across / 2:g}",
            (shape, "auvs.vehicle", "auvs.route.kind"),
        )
