"""What a viewer draws: survey, paths, vehicles and the ranges of the ASVs from the start, then
tracks and the ellipse of each estimate.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import groupby
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np
from foxglove.messages import (
    ArrowPrimitive,
    Color,
    CylinderPrimitive,
    LinePrimitive,
    LinePrimitiveLineType,
    Point3,
    Pose,
    Quaternion,
    SceneEntity,
    SceneUpdate,
    SpherePrimitive,
    TextPrimitive,
    Vector3,
)
from numpy.typing import ArrayLike

from ...core.geometry.geodesy import enu_from_ned, enu_yaw
from ...core.setup import Setup
from ...support.arrays import Floats
from ...support.palette import (
    ALARM_ON_DARK,
    COLOURS_ON_DARK,
    HF_ON_DARK,
    MF_ON_DARK,
    PLANNED_ON_DARK,
    SHORE_ON_DARK,
)
from .messages import FRAMES, MAP, Messages, ViewerMessage, colour, rows_in_time, timestamp

if TYPE_CHECKING:
    from ...core.results.result import Result


# Sides of the polygon that stands for a circle or an ellipse
CIRCLE_POINTS = 72
ELLIPSE_POINTS = 32

# A disc needs some thickness to be drawn.
DISC_THICKNESS_M = 0.01

# 95 % of a normal distribution in the plane: sqrt(-2 ln 0.05) standard deviations
ELLIPSE_SCALE = math.sqrt(-2 * math.log(0.05))


def auv_colour(name: str, opacity: float = 1.0) -> Color:
    """Return the colour of an AUV, as a report has it on its dark ground: so is a viewer's."""
    number = int(name.removeprefix("AUV")) % len(COLOURS_ON_DARK)
    return colour(COLOURS_ON_DARK[number], opacity)


def points(places: ArrayLike) -> list[Point3]:
    """Return places, shape (n, 3) in the survey frame (NED, m), as points of the map (ENU)."""
    return [Point3(x=x, y=y, z=z) for x, y, z in enu_from_ned(places).tolist()]


def upright(place: ArrayLike = (0.0, 0.0, 0.0), turned: float = 0.0) -> Pose:
    """Return the pose of a mark at a place (NED, m), along the axes of the frame it is drawn in.

    Or `turned` from its x towards its y (rad).
    """
    x, y, z = enu_from_ned(place).tolist()
    turn = Quaternion(z=math.sin(turned / 2), w=math.cos(turned / 2))
    return Pose(position=Vector3(x=x, y=y, z=z), orientation=turn)


def line(
    places: ArrayLike, code: Color, *, width: float = 2.0, closed: bool = False
) -> LinePrimitive:
    """Return a line through places of the survey, `width` pixels wide."""
    kind = LinePrimitiveLineType.LineLoop if closed else LinePrimitiveLineType.LineStrip
    return LinePrimitive(
        type=kind,
        pose=upright(),
        thickness=width,
        scale_invariant=True,
        points=points(places),
        color=code,
    )


def rays(start: ArrayLike, ends: Sequence[ArrayLike], codes: Sequence[Color]) -> LinePrimitive:
    """Return straight lines from one place to others, each in its colour."""
    return LinePrimitive(
        type=LinePrimitiveLineType.LineList,
        pose=upright(),
        thickness=2.0,
        scale_invariant=True,
        points=points(np.reshape([[start, end] for end in ends], (-1, 3))),
        colors=[code for code in codes for _ in range(2)],
    )


def ring(radius: float, code: Color, *, width: float = 1.0) -> LinePrimitive:
    """Return a horizontal circle (m) about the origin of the frame it is drawn in."""
    return line(_unit_circle(CIRCLE_POINTS) * radius, code, width=width, closed=True)


def ellipse(centre: ArrayLike, covariance: Floats, scale: float) -> Floats:
    """Return the horizontal ellipse at `scale` standard deviations about a place, shape (n, 3).

    >>> around = ellipse([0.0, 0.0, 10.0], np.diag([4.0, 1.0, 0.0]), 2.0)
    >>> np.abs(around).max(axis=0).round(9).tolist()
    [4.0, 2.0, 10.0]
    """
    values, axes = np.linalg.eigh(covariance[:2, :2])
    circle = _unit_circle(ELLIPSE_POINTS)
    circle[:, :2] = scale * (circle[:, :2] * np.sqrt(np.maximum(values, 0.0))) @ axes.T
    return np.asarray(centre, dtype=np.float64) + circle


def disc(centre: ArrayLike, covariance: Floats, scale: float, code: Color) -> CylinderPrimitive:
    """Return the horizontal ellipse of :func:`ellipse` as one filled mark, for what is drawn often.

    A line of so many points would take ten times the room.
    """
    values, axes = np.linalg.eigh(covariance[:2, :2])
    length, width = 2 * scale * np.sqrt(np.maximum(values, 0.0))
    first = enu_yaw(math.atan2(axes[1, 0], axes[0, 0]))
    return CylinderPrimitive(
        pose=upright(centre, first),
        size=Vector3(x=length, y=width, z=DISC_THICKNESS_M),
        bottom_scale=1.0,
        top_scale=1.0,
        color=code,
    )


def update(*entities: dict[str, Any]) -> SceneUpdate:
    """Return one change of the scene: each entity is drawn, or replaces the one of its id."""
    return SceneUpdate(entities=[SceneEntity(**entity) for entity in entities])


