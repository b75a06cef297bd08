"""Lines and marks in a viewer's scene, from places in the survey frame."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from foxglove.messages import (
    Color,
    CylinderPrimitive,
    LinePrimitive,
    LinePrimitiveLineType,
    Point3,
    Pose,
    Quaternion,
    SceneEntity,
    SceneUpdate,
    Vector3,
)
from numpy.typing import ArrayLike

from ..core.palette import COLOURS_ON_DARK
from ..geometry.geodesy import Floats, enu_from_ned, enu_yaw
from .messages import colour

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
