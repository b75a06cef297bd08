"""What a viewer shows from the start: survey, paths, vehicles and the ranges of the ASVs."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from foxglove.messages import ArrowPrimitive, Color, SpherePrimitive, TextPrimitive, Vector3

from ..core.palette import HF_ON_DARK, MF_ON_DARK, PLANNED_ON_DARK
from ..scenario.planned import horizontal_reach
from ..scenario.plans import planned_paths
from ..scenario.survey_area import area_of
from .drawing import auv_colour, line, ring, update, upright
from .messages import MAP, Message, Messages, colour, timestamp

if TYPE_CHECKING:
    from ..results.result import Result
    from ..scenario.scenario import Scenario

WHITE = "#FFFFFF"

# Points at which a planned path is drawn
PLAN_POINTS = 1000

# A vehicle is drawn this share of the survey's side long, so that it can be seen.
SHARE_OF_SIDE = 0.03

PATHS = {
    "truth": ("x_m", "y_m", "z_m"),
    "estimate": ("estimate_x_m", "estimate_y_m", "estimate_z_m"),
    "imu": ("imu_x_m", "imu_y_m", "estimate_z_m"),
}


def scenery(result: "Result") -> Messages:
    """Yield the scene at the start of a mission; it stays until its end."""
    scenario = result.scenario
    drawn = {
        "/scene/survey": [_survey(scenario)],
        "/scene/planned": list(_planned(scenario)),
        **{f"/scene/{kind}": list(_paths(result, kind)) for kind in PATHS},
        "/scene/vehicles": list(_vehicles(scenario)),
        "/scene/ranges": list(_ranges(scenario)),
    }
    for topic, entities in drawn.items():
        yield Message(0.0, topic, update(*entities))


def _entity(name: str, frame: str = MAP, **parts: Any) -> dict[str, Any]:
    start = timestamp(0.0)
    return {"timestamp": start, "frame_id": frame, "id": name, "frame_locked": True, **parts}


def _survey(scenario: "Scenario") -> dict[str, Any]:
    corners = [(x, y, 0.0) for x, y in area_of(scenario).outline]
    return _entity("survey", lines=[line(corners, colour(WHITE), closed=True)])


def _planned(scenario: "Scenario") -> Iterator[dict[str, Any]]:
    if scenario.auvs.route.kind not in ("lawnmower", "waypoints"):
        return
    for number, path in enumerate(planned_paths(scenario)):
        places = path.sample(np.linspace(0.0, path.length, PLAN_POINTS))[:, :2]
        depth = np.full(len(places), scenario.survey.depth(number))
        plan = line(np.column_stack([places, depth]), colour(PLANNED_ON_DARK), width=1.0)
        yield _entity(f"AUV{number}", lines=[plan])


def _paths(result: "Result", kind: str) -> Iterator[dict[str, Any]]:
    """Yield each AUV's path as it was, as it was believed, or as dead reckoning alone had it."""
    tracks = result.tables["tracks"]
    opacity = {"truth": 0.5, "estimate": 1.0, "imu": 0.4}[kind]
    width = {"truth": 4.0, "estimate": 1.5, "imu": 1.0}[kind]
    for number in range(result.scenario.auvs.count):
        name = f"AUV{number}"
        places = tracks.loc[tracks.vehicle == name, list(PATHS[kind])].to_numpy()
        yield _entity(name, lines=[line(places, auv_colour(name, opacity), width=width)])


def _vehicles(scenario: "Scenario") -> Iterator[dict[str, Any]]:
    """Yield a mark for each vehicle, and a paler one where an AUV believes to be."""
    length = SHARE_OF_SIDE * area_of(scenario).across
    for number in range(scenario.auvs.count):
        name = f"AUV{number}"
        yield _entity(name, name, arrows=[_hull(length, auv_colour(name))], texts=[_label(name)])
        ghost = _hull(length, auv_colour(name, 0.4))
        yield _entity(f"{name}/estimate", f"{name}/estimate", arrows=[ghost])
    for number in range(scenario.asvs.count):
        name = f"ASV{number}"
        size = Vector3(x=length / 2, y=length / 2, z=length / 2)
        buoy = SpherePrimitive(pose=upright(), size=size, color=colour(WHITE))
        yield _entity(name, name, spheres=[buoy], texts=[_label(name)])


def _hull(length: float, code: Color) -> ArrowPrimitive:
    return ArrowPrimitive(
        pose=upright(),
        shaft_length=0.6 * length,
        shaft_diameter=0.25 * length,
        head_length=0.4 * length,
        head_diameter=0.4 * length,
        color=code,
    )


def _label(name: str) -> TextPrimitive:
    return TextPrimitive(
        pose=upright(),
        billboard=True,
        font_size=12.0,
        scale_invariant=True,
        color=colour(WHITE),
        text=name,
    )


def _ranges(scenario: "Scenario") -> Iterator[dict[str, Any]]:
    """Yield the HF (as it reaches the survey's depth) and MF range of each ASV; they go with it."""
    hf, mf = horizontal_reach(scenario), scenario.acoustics.mf.range_m
    for number in range(scenario.asvs.count):
        name = f"ASV{number}"
        circles = [ring(hf, colour(HF_ON_DARK)), ring(mf, colour(MF_ON_DARK, 0.6))]
        yield _entity(name, name, lines=circles)