def _unit_circle(count: int) -> Floats:
    angles = np.arange(count) * (2 * np.pi / count)
    return np.column_stack([np.cos(angles), np.sin(angles), np.zeros(count)])


OPACITY = 0.3

SPREAD = ("estimate_sd_x_m", "estimate_sd_y_m", "estimate_cov_xy_m2")


def certainty(result: "Result") -> Messages:
    """Yield, for each instant of `tracks`, the ellipses that hold AUVs with 95 %, at their depths.

    Each replaces that of the instant before.  There are none while no AUV is ever unsure.
    """
    tracks = result.arrow["tracks"]
    if not any(tracks[name].drop_null().to_numpy().any() for name in SPREAD):
        return
    rows = (row for row in rows_in_time(tracks, "time_s") if row[SPREAD[0]] is not None)
    for at_s, together in groupby(rows, key=itemgetter("time_s")):
        drawn = [_around(row) for row in together]
        yield ViewerMessage(at_s, "/scene/certainty", update(*drawn))


def _around(row: Mapping[str, Any]) -> dict[str, Any]:
    sd_x, sd_y, xy = (row[name] for name in SPREAD)
    place = [row[name] for name in FRAMES["{}/estimate"]]
    name, covariance = row["vehicle"], np.array([[sd_x**2, xy], [xy, sd_y**2]])
    return {
        "timestamp": timestamp(row["time_s"]),
        "frame_id": MAP,
        "id": name,
        "cylinders": [disc(place, covariance, ELLIPSE_SCALE, auv_colour(name, OPACITY))],
    }


WHITE = "#FFFFFF"

# Points at which a planned path is drawn
PLAN_POINTS = 1000

# A vehicle is drawn this share of the survey's side long, so that it can be seen.
SHARE_OF_SIDE = 0.03

# Columns of each kind of path
PATHS = dict(zip(("truth", "estimate", "imu"), FRAMES.values(), strict=True))


def scenery(result: "Result") -> Messages:
    """Yield the scene at the start of a mission; it stays until its end."""
    setup = result.setup
    # made one after another as they are written: paths of a day have many points
    drawn: dict[str, Iterable[dict[str, Any]]] = {
        "/scene/survey": [_survey(setup)],
        "/scene/planned": _planned(setup),
        **{f"/scene/{kind}": _paths(result, kind) for kind in PATHS},
        "/scene/vehicles": _vehicles(setup),
        "/scene/ranges": _ranges(setup),
    }
    for topic, entities in drawn.items():
        yield ViewerMessage(0.0, topic, update(*entities))


def _entity(name: str, frame: str = MAP, **parts: Any) -> dict[str, Any]:
    start = timestamp(0.0)
    return {"timestamp": start, "frame_id": frame, "id": name, "frame_locked": True, **parts}


def _survey(setup: Setup) -> dict[str, Any]:
    """Return the outline of the survey, of land, and of water where nobody goes."""
    closed = ((setup.land, SHORE_ON_DARK), (setup.keep_out, ALARM_ON_DARK))
    rings = [(setup.area.outline, WHITE)]
    for what, code in closed:
        rings += [(ring, code) for polygon in what.outlines for ring in polygon] if what else []
    lines = [line([(*at, 0.0) for at in ring], colour(code), closed=True) for ring, code in rings]
    return _entity("survey", lines=lines)


def _planned(setup: Setup) -> Iterator[dict[str, Any]]:
    for (number, *_, depth_m, _, _), plan in zip(setup.auvs, setup.plans_that_ship, strict=True):
        if plan is None:
            continue
        path = plan.path
        places = path.sample(np.linspace(0.0, path.length, PLAN_POINTS))[:, :2]
        depth = np.full(len(places), depth_m)
        drawn = line(np.column_stack([places, depth]), colour(PLANNED_ON_DARK), width=1.0)
        yield _entity(f"AUV{number}", lines=[drawn])


def _paths(result: "Result", kind: str) -> Iterator[dict[str, Any]]:
    """Yield each AUV's path as it was, as it was believed, or as dead reckoning alone had it."""
    tracks = result.tables["tracks"]
    opacity = {"truth": 0.5, "estimate": 1.0, "imu": 0.4}[kind]
    width = {"truth": 4.0, "estimate": 1.5, "imu": 1.0}[kind]
    for number in range(result.scenario.auvs.count):
        name = f"AUV{number}"
        places = tracks.loc[tracks.vehicle == name, list(PATHS[kind])].to_numpy()
        yield _entity(name, lines=[line(places, auv_colour(name, opacity), width=width)])


def _vehicles(setup: Setup) -> Iterator[dict[str, Any]]:
    """Yield a mark for each vehicle, and a paler one where an AUV believes to be."""
    scenario = setup.scenario
    length = SHARE_OF_SIDE * setup.area.across
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


def _ranges(setup: Setup) -> Iterator[dict[str, Any]]:
    """Yield how far HF and MF of each ASV reach at the survey's depth; the rings go with it."""
    hf, mf = setup.horizontal_reach_m, setup.horizontal_mf_reach_m
    for number in range(setup.scenario.asvs.count):
        name = f"ASV{number}"
        circles = [ring(hf, colour(HF_ON_DARK)), ring(mf, colour(MF_ON_DARK, 0.6))]
        yield _entity(name, name, lines=circles)
